"""A neighbour list (Verlet, Phys. Rev. 159, 98, 1967): the pairs of disks, and of disks and walls,
that may touch in the next steps. Many disks are sorted into a cell list to find them.

The list changes no result: its pairs are in the order of the double loop over i < j, and a pair
that is not in it cannot touch until one of its disks has moved by half the skin. The distance moved
is not measured in every step: no disk moves farther in a step than `STRIDE`, which each step
subtracts from `SLACK`, the rest of half the skin.
"""

from math import floor, inf, sqrt
from typing import NamedTuple

import numpy as np

from .compiled import compiled, kernel
from .state import World

LASTS = 16  # steps of the fastest disk for which a list is built, unless fewer steps remain
HALF = 0.49  # of the skin, not 1/2: the margin is more than the rounding of the distances
EARLY = 0.1  # of half the skin, reserved for the position corrections of a step
# the skin in mean radii: at least, so that disks at rest may fall; at most
THIN, THICK = 0.125, 3.0
FEW = 64  # disks, up to which asking all pairs finds the near ones sooner than cells do
FAR = 2.0**31  # cells from the origin, up to where rounding cannot put a disk into the wrong one
ROOM = 32  # near pairs a disk, and near walls, beyond which a list is given up
ROUNDING = 2.0**-23  # of a coordinate, by which a step may be longer than v dt: in float32, too

PAIRS, WALLS, EDGES = 0, 1, 2  # places in `found`
NO_ROOM = -1  # in place of how many there are
HALF_SKIN, SLACK, STRIDE = 0, 1, 2  # places in `length`


class NeighbourList(NamedTuple):
    """What may touch while the list holds: while `SLACK` is not negative. Filled in place."""

    first: np.ndarray  # (room,) the near pairs, first < second, in the order of the double loop
    second: np.ndarray  # (room,)
    reach: np.ndarray  # (room,) m: sum of their radii
    disk: np.ndarray  # (room,) the disks near a wall, and
    wall: np.ndarray  # (room,) which wall it is, in the order of their double loop
    edge: np.ndarray  # (n,) the disks whose centre is near an edge of the box
    found: np.ndarray  # (3,) how many there are of each: `PAIRS`, `WALLS`, `EDGES`
    home: np.ndarray  # (n, 2) m: where the disks were when this was found
    length: np.ndarray  # (3,) m: `HALF_SKIN`, `SLACK`, `STRIDE`


