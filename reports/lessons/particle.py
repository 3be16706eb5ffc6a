"""Lesson 1: a particle and its step."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Lesson,
    LessonChart,
    Shown,
    Simulation,
    Slider,
    farthest,
    swept,
    time_step,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.lesson import ping_pong
from crosscheck2d.scenarios.model import Array, Scenario
from crosscheck2d.scenarios.truth.exact import with_oracle

STEPS = (64, 32, 16, 8, 4, 2)  # of a sample interval of 1/8 s
METHODS = ("reference:lesson", "reference:exercise")
ROUNDING = 1e-11  # m: some thousand steps, each of which rounds a height of up to 11 m in float64


def bouncing(speed: float, gravity: float) -> Scenario:
    """The lesson's particle between y = 1 and y = 11, thrown upwards, for 20 m of its way: past
    both walls."""
    base = ping_pong()
    scene = replace(
        base.scene, velocity=np.array([[0.0, speed]]), gravity=np.array([0.0, -gravity])
    )
    return with_oracle(
        replace(base, scene=scene, duration=20.0 / speed, sample_interval=1 / 8, truth=None)
    )


def show_particle(part: str, k: int) -> Shown:
    """Height over time, and the error against the step."""
    speed, gravity, claims = PARTS[part]
    scenario = bouncing(speed, gravity)
    played = Simulation.by(scenario, METHODS, k)
    steps = np.array([scenario.dt(each) for each in STEPS])
    errors = swept(
        1e3 * steps,
        [Simulation.by(scenario, METHODS, each) for each in STEPS],
        lambda each, scene: farthest(each, played.truth, scene).max(),
    )
    dt, radius = scenario.dt(k), float(scenario.scene.radius[0])
    guides = [("x", 1e3 * dt, "here")]
    if speed * scenario.dt(STEPS[-1]) > radius:
        guides.append(("x", 1e3 * radius / speed, "v dt = R"))
    return Shown(
        [
            played.over_time("Height", "y in m", lambda each: each.position[:, 0, 1]),
            LessonChart("Distance from the exact answer", "time in s", "m", played.errors()),
            LessonChart(
                f"Largest error in {number(scenario.duration)} s, against the step",
                "dt in ms",
                "m",
                errors,
                "xy",
                guides,
            ),
        ],
        played.film,
        [
            ("speed at the start, v", f"{number(speed)} m/s"),
            ("gravity, g", f"{number(gravity)} m/s²"),
            *(
                (f"{curve.name}, largest error", f"{number(np.max(curve.y))} m")
                for curve in played.errors()
            ),
        ],
        list(claims(played)),
    )


def way_of(played: Simulation) -> float:
    """v dt of the start, m."""
    return float(np.hypot(*played.scenario.scene.velocity[0])) * played.runs[0].dt


def without_force(played: Simulation) -> Iterator[Claim]:
    """Exact flight, and a bounce that is found up to one step late."""
    way = way_of(played)
    bounces = np.searchsorted(played.truth.collisions.t, played.truth.t, side="right")
    speed = float(np.hypot(*played.scenario.scene.velocity[0]))
    mm = number(1e3 * way)
    yield Claim(
        f"Here v = {number(speed)} m/s. Until the first bounce both methods are exact: without"
        " a force, v dt is the whole motion of a step.",
        lambda shown: all(shown.y(name, 1)[bounces == 0].max() < ROUNDING for name in METHODS),
    )
    yield Claim(
        "A bounce is found at the end of a step, up to dt late. reference:exercise then moves"
        f" the particle back to the wall and loses up to v dt = {mm} mm at each bounce."
        " reference:lesson does not move it back and loses up to 2 v dt.",
        lambda shown: all(
            (shown.y(name, 1) <= each * way * bounces + ROUNDING).all()
            for name, each in (("reference:exercise", 1), ("reference:lesson", 2))
        ),
    )
    yield Claim(
        "A smaller step has a smaller error, with both methods.",
        lambda shown: all((np.diff(shown.y(name, 2)) > 0).all() for name in METHODS),
    )


def with_gravity(played: Simulation) -> Iterator[Claim]:
    """Two orders of the same two lines."""
    g = float(np.hypot(*played.scenario.scene.gravity))
    gain = g * played.runs[0].dt  # m/s in a step
    flight = played.truth.t < played.first_collision
    offset = gain * played.truth.t[flight] / 2
    late = 1e3 * offset[-1]
    yield Claim(
        f"Here g = {number(g)} m/s². Until the first bounce explicit Euler (reference:lesson)"
        f" is g dt t / 2 above the exact parabola, {number(late)} mm at t ="
        f" {number(float(played.truth.t[flight][-1]))} s, the last sample before it. Symplectic"
        " Euler (reference:exercise) is as far below it.",
        lambda shown: all(
            np.abs(above(shown, name)[flight] - sign * offset).max() < ROUNDING
            for name, sign in (("reference:lesson", 1), ("reference:exercise", -1))
        ),
    )
    yield Claim(
        "Explicit Euler rises higher than the exact answer, symplectic Euler less high.",
        lambda shown: (
            shown.y("reference:lesson").max()
            > shown.y(TRUTH).max()
            > shown.y("reference:exercise").max()
        ),
    )
    yield Claim(
        f"From the largest step to the smallest, {STEPS[0] // STEPS[-1]} times smaller, both"
        " errors fall to less than a tenth. Not every halving of the step reduces the error,"
        " because the detection delay of a bounce depends on where in a step it happens.",
        lambda shown: (
            all(10 * shown.y(name, 2)[0] < shown.y(name, 2)[-1] for name in METHODS)
            and any((np.diff(shown.y(name, 2)) < 0).any() for name in METHODS)
        ),
    )


def tunnelling(played: Simulation) -> Iterator[Claim]:
    """A wall acts on what overlaps it at the end of a step."""
    way, radius = way_of(played), float(played.scenario.scene.radius[0])
    apart = f"A step moves the particle by v dt = {number(way)} m; its radius is R = {radius} m."
    low, high = 1 - radius, 11 + radius  # m, where the walls are
    if way <= radius:
        yield Claim(
            f"{apart} No step can carry the centre from outside the reach of a wall to behind"
            " it, and both methods stay between the walls.",
            lambda shown: all(
                low < shown.y(name).min() and shown.y(name).max() < high for name in METHODS
            ),
        )
        return
    yield Claim(
        f"{apart} A step can carry the centre across a wall without an end of a step at which"
        " the wall is touched from inside. That is tunnelling: both methods leave the box.",
        lambda shown: all(
            shown.y(name).min() < low or shown.y(name).max() > high for name in METHODS
        ),
    )
    yield Claim(
        "The exact answer stays between the walls.",
        lambda shown: low < shown.y(TRUTH).min() and shown.y(TRUTH).max() < high,
    )


def above(shown: Shown, name: str) -> Array:
    """(k,) m that a method is above the exact answer."""
    return shown.y(name) - shown.y(TRUTH)


class Part(NamedTuple):
    """A part of lesson 1: how fast the particle starts, m/s, gravity, m/s2, and what is claimed."""

    speed: float
    gravity: float
    claims: Callable[[Simulation], Iterator[Claim]]


PARTS = {
    "1. without a force": Part(1.0, 0.0, without_force),
    "2. with gravity": Part(1.0, 0.5, with_gravity),
    "3. a step longer than the radius": Part(10.0, 0.0, tunnelling),
}


PARTICLE = Lesson(
    name="particle",
    number="1",
    title="A particle and its step",
    asks="How wrong does a particle get when time goes in steps?",
    text="""
    A particle is a position, a velocity and a radius. A step of <code>dt</code> moves it by
    <code>v dt</code>. The particle bounces between two walls: at a wall its velocity is
    reversed.

    Then a force acts. <b>Explicit Euler</b> (<code>reference:lesson</code>) moves with the old
    velocity and then changes it. <b>Symplectic Euler</b> (<code>reference:exercise</code>)
    changes the velocity first and moves with the new one. In the last part a step may be longer
    than the radius of the particle. Then it may pass through a wall: this is <b>tunnelling</b>.
    """,
    sliders=(
        Slider("part", "Part of the lesson", tuple(PARTS)),
        time_step(1 / 8, STEPS, STEPS.index(4)),
    ),
    names=(*METHODS, TRUTH),
    show=show_particle,
)
