"""Writes stability.html: the limits, the maps, and a replay of the first run that failed at each
limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.charts import ChartLine, Drawing, figure_of, packed_charts, shortened
from crosscheck2d.reports.page.documents import CHARTED, render
from crosscheck2d.reports.page.links import neighbours
from crosscheck2d.reports.page.replay import pack_layers, ratio_of
from crosscheck2d.reports.stability import overview
from crosscheck2d.reports.stability.cases import FAMILY_OF
from crosscheck2d.reports.stability.failures import kept_failure, near
from crosscheck2d.reports.stability.limits import EXACT, FORMS, Case, Limit, Trial
from crosscheck2d.reports.stability.maps import MAPS
from crosscheck2d.reports.stability.results import StabilityResults, case_named
from crosscheck2d.reports.stability.touching import GAPS, TOUCHING
from crosscheck2d.reports.terminal.foreign_text import put_text
from crosscheck2d.scenarios.model import Scenario, Trajectory

GENERATOR = "crosscheck stability"
SECONDS = 5.0  # a replay lasts


@dataclass(frozen=True)
class Replay:
    """The first failing run of an engine: the data of the page's player, its height over its
    width, and a sentence."""

    engine: str
    pack: str
    ratio: float
    says: str


@dataclass(frozen=True)
class CaseSection:
    """One case as the page shows it."""

    case: Case
    limits: list[Limit]
    replays: list[Replay]
    reasons: list[overview.SharedReason]
    drawing: Drawing
    charts: str
    held: Mapping[str, str]  # of `overview.held`
    in_report: str  # of `overview.in_report`

    @property
    def anchor(self) -> str:
        """The name as a fragment of a URL."""
        return "".join(c if c.isalnum() or c in "_-" else "-" for c in self.case.name)

    def cell(self, engine: str) -> overview.LimitCell:
        """Its limit in the overview; empty where it was not asked."""
        return overview.cell_of(
            self.case, next((limit for limit in self.limits if limit.engine == engine), None)
        )

    def replay(self, engine: str) -> Replay | None:
        """The replay of an engine's failure, if there is one."""
        return next((replay for replay in self.replays if replay.engine == engine), None)


def write_page(path: Path, folder: Path, results: StabilityResults) -> None:
    """Write the page of a stability report, whose failing runs are in `folder`, to `path`."""
    limits, maps, laws = results.limits, results.maps, results.laws
    by_case: dict[str, list[Limit]] = {}
    for limit in limits:
        by_case.setdefault(limit.case, []).append(limit)
    sections = [section_of(case_named(name), found, folder) for name, found in by_case.items()]
    names = list(dict.fromkeys(one.engine for one in results.all))
    looks = style.looks_of((*names, style.TRUTH))
    html = render(
        "stability/stability.html.j2",
        generator=GENERATOR,
        scripts=(*CHARTED, "stability/stability.js"),
        styles=["stability/stability.css"],
        looks=looks,
        plotly=True,
        sections=sections,
        families=families_of(sections),
        findings=overview.findings(limits),
        about=results.header,
        engines=[name for name in names if "+" not in name],
        engines_changed=[name for name in names if "+" in name],
        alike=sum(section.case.name == f"dt_{section.case.report}" for section in sections),
        maps=overview.map_tables(maps),
        all_maps=MAPS,
        laws=laws,
        touching=TOUCHING,
        gaps=GAPS,
        words=overview,
        exact=EXACT,
        links=neighbours(path, "stability"),
        form=FORMS[results.header["form"]],
    )
    put_text(path, html)


def families_of(sections: Sequence[CaseSection]) -> dict[str, list[CaseSection]]:
    """The headings with their sections, both in the order of first appearance."""
    found: dict[str, list[CaseSection]] = {}
    for section in sections:
        family = FAMILY_OF.get(section.case.name, "A scene of your own")
        found.setdefault(family, []).append(section)
    return found


def section_of(case: Case, limits: list[Limit], folder: Path) -> CaseSection:
    """All that the page shows of one case."""
    replays = [replay for limit in limits if (replay := replay_of(case, limit, folder)) is not None]
    drawing = readings(case, limits)
    return CaseSection(
        case,
        limits,
        replays,
        overview.reasons(limits),
        drawing,
        packed_charts({"readings": drawing}),
        overview.held(case),
        overview.in_report(case),
    )


