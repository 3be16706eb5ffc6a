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
FLOAT32 = 2.0**-24  # half of the distance of two neighbours, relative
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


def lies_on(engine: str, own: bool, bound: float, unit: str = "") -> Claim:
    """Whether the ablated reference, as it is set, does what the engine does.

    own: whether it is set as the engine is; bound: what the rounding of both may add up to.
    """
    if own:
        within = f"within {number(bound, 2)} {unit}".strip() if bound else "to the last digit"
        return Claim(
            f"With this setting the ablated reference lies on {engine}, {within}.",
            lambda shown: shown.gap(ABLATED, engine) <= bound,
        )
    return Claim(
        f"With this setting the ablated reference does not lie on {engine}.",
        lambda shown: shown.gap(ABLATED, engine) > 300 * bound,
    )


def distances(runs: Sequence[Run], curves: Sequence[Curve], unit: str) -> list[tuple[str, str]]:
    """By how much the ablated reference's curve differs from those of the engines, at the most."""
    shown = Shown([LessonChart("", "", "", curves)])
    return [
        (
            f"largest difference of the ablated reference from {run.name}",
            f"{number(shown.gap(ABLATED, run.name), 2)} {unit}".strip(),
        )
        for run in runs
        if run.name not in (PLAIN, ABLATED)
    ]


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
    threshold, e = settings["threshold"], settings["e"]
    scenario = asked(pairs(closing, e), 0.5)
    runs = runs_of(["box2d:shipped"], AblatedReference(threshold=threshold), scenario, 4)
    curves = over(closing, runs, separation(closing))
    facts = [
        *setting_rows(runs, "restitution threshold in m/s"),
        *distances(runs, curves, ""),
    ]
    curves.append(Curve(TRUTH, closing, np.full(len(closing), e)))
    rounding = 8 * FLOAT32  # of a ratio of velocities that are rounded a few times

    def cut_below(shown: Shown, name: str, speed: float) -> bool:
        expected = np.where(closing < speed, 0.0, e)
        return bool(np.abs(shown.y(name) - expected).max() <= rounding)

    claims = [
        Claim(
            f"box2d:shipped takes every collision below 1 m/s as inelastic, and gives every faster"
            f" one the stated e = {e}.",
            lambda shown: cut_below(shown, "box2d:shipped", 1.0),
        ),
        Claim(
            f"The ablated reference does so below {number(threshold)} m/s."
            if threshold
            else "The ablated reference has no threshold yet, and reference:exercise has none.",
            lambda shown: cut_below(shown, ABLATED, threshold) and cut_below(shown, PLAIN, 0.0),
        ),
        lies_on("box2d:shipped", threshold == 1.0, rounding),
    ]
    chart = LessonChart(
        "Separation over approach speed", "closing speed in m/s", "e of the collision", curves, "x"
    )
    return Shown([chart], filmed(scenario, runs), facts, claims)


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
        *distances(runs, curves, ""),
    ]
    product, rounding = settings["rule"] == "the product", 8 * 2.0**-53
    claims = [
        Claim(
            "pymunk:shipped multiplies: two disks with e have a collision with e².",
            lambda shown: np.abs(shown.y("pymunk:shipped") - stated**2).max() <= rounding,
        ),
        lies_on("pymunk:shipped", product, rounding),
    ]
    if not product:
        claims.append(
            Claim(
                "Both disks have the same e here, so this rule gives the e that is stated.",
                lambda shown: shown.gap(ABLATED) <= rounding,
            )
        )
    chart = LessonChart(
        "Restitution of a pair", "e on each of the two disks", "e of the collision", curves
    )
    return Shown([chart], film, facts, claims)


def falling(engine: str, on: AblatedReference, substeps: int, claims: FlightClaims) -> Shown:
    """mm above the parabola of a thrown disk; `claims` are made of g dt t / 2 in mm."""
    scenario = free_fall()
    assert scenario.truth is not None
    exact = scenario.truth(scenario.times).position
    runs = runs_of([engine], on, scenario, substeps)
    curves = over_time(runs, lambda each: 1e3 * (each.position - exact)[:, 0, 1])
    facts = distances(runs, curves, "mm")
    curves.append(Curve(TRUTH, scenario.times, np.zeros(scenario.intervals + 1)))
    offset = 1e3 * 9.81 * scenario.dt(substeps) * scenario.times / 2
    return Shown(
        [LessonChart("Above the parabola", "time in s", "mm", curves)],
        filmed(scenario, runs),
        facts,
        claims(offset),
    )


FlightClaims = Callable[[Array], list[Claim]]
ROUNDING_MM = 1e-9  # of some 400 float64 additions of metres, in mm


