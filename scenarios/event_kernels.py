"""The event engine's kernels: one next-event record a disk, a cell grid, a winner tree, a clock of each disk's own.

A record holds the earliest contact of its disk with another one, as of when it was last looked for, and the earliest
event of the disk by itself: a wall, an edge of its cell or of the wrap box. A contact is void if the other disk has
been hit since (its `count` moved on); it is looked for again when its time comes, and is early rather than late until
then. Every pair is covered by the record made last of its two (Lubachevsky, J. Comput. Phys. 94, 255, 1991).
Compiled by numba; with NUMBA_DISABLE_JIT=1 the same source runs as plain Python.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scenarios.compiled import inlined, kernel
from scenarios.contact_times import curved_time, disk_time, line_time
from scenarios.model import Array

Ints = NDArray[np.int64]
# Columns of a disk's row: its state at its own time T, 1 / mass, the times of its record, since when hits are counted,
# its acceleration, where cell (0, 0) of its lap of the grid lies (the grid of an open scene repeats for ever), and the
# closing speed that rounding may have left of its last hit.
X, Y, VX, VY, T, RADIUS, WEIGHT, PAIR_TIME, OWN_TIME, MARK_TIME, AX, AY, OX, OY, NOISE = range(15)
# Of its tag: the disk before it in the chain of its cell, hits and changes of pull so far, what it hit last
# (a disk, or -1 - wall), its cell, the other disk of its record and that disk's COUNT, what it does by itself.
BEFORE, COUNT, LAST, CX, CY, PARTNER, PARTNER_COUNT, OWN_CODE, MARK_HITS = range(9)
DONE, LOG_FULL, ACCUMULATION, REENTRY = range(4)
NOBODY = -(2**62)
EDGE, WRAP, WALL = 0, 4, 8  # what a disk does by itself: + side (left, right, bottom, top), or + 3 wall + part
HITS, ULPS = 64, 1000.0  # so many hits of one disk within so many units in the last place of the time: accumulation
ROUNDING = 1e-14  # relative, of a contact just resolved: squared gap and closing speed are sums of a few roundings
EPOCH = 256.0  # s; the clock starts again after as many, so that its last place stays small


class Disks(NamedTuple):
    """One row a disk in two tables, columns as above, and the queue of their next events."""

    row: Array  # (n, 16) floats
    tag: Ints  # (n, 9) integers
    next: Ints  # (n,) the next disk in the chain of a cell, -1 ends
    key: Array  # (p,) the earlier of PAIR_TIME and OWN_TIME
    tree: NDArray[np.int32]  # (2 p,)


class Grid(NamedTuple):
    """Cells at least as wide as the largest disk; in a torus leaving the grid shifts the disk, else its origin."""

    side: tuple[float, float]  # m
    shape: tuple[int, int]  # at least 3
    span: tuple[float, float]  # m
    torus: bool
    head: Ints  # (cells,) first disk
    wall_first: Ints  # (cells + 1,) where a cell's walls begin in wall_of
    wall_of: Ints


class Rules(NamedTuple):
    """What all disks obey. falling: something is pulled; mixed: not everything alike."""

    restitution: float
    falling: bool
    mixed: bool
    wrapped: bool
    wrap: Array  # (2, 2) m
    walls: Array  # (w, 5) start m, direction, length m


@kernel
def fly(d: Disks, i: int, now: float, falling: bool) -> None:
    """Bring disk `i` to `now` on its parabola."""
    row = d.row[i]
    t = now - row[T]
    if falling:
        row[X] += (row[VX] + d.row[i, AX] * t / 2) * t
        row[Y] += (row[VY] + d.row[i, AY] * t / 2) * t
        row[VX] += d.row[i, AX] * t
        row[VY] += d.row[i, AY] * t
    else:
        row[X] += row[VX] * t
        row[Y] += row[VY] * t
    row[T] = now


@kernel
def link(d: Disks, g: Grid, i: int) -> None:
    """Put disk `i` at the head of its cell's chain."""
    c = d.tag[i, CX] * g.shape[1] + d.tag[i, CY]
    first = g.head[c]
    d.next[i], d.tag[i, BEFORE] = first, -1
    if first >= 0:
        d.tag[first, BEFORE] = i
    g.head[c] = i


