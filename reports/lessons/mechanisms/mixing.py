"""Lesson 6.2: a rule for mixing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from adapters.box2d import Box2DEngine
from adapters.mechanisms.ablated import MIXING, AblatedReference
from adapters.play import play, play_once
from adapters.pymunk import Pymunk
from adapters.run import Run
from reports.lessons.friction.thrown import ROUGH
from reports.lessons.lesson import (
    Claim,
    Curve,
    LessonChart,
    Settings,
    Shown,
    Simulation,
    Slider,
    run_of,
)
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
)
from reports.lessons.mechanisms.pairs import pairs, separation, sideways
from reports.page.style import TRUTH, number
from scenarios.model import Scenario, Scene

SHOWN = 0.5  # the number on the one disk, of the collision that is replayed
CLOSING = np.array([2.0])  # m/s
SPIN = 60.0  # rad/s: so fast that the surfaces slide all through the collision
RESTITUTION, FRICTION = "restitution e", "friction µ"
PYMUNK, BOX2D = "pymunk:shipped", "box2d:shipped"
OTHERS = {"the same": None, "0.2": 0.2, "0.8": 0.8}  # of the other disk
STEPS = 4  # of a sample interval
READ: dict[str, Read] = {RESTITUTION: separation(CLOSING), FRICTION: sideways}
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


OWN: dict[str, Callable[..., Pymunk | Box2DEngine]] = {PYMUNK: OnePymunk, BOX2D: OneBox2D}


def scene_of(what: str, value: float) -> Scenario:
    """A pair that meets with this coefficient; with friction it spins, and e is 0.5."""
    if what == RESTITUTION:
        return asked(pairs(CLOSING, value), 0.5)
    return asked(pairs(CLOSING, 0.5, value, SPIN), 0.5)


def plain_of(what: str) -> str:
    """The reference that plays it."""
    return PLAIN if what == RESTITUTION else ROUGH


def runs_with(what: str, rule: str, one: float, other: float | None) -> list[Run]:
    """pymunk, Box2D and the ablated reference with the coefficient `one` on the one disk and
    `other` on the other; None: the same, which the reference can play, too."""
    scenario = scene_of(what, one)
    dt = scenario.dt(STEPS)
    mixed = scene_of(what, MIXING[rule](one, one if other is None else other))
    ablated = play(AblatedReference(), ABLATED, mixed, dt)
    if other is None:
        names = (PYMUNK, BOX2D, plain_of(what))
        return [*(run_of(name, scenario, STEPS) for name in names), ablated]
    makes = {name: partial(make, what, (one, other)) for name, make in OWN.items()}
    return [*(play_once(make, name, scenario, dt) for name, make in makes.items()), ablated]


def show_mixing(settings: Settings) -> Shown:
    """The coefficient of a collision against the one that is stated on one of the disks."""
    what, rule, other = settings["what"], settings["rule"], OTHERS[settings["other"]]
    stated = np.linspace(0.0, 1.0, 11)
    found: dict[str, list[float]] = {}
    for value in stated:
        runs = runs_with(what, rule, float(value), other)
        for run in runs:
            if run.trajectory is not None:
                found.setdefault(run.name, []).append(float(READ[what](run.trajectory)[0]))
        if value == SHOWN:
            scenario = scene_of(what, SHOWN)
            # two different coefficients have no exact answer: no law says how to mix them
            alone = Simulation(replace(scenario, substeps=(STEPS,)), runs, None).film
            film = filmed(scenario, runs) if other is None else alone
    curves = [Curve(name, stated, values, dots=True) for name, values in found.items()]
    if other is None:
        curves.append(Curve(TRUTH, stated, stated))
    mark = what[-1]
    facts = [
        (f"replayed: {mark} of the one disk", number(SHOWN)),
        (f"{mark} of the other disk", "the same" if other is None else number(other)),
        *distances(runs[:2], curves, ""),
    ]
    chart = LessonChart(
        f"{what.split()[0].capitalize()} of a pair",
        f"{mark} of the one disk" if other is not None else f"{mark} of each of the two disks",
        f"{mark} of the collision",
        curves,
    )
    claims = same_claims(what, rule) if other is None else mixing_claims(what, rule, other)
    return Shown([chart], film, facts, claims)


# A ratio of impulses, rounded a few times.
DOUBLE, ROUNDED = 16 * 2.0**-53, 16 * FLOAT32


def same_claims(what: str, rule: str) -> list[Claim]:
    """Of two disks with the same number: which engine multiplies, and which gives that number."""
    mark, product = what[-1], rule == "the product"
    own = 0.2 if what == FRICTION else 0.0
    claims = [
        Claim(
            f"{PYMUNK} multiplies: two disks with {mark} have a collision with {mark}².",
            lambda shown: np.abs(shown.y(PYMUNK) - shown.x(PYMUNK) ** 2).max() <= DOUBLE,
        ),
        Claim(
            f"{BOX2D} has the {mark} that is stated."
            + (f" A scene without friction gets the default of Box2D, {own}." if own else ""),
            lambda shown: (
                np.abs(shown.y(BOX2D) - shown.x(BOX2D))[1:].max() <= ROUNDED
                and abs(shown.y(BOX2D)[0] - own) <= ROUNDED
            ),
        ),
        lies_on(PYMUNK, product, DOUBLE),
    ]
    if not product:
        claims.append(
            Claim(
                f"For two disks with the same {mark} this rule gives the {mark} that is stated, as"
                " does every rule but the product: only another number on the other disk shows"
                " which it is.",
                lambda shown: (
                    shown.gap(ABLATED) <= DOUBLE
                    and all(
                        abs(mix(SHOWN, SHOWN) - SHOWN) <= DOUBLE
                        for name, mix in MIXING.items()
                        if name != "the product"
                    )
                ),
            )
        )
    return claims


def mixing_claims(what: str, rule: str, other: float) -> list[Claim]:
    """Of two disks with different numbers: the rule of each engine."""
    mark = what[-1]
    claims = []
    for name, bound in ((PYMUNK, DOUBLE), (BOX2D, ROUNDED)):
        own = OWN_RULES[name][what]
        law = np.array([MIXING[own](float(x), other) for x in np.linspace(0.0, 1.0, 11)])
        claims += [
            Claim(
                f"{name} takes {own}: with {number(SHOWN)} and {number(other)} the {mark} of the"
                f" collision is {number(MIXING[own](SHOWN, other))}.",
                partial(lies_along, name, law, bound),
            ),
            lies_on(name, rule == own, bound),
        ]
    return claims


def lies_along(name: str, law: np.ndarray, bound: float, shown: Shown) -> np.bool_:
    """Whether a curve is `law`, within `bound`."""
    return np.bool_(np.abs(shown.y(name) - law).max() <= bound)


MIXING_RULE = page(
    2,
    "mixing",
    "A rule for mixing",
    "Whose restitution and whose friction does a collision have?",
    "A restitution belongs to a pair of disks, and so does a coefficient of friction. But an engine"
    " keeps one number for each shape and mixes the two by a rule of its own. Try the rules in the"
    " ablated reference: one of them is that of pymunk, another that of Box2D. Two disks with"
    " different numbers have no exact answer, because no law says how to mix them. See [friction]"
    " for what friction does.",
    [PYMUNK, BOX2D, ROUGH],
    show_mixing,
    Slider("what", "Coefficient", (RESTITUTION, FRICTION), 0),
    Slider("rule", "Rule in the ablated reference", tuple(MIXING), 0),
    Slider("other", "Coefficient of the other disk", tuple(OTHERS), 1),
)
