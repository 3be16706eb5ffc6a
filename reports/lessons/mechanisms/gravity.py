"""Lesson 6.4: impulse before or after gravity."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from crosscheck2d.adapters.mechanisms.ablated import BOX2D, EXERCISE, PYMUNK
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Shown,
    Simulation,
    Slider,
    time_step,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import (
    ABLATED,
    FLOAT32,
    NO_CCD,
    NO_CORRECTION,
    PLAIN,
    ablated,
    distances,
    lies_on,
    uncorrected,
    unswept,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.model import Array, Scene

NAMES = (NO_CCD, "box2d:matched", NO_CORRECTION, PLAIN, ABLATED)
ORDERS = {"as the exercise": EXERCISE, "aimed before gravity": PYMUNK, "aimed after gravity": BOX2D}


def show_gravity(order: str, k: int) -> Shown:
    """The height of a ball that should bounce for ever."""
    scenario = SCENARIOS["bouncing_ball_e1"]
    makes = {**unswept(), **uncorrected(), **ablated(order=ORDERS[order])}
    played = Simulation.by(scenario, NAMES, k, makes)
    chart = played.over_time("Height of the centre", "m", lambda each: each.position[:, 0, 1])
    turns = [(curve.name, np.append(curve.y[0], turned(curve.y))) for curve in chart.curves]
    heights = [Curve(name, np.arange(float(len(found))), found, dots=True) for name, found in turns]
    return Shown(
        [chart, LessonChart("How high it rises", "bounces so far", "m", heights)],
        played.film,
        distances(chart, "m"),
        list(bounce_claims(scenario.scene, scenario.dt(k), order)),
    )


def bounce_claims(scene: Scene, dt: float, order: str) -> Iterator[Claim]:
    """What each bounce adds to the height of the next."""
    start, radius = float(scene.position[0, 1]), float(scene.radius[0])
    g = float(np.hypot(*scene.gravity))
    # A sample is up to 1/120 s from the turn, which is then up to g (1/120 s)² / 2 higher.
    seen = g / 120**2 / 2  # m
    # 600 to 4800 steps that each round a height of up to 2.5 m, and bounces that hand the error on.
    single = 2400 * FLOAT32

    def gains(shown: Shown) -> bool:
        found = np.array([start, *peaks(shown, NO_CCD)])
        speed = np.sqrt(2 * g * (found[:-1] - radius))
        return bool((np.abs(np.diff(found) - speed * dt) <= 0.1 * speed * dt + 2 * seen).all())

    fall = float(np.sqrt(2 * g * (start - radius)))
    yield Claim(
        "Box2D without CCD (+no_ccd) reverses a velocity that gravity has already changed. The"
        " ball gains about |v| dt of height at each bounce, where v is its speed: some"
        f" {number(1e3 * fall * dt, 2)} mm at the first, and more at each later one.",
        lambda shown: gains(shown) and (np.diff(peaks(shown, NO_CCD)) > 0).all(),
    )
    if round(1 / dt) == 240:
        yield Claim(
            "At this dt box2d:matched, whose CCD is on, does the same.",
            lambda shown: shown.gap("box2d:matched", NO_CCD) <= single,
        )
    else:
        yield Claim(
            "At this dt CCD (box2d:matched) acts in some bounces, and the ball rises less high than"
            " without it.",
            lambda shown: shown.y("box2d:matched").max() < shown.y(NO_CCD).max() - 2 * seen,
        )
    yield Claim(
        "pymunk without position correction (+no_correction) reverses the velocity before gravity"
        " changes it. The ball rises as it fell, and returns to the height it started from.",
        lambda shown: np.abs(peaks(shown, NO_CORRECTION) - start).max() <= seen + 1e-9,
    )
    yield Claim(
        "reference:exercise projects the ball back to the floor at each bounce; no bounce rises"
        " higher than the start.",
        lambda shown: peaks(shown, PLAIN).max() <= start,
    )
    yield lies_on(NO_CCD, order == "aimed after gravity", single, "m")
    yield lies_on(NO_CORRECTION, order == "aimed before gravity", 1e-11, "m")


def peaks(shown: Shown, name: str) -> Array:
    """m, the heights at which a bouncing ball turns, as the second chart has them."""
    return shown.y(name, 1)[1:]


def turned(y: Array) -> Array:
    """m, the heights at which it turns, at the samples."""
    return y[1:-1][(y[1:-1] >= y[:-2]) & (y[1:-1] > y[2:])]


GRAVITY = Lesson(
    name="gravity",
    number="6.4",
    title="Impulse before or after gravity",
    asks="Why does a ball in Box2D bounce ever higher?",
    text="""
    A bounce reverses the velocity with which a ball meets the floor. If gravity has already
    changed this velocity in the step, the change is reversed, too. <b>Continuous collision
    detection</b> (CCD) looks for a contact along the whole path of a disk in a step, not only
    at its end. Box2D plays twice, with CCD and without it (<code>+no_ccd</code>), because CCD
    hides the effect at some step sizes. pymunk plays without position correction
    (<code>+no_correction</code>), which moves the ball out of the floor at each bounce.
    """,
    sliders=(
        Slider("order", "Velocity that is reversed", tuple(ORDERS), 0),
        time_step(1 / 60, (8, 4, 2, 1), 1),
    ),
    names=(*NAMES, TRUTH),
    show=show_gravity,
)
