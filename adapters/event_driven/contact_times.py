"""First contact times of disks, points and lines on parabolas.

Compiled by numba; with NUMBA_DISABLE_JIT=1 the same source runs as plain Python. Times are s from
now, inf: never. A gap is positive before a contact. A gap that rounding has made slightly negative
counts as a contact.
"""

from __future__ import annotations

from math import inf, sqrt

from crosscheck2d.adapters.event_driven.compiled import kernel

Quartic = tuple[float, float, float, float, float]


@kernel
def line_time(gap: float, speed: float, acceleration: float) -> float:
    """First t >= 0 at which gap + speed t + acceleration t2 / 2 falls through 0, without
    cancellation.

    A gap that is below 0 and rises must come down again first; if it never gets above 0, the time
    is that of its maximum.
    """
    if gap <= 0.0 and (speed < 0.0 or (speed == 0.0 and acceleration < 0.0)):
        return 0.0
    if acceleration == 0.0:
        return gap / -speed if speed < 0.0 else inf
    disc = speed * speed - 2.0 * acceleration * gap
    if acceleration < 0.0:
        root = sqrt(max(disc, 0.0))
        return 2.0 * gap / (root - speed) if speed < 0.0 else (speed + root) / -acceleration
    return 2.0 * gap / (sqrt(disc) - speed) if speed < 0.0 and gap > 0.0 and disc > 0.0 else inf


@kernel
def disk_time(gap: float, closing: float, speed2: float) -> float:
    """Contact of two disks with equal accelerations: gap = dr.dr - R2, closing = dr.dv, speed2 =
    dv.dv.

    t = c / (-b + sqrt(b2 - a c)), which avoids cancellation (Alder & Wainwright, J. Chem. Phys. 31,
    459, 1959).
    """
    disc = closing * closing - speed2 * gap
    if closing >= 0.0 or disc <= 0.0:
        return inf
    return gap / (sqrt(disc) - closing) if gap > 0.0 else 0.0


@kernel
def curved_time(
    dx: float,
    dy: float,
    ux: float,
    uy: float,
    ax: float,
    ay: float,
    gap: float,
    closing: float,
    until: float,
) -> float:
    """Contact of two disks with different accelerations up to `until` s: the first down-crossing of
    a quartic.

    d, u, a: position, velocity and acceleration of one relative to the other; a != 0.
    """
    if gap <= 0.0 and closing < 0.0:
        return 0.0
    f = (
        gap,
        2.0 * closing,
        ux * ux + uy * uy + dx * ax + dy * ay,
        ux * ax + uy * ay,
        (ax * ax + ay * ay) / 4,
    )
    # All roots lie below 1 + the largest ratio of a coefficient to the leading one (Cauchy).
    end = min(until, 1.0 + max(abs(f[0]), abs(f[1]), abs(f[2]), abs(f[3])) / f[4])
    turns = turning_points(f, end)
    for k in range(4):
        high, low = value(f, turns[k]), value(f, turns[k + 1])
        if high > 0.0 and low <= 0.0:
            return root(f, turns[k], turns[k + 1])
        # An overlap by rounding that begins to close again is a contact.
        if gap <= 0.0 and high <= 0.0 and low < high:
            return turns[k]
    return inf


@kernel
def turning_points(f: Quartic, end: float) -> Quartic:
    """The extrema of f between 0 and `end`, with 0 and `end` themselves.

    The root of the third derivative splits the range into intervals on which the second is
    monotone; the roots of the second split it for the first. An interval without a root gives its
    end instead.
    """
    first = (f[1], 2 * f[2], 3 * f[3], 4 * f[4], 0.0)
    second = (first[1], 2 * first[2], 3 * first[3], 0.0, 0.0)
    third = (second[1], 2 * second[2], 0.0, 0.0, 0.0)
    middle = root(third, 0.0, end)
    a, b = root(second, 0.0, middle), root(second, middle, end)
    return 0.0, root(first, 0.0, a), root(first, a, b), root(first, b, end), end


@kernel
def value(f: Quartic, t: float) -> float:
    """f[0] + f[1] t + ... + f[4] t4 (Horner)."""
    return (((f[4] * t + f[3]) * t + f[2]) * t + f[1]) * t + f[0]


@kernel
def root(f: Quartic, low: float, high: float) -> float:
    """The root of a polynomial that is monotone from low to high, or high if there is none:
    Newton's method, with bisection where that would leave the bracket."""
    rising = value(f, high) > 0.0
    if rising == (value(f, low) > 0.0):
        return high
    t = (low + high) / 2
    for _ in range(200):
        slope = ((4 * f[4] * t + 3 * f[3]) * t + 2 * f[2]) * t + f[1]
        here = value(f, t)
        if (here > 0.0) == rising:
            high = t
        else:
            low = t
        following = t - here / slope if slope != 0.0 else low
        if following != t and not low < following < high:
            following = (low + high) / 2
        if following in (t, low, high):
            break
        t = following
    return t
