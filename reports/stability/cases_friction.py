"""Cases of friction: in a bounce, between unequal masses, from sliding to rolling, on a slope, at
rest.

Every exact answer is a closed form (scenarios/truth/sliding.py) and holds to the end of the run:
no collision here is followed by another, so that no rounding grows and the horizon is the duration.
"""

from __future__ import annotations

from functools import partial
from math import ceil, hypot

import numpy as np

from crosscheck2d.reports.stability.cases_few import (
    AFTER,
    DT,
    LEAD,
    RADIUS,
    G,
    disks,
    phase,
    scenario_of,
    stepped,
)
from crosscheck2d.reports.stability.limits import WITH_FRICTION_ONLY, Case
from crosscheck2d.reports.stability.predicates import (
    CREEPS,
    FRICTION_OFF,
    ROLLING_OFF,
    SLIPS,
)
from crosscheck2d.scenarios.families.friction import start_of, turning_answer
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import at_rest
from crosscheck2d.scenarios.truth.sliding import bounce, slide, spinning_pair

SOLID = 2.0  # m r2 / I
FALL = 4.0  # m/s, four times the threshold of restitution of both Box2Ds as shipped
# A step displacement of 0.05 radii: an engine that takes its lever arm to the middle of the overlap
# is off by half of that at most.
BOUNCE_DT = 0.05 * RADIUS / FALL
PHASES = 8  # runs at a value, each with the collision elsewhere in its step
FLOOR = [[[-200.0, 0.0], [200.0, 0.0]]]


def rough_bounce(
    along: float, run: int, *, spin: float = 0.0, e: float = 0.0, mu: float = 0.1
) -> Scenario:
    height = FALL * BOUNCE_DT * (LEAD + phase(run))
    scene = disks(
        [[0.0, RADIUS + height]],
        [[along, -FALL]],
        angular_velocity=[spin],
        walls=FLOOR,
        e=e,
        friction=mu,
    )

    def truth(t: Array) -> Trajectory:
        start, v = start_of(scene)
        legs = bounce(start, v, scene.radius, np.array([SOLID]), e, mu, height)
        collision = (float(legs.start[1]), 0, -1, (1 + e) * FALL)
        return turning_answer(scene, t, legs.at(t), [collision])

    return stepped(scene, BOUNCE_DT, truth)


def spinning_into(x: float, run: int) -> Scenario:
    start = -2 * RADIUS - FALL * BOUNCE_DT * (LEAD + phase(run))
    scene = disks(
        [[start, 0.0], [0.0, 0.0]],
        [[FALL, 0.0], [0.0, 0.0]],
        angular_velocity=[1.0 / RADIUS, 0.0],
        mass=[1.0, x],
        e=0.5,
        friction=1.0,
    )

    def truth(t: Array) -> Trajectory:
        legs, impulse = spinning_pair(scene, 0)
        collision = (float(legs.start[1]), 0, 1, float(impulse[0]))
        return turning_answer(scene, t, legs.at(t), [collision])

    return stepped(scene, BOUNCE_DT, truth)


def on_floor(speed: float, friction: float, slope: float, steps: int) -> Scenario:
    """A disk touches a floor and has no spin; gravity leans forward by `slope`, its tangent.

    A leaning gravity stands for a slope: so the disk touches the floor exactly in float64.
    """
    cosine = 1 / hypot(1.0, slope)
    sine = slope * cosine
    scene = disks(
        [[0.0, RADIUS]],
        [[speed, 0.0]],
        walls=[[[-10.0, 0.0], [10.0 + speed * steps * DT, 0.0]]],
        gravity=[G * sine, -G * cosine],
        e=0.0,
        friction=friction,
    )

    def truth(t: Array) -> Trajectory:
        way, rate = slide(speed, 0.0, RADIUS, SOLID, friction, G * sine, G * cosine).at(t)
        place, moves = (np.zeros((len(t), 1, 3)) for _ in range(2))
        place[:, 0, 0::2], moves[:, 0, 0::2] = way, rate
        place[..., :2] += scene.position
        return turning_answer(scene, t, (place, moves), [(0.0, 0, -1, 0.0)])

    return scenario_of(scene, steps * DT, DT, truth=truth)


def sliding(x: float, run: int) -> Scenario:
    # the runs differ in where within its step the slide ends, by up to one step
    friction, speed = 0.5 * (1 + 0.02 * phase(run)), x * RADIUS / DT
    slides = speed / (3 * friction * G)
    return on_floor(speed, friction, 0.0, ceil(1.5 * slides / DT) + AFTER)


def in_corner(x: float, _run: int) -> Scenario:
    # on a floor and against a wall: the normal forces alone carry the disk
    walls = [[[-1.0, 0.0], [4.0, 0.0]], [[0.0, -1.0], [0.0, 4.0]]]
    scene = disks([[RADIUS, RADIUS]], walls=walls, gravity=[-3.0, -G], e=0.0, friction=0.5)
    every = max(1, int(x) // 100)
    duration = int(x) // every * every * DT
    return scenario_of(scene, duration, every * DT, every, lambda t: at_rest(scene, t))


rough = partial(Case, also=WITH_FRICTION_ONLY)
FRICTION = (
    rough(
        "friction_in_bounce",
        "Up to which e does friction in a bounce follow Coulomb's law?",
        # the rim slips during the whole collision
        lambda x, run: rough_bounce(5.0, run, e=x),
        "e",
        (0.05, 0.07, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0),
        FRICTION_OFF,
        runs=PHASES,
    ),
    rough(
        "strong_friction",
        "How large may friction be where the rim sticks in a bounce?",
        lambda x, run: rough_bounce(3.0, run, e=0.5, mu=x),
        "friction",
        (0.3, 1.0, 3.0, 10.0, 100.0, 1e3, 1e4, 1e6, 1e8),
        FRICTION_OFF,
        runs=PHASES,
    ),
    rough(
        "spin_in_bounce",
        "How fast may a disk spin that falls onto a floor with friction?",
        lambda x, run: rough_bounce(0.0, run, spin=x / BOUNCE_DT, mu=0.5),
        "w dt",
        (0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0, 3.0, 6.0, 10.0),
        FRICTION_OFF,
        unit="rad",
        runs=PHASES,
    ),
    rough(
        "friction_mass_ratio",
        "How unequal may two masses be that exchange spin?",
        spinning_into,
        "m2 / m1",
        (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8),
        FRICTION_OFF,
        runs=PHASES,
    ),
    rough(
        "slide_to_roll",
        "How far may a disk slide in a step and still come to roll at 2/3 of its speed?",
        sliding,
        "v dt / R",
        (0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0),
        ROLLING_OFF,
        runs=4,
    ),
    rough(
        "critical_slope",
        "How near to the steepest slope for rolling does a disk still roll?",
        # up to tan(angle) = 3 mu a solid disk rolls
        lambda x, _run: on_floor(0.0, 0.25, 3 * 0.25 * (1 - x), 64),
        "1 - tan(angle) / 3 mu",
        (0.9, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5),
        SLIPS,
    ),
    rough(
        "creep_at_rest",
        "For how many steps does a disk stay at rest in a corner?",
        in_corner,
        "steps",
        (100.0, 1e3, 1e4, 1e5),
        CREEPS,
        whole=True,
        refines=False,
        quick_values=(100.0, 1e4),
    ),
)
