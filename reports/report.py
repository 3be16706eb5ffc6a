"""Tables and page of a run, made from its journal; nothing is played."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from adapters.engines import ENGINES
from adapters.play import Run
from reports.archive import Archive
from reports.cells import open_scene
from reports.comparison import Comparison, compare
from reports.findings import findings
from reports.known_answers import MEANING
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
    deviations = pd.concat([comparison.table for comparison in comparisons], ignore_index=True)
    runs = table_of_runs([record for comparison in by_scene.values() for record in comparison], header["scenes"])
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
        about=header | {"seconds": footer[0]["seconds"] if footer else float("nan"), "known_answers_text": MEANING},
    )
    return Report(header, comparisons, deviations, runs, sentences, untrusted)


def compare_scene(archive: Archive, scene: str, records: list[dict[str, Any]]) -> Comparison:
    """One scenario's comparison, its runs in the order of engines, coarse dt first."""
    stored = archive.folder / "scenes" / f"{records[0]['scenario']}.toml"
    scenario = open_scene(scene if scene in SCENARIOS else str(stored), records[0]["seed"])
    ladder = tuple(sorted({record["substeps"] for record in records}))
    ordered = sorted(records, key=lambda record: (place_in_table(record), record["substeps"]))
    runs: list[Run] = [archive.run(record) for record in ordered]
    return compare(replace(scenario, substeps=ladder), runs)


def place_in_table(row: dict[str, Any]) -> int:
    """Where the engine of a row stands in `ENGINES`."""
    return list(ENGINES).index(f"{row['engine']}:{row['profile']}")


def table_of_runs(records: list[dict[str, Any]], scenes: list[str]) -> pd.DataFrame:
    """A row a cell: what was played, how it ended, how long the engine took, with which settings and versions."""
    columns = ["scenario", "engine", "profile", "dt_s", "seed", "status", "reason", "seconds", "cell"]
    ordered = sorted(
        records, key=lambda record: (scenes.index(record["scene"]), place_in_table(record), record["substeps"])
    )
    rows = [
        {name: record[name] for name in columns}
        | {
            "settings": "; ".join(f"{name}={resolved}" for name, (_, resolved) in record["settings"].items()),
            "versions": "; ".join(f"{name} {version}" for name, version in record["versions"].items()),
        }
        for record in ordered
    ]
    return pd.DataFrame(rows, columns=[*columns, "settings", "versions"])
