"""When disks, walls and edges meet, and the agenda of a step: the meetings that are still to come.

All have flown to the end of the step. The pairs of the neighbour list are tested once, and after
each meeting only those of the disks whose way has changed: the cost of a meeting does not grow with
the number of disks.
"""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from .compiled import compiled, internal, kernel
from .neighbour_list import EDGES, PAIRS, ROUNDING, STRIDE, WALLS, NeighbourList, account_for
from .state import Disks, World

NOBODY, EDGE = -1, 1 << 30  # in place of a disk: none, and the edge of the world
EXACT, COARSE = 2.0**-40, 2.0**-20  # of radii, speeds and accelerations
# In radii: how far a disk may overlap. It is held in the step by nothing, alone, or by so many
# solutions of `ordered.settle`.
LEEWAY = 0.0, EXACT, EXACT, COARSE, COARSE, inf
# Of a step: of times that differ by less rounding decides, so they are found again from the same
# instant on.
SAME = 2.0**-40
DUE, CHANGED, INDEXED = 0, 1, 2  # places in `length`


class Agenda(NamedTuple):
    """Rows of the neighbour list: its pairs, then its disks near walls, then those near edges.
    Filled in place."""

    start: np.ndarray  # (n + 1,) the rows of disk d are start[d] to start[d + 1] of
    row: np.ndarray  # (2 pairs + walls + edges,)
    due: np.ndarray  # (room,) the rows that meet in this step, in any order, and
    time: np.ndarray  # (room,) s, when
    changed: np.ndarray  # (n,) the disks whose way has changed since
    stale: np.ndarray  # (n,) whether a disk is one of them
    length: np.ndarray  # (3,) how many there are: `DUE`, `CHANGED`; `INDEXED` 1 if `row` is filled


class Accelerations(NamedTuple):
    """What accelerates the disks: all steps of a call alike, but for what rests on another."""

    steady: np.ndarray  # (n, 2) m/s2, by force and gravity
    now: np.ndarray  # (n, 2) m/s2, and by what holds those at rest until the end of a step
    turning: np.ndarray  # (n,) rad/s2
    held: np.ndarray  # (n,) what holds the disk in this step, as an index of `LEEWAY`
    moving: np.ndarray  # (m, 2) the disks that move, as `neighbours.moving` has them
    strongest: float  # m/s2, of the steady ones


class System(NamedTuple):
    """What moves, where, and how."""

    disks: Disks
    world: World
    acceleration: Accelerations
    dt: float  # s, of a step


@compiled
def empty_agenda(near: NeighbourList) -> Agenda:
    """Room for the meetings of this list."""
    n, rows = len(near.edge), len(near.first) + len(near.disk) + len(near.edge)
    return Agenda(
        start=np.empty(n + 1, np.int64),
        row=np.empty(rows + len(near.first), np.uint32),
        due=np.empty(rows, np.uint32),
        time=np.empty(rows),
        changed=np.empty(n, np.uint32),
        stale=np.zeros(n, np.bool_),
        length=np.zeros(3, np.int64),
    )


@kernel
def bodies(near: NeighbourList, row: int) -> tuple[int, int]:
    """The disk and the other disk, wall j = -1 - w, or edge of a row."""
    if row < near.found[PAIRS]:
        return int(near.first[row]), int(near.second[row])
    row -= near.found[PAIRS]
    if row < near.found[WALLS]:
        return int(near.disk[row]), -1 - int(near.wall[row])
    return int(near.edge[row - near.found[WALLS]]), EDGE


@internal
def meeting_time(system: System, near: NeighbourList, i: int, j: int, now: float) -> float:
    """When disk i meets disk, wall or edge j from `now` on, or inf."""
    if j == EDGE:
        return edge_time(system, i, now)
    if j < 0:
        return wall_time(system, near, i, -1 - j, now)
    return pair_time(system, near, i, j, now)


