"""The event engine's loop: take the earliest record, let its event happen, renew the records of who took part."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from scenarios.compiled import inlined, kernel
from scenarios.event_impacts import collide, collide_wall
from scenarios.event_kernels import (
    ACCUMULATION,
    AX,
    AY,
    COUNT,
    CX,
    CY,
    DONE,
    EDGE,
    EPOCH,
    HITS,
    LAST,
    LOG_FULL,
    MARK_HITS,
    MARK_TIME,
    NOBODY,
    OWN_CODE,
    OWN_TIME,
    OX,
    PAIR_TIME,
    PARTNER,
    PARTNER_COUNT,
    RADIUS,
    REENTRY,
    ULPS,
    VX,
    VY,
    WALL,
    WEIGHT,
    WRAP,
    Disks,
    Grid,
    Ints,
    Rules,
    T,
    X,
    Y,
    find_own,
    find_pair,
    fly,
    link,
    settle,
    unlink,
)
from scenarios.event_queue import put
from scenarios.model import Array

BASE, END = 0, 1  # clock: s at which the present epoch began, s at which the answer ends
LOGGED, WHO, WHOM = 0, 1, 2  # told: rows in the log; the disks of the end


@kernel
def advance(d: Disks, g: Grid, rules: Rules, clock: Array, until: float, log: Array, told: Ints) -> int:
    """Let everything up to `until` s happen; log (h, 4) gets t, i, j or -1 - wall, impulse of every hit.

    Returns DONE; LOG_FULL, to be called again with told[LOGGED] = 0; or ACCUMULATION or REENTRY, with clock[END],
    told[WHO] and told[WHOM] when and for whom the answer ends.
    """
    while True:
        i: Any = np.int64(d.tree[1])
        now = d.key[i]
        if clock[BASE] + now > until:
            return DONE
        if told[LOGGED] == len(log):
            return LOG_FULL
        if now > EPOCH:
            begin_epoch(d, clock)
            continue
        j, fresh = -1, True
        x0, x1, y0, y1 = -1, 1, -1, 1
        fly(d, i, now, rules.falling)
        if d.row[i, PAIR_TIME] <= d.row[i, OWN_TIME]:
            if d.tag[d.tag[i, PARTNER], COUNT] == d.tag[i, PARTNER_COUNT]:
                j = d.tag[i, PARTNER]
                fly(d, j, now, rules.falling)
                impulse = collide(d, g, i, j, rules.restitution)
                if note(d, clock, log, told, i, j, impulse):
                    return ACCUMULATION
        else:
            code = d.tag[i, OWN_CODE]
            if code >= WALL:
                w, part = (code - WALL) // 3, (code - WALL) % 3
                impulse = collide_wall(d, rules, i, w, part)
                if note(d, clock, log, told, i, -1 - w, impulse):
                    return ACCUMULATION
            elif code >= WRAP:
                side = code - WRAP
                d.row[i, side // 2] = rules.wrap[1 - side % 2, side // 2]
                change(d, i)
                unlink(d, g, i)
                settle(d, g, i)
                told[WHO], told[WHOM], clock[END] = i, covered(d, i), clock[BASE] + now
                if told[WHOM] >= 0:
                    return REENTRY
            else:
                side, fresh = code - EDGE, rules.mixed
                cross(d, g, i, side // 2, side % 2)
                if not fresh:  # the contact in the record still holds: only three cells are new
                    x0, x1 = (-1, 1) if side > 1 else (2 * side - 1, 2 * side - 1)
                    y0, y1 = (-1, 1) if side < 2 else (2 * side - 5, 2 * side - 5)
        for k in (i, j):
            if k >= 0 and (d.row[k, WEIGHT] > 0.0):
                renew(d, g, rules, k, fresh, x0, x1, y0, y1)


@inlined
def renew(d: Disks, g: Grid, rules: Rules, i: int, fresh: bool, x0: int, x1: int, y0: int, y1: int) -> None:
    """A new record of disk `i`, which is at the present; fresh: without the contact in the old one."""
    if fresh:
        d.row[i, PAIR_TIME] = inf
    find_own(d, g, rules, i)
    find_pair(d, g, rules, i, x0, x1, y0, y1)
    put(d.key, d.tree, i, min(d.row[i, PAIR_TIME], d.row[i, OWN_TIME]))


@kernel
def change(d: Disks, i: int) -> None:
    """Make void what others know of disk `i`, and forget what it hit last."""
    d.tag[i, COUNT] += 1
    d.tag[i, LAST] = NOBODY


@kernel
def note(d: Disks, clock: Array, log: Array, told: Ints, i: int, j: int, impulse: float) -> bool:
    """Count and log a hit; True if hits of disk `i` follow each other faster than float64 tells times apart."""
    now = d.row[i, T]
    d.tag[i, COUNT] += 1
    if j >= 0 and d.row[j, WEIGHT] > 0.0:
        d.tag[j, COUNT] += 1
    if impulse > 0.0:
        k = told[LOGGED]
        log[k, 0], log[k, 1], log[k, 2], log[k, 3] = clock[BASE] + now, i, j, impulse
        told[LOGGED] += 1
    d.tag[i, MARK_HITS] += 1
    if d.tag[i, MARK_HITS] < HITS:
        return False
    since, d.tag[i, MARK_HITS], d.row[i, MARK_TIME] = now - d.row[i, MARK_TIME], 0, now
    if since > ULPS * np.spacing(clock[BASE] + now):
        return False
    clock[END], told[WHO], told[WHOM] = clock[BASE] + now - since, i, j
    return True


@kernel
def cross(d: Disks, g: Grid, i: int, axis: int, high: int) -> None:
    """Move disk `i` to the next cell; over the end of the grid, shift the disk (torus) or the grid under it."""
    unlink(d, g, i)
    k = d.tag[i, CX + axis] + 2 * high - 1
    laps = -1 if k < 0 else (1 if k == g.shape[axis] else 0)
    d.tag[i, CX + axis] = k - laps * g.shape[axis]
    if g.torus:
        d.row[i, axis] -= laps * g.span[axis]
    else:
        d.row[i, OX + axis] += laps * g.span[axis]
    link(d, g, i)


@kernel
def covered(d: Disks, i: int) -> int:
    """A disk that overlaps disk `i`, -1 if there is none."""
    now = d.row[i, T]
    for j in range(len(d.row)):
        row, t = d.row[j], now - d.row[j, T]
        dx = row[X] + (row[VX] + d.row[j, AX] * t / 2) * t - d.row[i, X]
        dy = row[Y] + (row[VY] + d.row[j, AY] * t / 2) * t - d.row[i, Y]
        reach = row[RADIUS] + d.row[i, RADIUS]
        if j != i and dx * dx + dy * dy < reach * reach:
            return j
    return -1


@kernel
def begin_epoch(d: Disks, clock: Array) -> None:
    """Count all times from EPOCH s later."""
    clock[BASE] += EPOCH
    for i in range(len(d.row)):
        d.row[i, T] -= EPOCH
        d.row[i, PAIR_TIME] -= EPOCH
        d.row[i, OWN_TIME] -= EPOCH
        d.row[i, MARK_TIME] -= EPOCH
        d.key[i] -= EPOCH


@kernel
def begin(d: Disks, g: Grid) -> None:
    """Link all disks to their cells; their first records are made as the first events."""
    for i in range(len(d.row)):
        settle(d, g, i)
        ask_again(d, i, 0.0)


@kernel
def ask_again(d: Disks, i: int, now: float) -> None:
    """Give disk `i` a void contact at `now`: when its time comes, a new record is made."""
    if d.row[i, WEIGHT] > 0.0:
        d.tag[i, PARTNER], d.tag[i, PARTNER_COUNT] = i, -1
        d.row[i, PAIR_TIME] = now
        put(d.key, d.tree, i, now)


@kernel
def pull(d: Disks, clock: Array, i: int, at: float, ax: float, ay: float) -> None:
    """From `at` s on, which must not lie before the last event, let disk `i` accelerate by (ax, ay)."""
    fly(d, i, at - clock[BASE], True)
    d.row[i, AX], d.row[i, AY] = ax, ay
    change(d, i)
    ask_again(d, i, at - clock[BASE])


@kernel
def look(d: Disks, clock: Array, at: float, out: Array) -> None:
    """Position and velocity of all disks at `at` s, not before the last event, into out (n, 4); changes nothing."""
    for i in range(len(d.row)):
        t = at - clock[BASE] - d.row[i, T]
        for axis in range(2):
            v, a = d.row[i, VX + axis], d.row[i, AX + axis]
            out[i, axis] = d.row[i, axis] + (v + a * t / 2) * t
            out[i, 2 + axis] = v + a * t


@kernel
def near_pairs(d: Disks, g: Grid, slack: float, found: Ints) -> int:
    """Pairs of disks that overlap, or nearly: rows (i, j) of found, as many as fit; their number."""
    count = 0
    for i in range(len(d.row)):
        for ox in range(-1, 2):
            for oy in range(-1, 2):
                cx, cy = (d.tag[i, CX] + ox) % g.shape[0], (d.tag[i, CY] + oy) % g.shape[1]
                j = g.head[cx * g.shape[1] + cy]
                while j >= 0:
                    dx = d.row[j, X] - d.row[i, X]
                    dy = d.row[j, Y] - d.row[i, Y]
                    if g.torus:
                        dx -= g.span[0] * np.round(dx / g.span[0])
                        dy -= g.span[1] * np.round(dy / g.span[1])
                    reach = (d.row[i, RADIUS] + d.row[j, RADIUS]) * (1.0 + slack)
                    if i < j and count < len(found) and dx * dx + dy * dy <= reach * reach:
                        found[count, 0], found[count, 1] = i, j
                        count += 1
                    j = d.next[j]
    return count
