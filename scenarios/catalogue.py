"""All scenarios by name, in reading order, and their families with headings."""

from __future__ import annotations

from collections.abc import Callable

from crosscheck2d.scenarios.families.crowds import CROWDS
from crosscheck2d.scenarios.families.exercise import EXERCISE, THRUSTS
from crosscheck2d.scenarios.families.friction import FRICTION
from crosscheck2d.scenarios.families.lesson import LESSON
from crosscheck2d.scenarios.families.pairs import PAIRS
from crosscheck2d.scenarios.families.rows import ROWS
from crosscheck2d.scenarios.families.walls import WALLS
from crosscheck2d.scenarios.model import Scenario

Build = Callable[..., Scenario]
FAMILIES: dict[str, dict[str, Build]] = {
    heading: {build().name: build for build in family}
    for heading, family in (
        ("The lesson", LESSON),
        ("Two disks meet", PAIRS),
        ("Walls, floors and fixed disks", WALLS),
        ("Disks in a row", ROWS),
        ("Thrusts and spin", THRUSTS),
        ("Friction", FRICTION),
        ("The exercise", EXERCISE),
        ("Crowds", CROWDS),
    )
}
SCENARIOS = {name: build for family in FAMILIES.values() for name, build in family.items()}
RANDOM = {"falling_box", "asteroids", "gas_of_100", "frictional_box"}
"""Scenarios that are random (seed n); the others are the same for every seed."""


def scenario(name: str, seed: int = 0) -> Scenario:
    """The scenario with this name; if it is random, sampled with `seed`.

    Raises:
        KeyError: no scenario has that name.
    """
    return SCENARIOS[name](seed=seed) if name in RANDOM else SCENARIOS[name]()
