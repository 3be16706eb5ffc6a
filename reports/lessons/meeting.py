"""Lesson 4: two disks meet. Every line of the solver is shown with the numbers of this
collision."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from functools import cache, partial

import numpy as np

from crosscheck2d.adapters.box2d import MATCHED
from crosscheck2d.adapters.engines import ENGINES, changed
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
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Scene, State
from crosscheck2d.scenarios.truth.exact import with_oracle

ROUNDING = 1e-12  # of float64, over some dozen operations on numbers of the order of 1
NAMES = ("reference:exercise", "pymunk:matched", "box2d:matched", "event_driven:float64")
INTERVAL = 1 / 64
# m: b2TimeOfImpact stops two disks at an overlap of three slops, 0.005 units each; a unit is
# `length_unit` of the radius of 0.5 m.
STOPPED = 3 * 0.005 * MATCHED["length_unit"] * 0.5


def two(restitution: float, ratio: float, offset: float) -> Scenario:
    """A disk of 1 kg meets one of `ratio` kg, `offset` radii beside its centre line."""
    scene = lay_out(
        position=[[-1.2, 0.5 * offset], [0.4, 0.0]],
        velocity=[[1.5, 0.0], [-0.5, 0.0]],
        radius=0.5,
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


def overlap_found(scene: Scene, dt: float) -> float:
    """m, by which the two overlap at the end of the step that finds them."""
    before, _, _ = collision_of_the_reference(scene, dt)
    x = before.position + before.velocity * dt  # no force acts
    return float(scene.radius.sum() - np.hypot(*(x[0] - x[1])))


def in_numbers(scene: Scene, dt: float) -> dict[str, str]:
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
    return {
        "Detect": f"|x₁ − x₂| = {number(distance)} m < R₁ + R₂ = {number(reach)} m: they overlap by"
        f" δ = {number(1e3 * overlap)} mm, detected at the end of a step, up to dt ="
        f" {number(1e3 * dt)} ms late",
        "Project": f"n = (x₁ − x₂)/|x₁ − x₂| = {pair(n)}; x₁ moves by (1/m₁)/(1/m₁ + 1/m₂) δ ="
        f" {number(1e3 * overlap * share)} mm along n, x₂ by"
        f" {number(1e3 * overlap * (1 - share))} mm against it",
        "Impulse": f"v₁ − v₂ along n is {number(closing)} m/s; J = −(1 + e)(v₁ − v₂)·n / (1/m₁ +"
        f" 1/m₂) = {number(1 + e)} · {number(-closing)} / {number(1 / m1 + 1 / m2)} ="
        f" {number(impulse)} N s; the solver reports {number(reported)} N s",
        "Update": f"v₁' = v₁ + J n/m₁ = {pair(after.velocity[0])} m/s, v₂' = v₂ − J n/m₂ ="
        f" {pair(after.velocity[1])} m/s; separation over approach speed:"
        f" {or_rounding(-separating / closing, 6)}",
        "Momentum": f"m₁v₁ + m₂v₂ = {pair(start)} before and {pair(end)} kg m/s after: off by"
        f" {or_rounding(float(np.abs(end - start).max()), 2)}",
    }


@cache
def box2d_in_units(
    restitution: float, ratio: float, offset: float, k: int, length_unit: float
) -> float:
    """m/s that the first disk is off along x in the end, in Box2D as matched, but with its lengths
    in `length_unit` of the smallest radius."""
    makes = {NAMES[2]: partial(changed, NAMES[2], length_unit=length_unit)}
    played = Simulation.by(two(restitution, ratio, offset), NAMES[2:3], k, makes)
    ends = [each.velocity[-1, 0, 0] for each in played.motions.values()]
    return float(abs(ends[0] - ends[1]))


def or_rounding(value: float, digits: int) -> str:
    """A number of the order of 1, or "0 to rounding"."""
    return number(value, digits) if abs(value) > ROUNDING else "0 to rounding"


def pair(vector: Array) -> str:
    """(x, y) to four digits; what is 0 but for rounding is 0."""
    x, y = (tidy(float(each), ROUNDING, 4) for each in vector)
    return f"({x}, {y})"


def show_meeting(e: float, ratio: float, offset: float, k: int) -> Shown:
    """The collision, drawn and in numbers."""
    scenario = two(e, ratio, offset)
    played = Simulation.by(scenario, NAMES, k)
    return Shown(
        [
            played.over_time(
                "Velocity of the first disk along x", "m/s", lambda each: each.velocity[:, 0, 0]
            ),
            played.errors_over_time(),
        ],
        played.film,
        claims=list(meeting_claims(e, ratio, offset, k)),
        steps=in_numbers(scenario.scene, scenario.dt(k)),
    )


def meeting_claims(e: float, ratio: float, offset: float, k: int) -> Iterator[Claim]:
    """Off the centre line a late normal is wrong; on the centre line every normal is the same."""
    # A velocity below 3 m/s that is rounded a few times: by Box2D in float32, by the others in
    # float64.
    single, double = 3e-7, 4e-15

    exact = Claim(
        "The event-driven engine takes the collision at its own time: its velocity and"
        " position are exact, to rounding.",
        lambda shown: (
            off(shown, "event_driven:float64") <= double
            and shown.y("event_driven:float64", 1).max() <= double
        ),
    )
    if offset == 0.0:
        yield Claim(
            "On the centre line the normal is the same whenever it is read: every engine leaves"
            " with the exact velocity, to rounding (Box2D rounds to single precision).",
            lambda shown: all(
                off(shown, name) <= (single if "box2d" in name else double) for name in NAMES
            ),
        )
        yield exact
        return
    yield Claim(
        "Off the centre line the normal turns while the disks overlap. The engines that read it"
        " at the end of a step leave with a wrong velocity; reference:exercise and"
        " pymunk:matched read it at the same time and leave with the same one.",
        lambda shown: (
            all(off(shown, name) > 1e-5 for name in NAMES[:3])
            and abs(shown.y(NAMES[0])[-1] - shown.y(NAMES[1])[-1]) <= double
        ),
    )
    yield from box2d_claims(e, ratio, offset, k)
    yield exact


def off(shown: Shown, name: str) -> float:
    """m/s that the first disk of an engine is off along x in the end."""
    return float(abs(shown.y(name)[-1] - shown.y(TRUTH)[-1]))


def box2d_claims(e: float, ratio: float, offset: float, k: int) -> Iterator[Claim]:
    """When Box2D reads the normal, and which of its mechanisms decides that."""
    deep = overlap_found(two(e, ratio, offset).scene, INTERVAL / k)
    found, stopped = f"{number(1e3 * deep)} mm", f"{number(1e3 * STOPPED)} mm"
    if deep > STOPPED:
        share = STOPPED / deep
        yield Claim(
            f"This step finds the disks {found} deep in each other. The continuous collision"
            f" detection (CCD) of box2d:matched stops them where they overlap by {stopped}, three"
            " times the slop of Box2D. The normal has turned less by then: its error of velocity is"
            f" {number(share, 2)} times that of pymunk:matched, to a tenth.",
            lambda shown: abs(off(shown, NAMES[2]) / off(shown, NAMES[1]) / share - 1) < 0.1,
        )
        return
    yield Claim(
        "With this setting box2d:matched reads the normal as late as pymunk:matched: their"
        " errors of velocity differ by less than a hundredth.",
        lambda shown: abs(off(shown, NAMES[2]) / off(shown, NAMES[1]) - 1) < 0.01,
    )
    finer = box2d_in_units(e, ratio, offset, k, MATCHED["length_unit"] / 10)
    yield Claim(
        "Its continuous collision detection (CCD) has nothing to do here: it lets disks overlap by"
        f" {stopped}, three times the slop of Box2D, and this step finds them {found} deep. With a"
        f" tenth of that slop the error would be {number(finer)} m/s, at most two thirds.",
        lambda shown: finer < off(shown, NAMES[2]) * 2 / 3,
    )


MEETING = Lesson(
    name="meeting",
    number="4",
    title="Two disks meet",
    asks="What happens in a collision, in numbers?",
    text="""
    At the end of a step two disks overlap. <b>Detect</b> the overlap. <b>Project</b> the disks
    apart along the line of centres until they touch in a point; no velocity changes. Find the
    <b>impulse</b> that makes them separate with e times the speed of approach. <b>Update</b>
    both velocities with this one impulse, so that momentum is conserved.

    The normal is the line of centres when the collision is detected, not when the disks touch.
    """,
    sliders=(
        Slider("e", "Restitution e", (0.0, 0.5, 0.9, 1.0), 2),
        Slider("ratio", "Mass of the second disk", (0.1, 1.0, 10.0), 1, "kg"),
        Slider("offset", "Distance of the centre lines, in radii", (0.0, 0.5, 1.0, 1.5), 2),
        time_step(INTERVAL, (16, 1), 1),
    ),
    names=(*NAMES, TRUTH),
    show=show_meeting,
)
