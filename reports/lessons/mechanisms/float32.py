"""Lesson 6.10: what float32 costs, by Box2D 2.3 and planck, the same algorithm in float64."""

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
)
from crosscheck2d.reports.lessons.mechanisms.planck import (
    BOX2D,
    COMMAND,
    KEPT,
    LADDER,
    PLANCK,
    PROFILES,
    SCENES,
    known,
    largest_deviation,
    played,
    whole,
)
from crosscheck2d.reports.lessons.mechanisms.recorded import made_with, table_in
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Array

BETWEEN = "between the two"
ALIKE = 0.02  # of an error: where float32 changes none of a scene by more, one sentence says so


def show_float32(scene: str, profile: str) -> Shown:
    """The error of both at every step size, and float32's share of it in every scene."""
    scenario, _ = known(scene)
    box2d = f"{BOX2D}:{profile}"
    table = table_in(KEPT)
    mine = (table.scenario == scene) & (table.profile == profile)
    rows = table[mine & table.substeps.isin(LADDER)]
    ms = 1e3 * scenario.sample_interval / rows.substeps.to_numpy(float)
    curves = [
        Curve(f"{PLANCK}:{profile}", ms, rows.planck_radii.to_numpy(float), dots=True),
        Curve(box2d, ms, errors_of_box2d(scene, profile), dots=True),
        Curve(BETWEEN, ms, rows.deviation_radii.to_numpy(float), dots=True),
    ]
    middle = scenario.middle_substeps
    shares = shares_of(profile)
    percent = 100 * np.abs(list(shares.values()))
    return Shown(
        [
            LessonChart(
                "Largest error of a disk",
                "step size in ms",
                "radii",
                curves,
                "xy",
                guides=[("x", 1e3 * scenario.dt(middle), "middle")],
            ),
            LessonChart(
                "Share of float32 in the error, all scenes",
                "scenes, from the smallest share",
                "%, without its sign",
                [Curve(box2d, np.arange(1.0, len(percent) + 1), percent, dots=True)],
                "y",
                guides=[("y", 1.0, "1 %")],
            ),
        ],
        Simulation.by(scenario, (box2d,), middle).film,
        [
            (f"share of float32 in the error of {box2d}", "below 0: float32 makes it smaller"),
            *((each, f"{number(100 * share, 2)} %") for each, share in reversed(shares.items())),
        ],
        [*claims_of(scene, profile, curves, LADDER.index(middle)), claim_of_all(profile, percent)],
    )


@cache
def errors_of_box2d(name: str, profile: str) -> Array:
    """Radii, at each step size of `LADDER`, on this machine."""
    runs = [played(BOX2D, profile, name, substeps) for substeps in LADDER]
    return np.array([largest_deviation(whole(run), known(name)[1], name) for run in runs])


@cache
def shares_of(profile: str) -> dict[str, float]:
    """Scene -> the error of Box2D less that of planck, over that of Box2D, at the middle step size;
    from the smallest share to the largest. A scene in which Box2D is exact has none."""
    found: dict[str, float] = {}
    for row in table_in(KEPT).to_dict("records"):
        name = str(row["scenario"])
        usual = row["substeps"] == known(name)[0].middle_substeps
        if row["profile"] == profile and usual and row["box2d_radii"]:
            found[name] = 1 - row["planck_radii"] / row["box2d_radii"]
    return dict(sorted(found.items(), key=lambda one: abs(one[1])))