def follows(name: str, law: Array, bound: float) -> Callable[[Shown], np.bool_]:
    """Whether a curve is `law`, within `bound`."""
    return lambda shown: np.abs(shown.y(name) - law).max() <= bound


def show_order(settings: Settings) -> Shown:
    """Velocity then position, or position then velocity."""
    position_first = settings["order"] == "position first"

    def claims(offset: Array) -> list[Claim]:
        mm, half = number(offset[-1]), number(500 / 60 / settings["k"])
        return [
            Claim(
                f"pymunk:matched moves first. It is g dt t / 2 above the parabola, {mm} mm in the"
                f" end: its fall is late by dt / 2 = {half} ms, at every time.",
                follows("pymunk:matched", offset, ROUNDING_MM),
            ),
            Claim(
                "reference:exercise changes the velocity first. It is as far below: its fall is"
                " early by dt / 2. The two are g dt t from each other.",
                follows(PLAIN, -offset, ROUNDING_MM),
            ),
            lies_on("pymunk:matched", position_first, ROUNDING_MM, "mm"),
        ]

    order = POSITION_FIRST if position_first else EXERCISE
    return falling("pymunk:matched", AblatedReference(order=order), settings["k"], claims)


def show_substeps(settings: Settings) -> Shown:
    """A step cut into smaller ones."""
    n = settings["substeps"]
    single = 1e3 * 360 * 4 * FLOAT32  # mm: 360 substeps, heights up to 4 m

    def claims(offset: Array) -> list[Claim]:
        return [
            Claim(
                f"The ablated reference with n = {n} is g dt t / (2 n) below the parabola,"
                f" {number(offset[-1] / n)} mm in the end.",
                follows(ABLATED, -offset / n, ROUNDING_MM),
            ),
            Claim(
                "box2d_v3:matched, called with four substeps, is g dt t / 8 below it,"
                f" {number(offset[-1] / 4)} mm in the end, within {number(single, 1)} mm: it"
                " computes in single precision.",
                follows("box2d_v3:matched", -offset / 4, single),
            ),
            lies_on("box2d_v3:matched", n == 4, single, "mm")
            if n == 4
            else Claim(
                "With this setting the ablated reference does not lie on box2d_v3:matched.",
                lambda shown: shown.gap(ABLATED, "box2d_v3:matched") > 10 * single,
            ),
        ]

    return falling("box2d_v3:matched", AblatedReference(substeps=n), settings["k"], claims)


def peaks(shown: Shown, name: str) -> Array:
    """m, the heights at which a bouncing ball turns, at the samples."""
    y = shown.y(name)
    return y[1:-1][(y[1:-1] >= y[:-2]) & (y[1:-1] > y[2:])]


def show_gravity(settings: Settings) -> Shown:
    """Height of a ball that should bounce for ever."""
    scenario, k = bouncing_ball_e1(), settings["k"]
    names = ["box2d:matched", "pymunk:matched"]
    ablated = AblatedReference(order=ORDERS[settings["order"]])
    without = partial(changed, "box2d:matched", continuous=False, bullet=False)
    dt = scenario.dt(k)
    runs = [play_once(without, NO_CCD, scenario, dt), *runs_of(names, ablated, scenario, k)]
    curves = over_time(runs, lambda each: each.position[:, 0, 1])
    facts = distances(runs, curves, "m")
    assert scenario.truth is not None
    curves.append(Curve(TRUTH, scenario.times, scenario.truth(scenario.times).position[:, 0, 1]))
    return Shown(
        [LessonChart("Height of the centre", "time in s", "m", curves)],
        filmed(scenario, runs),
        facts,
        bounce_claims(scenario.scene, dt, settings["order"]),
    )


