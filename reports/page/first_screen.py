"""The first screen of the report: the first pictures, which engine for what, and the findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass

import numpy as np

from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.fast_disks import can_pass
from crosscheck2d.reports.page import cost_points, error_cost, pooled, situations
from crosscheck2d.reports.page.charts import Drawing, packed_charts
from crosscheck2d.reports.page.overview import names_of
from crosscheck2d.reports.page.own_solvers import Said
from crosscheck2d.reports.page.style import number


@dataclass(frozen=True)
class Pictures:
    """Charts under one key, with which the script of the page finds their data."""

    key: str
    drawings: Mapping[str, Drawing]
    charts: str  # the data of the drawings, packed


@dataclass(frozen=True)
class FirstScreen:
    """What the report shows before its tables.

    Attributes:
        scenes: how many there are.
        exact: how many of them have an exact answer.
        rough: how many of them have friction.
        cells: how many runs there are: a scene in an engine at a step size each.
        rough_cells: how many of them are of scenes with friction.
        steps: s, the smallest and the largest step size.
        versions: engine -> its libraries and their versions.
        said: a solver's file -> what `crosscheck check` says of it.
        error_cost: error against cost, its sentences and its times; None without exact answers.
        error_cost_charts: the pictures of `error_cost`.
        no_times: why no times are shown, or "".
        timed: the scenes that were timed, if times are shown.
        answers: the engines ranked, a row for each situation.
        libraries: whether there are libraries among them, which are then ranked alone.
        fast: the scenes in which a disk can pass through another, or a wall, in a coarsest step.
        flukes: (scene, engine) of `pooled.flukes`.
        early: scene -> up to when its exact answer goes, where that is before its end.
        whole: the row of all situations together.
        far_off: position error, radii, above which a disk is visibly off.
        pooled: the pictures of all scenes at once.
        charted: the engines with a mark in one of `pooled`.
        failed: an engine -> where it failed first, and why.
        findings: the sentences below.
    """

    scenes: int
    exact: int
    rough: int
    cells: int
    rough_cells: int
    steps: tuple[float, float]
    versions: Mapping[str, str]
    said: Mapping[str, Sequence[Said]]
    error_cost: error_cost.ErrorCost | None
    error_cost_charts: Pictures
    no_times: str
    timed: Sequence[str]
    answers: Sequence[situations.Recommendation]
    libraries: bool
    fast: Sequence[str]
    flukes: Sequence[tuple[str, str]]
    early: Mapping[str, str]
    whole: situations.Recommendation | None
    far_off: float
    pooled: Pictures
    charted: Sequence[str]
    failed: Mapping[str, str]
    findings: Sequence[str]


def first_screen(
    comparisons: Sequence[Comparison],
    untrusted: Set[str],
    clock: cost_points.RunTimes,
    findings: Sequence[str],
    said: Mapping[str, Sequence[Said]],
) -> FirstScreen:
    """The first screen for `comparisons`; an engine in `untrusted` is not ranked.

    Scenes with friction are ranked in a row of their own, and are not in the first picture.
    """
    without_friction, _ = situations.by_friction(comparisons)
    with_friction = [each for each in comparisons if each.scenario.scene.friction]
    scores = pooled.scores(comparisons)
    middle = cost_points.with_times(scores[scores.middle], clock)
    answers = situations.answers(middle, situated(comparisons), untrusted)
    drawings = pooled.drawings(scores, answers, untrusted)
    exact = filter(pooled.scored, without_friction)
    first = error_cost.error_cost(pooled.scores([*exact]), clock, untrusted)
    return FirstScreen(
        scenes=len(comparisons),
        exact=sum(comparison.truth is not None for comparison in comparisons),
        rough=len(with_friction),
        cells=sum(len(comparison.runs) for comparison in comparisons),
        rough_cells=sum(len(comparison.runs) for comparison in with_friction),
        steps=step_range(comparisons),
        versions=versions_of(comparisons),
        said=said,
        error_cost=first,
        error_cost_charts=pictures(error_cost.KEY, first.drawings if first else {}),
        no_times=clock.fault,
        timed=[] if clock.fault else list(dict.fromkeys(clock.table.scenario)),
        answers=answers,
        libraries=situations.ENGINE in situations.grouped(names_of(comparisons)),
        fast=[each.scenario.name for each in comparisons if can_pass(each)],
        flukes=pooled.flukes(scores[~scores.name.isin(untrusted)]),
        early=early_ends(comparisons),
        whole=situations.whole(answers),
        far_off=situations.FAR_OFF,
        pooled=pictures(pooled.KEY, drawings),
        charted=pooled.with_marks(drawings),
        failed=failed(comparisons),
        findings=findings,
    )


def pictures(key: str, drawings: Mapping[str, Drawing]) -> Pictures:
    """The drawings with their data, packed."""
    return Pictures(key, drawings, packed_charts(drawings))


def failed(comparisons: Sequence[Comparison]) -> dict[str, str]:
    """An engine -> the first scene in which it failed, and why."""
    return {
        run.name: f"{run.scenario}: {run.reason.removeprefix('SolverFailed: ')}"
        for comparison in reversed(comparisons)
        for run in reversed(comparison.runs)
        if run.status not in ("ok", "unsupported")
    }


def situated(comparisons: Sequence[Comparison]) -> dict[str, list[str]]:
    """Scene -> its `situations.situations_of`."""
    return {
        each.scenario.name: situations.situations_of(each.scenario, each.truth)
        for each in comparisons
    }


def early_ends(comparisons: Sequence[Comparison]) -> dict[str, str]:
    """Scene -> "up to 0.24 of 3 s", where its exact answer ends before the scene."""
    return {
        scenario.name: f"up to {number(truth.horizon, 2)} of {number(scenario.duration)} s"
        for scenario, truth in ((each.scenario, each.truth) for each in comparisons)
        if truth is not None and truth.horizon < scenario.duration
    }


def versions_of(comparisons: Sequence[Comparison]) -> dict[str, str]:
    """engine -> its libraries and their versions, from its runs."""
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
