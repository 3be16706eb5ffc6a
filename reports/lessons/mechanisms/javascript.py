"""Lesson 6.11: the restitution of the JavaScript engines."""

from __future__ import annotations

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
from crosscheck2d.reports.lessons.mechanisms.ablation import PLAIN
from crosscheck2d.reports.lessons.mechanisms.javascript_bounces import (
    COMMAND,
    ENGINES,
    KEPT,
    RESTITUTIONS,
    VERSIONS,
    name_in,
    ratios,
)
from crosscheck2d.reports.lessons.mechanisms.pairs import CLOSING, SECONDS, at_all_speeds
from crosscheck2d.reports.lessons.mechanisms.recorded import made_with
from crosscheck2d.reports.page.style import TRUTH, number

KEPT_E = 1e-3  # by how much e may be off for a sentence to say that it is kept
STUCK = 0.25  # of e: a collision that gives less is called cut, one that gives more is not


def show_javascript(e: float, off: str) -> Shown:
    """e of a collision against its closing speed."""
    curves = [
        Curve(name_in(engine, off), CLOSING, ratios(engine, off, e), dots=True)
        for engine in ENGINES
    ]
    claims = [claim_of(e, curve) for curve in curves]
    curves.append(Curve(TRUTH, CLOSING, np.full(len(CLOSING), e)))
    chart = LessonChart(
        "Separation over approach speed",
        "closing speed in m/s",
        f"ratio {SECONDS:g} s after the start",
        curves,
        "x",
    )
    return Shown([chart], Simulation.by(at_all_speeds(e), (PLAIN,), 1).film, claims=claims)


def claim_of(e: float, curve: Curve) -> Claim:
    """The speed up to which an engine reduces the bounce, and the e that it gives above."""
    name, speed, ratio = curve.name, curve.x, curve.y
    stuck = ratio < STUCK * e
    low, high = float(ratio[~stuck].min()), float(ratio[~stuck].max())
    kept = max(abs(low - e), abs(high - e)) <= KEPT_E
    gives = (
        f"gives e within {number(KEPT_E)}"
        if kept
        else f"leaves {number(low, 2)} of the closing speed, not {number(e)}"
    )
    text = (
        f"Up to {number(float(speed[stuck][-1]))} m/s {name} gives less than a quarter of e; from"
        f" {number(float(speed[~stuck][0]))} m/s on it {gives}."
        if stuck.any()
        else f"{name} has no threshold down to {number(float(speed[0]))} m/s, and {gives}."
    )

    def holds(shown: Shown) -> bool:
        y = shown.y(name)
        above = y[~stuck]
        return bool(
            (y[stuck] < STUCK * e).all()
            and np.ptp(above) <= 2 * KEPT_E
            and (np.abs(above - e).max() <= KEPT_E) == kept
            and abs(above.min() - low) <= KEPT_E
        )

    return Claim(text, holds)


JAVASCRIPT = Lesson(
    name="javascript",
    number="6.11",
    title="The same bounce in planck, matter and Rapier",
    asks="Which restitution do the JavaScript engines give?",
    text="""
    <code>planck</code> is Box2D 2.3, with its restitution threshold (see [threshold]).
    <code>Rapier</code> has no threshold. <code>matter-js</code> differs in three ways, and each
    can be disabled. Air slows its disks in flight. Its disks are polygons, which touch at a
    corner, so that a part of the impulse turns them. It solves a collision in several
    iterations, and those after the first stop a slow pair.

    Disable them one after the other. The matched profiles avoid all three by settings that the
    engines document; matter's disks then have 200 sides.
    """,
    sliders=(
        Slider("e", "Restitution e", RESTITUTIONS, 1),
        Slider("off", "Disabled", tuple(VERSIONS), 0),
    ),
    names=(
        *dict.fromkeys(name_in(engine, version) for version in VERSIONS for engine in ENGINES),
        PLAIN,
        TRUTH,
    ),
    show=show_javascript,
    recorded=(
        "The ratios of planck, matter and Rapier were recorded on"
        f" {made_with(KEPT)}, by {COMMAND}. The replay shows reference:exercise."
    ),
)
