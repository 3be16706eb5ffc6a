"""Rest in the event engine: what lies on a wall or in a corner, and collisions between which
nothing flies any more.

A disk whose bounces on a wall have come to their end lies on it: it has neither normal speed nor
normal acceleration, and flies along the wall on a parabola of its own, until a collision, a change
of acceleration or the wall's end takes it off. Between two walls that its acceleration presses it
into it lies still. This is the limit of the bounces, not a model of friction or of sticking.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

from adapters.event_driven.compiled import inlined, kernel
from adapters.event_driven.disks import Grid, Walls
from adapters.event_driven.search import ROUNDING

# so many collisions of one disk, within Rules.crowd or without a flight between them, accumulate
COLLISIONS = 64
# times a bounce that rounding hides, from one that counts to the next: others lie in between
LONGEST = 16


@kernel
def outward(walls: Walls, a: Any, w: int) -> tuple[float, float]:
    """The normal of wall `w` on the side of a disk."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    above = (a.y - walls.segment[w, 1]) * ux - (a.x - walls.segment[w, 0]) * uy > 0.0
    return (-uy, ux) if above else (uy, -ux)


@kernel
def across(walls: Walls, a: Any, w: int, x: float, y: float) -> float:
    """The part of a vector that points away from the face of wall `w` on which a disk touches
    it."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    above = (a.y - walls.segment[w, 1]) * ux - (a.x - walls.segment[w, 0]) * uy > 0.0
    return y * ux - x * uy if above else x * uy - y * ux


@kernel
def lie_down(walls: Walls, a: Any, w: int) -> None:
    """Let a disk that touches wall `w` lie on it: of its speed and its acceleration only what is
    along the wall is left."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    speed, acceleration = a.vx * ux + a.vy * uy, a.free_ax * ux + a.free_ay * uy
    a.vx, a.vy, a.ax, a.ay = speed * ux, speed * uy, acceleration * ux, acceleration * uy
    a.wall, a.bounces = w, 0


@kernel
def take_off(a: Any) -> None:
    """Let a disk that lies on a wall fly again."""
    a.ax, a.ay, a.wall = a.free_ax, a.free_ay, -1


@kernel
def leave_corner(walls: Walls, a: Any) -> None:
    """Let a disk that a collision moves in its corner lie on the wall along which it goes, if that
    bears it."""
    if abs(across(walls, a, a.corner, a.vx, a.vy)) < abs(across(walls, a, a.wall, a.vx, a.vy)):
        a.wall = a.corner
    a.corner = -1
    if across(walls, a, a.wall, a.free_ax, a.free_ay) >= 0.0:
        take_off(a)


@inlined
def jolt(walls: Walls, a: Any) -> None:
    """After a collision from elsewhere a disk stays on its wall only if nothing moves it off or
    into the wall."""
    if a.corner >= 0 and abs(a.vx) + abs(a.vy) > a.noise:
        leave_corner(walls, a)
    if a.wall >= 0:
        if a.corner >= 0:
            a.vx, a.vy = 0.0, 0.0
        elif abs(across(walls, a, a.wall, a.vx, a.vy)) <= a.noise:
            lie_down(walls, a, a.wall)
        else:
            take_off(a)
    elif a.wall < -1:
        a.wall = -1


@kernel
def fall_into(walls: Walls, a: Any, w: int, k: int) -> float:
    """m/s2 at which its acceleration drives a disk into wall `k` while it slides along wall `w`."""
    (nx, ny), (mx, my) = outward(walls, a, w), outward(walls, a, k)
    return (nx * mx + ny * my) * (nx * a.free_ax + ny * a.free_ay) - (
        mx * a.free_ax + my * a.free_ay
    )


@kernel
def blur(a: Any) -> float:
    """m, how far rounding may have left a disk from where it is: of its coordinates, and on its way
    of the time."""
    return ROUNDING * (abs(a.x) + abs(a.y) + a.radius + (abs(a.vx) + abs(a.vy)) * a.t)


@kernel
def slow(a: Any) -> bool:
    """Whether a disk is too slow for a flight that rounding does not hide, even straight against
    its acceleration."""
    speed2, acceleration2 = a.vx * a.vx + a.vy * a.vy, a.free_ax * a.free_ax + a.free_ay * a.free_ay
    return speed2 * speed2 <= 4.0 * acceleration2 * blur(a) * blur(a)


