"""When two bodies touch next: roots of polynomials in t, in any numbers, without cancellation."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from crosscheck2d.scenarios.truth.oracle.filter import first_fall
from crosscheck2d.scenarios.truth.oracle.numbers import Number, Numbers, Undecided

EPS = 2.0**-52
# halvings of a bracket before Newton's method: enough to separate a simple root from others
HALVINGS = 12


class Pressed(ArithmeticError):
    """Two bodies touch without approach and accelerate towards each other: a lasting contact, not a
    collision."""


def meeting(k: Numbers, c: Number, b: Number, a2: Number) -> Number | None:
    """s until two bodies of equal acceleration touch, or None.

    c = dr.dr - R^2 m2, b = dr.dv m2/s, a2 = dv.dv m2/s2: the first root of c + 2 b t + a2 t^2 as
    c / (-b + sqrt(b^2 - a2 c)), where (-b - sqrt) / a2 would cancel (Press et al., Numerical
    Recipes, 5.6).
    """
    if k.sign(b) >= 0:
        return None
    if k.sign(c) <= 0:
        return k.exact(0.0)
    under = b * b - a2 * c
    if under <= 0:
        return None
    k.sign(under)  # raises `Undecided` for a ball that does not prove that the two meet
    return c / (k.sqrt(under) - b)


def crossing(k: Numbers, s: Number, v: Number, a: Number) -> Number | None:
    """s until s + v t + a t^2 / 2 (m, m/s, m/s2) next falls through 0, or None.

    For s < 0 the point is behind the line, and must come back before it can cross it. Raises
    `Pressed`.
    """
    side, going, curving = k.sign(s), k.sign(v), k.sign(a)
    if side == 0 and going < 0:
        return k.exact(0.0)
    if side == 0 and going == 0 and curving < 0:
        raise Pressed
    if curving < 0:
        under = v * v - 2 * a * s
        if side < 0 and (going <= 0 or k.sign(under) <= 0):
            return None
        root = k.sqrt(under) if side else abs(v)
        return 2 * s / (root - v) if going < 0 else (v + root) / -a
    if side <= 0 or going >= 0:
        return None
    if curving == 0:
        return s / -v
    under = v * v - 2 * a * s
    return 2 * s / (k.sqrt(under) - v) if k.sign(under) > 0 else None


def falling_meeting(k: Numbers, gap: Sequence[Number], limit: float) -> Number | None:
    """s until the gap c0 + c1 t + ... + c4 t^4 (m2) of two bodies that accelerate differently
    closes, or None.

    Only up to `limit` s. A bracket is found in float64, with margins far above its rounding, and
    the time in many digits. Raises `Pressed`, and `Undecided` for balls where float64 finds no
    bracket (a grazing contact).
    """
    touching = k.sign(gap[0]) <= 0
    approach = k.sign(gap[1] / 2) if touching else 0
    if touching and approach < 0:
        return k.exact(0.0)
    if touching:
        # The root at 0 is the present contact: divide it out. The rest must begin positive.
        gap = gap[1:] if approach else gap[2:]
        if k.sign(gap[0]) < 0:
            raise Pressed
    rough = [float(x) for x in gap] + [0.0] * (5 - len(gap))
    low, high = first_fall((rough[0], rough[1], rough[2], rough[3], rough[4]), limit, 0.0)
    # The margins do not cover coefficients with a larger error than this.
    vague = any(k.spread(x) * max(1.0, limit) ** 4 > EPS * rough[0] for x in gap)
    if low == inf and not vague:
        return None
    if high and not vague:
        return sharpened(k, gap, low, high)
    if k.proves:
        raise Undecided
    roots = first_changes(k, gap, k.exact(0.0), k.exact(limit))
    return next((t for t in roots if _value(_slope(gap), t) <= 0), None)


def sharpened(k: Numbers, p: Sequence[Number], low: float, high: float) -> Number:
    """The one root of sum p[i] t^i between two times, where the sum decreases, by Newton's method.

    For balls the interval Newton method (Moore, Kearfott & Cloud, Introduction to Interval
    Analysis, 2009, 8.1): the root lies in m - p(m) / p'(T) if it lies in T and m is T's middle.
    """
    slope, t = _slope(p), k.between(low, high)
    for _ in range(HALVINGS + k.bits.bit_length()):
        steep = _value(slope, t)
        if k.proves and not steep < 0:
            raise Undecided
        middle = t.mid() if k.proves else t
        improved = middle - _value(p, middle) / steep
        done = (
            not k.spread(improved) < k.spread(t) / 2
            if k.proves
            else abs(improved - t) * 1024 < k.tie
        )
        t = improved
        # Newton doubles the right digits: after a step of less than half of them all are right.
        if done:
            break
    return t


def first_changes(k: Numbers, p: Sequence[Number], low: Number, high: Number) -> list[Number]:
    """The roots of sum p[i] t^i between `low` and `high` at which it changes sign, in order.

    Between two roots of its derivative a polynomial is monotone: one root at most in each piece,
    found by bisection and Newton steps that stay inside the bracket.
    """
    if len(p) < 2:
        return []
    ends = [low, *first_changes(k, _slope(p), low, high), high]
    values = [_value(p, t) for t in ends]
    return [
        _root(k, p, ends[i], ends[i + 1], values[i] < 0)
        for i in range(len(ends) - 1)
        if values[i] * values[i + 1] < 0
    ]


def _root(k: Numbers, p: Sequence[Number], low: Number, high: Number, rises: bool) -> Number:
    slope, t = _slope(p), (low + high) / 2
    for step in range(HALVINGS + 4 * k.bits):
        value = _value(p, t)
        if value == 0:
            return t
        low, high = (t, high) if (value < 0) == rises else (low, t)
        steep = _value(slope, t)
        improved = t - value / steep if steep and step >= HALVINGS else low
        improved = improved if low < improved < high else (low + high) / 2
        # Newton doubles the right digits: after a step of less than half of them all are right.
        if abs(improved - t) * 1024 < k.tie:
            return improved
        t = improved
    return t


def _value(p: Sequence[Number], t: Number) -> Number:
    value = p[-1]
    for coefficient in p[-2::-1]:
        value = value * t + coefficient
    return value


def _slope(p: Sequence[Number]) -> list[Number]:
    return [i * p[i] for i in range(1, len(p))]
