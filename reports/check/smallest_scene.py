"""The result of the search in smallest.py; in its own file because importing hypothesis is slow."""

from __future__ import annotations

from dataclasses import dataclass

from crosscheck2d.scenarios.model import Scenario, Trajectory

# s, coarse, so that a scene takes milliseconds; a collision found late is judged by the state in
# which it is found
DT = 1e-2


@dataclass(frozen=True)
class Smallest:
    """A scene that shows a fault, what is wrong in it, the file's motion, and the right one if
    there is one.

    of: the numbers, from 1, of the faults shown.
    """

    scenario: Scenario
    fault: str
    yours: Trajectory
    right: Trajectory | None
    of: tuple[int, ...] = (1,)

    @property
    def right_is(self) -> str:
        """What the right motion is. Under a force it is that of the exercise's formulas: from the
        exact answer x' = x + v dt, with the old v, is as far as the right order, on the other
        side."""
        stepped = f"the exercise's formulas in steps of {DT:g} s"
        return stepped if self.scenario.thrusts else "the exact answer"
