"""Lesson 9.4: from sliding to rolling."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache

import numpy as np

from crosscheck2d.adapters.mechanisms.ablated import MIXING
from crosscheck2d.adapters.mechanisms.table import IMPULSE, Mechanism
from crosscheck2d.reports.lessons.friction.thrown import ROUGH
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Lesson,
    Shown,
    Simulation,
    Slider,
    run_of,
    tidy,
    time_step,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import ablated_as
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.friction import G, slide_on_floor
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import Legs
from crosscheck2d.scenarios.truth.sliding import slide

SHIPPED, MATCHED = "pymunk:shipped", "pymunk:matched"
BOX2D, BOX2D_V3 = "box2d:shipped", "box2d_v3:shipped"
EVENTS = "event_driven:float64"
NAMES = (ROUGH, SHIPPED, MATCHED, BOX2D, BOX2D_V3, EVENTS)
SPEED, RADIUS, SECONDS = 2.0, 0.25, 4.0  # m/s at the start, m, s
SOLID = 2.0  # m R² / I
# m/s: 960 steps that each round velocities of up to 8 m/s in float64.
DOUBLE = 960 * 8 * 2.0**-53
STILL = 1e-16  # m/s, as low as a logarithmic axis goes


def show_rolling(spin: float, mu: float, k: int) -> Shown:
    """Velocity and slip over time, and the slip once more on a logarithmic axis."""
    played = Simulation.by(disk_on_floor(spin, mu), NAMES, k)
    begins = float(sliding(spin, mu).start[-1])
    guides = [("x", begins, "rolls")] if begins else []
    return Shown(
        [
            played.over_time(
                "Velocity along the floor", "m/s", lambda each: each.velocity[:, 0, 0], "", guides
            ),
            played.over_time("Slip of the point that touches", "v + R ω in m/s", slip, "", guides),
            played.over_time(
                "Size of that slip",
                "|v + R ω| in m/s",
                lambda each: np.maximum(np.abs(slip(each)), STILL),
                "y",
                guides,
            ),
        ],
        played.film,
        facts(played),
        list(rolling_claims(played, spin, mu, k)),
    )


def disk_on_floor(spin: float, friction: float) -> Scenario:
    """A disk that touches a floor, and slides unless its spin is that of rolling."""
    return slide_on_floor(
        "slide", "When does a disk that slides begin to roll?", SPEED, spin, SECONDS, friction
    )


def slip(each: Trajectory) -> Array:
    """(k,) m/s of the point that touches the floor."""
    found: Array = each.velocity[:, 0, 0] + RADIUS * each.angular_velocity[:, 0]
    return found


def sliding(spin: float, friction: float) -> Legs:
    """The exact motion of the disk: one leg while it slides, one while it rolls."""
    return slide(SPEED, spin, RADIUS, SOLID, friction, 0.0, G)


def facts(played: Simulation) -> list[tuple[str, str]]:
    """The motion of each engine's disk at the end, and how deep it was in the floor."""
    return [
        (
            "exact answer" if name == TRUTH else name,
            f"in the end {tidy(each.velocity[-1, 0, 0], DOUBLE)} m/s, slip"
            f" {tidy(slip(each)[-1], DOUBLE)} m/s; in the floor by at most"
            f" {tidy(max(1e3 * deepest(each), 0.0), DOUBLE)} mm",
        )
        for name, each in played.motions.items()
    ]


def rolling_claims(played: Simulation, spin: float, mu: float, k: int) -> Iterator[Claim]:
    """When the disk rolls and how fast, which engines are exact, and the slip at the end."""
    legs, dt = sliding(spin, mu), played.runs[0].dt
    rolls, end = float(legs.start[-1]), float(legs.velocity[-1, 0])
    late = f"one step of friction, µ g dt = {number(1e3 * mu * G * dt)} mm/s"
    yield from exact_claims(spin, mu, rolls, end)
    yield Claim(
        f"{ROUGH} and {EVENTS} have the exact velocity, to rounding. {MATCHED} is off by at"
        f" most {late}.",
        lambda shown: (
            max(shown.gap(ROUGH), shown.gap(EVENTS)) <= DOUBLE
            and shown.gap(MATCHED) <= mu * G * dt + DOUBLE
        ),
    )
    yield Claim(
        "When they roll, these three have no slip, to rounding.",
        lambda shown: all(
            np.abs(shown.y(name, 1)[shown.x(name, 1) > rolls + 2 * dt]).max() <= DOUBLE
            for name in (ROUGH, EVENTS, MATCHED)
        ),
    )
    yield mixed_claim(spin, mu, dt)
    yield from slip_claims(played.motions, spin, mu, k)


