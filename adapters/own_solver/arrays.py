"""Wraps a module with `advance(disks, world, dt, count)`, as in reference_impl, in the functions of
the exercise.

A step of 0 s moves nothing, so it gives the collision of a pair; a step of a single disk is its
integration.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from crosscheck2d.adapters.own_solver.spheres import sphere_of
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.reference_impl.state import Disks, World, make_disks
from crosscheck2d.scenarios.model import Scene

LOW, HIGH = np.array([-5.0, -3.0]), np.array([5.0, 3.0])  # m, the exercise's box


def as_functions(module: ModuleType, restitution: float = 0.9) -> dict[str, Callable[..., Any]]:
    """`integrate`, `collide`, `step` and `wrap` on spheres, by `module.advance`."""
    world = World(restitution=restitution)
    boxed = world._replace(low=LOW, high=HIGH)

    def act(spheres: list[Any], where: World, dt: float) -> None:
        disks = disks_of(spheres)
        try:
            module.advance(disks, where, dt, 1)
        finally:  # the state at a failure is judged, too
            write_back(disks, spheres)

    def everybody() -> list[Any]:
        return [module.ufo, *module.asteroids]

    return {
        "integrate": lambda sphere, dt: act([sphere], world, dt),
        "collide": lambda a, b: act([a, b], world, 0.0),
        "step": lambda dt: act(everybody(), boxed, dt),
        "wrap": lambda: act(everybody(), boxed, 0.0),
        "begin": lambda: begin(module),
    }


class Whole:
    """Plays scenes with the module's own `advance`, like the reference solver, at any
    restitution."""

    def __init__(self, module: ModuleType) -> None:
        self.engine = Reference(module)

    def whole_load(self, argument: dict[str, Any]) -> None:
        """Start a scene, given by the fields of `Scene`."""
        # JSON has no empty array of this shape
        walls = np.reshape(argument["scene"]["walls"], (-1, 2, 2))
        self.engine.load(Scene(**argument["scene"] | {"walls": walls}), argument["dt"])

    def whole_play(self, argument: dict[str, Any]) -> dict[str, Any]:
        """Call `whole_step` several times, then return the state and the collisions from number
        `heard` on."""
        for step in argument["steps"]:
            self.whole_step(step)
        return {"rows": self.rows(), "collisions": self.collisions(argument["heard"])}

    def whole_step(self, argument: dict[str, Any]) -> None:
        """`count` steps; forces act in the first."""
        for disk, (x, y, torque) in enumerate(argument["forces"] or ()):
            if x or y or torque:
                self.engine.apply_force(disk, np.array([x, y]), torque)
        self.engine.step(argument["count"])

    def rows(self) -> list[list[float]]:
        """Position, velocity, angle and angular velocity of every disk."""
        state = self.engine.read()
        rows: list[list[float]] = np.column_stack(
            [state.position, state.velocity, state.angle, state.angular_velocity]
        ).tolist()
        return rows

    def collisions(self, heard: int) -> list[list[float]]:
        """(step, i, j, impulse) reported by `advance`, from number `heard` on."""
        return [
            [int(step), int(i), int(j), float(impulse)]
            for step, i, j, impulse in self.engine.collisions()[heard:]
        ]


def begin(module: ModuleType) -> None:
    """Give the module a ufo and 20 asteroids in a grid, as the exercise's file has them."""
    places = [(-4.0 + 2.0 * (k % 5), -2.2 + 1.2 * (k // 5)) for k in range(20)]
    parked = [sphere_of([x, y, *[0.0] * 7, 1.0, 1.0, 0.1]) for x, y in places]
    ufo = sphere_of([-3.5, 0.0, *[0.0] * 7, 1.0, 1.0, 0.3])
    vars(module).update(ufo=ufo, asteroids=parked)


def disks_of(spheres: list[Any]) -> Disks:
    """Arrays from sphere objects."""
    disks = make_disks(
        [(s.position.x, s.position.y) for s in spheres],
        [(s.velocity.x, s.velocity.y) for s in spheres],
        [s.size for s in spheres],
        [s.mass for s in spheres],
        [s.MoI for s in spheres],
        [s.alpha for s in spheres],
        [s.angularVelocity for s in spheres],
    )
    disks.force[:] = [(s.force.x, s.force.y) for s in spheres]
    disks.torque[:] = [s.torque for s in spheres]
    return disks


def write_back(disks: Disks, spheres: list[Any]) -> None:
    """All numbers of the arrays into the sphere objects."""
    for k, s in enumerate(spheres):
        s.position.x, s.position.y = map(float, disks.position[k])
        s.velocity.x, s.velocity.y = map(float, disks.velocity[k])
        s.force.x, s.force.y = map(float, disks.force[k])
        s.alpha, s.angularVelocity = float(disks.angle[k]), float(disks.angular_velocity[k])
        s.torque, s.size = float(disks.torque[k]), float(disks.radius[k])
        s.mass, s.MoI = float(disks.mass[k]), float(disks.inertia[k])