@kernel
def second_wall(walls: Walls, g: Grid, a: Any, w: int) -> int:
    """Another wall near a disk on wall `w` whose face it touches and with which it makes a corner;
    -1: none."""
    c = a.cx * g.shape[1] + a.cy
    for at in range(walls.first[c], walls.first[c + 1]):
        k = walls.of[at]
        (nx, ny), (mx, my) = outward(walls, a, w), outward(walls, a, k)
        dx, dy = a.x - walls.segment[k, 0], a.y - walls.segment[k, 1]
        beside = 0.0 <= dx * walls.segment[k, 2] + dy * walls.segment[k, 3] <= walls.segment[k, 4]
        corner = abs(nx * my - ny * mx) > ROUNDING
        if k != w and beside and corner and dx * mx + dy * my - a.radius <= blur(a):
            return k
    return -1


@kernel
def hold(walls: Walls, a: Any, w: int, k: int) -> float:
    """m/s2, at least, at which its acceleration brings a disk that slides along either wall back
    into the corner; or 0.

    Where it is positive, the acceleration is minus a sum of the two normals.
    """
    return max(min(fall_into(walls, a, w, k), fall_into(walls, a, k, w)), 0.0)


@kernel
def lie_still(walls: Walls, a: Any, w: int, k: int, trapped: bool) -> bool:
    """Let a disk lie still in the corner of walls `w` and `k` that holds it, if it is too slow to
    leave; whether so.

    It is too slow where its speed lifts it off neither wall by more than rounding, v2 / 2 <= hold
    times blur; or where it is `trapped`, as `rattles` says.
    """
    held = hold(walls, a, w, k)
    if held == 0.0 or not (trapped or a.vx * a.vx + a.vy * a.vy <= 2.0 * held * blur(a)):
        return False
    a.vx, a.vy, a.ax, a.ay = 0.0, 0.0, 0.0, 0.0
    a.wall, a.corner, a.bounces = w, k, 0
    return True


@kernel
def rests(walls: Walls, a: Any, w: int, k: int, crowded: bool, trapped: bool) -> bool:
    """Let a disk that bounces off wall `w` lie in its corner with wall `k` (-1: none), or on it;
    whether it does.

    On a wall it lies where it has no normal speed left, and where its bounces accumulate: what they
    would still sweep then is less high than a unit in the last place, so that nothing can come
    between them and their limit.
    """
    if k >= 0 and lie_still(walls, a, w, k, trapped):
        return True
    over = (
        a.bounces >= COLLISIONS
        if crowded or trapped
        else abs(across(walls, a, w, a.vx, a.vy)) <= a.noise
    )
    if not over or (a.wall >= 0 and k < 0) or across(walls, a, w, a.free_ax, a.free_ay) >= 0.0:
        return False
    lie_down(walls, a, w)
    return True


@kernel
def bear(walls: Walls, a: Any) -> None:
    """After a change of its acceleration: let a disk lie still in its corner, or on the wall that
    still bears it, or fly."""
    w, k = a.wall, a.corner
    a.corner = -1
    if k >= 0:
        if lie_still(walls, a, w, k, False):
            return
        if across(walls, a, w, a.free_ax, a.free_ay) >= 0.0 or fall_into(walls, a, w, k) > 0.0:
            w = k
    if w >= 0 and across(walls, a, w, a.free_ax, a.free_ay) < 0.0:
        lie_down(walls, a, w)
    else:
        take_off(a)


@kernel
def rattles(run: Any, a: Any, closing: float, acceleration: float, counts: bool) -> bool:
    """Whether a disk that has just collided, closing at so many m/s, rattles between what it
    touches.

    A bounce that gets no higher than `blur` is none that float64 can play: v2 / 2 <= g blur, where
    g is the largest acceleration on those who take part, and what bends the way round a disk. It
    takes sqrt(8 blur / g) at most. COLLISIONS collisions in a row that count, with no more than
    LONGEST times as long for each, have no end. What counts is a collision with another thing than
    the one before: those with one thing die out by themselves, but where e is too near 1 for that.
    """
    run.acceleration = max(run.acceleration, acceleration)
    g = run.acceleration + (a.vx * a.vx + a.vy * a.vy) / a.radius
    if closing * closing > 2.0 * g * blur(a) + a.noise * a.noise:
        run.collisions, run.acceleration = 0, 0.0
        return False
    if run.collisions == 0:
        run.start = a.t
    run.collisions += counts
    if run.collisions < COLLISIONS:
        return False
    run.collisions = 0
    return (a.t - run.start) * sqrt(g) <= LONGEST * COLLISIONS * sqrt(8.0 * blur(a))