def exact_claims(spin: float, mu: float, rolls: float, end: float) -> Iterator[Claim]:
    """The closed form, in words."""
    if not rolls:
        yield Claim(
            f"The disk rolls from the start, v = −R ω = {number(SPEED)} m/s: the point that"
            " touches is at rest, there is no friction, and the exact velocity stays.",
            lambda shown: (
                shown.follows(TRUTH, SPEED, DOUBLE) and shown.follows(TRUTH, 0.0, DOUBLE, chart=1)
            ),
        )
        return
    brake = mu * G

    def slows(shown: Shown) -> bool:
        slides = shown.x(TRUTH) < rolls
        t = shown.x(TRUTH)[slides]
        speed, slid = shown.y(TRUTH)[slides], shown.y(TRUTH, 1)[slides]
        return bool(
            np.abs(speed - (SPEED - brake * t)).max() <= DOUBLE
            and np.abs(slid - (slid[0] - (1 + SOLID) * brake * t)).max() <= DOUBLE
        )

    stops = "stands still: the spin was just enough to stop it"
    ends = stops if abs(end) <= DOUBLE else "rolls on" if end > 0 else "has turned back"
    rule = "2/3 v₀" if not spin else "(2 v₀ − R ω₀)/3"
    when = "v₀/(3 µ g)" if not spin else "(v₀ + R ω₀)/(3 µ g)"
    yield Claim(
        f"While the disk slides, its velocity falls by µ g = {number(brake)} m/s each second."
        " Friction turns it, too, so that the slip falls by 3 µ g ="
        f" {number(3 * brake)} m/s each second.",
        slows,
    )
    yield Claim(
        f"From t = {when} = {number(rolls)} s on the exact slip is 0, and the velocity stays at"
        f" {rule} = {tidy(end, DOUBLE)} m/s: the disk {ends}.",
        lambda shown: (
            np.abs(shown.y(TRUTH)[shown.x(TRUTH) >= rolls] - end).max() <= DOUBLE
            and np.abs(shown.y(TRUTH, 1)[shown.x(TRUTH) >= rolls]).max() <= DOUBLE
            and np.abs(shown.y(TRUTH, 1)[shown.x(TRUTH) < rolls]).min() > DOUBLE
        ),
    )


def mixed_claim(spin: float, mu: float, dt: float) -> Claim:
    """pymunk multiplies the coefficients of floor and disk."""
    mixed = MIXING["the product"](mu, mu)
    rolls = float(sliding(spin, mixed).start[-1])
    if not rolls:
        return Claim(
            f"{SHIPPED} rolls, too: where nothing slides, no coefficient matters.",
            lambda shown: shown.gap(SHIPPED) <= DOUBLE,
        )
    after = "" if rolls < SECONDS else ", after the end of the replay"
    return Claim(
        f"{SHIPPED} multiplies the coefficients of floor and disk: its friction is µ² ="
        f" {number(mixed)}. It begins to roll 1/µ = {number(1 / mu)} times as late, at"
        f" {number(rolls)} s{after}.",
        lambda shown: shown.follows(
            SHIPPED, sliding(spin, mixed).at(shown.x(SHIPPED))[1][:, 0], mixed * G * dt + DOUBLE
        ),
    )


@cache
def depths_of_v3(spin: float, friction: float, k: int, carried: bool) -> tuple[float, float]:
    """m, how deep the disk sinks at the most, and m/s in the end, in the ablated reference with the
    mechanisms of Box2D 3.1; carried: whether its contact points turn with the disk."""
    scenario = disk_on_floor(spin, friction)
    change = Mechanism(IMPULSE, {"carried": carried})
    played = ablated_as(run_of(BOX2D_V3, scenario, k), scenario, change).trajectory
    assert played is not None
    return deepest(played), float(played.velocity[-1, 0, 0])


def deepest(played: Trajectory) -> float:
    """m, by which the disk is in the floor at the most, at the samples."""
    return float(RADIUS - played.position[:, 0, 1].min())