def bounce_claims(scene: Scene, dt: float, order: str) -> list[Claim]:
    """What each bounce adds to the height of the next."""
    start, radius = float(scene.position[0, 1]), float(scene.radius[0])
    g = float(np.hypot(*scene.gravity))
    # A sample is up to 1/120 s from the turn, which is then up to g (1/120 s)² / 2 higher.
    seen = g / 120**2 / 2  # m
    # 600 to 4800 steps that each round a height of up to 2.5 m, and bounces that hand the error on.
    single = 2400 * FLOAT32

    def gains(shown: Shown) -> bool:
        found = np.array([start, *peaks(shown, NO_CCD)])
        speed = np.sqrt(2 * g * (found[:-1] - radius))
        return bool((np.abs(np.diff(found) - speed * dt) <= 0.1 * speed * dt + 2 * seen).all())

    def rises(shown: Shown) -> bool:
        return bool(shown.y("box2d:matched").max() < shown.y(NO_CCD).max() - 2 * seen)

    fall = float(np.sqrt(2 * g * (start - radius)))
    continuous = (
        Claim(
            "At this dt box2d:matched, whose continuous collision is on, does the same.",
            lambda shown: shown.gap("box2d:matched", NO_CCD) <= single,
        )
        if round(1 / dt) == 240
        else Claim(
            "At this dt continuous collision (box2d:matched) acts in some bounces, and the ball"
            " rises less high than without it.",
            rises,
        )
    )
    return [
        Claim(
            "Box2D without continuous collision (+no_ccd) turns round a velocity that gravity has"
            " changed already. The ball gains |v| dt of height at each bounce, where v is its"
            f" speed: {number(1e3 * fall * dt)} mm at the first, and more at each later one.",
            lambda shown: gains(shown) and (np.diff(peaks(shown, NO_CCD)) > 0).all(),
        ),
        continuous,
        Claim(
            "pymunk:matched turns round the velocity before gravity. Up and down are the same"
            " motion, and the ball returns to the height it started from.",
            lambda shown: np.abs(peaks(shown, "pymunk:matched") - start).max() <= seen + 1e-9,
        ),
        Claim(
            "reference:exercise projects the ball back to the floor at each bounce; no bounce rises"
            " higher than the start.",
            lambda shown: peaks(shown, PLAIN).max() <= start,
        ),
        lies_on(NO_CCD, order == "aimed after gravity", single, "m"),
        lies_on("pymunk:matched", order == "aimed before gravity", 1e-11, "m"),
    ]


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
    facts = [*setting_rows(runs, "linear slop in m"), *distances(runs, curves, "mm")]
    chart = LessonChart("Overlap", "time in s", "mm, 0 drawn as 0.001", curves, "y")
    return Shown(
        [chart],
        filmed(scenario, runs),
        facts,
        correction_claims(settings["share"], settings["slop"]),
    )


def correction_claims(share: float, slop: float) -> list[Claim]:
    """What is left of 200 mm after a step, and in the end; slop in mm."""
    own = 2.5  # mm, the slop of Box2D in a scene of metres
    single = 1e3 * 72 * FLOAT32  # mm: 24 steps, three corrections each, of coordinates up to 1 m
    left = own + (200 - own) * (1 - 0.2) ** 3
    return [
        Claim(
            "reference:exercise removes the overlap in the first step.",
            lambda shown: shown.y(PLAIN)[0] > 199 and shown.y(PLAIN)[1:].max() <= 1e-3,
        ),
        Claim(
            "Box2D undoes 0.2 of what exceeds its slop of 2.5 mm, three times a step:"
            f" {number(left)} mm are left after the first step, and in the end the slop and less"
            " than 0.1 mm more.",
            lambda shown: (
                abs(shown.y(NO_CCD)[1] - left) <= single and own <= shown.y(NO_CCD)[-1] < own + 0.1
            ),
        ),
        Claim(
            f"The ablated reference never goes below its slop of {number(slop)} mm."
            if share
            else "The ablated reference undoes no share of the overlap yet: it stays at 200 mm.",
            lambda shown: (
                (np.diff(shown.y(ABLATED)) <= 0).all()
                and shown.y(ABLATED).min() >= (slop - 1e-9 if share else 200 - 1e-9)
            ),
        ),
        lies_on(NO_CCD, (share, slop) == (0.2, own), single, "mm"),
    ]


def show_digits(settings: Settings) -> Shown:
    """How far a disk far out is from x + v t."""
    far, digits = settings["far"], settings["digits"]
    start, v = np.array([far, 0.0]), np.array([1.0, 0.3])
    scenario = asked(
        lay_out(position=[start], velocity=[v], radius=[0.5], mass=[1.0], restitution=0.0), 2.0
    )
    runs = runs_of(["box2d:shipped"], AblatedReference(precision=PRECISION[digits]), scenario, 4)
    exact = start + scenario.times[:, None] * v
    curves = over_time(
        runs, lambda each: np.maximum(np.hypot(*(each.position[:, 0] - exact).T), 1e-16)
    )
    facts = distances(runs, curves, "m")
    curves.append(Curve(TRUTH, scenario.times, np.full(scenario.intervals + 1, 1e-16)))
    chart = LessonChart("Distance from x + v t", "time in s", "m, 0 drawn as 10⁻¹⁶", curves, "y")
    return Shown(
        [chart],
        filmed(scenario, runs),
        facts,
        digits_claims(far, digits, scenario.intervals * 4, scenario.dt(4)),
    )


