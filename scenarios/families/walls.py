"""One disk with floors, walls, a box, an incline or static disks; and a stack at rest."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from crosscheck2d.scenarios.families.friction import FLOOR, G
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import (
    answer,
    at_rest,
    drop,
    flight,
    offset_growth,
    stacked,
    to_and_fro,
)
from crosscheck2d.scenarios.truth.exact import with_oracle

EPS = float(np.finfo(float).eps)
ON_FLOOR: dict[str, Any] = {"walls": FLOOR, "gravity": [0.0, -G]}


def ball(
    name: str, asks: str, height: float, restitution: float, shortest: float | None = None
) -> Scenario:
    scene = lay_out([[0.0, 0.25 + height]], restitution=restitution, **ON_FLOOR)
    source = "the bouncing ball in closed form, to rest and after"
    truth = partial(drop, scene, height, shortest=shortest)
    return Scenario(name, asks, source, scene, duration=10.0, truth=truth)


def wall_to_wall() -> Scenario:
    restitution, reach = 0.8, 2.0 - 0.25
    scene = lay_out(
        [[0.0, 0.0]],
        [3.07, 0.0],
        restitution=restitution,
        walls=[[[-2, -2], [-2, 2]], [[2, -2], [2, 2]]],
    )

    def truth(t: Array) -> Trajectory:
        legs = to_and_fro(
            scene.position[0, 0] + reach, scene.velocity[0, 0], 2 * reach, restitution, t[-1]
        )
        x, speed = legs.at(t)
        position, velocity = (np.stack([a, 0 * a], axis=-1)[:, None] for a in (x - reach, speed))
        collisions = legs.wall_collisions(0, (1, 0), 1.0, restitution)
        return answer(scene, t, (position, velocity), collisions)

    return Scenario(
        "wall_to_wall",
        "Does a disk between two walls lose exactly a fifth of its speed at each?",
        "leg k at speed v e^k lasts D / (v e^k)",
        scene,
        duration=10.0,
        truth=truth,
    )


def box_billiard() -> Scenario:
    """The axes are independent of each other."""
    radius, low, high = 0.25, np.array([-3.0, -2.0]), np.array([3.0, 2.0])
    scene = lay_out([[-0.68, -0.08]], [1.93, 1.84], angular_velocity=[1.0], walls=box(low, high))

    def truth(t: Array) -> Trajectory:
        legs = [
            to_and_fro(x - a, v, b - a, 1.0, t[-1])
            for x, v, a, b in zip(scene.position[0], scene.velocity[0], low + radius, high - radius)
        ]
        position, velocity = (
            np.stack(part, axis=-1)[:, None] for part in zip(*(leg.at(t) for leg in legs))
        )
        collisions = [
            collision
            for leg, walls in zip(legs, ((2, 0), (3, 1)))
            for collision in leg.wall_collisions(0, walls, 1.0, 1.0)
        ]
        return answer(scene, t, (position + low + radius, velocity), collisions)

    return Scenario(
        "box_billiard",
        "Does a disk in a box keep its speed, its angles and its spin over many walls?",
        "the triangle wave on each axis",
        scene,
        duration=20.0,
        truth=truth,
    )


def disk_between_static_disks() -> Scenario:
    """A disk bounces between two static ones along a tilted line; an offset grows 2.6-fold at
    each."""
    # All are multiples of (4, 3) by binary fractions: the start is exactly on the line despite its
    # tilt.
    along = np.array([4.0, 3.0])
    radius, static = 0.5, 1.0
    centre, place, speed = 0.375, -0.00390625, 0.26953125  # in units of `along`, which has length 5
    scene = lay_out(
        [place * along, -centre * along, centre * along],
        [speed * along, 0 * along, 0 * along],
        radius=[radius, static, static],
        mass=[1.0, np.inf, np.inf],
    )
    reach = centre - (radius + static) / 5

    def truth(t: Array) -> Trajectory:
        legs = to_and_fro(place + reach, speed, 2 * reach, 1.0, t[-1])
        x, v = legs.at(t)
        position, velocity = np.tile(scene.position, (len(t), 1, 1)), np.zeros((len(t), 3, 2))
        position[:, 0], velocity[:, 0] = np.outer(x - reach, along), np.outer(v, along)
        kick = 2 * speed * 5
        collisions = [(float(at), 0, 2 - k % 2, kick) for k, at in enumerate(legs.start[1:])]
        # A relative rounding of 2^-52 grows to 1e-9 m in that many bounces, in any float64
        # engine.
        growth = offset_growth(10 * reach, radius + static)
        bounces = int(np.log(1e-9 / (EPS * centre * 5)) / np.log(growth))
        return answer(
            scene,
            t,
            (position, velocity),
            collisions,
            horizon=float(legs.start[min(bounces, len(collisions))]),
            error_bound=4 * EPS * centre * 5,
            reason="there a rounding has grown to 1e-9 m on the unstable orbit",
        )

    return Scenario(
        "disk_between_static_disks",
        "How long does a disk stay on the unstable line between two static disks?",
        "the two-disk orbit (Gaspard & Rice, J. Chem. Phys. 90, 2225, 1989)",
        scene,
        duration=10.0,
        truth=truth,
    )


def slide_on_incline() -> Scenario:
    # Binary fractions: the disk touches the line through the origin exactly.
    down, normal = np.array([4.0, -3.0]) / 5, np.array([0.375, 0.5])
    scene = lay_out(
        [np.array([-4.0, 3.0]) + normal],
        radius=0.625,
        walls=[[[-8, 6], [8, -6]]],
        gravity=[0.0, -G],
        restitution=0.0,
    )

    def truth(t: Array) -> Trajectory:
        motion = flight(t[:, None, None], scene.position, scene.velocity, 0.6 * G * down)
        return answer(scene, t, motion, stacked(scene))

    return Scenario(
        "slide_on_incline",
        "Does a disk slide down a smooth incline with g sin(alpha), without rolling?",
        "a = g sin(alpha) along the incline, sin(alpha) = 3/5",
        scene,
        duration=1.5,
        truth=truth,
    )


def resting(name: str, asks: str, source: str, y: Array) -> Scenario:
    """Disks on the floor and on each other, whose centres are at the heights y (n,) m."""
    scene = lay_out(np.stack([0 * y, y], axis=-1), restitution=0.0, **ON_FLOOR)
    truth = partial(at_rest, scene, collisions=stacked(scene))
    return Scenario(name, asks, source, scene, duration=5.0, truth=truth)


WALLS = (
    ball(
        "bouncing_ball_e1",
        "Does a ball dropped at e = 1 come back to its height every time?",
        height=1.54,
        restitution=1.0,
    ),
    # It bounces infinitely often, until it rests at 9 s.
    ball(
        "bouncing_ball_e09",
        "Does a ball dropped at e = 0.9 lose height as it should, and come to rest at the right"
        " time?",
        height=1.11,
        restitution=0.9,
        shortest=1e-4,
    ),
    wall_to_wall(),
    box_billiard(),
    disk_between_static_disks(),
    resting(
        "rest_on_floor",
        "Does a disk that lies on the floor stay there?",
        "equilibrium",
        np.array([0.25]),
    ),
    slide_on_incline(),
    resting(
        "column_of_ten",
        "Does a column of ten disks carry its weight, or does it sink, jitter or fall?",
        "equilibrium, unstable, exact while all centres have the same x",
        0.25 + 2 * 0.25 * np.arange(10.0),
    ),
    with_oracle(
        Scenario(
            "heavy_on_light",
            "Does a disk of 100 kg stay on a disk of 1 kg, or sink into it?",
            "after HighMassRatio1 to 3 of Box2D (samples/sample_robustness.cpp)",
            lay_out([[0.0, 0.6], [0.0, 2.0]], (0, 0), 0.5, [1.0, 100.0], 0.0, **ON_FLOOR),
            duration=3.0,
        )
    ),
    # The impulse returns from the lower ball.
    with_oracle(
        Scenario(
            "ball_on_supported_ball",
            "How high does a ball bounce at e = 0.9 from a ball that lies on a floor?",
            "after Box2D's test/test_restitution.c; the limit of small gaps",
            lay_out([[0.0, 0.25], [0.0, 1.75]], restitution=0.9, **ON_FLOOR),
            duration=1.5,
        )
    ),
)
