"""The hand-written solver of `reference_impl` as an engine."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse
from crosscheck2d.adapters.friction import must_be_frictionless
from crosscheck2d.adapters.library_versions import version
from crosscheck2d.reference_impl.blocks import ADVANCE, disks_block, disks_of, world_block, world_of
from crosscheck2d.reference_impl.state import BY_INVERSE_MASS, EQUAL, ONE_SIDED, World, make_disks
from crosscheck2d.scenarios.model import Array, Scene, State

SPLITS = {BY_INVERSE_MASS: "by inverse mass", EQUAL: "equal", ONE_SIDED: "one-sided"}
METHODS = {  # a module of reference_impl -> its settings
    "exercise": {"integrator": "symplectic Euler"},
    "neighbours": {"integrator": "symplectic Euler"},
    "coulomb": {"integrator": "symplectic Euler"},
    "lesson": {"integrator": "explicit Euler"},
    "ordered": {
        "integrator": "parabolas",
        "collisions": "in order, each where and when it happens",
        "projection": "none",
    },
}
WITH_FRICTION = ("coulomb", "ordered", "ablated_reference")


class Reference:
    """Plays one variant of `reference_impl`, or any module with the `advance` of `exercise`.

    `options` are fields of `World` that the exercise leaves free: split, approaching_only.
    `precision` is the dtype of the disks: for numpy's float32 the kernel is compiled again.
    """

    listening, wrapping = True, 0.0  # its own step wraps

    def __init__(
        self, variant: ModuleType, *, precision: type = np.float64, **options: Any
    ) -> None:
        self.variant, self.precision, self.options = variant, precision, options
        self.name = variant.__name__.split(".")[-1]

    def load(self, scene: Scene, dt: float) -> None:
        if self.name not in WITH_FRICTION:
            must_be_frictionless(scene, "this hand-written solver")
        self.dt, self.steps = dt, 0
        self.log: list[ContactImpulse] = []
        disks = make_disks(
            scene.position,
            scene.velocity,
            scene.radius,
            scene.mass,
            np.where(scene.static, np.inf, scene.inertia),  # friction turns no static disk
            scene.angle,
            scene.angular_velocity,
        )
        low, high = (np.full(2, -np.inf), np.full(2, np.inf)) if scene.wrap is None else scene.wrap
        world = World(
            restitution=float(scene.restitution),
            friction=float(scene.friction),
            gravity=np.array(scene.gravity),
            walls=np.array(scene.walls),
            low=np.array(low),
            high=np.array(high),
            **self.options,
        )
        kept: Array = disks_block(disks).astype(self.precision)
        laws = world_block(world, dt)
        self.disks, self.world = disks_of(kept), world_of(laws)
        self.advance = self._entered(kept, laws)
        self.forced = False
        self.advance(0)  # compiles, unless it is compiled already

    def _entered(self, disks: Array, world: Array) -> Callable[[int], Iterable[Any]]:
        if self.variant.__name__ in ADVANCE:
            return partial(ADVANCE[self.variant.__name__], disks, world)
        return partial(self.variant.advance, self.disks, self.world, self.dt)

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        self.disks.force[disk] += force
        self.disks.torque[disk] += torque
        self.forced = True

    def step(self, count: int = 1) -> None:
        if self.forced:
            self.forced = False
            self.step(1)
            self.disks.force.fill(0.0)
            self.disks.torque.fill(0.0)
            count -= 1
        if count and (collisions := self.advance(count)) and self.listening:
            self.log += [
                ContactImpulse(self.steps + k, i, j, impulse) for k, i, j, impulse in collisions
            ]
        self.steps += count

    def read(self) -> State:
        disks = self.disks
        kept = disks.position, disks.velocity, disks.angle, disks.angular_velocity
        return State(*(array.astype(np.float64) for array in kept))

    def collisions(self) -> list[ContactImpulse]:
        return self.log

    def settings(self) -> dict[str, tuple[Any, Any]]:
        method = {setting: (None, value) for setting, value in METHODS.get(self.name, {}).items()}
        if self.name == "ordered":
            return method
        return method | {
            "projection split": (self.options.get("split"), SPLITS[self.world.split]),
            "approaching pairs only": (
                self.options.get("approaching_only"),
                self.world.approaching_only,
            ),
        }

    def versions(self) -> dict[str, str]:
        return {"numba": version("numba"), "numpy": version("numpy")}

    def close(self) -> None:
        """Does nothing: no resources are held outside Python."""
