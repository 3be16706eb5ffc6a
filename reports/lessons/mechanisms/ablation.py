"""What the pages of lesson 6 share: a mechanism is enabled in the reference until the curves
coincide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from adapters.mechanisms.ablated import AblatedReference
from adapters.play import play
from adapters.run import Run
from reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Settings,
    Shown,
    Simulation,
    Slider,
    run_of,
)
from reports.page.style import TRUTH, number
from scenarios.model import Array, Scenario, Scene, Trajectory
from scenarios.no_truth import answered
from scenarios.truth.exact import with_oracle

ABLATED, PLAIN, NO_CCD = "reference:ablated", "reference:exercise", "box2d:matched+no_ccd"
ROUNDING = 1e-13  # of float64, in any unit of these pages
FLOAT32 = 2.0**-24  # half of the distance of two neighbours, relative
Read = Callable[[Trajectory], Array]


def asked(scene: Scene, duration: float) -> Scenario:
    """A scene of this lesson."""
    return Scenario("mechanism", "Where does the engine differ?", "", scene, duration, 1 / 60)


def runs_of(
    names: Sequence[str],
    on: AblatedReference,
    scenario: Scenario,
    substeps: int,
    plain: str = PLAIN,
) -> list[Run]:
    """The engines, the reference as it is, and the reference with what is enabled."""
    runs = [run_of(name, scenario, substeps) for name in (*names, plain)]
    return [*runs, play(on, ABLATED, scenario, scenario.dt(substeps))]


def over_time(runs: Sequence[Run], read: Read) -> list[Curve]:
    """`read` of every run that was played."""
    return [
        Curve(run.name, run.trajectory.t, read(run.trajectory))
        for run in runs
        if run.trajectory is not None
    ]


def over(x: Array, runs: Sequence[Run], read: Read) -> list[Curve]:
    """`read` of every run against `x`."""
    return [
        Curve(run.name, x, read(run.trajectory), dots=True)
        for run in runs
        if run.trajectory is not None
    ]


def lies_on(engine: str, own: bool, bound: float, unit: str = "") -> Claim:
    """Whether the ablated reference, with its current settings, moves as the engine does.

    own: whether it is set as the engine is; bound: what the rounding of both may add up to.
    """
    if own:
        rounding = f"up to rounding, which is at most {number(bound, 2)} {unit}".rstrip()
        within = rounding if bound else "to the last digit"
        return Claim(
            f"With this setting the ablated reference lies on {engine}, {within}.",
            lambda shown: shown.gap(ABLATED, engine) <= bound,
        )
    return Claim(
        f"With this setting the ablated reference does not lie on {engine}.",
        lambda shown: shown.gap(ABLATED, engine) > 300 * bound,
    )


def follows(name: str, law: Array, bound: float) -> Callable[[Shown], np.bool_]:
    """Whether a curve is `law`, within `bound`."""
    return lambda shown: np.abs(shown.y(name) - law).max() <= bound


def distances(runs: Sequence[Run], curves: Sequence[Curve], unit: str) -> list[tuple[str, str]]:
    """The largest difference between the curve of the ablated reference and that of each engine."""
    shown = Shown([LessonChart("", "", "", curves)])
    return [
        (
            f"largest difference of the ablated reference from {run.name}",
            (
                f"{number(gap)} {unit}".strip()
                if not 0 < (gap := shown.gap(ABLATED, run.name)) < ROUNDING
                else "0 to rounding"
            ),
        )
        for run in runs
        if run.name not in (PLAIN, ABLATED)
    ]


def setting_rows(runs: Sequence[Run], setting: str) -> list[tuple[str, str]]:
    """What the engines themselves say of a setting."""
    return [
        (f"{run.name}, {setting}", number(run.settings[setting][1]))
        for run in runs
        if setting in run.settings
    ]


def filmed(scenario: Scenario, runs: Sequence[Run]) -> Any:
    """What the player of the page shows: the runs at the step of the scenario, and the exact answer
    if there is one."""
    seen = replace(scenario, substeps=(round(scenario.sample_interval / runs[0].dt),))
    seen, truth = answered(seen if seen.truth else with_oracle(seen))
    return Simulation(seen, runs, truth).film


def page(
    part: int,
    name: str,
    title: str,
    asks: str,
    text: str | tuple[str, ...],
    names: Sequence[str],
    show: Callable[[Settings], Shown],
    *sliders: Slider,
) -> Lesson:
    """A page of this lesson; text: its paragraph, or several."""
    paragraphs = (text,) if isinstance(text, str) else text
    exact = () if name == "correction" else (TRUTH,)  # disks that overlap have no exact answer
    drawn = (*names, PLAIN, ABLATED, *exact)
    return Lesson(name, f"6.{part}", title, asks, paragraphs, sliders, drawn, show)
