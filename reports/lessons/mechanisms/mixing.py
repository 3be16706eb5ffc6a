"""Lesson 6.2: a rule for mixing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from crosscheck2d.adapters.box2d import Box2DEngine
from crosscheck2d.adapters.mechanisms.ablated import MIXING, AblatedReference
from crosscheck2d.adapters.pymunk import Pymunk
from crosscheck2d.reports.lessons.friction.thrown import ROUGH
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Makes,
    Read,
    Shown,
    Simulation,
    Slider,
    run_of,
    swept,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import (
    ABLATED,
    FLOAT32,
    PLAIN,
    asked,
    distances,
    lies_on,
)
from crosscheck2d.reports.lessons.mechanisms.pairs import SECONDS, pairs, separation, sideways
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Scenario, Scene

SHOWN = 0.5  # the number on the one disk, of the collision that is replayed
STATED = np.linspace(0.0, 1.0, 11)
SPEED = np.array([2.0])  # m/s
SPIN = 60.0  # rad/s: so fast that the surfaces slide all through the collision
RESTITUTION, FRICTION = "restitution e", "friction µ"
PYMUNK, BOX2D = "pymunk:shipped", "box2d:shipped"
OTHERS = {"the same": None, "0.2": 0.2, "0.8": 0.8}  # of the other disk
STEPS = 4  # of a sample interval
READ: dict[str, Read] = {RESTITUTION: separation(SPEED), FRICTION: sideways}
OWN_RULES = {
    PYMUNK: {RESTITUTION: "the product", FRICTION: "the product"},
    BOX2D: {RESTITUTION: "the larger", FRICTION: "the root of the product"},
}


class OnePymunk(Pymunk):
    """pymunk as shipped, whose shapes have coefficients of their own, (n,)."""

    def __init__(self, what: str, of_disks: tuple[float, ...]) -> None:
        super().__init__("shipped")
        self.what, self.of_disks = what, of_disks

    def load(self, scene: Scene, dt: float) -> None:
        """As it is, and then the coefficient of each disk."""
        super().load(scene, dt)
        name = "elasticity" if self.what == RESTITUTION else "friction"
        for shape, value in zip(self.index, self.of_disks, strict=True):
            setattr(shape, name, value)


class OneBox2D(Box2DEngine):
    """Box2D 2.3 as shipped, whose fixtures have coefficients of their own, (n,)."""

    def __init__(self, what: str, of_disks: tuple[float, ...]) -> None:
        super().__init__("shipped")
        self.what, self.of_disks = what, of_disks

    def load(self, scene: Scene, dt: float) -> None:
        """As it is, and then the coefficient of each disk."""
        super().load(scene, dt)
        name = "restitution" if self.what == RESTITUTION else "friction"
        for body, value in zip(self.bodies, self.of_disks, strict=True):
            setattr(body.fixtures[0], name, value)


def scene_of(what: str, value: float) -> Scenario:
    """A pair that meets with this coefficient; with friction it spins, and e is 0.5."""
    if what == RESTITUTION:
        return asked(pairs(SPEED, value), SECONDS)
    return asked(pairs(SPEED, 0.5, value, SPIN), SECONDS)


def played_with(what: str, rule: str, one: float, other: float | None) -> Simulation:
    """pymunk, Box2D and the ablated reference with the coefficient `one` on the one disk and
    `other` on the other; None: the same, which the reference can play, too. Two different
    coefficients have no exact answer: no law says how to mix them."""
    scenario = scene_of(what, one)
    if other is None:
        plain = PLAIN if what == RESTITUTION else ROUGH
        engines = Simulation.by(scenario, (PYMUNK, BOX2D, plain), STEPS)
    else:
        pair = (one, other)
        own: Makes = {PYMUNK: partial(OnePymunk, what, pair), BOX2D: partial(OneBox2D, what, pair)}
        engines = Simulation.by(replace(scenario, truth=None), tuple(own), STEPS, own)
    mixed = scene_of(what, MIXING[rule](one, one if other is None else other))
    ablated = run_of(ABLATED, mixed, STEPS, AblatedReference)
    return replace(engines, runs=[*engines.runs, ablated])


def show_mixing(what: str, rule: str, other: str) -> Shown:
    """The coefficient of a collision against the one that is stated on one of the disks."""
    second = OTHERS[other]
    played = [played_with(what, rule, float(value), second) for value in STATED]
    curves = swept(STATED, played, lambda each, _: READ[what](each)[0])
    if second is None:
        curves.append(Curve(TRUTH, STATED, STATED))
    mark = what[-1]
    chart = LessonChart(
        f"{what.split()[0].capitalize()} of a pair",
        f"{mark} of the one disk" if second is not None else f"{mark} of each of the two disks",
        f"{mark} of the collision",
        curves,
    )
    facts = [
        (f"replayed: {mark} of the one disk", number(SHOWN)),
        (f"{mark} of the other disk", "the same" if second is None else number(second)),
        *distances(chart),
    ]
    if second is None:
        claims = list(same_claims(what, rule))
    else:
        claims = [
            *rule_claims(PYMUNK, what, rule, second, DOUBLE),
            *rule_claims(BOX2D, what, rule, second, ROUNDED),
        ]
    return Shown([chart], played[STATED.tolist().index(SHOWN)].film, facts, claims)


# A ratio of impulses, rounded a few times.
DOUBLE, ROUNDED = 16 * 2.0**-53, 16 * FLOAT32


def same_claims(what: str, rule: str) -> Iterator[Claim]:
    """Of two disks with the same number: which engine multiplies, and which gives that number."""
    mark, product = what[-1], rule == "the product"
    own = 0.2 if what == FRICTION else 0.0
    yield Claim(
        f"{PYMUNK} multiplies: two disks with {mark} have a collision with {mark}².",
        lambda shown: shown.follows(PYMUNK, shown.x(PYMUNK) ** 2, DOUBLE),
    )
    yield Claim(
        f"{BOX2D} has the {mark} that is stated."
        + (f" A scene without friction gets the default of Box2D, {own}." if own else ""),
        lambda shown: (
            np.abs(shown.y(BOX2D) - shown.x(BOX2D))[1:].max() <= ROUNDED
            and abs(shown.y(BOX2D)[0] - own) <= ROUNDED
        ),
    )
    yield lies_on(PYMUNK, product, DOUBLE)
    if not product:
        yield Claim(
            f"For two disks with the same {mark} this rule gives the {mark} that is stated, as does"
            " every rule but the product: only another number on the other disk shows which it is.",
            lambda shown: (
                shown.gap(ABLATED) <= DOUBLE
                and all(
                    abs(mix(SHOWN, SHOWN) - SHOWN) <= DOUBLE
                    for name, mix in MIXING.items()
                    if name != "the product"
                )
            ),
        )


def rule_claims(name: str, what: str, rule: str, other: float, bound: float) -> Iterator[Claim]:
    """Of two disks with different numbers: the rule of an engine."""
    mark, own = what[-1], OWN_RULES[name][what]
    law = np.array([MIXING[own](float(x), other) for x in STATED])
    yield Claim(
        f"{name} takes {own}: with {number(SHOWN)} and {number(other)} the {mark} of the collision"
        f" is {number(MIXING[own](SHOWN, other))}.",
        lambda shown: shown.follows(name, law, bound),
    )
    yield lies_on(name, rule == own, bound)


MIXING_RULE = Lesson(
    name="mixing",
    number="6.2",
    title="A rule for mixing",
    asks="Whose restitution and whose friction does a collision have?",
    text="""
    A restitution belongs to a pair of disks, and so does a coefficient of friction. But an
    engine keeps one number for each shape and mixes the two by a rule of its own. Try the rules
    in the ablated reference: one of them is that of pymunk, another that of Box2D. Two disks
    with different numbers have no exact answer, because no law says how to mix them. See
    [friction] for what friction does.
    """,
    sliders=(
        Slider("what", "Coefficient", (RESTITUTION, FRICTION), 0),
        Slider("rule", "Rule in the ablated reference", tuple(MIXING), 0),
        Slider("other", "Coefficient of the other disk", tuple(OTHERS), 1),
    ),
    names=(PYMUNK, BOX2D, ROUGH, PLAIN, ABLATED, TRUTH),
    show=show_mixing,
)
