"""Lessons 1 to 3: a particle and its step, force and thrust, a box of small disks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from adapters.engines import ENGINES
from reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Settings,
    Shown,
    Simulation,
    Slider,
    run_of,
    time_step,
)
from reports.page.style import TRUTH, number
from scenarios.families.exercise import ship_thrust
from scenarios.families.lesson import falling_box, ping_pong
from scenarios.model import Array, Scenario, Thrust, Trajectory
from scenarios.truth.closed_forms import world_thrusts
from scenarios.truth.exact import with_oracle

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


def show_particle(settings: Settings) -> Shown:
    """Height over time, and the error against the step."""
    speed, gravity, claims = PARTS[settings["part"]]
    scenario = bouncing(speed, gravity)
    played = Simulation.by(scenario, METHODS, settings["k"])
    steps = np.array([scenario.dt(k) for k in STEPS])
    errors = []
    for name in METHODS:
        runs = [Simulation(scenario, [run_of(name, scenario, k)], played.truth) for k in STEPS]
        errors.append(
            Curve(name, 1e3 * steps, [np.max(run.errors()[0].y) for run in runs], dots=True)
        )
    dt, radius = scenario.dt(settings["k"]), float(scenario.scene.radius[0])
    height = played.curves(lambda each: each.position[:, 0, 1])
    guides = [("x", 1e3 * dt, "here")]
    if speed * scenario.dt(STEPS[-1]) > radius:
        guides.append(("x", 1e3 * radius / speed, "v dt = R"))
    return Shown(
        [
            LessonChart("Height", "time in s", "y in m", height),
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
            (f"{curve.name}, largest error", f"{number(np.max(curve.y))} m")
            for curve in played.errors()
        ],
        claims(played),
    )


def way_of(played: Simulation) -> float:
    """v dt of the start, m."""
    return float(np.hypot(*played.scenario.scene.velocity[0])) * played.runs[0].dt


def without_force(played: Simulation) -> list[Claim]:
    """Exact flight, and a bounce that is found up to one step late."""
    assert played.truth is not None
    way = way_of(played)
    bounces = np.searchsorted(played.truth.collisions.t, played.truth.t, side="right")
    mm = number(1e3 * way)
    return [
        Claim(
            "Until the first bounce both methods are exact: without a force, v dt is the whole"
            " motion of a step.",
            lambda shown: all(shown.y(name, 1)[bounces == 0].max() < ROUNDING for name in METHODS),
        ),
        Claim(
            "A bounce is found at the end of a step, up to dt late. reference:exercise then moves"
            f" the particle back to the wall and loses up to v dt = {mm} mm at each bounce."
            " reference:lesson does not move it back and loses up to 2 v dt.",
            lambda shown: all(
                (shown.y(name, 1) <= each * way * bounces + ROUNDING).all()
                for name, each in (("reference:exercise", 1), ("reference:lesson", 2))
            ),
        ),
        Claim(
            "A smaller step has a smaller error, with both methods.",
            lambda shown: all((np.diff(shown.y(name, 2)) > 0).all() for name in METHODS),
        ),
    ]


def with_gravity(played: Simulation) -> list[Claim]:
    """Two orders of the same two lines."""
    assert played.truth is not None
    gain = float(np.hypot(*played.scenario.scene.gravity)) * played.runs[0].dt  # m/s in a step
    flight = played.truth.t < first_collision(played)
    offset = gain * played.truth.t[flight] / 2
    late = 1e3 * offset[-1]
    return [
        Claim(
            "Until the first bounce explicit Euler (reference:lesson) is g dt t / 2 above the exact"
            f" parabola, {number(late)} mm in the end, and symplectic Euler (reference:exercise) as"
            " far below it.",
            lambda shown: all(
                np.abs(above(shown, name)[flight] - sign * offset).max() < ROUNDING
                for name, sign in (("reference:lesson", 1), ("reference:exercise", -1))
            ),
        ),
        Claim(
            "Explicit Euler rises higher than the exact answer ever does, symplectic Euler less"
            " high.",
            lambda shown: (
                shown.y("reference:lesson").max()
                > shown.y(TRUTH).max()
                > shown.y("reference:exercise").max()
            ),
        ),
        Claim(
            f"From the largest step to the smallest, {STEPS[0] // STEPS[-1]} times smaller, both"
            " errors fall to less than a tenth. Not every halving of the step helps, because how"
            " late a bounce is found depends on where in a step it happens.",
            lambda shown: (
                all(10 * shown.y(name, 2)[0] < shown.y(name, 2)[-1] for name in METHODS)
                and any((np.diff(shown.y(name, 2)) < 0).any() for name in METHODS)
            ),
        ),
    ]


def tunnelling(played: Simulation) -> list[Claim]:
    """A wall acts on what overlaps it at the end of a step."""
    way, radius = way_of(played), float(played.scenario.scene.radius[0])
    apart = f"A step moves the particle by v dt = {number(way)} m; its radius is R = {radius} m."
    low, high = 1 - radius, 11 + radius  # m, where the walls are
    if way <= radius:
        return [
            Claim(
                f"{apart} No step can carry the centre from outside the reach of a wall to behind"
                " it, and both methods stay between the walls.",
                lambda shown: all(
                    low < shown.y(name).min() and shown.y(name).max() < high for name in METHODS
                ),
            )
        ]
    return [
        Claim(
            f"{apart} A step can carry the centre across a wall without an end of a step at which"
            " the wall is touched from inside. That is tunnelling: both methods leave the box.",
            lambda shown: all(
                shown.y(name).min() < low or shown.y(name).max() > high for name in METHODS
            ),
        ),
        Claim(
            "The exact answer stays between the walls.",
            lambda shown: low < shown.y(TRUTH).min() and shown.y(TRUTH).max() < high,
        ),
    ]


def first_collision(played: Simulation) -> float:
    """s, up to when nothing collides, in the exact answer and in any engine."""
    assert played.truth is not None
    motions = [played.truth, *(run.trajectory for run in played.runs if run.trajectory)]
    return min(float(each.collisions.t[0]) for each in motions) - played.runs[0].dt


def above(shown: Shown, name: str) -> Array:
    """(k,) m that a method is above the exact answer."""
    return shown.y(name) - shown.y(TRUTH)


class Part(NamedTuple):
    """A part of lesson 1: how fast the particle starts, m/s, gravity, m/s2, and what is claimed."""

    speed: float
    gravity: float
    claims: Callable[[Simulation], list[Claim]]


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
    text=(
        (
            "A particle is a position, a velocity and a radius. A step of <code>dt</code> moves it"
            " by <code>v dt</code>. Between two walls it plays ping-pong: at a wall its velocity is"
            " turned round."
        ),
        (
            "Then a force acts. <b>Explicit Euler</b> (<code>reference:lesson</code>) moves with"
            " the old velocity and then changes it. <b>Symplectic Euler</b>"
            " (<code>reference:exercise</code>) changes the velocity first and moves with the new"
            " one. At last the particle is so fast that a step may be longer than its radius, and"
            " it may pass through a wall: this is <b>tunnelling</b>."
        ),
    ),
    sliders=(
        Slider("part", "Part of the lesson", tuple(PARTS)),
        time_step(1 / 8, STEPS, STEPS.index(4)),
    ),
    names=(*METHODS, TRUTH),
    show=show_particle,
)


START, STOP = 0.5, 2.5  # s, of the thrust


def thrust_ship(acceleration: float) -> Scenario:
    """The exercise's ship, accelerated along x for 2 s and coasting for 2 s."""
    base = ship_thrust()
    scene = base.scene
    thrusts = [Thrust(0, START, STOP, np.array([acceleration * float(scene.mass[0]), 0.0]))]
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

    seconds = min(exact.t[-1], STOP) - START
    laws = {
        run.name: 1e3 * (ENGINES[run.name].alpha - 0.5) * acceleration * dt * seconds
        for run in shown.runs
        if run.status == "ok"
    }
    return Shown(
        [
            LessonChart("Ahead of the exact answer", "time in s", "mm", shown.curves(ahead)),
            LessonChart(
                "Velocity", "time in s", "m/s", shown.curves(lambda each: each.velocity[:, 0, 0])
            ),
        ],
        shown.film,
        [
            (f"{name}, α = {number(ENGINES[name].alpha)}", f"(α − ½) a dt T = {number(law)} mm")
            for name, law in laws.items()
        ],
        thrust_claims(laws),
    )


