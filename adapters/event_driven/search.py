"""The searches of the event engine: the next event of a disk on its own, its next contact with
another disk; and the times of contact of disks, points and lines on parabolas.

Times are s from now, inf: never. A gap is positive before a contact. A gap that rounding has made
slightly negative counts as a contact.

The search among disks avoids branches that the processor cannot predict: it copies all candidates
of the neighbouring cells into one list, and computes a contact time for each, whether they meet or
not.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Any

import numpy as np

from crosscheck2d.adapters.event_driven.compiled import inlined, inlined_early, kernel
from crosscheck2d.adapters.event_driven.disks import (
    EDGE,
    END,
    NONE,
    WALL,
    WRAP,
    Arena,
    Disks,
    Grid,
    Links,
    Scenery,
    Walls,
)

# relative; the error of squared gap and closing speed of a contact just resolved: a few roundings
ROUNDING = 1e-14
# which of the cells around a disk to search: all, or only those beyond the edge it has just crossed
ALL = -1

Pair = tuple[float, float]
Quartic = tuple[float, float, float, float, float]


@inlined
def next_edge(g: Grid, a: Any) -> tuple[float, int]:
    """When a disk on a straight line leaves its cell, s from its own time, and over which edge."""
    right, top = a.vx > 0.0, a.vy > 0.0
    x = inf if a.vx == 0.0 else max((a.ox + (a.cx + right) * g.side[0] - a.x) / a.vx, 0.0)
    y = inf if a.vy == 0.0 else max((a.oy + (a.cy + top) * g.side[1] - a.y) / a.vy, 0.0)
    return min(x, y), (int(right) if x < y else 2 + int(top))


@kernel
def next_own(g: Grid, walls: Walls, wrapped: bool, a: Any) -> tuple[float, int]:
    """As `next_edge`, on a parabola: also the wrap box, the walls near its cell, and the end of the
    wall it rests on."""
    best, code = inf, EDGE
    for axis in range(2):
        x, v, acceleration = (a.x, a.vx, a.ax) if axis == 0 else (a.y, a.vy, a.ay)
        low = a.ox + a.cx * g.side[0] if axis == 0 else a.oy + a.cy * g.side[1]
        for high in range(2):
            sign = 1.0 - 2.0 * high
            t = line_time(sign * (x - low - high * g.side[axis]), sign * v, sign * acceleration)
            if t < best:
                best, code = t, EDGE + 2 * axis + high
            if wrapped:
                t = line_time(sign * (x - walls.wrap[high, axis]), sign * v, sign * acceleration)
                if t < best:
                    best, code = t, WRAP + 2 * axis + high
    c = a.cx * g.shape[1] + a.cy
    rests = walls.surface[a.wall] if a.wall >= 0 else -1
    slid_off = walls.surface[-2 - a.wall] if a.wall < -1 else -1
    for k in range(walls.first[c], walls.first[c + 1]):
        w = walls.of[k]
        for part in range(3):
            # A disk does not meet the surface it rests on, nor the face of the one it slid off.
            surface = walls.surface[w]
            t = (
                inf
                if surface == rests or (surface == slid_off and part == 0)
                else wall_time(walls, a, w, part, best)
            )
            if t < best:
                best, code = t, WALL + 3 * w + part
    if a.wall >= 0:
        t = end_time(walls, a)
        if t < best:
            best, code = t, END
    return best, code


@kernel
def wall_time(walls: Walls, a: Any, w: int, part: int, until: float) -> float:
    """When a disk meets a wall: part 0 is either face, 1 its start, 2 its end."""
    ux, uy, length = walls.segment[w, 2], walls.segment[w, 3], walls.segment[w, 4]
    dx, dy = a.x - walls.segment[w, 0], a.y - walls.segment[w, 1]
    noise = a.noise if a.last == -1 - w else 0.0
    height, speed, acceleration = dy * ux - dx * uy, a.vy * ux - a.vx * uy, a.ay * ux - a.ax * uy
    rounding = ROUNDING * (abs(dx) + abs(dy) + a.radius)
    if part > 0:
        # After a collision at e = 0 it moves along the face, and so past the ends.
        if abs(speed) < noise and abs(abs(height) - a.radius) < rounding:
            return inf
        if part == 2:
            dx, dy = dx - length * ux, dy - length * uy
        return meeting((dx, dy), (a.vx, a.vy), (a.ax, a.ay), a.radius, noise, until)
    first = inf
    for side in (1.0, -1.0):
        gap, v, p = side * height - a.radius, side * speed, side * acceleration
        if noise > 0.0 and side * height > 0.0:
            # beyond the end of the wall it may be far below its line
            if abs(gap) < rounding:
                gap = 0.0
            if abs(v) < noise:
                v = 0.0
        t = line_time(gap, v, p)
        along = (
            (dx + (a.vx + a.ax * t / 2) * t) * ux + (dy + (a.vy + a.ay * t / 2) * t) * uy
            if t < first
            else -1.0
        )
        # At the contact the foot of the disk must lie on the wall, and the disk on this side of it.
        if 0.0 <= along <= length and side * height + (v + p * t / 2) * t > 0.0:
            first = t
    return first


@kernel
def end_time(walls: Walls, a: Any) -> float:
    ux, uy = walls.segment[a.wall, 2], walls.segment[a.wall, 3]
    along = (a.x - walls.segment[a.wall, 0]) * ux + (a.y - walls.segment[a.wall, 1]) * uy
    speed, acceleration = a.vx * ux + a.vy * uy, a.ax * ux + a.ay * uy
    return min(
        line_time(along, speed, acceleration),
        line_time(walls.segment[a.wall, 4] - along, -speed, -acceleration),
    )


@kernel
def meeting(d: Pair, u: Pair, a: Pair, reach: float, noise: float, until: float) -> float:
    """When two disks meet, from position, velocity and acceleration of one relative to the other.

    noise: the rounding error of their closing speed if they have just collided, else 0.
    """
    (dx, dy), (ux, uy) = d, u
    gap, closing, speed2 = dx * dx + dy * dy - reach * reach, dx * ux + dy * uy, ux * ux + uy * uy
    if noise > 0.0:
        if abs(gap) < ROUNDING * reach * reach:
            gap = min(gap, 0.0)
        if abs(closing) < reach * noise:
            closing = 0.0
    if a[0] == 0.0 and a[1] == 0.0:
        return disk_time(gap, closing, speed2)
    return curved_time(d, u, a, gap, closing, until)


@inlined
def append_three(head: Links, near: Links, m: int, first: int, second: int, third: int) -> int:
    near[m] = head[first]
    m += near[m] != NONE
    near[m] = head[second]
    m += near[m] != NONE
    near[m] = head[third]
    return m + (near[m] != NONE)


@inlined
def neighbours(disks: Disks, head: Links, near: Links, g: Grid, a: Any, beyond: int) -> int:
    """List the disks of the cells around that of disk `a`, or only of the three beyond an edge;
    returns their number."""
    here, row, ny = a.cy, a.cx * g.shape[1], g.shape[1]
    left = row - ny if a.cx > 0 else row + (g.shape[0] - 1) * ny
    right = row + ny if a.cx < g.shape[0] - 1 else 0
    bottom = here - 1 if here > 0 else ny - 1
    top = here + 1 if here < ny - 1 else 0
    if beyond == ALL:
        m = append_three(head, near, 0, left + bottom, left + here, left + top)
        m = append_three(head, near, m, row + bottom, row + here, row + top)
        m = append_three(head, near, m, right + bottom, right + here, right + top)
    elif beyond < 2:
        row = right if beyond == 1 else left
        m = append_three(head, near, 0, row + bottom, row + here, row + top)
    else:
        here = top if beyond == 3 else bottom
        m = append_three(head, near, 0, left + here, row + here, right + here)
    k = 0
    while k < m:  # each may begin a chain; its next disk goes to the end of the list
        near[m] = disks[near[k]].next
        m += near[m] != NONE
        k += 1
    return m


@inlined
def image(apart: int, shift: float) -> float:
    """m to add to a coordinate difference in a torus, so that it is that to the image in a
    neighbouring cell."""
    return -shift if apart > 1 else (shift if apart < -1 else 0.0)


@inlined_early
def find_pair(arena: Arena, scenery: Scenery, i: int, beyond: int) -> None:
    disks, near, g = arena.disks, arena.near, arena.grid
    a = disks[i]
    x, y, vx, vy, now, radius, cx, cy = a.x, a.y, a.vx, a.vy, a.t, a.radius, a.cx, a.cy
    last, noise = np.int64(a.last), a.noise
    best, who = a.pair_time - now, np.int64(-1)
    for k in range(neighbours(disks, arena.head, near, g, a, beyond)):
        j = near[k]
        b = disks[j]
        t = now - b.t
        dx, dy = b.x - x + image(b.cx - cx, g.shift[0]), b.y - y + image(b.cy - cy, g.shift[1])
        ux, uy = b.vx, b.vy
        if len(scenery):
            dx, dy = dx + (ux + b.ax * t / 2) * t, dy + (uy + b.ay * t / 2) * t
            ux, uy = ux + b.ax * t - vx, uy + b.ay * t - vy
        else:
            dx, dy = dx + ux * t, dy + uy * t
            ux, uy = ux - vx, uy - vy
        reach = radius + b.radius
        if len(scenery) and arena.rules.mixed and (b.ax != a.ax or b.ay != a.ay):
            noise_of_pair = noise if last == j and b.last == i else 0.0
            curve, until = (b.ax - a.ax, b.ay - a.ay), min(best, a.own_time - now)
            t = meeting((dx, dy), (ux, uy), curve, reach, noise_of_pair, until)
            if t < best:
                best, who = t, np.int64(j)
        else:
            gap, closing = dx * dx + dy * dy - reach * reach, dx * ux + dy * uy
            disc = closing * closing - (ux * ux + uy * uy) * gap
            t = max(gap, 0.0) / (sqrt(max(disc, 0.0)) - closing)
            # Rounding may leave a small closing speed after a collision just resolved.
            if (closing < (-reach * noise if last == j else 0.0)) & (disc > 0.0) & (t < best):
                best, who = t, np.int64(j)
    if who >= 0:
        a.pair_time, a.partner, a.partner_count = now + best, who, disks[who].count


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
def curved_time(d: Pair, u: Pair, a: Pair, gap: float, closing: float, until: float) -> float:
    """Contact of two disks with different accelerations up to `until` s: the first down-crossing of
    a quartic.

    d, u, a: position, velocity and acceleration of one relative to the other; a != 0.
    """
    (dx, dy), (ux, uy), (ax, ay) = d, u, a
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
