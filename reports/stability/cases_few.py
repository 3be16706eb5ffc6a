"""What the scenes of all cases are made of, and where in a step a collision falls. Scenes of one
disk or two: a collision is missed, spurious, grazed, slow, or between unequal masses; a floor under
gravity, a spring, a spin; another size, another place; friction in a bounce, between unequal
masses, from sliding to rolling, on a slope, at rest."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from functools import cache, partial
from math import ceil, hypot, sqrt
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.run import Run, fault_of, gather
from crosscheck2d.reports.stability.limits import DrivenEngine
from crosscheck2d.scenarios.families.friction import start_of, turning_answer
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import NO_COLLISIONS, Array, Scenario, Scene, State, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, at_rest, bouncing, flight, pair
from crosscheck2d.scenarios.truth.sliding import bounce, slide, spinning_pair

RADIUS, G, DT = 0.25, 10.0, 1 / 64
LEAD, AFTER = 3, 6  # whole steps before the step of the collision, and after it
EDGE = 1e-3  # of a step: how near to a step's very beginning, or end, a phase comes
MOST = 1024  # runs, more than any case has


def scenario_of(
    scene: Scene,
    duration: float,
    interval: float,
    every: int = 1,
    truth: Callable[[Array], Trajectory] | None = None,
    **more: Any,
) -> Scenario:
    # `every` steps in a sample interval
    asks, source = "Does it work?", "reports/stability"  # a case has its own question
    return Scenario("case", asks, source, scene, duration, interval, (every,), truth=truth, **more)


def stepped(scene: Scene, dt: float, truth: Callable[[Array], Trajectory]) -> Scenario:
    return scenario_of(scene, (LEAD + 1 + AFTER) * dt, dt, truth=truth)


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
        [[start, offset * reach], [0, 0]],
        [[speed, 0.0], [0.0, 0.0]],
        radius=[RADIUS, radius],
        mass=[1.0, mass],
        restitution=e,
    )
    return stepped(scene, dt, partial(pair_answer, scene))


def pair_answer(scene: Scene, t: Array) -> Trajectory:
    """The exact answer of two disks that meet once at most, at the times t (k,) s: momentum, and
    Newton's restitution along the line of centres (Landau & Lifshitz, Mechanics, 17)."""
    position, velocity, radius, mass = scene.position, scene.velocity, scene.radius, scene.mass
    legs, impulse = pair(position, velocity, radius, mass, scene.restitution)
    collisions = [(float(at), 0, 1, float(kick)) for at, kick in zip(legs.start[1:], impulse)]
    return answer(scene, t, legs.at(t), collisions)


def free_answer(scene: Scene, t: Array) -> Trajectory:
    return answer(scene, t, flight(t[:, None, None], scene.position, scene.velocity))


@cache
def sampled(seed: int) -> tuple[float, ...]:
    """`MOST` numbers from 0 to 1, the same for a seed on every machine."""
    return tuple(float(x) for x in np.random.default_rng(seed).random(MOST))


