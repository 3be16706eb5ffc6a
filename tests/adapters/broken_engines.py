"""Adapters with one fault each, made from the reference adapter: what the conformance suite is
there to catch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse, Engine, Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.reference_impl import exercise, ordered
from crosscheck2d.scenarios.model import State


class Sound(Reference):
    def __init__(self) -> None:
        super().__init__(exercise)


class LeaksMomentum(Sound):
    """A millionth of a disk's velocity is lost in every collision."""

    def step(self, count=1):
        for _ in range(count):
            before = len(self.log)
            super().step()
            for collision in self.log[before:]:
                self.disks.velocity[collision.i] *= 1 - 1e-6


class GivesLiveView(Sound):
    """`read` hands out the solver's own arrays."""

    def read(self):
        disks = self.disks
        return State(disks.position, disks.velocity, disks.angle, disks.angular_velocity)


class IgnoresDt(Sound):
    def load(self, scene, dt):  # noqa: ARG002 - that is the fault
        super().load(scene, 1 / 60)


class IgnoresCount(Sound):
    def step(self, count=1):
        super().step(min(count, 1))


class SquaresRestitution(Sound):
    """e on both bodies, and the engine multiplies."""

    def load(self, scene, dt):
        super().load(replace(scene, restitution=scene.restitution**2), dt)


class StopsSlowCollisions(Sound):
    def load(self, scene, dt):
        slow = np.ptp(scene.velocity, axis=0).max() < 1
        super().load(replace(scene, restitution=0.0) if slow else scene, dt)


class NanAtStep7(Sound):
    def step(self, count=1):
        for _ in range(count):
            super().step()
            if self.steps == 7:
                self.disks.velocity[0] = np.nan


class ForceLasts(Sound):
    """Nobody clears the forces."""

    def step(self, count=1):
        self.forced = False
        super().step(count)


class LoadKeepsCollisions(Sound):
    """The log of the last scene is still there."""

    def load(self, scene, dt):
        kept = getattr(self, "log", [])
        super().load(scene, dt)
        self.log = kept


class LoadKeepsForce(Sound):
    def load(self, scene, dt):
        waiting = self.disks.force.sum(axis=0) if getattr(self, "forced", False) else None
        super().load(scene, dt)
        if waiting is not None:
            self.apply_force(0, waiting, 0.0)


class SharesOneWorld(Sound):
    """All engines of the process step by the dt of the one loaded last."""

    latest = SimpleNamespace(dt=0.0)

    def load(self, scene, dt):
        super().load(scene, dt)
        self.latest.dt = dt * scene.radius.max()

    def step(self, count=1):
        _, world = self.advance.args
        world[0] = self.latest.dt
        super().step(count)


class PutsStaticLast(Sound):
    """Moving bodies first, as an engine keeps them."""

    def read(self):
        order = np.argsort(np.isinf(self.disks.mass), kind="stable")
        return State(*(array[order] for array in vars(super().read()).values()))


class ReadsFloat32(Sound):
    def read(self):
        return State(*(array.astype(np.float32) for array in vars(super().read()).values()))


class MassFromDensity(Sound):
    """A fixture of density 1 set the mass after it was given."""

    def load(self, scene, dt):
        super().load(
            replace(scene, mass=np.where(scene.static, np.inf, np.pi * scene.radius**2)), dt
        )


class SolidDiskInertia(Sound):
    def load(self, scene, dt):
        super().load(replace(scene, inertia=scene.mass * scene.radius**2 / 2), dt)


class VelocityHalfAStepOff(Sound):
    """Leapfrog: the velocities belong to the middle of the step."""

    def read(self):
        state = super().read()
        state.velocity[...] += self.world.gravity * self.dt / 2
        return state


class OtherOrderOfUpdates(Sound):
    """Gravity by Verlet, while the row says symplectic Euler."""

    def step(self, count=1):
        moving = np.isfinite(self.disks.mass)
        for _ in range(count):
            super().step()
            self.disks.position[moving] -= self.world.gravity * self.dt**2 / 2


class StaticGivesWay(Sound):
    """A static disk is only heavy."""

    def load(self, scene, dt):
        super().load(replace(scene, mass=np.where(scene.static, 1e6, scene.mass), inertia=None), dt)


class ReportsNoCollisions(Sound):
    def collisions(self):
        return []


