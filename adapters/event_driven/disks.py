"""What the event engine keeps: disks with a next-event record each, a cell grid, the rules; and how
disks fly in it.

A record holds the earliest contact of its disk with another one, as of when it was last looked for,
and the earliest event of the disk by itself: a wall, an edge of its cell or of the wrap box. A
contact is void if the other disk has been struck since (its `count` moved on); it is looked for
again when its time comes, and is early rather than late until then. Every pair is covered by the
record made last of its two (Lubachevsky, J. Comput. Phys. 94, 255, 1991).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adapters.event_driven.compiled import inlined
from adapters.event_driven.queue import Tree
from scenarios.model import Array

Ints = NDArray[np.int64]
Links = NDArray[np.uint32]
Disks = NDArray[np.void]  # (n,) of DISK
Runs = NDArray[np.void]  # (n,) of RUN
Spins = NDArray[np.void]  # (n,) of SPIN
# ends a chain; without a sign, so that nobody must ask whether to count from the end
NONE = np.uint32(2**32 - 1)
NOBODY = -(2**31)
DONE, GOES_ON, LOG_FULL, ACCUMULATION, REENTRY, ROUND_END = range(6)  # what the loop says
BASE, STOP = 0, 1  # columns of Arena.clock
LOGGED, WHO, WHOM, LEFT = range(4)  # and of Arena.counters
# by itself: + side (left, right, bottom, top); the wall's end; no more slip; + 3 wall + part
EDGE, WRAP, END, GRIP, WALL = 0, 4, 8, 9, 10

# A disk in three lines of the cache: what a search for contacts reads of others, its record, what
# only some need.
DISK = np.dtype(
    [
        # state at the disk's own time
        ("x", "f8"),
        ("y", "f8"),
        ("vx", "f8"),
        ("vy", "f8"),
        ("t", "f8"),
        ("radius", "f8"),
        ("next", "u4"),  # the next disk in the chain of its cell
        ("cx", "i4"),
        ("cy", "i4"),  # its cell
        ("count", "i4"),  # collisions and changes of acceleration so far
        ("weight", "f8"),  # 1 / mass
        # m/s, what rounding may have left of the closing speed of its last collision
        ("noise", "f8"),
        # when it meets another disk, or something by itself
        ("pair_time", "f8"),
        ("own_time", "f8"),
        ("partner", "u4"),
        ("partner_count", "i4"),  # that disk, and its count when this was found
        ("own_code", "i4"),  # what it meets by itself, as above
        ("last", "i4"),  # what it struck last: a disk, or -1 - wall
        ("before", "u4"),  # the disk before it in its chain
        # collisions since, to notice when they accumulate
        ("mark_collisions", "i4"),
        ("mark_time", "f8"),
        ("ax", "f8"),
        ("ay", "f8"),  # acceleration; lying on a wall, only that along it
        ("free_ax", "f8"),
        ("free_ay", "f8"),  # acceleration of free flight
        # where cell (0, 0) of its lap lies: the grid of an open scene repeats for ever
        ("ox", "f8"),
        ("oy", "f8"),
        ("wall", "i4"),  # the wall it lies on; -1: none; -2 - wall: none since it slid off that one
        ("bounces", "i4"),  # collisions in a row on the face of one wall
        ("corner", "i4"),  # the second wall of the corner in which it lies still; -1: none
        ("", "i4"),
    ]
)

# Of each disk the collisions in a row between which it has not flown, see `event_rest.rattles`.
RUN = np.dtype(
    [
        ("collisions", "i4"),  # those that count
        ("walls", "i4"),  # collisions in a row with walls, whether it has flown between them or not
        ("start", "f8"),  # s, when the first of the run was
        ("acceleration", "f8"),  # m/s2, the largest that acted on those who took part
    ]
)

# How each disk turns, where friction makes that matter.
SPIN = np.dtype(
    [
        ("t", "f8"),  # s, when the next three were so
        ("angle", "f8"),  # rad
        ("spin", "f8"),  # rad/s
        ("rate", "f8"),  # rad/s2
        ("free_rate", "f8"),  # rad/s2, of torques alone
        ("turns", "f8"),  # 1 / inertia
        ("sliding", "i4"),  # the sign of the slip on the wall it lies on; 0: it rolls
    ],
    align=True,
)


class Grid(NamedTuple):
    """Cells at least as wide as the largest disk; in a torus leaving the grid shifts the disk, else
    its origin."""

    side: tuple[float, float]  # m
    shape: tuple[int, int]  # at least 3
    span: tuple[float, float]  # m
    shift: tuple[float, float]  # m, how far an image is from its disk: the span of a torus, or 0
    torus: bool


# () where there are only disks and they fly straight, else (True,). Numba knows how long a tuple is
# when it compiles, so that a gas has a loop of its own, without a trace of walls and accelerations.
Scenery = tuple[()] | tuple[bool]


class Rules(NamedTuple):
    """What all disks obey."""

    restitution: float
    falling: bool  # something is accelerated
    mixed: bool  # not everything alike
    wrapped: bool
    lasting: bool  # bounces die out too slowly for `crowd`, or never
    # units in the last place of the time: a disk that collides 64 times within so many has no
    # single continuation
    crowd: float
    friction: float


class Walls(NamedTuple):
    """What stands around, and which cells it is near."""

    wrap: Array  # (2, 2) m
    segment: Array  # (w, 5) start m, direction, length m
    first: Ints  # (cells + 1,) where a cell's walls begin in `of`
    of: Ints


class Arena(NamedTuple):
    """All there is. Kernels change its arrays in place."""

    disks: Disks
    tree: Tree
    head: Links  # (cells,) first disk
    near: Links  # (n + 9,) candidates of the search under way
    grid: Grid
    rules: Rules
    walls: Walls
    clock: Array  # s: when the present epoch began, when the answer ends
    log: Array  # (h, 4) t s, disk, other disk or -1 - wall, impulse N s
    # rows in the log; the two for whom the answer ends, as in the log; events until the loop comes
    # back
    counters: Ints
    runs: Runs  # untouched where there is no scenery
    spins: Spins  # untouched where there is no friction


@inlined
def fly(a: Any, now: float, scenery: Scenery) -> None:
    """Bring a disk to `now` on its parabola."""
    t = now - a.t
    if len(scenery):
        a.x += (a.vx + a.ax * t / 2) * t
        a.y += (a.vy + a.ay * t / 2) * t
        a.vx += a.ax * t
        a.vy += a.ay * t
    else:
        a.x += a.vx * t
        a.y += a.vy * t
    a.t = now


@inlined
def link(disks: Disks, head: Links, g: Grid, i: int) -> None:
    """Put disk `i` at the head of its cell's chain."""
    a = disks[i]
    c = a.cx * g.shape[1] + a.cy
    a.next, a.before = head[c], NONE
    if a.next != NONE:
        disks[a.next].before = i
    head[c] = i


