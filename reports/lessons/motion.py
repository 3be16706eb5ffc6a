"""Lessons 1 to 3: a particle and its step, force and thrust, a box of small disks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adapters.engines import ENGINES
from reports.lessons.lesson import (
    Curve,
    Lesson,
    LessonChart,
    Settings,
    Shown,
    Simulation,
    Slider,
    run_of,
)
from reports.page.style import TRUTH, number
from scenarios.families.exercise import ship_thrust
from scenarios.families.lesson import falling_box, ping_pong
from scenarios.model import Scenario, Thrust, Trajectory
from scenarios.truth.closed_forms import world_thrusts
from scenarios.truth.exact import with_oracle

LADDER = (1, 2, 4, 8, 16, 32)


def bouncing(gravity: float) -> Scenario:
    """The lesson's particle between y = 1 and y = 11, now also falling."""
    base = ping_pong()
    scene = replace(base.scene, gravity=np.array([0.0, -gravity]))
    return with_oracle(replace(base, scene=scene, duration=20.0, sample_interval=1 / 8, truth=None))


def show_particle(settings: Settings) -> Shown:
    """Height over time, and the error against the step."""
    names = ("reference:lesson", "reference:exercise")
    scenario = bouncing(settings["gravity"])
    shown = Simulation.by(scenario, names, settings["k"])
    steps = np.array([scenario.dt(k) for k in LADDER])
    errors = []
    for name in names:
        runs = [Simulation(scenario, [run_of(name, scenario, k)], shown.truth) for k in LADDER]
        errors.append(Curve(name, steps, [np.max(run.errors()[0].y) for run in runs], dots=True))
    now = [
        (f"{curve.name}, largest error", f"{number(np.max(curve.y))} m") for curve in shown.errors()
    ]
    return Shown(
        [
            LessonChart(
                "Height", "time in s", "y in m", shown.curves(lambda each: each.position[:, 0, 1])
            ),
            LessonChart(
                "Largest error in 20 s, against the step", "step in s", "m", errors, log="xy"
            ),
        ],
        shown.film,
        [("step", f"{number(shown.scenario.dt(settings['k']))} s"), *now],
    )


PARTICLE = Lesson(
    name="particle",
    number="1",
    title="A particle and its step",
    asks="How wrong does a particle get when time goes in steps?",
    text=(
        (
            "A body is a position, a velocity, a radius. In a step of <code>dt</code> it moves by"
            " <code>v dt</code>: between two walls it plays ping-pong, and without a force every"
            " method is exact until it meets a wall. A wall is noticed a step late at the most, so"
            " the error is about <code>v dt</code> a bounce."
        ),
        (
            "Now let it fall. <b>Explicit Euler</b> (<code>reference:lesson</code>) moves with the"
            " old velocity and then changes it; <b>symplectic Euler</b>"
            " (<code>reference:exercise</code>) changes the velocity first and moves with the new"
            " one. The exact answer flies a parabola between two bounces. Halve the step and see"
            " what the error does."
        ),
    ),
    sliders=(
        Slider("k", "Steps in 1/8 s", LADDER, 2),
        Slider("gravity", "Gravity", (0.0, 0.5, 2.0), 1, "m/s²"),
    ),
    names=("reference:lesson", "reference:exercise", TRUTH),
    show=show_particle,
)


def thrust_ship(acceleration: float) -> Scenario:
    """The exercise's ship, accelerated along x for 2 s and coasting for 2 s."""
    base = ship_thrust()
    scene = base.scene
    thrusts = [Thrust(0, 0.5, 2.5, np.array([acceleration * float(scene.mass[0]), 0.0]))]
    return replace(
        base,
        duration=4.0,
        sample_interval=1 / 16,
        thrusts=thrusts,
        truth=lambda t: world_thrusts(scene, thrusts, t),
    )


THRUST_NAMES = (
    "reference:exercise",
    "reference:lesson",
    "pymunk:matched",
    "box2d:matched",
    "box2d_v3:matched",
    "event_driven:float64",
)


