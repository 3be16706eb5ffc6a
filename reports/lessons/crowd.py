"""Lesson 5, the cost of many disks, and lesson 7, why trajectories stop being comparable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from math import log

import numpy as np

from adapters.engines import ENGINES
from adapters.play import play_once
from reports.compare.laws import deviation
from reports.compare.view import cut
from reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Settings,
    Shown,
    Simulation,
    Slider,
    time_step,
)
from reports.page.style import TRUTH, number
from scenarios.families.exercise import asteroid_field
from scenarios.families.placing import box, lay_out
from scenarios.model import Scenario, Trajectory
from scenarios.truth.exact import MOST_DISKS, with_oracle
from scenarios.truth.horizon import DIVERGED

EVERY_PAIR, LISTED = "reference:exercise", "reference:neighbours"
COST_NAMES = (
    EVERY_PAIR,
    LISTED,
    "pymunk:matched",
    "box2d:matched",
    "event_driven:float64",
)
SIZES = {  # numbers of disks in steps of two, so that the first and the last are 8 times apart
    "200 to 1600": (200, 400, 800, 1600),
    "5 to 40": (5, 10, 20, 40),
}
SUBSTEPS, ROUNDS = 4, 5
SECONDS = 4.0  # that the quarter of a second is replayed for
ROUNDED = "event_driven against itself, start moved by one rounding"
HORIZON_NAMES = ("reference:exercise", "pymunk:matched", "box2d:matched", "event_driven:float64")


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
        mass=np.ones(count),
        walls=box([-half, -half], [half, half]),
        restitution=1.0,
    )
    return Scenario("crowd", "What does a step cost?", "", scene, 0.25, 1 / 60)


def cost(name: str, scenario: Scenario) -> tuple[float, float]:
    """µs a step, the least of some rounds, because a disturbance can only make a measurement
    longer; and the second least over it."""
    steps = scenario.intervals * SUBSTEPS
    least, second, *_ = sorted(
        play_once(ENGINES[name].make, name, scenario, scenario.dt(SUBSTEPS)).seconds
        for _ in range(ROUNDS)
    )
    return least / steps * 1e6, second / least


def show_cost(settings: Settings) -> Shown:
    """Time of a step against the number of disks, and how many pairs there are."""
    sizes = SIZES[settings["sizes"]]
    scenes = [crowd(size, settings["fill"]) for size in sizes]
    costs = {name: [cost(name, scene) for scene in scenes] for name in COST_NAMES}
    curves = [
        Curve(name, sizes, [each for each, _ in found], dots=True) for name, found in costs.items()
    ]
    noise = max(ratio for found in costs.values() for _, ratio in found) - 1
    last = sizes[-1]
    facts = [(f"pairs of {size} disks", str(size * (size - 1) // 2)) for size in (sizes[0], last)]
    facts += [
        (f"{curve.name}, from {sizes[0]} to {last} disks", f"{number(growth_of(curve), 2)} times")
        for curve in curves
    ]
    replayed = with_oracle(max((s for s in scenes if s.scene.n <= MOST_DISKS), key=size_of))
    facts.append(("the two shortest runs differ by at most", f"{number(100 * noise, 2)} %"))
    facts.append(("replayed", f"{size_of(replayed)} disks"))
    film = Simulation.by(replayed, (LISTED, "event_driven:float64"), SUBSTEPS).film
    return Shown(
        [LessonChart("Cost of a step", "disks", "µs a step", curves, "xy")],
        film,
        facts,
        cost_claims(sizes, growth_of(curves[0]), noise),
        opening={"pace": replayed.duration / SECONDS},
    )


def size_of(scenario: Scenario) -> int:
    """How many disks it has."""
    return scenario.scene.n


def growth_of(curve: Curve) -> float:
    """The cost of the last point over that of the first."""
    y = np.asarray(curve.y, float)
    return float(y[-1] / y[0])


def cost_claims(sizes: tuple[int, ...], grown: float, noise: float) -> list[Claim]:
    """The pairs dominate among many disks, the call among few; grown: how much longer the most
    disks take; noise: by what share the two shortest runs differ.

    The bounds leave room for a machine that does other things, too: among many disks 64 times the
    pairs cost 40 to 60 times as much on one that is idle, as the call itself stays.
    """
    few, many = sizes[0], sizes[-1]
    pairs = many * (many - 1) / (few * (few - 1))
    more = (
        f" What exceeds {number(pairs, 2)} times is no work of pairs: the machine did other things,"
        f" too, and the two shortest runs of a time differ by up to {number(100 * noise, 2)} %."
        if grown > pairs
        else ""
    )
    if few < 100:
        return [
            Claim(
                f"From {few} to {many} disks there are {number(pairs, 2)} times as many pairs. The"
                " cost of testing all of them grows less than a quarter as much: with few disks"
                " the call takes most of the time of a step.",
                lambda shown: growth_of(shown.curve(EVERY_PAIR)) < pairs / 4,
            ),
            Claim(
                "With so few disks and so few steps in a call a neighbour list saves little:"
                f" {LISTED} takes a third to three times as long.",
                lambda shown: all(
                    1 / 3 < ratio < 3 for ratio in shown.y(LISTED) / shown.y(EVERY_PAIR)
                ),
            ),
        ]
    return [
        Claim(
            f"From {few} to {many} disks, {many // few} times as many, there are"
            f" {number(pairs, 2)} times as many pairs. Testing all of them costs at least 20 times"
            f" as much.{more}",
            lambda shown: (
                growth_of(shown.curve(EVERY_PAIR)) >= 20
                and (growth_of(shown.curve(EVERY_PAIR)) > pairs) == bool(more)
            ),
        ),
        Claim(
            f"{LISTED} tests near pairs only. Its cost grows less than half as much, and with"
            f" {many} disks it costs less than a fifth.",
            lambda shown: (
                growth_of(shown.curve(LISTED)) < growth_of(shown.curve(EVERY_PAIR)) / 2
                and shown.y(LISTED)[-1] < shown.y(EVERY_PAIR)[-1] / 5
            ),
        ),
    ]


COST = Lesson(
    name="crowd",
    number="5",
    title="Many disks",
    asks="What does it cost to test every pair?",
    text=(
        (
            "Among n disks there are <code>n (n − 1) / 2</code> pairs. The exercise tests each of"
            " them in every step. An engine that first sorts the disks into cells or a tree tests"
            " near pairs only. <code>reference:neighbours</code> is <code>reference:exercise</code>"
            " with a <b>neighbour list</b>: both give the same numbers, to the last bit."
        ),
        (
            "The event-driven engine uses cells, too. It has no steps, so its time is divided by"
            f" the number of steps of the others. A time is the shortest of {ROUNDS} runs on this"
            " machine, and it is longer on a busy machine."
        ),
    ),
    sliders=(
        Slider("sizes", "Number of disks", tuple(SIZES)),
        Slider("fill", "Part of the box they cover", (0.05, 0.2), 1),
    ),
    names=(*COST_NAMES, TRUTH),
    show=show_cost,
)


@cache
def field(seed: int, restitution: float) -> Scenario:
    """The exercise's asteroids for 20 s."""
    scene = asteroid_field(seed, 20, restitution)
    return with_oracle(Scenario("field", "How long is it comparable?", "", scene, 20.0, 1 / 32))


