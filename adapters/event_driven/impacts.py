"""Collisions of the event engine: Newton's restitution along the line of centres, the tangential
impulse of friction; and the sliding or rolling of a disk that rests on a wall.

Collisions are logged and counted, to detect accumulation: collisions with less time between them
than float64 resolves, or without flights between them.

In a collision the impulse of friction is min(mu J_n, |slip| / K) against the slip of the contact
points, K = 1/m_a + 1/m_b + r_a2/I_a + r_b2/I_b. For disks this is exact: the normal passes through
their centres, so that the normal impulse changes no slip, and the impulse of friction no speed
along the normal (Foerster, Louge, Chang & Allia, Phys. Fluids 6, 1108, 1994; Stronge, Impact
Mechanics, 2000, ch. 3). On a wall the force of friction is mu N against the slip; without slip it
is the force that keeps the slip 0, at most mu N.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from crosscheck2d.adapters.event_driven.compiled import inlined, kernel
from crosscheck2d.adapters.event_driven.disks import (
    ACCUMULATION,
    BASE,
    END_DISK,
    END_PARTNER,
    GOES_ON,
    LOGGED,
    NOBODY,
    SLIP_END,
    STOP,
    Arena,
    Spins,
    Walls,
)
from crosscheck2d.adapters.event_driven.rest import (
    COLLISIONS,
    check_rest,
    corner_acceleration,
    normal_component,
    outward,
    rattles,
    rests,
    second_wall,
    slow,
    touched_part,
)
from crosscheck2d.adapters.event_driven.search import ROUNDING, image
from crosscheck2d.scenarios.model import Array


@inlined
def collide(
    a: Any, b: Any, i: int, j: int, shift: tuple[float, float], restitution: float
) -> float:
    """Collision of disks i and j that are in contact; its impulse N s, 0 if they do not close in.

    v_i -= q w_i dr, v_j += q w_j dr, q = -(1 + e) b / (dr.dr (w_i + w_j)): a unit
    normal, which needs a square root, would let the energy drift by 1.5e-17 per collision.
    """
    dx, dy = b.x - a.x + image(b.cx - a.cx, shift[0]), b.y - a.y + image(b.cy - a.cy, shift[1])
    ux, uy = b.vx - a.vx, b.vy - a.vy
    closing = dx * ux + dy * uy
    a.last, b.last = j, i
    a.noise = b.noise = ROUNDING * (abs(a.vx) + abs(a.vy) + abs(b.vx) + abs(b.vy))
    if closing >= 0.0:
        return 0.0
    distance2 = dx * dx + dy * dy
    q = -(1.0 + restitution) * closing / (distance2 * (a.weight + b.weight))
    a.vx -= q * a.weight * dx
    a.vy -= q * a.weight * dy
    b.vx += q * b.weight * dx
    b.vy += q * b.weight * dy
    return q * sqrt(distance2)


@kernel
def collide_wall(walls: Walls, a: Any, w: int, part: int, restitution: float) -> float:
    """Collision of a disk with a wall that it touches, as `collide`; at a face the disk is placed
    exactly on it."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    dx, dy = a.x - walls.segment[w, 0], a.y - walls.segment[w, 1]
    a.bounces = 0 if part else (a.bounces + 1 if a.last == -1 - w else 1)
    a.last, a.noise = -1 - w, ROUNDING * (abs(a.vx) + abs(a.vy))
    if part == 0:
        height = dy * ux - dx * uy
        away = a.radius * (1.0 if height > 0.0 else -1.0) - height
        a.x -= away * uy
        a.y += away * ux
        dx, dy = (-uy, ux) if height > 0.0 else (uy, -ux)
    elif part == 2:
        dx, dy = dx - walls.segment[w, 4] * ux, dy - walls.segment[w, 4] * uy
    closing = dx * a.vx + dy * a.vy
    if closing >= 0.0:
        return 0.0
    distance2 = dx * dx + dy * dy
    q = -(1.0 + restitution) * closing / distance2
    a.vx += q * dx
    a.vy += q * dy
    return q * sqrt(distance2) / a.weight


@inlined
def log_collision(arena: Arena, now: float, i: int, j: int, impulse: float) -> None:
    log, k = arena.log, arena.counters[LOGGED]
    log[k, 0], log[k, 1], log[k, 2], log[k, 3] = arena.clock[BASE] + now, i, j, impulse
    arena.counters[LOGGED] += 1


@inlined
def set_end(arena: Arena, now: float, i: int, j: int) -> None:
    # Set when and for which disks the answer ends, should the status say that it does.
    arena.clock[STOP] = arena.clock[BASE] + now
    arena.counters[END_DISK], arena.counters[END_PARTNER] = i, j


