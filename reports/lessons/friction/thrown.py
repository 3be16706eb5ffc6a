"""A disk that is thrown against a floor, and the impulses that the floor gave it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from crosscheck2d.adapters.mechanisms.table import FRICTION, Mechanism
from crosscheck2d.reports.lessons.lesson import Simulation
from crosscheck2d.reports.lessons.mechanisms.ablation import ablated_as
from crosscheck2d.scenarios.families.friction import bounce_on_floor
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory

FALL = 5.0  # m/s towards the floor, of every disk that is thrown
ROUGH = "reference:coulomb"
APART = 0.6  # m, of disks that fly side by side, the faster ones ahead


class Taken(NamedTuple):
    """The impulses on disks from t = 0 to the end, (n,): N s along the floor and along its normal,
    and N m s about the centre."""

    along: Array
    normal: Array
    turning: Array

    @property
    def arm(self) -> Array:
        """(n,) m, the lever arm with which the impulse along the floor has turned each disk."""
        return self.turning / self.along


def thrown(
    along: ArrayLike, spin: float, restitution: float, friction: float, radius: float = 0.25
) -> Scenario:
    """Disks of 1 kg that meet the floor at `FALL` m/s downwards and `along` (n,) m/s along it, the
    faster ones later in the list: none meets another."""
    speeds = np.atleast_1d(np.asarray(along, float))
    return bounce_on_floor(
        "thrown",
        "What does a bounce with friction change?",
        speeds,
        np.full(len(speeds), spin),
        FALL,
        restitution,
        friction,
        radius,
        APART,
    )


def taken(played: Trajectory, scene: Scene) -> Taken:
    """What the disks of `thrown` took up."""
    along, normal = (scene.mass[:, None] * (played.velocity[-1] - played.velocity[0])).T
    turning = scene.inertia * (played.angular_velocity[-1] - played.angular_velocity[0])
    return Taken(along, normal, turning)


def ablated_beside(
    engine: str, rubs: Mapping[str, Any], scenario: Scenario, substeps: int
) -> Simulation:
    """The engine, the reference with friction, and the reference with all mechanisms of the engine,
    in which `rubs` are the parameters of its friction that are other than the engine's."""
    played = Simulation.by(scenario, (engine, ROUGH), substeps)
    ablated = ablated_as(played.runs[0], scenario, Mechanism(FRICTION, rubs))
    return replace(played, runs=[*played.runs, ablated])