def digits_claims(far: float, digits: int, steps: int, dt: float) -> list[Claim]:
    """What rounding a place that often may add up to."""
    apart = float(np.spacing(np.float32(far + 2)))  # m; the disk moves by 2 m
    most = steps * apart  # half of it along x, less along y
    claims = [
        Claim(
            f"{number(far)} m from the origin two neighbouring float32 numbers are"
            f" {number(1e3 * apart)} mm apart, and a step is {number(1e3 * dt)} mm. Box2D rounds"
            f" the place in each of {steps} steps; all together may not exceed"
            f" {number(1e3 * most)} mm, and does not.",
            lambda shown: apart / 100 < shown.y("box2d:shipped").max() <= most,
        ),
        Claim(
            "reference:exercise computes with 53 binary digits and stays within a millionth of a"
            " millimetre.",
            lambda shown: shown.y(PLAIN).max() < 1e-9,
        ),
        lies_on("box2d:shipped", digits == 24, 0.0),
    ]
    if far == 1e4:
        claims.insert(
            1,
            Claim(
                "Here every step is rounded the same way, so the error grows in proportion to the"
                " time.",
                lambda shown: (
                    np.abs(
                        shown.y("box2d:shipped")
                        - shown.y("box2d:shipped")[-1] * shown.x("box2d:shipped") / 2
                    ).max()
                    < 0.05 * shown.y("box2d:shipped")[-1]
                ),
            ),
        )
    return claims


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
    cap, dt = settings["cap"], scenario.dt(settings["k"])
    runs = runs_of(
        ["box2d:shipped"], AblatedReference(order=BOX2D, cap=cap), scenario, settings["k"]
    )
    curves = over(given, runs, lambda each: each.velocity[-1, :, 0])
    facts = [*setting_rows(runs, "speed cap in m/s"), *distances(runs, curves, "m/s")]
    curves.append(Curve(TRUTH, given, given))
    chart = LessonChart("Speed of a free disk", "speed it was given in m/s", "m/s", curves, "xy")
    claims = [
        Claim(
            f"box2d:shipped moves a disk by at most 2 m in a step of {number(1e3 * dt)} ms, and"
            f" cuts its speed to 2 m / dt = {number(2 / dt)} m/s.",
            follows("box2d:shipped", np.minimum(given, 2 / dt), 2000 * 4 * FLOAT32),
        ),
        Claim(
            f"The ablated reference cuts at {number(cap)} m, {number(cap / dt)} m/s."
            if np.isfinite(cap)
            else "The ablated reference has no cap yet and keeps every speed.",
            follows(ABLATED, np.minimum(given, cap / dt), 1e-9),
        ),
        Claim("reference:exercise keeps every speed.", follows(PLAIN, given, 0.0)),
        # A length and a ratio rounded at up to 480 m/s.
        lies_on("box2d:shipped", cap == 2.0, 480 * 4 * FLOAT32, "m/s"),
    ]
    return Shown([chart], filmed(scenario, runs), facts, claims, opening={"pace": 0.1 / SECONDS})


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
    facts = distances(runs, curves, "m/s")
    film = filmed(scenario, runs)
    assert film.truth is not None
    curves.append(Curve(TRUTH, np.arange(n + 1.0), film.truth.velocity[-1, :, 0]))
    chart = LessonChart("Velocity after the collision", "disk", "m/s", curves)
    return Shown([chart], film, facts, row_claims(n, settings["order"], settings["iterations"]))


