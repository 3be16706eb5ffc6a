"""One disk with floors, walls, a box, an incline or static disks; and a stack at rest."""

from __future__ import annotations

from typing import Any

import numpy as np

from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import (
    answer,
    at_rest,
    bouncing,
    flight,
    offset_growth,
    stacked,
    to_and_fro,
)
from crosscheck2d.scenarios.truth.exact import with_oracle

G = 9.81
FLOOR = [[[-10, 0], [10, 0]]]
EPS = float(np.finfo(float).eps)


def _ball(
    name: str, asks: str, height: float, restitution: float, duration: float, least: float = 0.0
) -> Scenario:
    """A ball dropped from `height` m over the floor; bounces that last less than `least` s are not
    listed."""
    radius, mass = 0.25, 1.0
    scene = lay_out(
        position=[[0.0, radius + height]],
        velocity=[[0.0, 0.0]],
        radius=[radius],
        mass=[mass],
        walls=FLOOR,
        gravity=[0.0, -G],
        restitution=restitution,
    )

    def truth(t: Array) -> Trajectory:
        legs = bouncing(height, G, restitution, t[-1])
        gap, speed = legs.at(t)
        lasting = int((np.diff(legs.start)[1:] > least).sum())
        collisions = legs.wall_collisions(0, (0,), mass, restitution)[:lasting]
        position, velocity = (np.stack([0 * y, y], axis=-1)[:, None] for y in (gap + radius, speed))
        return answer(scene, t, (position, velocity), collisions)

    source = "the bouncing ball in closed form, to rest and after"
    return Scenario(name, asks, source, scene, duration, 1 / 60, truth=truth)


def bouncing_ball_e1() -> Scenario:
    """A ball that always returns to its start height."""
    return _ball(
        "bouncing_ball_e1",
        "Does a ball dropped at e = 1 come back to its height every time?",
        height=1.54,
        restitution=1.0,
        duration=10.0,
    )


def bouncing_ball_e09() -> Scenario:
    """A ball that bounces ever lower, infinitely often, until it rests at 9 s."""
    return _ball(
        "bouncing_ball_e09",
        "Does a ball dropped at e = 0.9 lose height as it should, and come to rest at the right"
        " time?",
        height=1.11,
        restitution=0.9,
        duration=10.0,
        least=1e-4,
    )


def wall_to_wall() -> Scenario:
    """A disk thrown back and forth, slower after each wall."""
    restitution, radius, mass = 0.8, 0.25, 1.0
    reach = 2.0 - radius
    scene = lay_out(
        position=[[0.0, 0.0]],
        velocity=[[3.07, 0.0]],
        radius=[radius],
        mass=[mass],
        walls=[[[-2, -2], [-2, 2]], [[2, -2], [2, 2]]],
        restitution=restitution,
    )

    def truth(t: Array) -> Trajectory:
        legs = to_and_fro(
            scene.position[0, 0] + reach, scene.velocity[0, 0], 2 * reach, restitution, t[-1]
        )
        x, speed = legs.at(t)
        position, velocity = (np.stack([a, 0 * a], axis=-1)[:, None] for a in (x - reach, speed))
        return answer(
            scene, t, (position, velocity), legs.wall_collisions(0, (1, 0), mass, restitution)
        )

    return Scenario(
        name="wall_to_wall",
        asks="Does a disk between two walls lose exactly a fifth of its speed at each?",
        source="leg k at speed v e^k lasts D / (v e^k)",
        scene=scene,
        duration=10.0,
        sample_interval=1 / 60,
        truth=truth,
    )


def box_billiard() -> Scenario:
    """One disk in a box, its axes independent of each other."""
    radius, mass = 0.25, 1.0
    low, high = np.array([-3.0, -2.0]), np.array([3.0, 2.0])
    scene = lay_out(
        position=[[-0.68, -0.08]],
        velocity=[[1.93, 1.84]],
        angular_velocity=[1.0],
        radius=[radius],
        mass=[mass],
        walls=box(low, high),
        restitution=1.0,
    )

    def truth(t: Array) -> Trajectory:
        legs = [
            to_and_fro(x - a, v, b - a, 1.0, t[-1])
            for x, v, a, b in zip(scene.position[0], scene.velocity[0], low + radius, high - radius)
        ]
        position, velocity = (
            np.stack(part, axis=-1)[:, None] for part in zip(*(leg.at(t) for leg in legs))
        )
        collisions = legs[0].wall_collisions(0, (2, 0), mass, 1.0) + legs[1].wall_collisions(
            0, (3, 1), mass, 1.0
        )
        return answer(scene, t, (position + low + radius, velocity), collisions)

    return Scenario(
        name="box_billiard",
        asks="Does a disk in a box keep its speed, its angles and its spin over many walls?",
        source="the triangle wave on each axis",
        scene=scene,
        duration=20.0,
        sample_interval=1 / 60,
        truth=truth,
    )


