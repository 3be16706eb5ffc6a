"""The collisions of a step in the order in which they happen: exact flight, and every impulse where
and when two meet.

The same law of impact as `exercise`, and no projection: all fly to the end of the step on their
parabolas; then, as long as two met on the way, the two that met first go back to where they
touched, get the impulse there, and fly to the end anew. Times count back from the end of the step:
s = 0 is the end, s = -dt the start.

Every search asks the pairs of a neighbour list. Where collisions accumulate (a ball that bounces
ever lower, a stack) the work is bounded: a bounce that would last less than a `REST` of a step is
the last one, and after `MOST` collisions a disk the rest of a step goes unresolved, which shows as
overlap. One disk at rest can use up the collisions of all: the force that holds it leaves a
rounding of its speed, and it meets its wall again at the same instant. Another disk at rest then
falls and slides freely for that step. Alone on its wall none does.

It knows friction. What holds a disk at rest does so to the end of the step, also if a collision
lifts the disk off before. Compiled by numba, as `exercise` is.
"""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from reference_impl.compiled import compiled, inlined, kernel, pasted
from reference_impl.neighbour_list import (
    EDGES,
    PAIRS,
    ROUNDING,
    SLACK,
    STRIDE,
    WALLS,
    NeighbourList,
    account_for,
    build_list,
    empty_list,
    holds,
    take_step,
    used_up,
)
from reference_impl.neighbours import moving
from reference_impl.state import Disks, World

REST = 1 / 16  # of a step
MOST = 8  # collisions a disk and step, on average
NOBODY, EDGE = -1, 1 << 30  # in place of a disk: none, and the edge of the world


class Accelerations(NamedTuple):
    """What accelerates the disks: all steps of a call alike, but for what rests on another."""

    steady: np.ndarray  # (n, 2) m/s2, by force and gravity
    now: np.ndarray  # (n, 2) m/s2, and by what holds those at rest until the end of a step
    turning: np.ndarray  # (n,) rad/s2
    moving: np.ndarray  # (m, 2) who moves, as `moving` has it
    strongest: float  # m/s2, of the steady ones


@pasted
def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    """Advance `count` steps of `dt` s; return the collisions as (step, i, j, impulse in N s), wall
    w as j = -1 - w."""
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know what it will hold
    acceleration, k = accelerations_of(disks, world), 0
    near = empty_list(disks.radius, len(world.walls))
    while True:
        k, first = fly_until_meeting(disks, world, acceleration, near, dt, k, count)
        if k == count:
            break
        if used_up(near):
            find_near(disks, world, acceleration.now, near, dt, count - k)
            first = first_meeting(disks, world, acceleration.now, near, -dt)
        if first[1] != NOBODY:
            resolve(disks, world, acceleration, near, dt, k, first, count, collisions)
        k += 1
    if world.friction == 0.0:
        turn(disks, acceleration, dt, count)
    return collisions


@compiled
def accelerations_of(disks: Disks, world: World) -> Accelerations:
    """By force, torque and gravity."""
    steady, turning = np.zeros_like(disks.velocity), np.zeros_like(disks.angle)
    strongest2 = 0.0
    for i in range(len(disks.mass)):
        if disks.mass[i] == inf:
            continue
        ax = world.gravity[0] + disks.force[i, 0] / disks.mass[i]
        ay = world.gravity[1] + disks.force[i, 1] / disks.mass[i]
        steady[i, 0], steady[i, 1] = ax, ay
        strongest2 = max(strongest2, ax * ax + ay * ay)
        turning[i] = disks.torque[i] / disks.inertia[i]
    return Accelerations(
        steady, np.zeros_like(steady), turning, moving(disks.mass), sqrt(strongest2)
    )


@kernel
def fly_until_meeting(  # type: ignore[no-untyped-def]
    disks: Disks,
    world: World,
    acceleration: Accelerations,
    near: NeighbourList,
    dt: float,
    k: int,
    count: int,
):
    """Take steps from step k on until one in which two meet or the list is used up: in that one all
    have flown, and nothing else was done. Returns it and its `first_meeting`, as far as the list
    knows."""
    first = inf, NOBODY, NOBODY
    while k < count:
        fly(disks, acceleration, dt)
        if world.friction > 0.0:
            turn(disks, acceleration, dt, 1)
        take_step(near, acceleration.strongest * dt * dt)
        if used_up(near):
            break
        first = first_meeting(disks, world, acceleration.now, near, -dt)
        if first[1] != NOBODY:
            break
        k += 1
    return k, first


