"""Writes report.html: one file that holds everything it shows and asks nothing of anywhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from adapters.matched import searched
from adapters.run import Run
from adapters.thrust_grid import off_grid_note
from reports.compare.comparison import Comparison
from reports.compare.metrics import METRICS
from reports.page import error_cost, overview, pooled, situations, style
from reports.page.charts import CHARTS, NOISE, POINTS, Drawing, packed_charts
from reports.page.documents import CHARTED, render
from reports.page.links import neighbours
from reports.page.replay import frames, name_of, pack, played, ratio_of
from reports.page.trust import how_far_to_trust
from reports.run.known_answers import MEANING
from reports.terminal.foreign_text import put_text
from scenarios.catalogue import family_of

GENERATOR = "crosscheck run"
VERDICTS = ("keeps", "not asked", "departs", "breaks")
OWN = "Scenes of your own"
PAPER_CHARTS = ("deviation", "convergence")  # of a scene, where it is printed


@dataclass(frozen=True)
class ScenarioSection:
    """One scenario as the page shows it."""

    comparison: Comparison
    family: str
    dt: float
    failures: list[overview.Failure]
    drawings: dict[str, Drawing]
    charts: str
    replay: str
    layers: list[tuple[str, Run | None]]
    frames: int
    ratio: float
    table: list[tuple[str, str, str, list[overview.OverviewCell]]]
    settings: dict[str, list[tuple[str, str, str]]]
    pairs: dict[str, list[overview.OverviewCell]]


class Summary(NamedTuple):
    """A table of medians: its heading, "" for the first; how many scenes it is of; the rows of
    `overview.summary`; and the groups that they stand in."""

    title: str
    scenes: int
    rows: Mapping[str, list[overview.OverviewCell]]
    groups: Mapping[str, list[str]]


def write_page(
    path: Path,
    comparisons: Sequence[Comparison],
    *,
    findings: Sequence[str],
    untrusted: Set[str],
    conformance: pd.DataFrame,
    known_answers: pd.DataFrame,
    about: Mapping[str, Any],
    lessons: Mapping[str, Any],
    clock: error_cost.Clock = error_cost.NO_CLOCK,
    said: Mapping[str, Sequence[str]] = MappingProxyType({}),
    on_paper: Sequence[str] = (),
) -> None:
    """Write the page of `comparisons`, in reading order, to `path`.

    `findings` are the sentences on top; who is in `untrusted` is not scored; `conformance` and
    `known_answers` are the tables below them; `about` holds command, seed, machine, versions,
    started and seconds; `clock` what its steps cost;
    `lessons` name -> what has its number, title and question; `said` a
    solver's file -> what `crosscheck check` says of it. Scenarios `on_paper` have half a page each
    where the page is printed, others none.
    """
    names = overview.names_of(comparisons)
    common = overview.common_settings(comparisons)
    looks = style.looks_of((*names, style.TRUTH))
    sections = [section_of(comparison, names, common) for comparison in comparisons]
    smooth, rough = situations.by_friction(comparisons)
    scores = pooled.scores(comparisons)
    without_friction = pooled.scores(smooth)
    answers = situations.answers(scores[scores.middle], situated(comparisons), untrusted)
    drawings = pooled.drawings(scores, answers, untrusted)
    first = error_cost.error_cost(without_friction, clock, untrusted)
    html = render(
        "page/page.html.j2",
        generator=GENERATOR,
        scripts=CHARTED,
        looks=looks,
        plotly=True,
        names=names,
        sections=sections,
        families=by_family(sections),
        findings=findings,
        about=about,
        points=POINTS,
        noise=NOISE,
        engines=versions_of(comparisons),
        steps=step_range(comparisons),
        columns=overview.SUMMARY,
        summaries=summaries(smooth, rough, untrusted),
        error_cost=first,
        no_times=clock.fault,
        error_cost_key=error_cost.KEY,
        error_cost_charts=packed_charts(first.drawings) if first else "",
        answers=answers,
        whole=situations.whole(answers),
        far_off=situations.FAR_OFF,
        pooled=drawings,
        charted=pooled.with_marks(drawings),
        untrusted=untrusted,
        pooled_key=pooled.KEY,
        pooled_charts=packed_charts(drawings),
        links=neighbours(path, "report"),
        on_paper=on_paper,
        paper_charts=PAPER_CHARTS,
        heat_map=overview.heat_map(comparisons, names),
        conformance=conformance_matrix(conformance),
        departures=departures(conformance),
        probes=records(conformance),
        known_answers=records(known_answers),
        known_answers_text=about.get("known_answers_text", MEANING),
        heat_bounds=style.HEAT_BOUNDS,
        metrics=METRICS,
        lessons=lessons,
        said=said,
        truth_of=truth_of,
        off_grid_note=off_grid_note,
        common=by_name(common),
        trust=how_far_to_trust(comparisons),
        searched=by_engine(searched()),
    )
    put_text(path, html)


def summaries(
    smooth: Sequence[Comparison], rough: Sequence[Comparison], untrusted: Set[str]
) -> list[Summary]:
    """The table of medians, and where there are scenes with friction beside others one of these."""
    found = []
    for comparisons, title in ((smooth, ""), (rough, "Summary of the scenes with friction")):
        names = overview.names_of(comparisons)
        rows = overview.summary(comparisons, names, untrusted)
        groups = situations.grouped(names, pooled.scores(comparisons))
        found += (
            [Summary(title, len(comparisons), rows, groups)] if comparisons or not title else []
        )
    return found


def situated(comparisons: Sequence[Comparison]) -> dict[str, list[str]]:
    """Scene -> what `situations.situations_of` says of it."""
    return {
        each.scenario.name: situations.situations_of(each.scenario, each.truth)
        for each in comparisons
    }


def section_of(
    comparison: Comparison, names: Sequence[str], common: overview.Settings
) -> ScenarioSection:
    """All that the page shows of one scenario; of its settings those that are not `common`."""
    own = {key: pair for key, pair in overview.settings(comparison).items() if key not in common}
    drawings = {key: chart.draw(comparison) for key, chart in CHARTS.items()}
    layers = played(comparison)
    return ScenarioSection(
        comparison=comparison,
        family=family_of(comparison.scenario.name) or OWN,
        dt=comparison.middle_dt,
        failures=overview.failures(comparison),
        drawings=drawings,
        charts=packed_charts(drawings),
        replay=pack(comparison),
        layers=[(name_of(run), run) for run, _ in layers],
        frames=len(frames(comparison.scenario, layers)) if layers else 0,
        ratio=ratio_of(comparison.scenario, layers),
        table=overview.scenario_table(comparison, names),
        settings=by_name(own),
        pairs=overview.between_engines(comparison, names),
    )


def by_family(sections: Sequence[ScenarioSection]) -> dict[str, list[ScenarioSection]]:
    """The sections under their headings, both in the order of appearance."""
    families: dict[str, list[ScenarioSection]] = {}
    for section in sections:
        families.setdefault(section.family, []).append(section)
    return families


def versions_of(comparisons: Sequence[Comparison]) -> dict[str, str]:
    """engine -> its libraries and their versions, as its runs say."""
    found: dict[str, dict[str, str]] = {}
    for comparison in comparisons:
        for run in comparison.runs:
            found.setdefault(run.engine, {}).update(run.versions)
    return {
        engine: ", ".join(f"{library} {version[:16]}" for library, version in libraries.items())
        for engine, libraries in found.items()
    }


def step_range(comparisons: Sequence[Comparison]) -> tuple[float, float]:
    """s, the smallest and the largest step size of all runs."""
    steps = [run.dt for comparison in comparisons for run in comparison.runs]
    return (min(steps), max(steps)) if steps else (np.nan, np.nan)


def by_engine(rows: Sequence[dict[str, str]]) -> dict[str, list[dict[str, str]]]:
    """Engine -> its rows of the table of what was searched."""
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


def truth_of(comparison: Comparison) -> str:
    """What is known of the right answer, in a sentence."""
    scenario, truth = comparison.scenario, comparison.truth
    if truth is None:
        return f"none: {scenario.without_truth or 'the scene comes without an exact answer'}"
    ends = "at every sample"
    if truth.horizon < scenario.duration:
        ends = f"up to its horizon at {style.number(truth.horizon)} s, and no further"
        ends += f": {truth.reason}" if truth.reason else ""
    return f"exact {ends}" + (
        f"; off by at most {style.number(truth.error_bound)} m" if truth.error_bound else ""
    )


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
    """`engine:profile` -> the rows of what it does not keep."""
    found: dict[str, list[dict[str, Any]]] = {}
    for row in records(table):
        if row["verdict"] != "keeps":
            found.setdefault(f"{row['engine']}:{row['profile']}", []).append(row)
    return found