@compiled
def empty_list(radius, walls: int) -> NeighbourList:
    """Room for the list of disks of these radii (n,) m and so many walls; it does not hold yet."""
    n = len(radius)
    pairs, sides = min(n * (n - 1) // 2, ROOM * n), min(n * walls, ROOM * n)
    return NeighbourList(
        first=np.empty(pairs, np.uint32),
        second=np.empty(pairs, np.uint32),
        reach=np.empty(pairs, radius.dtype),
        disk=np.empty(sides, np.uint32),
        wall=np.empty(sides, np.uint32),
        edge=np.empty(n, np.uint32),
        found=np.zeros(3, np.int64),
        home=np.empty((n, 2)),
        length=np.array([0.0, -inf, 0.0]),
    )


@kernel
def holds(near: NeighbourList) -> bool:
    """Whether no disk can be farther than half the skin from its home."""
    return near.length[SLACK] >= 0.0


@kernel
def used_up(near: NeighbourList) -> bool:
    """Whether too little is left of half the skin for what collisions move."""
    return near.length[SLACK] < EARLY * near.length[HALF_SKIN] or not holds(near)


@kernel
def take_step(near: NeighbourList, faster: float) -> None:
    """All have moved by a step; the fastest is by `faster` m a step faster than before."""
    near.length[STRIDE] += faster
    near.length[SLACK] -= near.length[STRIDE]


@kernel
def account_for(near: NeighbourList, x, i: int, stride: float) -> None:
    """A collision has moved disk i, x (n, 2) m, and from now on it moves by up to `stride` m a
    step: in this one, too, where a collision acts before its end."""
    dx, dy = x[i, 0] - near.home[i, 0], x[i, 1] - near.home[i, 1]
    slack = near.length[HALF_SKIN] - sqrt(dx * dx + dy * dy) - stride
    if slack < near.length[SLACK]:
        near.length[SLACK] = slack
    if stride > near.length[STRIDE]:
        near.length[STRIDE] = stride


@compiled
def build_list(near: NeighbourList, x, radius, world: World, left: int) -> None:
    """Find what is near anew: all pairs of the disks at x (n, 2) m that are apart by less than a
    skin, and those within half a skin of a wall or an edge; `left` steps to go.

    `STRIDE` says how thick the skin must be. Where a list would be too long, or a disk is too far
    out, it does not hold.
    """
    n = len(radius)
    skin = skin_for(radius, near.length[STRIDE], left)
    near.length[HALF_SKIN], near.length[SLACK] = HALF * skin, -inf
    if n <= FEW:
        find_by_all_pairs(near, x, radius, skin)
    else:
        find_by_cells(near, x, radius, skin)
    find_walls(near, x, radius, world.walls, 0.5 * skin)
    find_edges(near, x, world, 0.5 * skin)
    if near.found[PAIRS] != NO_ROOM and near.found[WALLS] != NO_ROOM:
        for i in range(n):
            near.home[i, 0], near.home[i, 1] = x[i, 0], x[i, 1]
        near.length[SLACK] = near.length[HALF_SKIN]


@kernel
def skin_for(radius, stride: float, left: int) -> float:
    """m: the thicker, the more pairs are asked in vain; the thinner, the sooner the list is used
    up. Few steps that are left are taken with one list."""
    size, way = radius.mean(), min(LASTS, left) * stride
    return min(max(way / (HALF * (1.0 - EARLY)), THIN * size), THICK * size)


@kernel
def find_by_all_pairs(near: NeighbourList, x, radius, skin: float) -> None:
    """For `FEW` disks or fewer, whose pairs always fit into the list."""
    count = 0
    for i in range(len(radius)):
        for j in range(i + 1, len(radius)):
            dx, dy, reach = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], radius[i] + radius[j]
            if dx * dx + dy * dy < (reach + skin) * (reach + skin):
                near.first[count], near.second[count], near.reach[count] = i, j, reach
                count += 1
    near.found[PAIRS] = count


@kernel
def find_walls(near: NeighbourList, x, radius, walls, margin: float) -> None:
    """The disks that are within the margin of the upright rectangle around a wall, and which."""
    count = 0
    for i in range(len(radius)):
        reach = radius[i] + margin
        for w in range(len(walls)):
            left, right = min(walls[w, 0, 0], walls[w, 1, 0]), max(walls[w, 0, 0], walls[w, 1, 0])
            low, high = min(walls[w, 0, 1], walls[w, 1, 1]), max(walls[w, 0, 1], walls[w, 1, 1])
            if left - reach < x[i, 0] < right + reach and low - reach < x[i, 1] < high + reach:
                if count == len(near.disk):
                    near.found[WALLS] = NO_ROOM
                    return
                near.disk[count], near.wall[count] = i, w
                count += 1
    near.found[WALLS] = count


@kernel
def find_edges(near: NeighbourList, x, world: World, margin: float) -> None:
    """The disks that may leave the box while they use up the margin."""
    left, right = world.low[0] + margin, world.high[0] - margin
    low, high, count = world.low[1] + margin, world.high[1] - margin, 0
    for i in range(len(x)):
        if not (left < x[i, 0] < right and low < x[i, 1] < high):
            near.edge[count] = i
            count += 1
    near.found[EDGES] = count


@compiled
def find_by_cells(near: NeighbourList, x, radius, skin: float) -> None:
    """For more disks: tests only the pairs in neighbouring cells."""
    # wider than needed by more than rounding
    cells = sort_into_cells(x, radius, 1.001 * (2.0 * radius.max() + skin))
    first, second = near_pairs(cells, skin)
    near.found[PAIRS] = NO_ROOM
    if len(cells.disk) > 0 and len(first) <= len(near.first):
        near.found[PAIRS] = count = len(first)
        # the order of the double loop: by the second, then by the first, which keeps that order
        lesser, greater = np.empty_like(first), np.empty_like(second)
        sort_by(second, first, len(x), greater, lesser)
        sort_by(lesser, greater, len(x), near.first[:count], near.second[:count])
        for p in range(count):
            near.reach[p] = radius[near.first[p]] + radius[near.second[p]]