@inlined
def unlink(disks: Disks, head: Links, g: Grid, i: int) -> None:
    """Take disk `i` out of its cell's chain."""
    a = disks[i]
    if a.before != NONE:
        disks[a.before].next = a.next
    else:
        head[a.cx * g.shape[1] + a.cy] = a.next
    if a.next != NONE:
        disks[a.next].before = a.before


@inlined
def lap(k: int, cells: int) -> int:
    """By how many laps of the grid cell k, a step beyond it at most, is off."""
    return -1 if k < 0 else (1 if k == cells else 0)


@inlined
def cross(disks: Disks, head: Links, g: Grid, i: int, side: int) -> None:
    """Move disk `i` to the next cell; over the end of the grid, shift the disk (torus) or the grid
    under it."""
    a = disks[i]
    unlink(disks, head, g, i)
    step = 2 * (side % 2) - 1
    if side < 2:
        laps = lap(a.cx + step, g.shape[0])
        a.cx += step - laps * g.shape[0]
        a.x -= laps * g.shift[0]
        a.ox += laps * (g.span[0] - g.shift[0])
    else:
        laps = lap(a.cy + step, g.shape[1])
        a.cy += step - laps * g.shape[1]
        a.y -= laps * g.shift[1]
        a.oy += laps * (g.span[1] - g.shift[1])
    link(disks, head, g, i)


@inlined
def settle(disks: Disks, head: Links, g: Grid, i: int) -> None:
    """Find the cell and the lap of disk `i` from its position, and link it there."""
    a = disks[i]
    kx = int(np.floor((a.x - a.ox) / g.side[0]))
    ky = int(np.floor((a.y - a.oy) / g.side[1]))
    if g.torus:
        kx, ky = min(max(kx, 0), g.shape[0] - 1), min(max(ky, 0), g.shape[1] - 1)
    a.ox += kx // g.shape[0] * g.span[0]
    a.oy += ky // g.shape[1] * g.span[1]
    a.cx, a.cy = kx % g.shape[0], ky % g.shape[1]
    link(disks, head, g, i)
