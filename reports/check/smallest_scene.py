"""What the search of smallest.py finds; apart from it, as hypothesis takes long to import."""

from __future__ import annotations

from dataclasses import dataclass

from scenarios.model import Scenario, Trajectory

# s, coarse: a scene is played in milliseconds, and a collision found late is judged by the state it
# is found in
DT = 1e-2


@dataclass(frozen=True)
class Smallest:
    """A scene that shows a fault, what is wrong in it, the file's motion and the exact one where
    there is one.

    of: the numbers, from 1, of the faults that it shows.
    """

    scenario: Scenario
    fault: str
    yours: Trajectory
    truth: Trajectory | None
    of: tuple[int, ...] = (1,)
