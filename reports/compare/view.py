"""`View`: a run and the trajectory it is measured against; the one argument of every metric."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from adapters.engine_row import FLOAT64
from adapters.engines import ENGINES, FETCHED
from adapters.run import Run
from reports.compare import laws
from reports.compare.collisions import Matched, match
from reports.compare.delays import (
    WINDOW,
    Jumps,
    collision_free,
    energy_range,
    momentum_outside,
    nearest_velocity,
)
from reports.compare.faces import SAME, interval, on_faces
from reports.compare.restitution import Restitutions, effective_restitution
from scenarios.model import Array, Collisions, Scenario, Trajectory

# sample intervals of falling; irrational, as of a threshold that speeds may be equal to
SLOWEST = 401**0.5
LEAST_SHARE = 0.1
"""Of the samples after the start, or of the true collisions, that must carry a number for it to be
judged by. An engine errs in collisions: what is left of a run in less than a tenth of its samples
is mostly the flight before the first of them, where nobody errs; and those of the collisions that a
step can tell apart are the easiest."""
# begins the note of a number that is NaN because too few samples are judged
NOT_JUDGED = "not judged"


class Value(NamedTuple):
    """A number and where it comes from: the disk (-1: all), the instant in s, a remark."""

    value: float
    disk: int = -1
    at: float = np.nan
    note: str = ""


def not_judged(why: str) -> Value:
    """The value of a metric that applies, where too few samples or collisions are judged."""
    return Value(np.nan, note=f"{NOT_JUDGED}: {why}")


@dataclass(frozen=True, eq=False)
class View:
    """The trajectory of a run and the one it is measured against, over the samples both have.

    Attributes:
        scenario: what was played.
        dt: s, of the engine.
        played: the engine's trajectory, cut to the samples the other has.
        other: the truth, another engine's trajectory, or None: only the laws of physics.
        jumps: of `other` (delays.py) if it is the truth; None for an engine.
        rounding: the relative rounding of the numbers that the engine keeps.
        silent: whether one of the two reports no collisions, so that they cannot be compared.
    """

    scenario: Scenario
    dt: float
    played: Trajectory
    other: Trajectory | None = None
    jumps: Jumps | None = None
    rounding: float = FLOAT64
    silent: bool = False

    @cached_property
    def deviation(self) -> Array:
        """(k, n) m between the two."""
        assert self.other is not None
        return laws.deviation(self.played, self.other, self.scenario.scene)

    @cached_property
    def judged(self) -> np.ndarray:
        """(k, n) where the velocity of a disk is compared; never at the start, which is given.

        With the truth: up to `WINDOW` dt before its end, because an engine may already have a
        collision that the truth has only after its end. With another engine, of which either may
        be late: where neither has a collision of that disk within `WINDOW` dt.
        """
        assert self.other is not None
        played, moving = self.played, ~self.scenario.scene.static
        if self.jumps is None:
            free = collision_free(played, self.dt) & collision_free(self.other, self.dt)
            judged: np.ndarray = free & moving
        else:
            judged = (played.t < self.other.t[-1] - WINDOW * self.dt)[:, None] & moving
        judged[0] = False
        return judged

    @cached_property
    def share(self) -> float:
        """The fraction of the samples after the start, disk by disk, that are judged."""
        every = (len(self.played) - 1) * int((~self.scenario.scene.static).sum())
        return float(self.judged.sum() / every) if every else 0.0

    @cached_property
    def carried(self) -> str:
        """How many of the samples are judged, in words."""
        samples = len(self.played) - 1
        if self.jumps is not None:
            return f"{self.judged.any(axis=1).sum()} of {samples} samples"
        return (
            f"{self.judged.sum()} of {samples * (~self.scenario.scene.static).sum()} samples of a"
            " disk"
        )

    @cached_property
    def velocity_deviation(self) -> Array:
        """(k, n) m/s between the two, of the truth within the detection delay; nan where it is not
        judged."""
        assert self.other is not None
        expected = self.other.velocity
        if self.jumps is not None:
            expected = nearest_velocity(self.played, self.other, self.jumps, self.dt)
        return np.where(self.judged, laws.lengths(self.played.velocity - expected), np.nan)

    @cached_property
    def angular_velocity_deviation(self) -> Array:
        """(k, n) rad/s between the two; 0 where it is not compared.

        Without friction no collision changes a spin, so that none is late or early; with it, those
        within `WINDOW` dt of a collision of the disk are not compared.
        """
        assert self.other is not None
        deviation: Array = np.abs(self.played.angular_velocity - self.other.angular_velocity)
        if not self.scenario.scene.friction:
            return deviation
        free = collision_free(self.other, self.dt)
        if self.jumps is None:
            free = free & collision_free(self.played, self.dt)
        return np.where(free, deviation, 0.0)

    @cached_property
    def momentum_deviation(self) -> Array:
        """(k,) kg m/s between the momenta of the two, of the truth within the detection delay; nan
        if not judged.

        Beside an engine only those of the disks that are judged are added up.
        """
        assert self.other is not None
        if self.jumps is not None:
            off = momentum_outside(
                self.played, self.other, self.jumps, self.dt, self.scenario.scene
            )
            return np.where(self.judged.any(axis=1), off, np.nan)
        momenta = (laws.momenta(one, self.scenario.scene) for one in (self.played, self.other))
        return laws.lengths(self._summed(next(momenta) - next(momenta)))

    @cached_property
    def energy_range(self) -> tuple[Array, Array]:
        """((k,), (k,)) J, between which the truth's energy is within the detection delay."""
        assert self.other is not None
        assert self.jumps is not None
        return energy_range(self.played, self.other, self.jumps, self.dt, self.scenario.scene)

    @cached_property
    def energy_deviation(self) -> Array:
        """(k,) J that the engine has more than the other, as `momentum_deviation`."""
        assert self.other is not None
        if self.jumps is not None:
            energy, (low, high) = laws.energy(self.played, self.scenario.scene), self.energy_range
            return np.where(self.judged.any(axis=1), energy - np.clip(energy, low, high), np.nan)
        energies = (laws.energies(one, self.scenario.scene) for one in (self.played, self.other))
        return self._summed(next(energies) - next(energies))

    def _summed(self, difference: Array) -> Array:
        """Over the judged disks of (k, n, ...); nan where none is."""
        judged = self.judged.reshape(*self.judged.shape, *[1] * (difference.ndim - 2))
        return np.where(judged.any(axis=1), np.where(judged, difference, 0.0).sum(axis=1), np.nan)

    @cached_property
    def angle_deviation(self) -> Array:
        """(k, n) rad between the two."""
        assert self.other is not None
        return np.abs(self.played.angle - self.other.angle)

    @cached_property
    def collision_free_samples(self) -> np.ndarray:
        """(k,) False at samples within `WINDOW` dt of a collision of the other; sample 0 always
        counts.

        For the error budget, which takes runs from each other: no metric, as in a crowd nothing but
        the start is left.
        """
        free = np.ones(len(self.played), bool)
        if self.other is not None and len(collisions := self.other.collisions.t):
            nearest = np.searchsorted(collisions, self.played.t)
            before = self.played.t - collisions[np.maximum(nearest - 1, 0)]
            after = collisions[np.minimum(nearest, len(collisions) - 1)] - self.played.t
            free = np.minimum(np.abs(before), np.abs(after)) > WINDOW * self.dt
            free[0] = True
        return free

    @cached_property
    def restitutions(self) -> Restitutions:
        """What can be read off the samples; nothing under thrust.

        Slow collisions are left out under gravity, which is taken out of the samples to first order
        only.
        """
        if self.scenario.thrusts:
            return Restitutions(np.zeros(0), np.zeros(0), 0, 0)
        scene = self.scenario.scene
        slowest = SLOWEST * float(np.linalg.norm(scene.gravity)) * self.scenario.sample_interval
        return effective_restitution(self.played, scene, slowest, self.rounding)

    @cached_property
    def collisions(self) -> tuple[Collisions, Collisions]:
        """Of the engine and of the other, by what a disk can tell apart (faces.py)."""
        assert self.other is not None
        return on_faces(self.played, self.scenario.scene), on_faces(self.other, self.scenario.scene)

    @property
    def end(self) -> float:
        """s, of the samples both have."""
        assert self.other is not None
        return float(min(self.played.t[-1], self.other.t[-1]))

    @cached_property
    def matched(self) -> Matched:
        """The collisions of the two."""
        return match(*self.collisions, self.end, self.dt)


