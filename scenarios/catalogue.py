"""All scenarios by name, in reading order."""

from __future__ import annotations

from collections.abc import Callable

from scenarios.families.crowds import CROWDS
from scenarios.families.exercise import EXERCISE
from scenarios.families.lesson import LESSON
from scenarios.families.pairs import PAIRS
from scenarios.families.rows import ROWS
from scenarios.families.thrusts import THRUSTS
from scenarios.families.walls import WALLS
from scenarios.model import Scenario

SCENARIOS: dict[str, Callable[..., Scenario]] = {
    builder().name: builder
    for builder in (*LESSON, *PAIRS, *WALLS, *ROWS, *THRUSTS, *EXERCISE, *CROWDS)
}
RANDOM = {"falling_box", "asteroids", "gas_of_100"}
"""Scenarios that are random (seed n); the others are the same for every seed."""


def scenario(name: str, seed: int = 0) -> Scenario:
    """The scenario of that name, random (seed `seed`) if it is random at all.

    Raises:
        KeyError: no scenario has that name.
    """
    return SCENARIOS[name](seed=seed) if name in RANDOM else SCENARIOS[name]()
