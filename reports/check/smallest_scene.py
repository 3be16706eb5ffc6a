"""The result of the search in smallest.py; in its own file because importing hypothesis is slow."""

from __future__ import annotations

from dataclasses import dataclass

from scenarios.model import Scenario, Trajectory

# s, coarse, so that a scene takes milliseconds; a collision found late is judged by the state in
# which it is found
DT = 1e-2


@dataclass(frozen=True)
class Smallest:
    """A scene that shows a fault, what is wrong in it, the file's motion, and the exact one if
    there is one.

    of: the numbers, from 1, of the faults shown.
    """

    scenario: Scenario
    fault: str
    yours: Trajectory
    truth: Trajectory | None
    of: tuple[int, ...] = (1,)
