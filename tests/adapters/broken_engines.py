"""Adapters with one fault each, made from the reference adapter: what the conformance suite is
there to catch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse, Engine, Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.reference_impl import exercise, ordered
from crosscheck2d.scenarios.model import Scene, State


class Sound(Reference):
    def __init__(self) -> None:
        super().__init__(exercise)


Broken = type[Sound]


def loads(change: Callable[[Scene], Scene]) -> Broken:
    """Another scene than the one that is given."""

    class Loads(Sound):
        def load(self, scene, dt):
            super().load(change(scene), dt)

    return Loads


def reads(change: Callable[[Sound, State], State]) -> Broken:
    class Reads(Sound):
        def read(self):
            return change(self, super().read())

    return Reads


def reports(change: Callable[[Sound, list[ContactImpulse]], list[ContactImpulse]]) -> Broken:
    class Reports(Sound):
        def collisions(self):
            return change(self, self.log)

    return Reports


def steps(after: Callable[[Sound, list[ContactImpulse]], None]) -> Broken:
    """What `after` does with the engine and the collisions of a step follows each step."""

    class Steps(Sound):
        def step(self, count=1):
            for _ in range(count):
                before = len(self.log)
                super().step()
                after(self, self.log[before:])

    return Steps


def leak_momentum(engine: Sound, collisions: list[ContactImpulse]) -> None:
    # a millionth of a disk's velocity is lost in every collision
    for collision in collisions:
        engine.disks.velocity[collision.i] *= 1 - 1e-6


def rub_sidewise(engine: Sound, collisions: list[ContactImpulse]) -> None:
    # the default friction is on: a collision turns a part of the spin into sideways speed
    velocity, spin = engine.disks.velocity, engine.disks.angular_velocity
    for disk in (disk for collision in collisions for disk in (collision.i, collision.j)):
        velocity[disk, 1] += 0.01 * spin[disk]


def fall_asleep(engine: Sound, _: list[ContactImpulse]) -> None:
    engine.disks.velocity[np.hypot(*engine.disks.velocity.T) < 0.01] = 0.0


def limit_speed(engine: Sound, _: list[ContactImpulse]) -> None:
    engine.disks.velocity[...] = np.clip(engine.disks.velocity, -400.0, 400.0)


def put_static_last(engine: Sound, state: State) -> State:
    # moving bodies first, as an engine keeps them
    order = np.argsort(np.isinf(engine.disks.mass), kind="stable")
    return State(*(array[order] for array in vars(state).values()))


def stop_slow_collisions(scene: Scene) -> Scene:
    return replace(scene, restitution=0.0) if np.ptp(scene.velocity, axis=0).max() < 1 else scene


def number_walls_from_the_end(engine: Sound, log: list[ContactImpulse]) -> list[ContactImpulse]:
    walls = len(engine.world.walls)
    return [hit if hit.j >= 0 else hit._replace(j=-1 - walls - hit.j) for hit in log]


class IgnoresDt(Sound):
    def load(self, scene, dt):  # noqa: ARG002 - that is the fault
        super().load(scene, 1 / 60)


class IgnoresCount(Sound):
    def step(self, count=1):
        super().step(min(count, 1))


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


class OtherOrderOfUpdates(Sound):
    """Gravity by Verlet, while the row says symplectic Euler."""

    def step(self, count=1):
        moving = np.isfinite(self.disks.mass)
        for _ in range(count):
            super().step()
            self.disks.position[moving] -= self.world.gravity * self.dt**2 / 2


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
CAUGHT_BY: dict[str, tuple[type[Engine], str]] = {
    "static disks are last": (reads(put_static_last), "order_and_shapes"),
    "float32 is read": (
        reads(lambda _, state: State(*(a.astype(np.float32) for a in vars(state).values()))),
        "order_and_shapes",
    ),
    "cos and sin are kept, and nobody unwinds": (
        reads(lambda _, s: replace(s, angle=np.arctan2(np.sin(s.angle), np.cos(s.angle)))),
        "order_and_shapes",
    ),
    "the solver's own arrays are read": (
        reads(lambda e, _: State(*(getattr(e.disks, f.name) for f in fields(State)))),
        "read_copies",
    ),
    "load keeps collisions": (LoadKeepsCollisions, "load_forgets"),
    "load keeps a force": (LoadKeepsForce, "load_forgets"),
    "engines share one world": (SharesOneWorld, "worlds_are_separate"),
    "the count of steps is ignored": (IgnoresCount, "counts_are_steps"),
    "dt is ignored": (IgnoresDt, "steps_obey_dt"),
    "NaN at step 7": (NanAtStep7, "stays_finite"),
    "nobody clears the forces": (ForceLasts, "force_lasts_one_step"),
    "a density of 1 gives the mass": (
        loads(lambda s: replace(s, mass=np.where(s.static, np.inf, np.pi * s.radius**2))),
        "mass_by_force",
    ),
    "the inertia is that of a solid disk": (
        loads(lambda s: replace(s, inertia=s.mass * s.radius**2 / 2)),
        "inertia_by_torque",
    ),
    "velocities belong to the middle of the step": (  # leapfrog
        reads(lambda e, s: replace(s, velocity=s.velocity + e.world.gravity * e.dt / 2)),
        "same_instant",
    ),
    "no collision is reported": (reports(lambda *_: []), "collisions_are_reported"),
    "walls are numbered from the end": (reports(number_walls_from_the_end), "walls_are_reported"),
    "steps are counted from 1": (
        reports(lambda _, log: [hit._replace(step=hit.step + 1) for hit in log]),
        "collisions_name_their_step",
    ),
    "an impulse is reported per second": (
        reports(lambda e, log: [hit._replace(impulse=hit.impulse / e.dt) for hit in log]),
        "impulse_is_reported",
    ),
    "a static disk is only heavy": (
        loads(lambda s: replace(s, mass=np.where(s.static, 1e6, s.mass), inertia=None)),
        "static_stays",
    ),
    "gravity by Verlet": (OtherOrderOfUpdates, "free_flight"),
    "what is slow falls asleep": (steps(fall_asleep), "slow_flight"),
    "speeds are limited": (steps(limit_speed), "fast_flight"),
    "momentum leaks": (steps(leak_momentum), "pair_momentum"),
    "slow collisions stop": (loads(stop_slow_collisions), "restitution_0.5"),
    # e on both bodies, and the engine multiplies
    "restitution is squared": (
        loads(lambda s: replace(s, restitution=s.restitution**2)),
        "restitution_wall",
    ),
    "disks rub": (steps(rub_sidewise), "friction"),
}


def row_of(make: Callable[[], Engine]) -> EngineRow:
    return replace(ENGINES["reference:exercise"], make=make)
