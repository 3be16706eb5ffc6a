"""Friction in the event engine: the impulse along the tangent of a collision, and what lies on a
wall slides or rolls.

A collision changes the slip of the contact points by min(mu J_n, |slip| / K) against it, K = 1/m_a
+ 1/m_b + r_a2/I_a + r_b2/I_b. For disks that is exact: the normal leads through their centres, so
that the normal impulse changes no slip and that of friction no speed along the normal (Foerster,
Louge, Chang & Allia, Phys. Fluids 6, 1108, 1994; Stronge, Impact Mechanics, 2000, ch. 3). On a wall
friction is mu N against the slip until there is none, then what keeps it so, mu N at most.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

from adapters.event_driven.compiled import kernel
from adapters.event_driven.disks import GRIP, Arena, Spins
from adapters.event_driven.rest import across, outward
from adapters.event_driven.search import ROUNDING, image
from scenarios.model import Array


@kernel
def turn_to(s: Any, now: float) -> None:
    """Bring the turning of a disk to `now`."""
    t = now - s.t
    s.angle += (s.spin + s.rate * t / 2) * t
    s.spin += s.rate * t
    s.t = now


@kernel
def limited(wanted: float, most: float) -> float:
    """`wanted`, but no more than `most` either way."""
    return min(max(wanted, -most), most)


@kernel
def rub_disks(arena: Arena, i: int, j: int, impulse: float) -> None:
    """What friction adds to a collision of disks i and j with so many N s along the normal."""
    a, b, s, r = arena.disks[i], arena.disks[j], arena.spins[i], arena.spins[j]
    turn_to(s, a.t)
    turn_to(r, a.t)
    dx = b.x - a.x + image(b.cx - a.cx, arena.grid.shift[0])
    dy = b.y - a.y + image(b.cy - a.cy, arena.grid.shift[1])
    distance = sqrt(dx * dx + dy * dy)
    tx, ty = -dy / distance, dx / distance
    slip = tx * (b.vx - a.vx) + ty * (b.vy - a.vy) - a.radius * s.spin - b.radius * r.spin
    softness = a.weight + b.weight + a.radius**2 * s.turns + b.radius**2 * r.turns
    kick = limited(-slip / softness, arena.rules.friction * impulse)
    apply_impulse(a, s, -kick * tx, -kick * ty, kick)
    apply_impulse(b, r, kick * tx, kick * ty, kick)
    noise = ROUNDING * abs(kick) * (a.weight + b.weight)
    a.noise += noise
    b.noise += noise


@kernel
def rub_wall(arena: Arena, i: int, w: int, part: int, impulse: float) -> None:
    """The same of disk i and a wall: part 0 is its face, 1 its start, 2 its end."""
    a, s, walls = arena.disks[i], arena.spins[i], arena.walls
    turn_to(s, a.t)
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
    softness = a.weight + a.radius**2 * s.turns
    kick = limited(-slip / softness, arena.rules.friction * impulse)
    apply_impulse(a, s, kick * tx, kick * ty, -kick)
    a.noise += ROUNDING * abs(kick) * a.weight


@kernel
def apply_impulse(a: Any, s: Any, jx: float, jy: float, kick: float) -> None:
    """An impulse (jx, jy) N s on the rim of a disk, which turns it by r `kick`, clockwise."""
    a.vx += a.weight * jx
    a.vy += a.weight * jy
    s.spin -= a.radius * s.turns * kick


@kernel
def slip_on(arena: Arena, i: int) -> tuple[float, float, float]:
    """The direction of the rim of disk i where it touches the wall it lies on, for a spin above 0;
    and its slip, m/s."""
    a, s = arena.disks[i], arena.spins[i]
    nx, ny = outward(arena.walls, a, a.wall)
    return ny, -nx, ny * a.vx - nx * a.vy + a.radius * s.spin


@kernel
def drag(arena: Arena, i: int) -> None:
    """From now on friction acts on disk i if it lies on a wall, which it has begun to do, or where
    what acts on it has changed."""
    a, s = arena.disks[i], arena.spins[i]
    turn_to(s, a.t)
    s.rate, s.sliding = s.free_rate, 0
    if a.wall < 0:
        return
    tx, ty, slip = slip_on(arena, i)
    if abs(slip) > ROUNDING * (abs(a.vx) + abs(a.vy) + a.radius * abs(s.spin)):
        s.sliding = 1 if slip > 0.0 else -1
    along = a.free_ax * tx + a.free_ay * ty
    most = -arena.rules.friction * across(arena.walls, a, a.wall, a.free_ax, a.free_ay)
    if s.sliding == 0:
        driven = along + a.radius * s.free_rate
        wanted = -driven / (1.0 + a.radius**2 * s.turns / a.weight)
        force = limited(wanted, most)
        if force != wanted:
            s.sliding = 1 if driven > 0.0 else -1
    else:
        force = -s.sliding * most
    a.ax, a.ay = (along + force) * tx, (along + force) * ty
    s.rate += a.radius * s.turns * force / a.weight


@kernel
def find_grip(arena: Arena, i: int) -> None:
    """When disk i, which is at its own time, slides no more, if that is what it does next by
    itself."""
    a, s = arena.disks[i], arena.spins[i]
    if a.wall < 0 or s.sliding == 0:
        return
    turn_to(s, a.t)
    tx, ty, slip = slip_on(arena, i)
    slower = -s.sliding * (a.ax * tx + a.ay * ty + a.radius * s.rate)
    if slower > 0.0 and a.t + abs(slip) / slower < a.own_time:
        a.own_time, a.own_code = a.t + abs(slip) / slower, GRIP


@kernel
def roll(arena: Arena, i: int) -> None:
    """Disk i has lost its slip on the wall it lies on: it rolls, if friction is enough for that."""
    a, s = arena.disks[i], arena.spins[i]
    turn_to(s, a.t)
    s.spin -= slip_on(arena, i)[2] / a.radius
    drag(arena, i)
    a.count += 1


@kernel
def look_turned(spins: Spins, base: float, at: float, out: Array) -> None:
    """Angle and angular velocity of all disks at `at` s, not before the last event, into out (n,
    2); changes nothing."""
    for i in range(len(spins)):
        s = spins[i]
        t = at - base - s.t
        out[i, 0], out[i, 1] = s.angle + (s.spin + s.rate * t / 2) * t, s.spin + s.rate * t
