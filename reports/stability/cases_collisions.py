"""Cases of one collision: missed, spurious, grazed, slow, between unequal masses."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.stability.limits import Case
from crosscheck2d.reports.stability.predicates import (
    COLLISIONS_MISSED,
    COLLISIONS_SPURIOUS,
    RESTITUTION_OFF,
    VELOCITY_OFF,
)
from crosscheck2d.reports.stability.scenes import DT, LEAD, RADIUS, disks, flyby, phase, stepped
from crosscheck2d.reports.stability.variants import with_variant
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, flight

# runs at a value, each with the collision elsewhere in its step: a run is a millisecond
PHASES = 32
FAST = (0.125, 0.25, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0, 5.66, 8.0, 11.3, 16.0, 22.6, 32.0)
GRAZES = (0.5, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
MISSES = (0.5, 0.2, 0.1, *GRAZES[2:], 5e-5, 2e-5, 1e-5)
SPEEDS = (8.0, 4.0, 2.0, 1.41, 0.7, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3)
LOSSES = (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)
RATIOS = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8)
BULLETS = with_variant("bullets")


def head_on(x: float, run: int) -> Scenario:
    """How far may a disk fly in a step without missing a disk head-on?"""
    return flyby(x * RADIUS / DT, run)


def off_centre(x: float, run: int) -> Scenario:
    """How far may a disk fly in a step without missing a disk off centre, by 0.7 of the sum of
    the radii?"""
    return flyby(x * RADIUS / DT, run, offset=0.7)


def thin_wall(x: float, run: int) -> Scenario:
    """How far may a disk fly in a step without missing a wall?

    The wall is a segment without thickness through the origin.
    """
    speed = x * RADIUS / DT
    start = -RADIUS - speed * DT * (LEAD + phase(run))
    scene = disks([[start, 0]], [[speed, 0]], walls=[[[0, -4], [0, 4]]])

    def truth(t: Array) -> Trajectory:
        x, v = flight(t[:, None, None], scene.position, scene.velocity)
        beyond = x[..., 0] > -RADIUS
        x[..., 0] = np.where(beyond, -2 * RADIUS - x[..., 0], x[..., 0])
        v[..., 0] = np.where(beyond, -speed, speed)
        return answer(scene, t, (x, v), [((-RADIUS - start) / speed, 0, -1, 2 * speed)])

    return stepped(scene, DT, truth)


def thick_wall(x: float, run: int) -> Scenario:
    """How far may a disk fly in a step without missing a static disk of ten radii?

    It is the thickest wall that a scene can state.
    """
    return flyby(x * RADIUS / DT, run, mass=np.inf, radius=10 * RADIUS)


def grazing(x: float, run: int) -> Scenario:
    """How near to grazing may a collision at v dt / R = 0.2 be and still be found?"""
    return flyby(0.2 * RADIUS / DT, run, offset=1 - x)


def near_miss(x: float, run: int) -> Scenario:
    """How near may a disk pass at v dt / R = 0.2 without a collision?"""
    return flyby(0.2 * RADIUS / DT, run, offset=1 + x)


def slow_collision(x: float, run: int) -> Scenario:
    """How slow may a collision at e = 1 be and still be elastic?"""
    return flyby(x, run)


def with_restitution(x: float, run: int) -> Scenario:
    """Is a collision at 4 m/s played with the e that the scene states?"""
    return flyby(4.0, run, e=1 - x)


def unequal(x: float, run: int) -> Scenario:
    """How unequal may two masses be that meet at e = 1?

    The heavier one rests; v dt / R = 0.1.
    """
    return flyby(0.1 * RADIUS / DT, run, mass=x)


COLLISIONS = (
    *(
        Case(name, scene, varied, values, COLLISIONS_MISSED, runs=PHASES, also=BULLETS)
        for name, scene, varied, values in (
            ("tunnelling_head_on", head_on, "v dt / R", FAST),
            ("tunnelling_offset", off_centre, "v dt / R", FAST),
            ("tunnelling_thin_wall", thin_wall, "v dt / R", FAST),
            ("tunnelling_thick_wall", thick_wall, "v dt / R", FAST),
            ("grazing", grazing, "1 - b / 2R", GRAZES),
        )
    ),
    Case("near_miss", near_miss, "b / 2R - 1", MISSES, COLLISIONS_SPURIOUS, runs=PHASES),
    Case(
        "slow_collision",
        slow_collision,
        "closing speed",
        SPEEDS,
        RESTITUTION_OFF,
        unit="m/s",
        runs=PHASES,
    ),
    Case("restitution", with_restitution, "1 - e", LOSSES, RESTITUTION_OFF, runs=PHASES),
    Case("mass_ratio", unequal, "m2 / m1", RATIOS, VELOCITY_OFF, runs=PHASES),
)
