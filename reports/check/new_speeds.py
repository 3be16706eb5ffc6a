"""Known mistakes in closed formulas for the new velocities, which give the speeds along n without
an impulse: vA' = (mA vA + mB vB - mB e (vA - vB)) / (mA + mB), or, with the same terms collected,
((mA - e mB) vA + (1 + e) mB vB) / (mA + mB)."""

from __future__ import annotations

from collections.abc import Callable

from crosscheck2d.reports.check.collisions import PairCollision
from crosscheck2d.reports.check.parts import Change
from crosscheck2d.scenarios.model import Array

# (own mass, mass of the other, own speed along n, that of the other, e) -> its new speed, m/s
Speed = Callable[[float, float, float, float, float], float]


def newton(m: float, other: float, v: float, w: float, e: float) -> float:
    """The new speed by Newton's law of impact."""
    return (m * v + other * w - other * e * (v - w)) / (m + other)


WRONG_SPEEDS: dict[str, Speed] = {
    "the term with e has the wrong sign": lambda m, other, v, w, e: newton(m, other, v, w, -e),
    "the term with e has the mass of the wrong sphere": lambda m, other, v, w, e: (
        (m * v + other * w - m * e * (v - w)) / (m + other)
    ),
    "it is {m} + e {other} instead of {m} - e {other}": lambda m, other, v, w, e: (
        ((m + e * other) * v + (1 + e) * other * w) / (m + other)
    ),
    "it is (1 + e) {m} v{w} instead of (1 + e) {other} v{w}": lambda m, other, v, w, e: (
        ((m - e * other) * v + (1 + e) * m * w) / (m + other)
    ),
    "the factor (1 + e) is missing": lambda m, other, v, w, e: (
        ((m - e * other) * v + other * w) / (m + other)
    ),
}


def changed_speeds(speed_a: Speed, speed_b: Speed) -> Change:
    """The changes of both velocities if the speeds along n become these."""

    def change(h: PairCollision, _P: Array, e: float) -> tuple[Array, Array]:
        a, b = float(h.va @ h.n), float(h.vb @ h.n)
        return (speed_a(h.ma, h.mb, a, b, e) - a) * h.n, (speed_b(h.mb, h.ma, b, a, e) - b) * h.n

    return change


def speed_mistakes() -> dict[str, Change]:
    """Mistake -> its effect: each in the new speed of A, in that of B, or in both."""
    found: dict[str, Change] = {}
    for how, wrong in WRONG_SPEEDS.items():
        of_a, of_b = how.format(m="mA", other="mB", w="B"), how.format(m="mB", other="mA", w="A")
        found[f"in the formula of vA', {of_a}"] = changed_speeds(wrong, newton)
        found[f"in the formula of vB', {of_b}"] = changed_speeds(newton, wrong)
        found[f"in the formulas of vA' and vB', {of_a}"] = changed_speeds(wrong, wrong)
    return found
