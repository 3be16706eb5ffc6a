"""Lesson 9.3: the lever arm of friction, which Box2D 2.3 lets end in the middle of an overlap."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil

import numpy as np

from crosscheck2d.reports.lessons.friction.thrown import FALL, ROUGH, ablated_beside, taken, thrown
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Shown,
    Slider,
    swept,
    time_step,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import ABLATED, FLOAT32, distances, lies_on
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Scene

BOX2D = "box2d:shipped"
WHERE = {"the surface of the disk": 0.0, "the middle": 0.5, "the surface of the skin": 1.0}
RADII = np.array([0.05, 0.1, 0.2, 0.5, 1.0])  # m
REPLAYED = 0.2  # m
SKIN = 0.01  # m, of a wall: b2_polygonRadius, two slops of 5 mm
# Of a ratio of an impulse and a change of spin, both of float32 and rounded a few times.
SINGLE = 1e-6


def show_lever(where: str, k: int) -> Shown:
    """The lever arm over the radius, against the radius."""
    share = WHERE[where]
    played = [
        ablated_beside(BOX2D, {"lever": share}, thrown(8.0, 0.0, 0.5, 0.1, float(radius)), k)
        for radius in RADII
    ]
    ratios = swept(RADII, played, lambda each, scene: taken(each, scene).arm[0] / scene.radius[0])
    chart = LessonChart(
        "Lever arm over radius",
        "radius of the disk in m",
        "lever arm / R",
        [*ratios, Curve(TRUTH, RADII, np.ones(len(RADII)))],
        "x",
    )
    return Shown(
        [chart],
        played[RADII.tolist().index(REPLAYED)].film,
        [("replayed: radius", f"{number(REPLAYED)} m"), *distances(chart)],
        list(lever_claims(share, played[-1].runs[0].dt, played[-1].scenario.scene)),
    )


def overlap(dt: float, scene: Scene) -> float:
    """m, of disk and skin at the end of the step that finds them. Less than 15 mm, from which on
    continuous collision would stop the disk earlier (b2TimeOfImpact: total radius less 3 slops)."""
    gap = float(scene.position[0, 1] - scene.radius[0]) - SKIN
    return ceil(gap / (FALL * dt)) * FALL * dt - gap


def lever_claims(share: float, dt: float, scene: Scene) -> Iterator[Claim]:
    """The length by which each lever arm is too short."""
    deep = overlap(dt, scene)
    half = 1 - deep / 2 / RADII
    # Every step rounds a height of up to 2 m; the smallest radius shows it most.
    flown = SINGLE + scene.position[0, 1] / (FALL * dt) * 2 * FLOAT32 / RADII[0]
    yield Claim(
        f"{ROUGH} has the lever arm R at every radius.",
        lambda shown: shown.follows(ROUGH, 1.0, 1e-12),  # float64, at the smallest impulses
    )
    yield Claim(
        f"With this step {BOX2D} finds the contact when the disk overlaps the skin by"
        f" {number(1e3 * deep)} mm. Its lever arm is half of that too short at every radius, by"
        f" {number(1e3 * deep / 2)} mm: {number(100 * (1 - half[0]))} % of the smallest radius,"
        f" {number(100 * (1 - half[-1]))} % of the largest.",
        lambda shown: shown.follows(BOX2D, half, flown),
    )
    yield Claim(
        f"The lever arm of the ablated reference is {number(1e3 * share * deep)} mm too short."
        if share
        else "The ablated reference has the lever arm R, too.",
        lambda shown: shown.follows(ABLATED, 1 - share * deep / RADII, flown),
    )
    yield lies_on(BOX2D, share == 0.5, SINGLE)


LEVER = Lesson(
    name="lever",
    number="9.3",
    title="The lever arm of friction",
    asks="Why does Box2D 2.3 turn a disk less than its friction should?",
    text="""
    A friction impulse at the surface of a disk turns it with the lever arm <code>R</code>. A
    wall of Box2D 2.3 has a <b>skin</b> of 10 mm. A contact is found at the end of a step, when
    disk and skin overlap, and friction acts in the middle of the overlap, within the disk. The
    skin is a length in the units of the scene: it matters most for a small disk.

    The middle of the overlap has another slip than the surface. When a disk rolls, its surface
    does not slip, but this point does, and friction acts on it: see [rolling].
    """,
    sliders=(
        Slider("where", "Friction acts at", tuple(WHERE), 0),
        time_step(1 / 60, (16, 8, 1), 2),
    ),
    names=(BOX2D, ROUGH, ABLATED, TRUTH),
    show=show_lever,
)
