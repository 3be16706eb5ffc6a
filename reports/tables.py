"""The tables of a run, made from its journal scenario by scenario; what has been compared is not compared again."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Hashable, Mapping, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from reports.archive import Archive, run_of
from reports.comparison import Comparison, answered
from reports.journal import JOURNAL
from reports.runner import run_all
from reports.shares import (
    Records,
    compared,
    in_order,
    keep_share,
    name_of,
    path_of,
    read_share,
    scenario_of,
    share_of,
)
from reports.worker_process import Failure


class NotCompared(Exception):
    """The runs of a scene could not be set against its truth and each other, and why."""


class Tables(NamedTuple):
    """What was made.

    Attributes:
        runs: runs.csv.
        shares: scene -> where its share of deviations.csv is.
        damaged: scene -> its comparison, where a file of a trajectory is gone or torn: no share of it is kept.
    """

    runs: pd.DataFrame
    shares: dict[str, Path]
    damaged: dict[str, Comparison]


def make_tables(archive: Archive, say: Callable[[str], None]) -> Tables:
    """Write deviations.csv and runs.csv; what was compared before and has not changed is not compared again.

    Raises:
        ValueError: no cell has ended, or a scene is not the one that was played.
        NotCompared: naming the scene and what was raised.
    """
    by_scene = ordered(archive)
    if not by_scene:
        raise ValueError(f"{archive.folder / JOURNAL}: no cell has ended yet, so there is nothing to report")
    shares = {scene: path_of(archive.folder, records) for scene, records in by_scene.items()}
    damaged = compare_missing(archive.folder, by_scene, shares, say)
    say("writing the tables")
    write_deviations(archive.folder / "deviations.csv", shares, damaged)
    runs = table_of_runs([record for records in by_scene.values() for record in records], archive, damaged)
    runs.to_csv(archive.folder / "runs.csv", index=False)
    return Tables(runs, shares, damaged)


def compare_missing(
    folder: Path, by_scene: Mapping[str, Records], shares: Mapping[str, Path], say: Callable[[str], None]
) -> dict[str, Comparison]:
    """Make the shares that are not kept, in worker processes; returns the comparisons of which none may be kept."""
    (folder / "compared").mkdir(exist_ok=True)
    missing = {scene: path for scene, path in shares.items() if not path.exists()}
    for scene in missing:
        scenario_of(folder, by_scene[scene])  # a scene that is another one now is found here
    tasks: dict[Hashable, Any] = {scene: partial(share_of, folder, by_scene[scene]) for scene in missing}
    damaged = {}
    with closing(run_all(tasks, os.cpu_count() or 1)) as results:
        for number, (scene, share) in enumerate(results, 1):
            name = by_scene[scene][0]["scenario"]
            say(f"comparing: {name}, {number} of {len(tasks)}")
            if isinstance(share, Failure):
                raise NotCompared(f"{name} could not be compared: {share.reason}")
            if share:
                keep_share(missing[scene], share)
            else:
                damaged[scene] = compared(folder, by_scene[scene])
    return damaged


def comparisons_of(archive: Archive, tables: Tables) -> list[Comparison]:
    """The comparisons in reading order; only the runs at the middle dt hold their trajectories: no other is drawn."""
    comparisons = []
    for scene, records in ordered(archive).items():
        if scene in tables.damaged:
            comparisons.append(tables.damaged[scene])
            continue
        scenario, truth = answered(scenario_of(archive.folder, records))
        middle = scenario.substeps[len(scenario.substeps) // 2]
        runs = [run_of(archive.folder, record, with_trajectory=record["substeps"] == middle) for record in records]
        comparisons.append(Comparison(scenario, truth, runs, read_share(tables.shares[scene])))
    return comparisons


def ordered(archive: Archive) -> dict[str, list[dict[str, Any]]]:
    """Scene -> the lines of its cells, in the order of scenes and engines that was asked for, coarse dt first."""
    by_scene: dict[str, list[dict[str, Any]]] = {scene: [] for scene in archive.header["scenes"]}
    for record in archive.records:
        by_scene[record["scene"]].append(record)
    players = archive.header["engines"]
    return {scene: in_order(records, players) for scene, records in by_scene.items() if records}


def write_deviations(path: Path, shares: Mapping[str, Path], damaged: Mapping[str, Comparison]) -> None:
    """Put the scenes' shares one after the other, and delete those that are of something else."""
    with path.open("wb") as whole:
        for number, (scene, share) in enumerate(shares.items()):
            if scene in damaged:
                whole.write(damaged[scene].table.to_csv(index=False, header=not number).encode())
                continue
            with share.open("rb") as part:
                if number:
                    part.readline()  # the names of the columns
                shutil.copyfileobj(part, whole)
    for other in set((path.parent / "compared").iterdir()) - set(shares.values()):
        other.unlink()


def settled(name: str, pair: Sequence[Any]) -> str:
    """A setting, what was asked for, and what the engine then has, as runs.csv has it."""
    asked, used = pair
    return f"{name}: asked {'default' if asked is None else asked}, used {used}"


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
            "settings": "; ".join(map(settled, record["settings"], record["settings"].values())),
            "versions": "; ".join(f"{name} {version}" for name, version in record["versions"].items()),
        }
        for record in records
    ]
    return pd.DataFrame(rows, columns=[*columns, "seconds_alone", "settings", "versions"])
