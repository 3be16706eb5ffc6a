"""Lesson 3: a box of small disks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Lesson,
    Shown,
    Simulation,
    Slider,
    tidy,
    time_step,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.lesson import falling_box
from crosscheck2d.scenarios.model import Array, Scenario, Scene, State, Trajectory
from crosscheck2d.scenarios.truth.exact import with_oracle

SECONDS = 3.0
EULER = {"reference:lesson": 1, "reference:exercise": -1}  # the sign of its gain in flight
STEPPED, EVENTS = (*EULER, "pymunk:matched"), "event_driven:float64"
NAMES = (*STEPPED, EVENTS)
ROUNDING = 1e-11  # J, for each disk: some thousand steps, each of which rounds an energy in float64


def small_box(restitution: float, count: int) -> Scenario:
    """The first `count` disks of the lesson's falling box."""
    base = falling_box(0)
    arrays = ("position", "velocity", "radius", "mass", "angle", "angular_velocity", "inertia")
    cut = {name: getattr(base.scene, name)[:count] for name in arrays}
    scene = replace(base.scene, restitution=restitution, **cut)
    return with_oracle(replace(base, scene=scene, truth=None, duration=SECONDS))


def show_box(e: float, n: int, k: int) -> Shown:
    """Energy over time, and how far from the exact answer as long as there is one."""
    played = Simulation.by(small_box(e, n), NAMES, k)
    of_disks = partial(energy, played.scenario.scene)
    end, kept = float(played.truth.t[-1]), of_disks(played.truth)
    exact = float(kept[0] - kept[-1])
    budgets = {name: budget(name, e, n, k, end) for name in EULER}
    facts = [
        ("the exact answer ends at", f"{number(end)} s"),
        ("exact energy taken by collisions until then", f"{tidy(exact, 1e-9)} J"),
        *((f"{name}, energy until then", each.in_words) for name, each in budgets.items()),
        *(
            (
                f"collisions of {name} in {number(each.t[-1])} s; a contact with an impulse in"
                " every step counts once",
                str(len(each.collisions)),
            )
            for name, each in played.motions.items()
            if name != TRUTH
        ),
    ]
    claims = [*flight_claims(played), *collision_claims(played.scenario, budgets, end, exact)]
    return Shown(
        [
            played.over_time("Kinetic and potential energy", "J", of_disks),
            played.errors_over_time(),
        ],
        played.film,
        facts,
        claims,
    )


def energy(scene: Scene, each: Trajectory | State) -> Array:
    """J, kinetic and potential energy of all disks, at each sample or now."""
    moving: Array = (scene.mass * (each.velocity**2).sum(axis=-1) / 2).sum(axis=-1)
    return moving - each.position @ scene.gravity @ scene.mass


class EnergyChange(NamedTuple):
    """J that an engine's disks gain by flight, by collisions and by being moved apart, and the
    impulses in its steps."""

    flight: float
    collisions: float
    moved: float
    impulses: list[ContactImpulse]

    @property
    def in_words(self) -> str:
        """With signs."""
        flight, collisions, moved = (
            tidy(part, 1e-9) for part in (self.flight, self.collisions, self.moved)
        )
        return f"flight {flight} J, collisions {collisions} J, moved apart {moved} J"

    @property
    def whole(self) -> float:
        """J, all three."""
        return self.flight + self.collisions + self.moved


@cache
def budget(name: str, restitution: float, count: int, k: int, until: float) -> EnergyChange:
    """What changes the energy of a reference solver until then, s.

    A step of flight changes it by m g² dt²/2 each, up for explicit Euler, down for symplectic
    Euler. An impulse J takes (1 − e)/(1 + e) J² / (2 µ), µ the reduced mass. The rest is by moving.
    """
    scenario = small_box(restitution, count)
    scene, dt = scenario.scene, scenario.dt(k)
    steps = round(until / dt)

    with closing(ENGINES[name].make()) as engine:
        engine.load(scene, dt)
        before = engine.read()
        engine.step(steps)
        after, impulses = engine.read(), engine.collisions()
    gained = float(energy(scene, after) - energy(scene, before))
    flight = EULER[name] * float(scene.mass.sum() * (scene.gravity**2).sum()) * dt**2 / 2 * steps
    inverse = 1 / np.append(scene.mass, np.inf)  # the last is that of every wall
    taken = sum(
        each.impulse**2 * (inverse[each.i] + inverse[max(each.j, -1)]) / 2 for each in impulses
    )
    collisions = -(1 - restitution) / (1 + restitution) * float(taken)
    return EnergyChange(flight, collisions, gained - flight - collisions, impulses)


def flight_claims(played: Simulation) -> Iterator[Claim]:
    """How the energy changes in flight, and how near an event-driven engine is."""
    scene, dt = played.scenario.scene, played.runs[0].dt
    flight = played.truth.t < played.first_collision
    g = float(np.hypot(*scene.gravity))
    gain = float(scene.mass.sum()) * g**2 * dt / 2  # W

    def gains(shown: Shown, name: str, rate: float) -> bool:
        gained = shown.y(name)[: len(flight)][flight] - shown.y(name)[0]
        return bool(np.abs(gained - rate * played.truth.t[flight]).max() < ROUNDING * scene.n)

    if flight.sum() > 1:  # else something collides before there is a second sample
        yield Claim(
            f"Until the first collision, at {number(played.first_collision + dt)} s, the exact"
            " energy is constant. Explicit Euler (reference:lesson) gains m g² dt / 2 in a second,"
            f" {number(gain)} J for all disks; symplectic Euler (reference:exercise) loses as much."
            " Under a constant force neither is better. In a motion that repeats, such as an orbit"
            " or a pendulum, the energy of symplectic Euler stays near its first value, and that of"
            " explicit Euler grows (Hairer, Lubich and Wanner, Geometric Numerical Integration,"
            " chapter I.1).",
            lambda shown: (
                gains(shown, TRUTH, 0.0)
                and all(gains(shown, name, sign * gain) for name, sign in EULER.items())
            ),
        )
    yield Claim(
        "The event-driven engine takes every collision at its own time. As long as there is an"
        " exact answer it is within 1 nm of it; the engines with steps are at least ten thousand"
        " times farther away.",
        lambda shown: (
            shown.y(EVENTS, 1).max() < 1e-9
            and min(shown.y(name, 1).max() for name in STEPPED) > 1e4 * shown.y(EVENTS, 1).max()
        ),
    )


