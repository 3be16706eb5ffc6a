"""Rest in the event engine: disks that rest on a wall or in a corner, and collisions without
flights between them.

A disk whose bounces on a wall have died out rests on it: without normal speed and normal
acceleration it moves along the wall on a parabola, until a collision, a change of acceleration or
the end of the wall. In a corner of two walls that its acceleration presses it into it is at rest.
This is the limit of the bounces, not a model of friction or of sticking.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

from crosscheck2d.adapters.event_driven.compiled import inlined, kernel
from crosscheck2d.adapters.event_driven.disks import Grid, Walls
from crosscheck2d.adapters.event_driven.search import ROUNDING

# so many collisions of one disk within Rules.accumulation_ulps, or without flights between them,
# accumulate
COLLISIONS = 64
# the longest mean time from one counted collision to the next, in bounces that rounding hides:
# collisions that do not count lie in between
LONGEST = 16


@kernel
def outward(walls: Walls, a: Any, w: int) -> tuple[float, float]:
    """The unit normal of wall `w`, towards a disk."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    above = (a.y - walls.segment[w, 1]) * ux - (a.x - walls.segment[w, 0]) * uy > 0.0
    return (-uy, ux) if above else (uy, -ux)


@kernel
def normal_component(walls: Walls, a: Any, w: int, x: float, y: float) -> float:
    nx, ny = outward(walls, a, w)
    return nx * x + ny * y


