"""Cases of one disk or two: a collision is missed, spurious, grazed, slow, or between unequal
masses; a floor under gravity, a spring, a spin; another size, another place."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from math import sqrt

import numpy as np

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.run import Run, fault_of, gather
from crosscheck2d.reports.stability.limits import Case
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
from crosscheck2d.reports.stability.scenes import (
    DT,
    EDGE,
    LEAD,
    RADIUS,
    G,
    disks,
    flyby,
    free_answer,
    pair_answer,
    phase,
    sampled,
    scenario_of,
    stepped,
)
from crosscheck2d.reports.stability.variants import DrivenEngine, with_variant
from crosscheck2d.scenarios.model import NO_COLLISIONS, Array, Scenario, State, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, bouncing, flight

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


HEIGHT = 1.25  # m, so that the fall lasts 0.5 s and ends at 5 m/s
FALLS = 20  # the drop and nine and a half bounces
OSCILLATION = 400  # steps


def ball(x: float, run: int) -> Scenario:
    """Up to which dt does a ball at e = 1 come back to its height?

    It is sampled about 24 times in each flight; x = dt over the time of the fall. The runs differ
    in height, which changes the rounding of a step, and in the phase of the first collision within
    its step: some methods do better than usual where a fall takes a whole number of steps. Their dt
    over the time of the fall is x, or less by up to one step of the fall.
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
    """Two disks of x / 2 m meet head-on at 4 x m/s with e = 1: at x = 1 they approach by 0.13
    radii in 1/60 s."""
    scene = disks([[-2.2 * x, 0], [0, 0]], [[4.0 * x, 0], [0, 0]], radius=0.5 * x)
    return scenario_of(scene, 1.0, 1 / 60, truth=partial(pair_answer, scene))


def far(x: float, _run: int) -> Scenario:
    """How far from the origin may a disk at 1 m/s be and still fly on?

    For 1 s in steps of 1/240 s.
    """
    scene = disks([[x, 0]], [[1.0, 0]])
    return scenario_of(scene, 1.0, 1 / 30, 8, partial(free_answer, scene))


def spinning(x: float, _run: int) -> Scenario:
    """How fast may a disk spin?"""
    scene = disks([[0, 0]], [[1.0, 0]], angular_velocity=[x / DT])
    return scenario_of(scene, 0.5, DT, truth=partial(free_answer, scene))


def oscillator(x: float, _run: int) -> Scenario:
    """How stiff may a spring be whose force is read off the positions before each step?

    A disk of 1 kg on a spring of 1 N/m, so that w = 1 rad/s; x = w dt.
    """
    scene = disks([[1.0, 0]])

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


FALL_STEPS = (0.002, 0.003, 0.005, 0.007, 0.01, 0.015, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2)
LARGER = (1.0, 3.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3)
SMALLER = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)
DECADES = (1.0, 10.0, 100.0, 1e3, 3e3, 1e4, 3e4, 1e5, 1e6, 1e7, 1e8)
TURNS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0, 3.0, 6.0, 10.0)
SWINGS = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0)
SUBSTEPS = with_variant("16_substeps")
ALONE = (
    Case(
        "bounce_drift",
        ball,
        "dt / fall time",
        FALL_STEPS,
        BOUNCES_OFF,
        runs=16,
        also=(*SUBSTEPS, *with_variant("no_correction")),
    ),
    *(
        Case(f"scale_{way}", scaled, "scale", values, SCALED_DEVIATION, asks)
        for way, values, asks in (
            ("up", LARGER, "How much larger may a scene be made and stay the same?"),
            ("down", SMALLER, "How much smaller may a scene be made and stay the same?"),
        )
    ),
    Case("far_from_origin", far, "offset", DECADES, WRONG_DISTANCE, unit="m"),
    Case("spin", spinning, "w dt", TURNS, ANGLE_OFF, unit="rad", also=SUBSTEPS),
    Case("stiff_force", oscillator, "w dt", SWINGS, SPRING_GROWS, play=on_spring),
)
