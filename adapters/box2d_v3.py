"""pyb2d3 0.11 (Box2D v3.1), float32: soft substeps with speculative contacts, then one restitution
sweep."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, cos, pi, sin
from threading import Lock
from time import perf_counter
from typing import Any

import numpy as np
import pyb2d3

from crosscheck2d.adapters.advance import onto_torus
from crosscheck2d.adapters.engine import NOT_READABLE, PASSED, ContactImpulse
from crosscheck2d.adapters.float32 import must_fit, must_not_be_cut, rounding, vector
from crosscheck2d.adapters.friction import of_shapes
from crosscheck2d.adapters.library_versions import version
from crosscheck2d.adapters.matched import read_searched
from crosscheck2d.scenarios.model import Array, Scene, State

SHIPPED: dict[str, Any] = {
    "substeps": 4,  # as the manual recommends; `step` has no default
    "hertz": 30.0,
    "damping_ratio": 10.0,
    "push_speed": 3.0,
    "continuous": True,
    "bullet": False,
}
MATCHED = read_searched("box2d_v3").chosen
SPIN_CAP = (
    "an eighth of a turn, without b2BodyDef::allowFastRotation of Box2D 3.1, which pyb2d3 does not"
    " hand on"
)
# it is global to the process: threads take turns, so that each world gets its own unit
LENGTH_UNIT = Lock()


class Box2DV3:
    """`shipped`: restitution, friction, mass and inertia are set, all else is the engine's default,
    including the friction of a scene that states none.

    `matched`: no sleep, restitution threshold or speed cap. The length unit is 0.3 of the smallest
    radius: slop and speculative margin are fractions of it; a larger margin predicts more
    collisions, and makes spurious ones of disks that pass each other. Contacts are stiffer, and
    damped less, than by default. The values are those of matched.toml, by `crosscheck tune`. A
    scene that reaches the cap on spins, which pyb2d3 cannot lift, is refused.

    Changed one at a time by `options.py`, `table.py` and `crosscheck tune`: `sleeping` (None: the
    profile's), `turning` (False: no inertia, so no spin), `friction` (None: as above); `settings`
    are keys of `MATCHED`.
    """

    listening, wrapping = True, 0.0

    def __init__(
        self,
        profile: str,
        *,
        sleeping: bool | None = None,
        turning: bool = True,
        friction: float | None = None,
        **settings: Any,
    ) -> None:
        self.matched = profile == "matched"
        self.chosen = (MATCHED if self.matched else SHIPPED) | settings
        self.asked_friction = friction
        self.substeps, self.turning = self.chosen["substeps"], turning
        self.tuning = tuned(self.chosen)
        self.sleeping = not self.matched if sleeping is None else sleeping

    def load(self, scene: Scene, dt: float) -> None:
        with LENGTH_UNIT:
            self._load(scene, dt)

    def _load(self, scene: Scene, dt: float) -> None:
        must_fit(scene)
        self.scene, self.dt, self.steps = scene, dt, 0
        self.friction = of_shapes(scene, self.matched, self.asked_friction)
        self.log: list[ContactImpulse] = []
        self.unit = 1.0
        if "length_unit" in self.chosen:
            self.unit = float(self.chosen["length_unit"] * scene.radius.min())
        pyb2d3.set_length_units_per_meter(self.unit)
        # The binding has no way to ask for the unit, but the default of this limit is 400 of it.
        self.unit_found = pyb2d3.WorldDef().maximum_linear_speed / 400
        self.spin_cap = pi / 4 / dt
        self.options = self._options()
        self.world = pyb2d3.World(gravity=vector(scene.gravity), **self.options)
        self.world.continuous_enabled = self.chosen["continuous"]
        self.world.sleeping_enabled = self.sleeping
        if self.matched or self.tuning != tuned(SHIPPED):
            self.world.set_contact_tuning(*self.tuning)
        self.world.hit_event_threshold = 0.0  # listening only: report every collision
        self.bodies = [self._disk(i) for i in range(scene.n)]
        self.every = pyb2d3.Bodies()
        for body in self.bodies:
            self.every.append(body)
        for w in range(len(scene.walls)):
            self._wall(w)
        self.angle, self.spin = np.array(scene.angle), np.array(scene.angular_velocity)
        self.seen = 0

    def _options(self) -> dict[str, float]:
        given, names = dict[str, float](), ("restitution_threshold", "maximum_linear_speed")
        if self.matched:
            given = {"maximum_linear_speed": 1e9}
        elif "length_unit" in self.chosen:  # which would scale these, too
            given = dict(zip(names, (1.0, 400.0)))
        given = given | self.chosen
        return {name: given[name] for name in names if name in given}

    def _shape(self) -> Any:
        friction = {} if self.friction is None else {"friction": self.friction}
        material = pyb2d3.surface_material(restitution=float(self.scene.restitution), **friction)
        return pyb2d3.shape_def(density=1.0, material=material, enable_hit_events=self.listening)

    def _disk(self, i: int) -> Any:
        scene = self.scene
        turn = pyb2d3.make_rot(0.0)  # make_rot(angle) is a polynomial, off by up to 1.7e-3 rad
        turn.c, turn.s = cos(scene.angle[i]), sin(scene.angle[i])
        if scene.static[i]:
            body = self.world.create_static_body(position=vector(scene.position[i]), rotation=turn)
        else:
            body = self.world.create_dynamic_body(
                position=vector(scene.position[i]),
                rotation=turn,
                linear_velocity=vector(scene.velocity[i]),
                angular_velocity=float(scene.angular_velocity[i]),
                enable_sleep=self.sleeping,
                is_bullet=self.chosen["bullet"],
            )
        body.user_data = i
        body.create_circle_shape(self._shape(), pyb2d3.circle(radius=float(scene.radius[i])))
        if not scene.static[i]:
            mass = pyb2d3.MassData()
            mass.mass = float(scene.mass[i])
            mass.rotational_inertia = float(scene.inertia[i]) if self.turning else 0.0
            mass.center = (0.0, 0.0)
            body.mass_data = mass
        return body

    def _wall(self, w: int) -> None:
        body = self.world.create_static_body()
        body.user_data = self.scene.n + w
        start, end = self.scene.walls[w]
        body.create_segment_shape(self._shape(), pyb2d3.segment(vector(start), vector(end)))

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        self.bodies[disk].apply_force_to_center(vector(force))
        self.bodies[disk].apply_torque(float(torque))

    def step(self, count: int = 1) -> None:
        with LENGTH_UNIT:
            pyb2d3.set_length_units_per_meter(self.unit)  # another world may have changed it since
            for _ in range(count):
                self.world.step(self.dt, self.substeps)
                if self.listening:
                    self._listen()
                self.steps += 1
                if self.scene.wrap is not None:
                    started = perf_counter()
                    self._wrap()
                    self.wrapping += perf_counter() - started

    def _listen(self) -> None:
        for collision in self.world.get_contact_events().hit_events():
            i, j = collision.shape_a.body.user_data, collision.shape_b.body.user_data
            self.log.append(ContactImpulse(self.steps, self._index(i), self._index(j), np.nan))

    def _index(self, user_data: int) -> int:
        return user_data if user_data < self.scene.n else self.scene.n - 1 - user_data

    def _wrap(self) -> None:
        assert self.scene.wrap is not None
        low, high = self.scene.wrap
        at = self.every.get_positions(np.empty((self.scene.n, 2), np.float32))
        for i in np.flatnonzero(((at < low) | (at > high)).any(axis=1)):
            x, y = map(onto_torus, at[i].tolist(), low.tolist(), high.tolist())
            self.bodies[i].set_transform(vector(np.array([x, y])), self.bodies[i].rotation)

    def read(self) -> State:
        # All bodies at once, as float32. The engine keeps (cos, sin), so the angle is unwound from
        # read to read.
        n, every = self.scene.n, self.every
        position = every.get_positions(np.empty((n, 2), np.float32)).astype(float)
        velocity = every.get_linear_velocities(np.empty((n, 2), np.float32)).astype(float)
        angular_velocity = every.get_angular_velocities(np.empty(n, np.float32)).astype(float)
        if self.matched:
            must_not_be_cut("spin", angular_velocity, self.spin_cap, "rad/s", SPIN_CAP)
        return State(position, velocity, self._unwound(angular_velocity), angular_velocity)

    def _unwound(self, spin: Array) -> Array:
        # The angles nearest to the prediction from the mean spin since the last read.
        turn = self.every.get_rotations(np.empty((self.scene.n, 2), np.float32)).tolist()
        raw = np.array([atan2(s, c) for c, s in turn])
        expected = self.angle + (self.spin + spin) / 2 * (self.steps - self.seen) * self.dt
        self.angle = raw + 2 * pi * np.round((expected - raw) / (2 * pi))
        self.spin, self.seen = spin, self.steps
        return self.angle.copy()

    def collisions(self) -> list[ContactImpulse]:
        # From the collision events, which report the approach speed but no impulse.
        return self.log

    def settings(self) -> dict[str, tuple[Any, Any]]:
        matched, world, options = self.matched, self.world, self.options
        return {
            "length unit in m": (self.unit if matched else None, self.unit_found),
            "restitution threshold in m/s": (
                options.get("restitution_threshold"),
                world.restitution_threshold,
            ),
            "speed cap in m/s": (options.get("maximum_linear_speed"), NOT_READABLE),
            "spin cap in rad/s": (None, NOT_READABLE),
            "linear slop in m": (None, NOT_READABLE),
            "speculative margin in m": (None, NOT_READABLE),
            "contact tuning (hertz, damping ratio, push speed in m/s)": (
                "{:g}, {:g}, {:g}".format(*self.tuning) if matched else None,
                NOT_READABLE,
            ),
            "friction": (self.friction, self.bodies[0].shapes[0].friction),
            "restitution": (self.scene.restitution, self.bodies[0].shapes[0].restitution),
            "sleeping": (self.sleeping if matched else None, world.sleeping_enabled),
            "continuous collision": (
                self.chosen["continuous"] if matched else None,
                world.continuous_enabled,
            ),
            "continuous collision between disks": (
                self.chosen["bullet"] if matched else None,
                any(body.bullet for body in self.bodies),
            ),
            "substeps": (self.substeps, PASSED),
            "float32 rounding of the start in m": (None, rounding(self.scene)),
        }

    def versions(self) -> dict[str, str]:
        return {"pyb2d3": version("pyb2d3")}

    def close(self) -> None:
        # Bodies before the world: using one afterwards is a segmentation fault.
        self.bodies, self.every = [], None
        self.world = None


def tuned(chosen: Mapping[str, Any]) -> tuple[float, float, float]:
    return chosen["hertz"], chosen["damping_ratio"], chosen["push_speed"]
