"""Cases of friction: in a bounce, between unequal masses, from sliding to rolling, on a slope, at
rest.

Every exact answer is a closed form (scenarios/truth/sliding.py) and holds to the end of the run:
no collision here is followed by another, so that no rounding grows and the horizon is the duration.
"""

from __future__ import annotations

from math import ceil, hypot

import numpy as np

from crosscheck2d.reports.stability.cases_collisions import AFTER, LEAD, stepped
from crosscheck2d.reports.stability.limits import Case
from crosscheck2d.reports.stability.phases import phase
from crosscheck2d.reports.stability.predicates_friction import (
    CREEPS,
    FRICTION_OFF,
    ROLLING_OFF,
    SLIPS,
)
from crosscheck2d.reports.stability.variants import WITH_FRICTION_ONLY
from crosscheck2d.scenarios.families.friction import IMPACT, ROLL, start_of, turning_answer
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import at_rest
from crosscheck2d.scenarios.truth.sliding import bounce, slide, spinning_pair

RADIUS, SOLID, G = 0.25, 2.0, 10.0  # SOLID: m r2 / I
FALL = 4.0  # m/s, four times the threshold of restitution of both Box2Ds as shipped
# A step displacement of 0.05 radii: an engine that takes its lever arm to the middle of the overlap
# is off by half of that at most.
DT = 0.05 * RADIUS / FALL
PHASES = 8  # runs at a value, each with the collision elsewhere in its step
FLOOR = [[[-200.0, 0.0], [200.0, 0.0]]]
REST_DT = 1 / 64


def rough_bounce(
    along: float, run: int, *, spin: float = 0.0, e: float = 0.0, mu: float = 0.1
) -> Scenario:
    """A disk falls onto a floor at `FALL`, along it at `along` m/s, with a spin in rad/s."""
    height = FALL * DT * (LEAD + phase(run))
    scene = lay_out(
        position=[[0.0, RADIUS + height]],
        velocity=[[along, -FALL]],
        angular_velocity=[spin],
        radius=[RADIUS],
        mass=[1.0],
        walls=FLOOR,
        restitution=e,
        friction=mu,
    )

    def truth(t: Array) -> Trajectory:
        start, v = start_of(scene)
        legs = bounce(start, v, scene.radius, np.array([SOLID]), e, mu, height)
        collision = (float(legs.start[1]), 0, -1, (1 + e) * FALL)
        return turning_answer(scene, t, legs.at(t), [collision])

    asks = "Does friction brake and turn the disk?"
    return stepped("rough-bounce", asks, scene, DT, truth, IMPACT)


def spinning_into(x: float, run: int) -> Scenario:
    """A spinning disk of mass 1 meets one of mass x that rests: they stick, e = 0.5, friction 1."""
    start = -2 * RADIUS - FALL * DT * (LEAD + phase(run))
    scene = lay_out(
        position=[[start, 0.0], [0.0, 0.0]],
        velocity=[[FALL, 0.0], [0.0, 0.0]],
        angular_velocity=[1.0 / RADIUS, 0.0],
        radius=[RADIUS, RADIUS],
        mass=[1.0, x],
        restitution=0.5,
        friction=1.0,
    )

    def truth(t: Array) -> Trajectory:
        legs, impulse = spinning_pair(scene, 0)
        return turning_answer(
            scene, t, legs.at(t), [(float(legs.start[1]), 0, 1, float(impulse[0]))]
        )

    return stepped("spinning-into", "Do they exchange spin and speed?", scene, DT, truth, IMPACT)


def on_floor(asks: str, speed: float, friction: float, slope: float, steps: int) -> Scenario:
    """A disk touches a floor and has no spin; gravity leans forward by `slope`, its tangent.

    A leaning gravity stands for a slope: so the disk touches the floor exactly in float64.
    """
    cosine = 1 / hypot(1.0, slope)
    sine = slope * cosine
    scene = lay_out(
        position=[[0.0, RADIUS]],
        velocity=[[speed, 0.0]],
        radius=[RADIUS],
        mass=[1.0],
        walls=[[[-10.0, 0.0], [10.0 + speed * steps * REST_DT, 0.0]]],
        gravity=[G * sine, -G * cosine],
        restitution=0.0,
        friction=friction,
    )

    def truth(t: Array) -> Trajectory:
        way, rate = slide(speed, 0.0, RADIUS, SOLID, friction, G * sine, G * cosine).at(t)
        place, moves = (np.zeros((len(t), 1, 3)) for _ in range(2))
        place[:, 0, 0::2], moves[:, 0, 0::2] = way, rate
        place[..., :2] += scene.position
        return turning_answer(scene, t, (place, moves), [(0.0, 0, -1, 0.0)])

    duration = steps * REST_DT
    return Scenario("on-floor", asks, ROLL, scene, duration, REST_DT, (1,), truth=truth)