@inlined
def count_and_log(arena: Arena, a: Any, i: int, j: int, impulse: float) -> bool:
    """Count and log a collision; True if the collisions of disk `i` come faster than float64 can
    resolve their times."""
    a.count += 1
    if impulse > 0.0:
        log_collision(arena, a.t, i, j, impulse)
    a.mark_collisions += 1
    if a.mark_collisions < COLLISIONS:
        return False
    since, a.mark_collisions, a.mark_time = a.t - a.mark_time, 0, a.t
    if since > arena.rules.accumulation_ulps * np.spacing(arena.clock[BASE] + a.t):
        return False
    set_end(arena, a.t - since, i, j)
    return True


@inlined
def invalidate(a: Any) -> None:
    a.count += 1
    a.last = NOBODY


@kernel
def rattles_on_disk(
    run: Any, a: Any, b: Any, restitution: float, impulse: float, counts: bool
) -> bool:
    if a.weight == 0.0:
        return False
    run.walls = 0
    of_a = a.free_ax * a.free_ax + a.free_ay * a.free_ay
    of_b = b.free_ax * b.free_ax + b.free_ay * b.free_ay
    closing = impulse * (a.weight + b.weight) / (1.0 + restitution)
    return rattles(run, a, closing, sqrt(max(of_a, of_b)), counts)


@kernel
def collide_with_wall(arena: Arena, i: int, w: int, part: int) -> int:
    """Disk `i` bounces off a wall, or comes to rest on its face or in a corner.

    Bounces to and fro in a corner go on, however many there are at one instant, until the disk is
    slow.
    """
    a, walls, run = arena.disks[i], arena.walls, arena.runs[i]
    if part > 0:
        w, part = touched_part(walls, arena.grid, a, w, part)
    changed = a.last != -1 - w
    impulse = collide_wall(walls, a, w, part, arena.rules.restitution)
    rubs = arena.rules.friction > 0.0
    if rubs:
        apply_wall_friction(arena, i, w, part, impulse)
    check_rest(walls, a)
    accumulates = count_and_log(arena, a, i, -1 - w, impulse)
    run.walls += 1
    walls_only = run.walls >= COLLISIONS  # no other disk takes part
    trapped = False
    if arena.rules.falling or arena.rules.restitution < 1.0:
        closing = impulse * a.weight / (1.0 + arena.rules.restitution)
        acceleration = sqrt(a.free_ax * a.free_ax + a.free_ay * a.free_ay)
        trapped = rattles(run, a, closing, acceleration, changed or arena.rules.lasting)
    mixed, corner = arena.rules.mixed, -1
    # With friction a second contact that lasts is not modelled.
    if part == 0 and not rubs and (accumulates or trapped or (mixed and slow(a))):
        corner = second_wall(walls, arena.grid, a, w)
    may_rest = part == 0 and mixed and (walls_only or not trapped)
    at_rest = may_rest and rests(walls, a, w, corner, accumulates, trapped)
    if rubs:
        update_wall_friction(arena, i)
    if at_rest:
        if impulse == 0.0:  # a contact that begins without a collision
            log_collision(arena, a.t, i, -1 - w, 0.0)
        return GOES_ON
    if trapped:
        set_end(arena, run.start, i, -1 - w)
    to_and_fro = False
    if corner >= 0 and walls_only and (a.free_ax != 0.0 or a.free_ay != 0.0):
        to_and_fro = not slow(a) or corner_acceleration(walls, a, w, corner) > 0.0
    return ACCUMULATION if trapped or (accumulates and not to_and_fro) else GOES_ON


@kernel
def carry_rotation(s: Any, now: float) -> None:
    t = now - s.t
    s.angle += (s.spin + s.rate * t / 2) * t
    s.spin += s.rate * t
    s.t = now


@kernel
def limited(wanted: float, most: float) -> float:
    return min(max(wanted, -most), most)


@kernel
def apply_disk_friction(arena: Arena, i: int, j: int, impulse: float) -> None:
    """impulse: N s along the normal."""
    a, b, s, r = arena.disks[i], arena.disks[j], arena.spins[i], arena.spins[j]
    carry_rotation(s, a.t)
    carry_rotation(r, a.t)
    dx = b.x - a.x + image(b.cx - a.cx, arena.grid.shift[0])
    dy = b.y - a.y + image(b.cy - a.cy, arena.grid.shift[1])
    distance = sqrt(dx * dx + dy * dy)
    tx, ty = -dy / distance, dx / distance
    slip = tx * (b.vx - a.vx) + ty * (b.vy - a.vy) - a.radius * s.spin - b.radius * r.spin
    inverse_effective_mass = (
        a.weight + b.weight + a.radius**2 * s.inverse_inertia + b.radius**2 * r.inverse_inertia
    )
    kick = limited(-slip / inverse_effective_mass, arena.rules.friction * impulse)
    apply_impulse(a, s, -kick * tx, -kick * ty, kick)
    apply_impulse(b, r, kick * tx, kick * ty, kick)
    noise = ROUNDING * abs(kick) * (a.weight + b.weight)
    a.noise += noise
    b.noise += noise