@kernel
def fly(disks: Disks, acceleration: Accelerations, dt: float) -> None:
    """x + v dt + a dt2 / 2 and v + a dt for all, as if nobody met.

    What rounding cuts off is kept for the next time (Kahan, Comm. ACM 8, 40, 1965): hundreds of
    small steps would else round ten times as much as the few flights event by event that they are.
    """
    x, v, cut = (
        disks.position.reshape(-1),
        disks.velocity.reshape(-1),
        disks.remainder.reshape(-1),
    )
    a, steady = acceleration.now.reshape(-1), acceleration.steady.reshape(-1)
    for run in range(len(acceleration.moving)):
        begin, end = np.int64(acceleration.moving[run, 0]), np.int64(acceleration.moving[run, 1])
        for c in range(2 * begin, 2 * end):
            a[c] = steady[c]
            before, way = x[c], v[c] * dt + steady[c] * (dt * dt / 2) + cut[c]
            x[c] = before + way
            cut[c] = way - (x[c] - before)
            v[c] += steady[c] * dt


@kernel
def turn(disks: Disks, acceleration: Accelerations, dt: float, count: int) -> None:
    """The angles and spins of `count` steps: of all at last, as no collision asks for them without
    friction."""
    angle, spin, turning = disks.angle, disks.angular_velocity, acceleration.turning
    for run in range(len(acceleration.moving)):
        begin, end = np.int64(acceleration.moving[run, 0]), np.int64(acceleration.moving[run, 1])
        for _ in range(count):
            for i in range(begin, end):
                angle[i] += spin[i] * dt + turning[i] * (dt * dt / 2)
                spin[i] += turning[i] * dt


@inlined
def resolve(  # type: ignore[no-untyped-def]
    disks: Disks,
    world: World,
    acceleration: Accelerations,
    near: NeighbourList,
    dt: float,
    k: int,
    first,
    count: int,
    collisions: list,
) -> None:
    """Meeting after meeting, from the first on, of a step in which all have flown to its end."""
    for _ in range(MOST * len(disks.radius)):
        now, i, j = first
        if i == NOBODY:
            break
        if j == EDGE:
            carry_over(disks.position, world, i)
            near.length[SLACK] = -inf
        else:
            impulse = collide(disks, world, acceleration.now, i, j, now, dt)
            if impulse > 0.0:
                collisions.append((k, i, j, impulse))
            account_for(near, disks.position, i, way_of(disks, acceleration.now, i, dt))
            if j >= 0:
                account_for(near, disks.position, j, way_of(disks, acceleration.now, j, dt))
        if not holds(near):
            find_near(disks, world, acceleration.now, near, dt, count - k)
        first = first_meeting(disks, world, acceleration.now, near, now)


@compiled
def find_near(  # type: ignore[no-untyped-def]
    disks: Disks, world: World, acceleration, near: NeighbourList, dt: float, left: int
) -> None:
    """Build the list at the end of a step: in the step, each may have been a step away from it."""
    longest = 0.0
    for i in range(len(disks.mass)):
        if disks.mass[i] != inf:
            longest = max(longest, way_of(disks, acceleration, i, dt))
    near.length[STRIDE] = longest
    build_list(near, disks.position, disks.radius, world, left)
    near.length[SLACK] -= longest


@kernel
def way_of(disks: Disks, acceleration, i: int, dt: float) -> float:  # type: ignore[no-untyped-def]
    """m: disk i gets no farther in a step."""
    x, v, a = disks.position, disks.velocity, acceleration
    speed = sqrt(v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1])
    strength = sqrt(a[i, 0] * a[i, 0] + a[i, 1] * a[i, 1])
    return (speed + strength * abs(dt)) * abs(dt) + ROUNDING * max(abs(x[i, 0]), abs(x[i, 1]))


