"""A section of the report for each scenario: its replay, its charts, its tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from crosscheck2d.adapters.friction import REFUSAL
from crosscheck2d.adapters.run import Run
from crosscheck2d.adapters.thrust_grid import off_grid_note
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.fast_disks import fast_note
from crosscheck2d.reports.page import overview, style
from crosscheck2d.reports.page.charts import CHARTS, Drawing, packed_charts
from crosscheck2d.reports.page.page_tables import by_name
from crosscheck2d.reports.page.replay import frames, name_of, pack, played, ratio_of
from crosscheck2d.scenarios.catalogue import SCENARIOS, family_of
from crosscheck2d.scenarios.model import Scenario

OWN = "Scenes of your own"


@dataclass(frozen=True)
class ScenarioSection:
    """One scenario on the page.

    Attributes:
        comparison: the runs of the scenario and their metrics.
        family: the heading of the section.
        truth: a sentence on the exact answer.
        dt: s, the step size of `table`.
        limits: the cases of the page of limits that ask of this scene, or of one like it.
        off_grid: the step sizes at which a thrust starts or stops inside a step, or "".
        fast: the step sizes at which a disk can pass through another, and caps on speed, or "".
        failures: the engines that did not play it to its end.
        layers: what the replay shows: name, and its run; None for the exact answer.
        replay: the frames of `layers`, packed.
        frames: how many.
        ratio: width of the replay over its height.
        drawings: key -> chart.
        charts: the data of the drawings, packed.
        columns: the engines of `table` and `pairs`: all but those that were not asked to play this
            scene, or model no friction where it has some.
        table: metric, unit, which value is better, a cell for each of `columns`.
        pairs: engine -> its largest deviation from each engine before it.
        settings: engine -> its (setting, asked, used) that differ from scenario to scenario.
    """

    comparison: Comparison
    family: str
    truth: str
    dt: float
    limits: list[str]
    off_grid: str
    fast: str
    failures: list[overview.FailedRuns]
    layers: list[tuple[str, Run | None]]
    replay: str
    frames: int
    ratio: float
    drawings: dict[str, Drawing]
    charts: str
    columns: list[str]
    table: list[tuple[str, str, str, list[overview.OverviewCell]]]
    pairs: dict[str, list[overview.OverviewCell]]
    settings: dict[str, list[tuple[str, str, str]]]


def sections_of(comparisons: Sequence[Comparison]) -> list[ScenarioSection]:
    """A section for each comparison, in their order."""
    names = overview.names_of(comparisons)
    common = overview.common_settings(comparisons)
    return [section_of(comparison, names, common) for comparison in comparisons]


def section_of(
    comparison: Comparison, names: Sequence[str], common: overview.Settings
) -> ScenarioSection:
    """The section of one scenario, with those settings that are not `common`."""
    scenario = comparison.scenario
    own = {key: pair for key, pair in overview.settings(comparison).items() if key not in common}
    drawings = {key: chart.draw(comparison) for key, chart in CHARTS.items()}
    layers = played(comparison)
    asked = {run.name for run in comparison.runs if REFUSAL not in run.reason}
    columns = [name for name in names if name in asked]
    return ScenarioSection(
        comparison=comparison,
        family=family_of(scenario.name) or OWN,
        truth=truth_of(comparison),
        dt=comparison.middle_dt,
        limits=limits_of(scenario),
        off_grid=off_grid_note(scenario),
        fast=fast_note(comparison),
        failures=overview.failures(comparison),
        layers=[(name_of(run), run) for run, _ in layers],
        replay=pack(comparison),
        frames=len(frames(scenario, layers)) if layers else 0,
        ratio=ratio_of(scenario, layers),
        drawings=drawings,
        charts=packed_charts(drawings),
        columns=columns,
        table=overview.scenario_table(comparison, columns),
        pairs=overview.between_engines(comparison, columns),
        settings=by_name(own),
    )


# scene -> a case of `crosscheck stability` with another scene that asks something alike
ASKED_ALIKE = {"column_of_ten": "column"}


def limits_of(scenario: Scenario) -> list[str]:
    """The cases of the page of limits that ask of a scene of the suite, or of one like it; scenes
    with friction have none."""
    if scenario.name not in SCENARIOS or scenario.scene.friction:
        return []
    return [f"dt_{scenario.name}", *filter(None, [ASKED_ALIKE.get(scenario.name)])]


def by_family(sections: Sequence[ScenarioSection]) -> dict[str, list[ScenarioSection]]:
    """The sections under their headings, both in the order of appearance."""
    families: dict[str, list[ScenarioSection]] = {}
    for section in sections:
        families.setdefault(section.family, []).append(section)
    return families


def truth_of(comparison: Comparison) -> str:
    """A sentence on the exact answer."""
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
