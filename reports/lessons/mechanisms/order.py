"""Lesson 6.3: velocity or position first."""

from __future__ import annotations

import numpy as np

from crosscheck2d.adapters.mechanisms.ablated import EXERCISE, POSITION_FIRST
from crosscheck2d.reports.lessons.lesson import Claim, Lesson, Shown, Slider, time_step
from crosscheck2d.reports.lessons.mechanisms.ablation import ABLATED, PLAIN, ablated, lies_on
from crosscheck2d.reports.lessons.mechanisms.falling import ROUNDING_MM, falling
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.lesson import free_fall
from crosscheck2d.scenarios.model import Array

END = free_fall().duration  # s


def show_order(order: str, k: int) -> Shown:
    """Velocity then position, or position then velocity."""
    position_first = order == "position first"

    def claims(offset: Array) -> list[Claim]:
        mm, both = number(offset[-1]), number(2 * offset[-1])
        # mm/s: x + (v ± g dt / 2) t - g t² / 2 is g dt t / 2 off at every time
        faster = number(offset[-1] / END)
        return [
            Claim(
                f"pymunk:matched moves first. It is g dt t / 2 above the parabola, {mm} mm in the"
                f" end: the exact flight of a disk that is thrown g dt / 2 = {faster} mm/s faster.",
                lambda shown: shown.follows("pymunk:matched", offset, ROUNDING_MM),
            ),
            Claim(
                f"reference:exercise changes the velocity first. It is as far below, {mm} mm in the"
                " end: the exact flight of a disk that is thrown as much slower.",
                lambda shown: shown.follows(PLAIN, -offset, ROUNDING_MM),
            ),
            Claim(
                "The distance between these two is g dt t, the sum of both offsets:"
                f" {both} mm in the end.",
                lambda shown: (
                    np.abs(shown.y("pymunk:matched") - shown.y(PLAIN) - 2 * offset).max()
                    <= ROUNDING_MM
                ),
            ),
            lies_on("pymunk:matched", position_first, ROUNDING_MM, "mm"),
        ]

    steps = POSITION_FIRST if position_first else EXERCISE
    return falling("pymunk:matched", ablated(order=steps), k, claims)


ORDER = Lesson(
    name="order",
    number="6.3",
    title="Velocity or position first",
    asks="Why is a thrown disk off its parabola?",
    text="""
    With the same gravity and the same step, one engine moves a disk with the old velocity and
    another with the new velocity. [thrust] does this with a force.
    """,
    sliders=(
        Slider("order", "Order", ("velocity first", "position first"), 0),
        time_step(1 / 60, (4, 2, 1), 2),
    ),
    names=("pymunk:matched", PLAIN, ABLATED, TRUTH),
    show=show_order,
)
