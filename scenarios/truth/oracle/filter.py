"""Lower bounds in float64 on the times of the next contacts of a disk, so that only few contacts
are computed in many digits.

Every bound is lowered by far more than the rounding of float64, so no contact is missed; a bound
that is too low costs only time. A row of a table (b, 7) is a leg: x, y, vx, vy, ax, ay, t. Bodies
that are asleep are left out.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from crosscheck2d.scenarios.model import Array

Codes = NDArray[np.int64]

SLACK = 1e-9  # relative, of a distance or a time
BLUR = 1e-12  # relative, of the terms of a sum: float64 rounds about ten times by 1e-16 of them
HALVINGS = 60
kernel = njit(cache=True, error_model="numpy")  # plain Python with NUMBA_DISABLE_JIT=1
X, Y, VX, VY, AX, AY, T = range(7)

Row = tuple[float, float, float, float, float, float]
Quartic = tuple[float, float, float, float, float]


@kernel
def moved(row: Array, now: float) -> Row:
    s = now - row[T]
    x = row[X] + (row[VX] + row[AX] * s / 2) * s
    y = row[Y] + (row[VY] + row[AY] * s / 2) * s
    return x, y, row[VX] + row[AX] * s, row[VY] + row[AY] * s, row[AX], row[AY]


@kernel
def soonest(
    table: Array,
    radius: Array,
    asleep: Array,
    walls: Array,
    i: int,
    now: float,
    left: float,
    bounds: Array,
    codes: Codes,
) -> int:
    """Write the possible contacts of disk i within `left` s of `now` into `bounds` (s, lower
    bounds) and `codes`, soonest first; returns their number.

    The code of a body is its index; that of a wall is len(table) + twice its index, plus 1 for its
    right side (side -1).
    """
    one, count = moved(table[i], now), 0
    for j in range(len(table)):
        if j != i and not asleep[j]:
            count = insert(
                pair_bound(one, moved(table[j], now), radius[i] + radius[j], left),
                j,
                left,
                bounds,
                codes,
                count,
            )
    for w in range(len(walls)):
        for right in range(2):
            bound = wall_bound(one, walls[w], radius[i], 1.0 - 2.0 * right)
            count = insert(bound, len(table) + 2 * w + right, left, bounds, codes, count)
    return count


@kernel
def insert(bound: float, code: int, left: float, bounds: Array, codes: Codes, count: int) -> int:
    if not bound <= left * (1 + SLACK) + BLUR:
        return count
    k = count
    while k > 0 and bounds[k - 1] > bound:
        bounds[k], codes[k] = bounds[k - 1], codes[k - 1]
        k -= 1
    bounds[k], codes[k] = bound, code
    return count + 1


@kernel
def pair_bound(one: Row, other: Row, reach: float, left: float) -> float:
    """A lower bound, s, on the time until the centres of two bodies are `reach` m apart; inf: not
    within `left` s."""
    dx, dy, du, dv = other[X] - one[X], other[Y] - one[Y], other[VX] - one[VX], other[VY] - one[VY]
    ax, ay = other[AX] - one[AX], other[AY] - one[AY]
    far = max(max(abs(one[X]), abs(one[Y])), max(abs(other[X]), abs(other[Y])))
    distance, speed2 = sqrt(dx * dx + dy * dy), du * du + dv * dv
    speed, blur = sqrt(speed2), SLACK * reach + BLUR * (far + distance)
    gap, closing = (distance - reach) * (distance + reach), dx * du + dy * dv
    if ax != 0.0 or ay != 0.0:
        f = (
            gap,
            2 * closing,
            speed2 + dx * ax + dy * ay,
            du * ax + dv * ay,
            (ax * ax + ay * ay) / 4,
        )
        return first_fall(f, left * (1 + 1e-6), BLUR * far * (distance + reach))[0]
    # c / (-b + sqrt(b^2 - a2 c)), each term changed by its rounding error so that the time is too
    # early.
    closing -= blur * speed
    under = closing * closing - speed2 * max(gap, 0.0)
    if closing >= 0.0 or under < -8 * blur * (distance + reach) * speed2:
        return inf
    time = max(gap - 3 * blur * distance, 0.0) / (
        sqrt(max(under, 0.0) + blur * distance * speed2) - closing
    )
    return time * (1 - SLACK)


@kernel
def first_fall(f: Quartic, end: float, blur: float) -> tuple[float, float]:
    """A bracket of the first time up to `end` at which f[0] + ... + f[4] t^4 falls through 0; (inf,
    inf): it does not.

    (t, 0): float64 cannot decide what happens after t. blur: the error of f[0]. On each interval
    the Taylor series bounds f from below, or its slope from above, with margins far above the
    rounding.
    """
    a, h = 0.0, end
    for _ in range(20 * HALVINGS):
        if a >= end:
            return inf, inf
        h = min(h, end - a)
        b = a + h
        q = taylor(f, a)
        size = abs(f[0]) + b * (abs(f[1]) + b * (abs(f[2]) + b * (abs(f[3]) + b * abs(f[4]))))
        margin = BLUR * size + blur
        lowest = h * min(0.0, q[1] + h * min(0.0, q[2] + h * min(0.0, q[3] + h * min(0.0, q[4]))))
        if q[0] + lowest > margin:
            a, h = b, 2 * h
            continue
        steepest = q[1] + h * max(0.0, 2 * q[2] + h * max(0.0, 3 * q[3] + h * max(0.0, 4 * q[4])))
        if steepest * h < -margin and taylor(f, b)[0] < -margin:
            return narrowed(f, a, b, margin)
        h /= 2
        if h <= end * 2.0**-HALVINGS or b <= a:
            break
    return a, 0.0


@kernel
def taylor(f: Quartic, t: float) -> Quartic:
    q4 = f[4]
    q3 = f[3] + 4 * t * q4
    q2 = f[2] + t * (3 * f[3] + 6 * t * q4)
    q1 = f[1] + t * (2 * f[2] + t * (3 * f[3] + 4 * t * q4))
    return f[0] + t * (f[1] + t * (f[2] + t * (f[3] + t * q4))), q1, q2, q3, q4


@kernel
def narrowed(f: Quartic, low: float, high: float, margin: float) -> tuple[float, float]:
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        value = taylor(f, middle)[0]
        if value > margin:
            low = middle
        elif value < -margin:
            high = middle
        else:
            break
    return low, high


@kernel
def wall_bound(one: Row, wall: Array, radius: float, side: float) -> float:
    """A lower bound, s, on the time until a disk touches one side of the line of a wall; inf:
    never."""
    px, py, tx, ty = wall[0, 0], wall[0, 1], wall[1, 0] - wall[0, 0], wall[1, 1] - wall[0, 1]
    length = sqrt(tx * tx + ty * ty)
    nx, ny = -side * ty / length, side * tx / length
    far = max(max(abs(px), abs(py)), max(abs(one[X]), abs(one[Y]))) + length
    blur = BLUR * far
    gap = nx * (one[X] - px) + ny * (one[Y] - py) - radius
    speed = nx * one[VX] + ny * one[VY] - BLUR * (abs(one[VX]) + abs(one[VY]))
    acceleration = nx * one[AX] + ny * one[AY] - BLUR * (abs(one[AX]) + abs(one[AY]))
    if gap < -blur:
        # A disk behind the line must come back before it can cross it.
        falls_back = acceleration < 0 and speed + 2 * BLUR * (abs(one[VX]) + abs(one[VY])) > 0
        return 0.0 if falls_back else inf
    gap = max(gap - blur, 0.0)
    if acceleration >= 0.0:
        under = speed * speed - 2 * acceleration * gap * (1 - SLACK)
        return inf if speed >= 0.0 or under < 0.0 else 2 * gap / (sqrt(under) - speed) * (1 - SLACK)
    root = sqrt(speed * speed - 2 * acceleration * gap)
    late: float = 2 * gap / (root - speed) if speed < 0.0 else (speed + root) / -acceleration
    return late * (1 - SLACK)


@kernel
def touching(
    table: Array, radius: Array, asleep: Array, walls: Array, i: int, now: float, codes: Codes
) -> int:
    """Write the contacts of disk i that may have no gap at `now` s into `codes`, see `soonest`;
    returns their number."""
    one, count = moved(table[i], now), 0
    far = max(abs(one[X]), abs(one[Y])) + radius[i]
    for j in range(len(table)):
        other = moved(table[j], now)
        dx, dy, reach = other[X] - one[X], other[Y] - one[Y], radius[i] + radius[j]
        if j != i and not asleep[j] and sqrt(dx * dx + dy * dy) <= reach + SLACK * (reach + far):
            codes[count] = j
            count += 1
    for w in range(len(walls)):
        tx, ty = walls[w, 1, 0] - walls[w, 0, 0], walls[w, 1, 1] - walls[w, 0, 1]
        length = sqrt(tx * tx + ty * ty)
        height = (tx * (one[Y] - walls[w, 0, 1]) - ty * (one[X] - walls[w, 0, 0])) / length
        foot = (tx * (one[X] - walls[w, 0, 0]) + ty * (one[Y] - walls[w, 0, 1])) / length
        slack = SLACK * (far + length)
        if abs(height) <= radius[i] + slack and -slack <= foot <= length + slack:
            codes[count] = len(table) + 2 * w + (1 if height < 0 else 0)
            count += 1
    return count