def disk_between_static_disks() -> Scenario:
    """A disk bounces between two static ones along a tilted line; an offset grows 2.6-fold at
    each."""
    # All are multiples of (4, 3) by binary fractions: the start is exactly on the line despite its
    # tilt.
    along = np.array([4.0, 3.0])
    radius, mass, static = 0.5, 1.0, 1.0
    centre, place, speed = 0.375, -0.00390625, 0.26953125  # in units of `along`, which has length 5
    scene = lay_out(
        position=[place * along, -centre * along, centre * along],
        velocity=[speed * along, [0, 0], [0, 0]],
        radius=[radius, static, static],
        mass=[mass, np.inf, np.inf],
        restitution=1.0,
    )
    reach = centre - (radius + static) / 5

    def truth(t: Array) -> Trajectory:
        legs = to_and_fro(place + reach, speed, 2 * reach, 1.0, t[-1])
        x, v = legs.at(t)
        position, velocity = np.tile(scene.position, (len(t), 1, 1)), np.zeros((len(t), 3, 2))
        position[:, 0], velocity[:, 0] = np.outer(x - reach, along), np.outer(v, along)
        kick = 2 * mass * speed * 5
        collisions = [(float(at), 0, 2 - k % 2, kick) for k, at in enumerate(legs.start[1:])]
        # A relative rounding of 2^-52 grows to 1e-9 m in that many bounces, in any float64
        # engine.
        growth = offset_growth(10 * reach, radius + static)
        bounces = int(np.log(1e-9 / (EPS * centre * 5)) / np.log(growth))
        horizon = float(legs.start[min(bounces, len(collisions))])
        bound, reason = (
            4 * EPS * centre * 5,
            "there a rounding has grown to 1e-9 m on the unstable orbit",
        )
        return answer(scene, t, (position, velocity), collisions, None, horizon, bound, reason)

    return Scenario(
        name="disk_between_static_disks",
        asks="How long does a disk stay on the unstable line between two static disks?",
        source="the two-disk orbit (Gaspard & Rice, J. Chem. Phys. 90, 2225, 1989)",
        scene=scene,
        duration=10.0,
        sample_interval=1 / 60,
        truth=truth,
    )


def rest_on_floor() -> Scenario:
    """A disk that just touches the floor and stays."""
    scene = lay_out(
        position=[[0.0, 0.25]],
        velocity=[[0.0, 0.0]],
        radius=[0.25],
        mass=[1.0],
        walls=FLOOR,
        gravity=[0.0, -G],
        restitution=0.0,
    )
    return Scenario(
        name="rest_on_floor",
        asks="Does a disk that lies on the floor stay there?",
        source="equilibrium",
        scene=scene,
        duration=5.0,
        sample_interval=1 / 60,
        truth=lambda t: at_rest(scene, t, stacked(scene)),
    )


def slide_on_incline() -> Scenario:
    """A disk slides down a smooth 3-4-5 incline and does not roll."""
    # Binary fractions: the disk touches the line through the origin exactly.
    down, normal = np.array([4.0, -3.0]) / 5, np.array([0.375, 0.5])
    scene = lay_out(
        position=[np.array([-4.0, 3.0]) + normal],
        velocity=[[0.0, 0.0]],
        radius=[0.625],
        mass=[1.0],
        walls=[[[-8, 6], [8, -6]]],
        gravity=[0.0, -G],
        restitution=0.0,
    )

    def truth(t: Array) -> Trajectory:
        motion = flight(t[:, None, None], scene.position, scene.velocity, 0.6 * G * down)
        return answer(scene, t, motion, stacked(scene))

    return Scenario(
        name="slide_on_incline",
        asks="Does a disk slide down a smooth incline with g sin(alpha), without rolling?",
        source="a = g sin(alpha) along the incline, sin(alpha) = 3/5",
        scene=scene,
        duration=1.5,
        sample_interval=1 / 60,
        truth=truth,
    )


def column_of_ten() -> Scenario:
    """Ten equal disks exactly above each other: in equilibrium, but an unstable one."""
    count, radius = 10, 0.25
    scene = lay_out(
        position=np.stack([np.zeros(count), radius + 2 * radius * np.arange(count)], axis=-1),
        velocity=np.zeros((count, 2)),
        radius=np.full(count, radius),
        mass=np.ones(count),
        walls=FLOOR,
        gravity=[0.0, -G],
        restitution=0.0,
    )
    return Scenario(
        name="column_of_ten",
        asks="Does a column of ten disks carry its weight, or does it sink, jitter or fall?",
        source="equilibrium, unstable, exact while all centres have the same x",
        scene=scene,
        duration=5.0,
        sample_interval=1 / 60,
        truth=lambda t: at_rest(scene, t, stacked(scene)),
    )


def _one_above_the_other(
    name: str, asks: str, source: str, duration: float, restitution: float, **disks: Any
) -> Scenario:
    """Two disks that fall, the second from above onto the first."""
    still = [[0.0, 0.0], [0.0, 0.0]]
    scene = lay_out(
        velocity=still, walls=FLOOR, gravity=[0.0, -G], restitution=restitution, **disks
    )
    return with_oracle(Scenario(name, asks, source, scene, duration, 1 / 60))


def heavy_on_light() -> Scenario:
    """A disk of 100 kg falls onto one of 1 kg, which falls onto a floor first."""
    return _one_above_the_other(
        "heavy_on_light",
        "Does a disk of 100 kg stay on a disk of 1 kg, or sink into it?",
        "after HighMassRatio1 to 3 of Box2D (samples/sample_robustness.cpp)",
        duration=3.0,
        restitution=0.0,
        position=[[0.0, 0.6], [0.0, 2.0]],
        radius=[0.5, 0.5],
        mass=[1.0, 100.0],
    )


def ball_on_supported_ball() -> Scenario:
    """A ball falls onto an equal one that lies on a floor, so that the impulse returns from it."""
    return _one_above_the_other(
        "ball_on_supported_ball",
        "How high does a ball bounce at e = 0.9 from a ball that lies on a floor?",
        "after Box2D's test/test_restitution.c; the limit of small gaps",
        duration=1.5,
        restitution=0.9,
        position=[[0.0, 0.25], [0.0, 1.75]],
        radius=[0.25, 0.25],
        mass=[1.0, 1.0],
    )


WALLS = (
    bouncing_ball_e1,
    bouncing_ball_e09,
    wall_to_wall,
    box_billiard,
    disk_between_static_disks,
    rest_on_floor,
    slide_on_incline,
    column_of_ten,
    heavy_on_light,
    ball_on_supported_ball,
)