class NumbersWallsFromTheEnd(Sound):
    """Walls are known by the engine's list, which is the scene's reversed."""

    def collisions(self):
        return [
            ContactImpulse(
                h.step, h.i, h.j if h.j >= 0 else -1 - (len(self.world.walls) - -h.j), h.impulse
            )
            for h in self.log
        ]


class CountsStepsFromOne(Sound):
    def collisions(self):
        return [collision._replace(step=collision.step + 1) for collision in self.log]


class ReportsImpulsePerSecond(Sound):
    def collisions(self):
        return [collision._replace(impulse=collision.impulse / self.dt) for collision in self.log]


class RubsSidewise(Sound):
    """The default friction is on: a collision turns a part of the spin into sideways speed."""

    def step(self, count=1):
        for _ in range(count):
            before = len(self.log)
            super().step()
            for collision in self.log[before:]:
                for disk in (collision.i, collision.j):
                    self.disks.velocity[disk, 1] += 0.01 * self.disks.angular_velocity[disk]


class FallsAsleep(Sound):
    def step(self, count=1):
        super().step(count)
        self.disks.velocity[np.hypot(*self.disks.velocity.T) < 0.01] = 0.0


class HasSpeedLimit(Sound):
    def step(self, count=1):
        super().step(count)
        self.disks.velocity[...] = np.clip(self.disks.velocity, -400.0, 400.0)


class WrapsAngles(Sound):
    """The engine keeps cos and sin, and nobody unwinds."""

    def read(self):
        state = super().read()
        state.angle[...] = np.arctan2(np.sin(state.angle), np.cos(state.angle))
        return state


class RaisesInStep(Sound):
    def step(self, count=1):
        super().step(count)
        raise RuntimeError("island solver ran out of memory")


class Exact(Reference):
    """The solver that takes collisions in their order: beside it a wrong energy is not lost among
    detection delays."""

    def __init__(self) -> None:
        super().__init__(ordered)


class Freezes(Exact):
    def step(self, count=1):
        self.disks.velocity[...] = 0.0
        self.disks.angular_velocity[...] = 0.0
        self.steps += count


class Scales(Exact):
    """At the tenth and 60th step (a ship rests before) all velocities become `factor` times as
    large."""

    factor = 1.0

    def step(self, count=1):
        for _ in range(count):
            if self.steps in (10, 60):
                self.disks.velocity[...] *= self.factor
                self.disks.angular_velocity[...] *= self.factor
            super().step()


class DoublesSpeed(Scales):
    factor = 2.0


class GainsEnergy(Scales):
    factor = 1.1**0.5


class RefusesAll(Sound):
    def load(self, scene, dt):
        super().load(replace(scene, friction=0.0), dt)
        raise Unsupported("no disks here")


# Which probe is meant for which fault; other probes may see it too.
CAUGHT_BY: dict[type[Engine], str] = {
    PutsStaticLast: "order_and_shapes",
    ReadsFloat32: "order_and_shapes",
    WrapsAngles: "order_and_shapes",
    GivesLiveView: "read_copies",
    LoadKeepsCollisions: "load_forgets",
    LoadKeepsForce: "load_forgets",
    SharesOneWorld: "worlds_are_separate",
    IgnoresCount: "counts_are_steps",
    IgnoresDt: "steps_obey_dt",
    NanAtStep7: "stays_finite",
    ForceLasts: "force_lasts_one_step",
    MassFromDensity: "mass_by_force",
    SolidDiskInertia: "inertia_by_torque",
    VelocityHalfAStepOff: "same_instant",
    ReportsNoCollisions: "collisions_are_reported",
    NumbersWallsFromTheEnd: "walls_are_reported",
    CountsStepsFromOne: "collisions_name_their_step",
    ReportsImpulsePerSecond: "impulse_is_reported",
    StaticGivesWay: "static_stays",
    OtherOrderOfUpdates: "free_flight",
    FallsAsleep: "slow_flight",
    HasSpeedLimit: "fast_flight",
    LeaksMomentum: "pair_momentum",
    StopsSlowCollisions: "restitution_0.5",
    SquaresRestitution: "restitution_wall",
    RubsSidewise: "friction",
}


def row_of(make: Callable[[], Engine]) -> EngineRow:
    return replace(ENGINES["reference:exercise"], make=make)