@kernel
def apply_wall_friction(arena: Arena, i: int, w: int, part: int, impulse: float) -> None:
    """part 0 of the wall is its face, 1 its start, 2 its end; impulse: N s along the normal."""
    a, s, walls = arena.disks[i], arena.spins[i], arena.walls
    carry_rotation(s, a.t)
    if part == 0:
        nx, ny = outward(walls, a, w)
    else:
        nx, ny = a.x - walls.segment[w, 0], a.y - walls.segment[w, 1]
        if part == 2:
            nx -= walls.segment[w, 4] * walls.segment[w, 2]
            ny -= walls.segment[w, 4] * walls.segment[w, 3]
        distance = sqrt(nx * nx + ny * ny)
        nx, ny = nx / distance, ny / distance
    # The disk is on the side of its normal, so that its rim moves at r spin along (ny, -nx).
    tx, ty = ny, -nx
    slip = tx * a.vx + ty * a.vy + a.radius * s.spin
    inverse_effective_mass = a.weight + a.radius**2 * s.inverse_inertia
    kick = limited(-slip / inverse_effective_mass, arena.rules.friction * impulse)
    apply_impulse(a, s, kick * tx, kick * ty, -kick)
    a.noise += ROUNDING * abs(kick) * a.weight


@kernel
def apply_impulse(a: Any, s: Any, jx: float, jy: float, kick: float) -> None:
    # Apply an impulse (jx, jy) N s to the rim of a disk; its angular impulse is r `kick`,
    # clockwise.
    a.vx += a.weight * jx
    a.vy += a.weight * jy
    s.spin -= a.radius * s.inverse_inertia * kick


@kernel
def slip_on(arena: Arena, i: int) -> tuple[float, float, float]:
    """The direction in which a positive spin moves the contact point of disk i on its wall; and its
    slip, m/s."""
    a, s = arena.disks[i], arena.spins[i]
    nx, ny = outward(arena.walls, a, a.wall)
    return ny, -nx, ny * a.vx - nx * a.vy + a.radius * s.spin


@kernel
def update_wall_friction(arena: Arena, i: int) -> None:
    """Update the acceleration of disk i by friction: after it has come to rest on a wall or left
    it, or when its acceleration has changed."""
    a, s = arena.disks[i], arena.spins[i]
    carry_rotation(s, a.t)
    s.rate, s.sliding = s.free_rate, 0
    if a.wall < 0:
        return
    tx, ty, slip = slip_on(arena, i)
    if abs(slip) > ROUNDING * (abs(a.vx) + abs(a.vy) + a.radius * abs(s.spin)):
        s.sliding = 1 if slip > 0.0 else -1
    along = a.free_ax * tx + a.free_ay * ty
    most = -arena.rules.friction * normal_component(arena.walls, a, a.wall, a.free_ax, a.free_ay)
    if s.sliding == 0:
        driven = along + a.radius * s.free_rate
        wanted = -driven / (1.0 + a.radius**2 * s.inverse_inertia / a.weight)
        force = limited(wanted, most)
        if force != wanted:
            s.sliding = 1 if driven > 0.0 else -1
    else:
        force = -s.sliding * most
    a.ax, a.ay = (along + force) * tx, (along + force) * ty
    s.rate += a.radius * s.inverse_inertia * force / a.weight


@kernel
def predict_slip_end(arena: Arena, i: int) -> None:
    a, s = arena.disks[i], arena.spins[i]
    if a.wall < 0 or s.sliding == 0:
        return
    carry_rotation(s, a.t)
    tx, ty, slip = slip_on(arena, i)
    slower = -s.sliding * (a.ax * tx + a.ay * ty + a.radius * s.rate)
    if slower > 0.0 and a.t + abs(slip) / slower < a.own_time:
        a.own_time, a.own_code = a.t + abs(slip) / slower, SLIP_END


@kernel
def roll(arena: Arena, i: int) -> None:
    a, s = arena.disks[i], arena.spins[i]
    carry_rotation(s, a.t)
    s.spin -= slip_on(arena, i)[2] / a.radius
    update_wall_friction(arena, i)
    a.count += 1


@kernel
def rotation_at(spins: Spins, base: float, at: float, out: Array) -> None:
    """Angle and angular velocity of all disks at `at` s, not before the last event, into out (n,
    2); changes nothing."""
    for i in range(len(spins)):
        s = spins[i]
        t = at - base - s.t
        out[i, 0], out[i, 1] = s.angle + (s.spin + s.rate * t / 2) * t, s.spin + s.rate * t