def cone(x: float, run: int) -> Scenario:
    """x = e; friction 0.1, so that the rim slips during the whole collision."""
    return rough_bounce(5.0, run, e=x)


def strong(x: float, run: int) -> Scenario:
    """x = friction, enough for the rim to stick; e = 0.5."""
    return rough_bounce(3.0, run, e=0.5, mu=x)


def whirling(x: float, run: int) -> Scenario:
    """x = w dt, e = 0, friction 0.5."""
    return rough_bounce(0.0, run, spin=x / DT, mu=0.5)


def sliding(x: float, run: int) -> Scenario:
    """x = v dt / R; friction 0.5. The runs differ in where within its step the slide ends, by up
    to one step."""
    friction, speed = 0.5 * (1 + 0.02 * phase(run)), x * RADIUS / REST_DT
    slides = speed / (3 * friction * G)
    steps = ceil(1.5 * slides / REST_DT) + AFTER
    return on_floor("Does it come to roll?", speed, friction, 0.0, steps)


def nearly_slipping(x: float, _run: int) -> Scenario:
    """x = 1 - tan(angle) / 3 mu: up to tan(angle) = 3 mu a solid disk rolls; friction 0.25, 1 s."""
    return on_floor("Does it roll?", 0.0, 0.25, 3 * 0.25 * (1 - x), 64)


def in_corner(x: float, _run: int) -> Scenario:
    """A disk lies in a corner for x steps, on a floor and against a wall; friction 0.5."""
    scene = lay_out(
        position=[[RADIUS, RADIUS]],
        velocity=[[0.0, 0.0]],
        radius=[RADIUS],
        mass=[1.0],
        walls=[[[-1.0, 0.0], [4.0, 0.0]], [[0.0, -1.0], [0.0, 4.0]]],
        gravity=[-3.0, -G],
        restitution=0.0,
        friction=0.5,
    )
    every = max(1, int(x) // 100)
    return Scenario(
        "in-corner",
        "Does it stay?",
        "equilibrium: the normal forces alone carry it",
        scene,
        int(x) // every * every * REST_DT,
        every * REST_DT,
        (every,),
        truth=lambda t: at_rest(scene, t),
    )


FRICTION = (
    Case(
        "friction_in_bounce",
        "Up to which e does friction in a bounce follow Coulomb's law?",
        "e",
        (0.05, 0.07, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0),
        cone,
        FRICTION_OFF,
        runs=PHASES,
        also=WITH_FRICTION_ONLY,
    ),
    Case(
        "strong_friction",
        "How large may friction be where the rim sticks in a bounce?",
        "friction",
        (0.3, 1.0, 3.0, 10.0, 100.0, 1e3, 1e4, 1e6, 1e8),
        strong,
        FRICTION_OFF,
        runs=PHASES,
        also=WITH_FRICTION_ONLY,
    ),
    Case(
        "spin_in_bounce",
        "How fast may a disk spin that falls onto a floor with friction?",
        "w dt",
        (0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0, 3.0, 6.0, 10.0),
        whirling,
        FRICTION_OFF,
        unit="rad",
        runs=PHASES,
        also=WITH_FRICTION_ONLY,
    ),
    Case(
        "friction_mass_ratio",
        "How unequal may two masses be that exchange spin?",
        "m2 / m1",
        (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8),
        spinning_into,
        FRICTION_OFF,
        runs=PHASES,
        also=WITH_FRICTION_ONLY,
    ),
    Case(
        "slide_to_roll",
        "How far may a disk slide in a step and still come to roll at 2/3 of its speed?",
        "v dt / R",
        (0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0),
        sliding,
        ROLLING_OFF,
        runs=4,
        also=WITH_FRICTION_ONLY,
    ),
    Case(
        "critical_slope",
        "How near to the steepest slope for rolling does a disk still roll?",
        "1 - tan(angle) / 3 mu",
        (0.9, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5),
        nearly_slipping,
        SLIPS,
        also=WITH_FRICTION_ONLY,
    ),
    Case(
        "creep_at_rest",
        "For how many steps does a disk stay at rest in a corner?",
        "steps",
        (100.0, 1e3, 1e4, 1e5),
        in_corner,
        CREEPS,
        whole=True,
        also=WITH_FRICTION_ONLY,
        refines=False,
        quick_values=(100.0, 1e4),
    ),
)