def beside(
    scenario: Scenario,
    run: Run,
    other: Trajectory | None,
    jumps: Jumps | None,
    silent: bool = False,
) -> View:
    """What a run played beside `other`, over the samples both have; `silent`: that engine reports
    no collisions."""
    assert run.trajectory is not None
    known = ENGINES | FETCHED
    # a solver's file keeps float64
    rounding = known[run.name].rounding if run.name in known else FLOAT64
    k = len(run.trajectory) if other is None else min(len(run.trajectory), len(other))
    other = None if other is None else cut(other, k)
    silent = silent or run.silent
    return View(scenario, run.dt, cut(run.trajectory, k), other, jumps, rounding, silent)


def cut(trajectory: Trajectory, k: int) -> Trajectory:
    """The first `k` samples and the collisions up to the last of them."""
    if k == len(trajectory):
        return trajectory
    # Steps, and so collisions, lie on the grid of the samples: a collision at the last of them is
    # kept, however it rounds.
    found = trajectory.collisions
    early = found.t <= trajectory.t[k - 1] + SAME * interval(trajectory)
    return replace(
        trajectory,
        t=trajectory.t[:k],
        position=trajectory.position[:k],
        velocity=trajectory.velocity[:k],
        angle=trajectory.angle[:k],
        angular_velocity=trajectory.angular_velocity[:k],
        collisions=Collisions(found.t[early], found.i[early], found.j[early], found.impulse[early]),
    )
