"""The tables of the report over all scenarios: medians, errors, probes, settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.adapters.matched import searched
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.metrics import METRICS, Metric
from crosscheck2d.reports.compare.verdicts import VERDICTS, Kind
from crosscheck2d.reports.page import overview, situations, style
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.known_answers import MEANING
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM, EVENT_DRIVEN, OracleTruth, answered_by
from crosscheck2d.scenarios.truth.record import CERTIFIED, SEARCHED, TWO_PRECISIONS

OUTCOMES = ("keeps", "not asked", "departs", "breaks")
HOW_COMPUTED = {
    CERTIFIED: "proven by interval arithmetic",
    SEARCHED: "proven but for collisions that a search says never end",
    TWO_PRECISIONS: "at two precisions that agree",
}


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
        verdicts: id -> what a verdict is about.
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
    verdicts: Mapping[str, Kind]


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
        verdicts=VERDICTS,
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
    order = OUTCOMES
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


def how_far_to_trust(comparisons: Sequence[Comparison]) -> dict[str, str]:
    """Heading -> its text for this run."""
    return {
        "Exact answers": exact_answers(comparisons),
        "How far they hold": how_far_they_hold(comparisons),
        "Measured": (
            "Everything else is measured in this run. Each engine is played with the settings that"
            " this page shows. Failures stay in the tables. A number from too few samples is marked"
            " as not judged."
        ),
        "Checked from outside": (
            "Three checks share no code with what they check: a simulation of all pairs in 420"
            " bits, plain scripts for each engine, and metrics computed again from the"
            " trajectories. uv run pytest -m independent repeats them, and"
            " tests/independent/README.md lists what has not been checked."
        ),
        "Our own engines": (
            "reference and event_driven belong to this project, which also judges them. So the"
            " exact answers import none of their code; a test checks this. The same command"
            " searches the settings of every engine, on scenes that are not scored. Solvers that"
            " stand still, gain energy or double their speed must be caught in every scene in"
            " which something moves."
        ),
    }


def exact_answers(comparisons: Sequence[Comparison]) -> str:
    """How the exact answers of these scenes were found, and how far off they may be."""
    models = [answered_by(each.scenario) if each.truth is not None else "" for each in comparisons]
    closed, event_driven, none = (
        models.count(CLOSED_FORM),
        models.count(EVENT_DRIVEN),
        models.count(""),
    )
    parts = [f"{closed} of {len(models)} scenes have a closed form"] if closed else []
    if event_driven:
        computed = [c for c, model in zip(comparisons, models) if model == EVENT_DRIVEN]
        bound = max(c.truth.error_bound for c in computed if c.truth is not None)
        methods = [
            c.scenario.truth.record().method
            for c in computed
            if isinstance(c.scenario.truth, OracleTruth)
        ]
        how = [f"{methods.count(m)} {HOW_COMPUTED[m]}" for m in HOW_COMPUTED if m in methods]
        parts.append(
            f"{event_driven} {'is' if event_driven == 1 else 'are'} computed from collision to"
            f" collision in many digits ({', '.join(how)}), and off by at most {number(bound)} m"
        )
    if none:
        parts.append(
            f"{none} {'has' if none == 1 else 'have'} no exact answer and no score: engines are"
            " checked there against the laws of physics only"
        )
    return "; ".join(parts) + "."


def how_far_they_hold(comparisons: Sequence[Comparison]) -> str:
    """The times up to which engines are compared with the exact answers of these scenes."""
    ends = {
        each.scenario.name: (each.truth.horizon, each.scenario.duration)
        for each in comparisons
        if each.truth is not None and each.truth.horizon < each.scenario.duration
    }
    if not ends:
        return "Every exact answer holds to the end of its scene."
    listed = ", ".join(
        f"{name} to {number(until)} s of {number(whole)} s" for name, (until, whole) in ends.items()
    )
    return (
        f"{listed}: later samples have no score, because a rounding of the start has grown to a"
        " billionth of a radius, or the motion has no single answer. The section of the scene says"
        " which. All other exact answers hold to the end of their scene."
    )
