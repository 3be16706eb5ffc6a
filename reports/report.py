"""Tables and page of a run, made from its journal; nothing is played."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from adapters.engines import ENGINES, OWN
from adapters.play import Run
from reports.archive import Archive
from reports.cells import open_scene, scene_hash
from reports.comparison import Comparison, compare
from reports.findings import findings
from reports.page import write_page
from scenarios.catalogue import SCENARIOS


@dataclass(frozen=True, eq=False)
class Report:
    """What came out of a run.

    Attributes:
        header: command, seed, machine and versions.
        comparisons: one a scenario, in reading order.
        deviations, runs: the two tables.
        findings: the sentences on top.
        untrusted: the players that broke the protocol: their rows are kept, but nothing is concluded from them.
    """

    header: dict[str, Any]
    comparisons: list[Comparison]
    deviations: pd.DataFrame
    runs: pd.DataFrame
    findings: list[str]
    untrusted: set[str]


def make_report(folder: Path, say: Callable[[str], None]) -> Report:
    """From the journal of `folder` write deviations.csv, runs.csv and report.html; `say` hears what is being done."""
    archive = Archive(folder)
    header, records = archive.header(), archive.records()
    by_scene: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        by_scene.setdefault(record["scene"], []).append(record)
    comparisons = []
    for scene in header["scenes"]:
        if scene in by_scene:
            say(f"comparing {by_scene[scene][0]['scenario']}")
            comparisons.append(compare_scene(archive, scene, by_scene[scene]))
    say("writing tables and page")
    if not comparisons:
        raise ValueError(f"{archive.journal}: no cell has ended yet, so there is nothing to report")
    deviations = pd.concat([comparison.table for comparison in comparisons], ignore_index=True)
    statuses = {(r.scenario, r.name, r.dt): (r.status, r.reason) for one in comparisons for r in one.runs}
    runs = table_of_runs([record for records in by_scene.values() for record in records], header["scenes"], statuses)
    deviations.to_csv(folder / "deviations.csv", index=False)
    runs.to_csv(folder / "runs.csv", index=False)
    asked = sorted(archive.parts("conformance"), key=lambda rows: place_in_table(rows[0]))
    known = sorted(archive.parts("known_answer"), key=lambda row: (row["column"], row["dt_s"]), reverse=True)
    footer = archive.parts("footer")
    untrusted = {f"{row['engine']}:{row['profile']}" for rows in asked for row in rows if row["verdict"] == "breaks"}
    sentences = findings(comparisons, untrusted)
    write_page(
        folder / "report.html",
        comparisons,
        findings=sentences,
        untrusted=untrusted,
        conformance=pd.DataFrame([row for rows in asked for row in rows]),
        known_answers=pd.DataFrame(known),
        about=header | {"seconds": footer[0]["seconds"] if footer else float("nan")},
    )
    return Report(header, comparisons, deviations, runs, sentences, untrusted)


def compare_scene(archive: Archive, scene: str, records: list[dict[str, Any]]) -> Comparison:
    """One scenario's comparison, its runs in the order of engines, coarse dt first."""
    stored = archive.folder / "scenes" / f"{records[0]['scenario']}.toml"
    scenario = open_scene(scene if scene in SCENARIOS else str(stored), records[0]["seed"])
    if {record["scene_hash"] for record in records} != {scene_hash(scenario)}:
        raise ValueError(f"{scenario.name} is not the scene any more that was played; play it again")
    ladder = tuple(sorted({record["substeps"] for record in records}))
    ordered = sorted(records, key=lambda record: (place_in_table(record), record["substeps"]))
    runs: list[Run] = [archive.run(record) for record in ordered]
    return compare(replace(scenario, substeps=ladder), runs)


def _name(row: dict[str, Any]) -> str:
    return f"{row['engine']}:{row['profile']}"


def place_in_table(row: dict[str, Any]) -> int:
    """Where the engine of a row stands in `ENGINES`; somebody's own solver after them."""
    name = _name(row)
    if name.endswith(OWN):
        return len(ENGINES)
    if name not in ENGINES:
        raise ValueError(f"{name} was played, but is no engine of this version")
    return list(ENGINES).index(name)


def table_of_runs(
    records: list[dict[str, Any]], scenes: list[str], statuses: dict[tuple[str, str, float], tuple[str, str]]
) -> pd.DataFrame:
    """A row a cell: what was played, how it ended, how long the engine took, with which settings and versions.

    `statuses`: (scenario, `engine:profile`, dt) -> (status, reason) as found now, e.g. of a file that is gone.
    """
    columns = ["scenario", "engine", "profile", "dt_s", "seed", "status", "reason", "seconds", "cell"]
    ordered = sorted(
        records, key=lambda record: (scenes.index(record["scene"]), place_in_table(record), record["substeps"])
    )
    rows = [
        {name: record[name] for name in columns}
        | dict(zip(("status", "reason"), statuses[record["scenario"], _name(record), record["dt_s"]]))
        | {
            "settings": "; ".join(f"{name}={resolved}" for name, (_, resolved) in record["settings"].items()),
            "versions": "; ".join(f"{name} {version}" for name, version in record["versions"].items()),
        }
        for record in ordered
    ]
    return pd.DataFrame(rows, columns=[*columns, "settings", "versions"])
