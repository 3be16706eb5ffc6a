"""pymunk 7 (Munk2D, a fork of Chipmunk), float64: collide at the new position, then one velocity
solve."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import pymunk

from crosscheck2d.adapters.advance import onto_torus
from crosscheck2d.adapters.engine import NO_SUCH, ContactImpulse
from crosscheck2d.adapters.matched import read_searched
from crosscheck2d.scenarios.model import Array, Scene, State

try:
    from pymunk import batch
except ImportError:  # before pymunk 6.6
    batch = None  # type: ignore[assignment]

OF_SHAPES = ("elasticity", "friction")  # the engine multiplies the two of a pair
OF_SPACE = (
    *("iterations", "collision_slop", "collision_bias", "collision_persistence", "damping"),
    "sleep_time_threshold",
)
MATCHED = read_searched("pymunk").chosen


class Pymunk:
    """`shipped`: restitution and friction go into every shape, all else is pymunk's default.

    `matched`: the roots of both, because pymunk multiplies the two of a pair; and `MATCHED`, by
    `crosscheck tune`: ten iterations, because more cost time and are not more accurate; nearly no
    slop, because the default 0.1 is a length in the scene's units; contacts are forgotten when they
    separate, because one that touches again within three steps inherits an impulse that is not
    applied again, but is reported and may be taken back. An overlap is removed in a step at e = 1,
    where nothing rests; else by 60 % in a step of 1/60 s, because a column jitters if all of it is.

    Changed one at a time by `options.py`, `table.py` and `crosscheck tune`: `turning` False gives
    every disk an infinite inertia, `spatial_hash` (cell in m, count) replaces the tree of the broad
    phase; a key of `MATCHED` replaces the value of the matched profile, any other of `settings` is
    an attribute of the space.
    """

    listening, wrapping = True, 0.0

    def __init__(
        self,
        profile: str,
        *,
        turning: bool = True,
        spatial_hash: tuple[float, int] | None = None,
        **settings: Any,
    ) -> None:
        self.matched = profile == "matched"
        self.turning, self.spatial_hash = turning, spatial_hash
        matched = MATCHED if self.matched else {}
        self.chosen = {name: settings.pop(name, value) for name, value in matched.items()}
        self.changed = settings

    def load(self, scene: Scene, dt: float) -> None:
        self.scene, self.dt, self.steps = scene, dt, 0
        self.log: list[ContactImpulse] = []
        self.space = pymunk.Space()
        self.space.gravity = tuple(scene.gravity)
        self.asked = self._asked()
        for name, value in self.asked.items():
            if name not in OF_SHAPES and hasattr(self.space, name):
                setattr(self.space, name, value)
        if self.spatial_hash is not None:
            self.space.use_spatial_hash(*self.spatial_hash)
        self.bodies: list[pymunk.Body | None] = []
        self.index: dict[pymunk.Shape, int] = {}
        for i in range(scene.n):
            self._add_disk(i)
        for w, (start, end) in enumerate(scene.walls):
            self._add_shape(
                pymunk.Segment(self.space.static_body, tuple(start), tuple(end), 0.0), -1 - w
            )
        self.moving = np.flatnonzero(~scene.static)
        self.start = np.column_stack(
            [scene.position, scene.angle, scene.velocity, scene.angular_velocity]
        )
        if self.listening:
            space: Any = self.space
            if hasattr(space, "on_collision"):
                space.on_collision(None, None, post_solve=self._record)
            else:  # before pymunk 7
                space.add_default_collision_handler().post_solve = self._record
        self.buffer = None if batch is None else batch.Buffer()

    def _asked(self) -> dict[str, Any]:
        scene = self.scene
        if not self.matched:
            of_shapes = {"elasticity": float(scene.restitution), "friction": float(scene.friction)}
            return of_shapes | self.changed
        chosen = self.chosen
        asked: dict[str, Any] = {
            "elasticity": float(np.sqrt(scene.restitution)),
            "friction": float(np.sqrt(scene.friction)),
            "iterations": chosen["iterations"],
            "collision_slop": float(chosen["slop"] * scene.radius.min()),
            "collision_bias": chosen["elastic_bias" if scene.restitution == 1 else "bias"],
            "collision_persistence": chosen["persistence"],
        }
        return asked | self.changed

    def _add_disk(self, i: int) -> None:
        scene = self.scene
        if scene.static[i]:
            self.bodies.append(None)
            shape = pymunk.Circle(self.space.static_body, scene.radius[i], tuple(scene.position[i]))
        else:
            body = pymunk.Body(scene.mass[i], scene.inertia[i] if self.turning else np.inf)
            body.position, body.velocity = tuple(scene.position[i]), tuple(scene.velocity[i])
            body.angle, body.angular_velocity = scene.angle[i], scene.angular_velocity[i]
            self.space.add(body)
            self.bodies.append(body)
            shape = pymunk.Circle(body, scene.radius[i])
        self._add_shape(shape, i)

    def _add_shape(self, shape: pymunk.Shape, index: int) -> None:
        for name in OF_SHAPES:
            setattr(shape, name, self.asked[name])
        self.space.add(shape)
        self.index[shape] = index

    def _record(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        impulse = arbiter.total_impulse.length
        if impulse > 0.0:
            a, b = arbiter.shapes
            self.log.append(ContactImpulse(self.steps, self.index[a], self.index[b], impulse))

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        if (body := self.bodies[disk]) is not None:
            body.force += tuple(force)
            body.torque += torque

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.space.step(self.dt)
            self.steps += 1
            if self.scene.wrap is not None:
                started = perf_counter()
                self._wrap()
                self.wrapping += perf_counter() - started

    def _wrap(self) -> None:
        assert self.scene.wrap is not None
        low, high = self.scene.wrap
        position = self._rows()[:, :2]
        for row in np.flatnonzero(((position < low) | (position > high)).any(axis=1)):
            place = map(onto_torus, position[row].tolist(), low.tolist(), high.tolist())
            self.bodies[self.moving[row]].position = tuple(place)

    def _rows(self) -> Array:
        # (moving, 6): x, y, angle, vx, vy, angular velocity; static bodies follow in the buffer and
        # are cut off.
        if self.buffer is None:
            moving = (body for body in self.bodies if body is not None)
            rows = [(*b.position, b.angle, *b.velocity, b.angular_velocity) for b in moving]
            return np.array(rows, float).reshape(-1, 6)
        self.buffer.clear()
        of = batch.BodyFields
        fields = of.POSITION | of.ANGLE | of.VELOCITY | of.ANGULAR_VELOCITY
        batch.get_space_bodies(self.space, fields, self.buffer)
        return np.frombuffer(self.buffer.float_buf()).reshape(-1, 6)[: len(self.moving)]

    def read(self) -> State:
        rows = self.start.copy()
        rows[self.moving] = self._rows()
        return State(rows[:, :2], rows[:, 3:5], rows[:, 2], rows[:, 5])

    def collisions(self) -> list[ContactImpulse]:
        return self.log

    def settings(self) -> dict[str, tuple[Any, Any]]:
        shape = next(iter(self.index))
        resolved = {
            "elasticity": shape.elasticity,
            "restitution of a pair": shape.elasticity**2,
            "friction": shape.friction,
            "friction of a pair": shape.friction**2,
            **{name: getattr(self.space, name, NO_SUCH) for name in OF_SPACE},
        }
        return {name: (self.asked.get(name), value) for name, value in resolved.items()}

    def versions(self) -> dict[str, str]:
        inside = "Munk2D" if int(pymunk.version.partition(".")[0]) >= 7 else "Chipmunk"
        return {"pymunk": pymunk.version, inside: pymunk.chipmunk_version}

    def close(self) -> None:
        self.space = self.bodies = self.index = None  # type: ignore[assignment]