@kernel
def add_meeting(agenda: Agenda, row: int, s: float) -> None:
    """Row `row` of the list meets at s, if that is not inf."""
    if s < inf:
        agenda.due[agenda.length[DUE]], agenda.time[agenda.length[DUE]] = row, s
        agenda.length[DUE] += 1


@kernel
def list_meetings(system: System, near: NeighbourList, agenda: Agenda, now: float) -> None:
    """Fill the agenda with all meetings from `now` on."""
    pairs, walls = near.found[PAIRS], near.found[WALLS]
    for c in range(agenda.length[CHANGED]):
        agenda.stale[agenda.changed[c]] = False
    agenda.length[DUE] = agenda.length[CHANGED] = 0
    for p in range(pairs):
        i, j = int(near.first[p]), int(near.second[p])
        add_meeting(agenda, p, pair_time(system, near, i, j, now))
    for b in range(walls):
        s = wall_time(system, near, int(near.disk[b]), int(near.wall[b]), now)
        add_meeting(agenda, pairs + b, s)
    for e in range(near.found[EDGES]):
        add_meeting(agenda, pairs + walls + e, edge_time(system, int(near.edge[e]), now))


@kernel
def index_rows(near: NeighbourList, agenda: Agenda) -> None:
    """The rows of each disk, in order."""
    start, rows = agenda.start, near.found[PAIRS] + near.found[WALLS] + near.found[EDGES]
    start[:] = 0
    for row in range(rows):
        i, j = bodies(near, row)
        start[i] += 1
        if 0 <= j < EDGE:
            start[j] += 1
    for d in range(1, len(start)):
        start[d] += start[d - 1]
    for row in range(rows - 1, -1, -1):
        i, j = bodies(near, row)
        start[i] -= 1
        agenda.row[start[i]] = row
        if 0 <= j < EDGE:
            start[j] -= 1
            agenda.row[start[j]] = row
    agenda.length[INDEXED] = 1


@kernel
def way_in_step(system: System, i: int) -> float:
    """m: disk i gets no farther in a step."""
    x, v, a = system.disks.position, system.disks.velocity, system.acceleration.now
    speed = sqrt(v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1])
    strength, dt = sqrt(a[i, 0] * a[i, 0] + a[i, 1] * a[i, 1]), abs(system.dt)
    return (speed + strength * dt) * dt + ROUNDING * max(abs(x[i, 0]), abs(x[i, 1]))


@kernel
def mark_changed(system: System, near: NeighbourList, agenda: Agenda, d: int) -> None:
    """Disk d goes another way from now on."""
    account_for(near, system.disks.position, d, way_in_step(system, d))
    if not agenda.stale[d]:
        agenda.stale[d], agenda.changed[agenda.length[CHANGED]] = True, d
        agenda.length[CHANGED] += 1


@kernel
def update_meetings(system: System, near: NeighbourList, agenda: Agenda, now: float) -> None:
    """Renew the meetings from `now` on of the disks that go another way."""
    stale, keep = agenda.stale, 0
    if agenda.length[CHANGED] == 0:
        return
    if agenda.length[INDEXED] == 0:
        index_rows(near, agenda)
    for c in range(agenda.length[DUE]):
        i, j = bodies(near, agenda.due[c])
        if not (stale[i] or (0 <= j < EDGE and stale[j])):
            agenda.due[keep], agenda.time[keep] = agenda.due[c], agenda.time[c]
            keep += 1
    agenda.length[DUE] = keep
    for c in range(agenda.length[CHANGED]):
        d = int(agenda.changed[c])
        for k in range(agenda.start[d], agenda.start[d + 1]):
            row = int(agenda.row[k])
            i, j = bodies(near, row)
            partner = j if i == d else i
            if not (0 <= partner < EDGE and stale[partner]):  # whose turn comes later
                add_meeting(agenda, row, meeting_time(system, near, i, j, now))
        stale[d] = False
    agenda.length[CHANGED] = 0