@kernel
def unlink(d: Disks, g: Grid, i: int) -> None:
    """Take disk `i` out of its cell's chain."""
    if d.tag[i, BEFORE] >= 0:
        d.next[d.tag[i, BEFORE]] = d.next[i]
    else:
        g.head[d.tag[i, CX] * g.shape[1] + d.tag[i, CY]] = d.next[i]
    if d.next[i] >= 0:
        d.tag[d.next[i], BEFORE] = d.tag[i, BEFORE]


@kernel
def settle(d: Disks, g: Grid, i: int) -> None:
    """Find the cell and the lap of disk `i` from its position, and link it there."""
    for axis in range(2):
        k = int(np.floor((d.row[i, axis] - d.row[i, OX + axis]) / g.side[axis]))
        if g.torus:
            k = min(max(k, 0), g.shape[axis] - 1)
        laps = k // g.shape[axis]
        d.row[i, OX + axis] += laps * g.span[axis]
        d.tag[i, CX + axis] = k - laps * g.shape[axis]
    link(d, g, i)


@inlined
def find_own(d: Disks, g: Grid, rules: Rules, i: int) -> None:
    """The next thing disk `i` meets by itself: an edge of its cell, of the wrap box, or a wall near its cell."""
    row, best, code = d.row[i], inf, EDGE
    for axis in range(2):
        x, v, a = row[axis], row[VX + axis], row[AX + axis]
        low = row[OX + axis] + d.tag[i, CX + axis] * g.side[axis]
        # Without a pull only the edge ahead can be met.
        for high in range(2) if a != 0.0 else (range(1, 2) if v > 0.0 else range(1)):
            sign = 1.0 - 2.0 * high
            t = line_time(sign * (x - low - high * g.side[axis]), sign * v, sign * a)
            if t < best:
                best, code = t, EDGE + 2 * axis + high
            if rules.wrapped:
                t = line_time(sign * (x - rules.wrap[high, axis]), sign * v, sign * a)
                if t < best:
                    best, code = t, WRAP + 2 * axis + high
    c = d.tag[i, CX] * g.shape[1] + d.tag[i, CY]
    for k in range(g.wall_first[c], g.wall_first[c + 1]):
        for part in range(3):
            t = wall_time(d, rules, i, g.wall_of[k], part, best)
            if t < best:
                best, code = t, WALL + 3 * g.wall_of[k] + part
    d.row[i, OWN_TIME], d.tag[i, OWN_CODE] = row[T] + best, code


@kernel
def wall_time(d: Disks, rules: Rules, i: int, w: int, part: int, until: float) -> float:
    """When disk `i` meets a wall: part 0 is either face, 1 its start, 2 its end."""
    row, ux, uy = d.row[i], rules.walls[w, 2], rules.walls[w, 3]
    dx, dy = row[X] - rules.walls[w, 0], row[Y] - rules.walls[w, 1]
    vx, vy, ax, ay, reach = row[VX], row[VY], d.row[i, AX], d.row[i, AY], row[RADIUS]
    noise = row[NOISE] if d.tag[i, LAST] == -1 - w else 0.0
    if part > 0:
        if part == 2:
            dx, dy = dx - rules.walls[w, 4] * ux, dy - rules.walls[w, 4] * uy
        return meeting(dx, dy, vx, vy, ax, ay, reach, noise, until)
    first = inf
    height, speed, pull = dy * ux - dx * uy, vy * ux - vx * uy, ay * ux - ax * uy
    for side in (1.0, -1.0):
        gap, v, a = side * height - reach, side * speed, side * pull
        if noise > 0.0 and side * height > 0.0:
            if gap < ROUNDING * (abs(dx) + abs(dy) + reach):
                gap = 0.0
            if abs(v) < noise:
                v = 0.0
        t = line_time(gap, v, a)
        along = (dx + (vx + ax * t / 2) * t) * ux + (dy + (vy + ay * t / 2) * t) * uy if t < first else -1.0
        # At the contact the disk must be beside the wall, and on the side from which it was looked for.
        if 0.0 <= along <= rules.walls[w, 4] and side * height + (v + a * t / 2) * t > 0.0:
            first = t
    return first