def show_thrust(settings: Settings) -> Shown:
    """Who is ahead of the parabola and who is behind, and the formula for it."""
    acceleration = settings["a"]
    scenario = thrust_ship(acceleration)
    shown = Simulation.by(scenario, THRUST_NAMES, settings["k"])
    assert shown.truth is not None
    exact, dt = shown.truth, shown.scenario.dt(settings["k"])

    def ahead(each: Trajectory) -> np.ndarray:
        return 1e3 * (each.position[:, 0, 0] - exact.position[: len(each), 0, 0])

    acted = np.clip(exact.t - 0.5, 0, 2.0)
    facts = []
    for run in shown.runs:
        row = ENGINES[run.name]
        law = 1e3 * (row.alpha - 0.5) * acceleration * dt * acted[-1]
        got = ahead(run.trajectory)[-1] if run.trajectory else np.nan
        facts.append(
            (
                f"{run.name}, α = {number(row.alpha)}",
                f"{number(got)} mm, (α − ½) a dt T = {number(law)} mm",
            )
        )
    return Shown(
        [
            LessonChart("Ahead of the exact answer", "time in s", "mm", shown.curves(ahead)),
            LessonChart(
                "Velocity", "time in s", "m/s", shown.curves(lambda each: each.velocity[:, 0, 0])
            ),
        ],
        shown.film,
        facts,
    )


THRUST = Lesson(
    name="thrust",
    number="2",
    title="Force and thrust",
    asks="Does a force carry every engine equally far?",
    text=(
        (
            "A force changes the velocity by <code>F/m dt</code> a step, and everybody agrees on"
            " the velocity. Where the ship is depends on the order: with <code>x' = x + v dt + α a"
            " dt²</code> a thrust of T seconds ends <code>(α − ½) a T dt</code> away from the"
            " parabola. Velocity first is <code>α = 1</code>, position first <code>α = 0</code>,"
            " four substeps <code>α = 0.625</code>."
        ),
        (
            "The ship is accelerated from 0.5 s to 2.5 s and then coasts: the offset grows while"
            " the force is on, and stays."
        ),
    ),
    sliders=(
        Slider("k", "Steps in 1/16 s", (1, 2, 4, 8, 16), 1),
        Slider("a", "Acceleration", (0.25, 1.0, 4.0), 0, "m/s²"),
    ),
    names=(*THRUST_NAMES, TRUTH),
    show=show_thrust,
)


def small_box(restitution: float, count: int) -> Scenario:
    """The first `count` disks of the lesson's falling box."""
    base = falling_box(0)
    arrays = ("position", "velocity", "radius", "mass", "angle", "angular_velocity", "inertia")
    cut = {name: getattr(base.scene, name)[:count] for name in arrays}
    scene = replace(base.scene, restitution=restitution, **cut)
    return with_oracle(replace(base, scene=scene, truth=None, duration=3.0))


BOX_NAMES = ("reference:lesson", "reference:exercise", "pymunk:matched", "event_driven:float64")


def show_box(settings: Settings) -> Shown:
    """Energy over time, and how far from the exact answer as long as there is one."""
    scenario = small_box(settings["e"], settings["n"])
    shown = Simulation.by(scenario, BOX_NAMES, settings["k"])
    scene = scenario.scene

    def energy(each: Trajectory) -> np.ndarray:
        moving = (scene.mass * (each.velocity**2).sum(axis=2) / 2).sum(axis=1)
        energy: np.ndarray = moving + (scene.mass * each.position[:, :, 1]).sum(axis=1) * 9.81
        return energy

    facts = [
        ("collisions of " + run.name, str(len(run.trajectory.collisions)))
        for run in shown.runs
        if run.trajectory
    ]
    charts = [LessonChart("Energy of motion and height", "time in s", "J", shown.curves(energy))]
    if shown.truth is not None:
        charts.append(
            LessonChart(
                "Farthest disk from the exact answer", "time in s", "m", shown.errors(), log="y"
            )
        )
        facts.append(("the exact answer ends at", f"{number(float(shown.truth.t[-1]))} s"))
    return Shown(charts, shown.film, facts)


BOX = Lesson(
    name="box",
    number="3",
    title="A box of small disks",
    asks="Where does the energy go?",
    text=(
        (
            "Small disks from random places, with random velocities, under gravity. At a wall the"
            " normal velocity becomes <code>v' = −c_r v</code>: each collision keeps"
            " <code>c_r²</code> of that part of the energy, and nothing else may take any. Between"
            " two collisions the sum of <code>m v²/2 + m g y</code> must be level."
        ),
        (
            "With <code>c_r = 1</code> the exact line is flat: what an engine gains or loses is its"
            " own. The exact answer ends where the motion is no longer knowable in float64, or"
            " where a disk comes to rest."
        ),
    ),
    sliders=(
        Slider("e", "Restitution c_r", (0.5, 0.8, 0.95, 1.0), 2),
        Slider("n", "Disks", (1, 5, 30), 1),
        Slider("k", "Steps in 1/60 s", (1, 4, 16), 1),
    ),
    names=(*BOX_NAMES, TRUTH),
    show=show_box,
)
