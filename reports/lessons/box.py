"""Lesson 3: a box of small disks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reports.lessons.lesson import (
    Claim,
    Lesson,
    LessonChart,
    Settings,
    Shown,
    Simulation,
    Slider,
    time_step,
)
from reports.page.style import TRUTH, number
from scenarios.families.lesson import falling_box
from scenarios.model import Scenario, Trajectory
from scenarios.truth.exact import with_oracle

ROUNDING = 1e-11  # J, for each disk: some thousand steps, each of which rounds an energy in float64


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
    assert shown.truth is not None
    scene = scenario.scene

    def energy(each: Trajectory) -> np.ndarray:
        moving = (scene.mass * (each.velocity**2).sum(axis=2) / 2).sum(axis=1)
        return np.asarray(moving - each.position @ scene.gravity @ scene.mass)

    facts = [
        (
            f"contact impulses of {run.name}, step by step, in {number(run.trajectory.t[-1])} s",
            str(len(run.trajectory.collisions)),
        )
        for run in shown.runs
        if run.trajectory
    ]
    facts.append(("the exact answer ends at", f"{number(float(shown.truth.t[-1]))} s"))
    return Shown(
        [
            LessonChart("Kinetic and potential energy", "time in s", "J", shown.curves(energy)),
            LessonChart(
                "Farthest disk from the exact answer", "time in s", "m", shown.errors(), log="y"
            ),
        ],
        shown.film,
        facts,
        box_claims(shown, settings),
    )


def box_claims(played: Simulation, settings: Settings) -> list[Claim]:
    """How the energy changes in flight and at collisions, and how near an event-driven engine
    is."""
    assert played.truth is not None
    scene, dt = played.scenario.scene, played.scenario.dt(settings["k"])
    flight = played.truth.t < played.first_collision
    g = float(np.hypot(*scene.gravity))
    gain = float(scene.mass.sum()) * g**2 * dt / 2  # W
    claims = [
        Claim(
            "The event-driven engine takes every collision at its own time. As long as there is an"
            " exact answer it is within 1 nm of it; the engines with steps are at least ten"
            " thousand times farther away.",
            lambda shown: (
                max(shown.y("event_driven:float64", 1)) < 1e-9
                and min(max(shown.y(name, 1)) for name in BOX_NAMES[:3])
                > 1e4 * max(shown.y("event_driven:float64", 1))
            ),
        ),
    ]
    if flight.sum() > 1:  # else something collides before there is a second sample
        claims.insert(
            0,
            Claim(
                "Until the first collision the exact energy is constant. Explicit Euler"
                f" (reference:lesson) gains m g² dt / 2 in a second, {number(gain)} J for all"
                " disks; symplectic Euler (reference:exercise) loses as much. Under a constant"
                " force neither is better. In a motion that repeats, such as an orbit or a"
                " pendulum, the energy of symplectic Euler stays near its first value, and that of"
                " explicit Euler grows (Hairer, Lubich and Wanner, Geometric Numerical Integration,"
                " chapter I.1).",
                lambda shown: all(
                    np.abs(
                        shown.y(name)[: len(flight)][flight]
                        - shown.y(name)[0]
                        - rate * played.truth.t[flight]  # type: ignore[union-attr]
                    ).max()
                    < ROUNDING * scene.n
                    for name, rate in (
                        (TRUTH, 0.0),
                        ("reference:lesson", gain),
                        ("reference:exercise", -gain),
                    )
                ),
            ),
        )
    if settings["e"] == 1.0:
        claims.append(
            Claim(
                "With e = 1 the exact energy stays constant through every collision.",
                lambda shown: np.ptp(shown.y(TRUTH)) < 1e-9 * shown.y(TRUTH)[0],
            )
        )
    else:
        claims.append(
            Claim(
                "The exact energy falls at collisions and never rises.",
                lambda shown: (
                    (np.diff(shown.y(TRUTH)) < 1e-9 * shown.y(TRUTH)[0]).all()
                    and shown.y(TRUTH)[-1] < shown.y(TRUTH)[0]
                ),
            )
        )
    return claims


BOX = Lesson(
    name="box",
    number="3",
    title="A box of small disks",
    asks="Where does the energy go?",
    text=(
        (
            "Small disks start from random positions with random velocities and fall. In a"
            " collision of a disk with a wall, or with another disk, the relative velocity along"
            " the normal becomes <code>v' = −e v</code>, which leaves <code>e²</code> of the"
            " energy of the relative motion along the normal. Nothing else may take energy. Between"
            " two collisions the sum of <code>m v²/2 + m g y</code> must stay constant."
        ),
        (
            "The exact answer ends where float64 can no longer follow the motion, or where a disk"
            " comes to rest; the engines go on. [horizon] explains it."
        ),
    ),
    sliders=(
        Slider("e", "Restitution e", (0.5, 0.8, 0.95, 1.0), 2),
        Slider("n", "Disks", (1, 5, 30), 1),
        # From 8.3 ms on a step is longer than the radius of the fastest disk, which then tunnels.
        time_step(1 / 60, (32, 16, 8, 4), 3),
    ),
    names=(*BOX_NAMES, TRUTH),
    show=show_box,
)
