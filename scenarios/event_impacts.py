"""What a hit does in the event engine: Newton's restitution along the line of centres, without friction; and rest.

A disk whose bounces on a wall have come to their end lies on it: it has neither normal speed nor normal pull, and flies
along the wall on a parabola of its own, until a hit, a change of pull or the wall's end takes it off. This is the limit
of the bounces, not a model of friction or of sticking.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

from scenarios.compiled import inlined, kernel
from scenarios.event_disks import Walls
from scenarios.event_search import ROUNDING, image


@inlined
def collide(a: Any, b: Any, i: int, j: int, shift: tuple[float, float], restitution: float) -> tuple[float, float]:
    """Hit of disks i and j that are in contact; impulse N s, 0 if they do not close in, and cosine of the angle.

    v_i -= q w_i dr, v_j += q w_j dr, q = -(1 + e) b / (dr.dr (w_i + w_j)): a normal that is made a unit vector by a
    square root would let the energy drift by 1.5e-17 a hit.
    """
    dx, dy = b.x - a.x + image(b.cx - a.cx, shift[0]), b.y - a.y + image(b.cy - a.cy, shift[1])
    ux, uy = b.vx - a.vx, b.vy - a.vy
    closing = dx * ux + dy * uy
    a.last, b.last = j, i
    a.noise = b.noise = ROUNDING * (abs(a.vx) + abs(a.vy) + abs(b.vx) + abs(b.vy))
    if closing >= 0.0:
        return 0.0, 0.0
    distance2 = dx * dx + dy * dy
    q = -(1.0 + restitution) * closing / (distance2 * (a.weight + b.weight))
    a.vx -= q * a.weight * dx
    a.vy -= q * a.weight * dy
    b.vx += q * b.weight * dx
    b.vy += q * b.weight * dy
    return q * sqrt(distance2), min(-closing / sqrt(distance2 * (ux * ux + uy * uy)), 1.0)


@kernel
def collide_wall(walls: Walls, a: Any, w: int, part: int, restitution: float) -> tuple[float, float]:
    """Hit of a disk on a wall it touches, set exactly beside the face; as `collide`."""
    ux, uy, speed2 = walls.segment[w, 2], walls.segment[w, 3], a.vx * a.vx + a.vy * a.vy
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
        return 0.0, 0.0
    distance2 = dx * dx + dy * dy
    q = -(1.0 + restitution) * closing / distance2
    a.vx += q * dx
    a.vy += q * dy
    return q * sqrt(distance2) / a.weight, min(-closing / sqrt(distance2 * speed2), 1.0)


@kernel
def across(walls: Walls, a: Any, w: int, x: float, y: float) -> float:
    """The part of a vector that points away from the face of wall `w` on which a disk touches it."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    above = (a.y - walls.segment[w, 1]) * ux - (a.x - walls.segment[w, 0]) * uy > 0.0
    return y * ux - x * uy if above else x * uy - y * ux


@kernel
def lie_down(walls: Walls, a: Any, w: int) -> None:
    """Let a disk that touches wall `w` lie on it: of its speed and its pull only what is along the wall is left."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    speed, pull = a.vx * ux + a.vy * uy, a.pull_x * ux + a.pull_y * uy
    a.vx, a.vy, a.ax, a.ay = speed * ux, speed * uy, pull * ux, pull * uy
    a.wall, a.bounces = w, 0


@kernel
def take_off(a: Any) -> None:
    """Let a disk that lies on a wall fly again."""
    a.ax, a.ay, a.wall = a.pull_x, a.pull_y, -1


@inlined
def jolt(walls: Walls, a: Any) -> None:
    """After a hit from elsewhere a disk stays on its wall only if nothing moves it off or into the wall."""
    if a.wall >= 0:
        if abs(across(walls, a, a.wall, a.vx, a.vy)) <= a.noise:
            lie_down(walls, a, a.wall)
        else:
            take_off(a)
    elif a.wall < -1:
        a.wall = -1
