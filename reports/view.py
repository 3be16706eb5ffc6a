"""A played trajectory beside what it is set against: the one argument of every metric."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from reports import laws
from reports.collisions import Matched, effective_restitution, match
from scenarios.model import Array, Scenario, Trajectory

TOUCHY = 3  # dt around a true hit in which velocities are not compared: the delay of the hit is measured by itself


class Value(NamedTuple):
    """A number and where it comes from: the disk (-1: all), the instant in s, a remark."""

    value: float
    disk: int = -1
    at: float = np.nan
    note: str = ""


@dataclass(frozen=True, eq=False)
class View:
    """A played trajectory beside what it is set against, over the samples both have.

    Attributes:
        scenario: what was played.
        dt: s, of the player.
        played: the player's trajectory, cut to the samples the other has.
        other: the truth, another engine's trajectory, or None: only the laws of physics.
    """

    scenario: Scenario
    dt: float
    played: Trajectory
    other: Trajectory | None = None

    @cached_property
    def apart(self) -> Array:
        """(k, n) m between the two."""
        assert self.other is not None
        return laws.deviation(self.played, self.other, self.scenario.scene)

    @cached_property
    def velocity_apart(self) -> Array:
        """(k, n) m/s between the two."""
        assert self.other is not None
        return laws.lengths(self.played.velocity - self.other.velocity)

    @cached_property
    def momentum_apart(self) -> Array:
        """(k,) kg m/s between the momenta of the two."""
        assert self.other is not None
        scene = self.scenario.scene
        return laws.lengths(laws.momentum(self.played, scene) - laws.momentum(self.other, scene))

    @cached_property
    def angle_apart(self) -> Array:
        """(k, n) rad between the two."""
        assert self.other is not None
        return np.abs(self.played.angle - self.other.angle)

    @cached_property
    def calm(self) -> np.ndarray:
        """(k,) False at samples within `TOUCHY` dt of a hit of the other; sample 0 always counts."""
        calm = np.ones(len(self.played), bool)
        if self.other is not None and len(hits := self.other.collisions.t):
            nearest = np.searchsorted(hits, self.played.t)
            before = self.played.t - hits[np.maximum(nearest - 1, 0)]
            after = hits[np.minimum(nearest, len(hits) - 1)] - self.played.t
            calm = np.minimum(np.abs(before), np.abs(after)) > TOUCHY * self.dt
            calm[0] = True
        return calm

    @cached_property
    def restitutions(self) -> tuple[Array, Array]:
        """((m,), (m,) s) e and time of the hits that can be read; none under thrust.

        Slow hits are left out under gravity, which is taken out of the samples to first order only.
        """
        if self.scenario.thrusts:
            return np.zeros(0), np.zeros(0)
        slowest = 20 * float(np.linalg.norm(self.scenario.scene.gravity)) * self.scenario.sample_interval
        return effective_restitution(self.played, self.scenario.scene, slowest)

    @cached_property
    def matched(self) -> Matched:
        """The hits of the two."""
        assert self.other is not None
        end = float(min(self.played.t[-1], self.other.t[-1]))
        return match(self.played.collisions, self.other.collisions, end, self.dt)
