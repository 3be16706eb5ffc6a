"""The event loop: take the earliest record, carry out its event, and predict the next events of the
disks in it."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from crosscheck2d.adapters.event_driven.compiled import inlined, inlined_early, kernel
from crosscheck2d.adapters.event_driven.disks import (
    ACCUMULATION,
    BASE,
    DONE,
    EDGE,
    END,
    END_PARTNER,
    GOES_ON,
    LEFT,
    LOG_FULL,
    LOGGED,
    NONE,
    REENTRY,
    ROUND_END,
    SLIP_END,
    WALL,
    WRAP,
    Arena,
    Disks,
    Grid,
    Ints,
    Links,
    Runs,
    Scenery,
    Spins,
    Tree,
    cross,
    fly,
    link_by_position,
    put,
    unlink,
)
from crosscheck2d.adapters.event_driven.impacts import (
    apply_disk_friction,
    collide,
    collide_with_wall,
    count_and_log,
    invalidate,
    predict_slip_end,
    rattles_on_disk,
    roll,
    set_end,
    update_wall_friction,
)
from crosscheck2d.adapters.event_driven.rest import (
    check_rest,
    next_in_line,
    normal_component,
    rest_on,
    take_off,
    update_support,
)
from crosscheck2d.adapters.event_driven.search import ALL, ROUNDING, find_pair, next_edge, next_own
from crosscheck2d.scenarios.model import Array

EPOCH = 256.0  # s after which the clock restarts at 0, so that the last place of times stays small


@kernel
def advance(arena: Arena, scenery: Scenery, until: float) -> int:
    """Carry out all events up to `until` s.

    Returns DONE; GOES_ON after counters[LEFT] events, or LOG_FULL, to be called again with
    counters[LOGGED] = 0; or ACCUMULATION, REENTRY or ROUND_END: then clock[STOP],
    counters[END_DISK] and counters[END_PARTNER] say when and for which disks the answer ends.
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
        status, partner, side = carry_out(arena, scenery, i, now)
        if status != GOES_ON:
            return status
        predict(arena, scenery, i, partner, side)
    return GOES_ON


