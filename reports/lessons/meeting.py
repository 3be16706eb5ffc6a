"""Lesson 4: two disks meet, with the numbers of this very collision filled into every line of the
solver."""

from __future__ import annotations

from contextlib import closing

import numpy as np

from adapters.engines import ENGINES
from reports.lessons.lesson import Lesson, LessonChart, Settings, Shown, Simulation, Slider
from reports.page.style import TRUTH, number
from scenarios.families.placing import lay_out
from scenarios.model import Array, Scenario, Scene, State
from scenarios.truth.exact import with_oracle

NAMES = ("reference:exercise", "pymunk:matched", "box2d:matched", "event_driven:float64")
INTERVAL = 1 / 64


def two(restitution: float, ratio: float, offset: float) -> Scenario:
    """A disk of 1 kg meets one of `ratio` kg, `offset` radii beside its centre line."""
    scene = lay_out(
        position=[[-1.2, 0.5 * offset], [0.4, 0.0]],
        velocity=[[1.5, 0.0], [-0.5, 0.0]],
        radius=[0.5, 0.5],
        mass=[1.0, ratio],
        restitution=restitution,
    )
    return with_oracle(
        Scenario(
            name="two_disks",
            asks="What comes out of one collision?",
            source="the exercise, task 2",
            scene=scene,
            duration=1.0,
            sample_interval=INTERVAL,
        )
    )


def collision_of_the_reference(scene: Scene, dt: float) -> tuple[State, State, float]:
    """The reference's state before and after the step with its collision, and the impulse it
    reports, N s."""
    with closing(ENGINES["reference:exercise"].make()) as engine:
        engine.load(scene, dt)
        before = engine.read()
        while not engine.collisions():
            before = engine.read()
            engine.step()
        return before, engine.read(), engine.collisions()[0].impulse


def in_numbers(scene: Scene, dt: float) -> list[tuple[str, str]]:
    """Detection, projection, impulse and momentum, each with the numbers of this collision."""
    before, after, reported = collision_of_the_reference(scene, dt)
    (m1, m2), e = scene.mass, scene.restitution
    x = before.position + before.velocity * dt  # no force acts, so symplectic Euler moves by v dt
    gap = x[0] - x[1]
    distance, reach = float(np.hypot(*gap)), float(scene.radius.sum())
    n, overlap = gap / distance, reach - distance
    share = (1 / m1) / (1 / m1 + 1 / m2)
    closing = float((before.velocity[0] - before.velocity[1]) @ n)
    impulse = -(1 + e) * closing / (1 / m1 + 1 / m2)
    separating = float((after.velocity[0] - after.velocity[1]) @ n)
    start, end = scene.mass @ before.velocity, scene.mass @ after.velocity
    return [
        (
            "Detect",
            (
                f"|x₁ − x₂| = {number(distance)} m < r₁ + r₂ = {number(reach)} m: they overlap by δ"
                f" = {number(1e3 * overlap)} mm, found up to a step of {number(1e3 * dt)} ms late"
            ),
        ),
        (
            "Project",
            (
                f"n = (x₁ − x₂)/|x₁ − x₂| = {pair(n)}; x₁ moves by w₁/(w₁ + w₂) δ = "
                f"{number(1e3 * overlap * share)} mm along n, "
                f"x₂ by {number(1e3 * overlap * (1 - share))} mm against it"
            ),
        ),
        (
            "Impulse",
            (
                f"v₁ − v₂ along n is {number(closing)} m/s; J = −(1 + e)(v₁ − v₂)·n / (1/m₁ + 1/m₂)"
                f" = {number(1 + e)} · {number(-closing)} / {number(1 / m1 + 1 / m2)} ="
                f" {number(impulse)} N s; the solver reports {number(reported)} N s"
            ),
        ),
        (
            "Update",
            (
                f"v₁' = v₁ + J n/m₁ = {pair(after.velocity[0])} m/s, "
                f"v₂' = v₂ − J n/m₂ = {pair(after.velocity[1])} m/s; "
                f"separation over approach speed: {number(-separating / closing, 6)}"
            ),
        ),
        (
            "Momentum",
            (
                f"m₁v₁ + m₂v₂ = {pair(start)} before and {pair(end)} kg m/s after: off by "
                f"{number(float(np.abs(end - start).max()), 2)}"
            ),
        ),
    ]


def pair(vector: Array) -> str:
    """(x, y) to four digits."""
    return f"({number(float(vector[0]), 4)}, {number(float(vector[1]), 4)})"


def show_meeting(settings: Settings) -> Shown:
    """The collision, drawn and in numbers."""
    scenario = two(settings["e"], settings["ratio"], settings["offset"])
    shown = Simulation.by(scenario, NAMES, settings["k"])
    charts = [
        LessonChart(
            "Velocity of the first disk along x",
            "time in s",
            "m/s",
            shown.curves(lambda each: each.velocity[:, 0, 0]),
        ),
    ]
    if shown.truth is not None:
        charts.append(
            LessonChart(
                "Farthest disk from the exact answer", "time in s", "m", shown.errors(), log="y"
            )
        )
    return Shown(
        charts, shown.film, steps=in_numbers(scenario.scene, shown.scenario.dt(settings["k"]))
    )


MEETING = Lesson(
    name="meeting",
    number="4",
    title="Two disks meet",
    asks="What are the four parts of a collision, in numbers?",
    text=(
        (
            "A step finds two disks overlapping. <b>Detect</b> it, <b>project</b> them apart along"
            " the line of centres, so that they touch in a point and no velocity changes, find the"
            " <b>impulse</b> that lets them part with e times the speed they closed with, and"
            " <b>update</b> both velocities with the same impulse, so that momentum stays."
        ),
        (
            "The line of centres is read when the collision is found, not when it happened. Off the"
            " centre line, a large step therefore takes the wrong normal, and this is most of what"
            " the engines differ by."
        ),
    ),
    sliders=(
        Slider("e", "Restitution e", (0.0, 0.5, 0.9, 1.0), 2),
        Slider("ratio", "Second mass", (0.1, 1.0, 10.0), 1, "kg"),
        Slider("offset", "Beside the centre, in radii", (0.0, 0.5, 1.0, 1.5), 2),
        Slider("k", "Steps in 1/64 s", (1, 16), 0),
    ),
    names=(*NAMES, TRUTH),
    show=show_meeting,
)