def thrust_claims(laws: Mapping[str, float]) -> list[Claim]:
    """What the order of a step does to the place, and does not do to the velocity; laws: engine ->
    mm that it ends ahead."""
    # Box2D's float32 rounds a place of up to 16 m by 1 um in each of up to 1024 steps, and seldom
    # up as often as down.
    place, speed = 0.2, 3e-5  # mm, m/s

    def coasts(shown: Shown, name: str) -> bool:
        after = shown.y(name)[shown.x(name) >= STOP]
        return bool(np.ptp(after) <= place)

    return [
        Claim(
            "After a thrust of T seconds every engine that plays to the end is (α − ½) a dt T"
            " ahead of the exact answer, or behind it where this is negative; the table below has"
            " the numbers. Box2D, which computes in single precision, is within"
            f" {place} mm of it, all others to rounding.",
            lambda shown: all(
                abs(shown.y(name)[-1] - law) <= (place if "box2d" in name else 1e-9)
                for name, law in laws.items()
            ),
        ),
        Claim(
            "The offset grows while the force acts, from 0.5 s to 2.5 s. Then the ship coasts and"
            " the offset stays.",
            lambda shown: all(
                abs(shown.y(name)[shown.x(name) <= START]).max() <= place
                and coasts(shown, name)
                and grows(shown, name, law)
                for name, law in laws.items()
                if law
            ),
        ),
        Claim(
            f"All engines agree on the velocity, within {number(speed)} m/s.",
            lambda shown: all(shown.gap(name, chart=1) <= speed for name in laws),
        ),
        Claim(
            "The engines with α = 1 end ahead of the exact answer, those with α = 0 as far behind"
            " it.",
            lambda shown: all(
                abs(shown.y(name)[-1] + (1 - 2 * ENGINES[name].alpha) * abs(law)) <= place
                and np.sign(shown.y(name)[-1]) == np.sign(law)
                for name, law in laws.items()
                if ENGINES[name].alpha in (0.0, 1.0)
            ),
        ),
    ]


