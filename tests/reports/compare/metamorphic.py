"""A scenario, its exact answer and what was played of it, all stated otherwise: turned, shifted, in
other units ...

What is changed is what was played, not how: the metrics are under test here, and no engine. Steps,
samples and the collisions of a stepping engine are put on the grid of the new units, as the engine
would have put them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from crosscheck2d.adapters.run import Run
from crosscheck2d.scenarios.model import (
    Array,
    Collisions,
    Scenario,
    Scene,
    Thrust,
    Trajectory,
    frozen,
)

ON_GRID = 1e-6  # of a step: a collision that is as near to the end of one was found there


def the_same(w: int, _x: Array, _walls: Array, _truth: bool) -> Sequence[int]:
    return (w,)


@dataclass(frozen=True, kw_only=True)
class Change:
    """Another way to tell the same.

    Attributes:
        length, time, mass: m, s and kg in the new units.
        turn: rad; flip: -1 for the mirror image (y -> -y, before the turn).
        shift: m; boost: m/s, both in the new frame and units.
        order: for n disks, which comes where; walls: those of a scene -> new ones; wall: of each
            collision -> the new walls.
        thrusts: of a scenario -> new ones.
    """

    length: float = 1.0
    time: float = 1.0
    mass: float = 1.0
    turn: float = 0.0
    flip: int = 1
    shift: tuple[float, float] = (0.0, 0.0)
    boost: tuple[float, float] = (0.0, 0.0)
    order: Callable[[int], np.ndarray] = np.arange
    walls: Callable[[Array], Array] = field(default=lambda walls: walls)
    wall: Callable[[int, Array, Array, bool], Sequence[int]] = the_same
    thrusts: Callable[[Sequence[Thrust]], Sequence[Thrust]] = field(default=lambda thrusts: thrusts)

    def way(self, vectors: Array) -> Array:
        c, s = np.cos(self.turn), np.sin(self.turn)
        x, y = vectors[..., 0], vectors[..., 1] * self.flip
        if not self.turn:  # exactly, so that what stands upright goes on doing so
            return np.stack([x, y], axis=-1)
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)

    def place(self, x: Array, t: Array | float = 0.0) -> Array:
        moved = np.asarray(t)[..., None] * np.array(self.boost) if any(self.boost) else 0.0
        return self.length * self.way(np.asarray(x)) + np.array(self.shift) + moved

    def speed(self, v: Array) -> Array:
        return self.length / self.time * self.way(np.asarray(v)) + np.array(self.boost)

    def scene(self, scene: Scene) -> Scene:
        order = self.order(scene.n)
        unit = self.length / self.time
        velocity = np.where(scene.static[:, None], 0.0, self.speed(scene.velocity))
        return Scene(
            position=self.place(scene.position)[order],
            velocity=velocity[order],
            radius=self.length * scene.radius[order],
            mass=self.mass * scene.mass[order],
            restitution=scene.restitution,
            friction=scene.friction,
            angle=(self.flip * scene.angle + self.turn)[order],
            angular_velocity=(self.flip / self.time * scene.angular_velocity)[order],
            inertia=self.mass * self.length**2 * scene.inertia[order],
            walls=self.place(self.walls(scene.walls)),
            gravity=unit / self.time * self.way(scene.gravity),
            wrap=None if scene.wrap is None else np.sort(self.place(scene.wrap), axis=0),
        )

    def thrust(self, thrust: Thrust, n: int) -> Thrust:
        flipped = (
            thrust.force * [1, self.flip] if thrust.frame == "body" else self.way(thrust.force)
        )
        force = self.mass * self.length / self.time**2 * flipped
        torque = self.mass * self.length**2 / self.time**2 * self.flip * thrust.torque
        disk = int(np.argsort(self.order(n))[thrust.disk])
        return Thrust(
            disk, self.time * thrust.start, self.time * thrust.stop, force, torque, thrust.frame
        )

    def scenario(self, one: Scenario) -> Scenario:
        thrusts = [self.thrust(thrust, one.scene.n) for thrust in self.thrusts(one.thrusts)]
        new = replace(
            one,
            scene=self.scene(one.scene),
            duration=self.time * one.duration,
            sample_interval=self.time * one.sample_interval,
            thrusts=thrusts,
            truth=None,
        )
        if one.truth is None:
            return new
        old = one.truth

        def truth(t: Array) -> Trajectory:
            sampled = len(t) == len(new.times) and np.array_equal(t, new.times)
            known = old(one.times if sampled else np.clip(t / self.time, 0.0, old(one.times).t[-1]))
            return self.trajectory(known, one, t[: len(known)], None)

        return replace(new, truth=truth)

    def trajectory(self, old: Trajectory, one: Scenario, t: Array, dt: float | None) -> Trajectory:
        """What was played of a scenario with steps of `dt` s (None: its exact answer), at the times
        `t` s now."""
        order = self.order(one.scene.n)
        velocity = np.where(one.scene.static[:, None], 0.0, self.speed(old.velocity))
        return Trajectory(
            t=frozen(t),
            position=frozen(self.place(old.position, t[:, None])[:, order]),
            velocity=frozen(velocity[:, order]),
            angle=frozen((self.flip * old.angle + self.turn)[:, order]),
            angular_velocity=frozen((self.flip / self.time * old.angular_velocity)[:, order]),
            collisions=self.collisions(old, one, dt),
            horizon=self.time * old.horizon,
            error_bound=self.length * old.error_bound,
            reason=old.reason,
        )

    def collisions(self, old: Trajectory, one: Scenario, dt: float | None) -> Collisions:
        """The collisions of what was played; those that the end of a step has found are found there
        again."""
        collisions, rows, number = old.collisions, [], np.argsort(self.order(one.scene.n))
        asked = one.truth if dt is None and len(collisions) else None
        where = (
            asked(collisions.t).position
            if asked
            else old.position[np.searchsorted(old.t, collisions.t).clip(max=len(old) - 1)]
        )
        for t, i, j, impulse, x in zip(
            collisions.t, collisions.i, collisions.j, collisions.impulse, where
        ):
            steps = round(t / dt) if dt else 0
            found = dt is not None and abs(steps - t / dt) < ON_GRID
            now = steps * (self.time * dt) if dt and found else self.time * t
            others = (
                [number[j]]
                if j >= 0
                else [-1 - w for w in self.wall(-1 - j, x[i], one.scene.walls, dt is None)]
            )
            rows += [
                (now, int(number[i]), int(o), impulse * self.mass * self.length / self.time)
                for o in others
            ]
        return Collisions.of(rows)

    def run(self, run: Run, one: Scenario) -> Run:
        times = np.arange(len(run.trajectory)) * (self.time * one.sample_interval)
        new = self.trajectory(run.trajectory, one, times, run.dt)
        return replace(run, dt=self.time * run.dt, trajectory=new)

    def factor(self, unit: str) -> float:
        rates = {
            "m": self.length,
            "m/s": self.length / self.time,
            "s": self.time,
            "rad/s": 1 / self.time,
            "N s": self.mass * self.length / self.time,
            "J": self.mass * self.length**2 / self.time**2,
        }
        return 1.0 if unit in PLAIN else rates[unit]


# units that no change of scale touches; a unit that is neither here nor in `factor` is a KeyError
PLAIN = ("1", "%", "rad", "radii", "dt", "disks", "collisions", "g", "sqrt(g R)", "of the run")
CUT = 0.37  # of each wall


def in_two(walls: Array) -> Array:
    at = walls[:, :1] + CUT * (walls[:, 1:] - walls[:, :1])
    return np.concatenate([walls[:, :1], at, at, walls[:, 1:]], axis=1).reshape(-1, 2, 2)


def which_half(w: int, x: Array, walls: Array, _truth: bool) -> Sequence[int]:
    along = walls[w, 1] - walls[w, 0]
    return (2 * w + int((x - walls[w, 0]) @ along > CUT * (along @ along)),)


def both(w: int, _x: Array, walls: Array, truth: bool) -> Sequence[int]:
    """Of two walls in one place an engine reports both, the exact answer the second."""
    return (w + len(walls),) if truth else (w, w + len(walls))


def one_after_the_other(thrusts: Sequence[Thrust]) -> Sequence[Thrust]:
    halves = [(t, t.start + CUT * (t.stop - t.start)) for t in thrusts]
    return [part for t, at in halves for part in (replace(t, stop=at), replace(t, start=at))]


def side_by_side(thrusts: Sequence[Thrust]) -> Sequence[Thrust]:
    return [
        replace(t, force=p * t.force, torque=p * t.torque) for t in thrusts for p in (CUT, 1 - CUT)
    ]


CHANGES = {
    "permuted": Change(order=lambda n: np.arange(n)[::-1]),
    "rolled": Change(order=lambda n: np.roll(np.arange(n), 1)),
    "mirrored": Change(flip=-1),
    "turned": Change(turn=0.7),
    "turned by a quarter and mirrored": Change(turn=np.pi / 2, flip=-1),
    "boosted": Change(boost=(0.3, -0.2)),
    "shifted": Change(shift=(37.1, -12.3)),
    "ten times as fast": Change(time=0.1),
    "a third as fast": Change(time=3.0),
    "in ms": Change(time=1e3),
    "in mm": Change(length=1e3),
    "in km": Change(length=1e-3),
    "in g": Change(mass=1e3),
    "in feet, minutes and pounds": Change(length=3.28084, time=1 / 60, mass=2.20462),
    "walls cut in two": Change(walls=in_two, wall=which_half),
    "walls doubled": Change(walls=lambda walls: np.concatenate([walls, walls]), wall=both),
    "thrusts cut in two": Change(thrusts=one_after_the_other),
    "thrusts shared by two": Change(thrusts=side_by_side),
}
