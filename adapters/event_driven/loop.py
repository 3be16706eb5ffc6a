"""The event engine's loop: take the earliest record, let its event happen, renew the records of who
took part."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from adapters.event_driven.compiled import inlined, kernel, pasted
from adapters.event_driven.disks import (
    ACCUMULATION,
    BASE,
    DONE,
    EDGE,
    END,
    GOES_ON,
    GRIP,
    LEFT,
    LOG_FULL,
    LOGGED,
    NONE,
    REENTRY,
    ROUND_END,
    WALL,
    WHOM,
    WRAP,
    Arena,
    Disks,
    Grid,
    Ints,
    Links,
    Runs,
    Scenery,
    Spins,
    cross,
    fly,
    settle,
    unlink,
)
from adapters.event_driven.friction import drag, find_grip, roll, rub_disks
from adapters.event_driven.impacts import (
    change,
    collide,
    collision_wall,
    note,
    rattles_on_disk,
    stop,
)
from adapters.event_driven.queue import Tree, put
from adapters.event_driven.rest import across, bear, jolt, take_off
from adapters.event_driven.search import ALL, ROUNDING, find_own, find_pair
from scenarios.model import Array

EPOCH = 256.0  # s; the clock starts again after as many, so that its last place stays small


@kernel
def advance(arena: Arena, scenery: Scenery, until: float) -> int:
    """Let everything up to `until` s happen.

    Returns DONE; GOES_ON after counters[LEFT] events, or LOG_FULL, to be called again with
    counters[LOGGED] = 0; or ACCUMULATION, REENTRY or ROUND_END, with clock[STOP], counters[WHO] and
    counters[WHOM] when and for whom the answer ends.
    """
    tree, clock = arena.tree, arena.clock
    while arena.counters[LEFT] > 0:
        arena.counters[LEFT] -= 1
        now: float = tree[1].time
        i: Any = np.int64(tree[1].who)
        if clock[BASE] + now > until:
            return DONE
        if arena.counters[LOGGED] == len(arena.log):
            return LOG_FULL
        if now > EPOCH:
            begin_epoch(arena.disks, tree, arena.runs, arena.spins, clock)
            continue
        status, partner, side = happen(arena, scenery, i, now)
        if status != GOES_ON:
            return status
        renew_both(arena, scenery, i, partner, side)
    return GOES_ON


@pasted
def happen(arena: Arena, scenery: Scenery, i: int, now: float) -> tuple[int, int, int]:
    """Let the event in the record of disk `i` happen at `now`.

    Returns a status as `advance`; the other disk of a collision, or -1; the side over which the
    disk came into a cell, its contact still the next, or ALL.
    """
    a = arena.disks[i]
    fly(a, now, scenery)
    if a.pair_time <= a.own_time:
        j: Any = np.int64(a.partner)
        b = arena.disks[j]
        if b.count == a.partner_count:
            fly(b, now, scenery)
            return collision(arena, scenery, i, j), j, ALL
        return GOES_ON, -1, ALL  # the record is stale
    if a.own_code < WRAP:
        side = a.own_code - EDGE
        cross(arena.disks, arena.head, arena.grid, i, side)
        # the contact in the record still holds: three cells are new
        return GOES_ON, -1, ALL if len(scenery) and arena.rules.mixed else side
    return alone(arena, i) if len(scenery) else GOES_ON, -1, ALL


@pasted
def renew_both(arena: Arena, scenery: Scenery, i: int, j: int, side: int) -> None:
    """New records of who took part; in a loop, for one copy of the search in the machine code."""
    while i >= 0:
        if arena.disks[i].weight > 0.0:
            renew(arena, scenery, i, side == ALL, side)
        i, j = j, -1


@pasted
def renew(arena: Arena, scenery: Scenery, i: int, fresh: bool, beyond: int) -> None:
    """A new record of disk `i`, which is at the present; fresh: without the contact in the old
    one."""
    a = arena.disks[i]
    if fresh:
        a.pair_time = inf
    find_own(arena, scenery, a)
    if len(scenery) and arena.rules.friction > 0.0:
        find_grip(arena, i)
    find_pair(arena, scenery, i, beyond)
    put(arena.tree, i, min(a.pair_time, a.own_time))


@pasted
def collision(arena: Arena, scenery: Scenery, i: int, j: int) -> int:
    """Disks i and j collide."""
    a, b = arena.disks[i], arena.disks[j]
    new_to_a, new_to_b = a.last != j, b.last != i
    impulse = collide(a, b, i, j, arena.grid.shift, arena.rules.restitution)
    if len(scenery) and arena.rules.friction > 0.0:
        rub_disks(arena, i, j, impulse)
    if len(scenery) and arena.rules.falling:
        jolt(arena.walls, a)
        jolt(arena.walls, b)
    if len(scenery) and arena.rules.friction > 0.0:
        drag(arena, i)
        drag(arena, j)
    if b.weight > 0.0:
        b.count += 1
    crowded = note(arena, a, i, j, impulse)
    if len(scenery) and (arena.rules.falling or arena.rules.restitution < 1.0):
        e, lasting = arena.rules.restitution, arena.rules.lasting
        if rattles_on_disk(arena.runs[i], a, b, e, impulse, new_to_a or lasting):
            crowded = True
            stop(arena, arena.runs[i].start, i, j)
        if rattles_on_disk(arena.runs[j], b, a, e, impulse, new_to_b or lasting):
            crowded = True
            stop(arena, arena.runs[j].start, j, i)
    return ACCUMULATION if crowded else GOES_ON


@kernel
def alone(arena: Arena, i: int) -> int:
    """What disk `i` does by itself but for changing its cell: it meets a wall, the wrap, the end of
    its wall, or slides no more."""
    code = arena.disks[i].own_code
    if code >= WALL:
        return collision_wall(arena, i, (code - WALL) // 3, (code - WALL) % 3)
    if code == GRIP:
        roll(arena, i)
        return GOES_ON
    return leave(arena, i) if code == END else wrap(arena, i, code - WRAP)


@kernel
def leave(arena: Arena, i: int) -> int:
    """Disk `i` reaches the end of the wall it lies on: it flies off, unless it is too slow and
    would turn about it."""
    a, w = arena.disks[i], int(arena.disks[i].wall)
    speed2, press = a.vx * a.vx + a.vy * a.vy, -across(arena.walls, a, w, a.free_ax, a.free_ay)
    take_off(a)
    a.wall, a.count = -2 - w, a.count + 1
    if arena.rules.friction > 0.0:
        drag(arena, i)
    a.last, a.noise = -1 - w, ROUNDING * (abs(a.vx) + abs(a.vy))
    stop(arena, a.t, i, -1 - w)
    return GOES_ON if speed2 >= press * a.radius else ROUND_END


@kernel
def wrap(arena: Arena, i: int, side: int) -> int:
    """Disk `i` leaves the wrap box over a side and comes in over the opposite one."""
    a = arena.disks[i]
    if side < 2:
        a.x = arena.walls.wrap[1 - side, 0]
    else:
        a.y = arena.walls.wrap[3 - side, 1]
    change(a)
    unlink(arena.disks, arena.head, arena.grid, i)
    settle(arena.disks, arena.head, arena.grid, i)
    stop(arena, a.t, i, covered(arena.disks, i))
    return REENTRY if arena.counters[WHOM] >= 0 else GOES_ON


@kernel
def covered(disks: Disks, i: int) -> int:
    """A disk that overlaps disk `i`, -1 if there is none."""
    a = disks[i]
    for j in range(len(disks)):
        b = disks[j]
        t = a.t - b.t
        dx = b.x + (b.vx + b.ax * t / 2) * t - a.x
        dy = b.y + (b.vy + b.ay * t / 2) * t - a.y
        reach = b.radius + a.radius
        if j != i and dx * dx + dy * dy < reach * reach:
            return j
    return -1


@kernel
def begin_epoch(disks: Disks, tree: Tree, runs: Runs, spins: Spins, clock: Array) -> None:
    """Count all times from EPOCH s later."""
    clock[BASE] += EPOCH
    for i in range(len(disks)):
        a = disks[i]
        a.t -= EPOCH
        a.pair_time -= EPOCH
        a.own_time -= EPOCH
        a.mark_time -= EPOCH
        runs[i].start -= EPOCH
        spins[i].t -= EPOCH
    for k in range(len(tree)):
        tree[k].time -= EPOCH


@kernel
def begin(disks: Disks, head: Links, tree: Tree, g: Grid) -> None:
    """Link all disks to their cells; their first records are made as the first events."""
    for i in range(len(disks)):
        settle(disks, head, g, i)
        ask_again(disks[i], tree, i, 0.0)


@inlined
def ask_again(a: Any, tree: Tree, i: int, now: float) -> None:
    """Give disk `i` a void contact at `now`: when its time comes, a new record is made."""
    if a.weight > 0.0:
        a.partner, a.partner_count, a.pair_time = i, -1, now
        put(tree, i, now)


@kernel
def accelerate(
    arena: Arena, scenery: Scenery, i: int, at: float, ax: float, ay: float, rate: float
) -> None:
    """From `at` s on, which must not lie before the last event, let disk `i` accelerate by (ax,
    ay), and its spin by `rate`, which only friction makes use of."""
    a, now = arena.disks[i], at - arena.clock[BASE]
    fly(a, now, scenery)
    a.free_ax, a.free_ay = ax, ay
    bear(arena.walls, a)
    if arena.rules.friction > 0.0:
        arena.spins[i].free_rate = rate
        drag(arena, i)
    change(a)
    ask_again(a, arena.tree, i, now)


@kernel
def look(disks: Disks, base: float, at: float, out: Array) -> None:
    """Position and velocity of all disks at `at` s, not before the last event, into out (n, 4);
    changes nothing."""
    for i in range(len(disks)):
        a = disks[i]
        t = at - base - a.t
        out[i, 0], out[i, 1] = a.x + (a.vx + a.ax * t / 2) * t, a.y + (a.vy + a.ay * t / 2) * t
        out[i, 2], out[i, 3] = a.vx + a.ax * t, a.vy + a.ay * t


@kernel
def near_pairs(disks: Disks, head: Links, g: Grid, slack: float, found: Ints) -> int:
    """Pairs of disks that overlap, or nearly: rows (i, j) of found, as many as fit; their
    number."""
    count = 0
    for i in range(len(disks)):
        a = disks[i]
        for around in range(9):
            cx, cy = (a.cx + around // 3 - 1) % g.shape[0], (a.cy + around % 3 - 1) % g.shape[1]
            j = head[cx * g.shape[1] + cy]
            while j != NONE:
                b = disks[j]
                dx, dy = b.x - a.x, b.y - a.y
                if g.torus:
                    dx -= g.span[0] * np.rint(dx / g.span[0])
                    dy -= g.span[1] * np.rint(dy / g.span[1])
                reach = (a.radius + b.radius) * (1.0 + slack)
                if i < j and count < len(found) and dx * dx + dy * dy <= reach * reach:
                    found[count, 0], found[count, 1] = i, j
                    count += 1
                j = b.next
    return count
