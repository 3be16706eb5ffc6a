"""Two disks that collide once or just miss: head-on, oblique, unequal, slow, near."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from crosscheck2d.scenarios.families.placing import lay_out, tag
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import Collision, Motion, answer, pair

SOURCE = (
    "momentum, and Newton's restitution along the line of centres (Landau & Lifshitz,"
    " Mechanics, 17)"
)
RESTITUTIONS = (0.0, 0.5, 0.9, 1.0)


def _pairs(name: str, asks: str, duration: float = 4.0, **disks: Any) -> Scenario:
    """Disks 0 and 1, 2 and 3, ... meet; no pair comes near another."""
    scene = lay_out(**disks)

    def truth(t: Array) -> Trajectory:
        motions, collisions = list[Motion](), list[Collision]()
        x, v, r, m = scene.position, scene.velocity, scene.radius, scene.mass
        for i in range(0, scene.n, 2):
            two = slice(i, i + 2)
            legs, impulse = pair(x[two], v[two], r[two], m[two], scene.restitution)
            motions.append(legs.at(t))
            collisions += [
                (float(at), i, i + 1, float(kick)) for at, kick in zip(legs.start[1:], impulse)
            ]
        position, velocity = (np.concatenate(part, axis=1) for part in zip(*motions))
        return answer(scene, t, (position, velocity), collisions)

    return Scenario(name, asks, SOURCE, scene, duration, truth=truth)


def head_on_equal(restitution: float) -> Scenario:
    return _pairs(
        f"head_on_equal_{tag('e', restitution)}",
        f"Do two equal disks separate after a head-on collision as e = {restitution:g} says?",
        position=[[-1.7, 0], [1.9, 0]],
        velocity=[[1.1, 0], [-0.7, 0]],
        restitution=restitution,
    )


def head_on_unequal(restitution: float) -> Scenario:
    return _pairs(
        f"head_on_unequal_{tag('e', restitution)}",
        f"Do a light and a heavy disk share momentum in a head-on collision as e = {restitution:g}"
        " says?",
        position=[[-1.11, 0], [1.87, 0]],
        velocity=[[1.3, 0], [-0.6, 0]],
        mass=[1, 7],
        restitution=restitution,
    )


def oblique(restitution: float) -> Scenario:
    return _pairs(
        f"oblique_{tag('e', restitution)}",
        f"Do two disks that meet off centre separate at the angles of e = {restitution:g}, their"
        " spin untouched?",
        position=[[-1.8, -0.1], [1.7, 0.2]],
        velocity=[[1.2, 0.1], [-0.7, 0.05]],
        mass=[1, 2],
        angular_velocity=[1.5, -0.5],
        restitution=restitution,
    )


def off_centre_without_spin() -> Scenario:
    """At 37 degrees off the line of centres, for engines without rotation: one that exchanges x and
    y of the velocities, without a normal, is right on a line."""
    return _pairs(
        "off_centre_without_spin",
        "Do two disks that meet off centre change their velocities along the line of centres only?",
        duration=2.0,
        position=[[-1.013, 0.3], [0.5, 0.0]],
        velocity=[[2.0, 0.0], [0.0, 0.0]],
        mass=[1, 2],
    )


def mass_ratios() -> Scenario:
    lanes = np.arange(7)
    y = 2.0 * (lanes - 3)
    # The distance grows from lane to lane, so that the seven collisions are at different phases of
    # a step.
    light = np.stack([-1.442 - 0.0499 * lanes, y], axis=-1)
    heavy = np.stack([1.3 + 0.0 * lanes, y], axis=-1)
    return _pairs(
        "mass_ratios",
        "Up to which mass ratio does a head-on collision still keep momentum and energy?",
        position=np.stack([light, heavy], axis=1).reshape(-1, 2),
        velocity=np.tile([[0.5, 0], [-1, 0]], (7, 1)),
        mass=np.stack([np.ones(7), 10.0**lanes], axis=-1).ravel(),
    )


def slow_collision() -> Scenario:
    """Below the threshold under which some engines make every collision inelastic."""
    return _pairs(
        "slow_collision",
        "Is a collision at 0.5 m/s as elastic as a fast one, or is it below a threshold?",
        position=[[-0.63, 0], [0.583, 0]],
        velocity=[[0.37, 0], [-0.13, 0]],
        restitution=0.9,
    )


def near_miss() -> Scenario:
    return _pairs(
        "near_miss",
        "Which engine reports a spurious collision when a fast disk passes another at 1.005 times"
        " the touching distance?",
        duration=1.0,
        position=[[-6, 1.005 * 2 * 0.25], [0.03, 0]],
        velocity=[[12, 0], [0, 0]],  # 0.2 radii per step of 1/240 s
    )


PAIRS: tuple[Callable[..., Scenario], ...] = (
    *(
        partial(build, e)
        for build in (head_on_equal, head_on_unequal, oblique)
        for e in RESTITUTIONS
    ),
    off_centre_without_spin,
    mass_ratios,
    slow_collision,
    near_miss,
)
