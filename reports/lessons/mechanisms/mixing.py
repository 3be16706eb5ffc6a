"""Lesson 6.2: a rule for mixing."""

from __future__ import annotations

import numpy as np

from adapters.mechanisms.ablated import MIXING, AblatedReference
from reports.lessons.lesson import Claim, Curve, LessonChart, Settings, Shown, Slider
from reports.lessons.mechanisms.ablation import (
    ABLATED,
    PLAIN,
    asked,
    distances,
    filmed,
    lies_on,
    page,
    runs_of,
)
from reports.lessons.mechanisms.pairs import pairs, separation
from reports.page.style import TRUTH, number

SHOWN = 0.5  # the e whose collision is replayed in the page on mixing


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


MIXING_RULE = page(
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
)
