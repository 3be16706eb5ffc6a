"""All scenarios by name, in reading order."""

from __future__ import annotations

from collections.abc import Callable

from crosscheck2d.scenarios.families.crowds import CROWDS, gas_of_100
from crosscheck2d.scenarios.families.exercise import EXERCISE, THRUSTS, asteroids
from crosscheck2d.scenarios.families.friction import FRICTION, frictional_box
from crosscheck2d.scenarios.families.lesson import LESSON, falling_box
from crosscheck2d.scenarios.families.pairs import PAIRS
from crosscheck2d.scenarios.families.rows import ROWS
from crosscheck2d.scenarios.families.walls import WALLS
from crosscheck2d.scenarios.model import Scenario

FAMILIES = (LESSON, PAIRS, WALLS, ROWS, THRUSTS, FRICTION, EXERCISE, CROWDS)
SCENARIOS: dict[str, Scenario] = {member.name: member for family in FAMILIES for member in family}
RANDOM: dict[str, Callable[[int], Scenario]] = {
    "falling_box": falling_box,
    "asteroids": asteroids,
    "gas_of_100": gas_of_100,
    "frictional_box": frictional_box,
}
"""Scenarios that are random (seed n), in `SCENARIOS` with seed 0; the others are the same for every
seed."""


def scenario(name: str, seed: int = 0) -> Scenario:
    """The scenario with this name; if it is random, sampled with `seed`.

    Raises:
        KeyError: no scenario has that name.
    """
    return RANDOM[name](seed) if name in RANDOM else SCENARIOS[name]
