"""Two disks that collide once or just miss: head-on, oblique, unequal, slow, near."""

from __future__ import annotations

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


def meet(name: str, asks: str, duration: float = 4.0, **disks: Any) -> Scenario:
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


LANES = np.arange(7)

PAIRS = (
    *(
        meet(
            f"head_on_equal_{tag('e', e)}",
            f"Do two equal disks separate after a head-on collision as e = {e:g} says?",
            position=[[-1.7, 0], [1.9, 0]],
            velocity=[[1.1, 0], [-0.7, 0]],
            restitution=e,
        )
        for e in RESTITUTIONS
    ),
    *(
        meet(
            f"head_on_unequal_{tag('e', e)}",
            f"Do a light and a heavy disk share momentum in a head-on collision as e = {e:g} says?",
            position=[[-1.11, 0], [1.87, 0]],
            velocity=[[1.3, 0], [-0.6, 0]],
            mass=[1, 7],
            restitution=e,
        )
        for e in RESTITUTIONS
    ),
    *(
        meet(
            f"oblique_{tag('e', e)}",
            f"Do two disks that meet off centre separate at the angles of e = {e:g}, their spin"
            " untouched?",
            position=[[-1.8, -0.1], [1.7, 0.2]],
            velocity=[[1.2, 0.1], [-0.7, 0.05]],
            mass=[1, 2],
            angular_velocity=[1.5, -0.5],
            restitution=e,
        )
        for e in RESTITUTIONS
    ),
    # At 37 degrees off the line of centres, for engines without rotation: one that exchanges x and
    # y of the velocities, without a normal, is right on a line.
    meet(
        "off_centre_without_spin",
        "Do two disks that meet off centre change their velocities along the line of centres only?",
        duration=2.0,
        position=[[-1.013, 0.3], [0.5, 0.0]],
        velocity=[[2.0, 0.0], [0.0, 0.0]],
        mass=[1, 2],
    ),
    # The distance grows from lane to lane, so that the seven collisions are at different phases of
    # a step.
    meet(
        "mass_ratios",
        "Up to which mass ratio does a head-on collision still keep momentum and energy?",
        position=[[x, 2.0 * (lane - 3)] for lane in LANES for x in (-1.442 - 0.0499 * lane, 1.3)],
        velocity=np.tile([[0.5, 0], [-1, 0]], (7, 1)),
        mass=np.stack([np.ones(7), 10.0**LANES], axis=-1).ravel(),
    ),
    # Below the threshold under which some engines make every collision inelastic.
    meet(
        "slow_collision",
        "Is a collision at 0.5 m/s as elastic as a fast one, or is it below a threshold?",
        position=[[-0.63, 0], [0.583, 0]],
        velocity=[[0.37, 0], [-0.13, 0]],
        restitution=0.9,
    ),
    meet(
        "near_miss",
        "Which engine reports a spurious collision when a fast disk passes another at 1.005 times"
        " the touching distance?",
        duration=1.0,
        position=[[-6, 1.005 * 2 * 0.25], [0.03, 0]],
        velocity=[[12, 0], [0, 0]],  # 0.2 radii per step of 1/240 s
    ),
)