def replay_of(case: Case, limit: Limit, folder: Path) -> Replay | None:
    """The first failing run at the limit, from just before the failure; None if none was kept."""
    failing = limit.failing
    if failing is None or not isfinite(failing.value):
        return None
    scenario = case.scene(failing.value, failing.first)
    kept = kept_failure(limit, folder, scenario)
    if kept is None or failing.disk >= scenario.scene.n:
        return None
    played, companion = kept
    shown = near(failing, scenario)
    layers: list[tuple[Run | None, Trajectory]] = [(named(limit), played)]
    if companion is not None and len(companion):
        layers.append((None, companion))
    pack = pack_layers(scenario, layers, shown, opening(failing, scenario, shown))
    says = f"{case.parameter} = {style.number(failing.value)}: {failing.event}"
    return Replay(limit.engine, pack, ratio_of(scenario, layers), says)


def named(limit: Limit) -> Run:
    """A run with the name of an engine, which decides how it is drawn."""
    engine, profile = limit.engine.split(":")
    return Run(engine, profile, limit.case, 0.0)


def opening(failing: Trial, scenario: Scenario, shown: np.ndarray) -> dict[str, Any]:
    """The time at which the player starts, a tenth of the shown time before the failure, and
    what it marks."""
    first, last = float(scenario.times[shown[0]]), float(scenario.times[shown[-1]])
    at = min(max(failing.at, first), last) if np.isfinite(failing.at) else first
    return {
        "opens": max(first, at - max(0.1 * (last - first), 1.5 * scenario.sample_interval)),
        "pace": (last - first) / SECONDS,
        "event": {"t": at, "disk": failing.disk},
    }


def readings(case: Case, limits: Sequence[Limit]) -> Drawing:
    """The worst reading of every engine against the parameter, with the bound above which it
    fails."""
    predicate = case.predicate
    if predicate.bound == 0:
        return shares(case, limits)
    title = f"{predicate.name.capitalize()}, {predicate.unit}"
    caption = (
        f"The worst of the runs played at each {case.parameter}, harsher to the right. Above the"
        " dotted line the engine fails. Where a line ends, the engine refused the scene, stopped,"
        " or gave a value that is not a number."
    )
    lines = []
    for limit in limits:
        trials = [
            trial for trial in limit.trials if np.isfinite(trial.worst) and np.isfinite(trial.value)
        ]
        if len(trials) > 1:
            x = np.array([trial.value for trial in trials])
            lines.append(ChartLine(named(limit), x, np.array([abs(t.worst) for t in trials])))
    if not lines or not any((line.y > 0).any() for line in lines):
        return Drawing(title, "No engine reads more than 0 anywhere.", None)
    ends = [min(case.values), max(case.values)]
    guide = {
        "type": "scatter",
        "x": shortened(ends),
        "y": [predicate.bound or None] * 2,
        "mode": "lines",
        "name": "bound",
        "hoverinfo": "skip",
        "line": {"color": style.look(style.TRUTH).light, "dash": "dot", "width": 1.3},
    }
    figure = figure_of(
        lines, axis_of(case), predicate.unit, markers=40, guide=[guide], unit=unit_of(case)
    )
    return Drawing(title, caption, figure)


def shares(case: Case, limits: Sequence[Limit]) -> Drawing:
    """The fraction of runs that failed against the parameter, for a case that reads nothing
    else."""
    lines = []
    for limit in limits:
        trials = [trial for trial in limit.trials if not trial.left]
        x = np.array([trial.value for trial in trials])
        lines.append(ChartLine(named(limit), x, np.array([t.failed / t.runs for t in trials])))
    caption = (
        f"The share of the runs at each {case.parameter} that failed; harsher to the right. Values"
        " at which the quick form stopped at the first failing run are not drawn."
    )
    title = f"{case.predicate.name.capitalize()}, share of runs"
    figure = figure_of(
        lines, axis_of(case), "share of runs", log=False, markers=40, unit=unit_of(case)
    )
    return Drawing(title, caption, figure)


def unit_of(case: Case) -> str:
    """The unit of the parameter, "" for a ratio."""
    return "" if case.unit == "1" else case.unit


def axis_of(case: Case) -> dict[str, Any]:
    """The parameter's axis: logarithmic, with harsher values to the right."""
    harsh_left = case.values[0] > case.values[-1]
    title = case.parameter if case.unit == "1" else f"{case.parameter} ({case.unit})"
    return {"title": title, "type": "log"} | ({"autorange": "reversed"} if harsh_left else {})