def claims_of(name: str, profile: str, curves: list[Curve], middle: int) -> Iterator[Claim]:
    """What the errors of a scene show; `middle`: the place of the middle step size."""
    planck, box2d = f"{PLANCK}:{profile}", f"{BOX2D}:{profile}"
    p, b, between = (curve.y for curve in curves)
    ms = curves[0].x

    def share(shown: Shown) -> Array:
        return 1 - shown.y(planck) / shown.y(box2d)

    def ends(values: Array) -> float:
        return float(values[-1] / values[0])

    usual = float(1 - p[middle] / b[middle])
    part = f"{number(100 * abs(usual), 2)} %"
    effect = (
        f"float32 is {part} of that error"
        if usual >= 0
        else f"without float32 the error would be {part} larger"
    )
    yield Claim(
        f"At the middle step size, {number(ms[middle])} ms, {planck} is"
        f" {number(p[middle], 4)} radii off and {box2d} {number(b[middle], 4)}: {effect}.",
        lambda shown: abs(share(shown)[middle] - usual) <= 1e-9,
    )
    if name == "free_fall":
        yield Claim(
            f"Half the step gives half the error of {planck}, at every step size.",
            lambda shown: np.abs(shown.y(planck)[:-1] / shown.y(planck)[1:] - 2).max() < 1e-3,
        )
    worst = float(np.abs(1 - p / b).max())
    if worst <= ALIKE:
        yield Claim(
            "Float32 matters little here: at no step size does it change the error by more"
            f" than {number(100 * worst, 2)} %.",
            lambda shown: np.abs(share(shown)).max() <= worst * (1 + 1e-9),
        )
        return
    best = int(np.argmin(b))
    times = float(b[-1] / p[-1])
    yield Claim(
        f"{box2d} is nearest to the exact answer at {number(ms[best], 2)} ms. Smaller steps"
        f" make its error larger: at {number(ms[-1], 2)} ms it is {number(times, 2)} times"
        f" that of {planck}.",
        lambda shown: (
            int(np.argmin(shown.y(box2d))) == best < len(ms) - 1
            and abs(shown.y(box2d)[-1] / shown.y(planck)[-1] / times - 1) <= 1e-9
        ),
    )
    growth = ends(between)
    if growth > 1:
        yield Claim(
            "The distance between the two grows with the number of steps:"
            f" {LADDER[-1]} times as many steps make it {number(growth, 2)} times as large.",
            lambda shown: (
                abs(ends(shown.y(BETWEEN)) / growth - 1) <= 1e-9
                and ends(shown.x(BETWEEN)) == 1 / LADDER[-1]
                and np.polyfit(np.log(shown.x(BETWEEN)), np.log(shown.y(BETWEEN)), 1)[0] < -0.5
            ),
        )


def claim_of_all(profile: str, percent: Array) -> Claim:
    """In how many scenes float32 matters at the middle step size, and in which of them it makes the
    error smaller."""
    small, large = int((percent < 1).sum()), int((percent > 10).sum())
    shares = shares_of(profile)
    names = list(reversed(shares))[:large]
    smaller = [name for name in names if shares[name] < 0]
    box2d = f"{BOX2D}:{profile}"
    most = f"; by more than a tenth in {', '.join(names)}" if names else ""
    sign = (
        f". In {len(smaller)} of these, {', '.join(smaller)}, it makes the error smaller"
        if smaller
        else ""
    )
    return Claim(
        f"In {small} of {len(percent)} scenes float32 changes the error of {box2d} by less than 1 %"
        f" at the middle step size{most}{sign}. The table has the share of all {len(percent)}; the"
        " other scenes of the report have no exact answer, or Box2D is exact in them.",
        lambda shown: (
            int((shown.y(box2d, 1) < 1).sum()) == small
            and int((shown.y(box2d, 1) > 10).sum()) == large
            and smaller == [name for name in names if dict(shown.facts)[name].startswith("−")]
        ),
    )


SINGLE = Lesson(
    name="float32",
    number="6.10",
    title="planck against Box2D 2.3: what float32 costs",
    asks="How much of an error is the rounding of float32?",
    text="""
    Box2D 2.3 computes in float32. <code>planck</code> is Box2D 2.3 in JavaScript, which
    computes in float64. Both have the same settings here, as matched those of
    <code>box2d:matched</code>, so they differ only by rounding. The
    error of Box2D minus that of planck is the <b>share of float32</b>. A share below 0 means
    that float32 makes the error smaller.

    A smaller step makes the error of the method smaller. It also makes more steps, and each
    step rounds. See [digits] for what rounding does far from the origin.
    """,
    sliders=(
        Slider("scene", "Scene", SCENES, 0),
        Slider("profile", "Profile", PROFILES, 0),
    ),
    names=(
        *(f"{engine}:{profile}" for profile in PROFILES for engine in (PLANCK, BOX2D)),
        BETWEEN,
        TRUTH,
    ),
    show=show_float32,
    recorded=(
        "The numbers of planck, the distance between the two and the share of float32 in all scenes"
        f" were recorded on {made_with(KEPT)}, by {COMMAND}."
    ),
)