def show_horizon(settings: Settings) -> Shown:
    """The error as long as there is an exact answer, and the energy."""
    scenario = field(settings["seed"], settings["e"])
    shown = Simulation.by(scenario, HORIZON_NAMES, settings["k"])
    scene = scenario.scene

    def energy(each: Trajectory) -> np.ndarray:
        share: np.ndarray = (scene.mass * (each.velocity**2).sum(axis=2) / 2).sum(axis=1) / (
            (scene.mass * (scene.velocity**2).sum(axis=1)).sum() / 2
        )
        return share

    assert shown.truth is not None
    errors, end = shown.errors(), float(shown.truth.t[-1])
    moved = moved_by_a_rounding(settings["seed"], settings["e"], settings["k"])
    motions = {run.name: run.trajectory for run in shown.runs if run.trajectory}
    motions["the exact answer"] = shown.truth
    kept = [float(energy(motions[name])[-1]) for name in HORIZON_NAMES[:3]]
    return Shown(
        [
            LessonChart(
                "Farthest disk from the exact answer",
                "time in s",
                "m",
                [*errors, moved],
                "y",
                guides=[("x", end, "horizon")],
            ),
            LessonChart(
                "Kinetic energy over that at the start",
                "time in s",
                "ratio",
                shown.curves(energy),
            ),
        ],
        shown.film,
        [
            ("the exact answer ends at", f"{number(end)} s"),
            *(
                (f"collisions of {name} until then", str(int((each.collisions.t <= end).sum())))
                for name, each in motions.items()
            ),
        ],
        horizon_claims(shown, settings["e"], kept, moved),
    )


