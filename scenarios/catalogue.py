"""All scenarios by name, in reading order."""

from __future__ import annotations

from collections.abc import Callable

from scenarios.crowds import CROWDS
from scenarios.exercise import EXERCISE
from scenarios.lesson import LESSON
from scenarios.model import Scenario
from scenarios.pairs import PAIRS
from scenarios.rows import ROWS
from scenarios.thrusts import THRUSTS
from scenarios.walls import WALLS

SCENARIOS: dict[str, Callable[..., Scenario]] = {
    builder().name: builder for builder in (*LESSON, *PAIRS, *WALLS, *ROWS, *THRUSTS, *EXERCISE, *CROWDS)
}
DRAWN = {"falling_box", "asteroids", "gas_of_100"}
"""Scenarios drawn from a seed; the others are the same for every seed."""


def scenario(name: str, seed: int = 0) -> Scenario:
    """The scenario of that name, drawn from `seed` if it is drawn at all.

    Raises:
        KeyError: no scenario has that name.
    """
    return SCENARIOS[name](seed=seed) if name in DRAWN else SCENARIOS[name]()
