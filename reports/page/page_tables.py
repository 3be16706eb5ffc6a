"""The tables of the report over all scenarios: medians, errors, probes, settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from adapters.matched import searched
from reports.compare.comparison import Comparison
from reports.compare.metrics import METRICS, Metric
from reports.page import overview, situations, style
from reports.page.trust import how_far_to_trust
from reports.run.known_answers import MEANING

VERDICTS = ("keeps", "not asked", "departs", "breaks")


@dataclass(frozen=True)
class PageTables:
    """The tables between the first screen and the scenarios, in their order.

    Attributes:
        columns: of the tables of medians.
        summaries: the tables of medians: without friction, and with friction if there are both.
        heat_map: scenario -> a cell for each engine: its largest position error.
        flukes: whether a cell of it is one of `pooled.flukes`.
        heat_bounds: the errors at which the colour of a cell changes, radii.
        trust: heading -> how far to trust it.
        known_answers, known_answers_text: reproduced published numbers, and what they are.
        probes: whether any probe was run.
        conformance: probe -> engine -> the worst verdict, and how often.
        departures: engine -> the probes that it does not pass.
        settings: engine -> its (setting, asked, used) that are the same in every scenario.
        searched: engine -> the settings that were searched for its matched profile.
        metrics: name -> metric.
    """

    columns: Mapping[str, overview.SummaryColumn]
    summaries: Sequence[Summary]
    heat_map: Mapping[str, Sequence[overview.OverviewCell]]
    flukes: bool
    heat_bounds: Sequence[float]
    trust: Mapping[str, str]
    known_answers: Sequence[Mapping[str, Any]]
    known_answers_text: str
    probes: bool
    conformance: Mapping[str, Mapping[str, tuple[str, int]]]
    departures: Mapping[str, Sequence[Mapping[str, Any]]]
    settings: Mapping[str, Sequence[tuple[str, str, str]]]
    searched: Mapping[str, Sequence[Mapping[str, str]]]
    metrics: Mapping[str, Metric]


def page_tables(
    comparisons: Sequence[Comparison],
    untrusted: Set[str],
    conformance: pd.DataFrame,
    known_answers: pd.DataFrame,
) -> PageTables:
    """All tables of `comparisons`; an engine in `untrusted` is not scored."""
    heat_map = overview.heat_map(comparisons, overview.names_of(comparisons))
    medians = summaries(*situations.by_friction(comparisons), untrusted)
    shown = [column for table in medians for column in table.columns]
    return PageTables(
        columns={key: column for key, column in overview.SUMMARY.items() if column in shown},
        summaries=medians,
        heat_map=heat_map,
        flukes=any(cell.fluke for row in heat_map.values() for cell in row),
        heat_bounds=style.HEAT_BOUNDS,
        trust=how_far_to_trust(comparisons),
        known_answers=records(known_answers),
        known_answers_text=MEANING,
        probes=not conformance.empty,
        conformance=conformance_matrix(conformance),
        departures=departures(conformance),
        settings=by_name(overview.common_settings(comparisons)),
        searched=by_engine(searched()),
        metrics=METRICS,
    )


class Summary(NamedTuple):
    """A table of medians: heading, "" for the first; number of scenes; columns; the rows of
    `overview.summary` with these columns; and their groups."""

    title: str
    scenes: int
    columns: Sequence[overview.SummaryColumn]
    rows: Mapping[str, list[overview.OverviewCell]]
    groups: Mapping[str, list[str]]


def summaries(
    smooth: Sequence[Comparison], rough: Sequence[Comparison], untrusted: Set[str]
) -> list[Summary]:
    """The table of medians, and a second one for the scenes with friction if there are both
    kinds."""
    found = []
    for comparisons, title in ((smooth, ""), (rough, "Summary of the scenes with friction")):
        names = overview.names_of(comparisons)
        columns, rows = overview.with_numbers(overview.summary(comparisons, names, untrusted))
        groups = situations.grouped(names)
        found += (
            [Summary(title, len(comparisons), columns, rows, groups)]
            if comparisons or not title
            else []
        )
    return found


def by_engine(rows: Sequence[dict[str, str]]) -> dict[str, list[dict[str, str]]]:
    """Engine -> its rows of the table of searched settings."""
    return {
        engine: [row for row in rows if row["engine"] == engine]
        for engine in dict.fromkeys(r["engine"] for r in rows)
    }


def by_name(settings: overview.Settings) -> dict[str, list[tuple[str, str, str]]]:
    """`engine:profile` -> its (setting, asked, used)."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for (name, setting), (asked, used) in settings.items():
        found.setdefault(name, []).append((setting, asked, used))
    return found


def records(table: pd.DataFrame | None) -> list[dict[str, Any]]:
    """The rows of a table; [] if there is none."""
    rows = [] if table is None else table.to_dict("records")
    return [{str(column): value for column, value in row.items()} for row in rows]


def conformance_matrix(table: pd.DataFrame) -> dict[str, dict[str, tuple[str, int]]]:
    """probe -> `engine:profile` -> (the worst verdict, how many of its questions got it)."""
    order = VERDICTS
    matrix: dict[str, dict[str, tuple[str, int]]] = {}
    for row in records(table):
        name = f"{row['engine']}:{row['profile']}"
        worst, count = matrix.setdefault(str(row["probe"]), {}).get(name, ("keeps", 0))
        verdict = row["verdict"] if row["verdict"] in order else "breaks"
        if order.index(verdict) > order.index(worst):
            worst, count = verdict, 0
        matrix[str(row["probe"])][name] = (worst, count + (verdict == worst))
    return matrix


def departures(table: pd.DataFrame) -> dict[str, list[dict[str, Any]]]:
    """`engine:profile` -> the rows of the probes that it does not pass."""
    found: dict[str, list[dict[str, Any]]] = {}
    for row in records(table):
        if row["verdict"] != "keeps":
            found.setdefault(f"{row['engine']}:{row['profile']}", []).append(row)
    return found