def row_claims(n: int, order: str, iterations: int) -> list[Claim]:
    """Who gets what of 5 m/s."""
    last = np.append(np.zeros(n), 5.0)
    # 8 iterations over up to 5 contacts, at 5 m/s.
    single = 8 * n * 5 * FLOAT32

    def shared(shown: Shown) -> bool:
        y = shown.y("box2d:matched")
        return bool(y[0] < -1 and (y[1:] > 1).all() and abs(y.sum() - 5) < 1e-4)

    claims = [
        Claim(
            "In the exact answer the last disk takes all of the 5 m/s and the others stay.",
            follows(TRUTH, last, 0.0),
        ),
        Claim(
            "So it is with the solvers that take one pair after the other, reference:exercise and"
            " pymunk:matched.",
            lambda shown: all(
                follows(name, last, 1e-12)(shown) for name in (PLAIN, "pymunk:matched")
            ),
        ),
        Claim(
            "In Box2D the first disk is thrown back and all others move on; the momentum is the"
            " same.",
            shared,
        ),
    ]
    if order == "pair by pair":
        claims.append(lies_on("pymunk:matched", True, 1e-12, "m/s"))
    if order == "together" and iterations == 50:
        together = 10 / (n + 1)  # m/s: one body of n disks, struck with e = 1
        claims.append(
            Claim(
                "After 50 iterations the row of the ablated reference moves on as one body, at"
                f" {number(together)} m/s, within 1 mm/s.",
                follows(ABLATED, np.append(5 - n * together, np.full(n, together)), 1e-3),
            )
        )
    else:
        claims.append(
            lies_on("box2d:matched", order == "together" and iterations == 8, single, "m/s")
        )
    return claims


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
        "An engine may take a collision that closes more slowly than a threshold as inelastic, so"
        " that what should rest comes to rest. The threshold is a speed in the units of the scene."
        " Raise it in the ablated reference until its curve lies on that of Box2D.",
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
        "A restitution belongs to a pair of disks, but an engine keeps one number for each shape"
        " and mixes the two by a rule of its own. Try the rules in the ablated reference: one of"
        " them is that of pymunk.",
        ["pymunk:shipped"],
        show_mixing,
        Slider("rule", "Rule", tuple(MIXING), 0),
    ),
    page(
        3,
        "order",
        "Velocity or position first",
        "Why is a falling disk late by half a step?",
        "With the same gravity and the same step, one engine moves a disk with the old velocity and"
        " the other with the new one. [thrust] does this with a force.",
        ["pymunk:matched"],
        show_order,
        Slider("order", "Order", ("velocity first", "position first"), 0),
        time_step(1 / 60, (4, 2, 1), 2),
    ),
    page(
        4,
        "gravity",
        "Impulse before or after gravity",
        "Why does a ball in Box2D bounce ever higher?",
        "A bounce turns round the velocity with which a ball meets the floor. If gravity has been"
        " added to it already, the part that gravity added in this step is turned round, too. Box2D"
        " plays twice, with its continuous collision on and off (<code>+no_ccd</code>), because"
        " continuous collision hides the effect at some step sizes.",
        [NO_CCD, "box2d:matched", "pymunk:matched"],
        show_gravity,
        Slider("order", "Velocity that is turned round", tuple(ORDERS), 0),
        time_step(1 / 60, (8, 4, 2, 1), 1),
    ),
    page(
        5,
        "correction",
        "Slop and position correction",
        "What becomes of an overlap?",
        "The exercise projects two disks apart at once. Box2D undoes a share of their overlap at a"
        " time and leaves the last bit, the <b>slop</b>, so that a contact stays a contact. Here a"
        " disk starts deep in a fixed one, for which there is no exact answer. The continuous"
        " collision of Box2D is off (<code>+no_ccd</code>), because it removes the overlap by other"
        " means.",
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
        "Box2D 3.1 cuts every step into n smaller ones, and a disk in flight has the error of the"
        " smaller step. [order] is about a whole one.",
        ["box2d_v3:matched"],
        show_substeps,
        Slider("substeps", "Substeps n", (1, 2, 4, 8), 0),
        time_step(1 / 60, (4, 2, 1), 2),
    ),
    page(
        7,
        "digits",
        "Single precision",
        "Why does a free disk drift, far from the origin?",
        "A float32 number has 24 binary digits. The farther a disk is from the origin, the more of"
        " them the integer part of its coordinate takes, and the fewer are left for a step.",
        ["box2d:shipped"],
        show_digits,
        Slider("digits", "Binary digits", (53, 24), 0),
        Slider("far", "Distance from the origin", (1.0, 100.0, 1e4), 2, "m"),
    ),
    page(
        8,
        "cap",
        "A speed cap",
        "How fast can a disk be?",
        "Box2D limits how far a disk may move in a step. It cuts the velocity to fit, not only the"
        " path. The limit is a length, so the highest speed depends on the step.",
        ["box2d:shipped"],
        show_cap,
        Slider("cap", "Farthest move in a step", (1.0, 2.0, 4.0, np.inf), 3, "m"),
        time_step(1 / 60, (4, 1), 1),
    ),
    page(
        9,
        "row",
        "Sequential impulses in a touching row",
        "What comes out of a row that touches?",
        "A disk strikes a row of disks that touch. The exercise lets one pair after the other"
        " collide. A solver of simultaneous contacts first fixes what each contact shall become: e"
        " times its closing speed, and 0 where two disks only touch. Then it goes through all"
        " contacts again and again, a number of <b>iterations</b>.",
        ["box2d:matched", "pymunk:matched"],
        show_row,
        Slider("order", "Contacts", ("pair by pair", "together"), 0),
        Slider("iterations", "Iterations", (1, 2, 4, 8, 50), 3),
        Slider("n", "Disks in the row", (2, 3, 5), 1),
    ),
)
