"""What the pages of lesson 6 share: a mechanism is enabled in the reference until the curves
coincide."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from crosscheck2d.adapters.engines import changed
from crosscheck2d.adapters.mechanisms.ablated import AblatedReference
from crosscheck2d.adapters.mechanisms.table import Mechanism, mechanisms_of, with_mechanisms
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.lessons.lesson import Claim, LessonChart, Makes, run_of
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.truth.exact import with_oracle

ABLATED, PLAIN, NO_CCD = "reference:ablated", "reference:exercise", "box2d:matched+no_ccd"
NO_CORRECTION = "pymunk:matched+no_correction"
ROUNDING = 1e-13  # of float64, in any unit of these pages
FLOAT32 = 2.0**-24  # half of the distance of two neighbours, relative


def asked(scene: Scene, duration: float) -> Scenario:
    """A scene of this lesson."""
    asks = "Where does the engine differ?"
    return with_oracle(Scenario("mechanism", asks, "", scene, duration, 1 / 60))


def ablated(**parameters: Any) -> Makes:
    """How the ablated reference is made with what is enabled."""
    return {ABLATED: partial(AblatedReference, **parameters)}


def unswept(**parameters: Any) -> Makes:
    """How Box2D as matched is made without CCD."""
    off = {"continuous": False, "bullet": False}
    return {NO_CCD: partial(changed, "box2d:matched", **off, **parameters)}


def uncorrected() -> Makes:
    """How pymunk as matched is made without position correction."""
    return {NO_CORRECTION: partial(changed, "pymunk:matched", collision_bias=1.0)}


def ablated_as(run: Run, scenario: Scenario, change: Mechanism) -> Run:
    """The ablated reference with all mechanisms of the engine that made `run`, and `change`."""
    own = mechanisms_of(run.name, run.settings, scenario.scene, run.dt)
    substeps = round(scenario.sample_interval / run.dt)
    return run_of(ABLATED, scenario, substeps, lambda: with_mechanisms([*own, change]))


def lies_on(engine: str, own: bool, bound: float, unit: str = "", off: float = 300.0) -> Claim:
    """Whether the ablated reference, with its current settings, moves as the engine does.

    own: whether it is set as the engine is; bound: what the rounding of both may add up to; off:
    how many bounds they are apart at least, if it is not.
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
        lambda shown: shown.gap(ABLATED, engine) > off * bound,
    )


def distances(chart: LessonChart, unit: str = "") -> list[tuple[str, str]]:
    """The largest difference between the curve of the ablated reference and that of each engine."""
    engines = [
        curve.name
        for curve in chart.curves
        if curve.name != TRUTH and not curve.name.startswith("reference:")
    ]
    return [
        (
            f"largest difference of the ablated reference from {engine}",
            (
                f"{number(gap)} {unit}".strip()
                if not 0 < (gap := chart.gap(ABLATED, engine)) < ROUNDING
                else "0 to rounding"
            ),
        )
        for engine in engines
    ]


def setting_rows(runs: Sequence[Run], setting: str) -> list[tuple[str, str]]:
    """What the engines themselves say of a setting."""
    return [
        (f"{run.name}, {setting}", number(run.settings[setting][1]))
        for run in runs
        if setting in run.settings
    ]
