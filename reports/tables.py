"""The tables of a run, made from its journal scenario by scenario; what has been compared is not compared again."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from reports.archive import Archive, stored_scene, trajectory_file
from reports.cells import scene_hash, versions
from reports.comparison import Comparison, answered, compare
from reports.journal import JOURNAL
from reports.scenes import open_scene
from scenarios.catalogue import SCENARIOS
from scenarios.model import Scenario

JUDGES = (
    "comparison",
    "metrics",
    "view",
    "laws",
    "collisions",
    "violations",
    "scales",
)  # files by which runs are compared
NUMBERS = ("dt_s", "value", "at_s")  # columns of deviations.csv in which nothing means NaN


class Tables(NamedTuple):
    """What was made.

    Attributes:
        runs: runs.csv.
        chunks: scene -> where its share of deviations.csv is.
        damaged: scene -> its comparison, where a file of a trajectory is gone or torn: no share of it is kept.
    """

    runs: pd.DataFrame
    chunks: dict[str, Path]
    damaged: dict[str, Comparison]


def make_tables(archive: Archive, say: Callable[[str], None]) -> Tables:
    """Write deviations.csv and runs.csv; what was compared before and has not changed is not compared again.

    Raises:
        ValueError: no cell has ended, or a scene is not the one that was played.
    """
    by_scene = ordered(archive)
    if not by_scene:
        raise ValueError(f"{archive.folder / JOURNAL}: no cell has ended yet, so there is nothing to report")
    (archive.folder / "compared").mkdir(exist_ok=True)
    chunks, damaged = {}, {}
    for scene, records in by_scene.items():
        chunks[scene] = chunk_of(archive, records)
        if not chunks[scene].exists():
            say(f"comparing {records[0]['scenario']}")
            comparison = compare(scenario_of(archive, scene, records), [archive.run(record) for record in records])
            if any(run.status != record["status"] for run, record in zip(comparison.runs, records)):
                damaged[scene] = comparison
            else:
                comparison.table.to_csv(chunks[scene], index=False)
    say("writing the tables")
    write_deviations(archive.folder / "deviations.csv", chunks, damaged)
    runs = table_of_runs([record for records in by_scene.values() for record in records], archive, damaged)
    runs.to_csv(archive.folder / "runs.csv", index=False)
    return Tables(runs, chunks, damaged)


def comparisons_of(archive: Archive, tables: Tables) -> list[Comparison]:
    """The comparisons in reading order; only the runs at the middle dt hold their trajectories: no other is drawn."""
    comparisons = []
    for scene, records in ordered(archive).items():
        if scene in tables.damaged:
            comparisons.append(tables.damaged[scene])
            continue
        scenario, truth = answered(scenario_of(archive, scene, records))
        middle = scenario.substeps[len(scenario.substeps) // 2]
        runs = [archive.run(record, with_trajectory=record["substeps"] == middle) for record in records]
        comparisons.append(Comparison(scenario, truth, runs, read_chunk(tables.chunks[scene])))
    return comparisons


def ordered(archive: Archive) -> dict[str, list[dict[str, Any]]]:
    """Scene -> the lines of its cells, in the order of scenes and engines that was asked for, coarse dt first."""
    players = archive.header["engines"]
    by_scene: dict[str, list[dict[str, Any]]] = {scene: [] for scene in archive.header["scenes"]}
    for record in sorted(archive.records, key=lambda record: (players.index(name_of(record)), record["substeps"])):
        by_scene[record["scene"]].append(record)
    return {scene: records for scene, records in by_scene.items() if records}


def name_of(record: dict[str, Any]) -> str:
    """`engine:profile`."""
    return f"{record['engine']}:{record['profile']}"


def scenario_of(archive: Archive, scene: str, records: Sequence[dict[str, Any]]) -> Scenario:
    """What was played, with the steps that were played; raises `ValueError` if the scene is another one now."""
    stored = stored_scene(archive.folder, records[0]["scenario"])
    scenario = open_scene(scene if scene in SCENARIOS else str(stored), records[0]["seed"])
    if {record["scene_hash"] for record in records} != {scene_hash(scenario)}:
        raise ValueError(
            f"{scenario.name} is not the scene any more that was played; crosscheck run --resume plays it again"
        )
    return replace(scenario, substeps=tuple(sorted({record["substeps"] for record in records})))


def chunk_of(archive: Archive, records: Sequence[dict[str, Any]]) -> Path:
    """Where the table of a scenario is kept: named by all that decides it, the judge's source and the files too."""
    sizes = []
    for record in records:
        path = trajectory_file(archive.folder, record["cell"])
        sizes.append((record["cell"], record["status"], record["reason"], path.stat().st_size if path.exists() else -1))
    digest = hashlib.sha256(repr((sizes, judge())).encode()).hexdigest()[:16]
    return archive.folder / "compared" / f"{records[0]['scenario']}-{digest}.csv"


@cache
def judge() -> str:
    """A hash over the source and versions by which runs are compared, so that a changed metric is measured again."""
    root = Path(__file__).parent.parent
    files = [root / "reports" / f"{name}.py" for name in JUDGES] + sorted((root / "scenarios").glob("*.py"))
    source = b"".join(path.read_bytes() for path in files)
    return hashlib.sha256(source + repr((versions(), pd.__version__)).encode()).hexdigest()


def read_chunk(path: Path) -> pd.DataFrame:
    """The table, bit for bit as it was written."""
    empty = {column: [""] for column in NUMBERS}
    return pd.read_csv(path, keep_default_na=False, na_values=empty)


def write_deviations(path: Path, chunks: Mapping[str, Path], damaged: Mapping[str, Comparison]) -> None:
    """Put the scenes' shares one after the other, and delete those that are of something else."""
    with path.open("wb") as whole:
        for number, (scene, chunk) in enumerate(chunks.items()):
            if scene in damaged:
                whole.write(damaged[scene].table.to_csv(index=False, header=not number).encode())
                continue
            with chunk.open("rb") as part:
                if number:
                    part.readline()  # the names of the columns
                shutil.copyfileobj(part, whole)
    for other in set((path.parent / "compared").iterdir()) - set(chunks.values()):
        other.unlink()


def table_of_runs(
    records: Sequence[dict[str, Any]], archive: Archive, damaged: Mapping[str, Comparison]
) -> pd.DataFrame:
    """A row a cell: what was played, how it ended, how long the engine took, with which settings and versions."""
    found = {
        (run.scenario, run.name, run.dt): {"status": run.status, "reason": run.reason}
        for comparison in damaged.values()
        for run in comparison.runs
    }
    columns = [
        "scenario", "engine", "profile", "dt_s", "seed", "status", "reason", "step", "until_s", "seconds", "cell",
    ]  # fmt: skip
    rows = [
        {name: record[name] for name in columns}
        | found.get((record["scenario"], name_of(record), record["dt_s"]), {})
        | {
            "until_s": float(record["until_s"]),
            "seconds_alone": min(archive.timings.get(record["cell"], [float("nan")])),
            "settings": "; ".join(f"{name}={resolved}" for name, (_, resolved) in record["settings"].items()),
            "versions": "; ".join(f"{name} {version}" for name, version in record["versions"].items()),
        }
        for record in records
    ]
    return pd.DataFrame(rows, columns=[*columns, "seconds_alone", "settings", "versions"])