@inlined_early
def carry_out(arena: Arena, scenery: Scenery, i: int, now: float) -> tuple[int, int, int]:
    """Carry out the event in the record of disk `i` at `now`.

    Returns a status as `advance`; the other disk of a collision, or -1; and the edge over which the
    disk entered a cell, if only the cells beyond it need a search, else ALL.
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
        # the contact in the record is still valid: only three cells are new
        return GOES_ON, -1, ALL if len(scenery) and arena.rules.mixed else side
    return own_event(arena, i) if len(scenery) else GOES_ON, -1, ALL


@inlined_early
def predict(arena: Arena, scenery: Scenery, i: int, j: int, side: int) -> None:
    """Make new records for the disks i and j (-1: none) of an event at the present time; in a loop,
    so that the machine code holds one copy of the search."""
    while i >= 0:
        a = arena.disks[i]
        if a.weight > 0.0:
            if side == ALL:  # else the contact in the old record is still valid
                a.pair_time = inf
            if len(scenery):
                best, code = next_own(arena.grid, arena.walls, arena.rules.wrapped, a)
            else:
                best, code = next_edge(arena.grid, a)
            a.own_time, a.own_code = a.t + best, code
            if len(scenery) and arena.rules.friction > 0.0:
                predict_slip_end(arena, i)
            find_pair(arena, scenery, i, side)
            put(arena.tree, i, min(a.pair_time, a.own_time))
        i, j = j, -1


@inlined_early
def collision(arena: Arena, scenery: Scenery, i: int, j: int) -> int:
    a, b = arena.disks[i], arena.disks[j]
    new_to_a, new_to_b = a.last != j, b.last != i
    impulse = collide(a, b, i, j, arena.grid.shift, arena.rules.restitution)
    if len(scenery) and arena.rules.friction > 0.0:
        apply_disk_friction(arena, i, j, impulse)
    if len(scenery) and arena.rules.falling:
        check_rest(arena.walls, a)
        check_rest(arena.walls, b)
    if len(scenery) and arena.rules.friction > 0.0:
        update_wall_friction(arena, i)
        update_wall_friction(arena, j)
    if b.weight > 0.0:
        b.count += 1
    accumulates = count_and_log(arena, a, i, j, impulse)
    if len(scenery) and (arena.rules.falling or arena.rules.restitution < 1.0):
        e, lasting = arena.rules.restitution, arena.rules.lasting
        if rattles_on_disk(arena.runs[i], a, b, e, impulse, new_to_a or lasting):
            accumulates = True
            set_end(arena, arena.runs[i].start, i, j)
        if rattles_on_disk(arena.runs[j], b, a, e, impulse, new_to_b or lasting):
            accumulates = True
            set_end(arena, arena.runs[j].start, j, i)
    return ACCUMULATION if accumulates else GOES_ON


@kernel
def own_event(arena: Arena, i: int) -> int:
    code = arena.disks[i].own_code
    if code >= WALL:
        return collide_with_wall(arena, i, (code - WALL) // 3, (code - WALL) % 3)
    if code == SLIP_END:
        roll(arena, i)
        return GOES_ON
    return leave(arena, i) if code == END else wrap(arena, i, code - WRAP)


@kernel
def leave(arena: Arena, i: int) -> int:
    """Disk `i` reaches the end of the wall it rests on: it goes on along the next wall in line, or
    flies off, unless it is so slow that it would turn about the end."""
    a, w = arena.disks[i], int(arena.disks[i].wall)
    following = next_in_line(arena.walls, arena.grid, a)
    if following >= 0:
        rest_on(arena.walls, a, following)
        if arena.rules.friction > 0.0:
            update_wall_friction(arena, i)
        a.count += 1
        return GOES_ON
    speed2 = a.vx * a.vx + a.vy * a.vy
    press = -normal_component(arena.walls, a, w, a.free_ax, a.free_ay)
    take_off(a)
    a.wall, a.count = -2 - w, a.count + 1
    if arena.rules.friction > 0.0:
        update_wall_friction(arena, i)
    a.last, a.noise = -1 - w, ROUNDING * (abs(a.vx) + abs(a.vy))
    set_end(arena, a.t, i, -1 - w)
    return GOES_ON if speed2 >= press * a.radius else ROUND_END


@kernel
def wrap(arena: Arena, i: int, side: int) -> int:
    a = arena.disks[i]
    if side < 2:
        a.x = arena.walls.wrap[1 - side, 0]
    else:
        a.y = arena.walls.wrap[3 - side, 1]
    invalidate(a)
    unlink(arena.disks, arena.head, arena.grid, i)
    link_by_position(arena.disks, arena.head, arena.grid, i)
    set_end(arena, a.t, i, overlapping(arena.disks, i))
    return REENTRY if arena.counters[END_PARTNER] >= 0 else GOES_ON


@kernel
def overlapping(disks: Disks, i: int) -> int:
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
    # Move the origin of all times by EPOCH s.
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
    # Link all disks to their cells; their first records are made by the first events.
    for i in range(len(disks)):
        link_by_position(disks, head, g, i)
        schedule_search(disks[i], tree, i, 0.0)


@inlined
def schedule_search(a: Any, tree: Tree, i: int, now: float) -> None:
    # Give disk `i` a stale contact at `now`, so that the loop makes a new record for it.
    if a.weight > 0.0:
        a.partner, a.partner_count, a.pair_time = i, -1, now
        put(tree, i, now)


@kernel
def accelerate(
    arena: Arena, scenery: Scenery, i: int, at: float, ax: float, ay: float, rate: float
) -> None:
    """Set the acceleration (ax, ay) of disk `i`, and its angular acceleration `rate`, used with
    friction only, from `at` s on, which must not lie before the last event."""
    a, now = arena.disks[i], at - arena.clock[BASE]
    fly(a, now, scenery)
    a.free_ax, a.free_ay = ax, ay
    update_support(arena.walls, a)
    if arena.rules.friction > 0.0:
        arena.spins[i].free_rate = rate
        update_wall_friction(arena, i)
    invalidate(a)
    schedule_search(a, arena.tree, i, now)


@kernel
def motion_at(disks: Disks, base: float, at: float, out: Array) -> None:
    """Position and velocity of all disks at `at` s, not before the last event, into out (n, 4);
    changes nothing."""
    for i in range(len(disks)):
        a = disks[i]
        t = at - base - a.t
        out[i, 0], out[i, 1] = a.x + (a.vx + a.ax * t / 2) * t, a.y + (a.vy + a.ay * t / 2) * t
        out[i, 2], out[i, 3] = a.vx + a.ax * t, a.vy + a.ay * t


@kernel
def near_pairs(disks: Disks, head: Links, g: Grid, slack: float, found: Ints) -> int:
    """Write the pairs of disks that overlap, or nearly, as rows (i, j) into `found`, as many as
    fit; returns their number."""
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
