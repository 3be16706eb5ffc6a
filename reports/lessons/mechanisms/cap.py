"""Lesson 6.8: a speed cap."""

from __future__ import annotations

import numpy as np

from crosscheck2d.adapters.mechanisms.ablated import BOX2D
from crosscheck2d.reports.lessons.lesson import (
    Claim,
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
    PLAIN,
    ablated,
    asked,
    distances,
    lies_on,
    setting_rows,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.placing import lay_out

NAMES = ("box2d:shipped", PLAIN, ABLATED)
SECONDS = 3.0  # that the tenth of a second of the page on the cap is replayed for


def show_cap(cap: float, k: int) -> Shown:
    """The speed a disk has against the speed it was given."""
    given = np.geomspace(20.0, 2000.0, 15)
    scene = lay_out(
        position=np.column_stack([np.zeros(15), np.arange(15.0)]),
        velocity=np.column_stack([given, np.zeros(15)]),
        radius=0.2,
        restitution=0.0,
    )
    scenario = asked(scene, 0.1)
    dt = scenario.dt(k)
    played = Simulation.by(scenario, NAMES, k, ablated(order=BOX2D, cap=cap))
    curves = played.curves(lambda each: each.velocity[-1, :, 0], given)
    chart = LessonChart("Speed of a free disk", "speed it was given in m/s", "m/s", curves, "xy")
    claims = [
        Claim(
            f"box2d:shipped moves a disk by at most 2 m in a step of {number(1e3 * dt)} ms, and"
            f" cuts its speed to 2 m / dt = {number(2 / dt)} m/s.",
            lambda shown: shown.follows(
                "box2d:shipped", np.minimum(given, 2 / dt), 2000 * 4 * FLOAT32
            ),
        ),
        Claim(
            f"The ablated reference cuts at {number(cap)} m, {number(cap / dt)} m/s."
            if np.isfinite(cap)
            else "The ablated reference has no cap yet and keeps every speed.",
            lambda shown: shown.follows(ABLATED, np.minimum(given, cap / dt), 1e-9),
        ),
        Claim(
            "reference:exercise keeps every speed.",
            lambda shown: shown.follows(PLAIN, given, 0.0),
        ),
        # A length and a ratio rounded at up to 480 m/s.
        lies_on("box2d:shipped", cap == 2.0, 480 * 4 * FLOAT32, "m/s"),
    ]
    facts = [*setting_rows(played.runs, "speed cap in m/s"), *distances(chart, "m/s")]
    return Shown([chart], played.film, facts, claims, opening={"pace": 0.1 / SECONDS})


CAP = Lesson(
    name="cap",
    number="6.8",
    title="A speed cap",
    asks="How fast can a disk be?",
    text="""
    Box2D limits how far a disk may move in a step. It cuts the velocity to fit, not only the
    path. The limit is a length, so the highest speed depends on the step.
    """,
    sliders=(
        Slider("cap", "Farthest move in a step", (1.0, 2.0, 4.0, np.inf), 3, "m"),
        time_step(1 / 60, (4, 1), 1),
    ),
    names=(*NAMES, TRUTH),
    show=show_cap,
)
