"""Lesson 6.1: a restitution threshold."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Lesson,
    LessonChart,
    Shown,
    Simulation,
    Slider,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import (
    ABLATED,
    FLOAT32,
    PLAIN,
    ablated,
    distances,
    lies_on,
    setting_rows,
)
from crosscheck2d.reports.lessons.mechanisms.pairs import CLOSING, at_all_speeds, separation
from crosscheck2d.reports.page.style import TRUTH, number

NAMES = ("box2d:shipped", PLAIN, ABLATED)


def show_threshold(threshold: float, e: float) -> Shown:
    """e of a collision against its closing speed."""
    played = Simulation.by(at_all_speeds(e), NAMES, 4, ablated(threshold=threshold))
    curves = played.curves(separation(CLOSING), CLOSING)
    chart = LessonChart(
        "Separation over approach speed", "closing speed in m/s", "e of the collision", curves, "x"
    )
    rounding = 8 * FLOAT32  # of a ratio of velocities that are rounded a few times

    def cut_below(shown: Shown, name: str, speed: float) -> bool:
        return shown.follows(name, np.where(speed > CLOSING, 0.0, e), rounding)

    claims = [
        Claim(
            f"box2d:shipped takes every collision below 1 m/s as inelastic, and gives every faster"
            f" collision the stated e = {e}.",
            lambda shown: cut_below(shown, "box2d:shipped", 1.0),
        ),
        Claim(
            f"The ablated reference does so below {number(threshold)} m/s."
            if threshold
            else "The ablated reference has no threshold yet, and reference:exercise has none.",
            lambda shown: cut_below(shown, ABLATED, threshold) and cut_below(shown, PLAIN, 0.0),
        ),
        lies_on("box2d:shipped", threshold == 1.0, rounding),
    ]
    facts = [*setting_rows(played.runs, "restitution threshold in m/s"), *distances(chart)]
    return Shown([chart], played.film, facts, claims)


THRESHOLD = Lesson(
    name="threshold",
    number="6.1",
    title="A restitution threshold",
    asks="Why do slow disks stick in Box2D?",
    text="""
    An engine may take a collision below a threshold of closing speed as inelastic, so that
    disks come to rest. The threshold is a speed in the units of the scene. Raise it in the
    ablated reference until its curve lies on that of Box2D.
    """,
    sliders=(
        Slider("threshold", "Threshold", (0.0, 0.25, 0.5, 1.0, 2.0), 0, "m/s"),
        Slider("e", "Restitution e", (0.5, 0.9, 1.0), 1),
    ),
    names=(*NAMES, TRUTH),
    show=show_threshold,
)