class Cells(NamedTuple):
    """The square cells of the plane, rolled up on a ring: cell (a, b) is number a + b row, modulo
    their count.

    Far cells may share a number, neighbours never do. The disks in cell c are start[c] to start[c +
    1] of the lists; the first two cells stand there once more at the end, so that three cells in a
    row are always one piece.
    """

    row: int
    start: np.ndarray  # (cells + 3,)
    # (m,) which disk it is; empty if one is too far out to say in which cell it is
    disk: np.ndarray
    number: np.ndarray  # (m,) of its cell
    place: np.ndarray  # (m, 3) m: x, y and radius, side by side as they are needed


@compiled
def sort_into_cells(x, radius, side: float) -> Cells:
    """A counting sort of the disks at x (n, 2) m by their cells of `side` m."""
    n, count = len(x), 16
    while count < n:
        count *= 2
    row = int(sqrt(count)) | 1
    of, start = np.empty(n, np.uint32), np.zeros(count + 3, np.uint32)
    for i in range(n):
        a, b = x[i, 0] / side, x[i, 1] / side
        if not (abs(a) < FAR and abs(b) < FAR):
            return Cells(row, start, of[:0], of[:0], np.empty((0, 3)))
        of[i] = (floor(a) + floor(b) * row) & (count - 1)
        start[of[i] + 2] += 1
    for c in range(2, count + 2):
        start[c] += start[c - 1]  # of the cell before, until that one is filled

    m = n + np.int64(start[3])
    disk, number, place = np.empty(m, np.uint32), np.empty(m, np.uint32), np.empty((m, 3))
    for i in range(n):
        q = start[of[i] + 1]
        start[of[i] + 1] += 1
        disk[q], number[q] = i, of[i]
        place[q, 0], place[q, 1], place[q, 2] = x[i, 0], x[i, 1], radius[i]
    start[count + 1], start[count + 2] = n + start[1], n + start[2]
    for q in range(n, m):
        disk[q] = disk[q - n]
        place[q, 0], place[q, 1], place[q, 2] = place[q - n, 0], place[q - n, 1], place[q - n, 2]
    return Cells(row, start, disk, number, place)


@compiled
def near_pairs(cells: Cells, skin: float):
    """(p,), (p,): the pairs that are apart by less than the skin, first < second, in no order."""
    n = cells.start[-3] if len(cells.disk) else 0
    first, second = np.empty(4 * n, np.uint32), np.empty(4 * n, np.uint32)
    q, count = 0, 0
    while q < n and count <= ROOM * n:
        q, count = add_pairs(cells, skin, first, second, q, count)
        if q < n:
            first = np.concatenate((first, np.empty_like(first)))  # as much room again
            second = np.concatenate((second, np.empty_like(second)))
    return first[:count], second[:count]


@kernel
def add_pairs(cells: Cells, skin: float, first, second, q: int, count: int) -> tuple[int, int]:
    """Write the pairs of the disks from q on behind the first `count`, as far as there is room;
    returns both anew."""
    start, disk, place, last = cells.start, cells.disk, cells.place, len(cells.start) - 4
    for p in range(q, start[-3]):
        # The rest of its own cell and the next one, then three cells in the row above: each pair is
        # met once.
        c = np.int64(cells.number[p])
        above = (c + cells.row - 1) & last
        begin, end = p + 1, start[c + 2]
        if count + end - begin + start[above + 3] - start[above] > len(first):
            return p, count
        i, x, y, r = disk[p], place[p, 0], place[p, 1], place[p, 2] + skin
        for _ in range(2):
            for k in range(begin, end):
                dx, dy, reach = x - place[k, 0], y - place[k, 1], r + place[k, 2]
                # Written in any case, kept if it counts: a branch that nobody can foresee would
                # take longer.
                first[count], second[count] = min(i, disk[k]), max(i, disk[k])
                count += dx * dx + dy * dy < reach * reach
            begin, end = start[above], start[above + 3]
    return start[-3], count


@compiled
def sort_by(key, other, n: int, keys, others) -> None:
    """Write both (p,) arrays by a counting sort of the keys, numbers below n; equal keys stay in
    order."""
    free = np.zeros(n + 1, np.uint32)
    for k in key:
        free[k + 1] += 1
    for k in range(n):
        free[k + 1] += free[k]
    for p in range(len(key)):
        q = free[key[p]]
        free[key[p]] += 1
        keys[q], others[q] = key[p], other[p]
