"""What the scenes of all cases are made of, and where in a step a collision falls. Cases of one
disk or two: a collision is missed, spurious, grazed, slow, or between unequal masses; a floor under
gravity, a spring, a spin; another size, another place."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from functools import cache, partial
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.run import Run, fault_of, gather
from crosscheck2d.reports.stability.limits import Case, DrivenEngine, with_variant
from crosscheck2d.reports.stability.predicates import (
    ANGLE_OFF,
    BOUNCES_OFF,
    COLLISIONS_MISSED,
    COLLISIONS_SPURIOUS,
    RESTITUTION_OFF,
    SCALED_DEVIATION,
    SPRING_GROWS,
    VELOCITY_OFF,
    WRONG_DISTANCE,
)
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import NO_COLLISIONS, Array, Scenario, Scene, State, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, bouncing, flight, pair

RADIUS, G, DT = 0.25, 10.0, 1 / 64
LEAD, AFTER = 3, 6  # whole steps before the step of the collision, and after it
EDGE = 1e-3  # of a step: how near to a step's very beginning, or end, a phase comes
MOST = 1024  # runs, more than any case has
SEEDS = 16  # runs at a value of what is sampled


def disks(
    position: Any,
    velocity: Any = 0.0,
    *,
    radius: ArrayLike = RADIUS,
    mass: ArrayLike = 1.0,
    e: float = 1.0,
    **more: Any,
) -> Scene:
    """The scene of disks at these places (n, 2); one number stands for all of them."""
    n = len(np.asarray(position))
    return lay_out(
        position=position,
        velocity=np.broadcast_to(velocity, (n, 2)),
        radius=np.broadcast_to(radius, n),
        mass=np.broadcast_to(mass, n),
        restitution=e,
        **more,
    )


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
    scene = disks(
        [[start, offset * reach], [0, 0]],
        [[speed, 0], [0, 0]],
        radius=[RADIUS, radius],
        mass=[1.0, mass],
        e=e,
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


# runs at a value, each with the collision elsewhere in its step: a run is a millisecond
PHASES = 32
FAST = (0.125, 0.25, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0, 5.66, 8.0, 11.3, 16.0, 22.6, 32.0)
GRAZES = (0.5, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
MISSES = (0.5, 0.2, 0.1, *GRAZES[2:], 5e-5, 2e-5, 1e-5)
BULLETS = with_variant("bullets")


def thin_wall(x: float, run: int) -> Scenario:
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


phased = partial(Case, runs=PHASES)
tunnelling = partial(
    phased, parameter="v dt / R", values=FAST, predicate=COLLISIONS_MISSED, also=BULLETS
)
COLLISIONS = (
    tunnelling(
        "tunnelling_head_on",
        "How far may a disk fly in a step without missing a disk head-on?",
        lambda x, run: flyby(x * RADIUS / DT, run),
    ),
    tunnelling(
        "tunnelling_offset",
        "How far may a disk fly in a step without missing a disk off centre, by 0.7 of the sum of"
        " the radii?",
        lambda x, run: flyby(x * RADIUS / DT, run, offset=0.7),
    ),
    tunnelling(
        "tunnelling_thin_wall",
        "How far may a disk fly in a step without missing a wall?",
        thin_wall,
    ),
    tunnelling(
        "tunnelling_thick_wall",
        "How far may a disk fly in a step without missing a static disk of ten radii?",
        # the thickest wall that a scene can state
        lambda x, run: flyby(x * RADIUS / DT, run, mass=np.inf, radius=10 * RADIUS),
    ),
    phased(
        "grazing",
        "How near to grazing may a collision at v dt / R = 0.2 be and still be found?",
        lambda x, run: flyby(0.2 * RADIUS / DT, run, offset=1 - x),
        "1 - b / 2R",
        GRAZES,
        COLLISIONS_MISSED,
        also=BULLETS,
    ),
    phased(
        "near_miss",
        "How near may a disk pass at v dt / R = 0.2 without a collision?",
        lambda x, run: flyby(0.2 * RADIUS / DT, run, offset=1 + x),
        "b / 2R - 1",
        MISSES,
        COLLISIONS_SPURIOUS,
    ),
    phased(
        "slow_collision",
        "How slow may a collision at e = 1 be and still be elastic?",
        flyby,
        "closing speed",
        (8.0, 4.0, 2.0, 1.41, 0.7, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3),
        RESTITUTION_OFF,
        unit="m/s",
    ),
    phased(
        "restitution",
        "Is a collision at 4 m/s played with the e that the scene states?",
        lambda x, run: flyby(4.0, run, e=1 - x),
        "1 - e",
        (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0),
        RESTITUTION_OFF,
    ),
    phased(
        "mass_ratio",
        "How unequal may two masses be that meet at e = 1?",
        # the heavier one rests; v dt / R = 0.1
        lambda x, run: flyby(0.1 * RADIUS / DT, run, mass=x),
        "m2 / m1",
        (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8),
        VELOCITY_OFF,
    ),
)


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
    scene = disks([[0, RADIUS + height]], gravity=[0, -G], walls=[[[-4, 0], [4, 0]]])

    def truth(t: Array) -> Trajectory:
        legs = bouncing(height, G, 1.0, t[-1])
        gap, speed = legs.at(t)
        position, velocity = (np.stack([0 * y, y], axis=-1)[:, None] for y in (gap + RADIUS, speed))
        return answer(scene, t, (position, velocity), legs.wall_collisions(0, (0,), 1.0, 1.0))

    return scenario_of(scene, samples * interval, interval, every, truth)


def scaled(x: float, _run: int) -> Scenario:
    # at x = 1 they approach by 0.13 radii in 1/60 s
    scene = disks([[-2.2 * x, 0], [0, 0]], [[4.0 * x, 0], [0, 0]], radius=0.5 * x)
    return scenario_of(scene, 1.0, 1 / 60, truth=partial(pair_answer, scene))


def far(x: float, _run: int) -> Scenario:
    scene = disks([[x, 0]], [[1.0, 0]])
    return scenario_of(scene, 1.0, 1 / 30, 8, partial(free_answer, scene))


def spinning(x: float, _run: int) -> Scenario:
    scene = disks([[0, 0]], [[1.0, 0]], angular_velocity=[x / DT])
    return scenario_of(scene, 0.5, DT, truth=partial(free_answer, scene))


def oscillator(x: float, _run: int) -> Scenario:
    scene = disks([[1.0, 0]])  # 1 kg on a spring of 1 N/m, so that w = 1 rad/s

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


LARGER = (1.0, 3.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3)
SMALLER = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)
SUBSTEPS = with_variant("16_substeps")
ALONE = (
    Case(
        "bounce_drift",
        "Up to which dt does a ball at e = 1 come back to its height?",
        ball,
        "dt / fall time",
        (0.002, 0.003, 0.005, 0.007, 0.01, 0.015, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2),
        BOUNCES_OFF,
        runs=16,
        also=(*SUBSTEPS, *with_variant("no_correction")),
    ),
    *(
        Case(
            f"scale_{way}",
            f"How much {word} may a scene be made and stay the same?",
            scaled,
            "scale",
            values,
            SCALED_DEVIATION,
        )
        for way, values, word in (("up", LARGER, "larger"), ("down", SMALLER, "smaller"))
    ),
    Case(
        "far_from_origin",
        "How far from the origin may a disk at 1 m/s be and still fly on?",
        far,
        "offset",
        (1.0, 10.0, 100.0, 1e3, 3e3, 1e4, 3e4, 1e5, 1e6, 1e7, 1e8),
        WRONG_DISTANCE,
        unit="m",
    ),
    Case(
        "spin",
        "How fast may a disk spin?",
        spinning,
        "w dt",
        (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0, 3.0, 6.0, 10.0),
        ANGLE_OFF,
        unit="rad",
        also=SUBSTEPS,
    ),
    Case(
        "stiff_force",
        "How stiff may a spring be whose force is read off the positions before each step?",
        oscillator,
        "w dt",
        (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0),
        SPRING_GROWS,
        play=on_spring,
    ),
)
