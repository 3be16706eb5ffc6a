"""Lesson 6.2: a rule for mixing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from adapters.mechanisms.ablated import MIXING, AblatedReference
from adapters.run import Run
from reports.lessons.friction.thrown import ROUGH
from reports.lessons.lesson import Claim, Curve, LessonChart, Settings, Shown, Slider
from reports.lessons.mechanisms.ablation import (
    ABLATED,
    FLOAT32,
    PLAIN,
    Read,
    asked,
    distances,
    filmed,
    lies_on,
    page,
    runs_of,
)
from reports.lessons.mechanisms.pairs import pairs, separation, sideways
from reports.page.style import TRUTH, number
from scenarios.model import Scenario

SHOWN = 0.5  # the number on both disks whose collision is replayed
CLOSING = np.array([2.0])  # m/s
SPIN = 60.0  # rad/s: so fast that the surfaces slide all through the collision
RESTITUTION, FRICTION = "restitution e", "friction µ"
PYMUNK, BOX2D = "pymunk:shipped", "box2d:shipped"


def bouncing(e: float, rule: str) -> tuple[Scenario, list[Run]]:
    """A pair with this restitution on both disks, which the ablated reference mixes by the rule."""
    scenario = asked(pairs(CLOSING, e), 0.5)
    return scenario, runs_of([PYMUNK, BOX2D], AblatedReference(mixing=rule), scenario, 4)


def rubbing(mu: float, rule: str) -> tuple[Scenario, list[Run]]:
    """A pair with this friction on both disks, e = 0.5, which spin and rub; mixed by the rule."""
    scenario = asked(pairs(CLOSING, 0.5, mu, SPIN), 0.5)
    ablated = AblatedReference(friction=MIXING[rule](mu, mu))
    return scenario, runs_of([PYMUNK, BOX2D], ablated, scenario, 4, ROUGH)


PLAYED: dict[str, tuple[Callable[[float, str], tuple[Scenario, list[Run]]], Read, str]] = {
    RESTITUTION: (bouncing, separation(CLOSING), PLAIN),
    FRICTION: (rubbing, sideways, ROUGH),
}


def show_mixing(settings: Settings) -> Shown:
    """The coefficient of a collision against the one that is stated on both disks."""
    what, rule = settings["what"], settings["rule"]
    play, read, plain = PLAYED[what]
    stated = np.linspace(0.0, 1.0, 11)
    found: dict[str, list[float]] = {}
    for value in stated:
        scenario, runs = play(float(value), rule)
        for run in runs:
            if run.trajectory is not None:
                found.setdefault(run.name, []).append(float(read(run.trajectory)[0]))
        if value == SHOWN:
            film = filmed(scenario, runs)
    curves = [
        *(Curve(name, stated, found[name], dots=True) for name in (PYMUNK, BOX2D, plain, ABLATED)),
        Curve(TRUTH, stated, stated),
    ]
    mark = what[-1]
    facts = [
        (f"replayed: {mark} on each of the two disks", number(SHOWN)),
        *distances(runs[:2], curves, ""),
    ]
    chart = LessonChart(
        f"{what.split()[0].capitalize()} of a pair",
        f"{mark} on each of the two disks",
        f"{mark} of the collision",
        curves,
    )
    return Shown([chart], film, facts, mixing_claims(mark, rule == "the product"))


def mixing_claims(mark: str, product: bool) -> list[Claim]:
    """Which engine multiplies, and which gives the number that is stated."""
    # A ratio of impulses, rounded a few times.
    double, single = 16 * 2.0**-53, 16 * FLOAT32
    box2d, own = ("the larger", 0.0) if mark == "e" else ("the root of the product", 0.2)
    claims = [
        Claim(
            f"{PYMUNK} multiplies: two disks with {mark} have a collision with {mark}².",
            lambda shown: np.abs(shown.y(PYMUNK) - shown.x(PYMUNK) ** 2).max() <= double,
        ),
        Claim(
            f"{BOX2D} takes {box2d}. Both disks have the same {mark} here, so that is the {mark}"
            " that is stated."
            + (f" A scene without friction gets the default of Box2D, {own}." if own else ""),
            lambda shown: (
                np.abs(shown.y(BOX2D) - shown.x(BOX2D))[1:].max() <= single
                and abs(shown.y(BOX2D)[0] - own) <= single
            ),
        ),
        lies_on(PYMUNK, product, double),
    ]
    if not product:
        claims.append(
            Claim(
                f"For two disks with the same {mark} this rule gives the {mark} that is stated.",
                lambda shown: shown.gap(ABLATED) <= double,
            )
        )
    return claims


MIXING_RULE = page(
    2,
    "mixing",
    "A rule for mixing",
    "Whose restitution and whose friction does a collision have?",
    "A restitution belongs to a pair of disks, and so does a coefficient of friction. But an engine"
    " keeps one number for each shape and mixes the two by a rule of its own. Try the rules in the"
    " ablated reference: one of them is that of pymunk. See [friction] for what friction does.",
    [PYMUNK, BOX2D, ROUGH],
    show_mixing,
    Slider("what", "Coefficient", (RESTITUTION, FRICTION), 0),
    Slider("rule", "Rule", tuple(MIXING), 0),
)