@kernel
def first_meeting(system: System, near: NeighbourList, agenda: Agenda, now: float):
    """(s, i, j) of the first meeting from `now` on: of two disks, of a disk and wall j = -1 - w, or
    the edge. Of meetings at the same instant, that of the least i; of a disk, before a wall."""
    changed = agenda.length[CHANGED] > 0
    update_meetings(system, near, agenda, now)
    while True:
        soon = inf
        for c in range(agenda.length[DUE]):
            soon = min(soon, agenda.time[c])
        first, least = (inf, NOBODY, NOBODY), 0
        soon += SAME * system.dt
        if soon == inf:
            return first
        for c in range(agenda.length[DUE]):
            if agenda.time[c] <= soon:
                row = int(agenda.due[c])
                i, j = bodies(near, row)
                s = agenda.time[c]
                if changed:
                    s = meeting_time(system, near, i, j, now)
                    agenda.time[c] = s
                if s < first[0] or (s == first[0] < inf and (i, row) < (first[1], least)):
                    first, least = (s, i, j), row
        if first[0] <= soon:
            return first


@kernel
def first_of_all_pairs(system: System, near: NeighbourList, now: float):
    """As `first_meeting`, where the list does not hold: of all pairs."""
    first, n = (inf, NOBODY, NOBODY), len(system.disks.radius)
    for i in range(n):
        for j in range(i + 1, n):
            first = sooner(first, meeting_time(system, near, i, j, now), i, j)
        for w in range(len(system.world.walls)):
            first = sooner(first, wall_time(system, near, i, w, now), i, -1 - w)
        first = sooner(first, edge_time(system, i, now), i, EDGE)
    return first


@kernel
def sooner(first, s: float, i: int, j: int):
    """The earlier of two meetings."""
    if s < first[0] or (s == first[0] and i < first[1]):
        return s, i, j
    return first


@kernel
def pair_time(system: System, near: NeighbourList, i: int, j: int, now: float) -> float:
    """When two disks meet from `now` on, or inf."""
    x, radius, mass = system.disks.position, system.disks.radius, system.disks.mass
    held = system.acceleration.held
    # Two that met within the step are no farther apart at its end than both ways: also those that
    # have passed through each other.
    dx, dy = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1]
    reach = radius[i] + radius[j] + 2.0 * near.length[STRIDE]
    if dx * dx + dy * dy < reach * reach and not (mass[i] == inf and mass[j] == inf):
        level = min(held[i if mass[i] != inf else j], held[j if mass[j] != inf else i])
        return meeting(path_of(system, i, j), now, LEEWAY[level])
    return inf


@kernel
def wall_time(system: System, near: NeighbourList, i: int, w: int, now: float) -> float:
    """When a disk meets a wall from `now` on, or inf."""
    disks, walls = system.disks, system.world.walls
    x, reach = disks.position, disks.radius[i] + near.length[STRIDE]
    left, right = min(walls[w, 0, 0], walls[w, 1, 0]), max(walls[w, 0, 0], walls[w, 1, 0])
    low, high = min(walls[w, 0, 1], walls[w, 1, 1]), max(walls[w, 0, 1], walls[w, 1, 1])
    beside = left - reach < x[i, 0] < right + reach and low - reach < x[i, 1] < high + reach
    if beside and disks.mass[i] != inf:
        return meeting(path_of(system, i, -1 - w), now, LEEWAY[system.acceleration.held[i]])
    return inf


@kernel
def edge_time(system: System, i: int, now: float) -> float:
    """When the centre of a disk leaves the box from `now` on, or inf."""
    disks, world = system.disks, system.world
    first, x = inf, disks.position
    if disks.mass[i] == inf:
        return inf
    for axis in range(2):
        beyond = max(world.low[axis] - x[i, axis], x[i, axis] - world.high[axis])
        if beyond > 0.0:
            first = min(first, max(now, -beyond / abs(disks.velocity[i, axis])))
    return first


