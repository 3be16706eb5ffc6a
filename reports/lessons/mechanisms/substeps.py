"""Lesson 6.6: substeps."""

from __future__ import annotations

from crosscheck2d.reports.lessons.lesson import Claim, Lesson, Shown, Slider, time_step
from crosscheck2d.reports.lessons.mechanisms.ablation import (
    ABLATED,
    FLOAT32,
    PLAIN,
    ablated,
    lies_on,
)
from crosscheck2d.reports.lessons.mechanisms.falling import ROUNDING_MM, falling
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Array


def show_substeps(substeps: int, k: int) -> Shown:
    """A step cut into smaller ones."""
    n = substeps
    single = 1e3 * 360 * 4 * FLOAT32  # mm: 360 substeps, heights up to 4 m

    def claims(offset: Array) -> list[Claim]:
        return [
            Claim(
                f"The ablated reference with n = {n} is g dt t / (2 n) below the parabola,"
                f" {number(offset[-1] / n)} mm in the end.",
                lambda shown: shown.follows(ABLATED, -offset / n, ROUNDING_MM),
            ),
            Claim(
                "box2d_v3:matched, called with four substeps, is g dt t / 8 below it,"
                f" {number(offset[-1] / 4)} mm in the end, within {number(single, 1)} mm: it"
                " computes in single precision.",
                lambda shown: shown.follows("box2d_v3:matched", -offset / 4, single),
            ),
            lies_on("box2d_v3:matched", n == 4, single, "mm", off=10.0),
        ]

    return falling("box2d_v3:matched", ablated(substeps=n), k, claims)


SUBSTEPS = Lesson(
    name="substeps",
    number="6.6",
    title="Substeps",
    asks="What is a step of Box2D 3.1?",
    text="""
    Box2D 3.1 divides every step into n substeps. A disk in flight has the error of a substep.
    [order] shows the error of a whole step.
    """,
    sliders=(
        Slider("substeps", "Substeps n", (1, 2, 4, 8), 0),
        time_step(1 / 60, (4, 2, 1), 2),
    ),
    names=("box2d_v3:matched", PLAIN, ABLATED, TRUTH),
    show=show_substeps,
)