def moved_by_a_rounding(seed: int, restitution: float, k: int) -> Curve:
    """m, the farthest disk of an event-driven run from that of another whose start is moved by one
    rounding in every coordinate; as long as both play."""
    scenario = replace(field(seed, restitution), truth=None)
    name, scene = HORIZON_NAMES[-1], scenario.scene
    start = replace(scene, position=np.nextafter(scene.position, np.inf))
    one, other = (
        play_once(ENGINES[name].make, name, each, scenario.dt(k)).trajectory
        for each in (scenario, replace(scenario, scene=start))
    )
    assert one is not None
    assert other is not None
    both = min(len(one), len(other))
    apart = deviation(cut(one, both), cut(other, both), scene).max(axis=1)
    return Curve(ROUNDED, one.t[:both], apart)


def rounding_claim(played: Simulation, factor: float, moved: Curve) -> Claim:
    """How far two right runs are apart at the horizon and in the end, and when they would be a
    radius apart."""
    assert played.truth is not None
    end, radius = float(played.truth.t[-1]), float(played.scenario.scene.radius.min())
    t, apart = np.asarray(moved.x, float), np.asarray(moved.y, float)
    here, last = float(apart[t <= end][-1]), float(apart[-1])
    more = log(1 / DIVERGED) / log(factor)
    beyond = t[apart > radius]
    later = (
        f"At {number(float(beyond[0]))} s they are a radius apart."
        if len(beyond)
        else f"At {number(float(t[-1]))} s, where the first of them ends, they are"
        f" {number(1e9 * last)} nm apart."
    )
    return Claim(
        "Two event-driven runs whose starts differ by one rounding are"
        f" {number(1e9 * here, 2)} nm apart at the horizon. {later} At this growth a billionth of a"
        f" radius needs some {number(more, 2)} more collisions to become a radius.",
        lambda shown: (
            shown.y(ROUNDED)[shown.x(ROUNDED) <= end][-1] == here < 1e-9
            and abs(shown.y(ROUNDED)[-1] - last) <= 1e-9 * last
            and (shown.y(ROUNDED).max() > radius) == bool(len(beyond))
        ),
    )