def slip_claims(
    motions: Mapping[str, Trajectory], spin: float, mu: float, k: int
) -> Iterator[Claim]:
    """The slip that remains in Box2D."""

    def share(shown: Shown, name: str) -> float:
        return float(np.abs(shown.y(name, 1)[-1] / shown.y(name)[-1]))

    exact = float(sliding(spin, mu).velocity[-1, 0])
    height = float(motions[BOX2D].position[-1, 0, 1])
    sunk = deepest(motions[BOX2D_V3])
    depth, end = depths_of_v3(spin, mu, k, True)
    level, straight = depths_of_v3(spin, mu, k, False)

    yield Claim(
        f"{BOX2D} never stops slipping. The disk rests 5 mm deep in the skin of the floor, so"
        " the lever arm of friction is 2.5 mm too short, 1 % of the radius. Friction stops a"
        " point above the one that touches, which slips at 1 % of the velocity.",
        lambda shown: (
            abs(share(shown, BOX2D) - 0.01) <= 5e-4 and abs(height - RADIUS - 0.005) <= 1e-4
        ),
    )
    yield Claim(
        f"In {BOX2D_V3} the disk sinks into the floor, here by up to {number(1e3 * depth)} mm:"
        " the point that touches turns with the disk within a step, and Box2D takes the rise of"
        " that point for a gap. The faster the spin and the longer the step, the deeper. The"
        " ablated reference, which is not drawn here, sinks as deep and ends within 4 mm/s of"
        " its velocity. Without this mechanism it sinks by less than 0.1 mm.",
        lambda shown: (
            abs(sunk - depth) <= 2e-6 + 2e-3 * depth
            and level < min(depth, 1e-4)
            and abs(shown.y(BOX2D_V3)[-1] - end) <= 4e-3
        ),
    )
    if abs(sliding(spin, 1.0).velocity[-1, 0]) <= DOUBLE:
        yield Claim(
            f"{BOX2D_V3} lets a disk that is slow enough sleep: in the end nothing moves.",
            lambda shown: shown.y(BOX2D_V3)[-1] == shown.y(BOX2D_V3, 1)[-1] == 0.0,
        )
        return
    near = abs(end - exact) < 1e-3 * abs(exact)
    velocity = (
        "which is within a thousandth of the exact one"
        if near
        else f"which is {number(end, 4)} m/s, not {number(exact, 4)} m/s; without this mechanism it"
        f" is {number(straight, 4)} m/s"
    )
    yield Claim(
        "This shortens the lever arm, too. In the end the point that touches slips at less than"
        f" 0.3 % of the velocity, {velocity}.",
        lambda shown: (
            1e-5 < share(shown, BOX2D_V3) < 0.003
            and abs(shown.y(BOX2D_V3)[-1] - end) <= 1e-4
            and (near or abs(straight - exact) < abs(end - exact) / 4)
        ),
    )


ROLLING = Lesson(
    name="rolling",
    number="9.4",
    title="From sliding to rolling",
    asks="When does a disk that slides begin to roll?",
    text="""
    A disk touches the floor and slides. Friction <code>µ m g</code> acts against the slip
    <code>v + R ω</code> of the point that touches. It slows the disk and changes its spin until
    the slip is gone. From then on the disk <b>rolls</b>, and on a level floor no friction acts
    any more. A disk with back spin, here <code>ω > 0</code>, may stop and return before it
    rolls.

    An engine keeps a coefficient for each shape, and mixes those of floor and disk by a rule of
    its own: pymunk multiplies them, Box2D takes the root of the product. As shipped, both have
    <code>µ</code> here. <code>pymunk:matched</code> gives both the root of <code>µ</code>,
    whose product is <code>µ</code>. [mixing] compares the rules.

    The last chart shows the <b>slip at rest</b>: the slip that remains when the disk should
    roll. See [lever] for the slip at rest of Box2D 2.3.
    """,
    sliders=(
        Slider("spin", "Spin ω at the start", (-8.0, 0.0, 16.0, 32.0), 1, "rad/s"),
        Slider("mu", "Friction µ", (0.1, 0.2, 0.4), 1),
        time_step(1 / 60, (4, 1), 1),
    ),
    names=(*NAMES, TRUTH),
    show=show_rolling,
)