def collision_claims(
    scenario: Scenario, budgets: dict[str, EnergyChange], end: float, exact: float
) -> Iterator[Claim]:
    """What becomes of the energy after the first collision; end: s, of the exact answer; exact: J
    that its collisions take."""
    lesson, exercise = (budgets[name] for name in EULER)
    elastic = scenario.scene.restitution == 1.0

    def adds_up(shown: Shown) -> bool:
        return all(
            abs(shown.y(name)[shown.x(name) <= end][-1] - shown.y(name)[0] - each.whole) < 1e-6
            for name, each in budgets.items()
        )

    if elastic:
        yield Claim(
            "With e = 1 the exact energy stays constant through every collision.",
            lambda shown: np.ptp(shown.y(TRUTH)) < 1e-9 * shown.y(TRUTH)[0],
        )
    else:
        yield Claim(
            "The exact energy falls at collisions and never rises.",
            lambda shown: (
                (np.diff(shown.y(TRUTH)) < 1e-9 * shown.y(TRUTH)[0]).all()
                and shown.y(TRUTH)[-1] < shown.y(TRUTH)[0]
            ),
        )
    yield Claim(
        "What the two methods gain and lose in flight goes on after the first collision:"
        f" {number(lesson.flight)} J each until {number(end)} s. reference:exercise moves disks"
        f" out of the walls and apart, and lifts them by it: {number(exercise.moved)} J."
        " reference:lesson leaves them in the walls.",
        lambda shown: (
            adds_up(shown)
            and lesson.flight == -exercise.flight > 0
            and exercise.moved > max(lesson.moved, 0.0)
        ),
    )
    if elastic:
        yield Claim(
            "With e = 1 a collision takes nothing: the energy of reference:lesson rises by what it"
            " gains in flight, and that of reference:exercise falls by its loss less what moving"
            " gives back.",
            lambda shown: (
                adds_up(shown)
                and abs(lesson.whole - lesson.flight) < 0.01 * lesson.flight
                and exercise.whole < 0
            ),
        )
    else:
        yield Claim(
            f"Collisions take {number(-lesson.collisions)} J of reference:lesson and"
            f" {number(-exercise.collisions)} J of reference:exercise until then, and the exact"
            f" ones {number(exact)} J. Once one is detected late, the disks meet elsewhere and at"
            " other speeds. Which curve is lowest follows from the sum of the three parts.",
            lambda shown: (
                adds_up(shown)
                and max(lesson.collisions, exercise.collisions) < 0
                and abs(shown.y(TRUTH)[0] - shown.y(TRUTH)[-1] - exact) < 1e-6
            ),
        )
    if scenario.scene.restitution == 0.5 and end == SECONDS:
        yield resting_claim(scenario, budgets)


def resting_claim(scenario: Scenario, budgets: dict[str, EnergyChange]) -> Claim:
    """Why the two count so many and so few collisions once the disks lie on the floor."""
    steps = scenario.intervals * scenario.substeps[0]

    def last(name: str) -> float:
        late = sum(each.step >= steps - 60 for each in budgets[name].impulses)
        return float(late / 60 / scenario.scene.n)

    return Claim(
        "In the end the disks lie on the floor. reference:exercise puts each back in every step and"
        " gives it an impulse, which is one contact. reference:lesson leaves it in the floor and"
        " turns it round in every third step only, which counts as a new collision each time.",
        lambda shown: (
            all(abs(last(name) - rate) < 0.01 for name, rate in zip(EULER, (1 / 3, 1.0)))
            and len(budgets["reference:lesson"].impulses)
            < len(budgets["reference:exercise"].impulses)
            and np.ptp(shown.y(TRUTH)[-3:]) < 1e-3
        ),
    )


BOX = Lesson(
    name="box",
    number="3",
    title="A box of small disks",
    asks="Where does the energy go?",
    text="""
    Small disks start from random positions with random velocities and fall. In a collision of a
    disk with a wall, or with another disk, the relative velocity along the normal
    <code>u</code> becomes <code>u' = −e u</code>, which leaves <code>e²</code> of the energy of
    this part of the motion. Nothing else may take energy. Between two collisions the sum of
    <code>m v²/2 + m g y</code> must stay constant.

    The exact answer ends where float64 can no longer follow the motion, or where a disk comes
    to rest; the engines go on. [horizon] explains it.
    """,
    sliders=(
        Slider("e", "Restitution e", (0.5, 0.8, 0.95, 1.0), 2),
        Slider("n", "Disks", (1, 5, 30), 1),
        # From 8.3 ms on a step is longer than the radius of the fastest disk, which then tunnels.
        time_step(1 / 60, (32, 16, 8, 4), 3),
    ),
    names=(*NAMES, TRUTH),
    show=show_box,
)
