"""Lesson 9.1: spin and friction in a bounce."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from crosscheck2d.reports.lessons.friction.thrown import FALL, ROUGH, Taken, taken, thrown
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Shown,
    Simulation,
    Slider,
    tidy,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Array, Scene
from crosscheck2d.scenarios.truth.sliding import friction_kick

CONE = "friction cone"
BOX2D, BOX2D_V3 = "box2d:shipped", "box2d_v3:shipped"
EXACT = (ROUGH, "pymunk:matched", "event_driven:float64")
NAMES = (ROUGH, "pymunk:matched", BOX2D, BOX2D_V3, "event_driven:float64")
STEEPEST = 75.0  # degrees, of the angles of incidence
RADIUS = 0.25  # m
# Velocities up to 19 m/s, and spins up to 100 rad/s, that float64 rounds a few times.
DOUBLE = 5e-13
# N s of 10: float32 rounds the ends of a floor of 22 m and so its normal, along which a disk then
# has a small share of its 19 m/s.
SINGLE = 1e-4
# m: half of the 13.3 mm by which disk and skin overlap at the end of the step that finds them.
SHORT = 0.02 / 3


class FloorBounce(NamedTuple):
    """The settings, N s that end 1 m/s of slip, and the exact normal impulse, N s."""

    e: float
    mu: float
    angle: float
    spin: float
    weight: float
    normal: float

    @property
    def edge(self) -> float:
        """N s, of the cone by Coulomb's law."""
        return self.mu * self.normal

    @property
    def slip(self) -> float:
        """m/s of the point that touches, before it."""
        return float(slip_at(self.angle, self.spin))


def show_bounce(e: float, mu: float, angle: float, spin: float) -> Shown:
    """The impulse in its cone; the friction impulse and the spin at every angle."""
    here = Simulation.by(thrown(speed_along(angle), spin, e, mu), NAMES, 1)
    scene, impulses = here.scenario.scene, taken_by(here)
    weight = 1 / float(1 / scene.mass[0] + scene.radius[0] ** 2 / scene.inertia[0])
    bounce = FloorBounce(e, mu, angle, spin, weight, float(impulses[TRUTH].normal[0]))
    angles = angles_of(bounce)
    at_angles = taken_by(Simulation.by(thrown(speed_along(angles), spin, e, mu), NAMES, 1))
    edges = [Curve(CONE, angles, np.full(len(angles), side * bounce.edge)) for side in (-1.0, 1.0)]
    frictions = [Curve(name, angles, each.along) for name, each in at_angles.items()]
    spins = [
        Curve(name, angles, spin + each.turning / scene.inertia[0])
        for name, each in at_angles.items()
    ]
    incidence, mark = "angle of incidence from the normal in degrees", [("x", angle, "here")]
    return Shown(
        [
            cone_chart(impulses, bounce),
            LessonChart("Friction impulse", incidence, "Jₜ in N s", [*edges, *frictions], "", mark),
            LessonChart("Spin after the bounce", incidence, "ω in rad/s", spins, "", mark),
        ],
        here.film,
        [
            ("exact answer" if name == TRUTH else name, left_with(each, scene))
            for name, each in impulses.items()
        ],
        list(bounce_claims(bounce, angles)),
        in_numbers(bounce, float(impulses[TRUTH].along[0])),
    )


def speed_along(angle: Array | float) -> Array:
    """m/s along the floor at angles of incidence in degrees, from the normal."""
    return FALL * np.tan(np.radians(angle))


def slip_at(angle: Array | float, spin: float) -> Array:
    """m/s of the point that touches, before the bounce."""
    return speed_along(angle) + RADIUS * spin


def angles_of(bounce: FloorBounce) -> Array:
    """(k,) degrees from 0 to `STEEPEST`, among them those where sticking ends."""
    ends = np.array([-1.0, 1.0]) * bounce.edge / bounce.weight  # m/s of slip
    limits = (ends - RADIUS * bounce.spin) / FALL
    edges = np.degrees(np.arctan(limits))
    inside = edges[(edges > 0) & (edges < STEEPEST)]
    return np.unique(np.append(np.linspace(0.0, STEEPEST, 11), inside))


def taken_by(played: Simulation) -> dict[str, Taken]:
    """What each engine gave the disks; the exact values come last."""
    scene = played.scenario.scene
    return {name: taken(motion, scene) for name, motion in played.motions.items()}


