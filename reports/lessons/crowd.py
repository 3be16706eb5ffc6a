"""Lesson 5: the cost of many disks."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Shown,
    Simulation,
    Slider,
    run_of,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.exact import MOST_DISKS, with_oracle

EVERY_PAIR, LISTED = "reference:exercise", "reference:neighbours"
EVENTS = "event_driven:float64"
NAMES = (EVERY_PAIR, LISTED, "pymunk:matched", "box2d:matched", EVENTS)
SIZES = {  # numbers of disks in steps of two, so that the first and the last are 8 times apart
    "200 to 1600": (200, 400, 800, 1600),
    "5 to 40": (5, 10, 20, 40),
}
SUBSTEPS, ROUNDS = 4, 5
SECONDS = 4.0  # that the quarter of a second is replayed for


@cache
def crowd(count: int, fill: float) -> Scenario:
    """`count` disks that cover the part `fill` of a box, with random velocities: each anywhere in a
    field of its own, so that no two overlap and a thousand are placed at once."""
    rng = np.random.default_rng(count)
    r, side = 0.05, int(np.ceil(np.sqrt(count)))
    width = np.sqrt(np.pi / fill) * r * np.sqrt(count) / side  # of a field, m
    half = side * width / 2
    field = np.stack(np.divmod(np.arange(count), side), axis=1)
    scene = lay_out(
        position=(field + 0.5) * width - half + rng.uniform(-1, 1, (count, 2)) * (width / 2 - r),
        velocity=rng.normal(size=(count, 2)),
        radius=np.full(count, r),
        walls=box([-half, -half], [half, half]),
    )
    return Scenario("crowd", "What does a step cost?", "", scene, 0.25, 1 / 60)


def cost(name: str, scenario: Scenario) -> tuple[float, float]:
    """µs a step, the least of some rounds, because a disturbance can only make a measurement
    longer; and the second least over it."""
    steps = scenario.intervals * SUBSTEPS
    least, second, *_ = sorted(run_of(name, scenario, SUBSTEPS).seconds for _ in range(ROUNDS))
    return least / steps * 1e6, second / least


def show_cost(sizes: str, fill: float) -> Shown:
    """Time of a step against the number of disks, and how many pairs there are."""
    numbers = SIZES[sizes]
    scenes = [crowd(size, fill) for size in numbers]
    costs = {name: [cost(name, scene) for scene in scenes] for name in NAMES}
    curves = [
        Curve(name, np.array(numbers), np.array([each for each, _ in found]), dots=True)
        for name, found in costs.items()
    ]
    noise = max(ratio for found in costs.values() for _, ratio in found) - 1
    few, many = numbers[0], numbers[-1]
    replayed = with_oracle([scene for scene in scenes if scene.scene.n <= MOST_DISKS][-1])
    return Shown(
        [LessonChart("Cost of a step", "disks", "µs a step", curves, "xy")],
        Simulation.by(replayed, (LISTED, EVENTS), SUBSTEPS).film,
        [
            *((f"pairs of {size} disks", str(size * (size - 1) // 2)) for size in (few, many)),
            *(
                (
                    f"{curve.name}, from {few} to {many} disks",
                    f"{number(growth_of(curve), 2)} times",
                )
                for curve in curves
            ),
            ("the two shortest runs differ by at most", f"{number(100 * noise, 2)} %"),
            ("replayed", f"{replayed.scene.n} disks"),
        ],
        list(cost_claims(few, many, growth_of(curves[0]), noise)),
        opening={"pace": replayed.duration / SECONDS},
    )


def growth_of(curve: Curve) -> float:
    """The cost of the last point over that of the first."""
    return float(curve.y[-1] / curve.y[0])


def cost_claims(few: int, many: int, grown: float, noise: float) -> Iterator[Claim]:
    """The pairs dominate among many disks, the call among few; grown: how much longer the most
    disks take; noise: by what share the two shortest runs differ.

    The bounds leave room for a machine that does other things, too: among many disks 64 times the
    pairs cost 40 to 60 times as much on one that is idle, as the call itself stays.
    """
    pairs = many * (many - 1) / (few * (few - 1))
    more = (
        f" What exceeds {number(pairs, 2)} times is no work of pairs: the machine did other things,"
        f" too, and the two shortest runs of a time differ by up to {number(100 * noise, 2)} %."
        if grown > pairs
        else ""
    )
    if few < 100:
        yield Claim(
            f"From {few} to {many} disks there are {number(pairs, 2)} times as many pairs. The"
            " cost of testing all of them grows less than a quarter as much: with few disks"
            " the call takes most of the time of a step.",
            lambda shown: growth_of(shown.curve(EVERY_PAIR)) < pairs / 4,
        )
        yield Claim(
            "With so few disks and so few steps in a call a neighbour list saves little:"
            f" {LISTED} takes a third to three times as long.",
            lambda shown: all(1 / 3 < ratio < 3 for ratio in shown.y(LISTED) / shown.y(EVERY_PAIR)),
        )
        return
    yield Claim(
        f"From {few} to {many} disks, {many // few} times as many, there are {number(pairs, 2)}"
        f" times as many pairs. Testing all of them costs at least 20 times as much.{more}",
        lambda shown: (
            growth_of(shown.curve(EVERY_PAIR)) >= 20
            and (growth_of(shown.curve(EVERY_PAIR)) > pairs) == bool(more)
        ),
    )
    yield Claim(
        f"{LISTED} tests near pairs only. Its cost grows less than half as much, and with"
        f" {many} disks it costs less than a fifth.",
        lambda shown: (
            growth_of(shown.curve(LISTED)) < growth_of(shown.curve(EVERY_PAIR)) / 2
            and shown.y(LISTED)[-1] < shown.y(EVERY_PAIR)[-1] / 5
        ),
    )


COST = Lesson(
    name="crowd",
    number="5",
    title="Many disks",
    asks="What does it cost to test every pair?",
    text=f"""
    Among n disks there are <code>n (n − 1) / 2</code> pairs. The exercise tests each of them in
    every step. An engine that first sorts the disks into cells or a tree tests near pairs only.
    <code>reference:neighbours</code> is <code>reference:exercise</code> with a <b>neighbour
    list</b>: both give the same numbers, to the last bit.

    The event-driven engine uses cells, too. It has no steps, so its time is divided by the number
    of steps of the others. A time is the shortest of {ROUNDS} runs on this machine, and it is
    longer on a busy machine.
    """,
    sliders=(
        Slider("sizes", "Number of disks", tuple(SIZES)),
        Slider("fill", "Part of the box they cover", (0.05, 0.2), 1),
    ),
    names=(*NAMES, TRUTH),
    show=show_cost,
)