@kernel
def first_meeting(  # type: ignore[no-untyped-def]
    disks: Disks, world: World, acceleration, near: NeighbourList, now: float
) -> tuple[float, int, int]:
    """(s, i, j) of the first meeting from `now` on: of two disks, of a disk and wall j = -1 - w, or
    the edge. Of meetings at the same instant, that of the least i; of a disk, before a wall."""
    first = inf, NOBODY, NOBODY
    if holds(near):
        for p in range(near.found[PAIRS]):
            i, j = int(near.first[p]), int(near.second[p])
            first = sooner(first, of_disks(disks, acceleration, near, i, j, now), i, j)
        for b in range(near.found[WALLS]):
            i, w = int(near.disk[b]), int(near.wall[b])
            first = sooner(first, of_wall(disks, world, acceleration, near, i, w, now), i, -1 - w)
        for e in range(near.found[EDGES]):
            i = int(near.edge[e])
            first = sooner(first, of_edge(disks, world, i, now), i, EDGE)
    else:
        for i in range(len(disks.radius)):
            for j in range(i + 1, len(disks.radius)):
                first = sooner(first, of_disks(disks, acceleration, near, i, j, now), i, j)
            for w in range(len(world.walls)):
                s = of_wall(disks, world, acceleration, near, i, w, now)
                first = sooner(first, s, i, -1 - w)
            first = sooner(first, of_edge(disks, world, i, now), i, EDGE)
    return first


@kernel
def sooner(  # type: ignore[no-untyped-def]
    first, s: float, i: int, j: int
):
    """The earlier of two meetings."""
    if s < first[0] or (s == first[0] and i < first[1]):
        return s, i, j
    return first


@kernel
def of_disks(disks: Disks, acceleration, near: NeighbourList, i: int, j: int, now: float) -> float:  # type: ignore[no-untyped-def]
    """When two disks meet from `now` on, or inf."""
    x, radius, mass = disks.position, disks.radius, disks.mass
    # Who met within the step cannot be farther apart at its end than both ways: passing through is
    # seen, too.
    dx, dy = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1]
    reach = radius[i] + radius[j] + 2.0 * near.length[STRIDE]
    if dx * dx + dy * dy < reach * reach and not (mass[i] == inf and mass[j] == inf):
        return meeting(path_to_disk(x, disks.velocity, acceleration, radius, i, j), now)
    return inf


@kernel
def of_wall(  # type: ignore[no-untyped-def]
    disks: Disks, world: World, acceleration, near: NeighbourList, i: int, w: int, now: float
) -> float:
    """When a disk meets a wall from `now` on, or inf."""
    x, walls, reach = disks.position, world.walls, disks.radius[i] + near.length[STRIDE]
    left, right = min(walls[w, 0, 0], walls[w, 1, 0]), max(walls[w, 0, 0], walls[w, 1, 0])
    low, high = min(walls[w, 0, 1], walls[w, 1, 1]), max(walls[w, 0, 1], walls[w, 1, 1])
    beside = left - reach < x[i, 0] < right + reach and low - reach < x[i, 1] < high + reach
    if beside and disks.mass[i] != inf:
        return meeting(
            path_to_wall(x, disks.velocity, acceleration, disks.radius, i, walls, w), now
        )
    return inf


@kernel
def of_edge(disks: Disks, world: World, i: int, now: float) -> float:
    """When the centre of a disk leaves the box from `now` on, or inf."""
    first, x = inf, disks.position
    if disks.mass[i] == inf:
        return inf
    for axis in range(2):
        beyond = max(world.low[axis] - x[i, axis], x[i, axis] - world.high[axis])
        if beyond > 0.0:
            first = min(first, max(now, -beyond / abs(disks.velocity[i, axis])))
    return first


@compiled
def move(x, remainder, i: int, axis: int, way: float) -> None:  # type: ignore[no-untyped-def]
    """Move disk i as `fly` does, and keep what rounding cuts off."""
    before, way = x[i, axis], way + remainder[i, axis]
    x[i, axis] = before + way
    remainder[i, axis] = way - (x[i, axis] - before)


@kernel
def path_to_disk(x, v, acceleration, radius, i: int, j: int):  # type: ignore[no-untyped-def]
    """How disk i moves as seen from disk j, which is a wall without length."""
    return (
        x[i, 0] - x[j, 0],
        x[i, 1] - x[j, 1],
        v[i, 0] - v[j, 0],
        v[i, 1] - v[j, 1],
        acceleration[i, 0] - acceleration[j, 0],
        acceleration[i, 1] - acceleration[j, 1],
        0.0,
        0.0,
        radius[i] + radius[j],
    )