def cone_chart(impulses: Mapping[str, Taken], bounce: FloorBounce) -> LessonChart:
    """The impulse of each as a line from the origin, between the edges of the cone."""
    x, y = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 0.0, 1.0])
    edges = Curve(CONE, bounce.edge * x, bounce.normal * y)
    lines = [
        Curve(name, np.append(0.0, each.along), np.append(0.0, each.normal), dots=True)
        for name, each in impulses.items()
    ]
    return LessonChart(
        "The impulse in its friction cone",
        "friction impulse Jₜ in N s",
        "normal impulse Jₙ in N s",
        [edges, *lines],
    )


def left_with(each: Taken, scene: Scene) -> str:
    """Velocity along the floor and spin after the bounce."""
    along = scene.velocity[0, 0] + each.along[0] / scene.mass[0]
    spin = scene.angular_velocity[0] + each.turning[0] / scene.inertia[0]
    return (
        f"leaves at {tidy(along, SINGLE, 4)} m/s along the floor with {tidy(spin, SINGLE, 4)} rad/s"
    )


def in_numbers(bounce: FloorBounce, friction: float) -> dict[str, str]:
    """Slip, normal impulse, cone and friction impulse, with the numbers of this bounce."""
    along, slip, size, need, found = (
        tidy(float(value), SINGLE, 4)
        for value in (
            speed_along(bounce.angle),
            bounce.slip,
            abs(bounce.slip),
            abs(bounce.slip) * bounce.weight,
            friction,
        )
    )
    return {
        "Slip": f"vₜ + R ω = {along} + {number(RADIUS)} · {number(bounce.spin)} = {slip} m/s",
        "Normal impulse": f"Jₙ = (1 + e) m vₙ = {number(1 + bounce.e)} · 1 · {number(FALL)} ="
        f" {number(bounce.normal)} N s",
        "To stick": f"|slip| / (1/m + R²/I) = {size} / {number(1 / bounce.weight)} = {need} N s"
        " would end the slip",
        "Cone": f"µ Jₙ = {number(bounce.mu)} · {number(bounce.normal)} = {number(bounce.edge)} N s",
        "Friction impulse": f"the smaller of these two, against the slip: Jₜ = {found} N s; it"
        " changes vₜ by Jₜ/m and ω by R Jₜ/I",
    }


def bounce_claims(bounce: FloorBounce, angles: Array) -> Iterator[Claim]:
    """When the contact sticks, which engines have the exact answer, and what the others do."""
    slips = slip_at(angles, bounce.spin)
    exact = friction_kick(slips, 1 / bounce.weight, np.asarray(bounce.edge))
    yield Claim(
        f"The normal impulse is (1 + e) m vₙ = {number(bounce.normal)} N s in every engine. At"
        f" every angle the cone is equally wide, µ Jₙ = {number(bounce.edge)} N s to each side.",
        lambda shown: (
            all(abs(shown.y(name)[-1] - bounce.normal) <= SINGLE for name in (*NAMES, TRUTH))
            and np.ptp(shown.y(CONE, 1)) == 0.0
            and abs(abs(shown.y(CONE, 1)[0]) - bounce.edge) <= DOUBLE
        ),
    )
    yield claim_here(bounce)
    yield Claim(
        "The contact sticks where |vₜ + R ω| is at most (1 + m R²/I) µ (1 + e) vₙ ="
        f" {number(bounce.edge / bounce.weight)} m/s. There the exact friction impulse is in"
        " proportion to the slip. Where the slip is larger the impulse stays on the edge of the"
        " cone.",
        lambda shown: shown.follows(TRUTH, exact, DOUBLE, chart=1),
    )
    yield Claim(
        f"{', '.join(EXACT[:-1])} and {EXACT[-1]} have the exact friction impulse and the exact"
        " spin at every angle, to rounding.",
        lambda shown: all(
            shown.gap(name, chart=1) <= DOUBLE and shown.gap(name, chart=2) <= 32 * DOUBLE
            for name in EXACT
        ),
    )
    yield Claim(
        f"{BOX2D} turns the disk as if friction acted {number(1e3 * SHORT, 2)} mm above the"
        f" floor: its spin changes by {number(100 * SHORT / RADIUS, 2)} % less than its own"
        " friction impulse should change it.",
        lambda shown: turned_short(shown, bounce.spin),
    )
    yield cone_of_v3(bounce.e, bounce.mu)


