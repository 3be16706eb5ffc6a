"""Tables and page of a run, made from its journal; nothing is played."""

from __future__ import annotations

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
    """What came out of a run: the header, a comparison a scenario, both tables, the sentences on top."""

    header: dict[str, Any]
    comparisons: list[Comparison]
    deviations: pd.DataFrame
    runs: pd.DataFrame
    findings: list[str]


def make_report(folder: Path) -> Report:
    """Read the journal of `folder`, write deviations.csv, runs.csv and report.html into it."""
    archive = Archive(folder)
    header, records = archive.header(), archive.records()
    by_scene: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        by_scene.setdefault(record["scene"], []).append(record)
    comparisons = [compare_scene(archive, scene, by_scene[scene]) for scene in header["scenes"] if scene in by_scene]
    deviations = pd.concat([comparison.table for comparison in comparisons], ignore_index=True)
    runs = table_of_runs([record for comparison in by_scene.values() for record in comparison], header["scenes"])
    deviations.to_csv(folder / "deviations.csv", index=False)
    runs.to_csv(folder / "runs.csv", index=False)
    sentences = findings(comparisons)
    footer = next((line["footer"] for line in archive.lines() if "footer" in line), {"seconds": None})
    write_page(
        folder / "report.html",
        comparisons,
        findings=sentences,
        conformance=pd.DataFrame(archive.rows("conformance")),
        known_answers=pd.DataFrame(archive.rows("known_answers")),
        about=header | {"seconds": footer["seconds"], "known_answers_text": MEANING},
    )
    return Report(header, comparisons, deviations, runs, sentences)


def compare_scene(archive: Archive, scene: str, records: list[dict[str, Any]]) -> Comparison:
    """One scenario's comparison, its runs in the order of engines, coarse dt first."""
    stored = archive.folder / "scenes" / f"{records[0]['scenario']}.toml"
    scenario = open_scene(scene if scene in SCENARIOS else str(stored), records[0]["seed"])
    ladder = tuple(sorted({record["substeps"] for record in records}))
    ordered = sorted(records, key=place_in_table)
    runs: list[Run] = [archive.run(record) for record in ordered]
    return compare(replace(scenario, substeps=ladder), runs)


def place_in_table(record: dict[str, Any]) -> tuple[int, int]:
    """Where a cell stands among those of its scenario."""
    return list(ENGINES).index(f"{record['engine']}:{record['profile']}"), record["substeps"]


def table_of_runs(records: list[dict[str, Any]], scenes: list[str]) -> pd.DataFrame:
    """A row a cell: what was played, how it ended, how long the engine took, with which settings and versions."""
    columns = ["scenario", "engine", "profile", "dt_s", "seed", "status", "reason", "seconds", "cell"]
    ordered = sorted(records, key=lambda record: (scenes.index(record["scene"]), *place_in_table(record)))
    rows = [
        {name: record[name] for name in columns}
        | {
            "settings": "; ".join(f"{name}={resolved}" for name, (_, resolved) in record["settings"].items()),
            "versions": "; ".join(f"{name} {version}" for name, version in record["versions"].items()),
        }
        for record in ordered
    ]
    return pd.DataFrame(rows, columns=[*columns, "settings", "versions"])