@kernel
def path_of(system: System, i: int, j: int):
    """How disk i moves as seen from disk j, or from the start of wall w = -1 - j: place, velocity,
    acceleration; the wall, which a disk has without length; and the reach."""
    disks, walls, w = system.disks, system.world.walls, -1 - j
    x, v, a = disks.position, disks.velocity, system.acceleration.now
    if j >= 0:
        px, py, pu, pv = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], v[i, 0] - v[j, 0], v[i, 1] - v[j, 1]
        pa, pb = a[i, 0] - a[j, 0], a[i, 1] - a[j, 1]
        return px, py, pu, pv, pa, pb, 0.0, 0.0, disks.radius[i] + disks.radius[j]
    px, py = x[i, 0] - walls[w, 0, 0], x[i, 1] - walls[w, 0, 1]
    along, up = walls[w, 1, 0] - walls[w, 0, 0], walls[w, 1, 1] - walls[w, 0, 1]
    return px, py, v[i, 0], v[i, 1], a[i, 0], a[i, 1], along, up, disks.radius[i]


@kernel
def contact(path, s: float) -> tuple[float, float, float, float]:
    """At s: the gap in m, how fast it opens in m/s, and the normal, from the nearest point of the
    other to the disk."""
    x, y, u, v, a, b, along, up, reach = path
    px, py = x + (u + a * s / 2) * s, y + (v + b * s / 2) * s
    if along != 0.0 or up != 0.0:
        part = min(max((px * along + py * up) / (along * along + up * up), 0.0), 1.0)
        px, py = px - part * along, py - part * up
    distance = sqrt(px * px + py * py)
    nx, ny = (px / distance, py / distance) if distance > 0.0 else (1.0, 0.0)
    return distance - reach, (u + a * s) * nx + (v + b * s) * ny, nx, ny


@compiled
def meeting(path, since: float, leeway: float) -> float:
    """The first s from `since` to 0 at which the gap is closed and closes on, or inf, also where it
    ends within the leeway."""
    low, high = since, 0.0
    closing, opening = contact(path, low)[1] < 0.0, contact(path, high)[1] >= 0.0
    if opening and not closing:
        return inf
    # it turns in between: from closing to opening, or, as a ball thrown up, the other way
    if opening == closing:
        turn = turning_time(path, low, high)
        low, high = (low, turn) if closing else (turn, high)
    if contact(path, high)[0] >= -leeway * path[8]:
        return inf
    return low if contact(path, low)[0] <= 0.0 else closing_time(path, low, high)


@compiled
def turning_time(path, low: float, high: float) -> float:
    """Where the gap turns: its least or greatest value, but for rounding. By secants; of an end
    that stays, half the rate counts (Illinois: Dowell and Jarratt, BIT 11, 168, 1971)."""
    at_low, at_high, stays, s = contact(path, low)[1], contact(path, high)[1], 0, low
    for _ in range(50):
        s = high - at_high * (high - low) / (at_high - at_low)
        rate = contact(path, s)[1]
        if abs(rate) * (high - low) < 2.0**-55 * path[8]:
            break
        if (rate < 0.0) == (at_low < 0.0):
            at_high *= 0.5 if stays > 0 else 1.0
            low, at_low, stays = s, rate, 1
        else:
            at_low *= 0.5 if stays < 0 else 1.0
            high, at_high, stays = s, rate, -1
    return s


@compiled
def closing_time(path, low: float, high: float) -> float:
    """Where a gap that is open at low and closed at high closes: Newton, halving where that would
    leave the bracket."""
    s = high
    for _ in range(100):
        gap, rate, _, _ = contact(path, s)
        if gap > 0.0:
            low = s
        else:
            high = s
        next_s = s - gap / rate
        if not low < next_s < high:
            next_s = (low + high) / 2
        if next_s == s or not low < next_s < high:
            break
        s = next_s
    return s