def horizon_claims(
    played: Simulation, restitution: float, kept: Sequence[float], moved: Curve
) -> list[Claim]:
    """Errors grow exponentially up to the size of the box; the energy stays comparable: `kept` is
    the share that each engine with steps has left."""
    assert played.truth is not None
    end = float(played.truth.t[-1])
    steps = HORIZON_NAMES[:3]
    factor = growth(played)
    claims = [
        Claim(
            f"The exact answer ends at {number(end)} s. Until then the event-driven engine, whose"
            " only error is rounding, is less than 1 nm off.",
            lambda shown: (
                shown.x("event_driven:float64")[-1] == end
                and shown.y("event_driven:float64").max() < 1e-9
            ),
        ),
        Claim(
            "Its error grows exponentially: on average a collision multiplies it by"
            f" {number(factor, 2)}.",
            lambda shown: (
                abs(growth(played, shown.curve("event_driven:float64")) / factor - 1) < 1e-9
                and factor > 1.2
            ),
        ),
        rounding_claim(played, factor, moved),
        Claim(
            "The engines with steps detect collisions late. Half way to the horizon they are at"
            " least a million times farther off than the event-driven engine, and later at least a"
            " decimetre.",
            lambda shown: all(
                half_way(shown, name) > 1e6 * half_way(shown, HORIZON_NAMES[-1])
                and shown.y(name).max() > 0.1
                for name in steps
            ),
        ),
    ]
    if restitution == 1.0:
        claims.append(
            Claim(
                "The energy stays comparable: with e = 1 the engines with steps keep it for 20 s,"
                " long past the horizon, within a millionth (Box2D computes in single precision).",
                lambda shown: all(
                    shown.x(name, 1)[-1] == 20 > 1.3 * end
                    and np.abs(shown.y(name, 1) - 1).max() < 1e-6
                    for name in steps
                ),
            )
        )
    else:
        claims.append(
            Claim(
                "The energy stays comparable: after 20 s, long past the horizon, the engines with"
                f" steps have {number(min(kept), 2)} to {number(max(kept), 2)} of it left. How much"
                " depends on their collisions.",
                lambda shown: (
                    1.3 * end < 20
                    and all(shown.x(name, 1)[-1] == 20 for name in steps)
                    and [shown.y(name, 1)[-1] for name in steps] == kept
                    and max(kept) < 1.25 * min(kept)
                ),
            )
        )
    return claims


def half_way(shown: Shown, name: str) -> float:
    """m, the error of an engine half way to the horizon."""
    error = shown.y(name)
    return float(error[len(error) // 2])


def growth(played: Simulation, error: Curve | None = None) -> float:
    """By what factor a collision makes the error of the event-driven engine grow, fitted over all
    collisions of the exact answer; nan if there is nothing to fit."""
    assert played.truth is not None
    error = error or next(each for each in played.errors() if each.name == HORIZON_NAMES[-1])
    t, y = np.asarray(error.x, float), np.asarray(error.y, float)
    used = y > 1e-15
    if used.sum() < 10:
        return float("nan")
    collisions = np.searchsorted(played.truth.collisions.t, t[used])
    return float(np.exp(np.polyfit(collisions, np.log(y[used]), 1)[0]))


HORIZON = Lesson(
    name="horizon",
    number="7",
    title="Why trajectories stop being comparable",
    asks="How long do two right solvers agree?",
    text=(
        (
            "Two disks that meet slightly further to the side separate in another direction. So a"
            " collision multiplies an error, also one that is as small as the rounding of a number."
            " The <b>horizon</b> is the time at which a rounding of the start has grown to a"
            " billionth of a radius. There the exact answer ends and this harness stops judging"
            " positions: from then on a distance from it could come from rounding alone. How soon"
            " two right solvers disagree by a radius depends on the collisions that follow."
        ),
        (
            "What stays comparable for longer is what depends little on which disk is where: the"
            " energy, the number of collisions. A disk that leaves the field enters it again at"
            " the opposite edge, as in the exercise."
        ),
    ),
    sliders=(
        Slider("seed", "Random field, seed", (0, 1, 3), 0),
        Slider("e", "Restitution e", (0.9, 1.0), 0),
        time_step(1 / 32, (32, 16, 4), 1),
    ),
    names=(*HORIZON_NAMES, ROUNDED, TRUTH),
    show=show_horizon,
)
