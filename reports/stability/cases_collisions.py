"""Cases of one collision: missed, spurious, grazed, slow, between unequal masses."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from crosscheck2d.reports.stability.limits import Case
from crosscheck2d.reports.stability.phases import phase
from crosscheck2d.reports.stability.predicates import (
    COLLISIONS_MISSED,
    COLLISIONS_SPURIOUS,
    RESTITUTION_OFF,
    VELOCITY_OFF,
)
from crosscheck2d.reports.stability.variants import with_variant
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, flight, pair

RADIUS, DT = 0.25, 1 / 64
LEAD, AFTER = 3, 6  # whole steps before the step of the collision, and after it
# runs at a value, each with the collision elsewhere in its step: a run is a millisecond
PHASES = 32
SOURCE = (
    "momentum, and Newton's restitution along the line of centres (Landau & Lifshitz,"
    " Mechanics, 17)"
)
FAST = (0.125, 0.25, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0, 5.66, 8.0, 11.3, 16.0, 22.6, 32.0)
BULLETS = with_variant("bullets")


def flyby(
    speed: float,
    run: int,
    *,
    offset: float = 0.0,
    e: float = 1.0,
    mass: float = 1.0,
    radius: float = RADIUS,
    dt: float = DT,
) -> Scenario:
    """Disk 0 flies towards disk 1, which rests at the origin, and reaches it after `LEAD` steps;
    `offset` is in units of the sum of the radii."""
    reach = radius + RADIUS
    touch = -reach * np.sqrt(max(0.0, 1 - offset**2))
    start = touch - speed * dt * (LEAD + phase(run))
    scene = lay_out(
        position=[[start, offset * reach], [0, 0]],
        velocity=[[speed, 0], [0, 0]],
        radius=[RADIUS, radius],
        mass=[1.0, mass],
        restitution=e,
    )
    asks = "Is the collision found?" if offset < 1 else "Is there a spurious collision?"
    return stepped("flyby", asks, scene, dt, partial(of_pair, scene))


def of_pair(scene: Scene, t: Array) -> Trajectory:
    """The exact answer of two disks that meet once at most, at the times t (k,) s."""
    position, velocity, radius, mass = scene.position, scene.velocity, scene.radius, scene.mass
    legs, impulse = pair(position, velocity, radius, mass, scene.restitution)
    collisions = [(float(at), 0, 1, float(kick)) for at, kick in zip(legs.start[1:], impulse)]
    return answer(scene, t, legs.at(t), collisions)


def wall_at_speed(x: float, run: int) -> Scenario:
    """A disk flies at a wall, a segment without thickness through the origin; x = v dt / R."""
    speed = x * RADIUS / DT
    start = -RADIUS - speed * DT * (LEAD + phase(run))
    scene = lay_out(
        position=[[start, 0]],
        velocity=[[speed, 0]],
        radius=[RADIUS],
        mass=[1.0],
        restitution=1.0,
        walls=[[[0, -4], [0, 4]]],
    )

    def truth(t: Array) -> Trajectory:
        x, v = flight(t[:, None, None], scene.position, scene.velocity)
        beyond = x[..., 0] > -RADIUS
        x[..., 0] = np.where(beyond, -2 * RADIUS - x[..., 0], x[..., 0])
        v[..., 0] = np.where(beyond, -speed, speed)
        return answer(scene, t, (x, v), [((-RADIUS - start) / speed, 0, -1, 2 * speed)])

    return stepped("wall-collision", "Is the wall found?", scene, DT, truth)


def stepped(
    name: str,
    asks: str,
    scene: Scene,
    dt: float,
    truth: Callable[[Array], Trajectory],
    source: str = SOURCE,
) -> Scenario:
    """A scenario of a few steps, sampled at each of them."""
    steps = LEAD + 1 + AFTER
    return Scenario(name, asks, source, scene, steps * dt, dt, (1,), truth=truth)


def at_speed(x: float, run: int, offset: float = 0.0) -> Scenario:
    """x = v dt / R."""
    return flyby(x * RADIUS / DT, run, offset=offset)


def thick_wall(x: float, run: int) -> Scenario:
    """The thickest wall that a scene can state: a static disk of ten radii."""
    return flyby(x * RADIUS / DT, run, mass=np.inf, radius=10 * RADIUS)


def grazing(x: float, run: int) -> Scenario:
    """x = 1 - b / 2R, at v dt / R = 0.2."""
    return flyby(0.2 * RADIUS / DT, run, offset=1 - x)


def near_miss(x: float, run: int) -> Scenario:
    """x = b / 2R - 1, at v dt / R = 0.2."""
    return flyby(0.2 * RADIUS / DT, run, offset=1 + x)


def unequal(x: float, run: int) -> Scenario:
    """A disk of mass 1 strikes a disk of mass x at rest, at v dt / R = 0.1."""
    return flyby(0.1 * RADIUS / DT, run, mass=x)


def with_restitution(x: float, run: int) -> Scenario:
    """A head-on collision at e = 1 - x and 4 m/s."""
    return flyby(4.0, run, e=1 - x)


COLLISIONS = (
    Case(
        "tunnelling_head_on",
        "How far may a disk fly in a step without missing a disk head-on?",
        "v dt / R",
        FAST,
        at_speed,
        COLLISIONS_MISSED,
        runs=PHASES,
        also=BULLETS,
    ),
    Case(
        "tunnelling_offset",
        "How far may a disk fly in a step without missing a disk off centre, by 0.7 of the sum of"
        " the radii?",
        "v dt / R",
        FAST,
        partial(at_speed, offset=0.7),
        COLLISIONS_MISSED,
        runs=PHASES,
        also=BULLETS,
    ),
    Case(
        "tunnelling_thin_wall",
        "How far may a disk fly in a step without missing a wall?",
        "v dt / R",
        FAST,
        wall_at_speed,
        COLLISIONS_MISSED,
        runs=PHASES,
        also=BULLETS,
    ),
    Case(
        "tunnelling_thick_wall",
        "How far may a disk fly in a step without missing a static disk of ten radii?",
        "v dt / R",
        FAST,
        thick_wall,
        COLLISIONS_MISSED,
        runs=PHASES,
        also=BULLETS,
    ),
    Case(
        "grazing",
        "How near to grazing may a collision at v dt / R = 0.2 be and still be found?",
        "1 - b / 2R",
        (0.5, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4),
        grazing,
        COLLISIONS_MISSED,
        runs=PHASES,
        also=BULLETS,
    ),
    Case(
        "near_miss",
        "How near may a disk pass at v dt / R = 0.2 without a collision?",
        "b / 2R - 1",
        (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
        near_miss,
        COLLISIONS_SPURIOUS,
        runs=PHASES,
    ),
    Case(
        "slow_collision",
        "How slow may a collision at e = 1 be and still be elastic?",
        "closing speed",
        (8.0, 4.0, 2.0, 1.41, 0.7, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3),
        flyby,
        RESTITUTION_OFF,
        unit="m/s",
        runs=PHASES,
    ),
    Case(
        "restitution",
        "Is a collision at 4 m/s played with the e that the scene states?",
        "1 - e",
        (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0),
        with_restitution,
        RESTITUTION_OFF,
        runs=PHASES,
    ),
    Case(
        "mass_ratio",
        "How unequal may two masses be that meet at e = 1?",
        "m2 / m1",
        (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8),
        unequal,
        VELOCITY_OFF,
        runs=PHASES,
    ),
)
