"""Lesson 9.2: friction before restitution, which is why Box2D 3.1 gives half of it at e = 1."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from crosscheck2d.reports.lessons.friction.thrown import FALL, ROUGH, ablated_beside, taken, thrown
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Shown,
    Slider,
    swept,
    time_step,
)
from crosscheck2d.reports.lessons.mechanisms.ablation import ABLATED, distances, lies_on
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Array, Scene, Trajectory

BOX2D_V3 = "box2d_v3:shipped"
LIMITS = {"µ × whole impulse": True, "µ × impulse before restitution": False}
STATED = np.linspace(0.0, 1.0, 11)  # e
ALONG = 8.0  # m/s: so fast that the contact slips at every setting
# Of a ratio of impulses: Box2D 3.1 rounds the ends of a floor of 22 m to float32.
SINGLE = 1e-5
# The point that touches turns with the disk, which Box2D 3.1 takes for a gap that is a little wider
# (`carried` in the ablated reference): a part of the normal impulse comes after the friction.
CARRIED = 2e-3
# Of Box2D 3.1: m, B2_SPECULATIVE_DISTANCE, four slops of 5 mm, and the substeps of a step.
FORESEEN, SUBSTEPS = 0.02, 4


def show_cone(limit: str, mu: float, k: int) -> Shown:
    """Friction over normal impulse, and the normal impulse, against e."""
    whole = LIMITS[limit]
    played = [
        ablated_beside(BOX2D_V3, {"rub_restituted": whole}, thrown(ALONG, 0.0, float(e), mu), k)
        for e in STATED
    ]
    chart = LessonChart(
        "Friction over normal impulse",
        "restitution e",
        "Jₜ / Jₙ",
        [*swept(STATED, played, friction_share), Curve(TRUTH, STATED, np.full(len(STATED), mu))],
    )
    exact = Curve(TRUTH, STATED, (1 + STATED) * FALL)
    normal = swept(STATED, played, lambda each, scene: taken(each, scene).normal[0])
    last = played[-1]
    return Shown(
        [chart, LessonChart("Normal impulse", "restitution e", "Jₙ in N s", [*normal, exact])],
        last.film,
        [("replayed: e", number(float(STATED[-1]))), *distances(chart)],
        list(cone_claims(mu, whole, last.runs[0].dt, last.scenario.scene)),
    )


def friction_share(played: Trajectory, scene: Scene) -> float:
    """The friction impulse over the normal impulse."""
    each = taken(played, scene)
    return float(np.abs(each.along[0] / each.normal[0]))


def share_of_v3(dt: float, scene: Scene) -> float:
    """The part of m vₙ that Box2D 3.1 takes before restitution.

    Less than 1 if a step ends with a gap that is shorter than a substep moves the disk, and began
    within `FORESEEN`: the last pass only slows the disk to gap / h (b2SolveContact, s > 0).
    """
    step = FALL * dt  # m
    left = float(scene.position[0, 1] - scene.radius[0]) % step
    substep = step / SUBSTEPS
    return 1 - left / substep if left < substep and step + left < FORESEEN else 1.0


def cone_claims(mu: float, whole: bool, dt: float, scene: Scene) -> Iterator[Claim]:
    """The normal impulse, and the friction that each engine gives."""
    share = share_of_v3(dt, scene)
    narrow = mu / (1 + STATED) * np.where(STATED > 0, share, 1.0)
    ablated = np.full(len(STATED), mu) if whole else narrow

    def gives(name: str, law: Array) -> Callable[[Shown], np.bool_]:
        return lambda shown: np.abs(shown.y(name) / law - 1).max() <= CARRIED

    yield Claim(
        "The normal impulse is right in every engine: (1 + e) m vₙ.",
        lambda shown: all(
            shown.gap(name, chart=1) <= 10 * SINGLE for name in (BOX2D_V3, ROUGH, ABLATED)
        ),
    )
    yield Claim(
        f"The exact friction impulse is µ = {number(mu)} of the normal impulse at every e."
        f" {ROUGH} gives it.",
        # Velocities of 8 m/s that float64 rounds a few times.
        lambda shown: shown.gap(ROUGH) <= 1e-13 and np.ptp(shown.y(TRUTH)) == 0.0,
    )
    yield foreseen_claim(gives(BOX2D_V3, narrow), share, dt)
    yield Claim(
        "The ablated reference has all other mechanisms of Box2D 3.1, and gives the exact"
        " friction at every e."
        if whole
        else "The ablated reference now gives what Box2D 3.1 gives: that friction does not act"
        " after restitution is the whole cause.",
        gives(ABLATED, ablated),
    )
    yield lies_on(BOX2D_V3, not whole, SINGLE)


def foreseen_claim(holds: Callable[[Shown], np.bool_], share: float, dt: float) -> Claim:
    """What Box2D 3.1 gives with this step, and why."""
    step = f"vₙ dt = {number(1e3 * FALL * dt)} mm"
    near = f"{number(1e3 * FORESEEN)} mm"
    if share == 1.0:
        return Claim(
            f"{BOX2D_V3} gives µ m vₙ at every e. That is right at e = 0. It is µ/(1 + e) of the"
            " normal impulse: at e = 1 half of the exact friction. A contact is foreseen within"
            f" {near}; a step moves the disk by {step}, which is more, so this holds wherever in a"
            " step the disk meets the floor.",
            lambda shown: FALL * dt > FORESEEN and holds(shown),
        )
    return Claim(
        f"{BOX2D_V3} gives {number(share, 2)} µ m vₙ at every e above 0 here. A step moves the"
        f" disk by {step}, less than the {near} within which a contact is foreseen. A step then"
        f" ends with a gap that {number(1 - share, 2)} of a substep would close. Its last pass only"
        f" slows the disk to what closes the gap in one substep, which takes {number(share, 2)} of"
        " m vₙ. Restitution gives the rest of the impulse, without friction.",
        holds,
    )


CONE = Lesson(
    name="cone",
    number="9.2",
    title="Friction before restitution",
    asks="Why does Box2D 3.1 give half of the friction at e = 1?",
    text="""
    Box2D 3.1 solves a step in two parts. In the first a contact stops the approach, and
    friction acts up to <code>µ</code> times the normal impulse of this part, <code>m vₙ</code>.
    In the second part, restitution adds <code>e m vₙ</code>, and friction does not act again.
    The friction cone is that of a collision with <code>e = 0</code>. See [friction] for what
    the cone is.

    The ablated reference plays with the mechanisms of Box2D 3.1. Choose what limits its
    friction. The disk is so fast along the floor that the contact slips at every setting here.
    If the contact sticks within the narrower cone, the order does not matter.
    """,
    sliders=(
        Slider("limit", "Friction limit", tuple(LIMITS), 0),
        Slider("mu", "Friction µ", (0.05, 0.1, 0.2), 1),
        time_step(1 / 60, (20, 4, 1), 2),
    ),
    names=(BOX2D_V3, ROUGH, ABLATED, TRUTH),
    show=show_cone,
)