@kernel
def path_to_wall(x, v, acceleration, radius, i: int, walls, w: int):  # type: ignore[no-untyped-def]
    """How disk i moves as seen from the start of wall w: place, velocity, acceleration; the wall,
    and the reach."""
    return (
        x[i, 0] - walls[w, 0, 0],
        x[i, 1] - walls[w, 0, 1],
        v[i, 0],
        v[i, 1],
        acceleration[i, 0],
        acceleration[i, 1],
        walls[w, 1, 0] - walls[w, 0, 0],
        walls[w, 1, 1] - walls[w, 0, 1],
        radius[i],
    )


@kernel
def contact(path, s: float) -> tuple[float, float, float, float]:  # type: ignore[no-untyped-def]
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
def lift(path, s: float, nx: float, ny: float) -> float:  # type: ignore[no-untyped-def]
    """m/s2 at which the gap opens at s as one slides past the other: v2 / distance, and nothing
    along a wall's face.

    Two that touch and slide past each other part, however hard they are pressed together, if that
    is more.
    """
    x, y, u, v, a, b, along, up, _ = path
    px, py = x + (u + a * s / 2) * s, y + (v + b * s / 2) * s
    part = 0.0
    if along != 0.0 or up != 0.0:
        part = (px * along + py * up) / (along * along + up * up)
        if 0.0 < part < 1.0:
            return 0.0
        part = min(max(part, 0.0), 1.0)
    slide = (v + b * s) * nx - (u + a * s) * ny
    distance = sqrt((px - part * along) ** 2 + (py - part * up) ** 2)
    return slide * slide / distance if distance > 0.0 else 0.0


@compiled
def meeting(path, since: float) -> float:  # type: ignore[no-untyped-def]
    """The first s from `since` to 0 at which the gap is closed and closes on, or inf."""
    low, high = since, 0.0
    closing, opening = contact(path, low)[1] < 0.0, contact(path, high)[1] >= 0.0
    if opening and not closing:
        return inf
    # it turns in between: from closing to opening, or, as a ball thrown up, the other way
    if opening == closing:
        turn = halved(path, low, high, closing)
        low, high = (low, turn) if closing else (turn, high)
    if contact(path, high)[0] >= 0.0:
        return inf
    return low if contact(path, low)[0] <= 0.0 else root(path, low, high)


@compiled
def halved(path, low: float, high: float, closing: bool) -> float:  # type: ignore[no-untyped-def]
    """Where the gap turns, to a 2^-50 of the step: its least or greatest value does not tell the
    difference."""
    for _ in range(50):
        middle = (low + high) / 2
        if (contact(path, middle)[1] < 0.0) == closing:
            low = middle
        else:
            high = middle
    return high if closing else low


@compiled
def root(path, low: float, high: float) -> float:  # type: ignore[no-untyped-def]
    """Where a gap that is open at low and closed at high closes: Newton, halving where that would
    leave the bracket."""
    s = high
    for _ in range(100):
        gap, rate, _, _ = contact(path, s)
        if gap > 0.0:
            low = s
        else:
            high = s
        following = s - gap / rate
        if not low < following < high:
            following = (low + high) / 2
        if following == s or not low < following < high:
            break
        s = following
    return s


@compiled
def collide(disks: Disks, world: World, acceleration, i: int, j: int, s: float, dt: float) -> float:  # type: ignore[no-untyped-def]
    """The impulse J = -(1 + e) (vi - vj).n / (1/mi + 1/mj) at s, and both on their new ways to the
    end; returns J."""
    x, v, e = disks.position, disks.velocity, world.restitution
    if j >= 0:
        path = path_to_disk(x, v, acceleration, disks.radius, i, j)
        wi, wj = 1.0 / disks.mass[i], 1.0 / disks.mass[j]
    else:
        path = path_to_wall(x, v, acceleration, disks.radius, i, world.walls, -1 - j)
        wi, wj = 1.0 / disks.mass[i], 0.0
    _, rate, nx, ny = contact(path, s)
    speed, inward, hold = (
        max(-rate, 0.0),
        -(path[4] * nx + path[5] * ny) - lift(path, s, nx, ny),
        0.0,
    )
    # it would be back at once, and ever sooner: it rests, and is held
    if 2.0 * e * speed < inward * dt * REST:
        e, hold = 0.0, inward / (wi + wj)
    J = (1.0 + e) * speed / (wi + wj)
    fly_anew(disks, acceleration, i, wi * nx, wi * ny, J, hold, s)
    if j >= 0:
        fly_anew(disks, acceleration, j, -wj * nx, -wj * ny, J, hold, s)
    if world.friction > 0.0:
        rub(disks, acceleration, i, j, path, nx, ny, world.friction * J, world.friction * hold, s)
    return J - hold * s


