"""Lesson 6, how engines differ: one page a mechanism, enabled in the reference until the curves
coincide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from adapters.engines import changed
from adapters.mechanisms.ablated import (
    BOX2D,
    EXERCISE,
    MIXING,
    POSITION_FIRST,
    PYMUNK,
    AblatedReference,
)
from adapters.play import play, play_once
from adapters.run import Run
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
from scenarios.families.lesson import free_fall
from scenarios.families.placing import lay_out
from scenarios.families.walls import bouncing_ball_e1
from scenarios.model import Array, Scenario, Scene, Trajectory
from scenarios.no_truth import answered
from scenarios.truth.exact import with_oracle

ABLATED, PLAIN, NO_CCD = "reference:ablated", "reference:exercise", "box2d:matched+no_ccd"
PRECISION = {53: np.float64, 24: np.float32}
ORDERS = {"as the exercise": EXERCISE, "aimed before gravity": PYMUNK, "aimed after gravity": BOX2D}
SHOWN = 0.5  # the e whose collision is replayed in the page on mixing
SECONDS = 3.0  # that the tenth of a second of the page on the cap is replayed for
Read = Callable[[Trajectory], Array]


def asked(scene: Scene, duration: float) -> Scenario:
    """A scene of this lesson."""
    return Scenario("mechanism", "Where does the engine differ?", "", scene, duration, 1 / 60)


def runs_of(
    names: Sequence[str], on: AblatedReference, scenario: Scenario, substeps: int
) -> list[Run]:
    """The engines, the reference as it is, and the reference with what is enabled."""
    runs = [run_of(name, scenario, substeps) for name in (*names, PLAIN)]
    return [*runs, play(on, ABLATED, scenario, scenario.dt(substeps))]


def over_time(runs: Sequence[Run], read: Read) -> list[Curve]:
    """`read` of every run that was played."""
    return [
        Curve(run.name, run.trajectory.t, read(run.trajectory))
        for run in runs
        if run.trajectory is not None
    ]


def distance(curves: Sequence[Curve], name: str, unit: str) -> tuple[str, str]:
    """How far the ablated reference's curve is from an engine's, at the most."""
    found = {curve.name: np.asarray(curve.y, float) for curve in curves}
    deviation = np.nanmax(np.abs(found[ABLATED] - found[name]))
    return (
        f"largest distance of the ablated reference from {name}",
        f"{number(float(deviation), 2)} {unit}".strip(),
    )


def setting_rows(runs: Sequence[Run], setting: str) -> list[tuple[str, str]]:
    """What the engines themselves say of a setting."""
    return [
        (f"{run.name}, {setting}", number(run.settings[setting][1]))
        for run in runs
        if setting in run.settings
    ]


def filmed(scenario: Scenario, runs: Sequence[Run]) -> Any:
    """For the engine of the page, which shows the runs at the step of the scenario, and the exact
    answer if any."""
    seen = replace(scenario, substeps=(round(scenario.sample_interval / runs[0].dt),))
    seen, truth = answered(seen if seen.truth else with_oracle(seen))
    return Simulation(seen, runs, truth).film


def pairs(closing: Array, restitution: float) -> Scene:
    """One head-on pair of equal disks for each closing speed (k,) m/s, above each other, to meet
    after 0.2 s."""
    k, r = len(closing), 0.1
    gap = r + closing * 0.1
    x = np.stack(
        [
            np.column_stack([-gap, 3 * r * np.arange(k)]),
            np.column_stack([gap, 3 * r * np.arange(k)]),
        ],
        axis=1,
    )
    v = np.stack(
        [np.column_stack([closing / 2, np.zeros(k)]), np.column_stack([-closing / 2, np.zeros(k)])],
        axis=1,
    )
    return lay_out(
        position=x.reshape(-1, 2),
        velocity=v.reshape(-1, 2),
        radius=np.full(2 * k, r),
        mass=np.ones(2 * k),
        restitution=restitution,
    )


def separation(closing: Array) -> Read:
    """(k,) separation over approach speed of `pairs`, at the end."""
    return lambda each: (each.velocity[-1, 1::2, 0] - each.velocity[-1, 0::2, 0]) / closing


def over(x: Array, runs: Sequence[Run], read: Read) -> list[Curve]:
    """`read` of every run against `x`."""
    return [
        Curve(run.name, x, read(run.trajectory), dots=True)
        for run in runs
        if run.trajectory is not None
    ]


def show_threshold(settings: Settings) -> Shown:
    """e of a collision against its closing speed."""
    closing = np.array(
        [0.1, 0.2, 0.3, 0.4, 0.55, 0.7, 0.85, 0.95, 1.05, 1.2, 1.5, 1.9, 2.1, 3.0, 5.0]
    )
    scenario = asked(pairs(closing, settings["e"]), 0.5)
    runs = runs_of(
        ["box2d:shipped"], AblatedReference(threshold=settings["threshold"]), scenario, 4
    )
    curves = over(closing, runs, separation(closing))
    facts = [
        *setting_rows(runs, "restitution threshold in m/s"),
        distance(curves, "box2d:shipped", ""),
    ]
    curves.append(Curve(TRUTH, closing, np.full(len(closing), settings["e"])))
    chart = LessonChart(
        "Separation over approach speed", "closing speed in m/s", "e of the collision", curves, "x"
    )
    return Shown([chart], filmed(scenario, runs), facts)


def show_mixing(settings: Settings) -> Shown:
    """e of a collision against the e that is stated on both disks."""
    stated, closing = np.linspace(0.0, 1.0, 11), np.array([2.0])
    names = ("pymunk:shipped", PLAIN, ABLATED)
    found: dict[str, list[float]] = {}
    for e in stated:
        scenario = asked(pairs(closing, float(e)), 0.5)
        runs = runs_of(names[:1], AblatedReference(mixing=settings["rule"]), scenario, 4)
        for run in runs:
            if run.trajectory is not None:
                found.setdefault(run.name, []).append(float(separation(closing)(run.trajectory)[0]))
        if e == SHOWN:
            film = filmed(scenario, runs)
    curves = [
        *(Curve(name, stated, found[name], dots=True) for name in names),
        Curve(TRUTH, stated, stated),
    ]
    facts = [
        ("replayed: e on each of the two disks", number(SHOWN)),
        distance(curves, "pymunk:shipped", ""),
    ]
    curves.append(Curve(TRUTH, stated, stated))
    chart = LessonChart(
        "Restitution of a pair", "e on each of the two disks", "e of the collision", curves
    )
    return Shown([chart], film, facts)


def falling(names: Sequence[str], on: AblatedReference, substeps: int) -> Shown:
    """mm above the parabola of a thrown disk."""
    scenario = free_fall()
    assert scenario.truth is not None
    exact = scenario.truth(scenario.times).position
    runs = runs_of(names, on, scenario, substeps)
    curves = over_time(runs, lambda each: 1e3 * (each.position - exact)[:, 0, 1])
    facts = [*setting_rows(runs[:1], "substeps"), *(distance(curves, name, "mm") for name in names)]
    curves.append(Curve(TRUTH, scenario.times, np.zeros(scenario.samples + 1)))
    return Shown(
        [LessonChart("Above the parabola", "time in s", "mm", curves)],
        filmed(scenario, runs),
        facts,
    )


def show_order(settings: Settings) -> Shown:
    """Velocity then position, or position then velocity."""
    order = {"velocity first": EXERCISE, "position first": POSITION_FIRST}[settings["order"]]
    return falling(["pymunk:matched"], AblatedReference(order=order), settings["k"])


def show_substeps(settings: Settings) -> Shown:
    """A step cut into smaller ones."""
    return falling(
        ["box2d_v3:matched"], AblatedReference(substeps=settings["substeps"]), settings["k"]
    )


def show_gravity(settings: Settings) -> Shown:
    """Height of a ball that should bounce for ever."""
    scenario = bouncing_ball_e1()
    names = ["box2d:matched", "pymunk:matched"]
    runs = runs_of(
        names, AblatedReference(order=ORDERS[settings["order"]]), scenario, settings["k"]
    )
    curves = over_time(runs, lambda each: each.position[:, 0, 1])
    facts = [distance(curves, name, "m") for name in names]
    assert scenario.truth is not None
    curves.append(Curve(TRUTH, scenario.times, scenario.truth(scenario.times).position[:, 0, 1]))
    return Shown(
        [LessonChart("Height of the centre", "time in s", "m", curves)],
        filmed(scenario, runs),
        facts,
    )


def show_position_correction(settings: Settings) -> Shown:
    """How an overlap that is there at the start is undone."""
    x, still = [[0.0, 0.0], [0.8, 0.0]], np.zeros((2, 2))
    scenario = asked(
        lay_out(position=x, velocity=still, radius=[0.5] * 2, mass=[np.inf, 2.0], restitution=0.0),
        0.4,
    )
    on = AblatedReference(
        BOX2D, correction_most=0.2, correction_share=settings["share"], slop=settings["slop"] / 1e3
    )
    without = partial(changed, "box2d:matched", continuous=False, bullet=False, length_unit=1.0)
    runs = [play_once(without, NO_CCD, scenario, scenario.dt(1)), *runs_of([], on, scenario, 1)]
    curves = over_time(runs, lambda each: np.maximum(1e3 * (1.0 - each.position[:, 1, 0]), 1e-3))
    facts = [*setting_rows(runs, "linear slop in m"), distance(curves, NO_CCD, "mm")]
    chart = LessonChart("Overlap", "time in s", "mm, 0 drawn as 0.001", curves, "y")
    return Shown([chart], filmed(scenario, runs), facts)


def show_digits(settings: Settings) -> Shown:
    """How far a disk far out is from x + v t."""
    start, v = np.array([settings["far"], 0.0]), np.array([1.0, 0.3])
    scenario = asked(
        lay_out(position=[start], velocity=[v], radius=[0.5], mass=[1.0], restitution=0.0), 2.0
    )
    runs = runs_of(
        ["box2d:shipped"], AblatedReference(precision=PRECISION[settings["digits"]]), scenario, 4
    )
    exact = start + scenario.times[:, None] * v
    curves = over_time(
        runs, lambda each: np.maximum(np.hypot(*(each.position[:, 0] - exact).T), 1e-16)
    )
    facts = [
        *setting_rows(runs, "float32 rounding of the start in m"),
        distance(curves, "box2d:shipped", "m"),
    ]
    curves.append(Curve(TRUTH, scenario.times, np.full(scenario.samples + 1, 1e-16)))
    chart = LessonChart("Distance from x + v t", "time in s", "m, 0 drawn as 10⁻¹⁶", curves, "y")
    return Shown([chart], filmed(scenario, runs), facts)


def show_cap(settings: Settings) -> Shown:
    """The speed a disk has against the speed it was given."""
    given = np.geomspace(20.0, 2000.0, 15)
    scene = lay_out(
        position=np.column_stack([np.zeros(15), np.arange(15.0)]),
        velocity=np.column_stack([given, np.zeros(15)]),
        radius=np.full(15, 0.2),
        mass=np.ones(15),
        restitution=0.0,
    )
    scenario = asked(scene, 0.1)
    runs = runs_of(
        ["box2d:shipped"],
        AblatedReference(order=BOX2D, cap=settings["cap"]),
        scenario,
        settings["k"],
    )
    curves = over(given, runs, lambda each: each.velocity[-1, :, 0])
    facts = [*setting_rows(runs, "speed cap in m/s"), distance(curves, "box2d:shipped", "m/s")]
    curves.append(Curve(TRUTH, given, given))
    chart = LessonChart("Speed of a free disk", "speed it was given in m/s", "m/s", curves, "xy")
    return Shown([chart], filmed(scenario, runs), facts, opening={"pace": 0.1 / SECONDS})


def show_row(settings: Settings) -> Shown:
    """The velocities after a disk has struck a row that touches."""
    n = settings["n"]
    scene = lay_out(
        position=np.column_stack([[-2.01, *range(n)], np.zeros(n + 1)]),
        velocity=[[5.0, 0.0], *[[0.0, 0.0]] * n],
        radius=np.full(n + 1, 0.5),
        mass=np.ones(n + 1),
        restitution=1.0,
    )
    scenario = asked(scene, 1.0)
    order = {"pair by pair": EXERCISE, "together": BOX2D}[settings["order"]]
    names = ["box2d:matched", "pymunk:matched"]
    runs = runs_of(
        names,
        AblatedReference(order, iterations=settings["iterations"], touching=True),
        scenario,
        4,
    )
    curves = over(np.arange(n + 1.0), runs, lambda each: each.velocity[-1, :, 0])
    facts = [
        *setting_rows(runs, "velocity, position iterations"),
        *(distance(curves, name, "m/s") for name in names),
    ]
    film = filmed(scenario, runs)
    if film.truth is not None:
        curves.append(Curve(TRUTH, np.arange(n + 1.0), film.truth.velocity[-1, :, 0]))
    return Shown([LessonChart("Velocity after the collision", "disk", "m/s", curves)], film, facts)


def page(
    part: int,
    name: str,
    title: str,
    asks: str,
    text: str,
    names: Sequence[str],
    show: Callable[[Settings], Shown],
    *sliders: Slider,
) -> Lesson:
    """A page of this lesson."""
    exact = () if name == "correction" else (TRUTH,)  # disks that overlap have no exact answer
    return Lesson(
        name, f"6.{part}", title, asks, (text,), sliders, (*names, PLAIN, ABLATED, *exact), show
    )


MECHANISMS = (
    page(
        1,
        "threshold",
        "A restitution threshold",
        "Why do slow disks stick in Box2D?",
        "A collision that closes more slowly than a threshold is taken as inelastic, so that what"
        " should rest comes to rest. It is a speed in the engine's own units; the asteroids of the"
        " exercise fly at 0.35 to 0.7 m/s. Raise it in the reference until its curve falls where"
        " the engine's does.",
        ["box2d:shipped"],
        show_threshold,
        Slider("threshold", "Threshold", (0.0, 0.25, 0.5, 1.0, 2.0), 0, "m/s"),
        Slider("e", "Restitution e", (0.5, 0.9, 1.0), 1),
    ),
    page(
        2,
        "mixing",
        "A rule for mixing",
        "Whose restitution does a collision have?",
        "A restitution belongs to a pair, but engines keep one for each shape, and mix the two by a"
        " rule of their own. Try the rules in the reference: one of them is this engine's.",
        ["pymunk:shipped"],
        show_mixing,
        Slider("rule", "Rule", tuple(MIXING), 0),
    ),
    page(
        3,
        "order",
        "Velocity or position first",
        "Why is a falling disk late by a fixed time?",
        "With the same gravity and the same step, one engine moves with the old velocity, the other"
        " with the new one. The velocities stay equal to the last digit; the positions part by"
        " <code>g dt t</code>.",
        ["pymunk:matched"],
        show_order,
        Slider("order", "Order", ("velocity first", "position first"), 0),
        Slider("k", "Steps in 1/60 s", (1, 2, 4), 0),
    ),
    page(
        4,
        "gravity",
        "Impulse before or after gravity",
        "Why does a ball in Box2D bounce ever higher?",
        "A bounce turns round the velocity a disk comes in with. If gravity has been added to it"
        " already, the part of the last step is turned round, too: a ball gains <code>|v| dt</code>"
        " of height a bounce. Taken before gravity, the bounce is reversible and the height stays.",
        ["box2d:matched", "pymunk:matched"],
        show_gravity,
        Slider("order", "Velocity that is turned round", tuple(ORDERS), 0),
        Slider("k", "Steps in 1/60 s", (1, 4), 1),
    ),
    page(
        5,
        "correction",
        "Slop and position correction",
        "What becomes of an overlap?",
        "The exercise projects an overlap away at once. Box2D undoes a share of it, three times a"
        " step, and leaves the last bit, the slop, so that a contact stays a contact. Here a disk"
        " begins 20 cm deep in a fixed one, which no exact answer allows. Box2D's continuous"
        " collision is off, because it undoes the overlap sooner.",
        [NO_CCD],
        show_position_correction,
        Slider("share", "Share undone each time", (0.0, 0.1, 0.2, 0.4), 0),
        Slider("slop", "Slop", (0.0, 1.25, 2.5, 5.0), 0, "mm"),
    ),
    page(
        6,
        "substeps",
        "Substeps",
        "What is a step of Box2D 3.1?",
        "Box2D 3.1 cuts every step into smaller ones, and free flight has the error of the smaller"
        " step: <code>g dt t / 2s</code> below the parabola with s substeps.",
        ["box2d_v3:matched"],
        show_substeps,
        Slider("substeps", "Substeps", (1, 2, 4, 8), 0),
        Slider("k", "Steps in 1/60 s", (1, 2, 4), 0),
    ),
    page(
        7,
        "digits",
        "Single precision",
        "Why does a free disk stray, far from the origin?",
        "A float32 has 24 binary digits. At 10 km two neighbours are 1 mm apart, so a step of 4 mm"
        " is rounded by up to an eighth of itself, and always the same way.",
        ["box2d:shipped"],
        show_digits,
        Slider("digits", "Binary digits", (53, 24), 0),
        Slider("far", "Distance from the origin", (1.0, 100.0, 1e4), 1, "m"),
    ),
    page(
        8,
        "cap",
        "A speed cap",
        "How fast can a disk be?",
        "Box2D moves nothing further than 2 units of length a step, and cuts the velocity to fit,"
        " not only the path. The cap is a length, so the top speed depends on the step.",
        ["box2d:shipped"],
        show_cap,
        Slider("cap", "Farthest move in a step", (np.inf, 1.0, 2.0, 4.0), 0, "m"),
        Slider("k", "Steps in 1/60 s", (1, 4), 0),
    ),
    page(
        9,
        "row",
        "Sequential impulses in a touching row",
        "What comes out of a row that touches?",
        "The exercise lets one pair after the other collide, and the last disk flies off with"
        " everything. So it is in the exact answer, which all orders of these collisions share. A"
        " solver of simultaneous contacts fixes first what each contact shall become, e times its"
        " closing speed, 0 for those that only touch, and then goes through all of them again and"
        " again: what comes out depends on how often.",
        ["box2d:matched", "pymunk:matched"],
        show_row,
        Slider("order", "Contacts", ("pair by pair", "together"), 0),
        Slider("iterations", "Iterations", (1, 2, 4, 8, 50), 3),
        Slider("n", "Disks in the row", (2, 3, 5), 1),
    ),
)
