"""Lesson 6.7: single precision."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Shown,
    Simulation,
    Slider,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import (
    ABLATED,
    PLAIN,
    ablated,
    asked,
    distances,
    lies_on,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.placing import lay_out

NAMES = ("box2d:shipped", PLAIN, ABLATED)
PRECISION = {53: np.float64, 24: np.float32}


def show_digits(digits: int, far: float) -> Shown:
    """How far a disk far out is from x + v t."""
    start, v = np.array([far, 0.0]), np.array([1.0, 0.3])
    scenario = asked(lay_out(position=[start], velocity=[v], radius=0.5, restitution=0.0), 2.0)
    played = Simulation.by(scenario, NAMES, 4, ablated(precision=PRECISION[digits]))
    exact = start + scenario.times[:, None] * v
    *engines, _ = played.curves(
        lambda each: np.maximum(np.hypot(*(each.position[:, 0] - exact).T), 1e-16)
    )
    # Also the exact answer rounds x + v t: of it the law is drawn.
    curves = [*engines, Curve(TRUTH, scenario.times, np.full(scenario.intervals + 1, 1e-16))]
    chart = LessonChart("Distance from x + v t", "time in s", "m", curves, "y")
    millimetres = [Curve(each.name, each.x, 1e3 * each.y) for each in curves]
    return Shown(
        [chart, LessonChart("The same on a linear axis", "time in s", "mm", millimetres)],
        played.film,
        distances(chart, "m"),
        list(digits_claims(far, digits, scenario.intervals * 4, scenario.dt(4), curves[0])),
    )


def digits_claims(far: float, digits: int, steps: int, dt: float, box2d: Curve) -> Iterator[Claim]:
    """The largest sum of the rounding errors of a position, and their sum in Box2D."""
    apart = float(np.spacing(np.float32(far + 2)))  # m; the disk moves by 2 m
    near = float(np.spacing(np.float32(far)))
    most = steps * apart / 2  # along x; y has smaller numbers, and far more digits
    largest = float(box2d.y.max())

    def in_proportion(shown: Shown) -> bool:
        y = shown.y("box2d:shipped", 1)
        law = y[-1] * shown.x("box2d:shipped", 1) / 2
        return bool(np.abs(y - law).max() < 0.05 * y[-1])

    yield Claim(
        f"Two neighbouring float32 numbers are {number(1e3 * near)} mm apart at x = {number(far)}"
        f" m, where the disk starts, and {number(1e3 * apart)} mm at x = {number(far + 2, 5)} m,"
        f" where it ends; a step is {number(1e3 * dt)} mm along x. Box2D rounds x in each of"
        f" {steps} steps, by at most half of this distance. These errors could add up to"
        f" {number(1e3 * most)} mm. Here the largest distance is {number(1e3 * largest)} mm.",
        lambda shown: (
            apart / 100 < shown.y("box2d:shipped").max() <= most
            and abs(shown.y("box2d:shipped").max() / largest - 1) <= 1e-9
        ),
    )
    if far == 1e4:
        yield Claim(
            "Here every step is rounded the same way, so the error grows in proportion to the"
            " time: on the linear axis it is a straight line.",
            in_proportion,
        )
    yield Claim(
        "reference:exercise computes with 53 binary digits and stays within a millionth of a"
        " millimetre.",
        lambda shown: shown.y(PLAIN).max() < 1e-9,
    )
    yield lies_on("box2d:shipped", digits == 24, 0.0)


DIGITS = Lesson(
    name="digits",
    number="6.7",
    title="Single precision",
    asks="Why does a free disk drift, far from the origin?",
    text="""
    A float32 number has 24 binary digits. The farther a disk is from the origin, the more of
    these digits the integer part of its coordinate takes. Fewer digits remain for the
    displacement in a step.
    """,
    sliders=(
        Slider("digits", "Binary digits", (53, 24), 0),
        Slider("far", "Distance from the origin", (1.0, 100.0, 1e4), 2, "m"),
    ),
    names=(*NAMES, TRUTH),
    show=show_digits,
)