@kernel
def rest_on(walls: Walls, a: Any, w: int) -> None:
    """Let a disk that touches wall `w` rest on it: it keeps only the components of its velocity and
    acceleration along the wall."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    speed, acceleration = a.vx * ux + a.vy * uy, a.free_ax * ux + a.free_ay * uy
    a.vx, a.vy, a.ax, a.ay = speed * ux, speed * uy, acceleration * ux, acceleration * uy
    a.wall, a.bounces = w, 0


@kernel
def next_in_line(walls: Walls, g: Grid, a: Any) -> int:
    """The wall that carries a disk on, farthest beyond the end of its wall that it has reached; -1:
    none does."""
    ux, uy, length = walls.segment[a.wall, 2], walls.segment[a.wall, 3], walls.segment[a.wall, 4]
    x, y = walls.segment[a.wall, 0], walls.segment[a.wall, 1]
    if 2.0 * ((a.x - x) * ux + (a.y - y) * uy) < length:
        ux, uy = -ux, -uy
    else:
        x, y = x + length * ux, y + length * uy
    farthest, found = 0.0, -1
    c = a.cx * g.shape[1] + a.cy
    for at in range(walls.first[c], walls.first[c + 1]):
        k = walls.of[at]
        dx, dy = walls.segment[k, 0] - x, walls.segment[k, 1] - y
        start = dx * ux + dy * uy
        end = start + walls.segment[k, 4] * (walls.segment[k, 2] * ux + walls.segment[k, 3] * uy)
        slack = ROUNDING * (abs(x) + abs(y) + length + walls.segment[k, 4])
        beyond = min(start, end) <= slack < max(start, end)
        if walls.surface[k] == walls.surface[a.wall] and beyond and max(start, end) > farthest:
            farthest, found = max(start, end), k
    return found


@kernel
def take_off(a: Any) -> None:
    a.ax, a.ay, a.wall = a.free_ax, a.free_ay, -1


@inlined
def check_rest(walls: Walls, a: Any) -> None:
    """After a collision, let a disk stay at rest on its wall only if it has no normal speed
    there."""
    if a.corner >= 0 and abs(a.vx) + abs(a.vy) > a.noise:
        # it is moved out of its corner: it rests on the wall along which it moves, if on any
        off_corner = abs(normal_component(walls, a, a.corner, a.vx, a.vy))
        if off_corner < abs(normal_component(walls, a, a.wall, a.vx, a.vy)):
            a.wall = a.corner
        a.corner = -1
        if normal_component(walls, a, a.wall, a.free_ax, a.free_ay) >= 0.0:
            take_off(a)
    if a.wall >= 0:
        if a.corner >= 0:
            a.vx, a.vy = 0.0, 0.0
        elif abs(normal_component(walls, a, a.wall, a.vx, a.vy)) <= a.noise:
            rest_on(walls, a, a.wall)
        else:
            take_off(a)
    elif a.wall < -1:
        a.wall = -1


@kernel
def acceleration_into(walls: Walls, a: Any, w: int, k: int) -> float:
    """m/s2, the acceleration into wall `k` of a disk that slides along wall `w`."""
    (nx, ny), (mx, my) = outward(walls, a, w), outward(walls, a, k)
    along_n, along_m = nx * a.free_ax + ny * a.free_ay, mx * a.free_ax + my * a.free_ay
    return (nx * mx + ny * my) * along_n - along_m


@kernel
def position_error(a: Any) -> float:
    """m, the rounding error of the position of a disk: of its coordinates, and of the time at its
    speed."""
    return ROUNDING * (abs(a.x) + abs(a.y) + a.radius + (abs(a.vx) + abs(a.vy)) * a.t)


@kernel
def slow(a: Any) -> bool:
    """Whether a disk is so slow that its flight, even straight against its acceleration, is lower
    than the rounding error."""
    speed2, acceleration2 = a.vx * a.vx + a.vy * a.vy, a.free_ax * a.free_ax + a.free_ay * a.free_ay
    return speed2 * speed2 <= 4.0 * acceleration2 * position_error(a) * position_error(a)


@kernel
def on_face(walls: Walls, a: Any, w: int) -> bool:
    """Whether a disk touches the face of wall `w`: its foot lies on the wall, and its gap is below
    the rounding error."""
    ux, uy = walls.segment[w, 2], walls.segment[w, 3]
    dx, dy = a.x - walls.segment[w, 0], a.y - walls.segment[w, 1]
    beside = 0.0 <= dx * ux + dy * uy <= walls.segment[w, 4]
    return beside and abs(dy * ux - dx * uy) - a.radius <= position_error(a)


@kernel
def second_wall(walls: Walls, g: Grid, a: Any, w: int) -> int:
    """Another wall whose face the disk touches and that makes a corner with wall `w`; -1: none."""
    c = a.cx * g.shape[1] + a.cy
    for at in range(walls.first[c], walls.first[c + 1]):
        k = walls.of[at]
        (nx, ny), (mx, my) = outward(walls, a, w), outward(walls, a, k)
        if k != w and abs(nx * my - ny * mx) > ROUNDING and on_face(walls, a, k):
            return k
    return -1


@kernel
def touched_part(walls: Walls, g: Grid, a: Any, w: int, part: int) -> tuple[int, int]:
    """What a disk that meets an end of wall `w` (part 1 its start, 2 its end) touches there, a wall
    and its part: the face of a wall through this end, if the foot of the disk lies on that wall; or
    the nearer end of `w`.

    It meets that first; but for a foot within 1e-8 radii of the end both times are the same in
    float64, and the normal of the end would be wrong by so much.
    """
    ux, uy, length = walls.segment[w, 2], walls.segment[w, 3], walls.segment[w, 4]
    dx, dy = a.x - walls.segment[w, 0], a.y - walls.segment[w, 1]
    nearer = 1 if 2.0 * (dx * ux + dy * uy) < length else 2
    along = 0.0 if nearer == 1 else length
    x, y = walls.segment[w, 0] + along * ux, walls.segment[w, 1] + along * uy
    if (a.x - x) * a.vx + (a.y - y) * a.vy < 0.0:
        part = nearer
    rounding = ROUNDING * (abs(a.vx) + abs(a.vy))
    c = a.cx * g.shape[1] + a.cy
    for at in range(walls.first[c], walls.first[c + 1]):
        k = walls.of[at]
        ux, uy = walls.segment[k, 2], walls.segment[k, 3]
        height = (y - walls.segment[k, 1]) * ux - (x - walls.segment[k, 0]) * uy
        approaches = normal_component(walls, a, k, a.vx, a.vy) < -rounding
        if abs(height) <= position_error(a) and approaches and on_face(walls, a, k):
            return k, 0
    return w, part


@kernel
def corner_acceleration(walls: Walls, a: Any, w: int, k: int) -> float:
    """m/s2, the least acceleration back into the corner of a disk that slides along either wall; 0
    if it is driven out.

    Where it is positive, the acceleration is minus a positive combination of the two normals.
    """
    return max(min(acceleration_into(walls, a, w, k), acceleration_into(walls, a, k, w)), 0.0)


@kernel
def rest_in_corner(walls: Walls, a: Any, w: int, k: int, trapped: bool) -> bool:
    """Let a disk rest in the corner of walls `w` and `k` if its acceleration holds it there and it
    is too slow to leave; returns whether it rests.

    It is too slow if its speed cannot lift it off either wall by more than the rounding error,
    v2 / 2 <= corner_acceleration times position_error; or if it is `trapped`, see `rattles`.
    """
    held = corner_acceleration(walls, a, w, k)
    if held == 0.0 or not (trapped or a.vx * a.vx + a.vy * a.vy <= 2.0 * held * position_error(a)):
        return False
    a.vx, a.vy, a.ax, a.ay = 0.0, 0.0, 0.0, 0.0
    a.wall, a.corner, a.bounces = w, k, 0
    return True


@kernel
def rests(walls: Walls, a: Any, w: int, k: int, accumulates: bool, trapped: bool) -> bool:
    """Let a disk that bounces off wall `w` rest in its corner with wall `k` (-1: none), or on the
    wall; returns whether it rests.

    It rests on a wall if it has no normal speed, or if its bounces accumulate: the remaining ones
    are lower than a unit in the last place, so that no other contact can come between.
    """
    if k >= 0 and rest_in_corner(walls, a, w, k, trapped):
        return True
    over = abs(normal_component(walls, a, w, a.vx, a.vy)) <= a.noise
    if accumulates or trapped:
        over = a.bounces >= COLLISIONS
    pressed = normal_component(walls, a, w, a.free_ax, a.free_ay) < 0.0
    if not over or (a.wall >= 0 and k < 0) or not pressed:
        return False
    rest_on(walls, a, w)
    return True


@kernel
def update_support(walls: Walls, a: Any) -> None:
    """After a change of its acceleration: let a disk rest in its corner, or on a wall onto which it
    is still pressed, or fly."""
    w, k = a.wall, a.corner
    a.corner = -1
    if k >= 0:
        if rest_in_corner(walls, a, w, k, False):
            return
        off = normal_component(walls, a, w, a.free_ax, a.free_ay) >= 0.0
        if off or acceleration_into(walls, a, w, k) > 0.0:
            w = k
    if w >= 0 and normal_component(walls, a, w, a.free_ax, a.free_ay) < 0.0:
        rest_on(walls, a, w)
    else:
        take_off(a)


@kernel
def rattles(run: Any, a: Any, closing: float, acceleration: float, counts: bool) -> bool:
    """Whether a disk that has just collided, at a closing speed of so many m/s, rattles: collides
    in turn with the bodies that it touches, without flights between.

    Float64 cannot resolve a bounce that is lower than position_error: v2 / 2 <= g position_error,
    where g is the largest acceleration of the disks that take part, plus v2 / r of the path around
    a disk. Such a bounce lasts sqrt(8 position_error / g) at most. COLLISIONS counted collisions in
    a row, each within LONGEST times that, have no end. A collision counts if its partner is not
    that
    of the one before: bounces on a single partner die out, unless e is too near 1.
    """
    run.acceleration = max(run.acceleration, acceleration)
    g = run.acceleration + (a.vx * a.vx + a.vy * a.vy) / a.radius
    if closing * closing > 2.0 * g * position_error(a) + a.noise * a.noise:
        run.collisions, run.acceleration = 0, 0.0
        return False
    if run.collisions == 0:
        run.start = a.t
    run.collisions += counts
    if run.collisions < COLLISIONS:
        return False
    run.collisions = 0
    return (a.t - run.start) * sqrt(g) <= LONGEST * COLLISIONS * sqrt(8.0 * position_error(a))