@kernel
def meeting(
    dx: float, dy: float, ux: float, uy: float, ax: float, ay: float, reach: float, noise: float, until: float
) -> float:
    """When two disks meet, from position, velocity and acceleration of one relative to the other.

    noise: what rounding may have left of their closing speed if these two hit each other last, else 0.
    """
    gap, closing, speed2 = dx * dx + dy * dy - reach * reach, dx * ux + dy * uy, ux * ux + uy * uy
    if noise > 0.0:
        if abs(gap) < ROUNDING * reach * reach:
            gap = min(gap, 0.0)
        if abs(closing) < reach * noise:
            closing = 0.0
    if ax == 0.0 and ay == 0.0:
        return disk_time(gap, closing, speed2)
    return curved_time(dx, dy, ux, uy, ax, ay, gap, closing, until)


@inlined
def find_pair(d: Disks, g: Grid, rules: Rules, i: int, x0: int, x1: int, y0: int, y1: int) -> None:
    """Look for an earlier contact of disk `i`, which is at its own time, in cells x0 .. x1, y0 .. y1 around its own."""
    row = d.row[i]
    x, y, vx, vy, now, radius = row[X], row[Y], row[VX], row[VY], row[T], row[RADIUS]
    best, who = d.row[i, PAIR_TIME] - now, -1
    nx, ny = g.shape[0], g.shape[1]
    for ox in range(x0, x1 + 1):
        cx, shift_x = d.tag[i, CX] + ox, 0.0
        if cx < 0:
            cx, shift_x = cx + nx, -g.span[0]
        elif cx >= nx:
            cx, shift_x = cx - nx, g.span[0]
        for oy in range(y0, y1 + 1):
            cy, shift_y = d.tag[i, CY] + oy, 0.0
            if cy < 0:
                cy, shift_y = cy + ny, -g.span[1]
            elif cy >= ny:
                cy, shift_y = cy - ny, g.span[1]
            j = g.head[cx * ny + cy]
            while j >= 0:
                other = d.row[j]
                t = now - other[T]
                dx, dy = other[X] - x, other[Y] - y
                if g.torus:
                    dx, dy = dx + shift_x, dy + shift_y
                ux, uy, ax, ay = other[VX], other[VY], 0.0, 0.0
                if rules.falling:
                    dx, dy = dx + d.row[j, AX] * t * t / 2, dy + d.row[j, AY] * t * t / 2
                    ax, ay = d.row[j, AX] - d.row[i, AX], d.row[j, AY] - d.row[i, AY]
                dx, dy = dx + ux * t, dy + uy * t
                if rules.falling:
                    ux, uy = ux + d.row[j, AX] * t, uy + d.row[j, AY] * t
                ux, uy = ux - vx, uy - vy
                if rules.mixed and (ax != 0.0 or ay != 0.0):
                    noise = row[NOISE] if d.tag[i, LAST] == j and d.tag[j, LAST] == i else 0.0
                    until = min(best, d.row[i, OWN_TIME] - now)
                    t = meeting(dx, dy, ux, uy, ax, ay, radius + other[RADIUS], noise, until)
                    if t < best:
                        best, who = t, j
                else:
                    closing = dx * ux + dy * uy
                    # Most pairs part; asking here spares them the rest.
                    if closing < 0.0:
                        reach, speed2 = radius + other[RADIUS], ux * ux + uy * uy
                        t = disk_time(dx * dx + dy * dy - reach * reach, closing, speed2)
                        if t < best and not (d.tag[i, LAST] == j and -closing < reach * row[NOISE]):
                            best, who = t, j
                j = d.next[j]
    if who >= 0:
        d.row[i, PAIR_TIME], d.tag[i, PARTNER], d.tag[i, PARTNER_COUNT] = now + best, who, d.tag[who, COUNT]