def claim_here(bounce: FloorBounce) -> Claim:
    """Whether the contact of the replay sticks or slips."""
    need = abs(bounce.slip) * bounce.weight
    if need <= DOUBLE and not bounce.spin:
        return Claim(
            "Here the disk falls straight and does not spin: nothing slides, and no engine"
            " gives a friction impulse.",
            lambda shown: all(abs(shown.x(name)[-1]) <= SINGLE for name in (*NAMES, TRUTH)),
        )
    if need <= DOUBLE:
        return Claim(
            "Here the point that touches is at rest, as that of a wheel that rolls: the exact"
            f" friction impulse is 0. {BOX2D} gives one, because it takes the slip of a point"
            " above the one that touches, and that point moves.",
            lambda shown: (
                abs(shown.x(TRUTH)[-1]) <= DOUBLE and abs(shown.x(BOX2D)[-1]) > 100 * SINGLE
            ),
        )
    if need <= bounce.edge:
        return Claim(
            f"Here the contact sticks: {number(need, 4)} N s end the slip, and the cone allows"
            f" {number(bounce.edge, 4)} N s. The exact impulse lies within the cone.",
            lambda shown: (
                abs(abs(shown.x(TRUTH)[-1]) - need) <= DOUBLE
                and abs(shown.x(TRUTH)[-1]) <= shown.x(CONE)[-1] + DOUBLE
            ),
        )
    return Claim(
        f"Here the contact slips: {number(need, 4)} N s would end the slip, and the cone allows"
        f" only {number(bounce.edge, 4)} N s. The exact impulse lies on the edge of the cone.",
        lambda shown: abs(abs(shown.x(TRUTH)[-1]) - shown.x(CONE)[-1]) <= DOUBLE,
    )


def turned_short(shown: Shown, spin: float) -> bool:
    """Whether every friction impulse of Box2D 2.3 that is not tiny has turned the disk with a lever
    arm that is `SHORT`."""
    impulse, turn = shown.y(BOX2D, 1), shown.y(BOX2D, 2) - spin
    rubs = np.abs(impulse) > 0.05  # N s, of which float32 has four digits
    arm = turn[rubs] * (RADIUS**2 / 2) / impulse[rubs]  # I = m R² / 2 of 1 kg
    return bool(rubs.any() and np.abs(arm - (RADIUS - SHORT)).max() <= 1e-5)


def cone_of_v3(e: float, mu: float) -> Claim:
    """Box2D 3.1 gives the friction of a bounce with e = 0."""
    narrow = mu * FALL
    if not e:
        return Claim(
            f"At e = 0 the friction impulse of {BOX2D_V3} is within a tenth of µ Jₙ of the exact"
            " one.",
            lambda shown: shown.gap(BOX2D_V3, chart=1) <= narrow / 10,
        )
    return Claim(
        f"{BOX2D_V3} never gives more than µ m vₙ = {number(narrow)} N s, 1/(1 + e) ="
        f" {number(100 / (1 + e))} % of what the cone allows: its cone is that of a bounce with e ="
        " 0.",
        lambda shown: (
            0.9 * min(narrow, np.abs(shown.y(TRUTH, 1)).max())
            <= np.abs(shown.y(BOX2D_V3, 1)).max()
            <= narrow + SINGLE
            and np.abs(shown.y(CONE, 1)).max() <= (1 + e) * narrow + DOUBLE
        ),
    )


BOUNCE = Lesson(
    name="friction",
    number="9.1",
    title="Spin and friction in a bounce",
    asks="What does friction do to speed and spin in a bounce?",
    text="""
    A disk meets a floor. The normal passes through its centre, so the normal impulse
    <code>Jₙ</code> does not turn the disk. The friction impulse <code>Jₜ</code> acts along the
    floor and does not change how fast the disk leaves it. The two decouple: <code>Jₙ = (1 + e)
    m vₙ</code> is that of a bounce without friction, and friction acts on the <b>slip</b>
    <code>vₜ + R ω</code>, the velocity of the point that touches.

    Friction acts against the slip. An impulse of <code>|slip| / (1/m + R²/I)</code> ends it:
    the contact <b>sticks</b>. Coulomb's law allows at most <code>µ Jₙ</code>, the edge of the
    <b>friction cone</b>. If that does not end the slip, the contact <b>slips</b> until the disk
    leaves. See [cone] and [lever] for why Box2D differs, and [rolling] for a contact that
    lasts.
    """,
    sliders=(
        Slider("e", "Restitution e", (0.0, 0.5, 1.0), 2),
        Slider("mu", "Friction µ", (0.1, 0.2, 0.5), 0),
        Slider("angle", "Angle of incidence, from the normal", (0, 15, 30, 45, 60, 75), 3, "°"),
        Slider("spin", "Spin ω before the bounce", (-40.0, -20.0, 0.0, 20.0, 40.0), 2, "rad/s"),
    ),
    names=(*NAMES, CONE, TRUTH),
    show=show_bounce,
)
