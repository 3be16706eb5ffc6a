"""Friction in the event engine: the tangential impulse of a collision, and the sliding or rolling
of a disk that rests on a wall.

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

from crosscheck2d.adapters.event_driven.compiled import kernel
from crosscheck2d.adapters.event_driven.disks import SLIP_END, Arena, Spins
from crosscheck2d.adapters.event_driven.rest import normal_component, outward
from crosscheck2d.adapters.event_driven.search import ROUNDING, image
from crosscheck2d.scenarios.model import Array


@kernel
def carry_rotation(s: Any, now: float) -> None:
    """Carry the rotation of a disk to `now`."""
    t = now - s.t
    s.angle += (s.spin + s.rate * t / 2) * t
    s.spin += s.rate * t
    s.t = now


@kernel
def limited(wanted: float, most: float) -> float:
    """`wanted`, limited to `most` either way."""
    return min(max(wanted, -most), most)


@kernel
def apply_disk_friction(arena: Arena, i: int, j: int, impulse: float) -> None:
    """Apply friction in a collision of disks i and j; impulse: N s along the normal."""
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
    """Apply friction in a collision of disk i with a wall: part 0 is its face, 1 its start, 2 its
    end."""
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
    """Apply an impulse (jx, jy) N s to the rim of a disk; its angular impulse is r `kick`,
    clockwise."""
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
    """Predict the end of the slip of disk i, which is at its own time, if that comes before its
    other events on its own."""
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
    """End the slip of disk i on its wall: it rolls, if friction is large enough."""
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
