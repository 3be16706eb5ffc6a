"""The flight of a disk under a constant thrust that turns with it: power series in any numbers.

The thrust is f exp(i phi), phi = angle + spin t + rate t^2 / 2. As y = exp(i phi) has
y' = i (spin + rate t) y, its series has c_(n+1) = i (spin c_n + rate c_(n-1)) / (n + 1).
On pieces of length h with |spin| h and |rate| h^2 below 1, |c_n| h^n decreases as 2^n / n!.
"""

from __future__ import annotations

from math import ceil, lgamma, log
from typing import Any

Value = Any
"""A `Number`, or an array of float64."""
Pair = tuple[Value, Value]
"""Real and imaginary part."""


def count_terms(bits: int) -> int:
    """The terms after which the rest of a series is below 2^-bits."""
    return next(n for n in range(8, 9 * bits) if lgamma(n) > (n + bits) * log(2))


def count_pieces(spin: float, rate: float, s: float) -> int:
    """The pieces of s seconds in each of which the direction turns by at most 1 rad."""
    return ceil(abs(spin) * s + abs(rate) * s * s) + 1


def integrals(
    way: Pair, spin: Value, rate: Value, s: Value, pieces: int, terms: int
) -> tuple[Pair, Pair, Pair]:
    """exp(i phi) after s seconds, its integral, and the integral of that; way: exp(i angle)."""
    h, zero = s / pieces, s - s
    speed, place = (zero, zero), (zero, zero)
    for _ in range(pieces):
        before, now, power = (zero, zero), way, zero + 1
        place = place[0] + speed[0] * h, place[1] + speed[1] * h
        way = (zero, zero)
        for n in range(terms):
            term = now[0] * power, now[1] * power
            way = way[0] + term[0], way[1] + term[1]
            term = term[0] * h / (n + 1), term[1] * h / (n + 1)
            speed = speed[0] + term[0], speed[1] + term[1]
            place = place[0] + term[0] * h / (n + 2), place[1] + term[1] * h / (n + 2)
            ahead = [(spin * now[k] + rate * before[k]) / (n + 1) for k in (0, 1)]
            before, now, power = now, (-ahead[1], ahead[0]), power * h
        spin = spin + rate * h
    return way, speed, place


def push(
    force: Pair, angle: float, spin: Value, rate: Value, s: Value, pieces: int, bits: int
) -> tuple[Pair, Pair]:
    """The displacement (x, y) m and the gain of velocity (x, y) m/s after s seconds of a thrust.

    force: m/s2 in the axes of the disk. angle, spin, rate: of the disk at the start of the thrust.
    """
    terms, zero, (fx, fy) = count_terms(bits), s - s, force
    turns = count_pieces(float(angle), 0.0, 1.0)
    start = integrals((zero + 1, zero), angle, zero, zero + 1, turns, terms)[0]
    _, (vx, vy), (x, y) = integrals(start, spin, rate, s, pieces, terms)
    return (fx * x - fy * y, fx * y + fy * x), (fx * vx - fy * vy, fx * vy + fy * vx)
