"""`View`: a run and the trajectory it is measured against. It is the argument of every metric."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engine_row import FLOAT64
from crosscheck2d.adapters.engines import known_row
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.collisions import (
    SAME,
    WINDOW,
    Matched,
    interval,
    match,
    on_faces,
)
from crosscheck2d.reports.compare.delays import (
    Jumps,
    collision_free,
    energy_range,
    momentum_outside,
    nearest_velocity,
)
from crosscheck2d.reports.compare.restitution import Restitutions, effective_restitution
from crosscheck2d.scenarios.model import Array, Collisions, Scenario, Scene, Trajectory

# sample intervals of falling, times (1 + e) / 2: e is known to a tenth even if a step is as long as
# an interval; irrational, so that no closing speed equals the threshold
SLOWEST = 401**0.5
LEAST_SHARE = 0.1
"""Fraction of the samples after the start, or of the true collisions, that must be usable for a
number to be judged. Engines err in collisions. Less than a tenth of the samples is mostly the
flight before the first collision, where no engine errs; less than a tenth of the collisions are the
easiest ones, those that a step can resolve."""
NOT_JUDGED = "not judged"


class Value(NamedTuple):
    value: float
    disk: int = -1  # -1: all
    at: float = np.nan  # s
    note: str = ""
    judged: bool = True


def not_judged(reason: str) -> Value:
    """The value of a metric that applies, but for which too few samples or collisions are
    judged."""
    return Value(np.nan, note=f"{NOT_JUDGED}: {reason}", judged=False)


@dataclass(frozen=True, eq=False)
class View:
    """The trajectory of a run and the one it is measured against, over their common samples."""

    scenario: Scenario
    dt: float  # s, of the engine
    played: Trajectory
    other: Trajectory | None = None  # the truth, another engine's, or None: only the laws
    jumps: Jumps | None = None  # of `other` (delays.py) if it is the truth
    rounding: float = FLOAT64  # relative, of the numbers that the engine keeps
    silent: bool = False  # whether one of the two reports no collisions

    @property
    def scene(self) -> Scene:
        return self.scenario.scene

    @property
    def reference(self) -> Trajectory:
        """`other`, in a view that has one."""
        assert self.other is not None
        return self.other

    @cached_property
    def deviation(self) -> Array:
        """(k, n) m between the two."""
        return laws.deviation(self.played, self.reference, self.scene)

    # Which samples are compared.

    @cached_property
    def judged(self) -> np.ndarray:
        """(k, n) bool, where the velocity of a disk is compared; never at the start, which is
        given.

        With the truth: up to `WINDOW` dt before its end, because an engine may already have a
        collision that the truth has only after its end. With another engine, where either may be
        late: if that disk has no collision within `WINDOW` dt in either trajectory.
        """
        if self.jumps is None:
            free = collision_free(self.played, self.dt) & collision_free(self.reference, self.dt)
        else:
            free = (self.played.t < self.reference.t[-1] - WINDOW * self.dt)[:, None]
        judged: np.ndarray = free & ~self.scene.static
        judged[0] = False
        return judged

    @cached_property
    def judged_spin(self) -> np.ndarray:
        """(k, n) bool, where the spin of a disk is compared: where its velocity is, and with
        friction, which changes spins, only if the disk has no collision within `WINDOW` dt in the
        truth either."""
        if not self.scene.friction:
            return self.judged
        judged: np.ndarray = self.judged & collision_free(self.reference, self.dt)
        return judged

    def share(self, judged: np.ndarray) -> float:
        """The fraction of the samples after the start, disk by disk, that are `judged` (k, n)."""
        every = (len(self.played) - 1) * int((~self.scene.static).sum())
        return float(judged.sum() / every) if every else 0.0

    def carried(self, judged: np.ndarray) -> str:
        """How many of the samples are `judged` (k, n), in words."""
        samples, moving = len(self.played) - 1, int((~self.scene.static).sum())
        whole = judged.any(axis=1)
        if self.jumps is not None and judged.sum() == whole.sum() * moving:
            return f"{whole.sum()} of {samples} samples"
        return f"{judged.sum()} of {samples * moving} samples of a disk"

    # Differences, with the detection delay allowed for if the other is the truth; nan where nothing
    # is judged. Beside an engine momentum and energy are summed over the judged disks only.

    @cached_property
    def velocity_deviation(self) -> Array:
        """(k, n) m/s."""
        expected = self.reference.velocity
        if self.jumps is not None:
            expected = nearest_velocity(self.played, self.reference, self.jumps, self.dt)
        return np.where(self.judged, laws.lengths(self.played.velocity - expected), np.nan)

    @cached_property
    def momentum_deviation(self) -> Array:
        """(k,) kg m/s."""
        played, reference, scene = self.played, self.reference, self.scene
        if self.jumps is None:
            difference = laws.momenta(played, scene) - laws.momenta(reference, scene)
            return laws.lengths(self._sum_judged(difference))
        off = momentum_outside(played, reference, self.jumps, self.dt, scene)
        return np.where(self.judged.any(axis=1), off, np.nan)

    @cached_property
    def energy_deviation(self) -> Array:
        """(k,) J, energy of the engine minus that of the other."""
        played, reference, scene = self.played, self.reference, self.scene
        if self.jumps is None:
            return self._sum_judged(laws.energies(played, scene) - laws.energies(reference, scene))
        energy = laws.energy(played, scene)
        off = energy - np.clip(energy, *self.energy_range)
        return np.where(self.judged.any(axis=1), off, np.nan)

    @cached_property
    def energy_range(self) -> tuple[Array, Array]:
        """((k,), (k,)) J, the least and the largest energy that the truth allows within the
        detection delay."""
        assert self.jumps is not None
        return energy_range(self.played, self.reference, self.jumps, self.dt, self.scene)

    def _sum_judged(self, difference: Array) -> Array:
        """The sum over the judged disks of (k, n, ...)."""
        judged = self.judged.reshape(*self.judged.shape, *[1] * (difference.ndim - 2))
        return np.where(judged.any(axis=1), np.where(judged, difference, 0.0).sum(axis=1), np.nan)

    @cached_property
    def collision_free_samples(self) -> np.ndarray:
        """(k,) False at samples within `WINDOW` dt of a collision of the other; sample 0 always
        counts.

        Used by the error budget, which subtracts runs. Not for a metric: in a crowd only the start
        would be left.
        """
        free, t = np.ones(len(self.played), bool), self.played.t
        if len(collisions := self.reference.collisions.t):
            following = np.searchsorted(collisions, t)
            before = t - collisions[np.maximum(following - 1, 0)]
            after = collisions[np.minimum(following, len(collisions) - 1)] - t
            free = np.minimum(np.abs(before), np.abs(after)) > WINDOW * self.dt
            free[0] = True
        return free

    # Collisions.

    @cached_property
    def restitutions(self) -> Restitutions:
        """The restitution read off the samples; empty under thrust.

        Under gravity slow collisions are left out, because gravity is subtracted to first order
        only.
        """
        if self.scenario.thrusts:
            return Restitutions(np.zeros(0), np.zeros(0), np.zeros(0), 0, 0)
        slowest = SLOWEST * (1 + self.scene.restitution) / 2 * self.scenario.sample_interval
        slowest *= float(np.linalg.norm(self.scene.gravity))
        return effective_restitution(self.played, self.scene, self.dt, slowest, self.rounding)

    @cached_property
    def collisions(self) -> tuple[Collisions, Collisions]:
        """The collisions of the engine and of the other, by what a disk can distinguish
        (`on_faces`)."""
        return on_faces(self.played, self.scene), on_faces(self.reference, self.scene)

    @property
    def end(self) -> float:
        """s, the last common sample."""
        return float(min(self.played.t[-1], self.reference.t[-1]))

    @cached_property
    def matched(self) -> Matched:
        return match(*self.collisions, self.end, self.dt)


def beside(
    scenario: Scenario,
    run: Run,
    other: Trajectory | None,
    jumps: Jumps | None,
    silent: bool = False,
) -> View:
    """The view of a run and `other` over their common samples; `silent`: that engine reports no
    collisions."""
    assert run.trajectory is not None
    k = len(run.trajectory) if other is None else min(len(run.trajectory), len(other))
    other, played = None if other is None else cut(other, k), cut(run.trajectory, k)
    silent = silent or run.silent
    return View(scenario, run.dt, played, other, jumps, rounding_of(run.name), silent)


def rounding_of(name: str) -> float:
    """The relative rounding of the numbers of an `engine:profile`; those of a solver's file are
    float64."""
    row = known_row(name)
    return row.rounding if row else FLOAT64


def cut(trajectory: Trajectory, k: int) -> Trajectory:
    """The first `k` samples and the collisions up to the last of them."""
    if k == len(trajectory):
        return trajectory
    # Steps, and so collisions, lie on the grid of the samples: a collision at the last of them is
    # kept, however it rounds.
    collisions = trajectory.collisions
    early = collisions.t <= trajectory.t[k - 1] + SAME * interval(trajectory)
    arrays = ("t", "position", "velocity", "angle", "angular_velocity")
    return replace(
        trajectory,
        **{name: getattr(trajectory, name)[:k] for name in arrays},
        collisions=Collisions(
            *(getattr(collisions, name)[early] for name in ("t", "i", "j", "impulse"))
        ),
    )
