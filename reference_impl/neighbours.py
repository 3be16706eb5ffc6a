"""Which disks are near each other, and which are near a wall, so that many disks need not ask every
pair in every step.

A neighbour list (Verlet, Phys. Rev. 159, 98, 1967), found by cells. It decides what is asked, never
what is
answered: the pairs stand in the order of the double loop over i < j, and one that is left out
cannot touch as long as neither of its disks has moved by half the skin.
"""

from math import floor, sqrt
from typing import NamedTuple

import numpy as np

from reference_impl.compiled import compiled, kernel
from reference_impl.state import Disks, World

LASTS = 16  # steps of the fastest disk that a list is made for, unless fewer are left
# the skin in mean radii: at least, so that disks at rest may fall; at most
THIN, THICK = 0.125, 2.0
FAR = 2.0**31  # cells from the origin, up to where rounding cannot put a disk into the wrong one
ROOM = 32  # near pairs a disk, beyond which a list is given up


class NeighbourList(NamedTuple):
    """What may touch as long as no disk is farther than `half_skin` from its home."""

    listed: bool  # False: too dense or too far out for a list, so everything may touch
    home: np.ndarray  # (2n,) m: where the disks were when this was found, x and y in turn
    half_skin: float  # m
    first: np.ndarray  # (p,) the near pairs, first < second, in the order of the double loop
    second: np.ndarray  # (p,)
    reach2: np.ndarray  # (p,) m2: squared sum of the radii
    disk: np.ndarray  # (b,) the disks near a wall, and
    wall: np.ndarray  # (b,) which wall it is, in the order of their double loop


@compiled
def build_list(disks: Disks, world: World, dt: float, left: int) -> NeighbourList:
    """All pairs that are apart by less than a skin, and the disks within half a skin of a wall;
    `left` steps to go.

    Both disks of a pair may use up half of the skin. `half_skin` is a little less than that: 2 % of
    the skin are more than what rounding makes of all the distances.
    """
    x, radius = disks.position, disks.radius
    skin = skin_for(disks, dt, left)
    # wider than needed by more than rounding
    cells = sort_into_cells(x, radius, 1.001 * (2.0 * radius.max() + skin))
    first, second = near_pairs(cells, skin)
    first, second = in_order(first, second, len(x))
    reach2 = (radius[first] + radius[second]) ** 2
    listed = len(cells.disk) > 0 and len(first) <= ROOM * len(x)
    disk, wall = near_walls(x, radius, 0.5 * skin, world.walls)
    return NeighbourList(
        listed, x.copy().reshape(-1), 0.49 * skin, first, second, reach2, disk, wall
    )


@kernel
def skin_for(disks: Disks, dt: float, left: int) -> float:
    """m: the thicker, the more pairs are asked in vain; the thinner, the sooner the list is out of
    date."""
    fastest = 0.0
    for i in range(len(disks.mass)):
        speed = abs(disks.velocity[i, 0]) + abs(disks.velocity[i, 1])
        if speed > fastest:
            fastest = speed
    size = disks.radius.mean()
    return min(max(2.0 * min(LASTS, left) * fastest * abs(dt), THIN * size), THICK * size)


@kernel
def beyond_skin(x, home, i: int, half_skin: float) -> bool:  # type: ignore[no-untyped-def]
    """Whether disk i is farther from its home than half the skin; x (2n,) m, as `home`: rows of two
    are no vectors."""
    dx, dy = x[2 * i] - home[2 * i], x[2 * i + 1] - home[2 * i + 1]
    return dx * dx + dy * dy > half_skin * half_skin


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
def sort_into_cells(x, radius, side: float) -> Cells:  # type: ignore[no-untyped-def]
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
    start[count + 1 :] = n + start[1:3]
    disk[n:], place[n:] = disk[: m - n], place[: m - n]
    return Cells(row, start, disk, number, place)


@compiled
def near_pairs(cells: Cells, skin: float):  # type: ignore[no-untyped-def]
    """(p,), (p,): the pairs that are apart by less than the skin, first < second, in no order."""
    n = cells.start[-3] if len(cells.disk) else 0
    first, second = np.empty(4 * n, np.uint32), np.empty(4 * n, np.uint32)
    q, count = 0, 0
    while q < n and count <= ROOM * n:
        q, count = add_pairs(cells, skin, first, second, q, count)
        if q < n:
            first, second = longer(first), longer(second)
    return first[:count], second[:count]


@kernel
def add_pairs(cells: Cells, skin: float, first, second, q: int, count: int) -> tuple[int, int]:  # type: ignore[no-untyped-def]
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
def longer(array):  # type: ignore[no-untyped-def]
    """The array (p,) with as much room again."""
    return np.concatenate((array, np.empty_like(array)))


@compiled
def in_order(first, second, n: int):  # type: ignore[no-untyped-def]
    """The pairs in the order of the double loop: sorted by the second, then by the first, which
    keeps that order."""
    second, first = sorted_by(second, first, n)
    return sorted_by(first, second, n)


@compiled
def sorted_by(key, other, n: int):  # type: ignore[no-untyped-def]
    """Both (p,) arrays by a counting sort of the keys, numbers below n; equal keys stay in
    order."""
    free = np.zeros(n + 1, np.uint32)
    for k in key:
        free[k + 1] += 1
    for k in range(n):
        free[k + 1] += free[k]
    keys, others = np.empty_like(key), np.empty_like(other)
    for p in range(len(key)):
        q = free[key[p]]
        free[key[p]] += 1
        keys[q], others[q] = key[p], other[p]
    return keys, others


@compiled
def near_walls(x, radius, margin: float, walls):  # type: ignore[no-untyped-def]
    """(b,), (b,): the disks, in order, that are within the margin of the upright rectangle around a
    wall, and which."""
    disk, wall, count = (
        np.empty(len(x) * len(walls), np.uint32),
        np.empty(len(x) * len(walls), np.uint32),
        0,
    )
    for i in range(len(x)):
        reach = radius[i] + margin
        for w in range(len(walls)):
            left, right = min(walls[w, 0, 0], walls[w, 1, 0]), max(walls[w, 0, 0], walls[w, 1, 0])
            low, high = min(walls[w, 0, 1], walls[w, 1, 1]), max(walls[w, 0, 1], walls[w, 1, 1])
            if left - reach < x[i, 0] < right + reach and low - reach < x[i, 1] < high + reach:
                disk[count], wall[count] = i, w
                count += 1
    return disk[:count].copy(), wall[:count].copy()