def phase(run: int) -> float:
    """Where within its step the collision of a run happens: 0 is the beginning of the step, 1
    its end.

    Run 0 has it at the very beginning, where it is found latest. Of the other runs every second
    follows an even sequence (van der Corput: 1/2, 1/4, 3/4, 1/8 ...) and the rest are random,
    because an error that repeats with the step could escape the even ones. So the first few runs
    are a good sample.
    """
    if run == 0:
        return EDGE
    if run % 2:
        k = (run + 1) // 2
        where = int(f"{k:b}"[::-1], 2) / (1 << k.bit_length())  # its digits mirrored at the point
    else:
        where = sampled(seed=0)[run // 2]
    return EDGE + (1 - 2 * EDGE) * where


def thin_wall(x: float, run: int) -> Scenario:
    speed = x * RADIUS / DT
    start = -RADIUS - speed * DT * (LEAD + phase(run))
    scene = lay_out([[start, 0]], [[speed, 0]], walls=[[[0, -4], [0, 4]]])

    def truth(t: Array) -> Trajectory:
        x, v = flight(t[:, None, None], scene.position, scene.velocity)
        beyond = x[..., 0] > -RADIUS
        x[..., 0] = np.where(beyond, -2 * RADIUS - x[..., 0], x[..., 0])
        v[..., 0] = np.where(beyond, -speed, speed)
        return answer(scene, t, (x, v), [((-RADIUS - start) / speed, 0, -1, 2 * speed)])

    return stepped(scene, DT, truth)


HEIGHT = 1.25  # m, so that the fall lasts 0.5 s and ends at 5 m/s
FALLS = 20  # the drop and nine and a half bounces
OSCILLATION = 400  # steps


def ball(x: float, run: int) -> Scenario:
    """A ball at e = 1, sampled about 24 times in each flight; x = dt over the time of the fall.

    The runs differ in height, which changes the rounding of a step, and in the phase of the first
    collision within its step: some methods do better than usual where a fall takes a whole number
    of steps. Their dt over the time of the fall is x, or less by up to one step of the fall.
    """
    height = HEIGHT * (1 + 0.01 * sampled(seed=1)[run])
    fall = sqrt(2 * height / G)
    dt = fall / (1 / x + phase(run) - EDGE)
    every = max(1, int(1 / (12 * x)))
    interval = every * dt
    samples = round(FALLS * fall / interval)
    scene = lay_out([[0, RADIUS + height]], gravity=[0, -G], walls=[[[-4, 0], [4, 0]]])

    def truth(t: Array) -> Trajectory:
        legs = bouncing(height, G, 1.0, t[-1])
        gap, speed = legs.at(t)
        position, velocity = (np.stack([0 * y, y], axis=-1)[:, None] for y in (gap + RADIUS, speed))
        return answer(scene, t, (position, velocity), legs.wall_collisions(0, (0,), 1.0, 1.0))

    return scenario_of(scene, samples * interval, interval, every, truth)


def scaled(x: float, _run: int) -> Scenario:
    # at x = 1 they approach by 0.13 radii in 1/60 s
    scene = lay_out([[-2.2 * x, 0.0], [0.0, 0.0]], [[4.0 * x, 0.0], [0.0, 0.0]], radius=0.5 * x)
    return scenario_of(scene, 1.0, 1 / 60, truth=partial(pair_answer, scene))


def far(x: float, _run: int) -> Scenario:
    scene = lay_out([[x, 0]], [[1.0, 0]])
    return scenario_of(scene, 1.0, 1 / 30, 8, partial(free_answer, scene))


def spinning(x: float, _run: int) -> Scenario:
    scene = lay_out([[0, 0]], [[1.0, 0]], angular_velocity=[x / DT])
    return scenario_of(scene, 0.5, DT, truth=partial(free_answer, scene))


def oscillator(x: float, _run: int) -> Scenario:
    scene = lay_out([[1.0, 0]])  # 1 kg on a spring of 1 N/m, so that w = 1 rad/s

    def truth(t: Array) -> Trajectory:
        position, velocity = np.zeros((len(t), 1, 2)), np.zeros((len(t), 1, 2))
        position[:, 0, 0], velocity[:, 0, 0] = np.cos(t), -np.sin(t)
        return answer(scene, t, (position, velocity))

    return scenario_of(scene, OSCILLATION * x, x, truth=truth)


def on_spring(driven: DrivenEngine, scenario: Scenario) -> tuple[Scenario, Run]:
    """Play a disk with the force -x N, read from its position before every step, as a user of an
    engine would write it."""
    states: list[State] = []
    status, reason, settings = "ok", "", {}
    dt = scenario.sample_interval
    with closing(driven.make()) as engine:
        try:
            engine.load(scenario.scene, dt)
            settings = engine.settings()
            states.append(engine.read())
            for _ in range(scenario.intervals):
                engine.apply_force(0, -states[-1].position[0], 0.0)
                engine.step()
                states.append(engine.read())
                if reason := fault_of(states[-1], 1e6):
                    status = "diverged"
                    break
        except Unsupported as refusal:
            status, reason = "unsupported", str(refusal)
    trajectory = gather(scenario, states, NO_COLLISIONS) if states else None
    name, profile = driven.name.split(":")
    run = Run(name, profile, scenario.name, dt, status, reason, trajectory, settings=settings)
    return scenario, run


# Friction. Every exact answer is a closed form (scenarios/truth/sliding.py) and holds to the end of
# the run: no collision here is followed by another, so that no rounding grows.

SOLID = 2.0  # m r2 / I
FALL = 4.0  # m/s, four times the threshold of restitution of both Box2Ds as shipped
# A step displacement of 0.05 radii: an engine that takes its lever arm to the middle of the overlap
# is off by half of that at most.
BOUNCE_DT = 0.05 * RADIUS / FALL
FLOOR = [[[-200.0, 0.0], [200.0, 0.0]]]


def rough_bounce(
    along: float, run: int, *, spin: float = 0.0, e: float = 0.0, mu: float = 0.1
) -> Scenario:
    height = FALL * BOUNCE_DT * (LEAD + phase(run))
    scene = lay_out(
        [[0.0, RADIUS + height]],
        [[along, -FALL]],
        angular_velocity=[spin],
        walls=FLOOR,
        restitution=e,
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
    scene = lay_out(
        [[start, 0.0], [0.0, 0.0]],
        [[FALL, 0.0], [0.0, 0.0]],
        angular_velocity=[1.0 / RADIUS, 0.0],
        mass=[1.0, x],
        restitution=0.5,
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
    scene = lay_out(
        [[0.0, RADIUS]],
        [[speed, 0.0]],
        walls=[[[-10.0, 0.0], [10.0 + speed * steps * DT, 0.0]]],
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

    return scenario_of(scene, steps * DT, DT, truth=truth)


def sliding(x: float, run: int) -> Scenario:
    # the runs differ in where within its step the slide ends, by up to one step
    friction, speed = 0.5 * (1 + 0.02 * phase(run)), x * RADIUS / DT
    slides = speed / (3 * friction * G)
    return on_floor(speed, friction, 0.0, ceil(1.5 * slides / DT) + AFTER)


def in_corner(x: float, _run: int) -> Scenario:
    # on a floor and against a wall: the normal forces alone carry the disk
    walls = [[[-1.0, 0.0], [4.0, 0.0]], [[0.0, -1.0], [0.0, 4.0]]]
    scene = lay_out(
        [[RADIUS, RADIUS]], walls=walls, gravity=[-3.0, -G], restitution=0.0, friction=0.5
    )
    every = max(1, int(x) // 100)
    duration = int(x) // every * every * DT
    return scenario_of(scene, duration, every * DT, every, lambda t: at_rest(scene, t))


# case -> its scene at a value of the parameter, in a run
SCENES: dict[str, Callable[[float, int], Scenario]] = {
    "tunnelling_head_on": lambda x, run: flyby(x * RADIUS / DT, run),
    "tunnelling_offset": lambda x, run: flyby(x * RADIUS / DT, run, offset=0.7),
    "tunnelling_thin_wall": thin_wall,
    # the thickest wall that a scene can state
    "tunnelling_thick_wall": lambda x, run: flyby(
        x * RADIUS / DT, run, mass=np.inf, radius=10 * RADIUS
    ),
    "grazing": lambda x, run: flyby(0.2 * RADIUS / DT, run, offset=1 - x),
    "near_miss": lambda x, run: flyby(0.2 * RADIUS / DT, run, offset=1 + x),
    "slow_collision": flyby,
    "restitution": lambda x, run: flyby(4.0, run, e=1 - x),
    # the heavier one rests; v dt / R = 0.1
    "mass_ratio": lambda x, run: flyby(0.1 * RADIUS / DT, run, mass=x),
    "bounce_drift": ball,
    "scale_up": scaled,
    "scale_down": scaled,
    "far_from_origin": far,
    "spin": spinning,
    "stiff_force": oscillator,
}
SCENES_WITH_FRICTION: dict[str, Callable[[float, int], Scenario]] = {
    # the rim slips during the whole collision
    "friction_in_bounce": lambda x, run: rough_bounce(5.0, run, e=x),
    "strong_friction": lambda x, run: rough_bounce(3.0, run, e=0.5, mu=x),
    "spin_in_bounce": lambda x, run: rough_bounce(0.0, run, spin=x / BOUNCE_DT, mu=0.5),
    "friction_mass_ratio": spinning_into,
    "slide_to_roll": sliding,
    # up to tan(angle) = 3 mu a solid disk rolls
    "critical_slope": lambda x, _run: on_floor(0.0, 0.25, 3 * 0.25 * (1 - x), 64),
    "creep_at_rest": in_corner,
}