@compiled
def fly_anew(  # type: ignore[no-untyped-def]
    disks: Disks, acceleration, i: int, wx: float, wy: float, J: float, hold: float, s: float
) -> None:
    """From s on, as if disk i had left with the impulse J and the force `hold` along n; (wx, wy) is
    n / mass."""
    for axis, w in enumerate((wx, wy)):
        move(disks.position, disks.remainder, i, axis, (hold * (s * s / 2) - J * s) * w)
        disks.velocity[i, axis] += (J - hold * s) * w
        acceleration[i, axis] += hold * w


@compiled
def rub(  # type: ignore[no-untyped-def]
    disks: Disks,
    acceleration,
    i: int,
    j: int,
    path,
    nx: float,
    ny: float,
    most: float,
    most_held: float,
    s: float,
) -> None:
    """Coulomb's friction from s on: at most the impulse `most` at once, then at most the force
    `most_held`, which brakes until the surfaces do not slide and from then on keeps them so.

    The slip is that of i against j where they touch, along t = (-ny, nx). It is exact for one
    contact that lasts; of two of the same disk the second does not know that the first turns it.
    """
    spin, torque, inertia, radius = (
        disks.angular_velocity,
        disks.torque,
        disks.inertia,
        disks.radius,
    )
    slip = (path[3] + path[5] * s) * nx - (path[2] + path[4] * s) * ny
    growth = path[5] * nx - path[4] * ny  # of the slip in m/s2, as long as nothing brakes
    weight = 0.0
    for k in (i, j):
        if k >= 0:
            turning = torque[k] / inertia[k]
            slip -= radius[k] * (spin[k] + turning * s)
            growth -= radius[k] * turning
            weight += 1.0 / disks.mass[k] + radius[k] * radius[k] / inertia[k]
    J = min(max(-slip / weight, -most), most)

    # the force brakes until `stopped`, and holds from then on
    slip += J * weight
    brake = -most_held if slip > 0.0 else most_held
    slowing = growth + brake * weight
    stopped = s if slip == 0.0 else min(s - slip / slowing, 0.0) if slip * slowing < 0.0 else 0.0
    hold = min(max(-growth / weight, -most_held), most_held) if stopped < 0.0 else brake
    impulse = J + brake * (stopped - s) - hold * stopped
    way = -J * s + (brake * (s * s - stopped * stopped) + hold * stopped * stopped) / 2
    drag(disks, acceleration, i, -ny, nx, impulse, way, hold)
    if j >= 0:
        drag(disks, acceleration, j, ny, -nx, impulse, way, hold)


@compiled
def drag(  # type: ignore[no-untyped-def]
    disks: Disks,
    acceleration,
    i: int,
    tx: float,
    ty: float,
    impulse: float,
    way: float,
    hold: float,
) -> None:
    """By the end of the step disk i has got `impulse` N s along t where it is touched, moved by
    `way` kg m over its mass, and is under the force `hold`."""
    for axis, t in enumerate((tx, ty)):
        move(disks.position, disks.remainder, i, axis, way * t / disks.mass[i])
        disks.velocity[i, axis] += impulse * t / disks.mass[i]
        acceleration[i, axis] += hold * t / disks.mass[i]
    disks.angular_velocity[i] -= impulse * disks.radius[i] / disks.inertia[i]
    disks.angle[i] -= way * disks.radius[i] / disks.inertia[i]


@compiled
def carry_over(x, world: World, i: int) -> None:  # type: ignore[no-untyped-def]
    """A centre that is set onto the opposite edge as it leaves and flies on ends a box away."""
    for axis in range(2):
        if x[i, axis] < world.low[axis]:
            x[i, axis] += world.high[axis] - world.low[axis]
        elif x[i, axis] > world.high[axis]:
            x[i, axis] -= world.high[axis] - world.low[axis]
