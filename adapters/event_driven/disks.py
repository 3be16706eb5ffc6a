"""The data of the event engine: disks, each with a record of its next event, a winner tree of these
records, the cell grid, the rules; and how disks fly in it.

A record holds the earliest contact of its disk with another one, as of the last search, and the
earliest event of the disk on its own: a wall, an edge of its cell or of the wrap box. A contact is
stale if the other disk has collided since (its `count` has changed); the search is then repeated
at the time of the contact, which is never after the next true one. Of every pair, the disk whose
record was made last has the valid one (Lubachevsky, J. Comput. Phys. 94, 255, 1991).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.adapters.event_driven.compiled import inlined
from crosscheck2d.scenarios.model import Array

Ints = NDArray[np.int64]
Links = NDArray[np.uint32]
Disks = NDArray[np.void]  # (n,) of DISK
Runs = NDArray[np.void]  # (n,) of RUN
Spins = NDArray[np.void]  # (n,) of SPIN
Tree = NDArray[np.void]  # (2 p,) of NODE
# the end of a chain; unsigned, so that numba need not test for negative indices
NONE = np.uint32(2**32 - 1)
NOBODY = -(2**31)  # the value of `last` before the first collision
DONE, GOES_ON, LOG_FULL, ACCUMULATION, REENTRY, ROUND_END = range(6)  # statuses of the loop
BASE, STOP = 0, 1  # columns of Arena.clock
LOGGED, END_DISK, END_PARTNER, LEFT = range(4)  # columns of Arena.counters
# Codes of the events of a disk on its own: EDGE and WRAP + side (left, right, bottom, top); the end
# of its wall; the end of its slip; WALL + 3 wall + part.
EDGE, WRAP, END, SLIP_END, WALL = 0, 4, 8, 9, 10

# A disk in three cache lines: what a search for contacts reads of other disks, its record, and what
# few events need.
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
        # the times of its next contact with a disk, and of its next event on its own
        ("pair_time", "f8"),
        ("own_time", "f8"),
        ("partner", "u4"),
        ("partner_count", "i4"),  # the disk of that contact, and its count when it was predicted
        ("own_code", "i4"),  # its next event on its own, as above
        ("last", "i4"),  # its last collision: a disk, or -1 - wall
        ("before", "u4"),  # the disk before it in its chain
        # a time, and the collisions since, to detect accumulation
        ("mark_collisions", "i4"),
        ("mark_time", "f8"),
        ("ax", "f8"),
        ("ay", "f8"),  # acceleration; of a disk that rests on a wall, only the part along it
        ("free_ax", "f8"),
        ("free_ay", "f8"),  # acceleration of free flight
        # the corner of cell (0, 0) of its copy of the grid, which repeats in an open scene
        ("ox", "f8"),
        ("oy", "f8"),
        ("wall", "i4"),  # the wall it rests on; -1: none; -2 - wall: it has just slid off that one
        ("bounces", "i4"),  # collisions in a row on the face of one wall
        ("corner", "i4"),  # the second wall of the corner in which it rests; -1: none
        ("", "i4"),
    ]
)

# For each disk the latest collisions without a flight between them, see `rest.rattles`.
RUN = np.dtype(
    [
        ("collisions", "i4"),  # those that count
        ("walls", "i4"),  # collisions in a row with walls, with or without flights between them
        ("start", "f8"),  # s, the first of these collisions
        ("acceleration", "f8"),  # m/s2, the largest of the disks in these collisions
    ]
)

# The rotation of each disk, used where there is friction.
SPIN = np.dtype(
    [
        ("t", "f8"),  # s, the time of the next three
        ("angle", "f8"),  # rad
        ("spin", "f8"),  # rad/s
        ("rate", "f8"),  # rad/s2
        ("free_rate", "f8"),  # rad/s2, by torques without friction
        ("inverse_inertia", "f8"),
        ("sliding", "i4"),  # the sign of the slip on the wall it rests on; 0: it rolls
    ],
    align=True,
)

# A winner tree (tournament tree) finds the disk with the earliest event, with log n comparisons per
# change. Node k holds the earlier of 2 k and 2 k + 1, node 1 the earliest of all; disk i is leaf
# p + i, p a power of two.
# Time and disk lie in one cache line. The disk is a float, so that the processor selects it without
# a branch, as it selects the earlier time. With an integer it branches, mispredicts at every other
# node, and takes twice as long for an event.
NODE = np.dtype([("time", "f8"), ("who", "f8")])


class Grid(NamedTuple):
    """Cells at least as wide as the largest disk. A disk that leaves the grid is shifted by its
    span in a torus; otherwise its copy of the grid is shifted."""

    side: tuple[float, float]  # m
    shape: tuple[int, int]  # at least 3
    span: tuple[float, float]  # m
    shift: tuple[float, float]  # m, how far an image is from its disk: the span of a torus, or 0
    torus: bool


# () where there are only disks on straight lines, else (True,). Numba knows the length of a tuple
# when it compiles, so that a gas gets its own loop without code for walls and accelerations.
Scenery = tuple[()] | tuple[bool]


class Rules(NamedTuple):
    restitution: float
    falling: bool  # some disk is accelerated
    mixed: bool  # not all with the same acceleration
    wrapped: bool
    lasting: bool  # bounces die out too slowly for `accumulation_ulps`, or never
    # units in the last place of the time: the collisions of a disk that collides 64 times within so
    # many accumulate
    accumulation_ulps: float
    friction: float


class Walls(NamedTuple):
    wrap: Array  # (2, 2) m
    segment: Array  # (w, 5) start m, direction, length m
    # (w,) walls in line that overlap or share an end are one surface, with one number
    surface: Ints
    first: Ints  # (cells + 1,) the index in `of` of a cell's first wall
    of: Ints


class Arena(NamedTuple):
    """The whole state of the engine. Kernels change its arrays in place."""

    disks: Disks
    tree: Tree
    head: Links  # (cells,) first disk
    near: Links  # (n + 9,) candidates of the present search
    grid: Grid
    rules: Rules
    walls: Walls
    clock: Array  # s: the start of the present epoch, the end of the answer
    log: Array  # (h, 4) t s, disk, other disk or -1 - wall, impulse N s
    # rows in the log; the two for which the answer ends, as in the log; events until the loop
    # returns
    counters: Ints
    runs: Runs  # unused without scenery
    spins: Spins  # unused without friction


@inlined
def fly(a: Any, now: float, scenery: Scenery) -> None:
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
    a = disks[i]
    c = a.cx * g.shape[1] + a.cy
    a.next, a.before = head[c], NONE
    if a.next != NONE:
        disks[a.next].before = i
    head[c] = i


@inlined
def unlink(disks: Disks, head: Links, g: Grid, i: int) -> None:
    a = disks[i]
    if a.before != NONE:
        disks[a.before].next = a.next
    else:
        head[a.cx * g.shape[1] + a.cy] = a.next
    if a.next != NONE:
        disks[a.next].before = a.before


@inlined
def lap(k: int, cells: int) -> int:
    """By how many spans of the grid cell k, at most one cell outside, is off: -1, 0 or 1."""
    return -1 if k < 0 else (1 if k == cells else 0)


@inlined
def cross(disks: Disks, head: Links, g: Grid, i: int, side: int) -> None:
    """Move disk `i` to the next cell; beyond the end of the grid, shift the disk (torus) or its
    copy of the grid."""
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
def link_by_position(disks: Disks, head: Links, g: Grid, i: int) -> None:
    a = disks[i]
    kx = int(np.floor((a.x - a.ox) / g.side[0]))
    ky = int(np.floor((a.y - a.oy) / g.side[1]))
    if g.torus:
        kx, ky = min(max(kx, 0), g.shape[0] - 1), min(max(ky, 0), g.shape[1] - 1)
    a.ox += kx // g.shape[0] * g.span[0]
    a.oy += ky // g.shape[1] * g.span[1]
    a.cx, a.cy = kx % g.shape[0], ky % g.shape[1]
    link(disks, head, g, i)


def empty_queue(n: int) -> Tree:
    """The tree (2 p,) of n disks without events."""
    p = 1 << max(n - 1, 1).bit_length()
    tree = np.zeros(2 * p, NODE)
    tree["time"] = np.inf
    tree["who"][p:] = np.arange(p)
    for k in range(p - 1, 0, -1):
        tree[k] = tree[2 * k]
    return tree.view(np.recarray)


@inlined
def put(tree: Tree, i: int, time: float) -> None:
    """Set the time of the next event of disk `i`, and update the nodes above it."""
    node, who = (len(tree) >> 1) + i, np.float64(i)
    tree[node].time = time
    while node > 1:
        rival = tree[node ^ 1]
        rival_time, rival_who = rival.time, rival.who
        who = rival_who if rival_time < time else who
        time = rival_time if rival_time < time else time
        node >>= 1
        tree[node].time, tree[node].who = time, who