def grows(shown: Shown, name: str, law: float) -> bool:
    """Whether the offset is half of what the law says in the middle of the thrust."""
    middle = shown.y(name)[np.searchsorted(shown.x(name), (START + STOP) / 2)]
    return bool(abs(middle - law / 2) <= 0.2 + 1e-3 * abs(law))


THRUST = Lesson(
    name="thrust",
    number="2",
    title="Force and thrust",
    asks="Does a force carry every engine equally far?",
    text=(
        (
            "A force changes the velocity by <code>F/m dt</code> in a step. How far it carries the"
            " ship depends on the order of a step. Write the step as <code>x' = x + v dt + α a"
            " dt²</code>: velocity first is <code>α = 1</code>, position first is <code>α ="
            " 0</code>, the exact parabola is <code>α = ½</code>. [order] does this with gravity."
        ),
    ),
    sliders=(
        time_step(1 / 16, (16, 8, 4, 2, 1), 3),
        Slider("a", "Acceleration a", (0.25, 1.0, 4.0), 0, "m/s²"),
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
    assert shown.truth is not None
    scene = scenario.scene

    def energy(each: Trajectory) -> np.ndarray:
        moving = (scene.mass * (each.velocity**2).sum(axis=2) / 2).sum(axis=1)
        return np.asarray(moving - each.position @ scene.gravity @ scene.mass)

    facts = [
        ("collisions of " + run.name, str(len(run.trajectory.collisions)))
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
    """What the energy does in flight and at collisions, and how near an event-driven engine is."""
    assert played.truth is not None
    scene, dt = played.scenario.scene, played.scenario.dt(settings["k"])
    flight = played.truth.t < first_collision(played)
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
                "Until the first collision the exact energy is level. Explicit Euler"
                f" (reference:lesson) gains m g² dt / 2 in a second, {number(gain)} J for all"
                " disks; symplectic Euler (reference:exercise) loses as much.",
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
                "With e = 1 the exact energy stays level through every collision.",
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
            "Small disks start from random places with random velocities and fall. At a wall the"
            " normal velocity becomes <code>v' = −e v</code>: a collision leaves <code>e²</code> of"
            " the energy of this part of the motion. Nothing else may take energy. Between two"
            " collisions the sum of <code>m v²/2 + m g y</code> must be level."
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
