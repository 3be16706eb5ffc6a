"""Lessons 5 and 7: what many disks cost, and why their trajectories stop being comparable."""

from __future__ import annotations

from functools import cache

import numpy as np

from adapters.engines import ENGINES
from adapters.play import play_once
from adapters.reference import every_pair
from reports.lessons.lesson import Curve, Lesson, LessonChart, Settings, Shown, Simulation, Slider
from reports.page.style import TRUTH, number
from scenarios.families.exercise import asteroid_field
from scenarios.families.placing import box, lay_out, scatter
from scenarios.model import Scenario, Trajectory
from scenarios.truth.exact import MOST_DISKS, with_oracle

EVERY_PAIR = "reference:every_pair"
COST_NAMES = (
    EVERY_PAIR,
    "reference:exercise",
    "pymunk:matched",
    "box2d:matched",
    "event_driven:float64",
)
SIZES = (5, 10, 20, 50, 100, 200, 400)
SUBSTEPS, ROUNDS = 4, 5
SECONDS = 4.0  # that the quarter of a second is replayed for
HORIZON_NAMES = ("reference:exercise", "pymunk:matched", "box2d:matched", "event_driven:float64")


@cache
def crowd(count: int, fill: float) -> Scenario:
    """`count` disks that cover the part `fill` of a box, with random velocities."""
    rng = np.random.default_rng(count)
    r = np.full(count, 0.05)
    half = np.sqrt(np.pi * (r @ r) / fill) / 2
    scene = lay_out(
        position=scatter(rng, [-half + r[0]] * 2, [half - r[0]] * 2, r),
        velocity=rng.normal(size=(count, 2)),
        radius=r,
        mass=np.ones(count),
        walls=box([-half, -half], [half, half]),
        restitution=1.0,
    )
    return Scenario("crowd", "What does a step cost?", "", scene, 0.25, 1 / 60)


def cost(name: str, scenario: Scenario) -> float:
    """µs a step, the least of some rounds: what disturbs a measurement only ever makes it
    longer."""
    steps = scenario.samples * SUBSTEPS
    make = every_pair if name == EVERY_PAIR else ENGINES[name].make
    return (
        min(play_once(make, name, scenario, scenario.dt(SUBSTEPS)).seconds for _ in range(ROUNDS))
        / steps
        * 1e6
    )


def show_cost(settings: Settings) -> Shown:
    """Time of a step against the number of disks, and how many pairs there are."""
    sizes = [size for size in SIZES if size <= settings["most"]]
    scenes = [crowd(size, settings["fill"]) for size in sizes]
    curves = [
        Curve(name, sizes, [cost(name, scene) for scene in scenes], dots=True)
        for name in COST_NAMES
    ]
    last = sizes[-1]
    facts = [(f"pairs of {last} disks", number(last * (last - 1) / 2, 6))]
    for curve in curves:
        x, y = np.log(sizes[-3:]), np.log(np.asarray(curve.y)[-3:])
        facts.append(
            (
                f"{curve.name}: cost grows as number to the power",
                number(float(np.polyfit(x, y, 1)[0]), 2),
            )
        )
    largest = scenes[-1] if last > MOST_DISKS else with_oracle(scenes[-1])
    film = Simulation.by(largest, ("reference:exercise", "event_driven:float64"), SUBSTEPS).film
    pace = {"pace": largest.duration / SECONDS}
    return Shown(
        [LessonChart("Cost of a step", "disks", "µs a step", curves, "xy")],
        film,
        facts,
        opening=pace,
    )


COST = Lesson(
    name="crowd",
    number="5",
    title="Many disks",
    asks="What does it cost to look at every pair?",
    text=(
        (
            "Among n disks there are <code>n (n − 1) / 2</code> pairs, and the exercise asks every"
            " one of them in every step: ten times the disks, a hundred times the work. Whoever"
            " sorts the disks into cells or a tree first asks only neighbours: the cost grows about"
            " as the number does. <code>reference:exercise</code> does so where there are many, and"
            " gives the same bits as with every pair. For few disks a step is mostly the call"
            " itself."
        ),
        (
            "The event-driven engine has no steps to take: it uses cells, too, and its time goes"
            " with the number of collisions. Times are the least of five runs on this machine and"
            " as noisy as it is busy."
        ),
    ),
    sliders=(
        Slider("most", "Disks, up to", (50, 100, 200, 400), 1),
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
    """The distance from the exact answer as long as there is one, and the energy, which stays
    comparable."""
    scenario = field(settings["seed"], settings["e"])
    shown = Simulation.by(scenario, HORIZON_NAMES, settings["k"])
    scene = scenario.scene

    def energy(each: Trajectory) -> np.ndarray:
        share: np.ndarray = (scene.mass * (each.velocity**2).sum(axis=2) / 2).sum(axis=1) / (
            (scene.mass * (scene.velocity**2).sum(axis=1)).sum() / 2
        )
        return share

    charts = [
        LessonChart("Energy of motion, of what it was", "time in s", "", shown.curves(energy))
    ]
    facts = [
        ("collisions of " + run.name, str(len(run.trajectory.collisions)))
        for run in shown.runs
        if run.trajectory
    ]
    if shown.truth is not None:
        errors = shown.errors()
        charts.insert(
            0, LessonChart("Farthest disk from the exact answer", "time in s", "m", errors, "y")
        )
        facts += [
            ("the exact answer ends at its horizon", f"{number(float(shown.truth.t[-1]))} s"),
            *growth(shown, errors),
        ]
    return Shown(charts, shown.film, facts)


def growth(shown: Simulation, errors: list[Curve]) -> list[tuple[str, str]]:
    """By what factor a collision makes a distance grow, fitted to the engine whose errors begin at
    rounding."""
    assert shown.truth is not None
    found = next((curve for curve in errors if curve.name == "event_driven:float64"), None)
    if found is None:
        return []
    t, y = np.asarray(found.x), np.asarray(found.y)
    used = (y > 1e-15) & (y < 1e-2)
    collisions = np.searchsorted(shown.truth.collisions.t, t[used])
    if used.sum() < 10 or np.ptp(collisions) < 5:
        return []
    slope = float(np.polyfit(collisions, np.log(y[used]), 1)[0])
    return [
        (
            "a collision makes a distance grow, on average, by a factor of",
            number(float(np.exp(slope))),
        )
    ]


HORIZON = Lesson(
    name="horizon",
    number="7",
    title="Why trajectories stop being comparable",
    asks="How long do two right solvers agree?",
    text=(
        (
            "Two disks that meet a hair further to the side fly off in another direction: every"
            " collision multiplies a small distance by some factor, so that it grows exponentially"
            " and reaches the size of a disk, however small it was. A rounding of 10⁻¹⁶ lasts some"
            " ten seconds here; a step that finds its collisions late begins a dozen decades"
            " higher."
        ),
        (
            "After this horizon no trajectory is right or wrong by its places. What stays"
            " comparable are momentum, energy, the number of collisions, and whatever else does not"
            " care which disk is where."
        ),
    ),
    sliders=(
        Slider("seed", "Seed of the field", (0, 1, 2), 0),
        Slider("e", "Restitution", (0.9, 1.0), 0),
        Slider("k", "Steps in 1/32 s", (4, 16, 32), 1),
    ),
    names=(*HORIZON_NAMES, TRUTH),
    show=show_horizon,
)
