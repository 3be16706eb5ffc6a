"""The exercise's solver with a neighbour list: the same steps, bit for bit, sooner.

`exercise` is the solver; read that. This leaves out what cannot touch, by the list of
`neighbour_list`, and divides by the masses once a call.
"""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from . import exercise
from .compiled import compiled, inlined, kernel, pasted
from .exercise import collide, collide_wall, touching_wall, wrap
from .neighbour_list import (
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
from .state import Disks, World

WORTH = 64  # disks times steps, from which on a list is cheaper than all pairs
# disks a new list in mid-step: more of them would cost more than asking all pairs
REBUILD = 256
BLOCK = 256  # disks that turn at a time: few enough for the nearest cache


class Kicks(NamedTuple):
    """What force, torque and gravity do in a step, and to whom; the same in every step of a
    call."""

    velocity: np.ndarray  # (2n,) m/s, x and y in turn
    spin: np.ndarray  # (n,) rad/s
    moving: np.ndarray  # (m, 2) the disks that move, as `moving` has them
    strongest: float  # m: no disk moves by more in a step than it did in the one before


@pasted
def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    """As `exercise.advance`, to the bit."""
    if len(disks.radius) * count < WORTH:
        return exercise.advance(disks, world, dt, count)
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know what it will hold
    advance_listed(disks, world, dt, count, collisions)
    return collisions


@pasted
def advance_listed(disks: Disks, world: World, dt: float, count: int, collisions: list) -> None:
    """Advance by near pairs, however few the disks and steps are."""
    kicks, k = kicks_of(disks, world, dt), 0
    near = empty_list(disks.radius, len(world.walls))
    while True:
        k, p = take_quiet_steps(disks, world, kicks, dt, near, k, count)
        if k == count:
            break
        if used_up(near):
            near.length[STRIDE] = longest_stride(disks, dt)
            build_list(near, disks.position, disks.radius, world, count - k)
            p = next_touching(disks, near, 0)
        if not is_quiet(disks, world, near, p):
            collide_near(disks, world, dt, near, k, p, count, collisions)
            collide_near_walls(disks, world, dt, near, k, collisions)
            wrap_near(disks, world, near)
        k += 1
    turn(disks, kicks, dt, count)


@kernel
def take_quiet_steps(
    disks: Disks, world: World, kicks: Kicks, dt: float, near: NeighbourList, k: int, count: int
) -> tuple[int, int]:
    """Take steps from step k on until one in which two touch or the list is used up: in that one
    all have flown, and nothing else was done. Returns it, and the number of the first near pair
    that may touch."""
    while k < count:
        fly(disks, kicks, dt)
        take_step(near, kicks.strongest)
        if used_up(near):
            return k, 0
        p = next_touching(disks, near, 0)
        if not is_quiet(disks, world, near, p):
            return k, p
        k += 1
    return k, 0


@kernel
def is_quiet(disks: Disks, world: World, near: NeighbourList, p: int) -> bool:
    """Whether nothing collides in this step; p is the first near pair that touches."""
    if not holds(near) or p < near.found[PAIRS]:
        return False
    if next_touching_wall(disks, world, near, 0) < near.found[WALLS]:
        return False
    return not any_outside(disks.position, near, world)


@compiled
def kicks_of(disks: Disks, world: World, dt: float) -> Kicks:
    """Rounded as in `exercise.integrate`."""
    n, g, strongest2 = len(disks.mass), world.gravity, 0.0
    kick, spin = np.zeros(2 * n), np.zeros(n)
    for i in range(n):
        if disks.mass[i] == inf:
            continue
        kx = (g[0] + disks.force[i, 0] / disks.mass[i]) * dt
        ky = (g[1] + disks.force[i, 1] / disks.mass[i]) * dt
        kick[2 * i], kick[2 * i + 1] = kx, ky
        strongest2 = max(strongest2, kx * kx + ky * ky)
        spin[i] = disks.torque[i] / disks.inertia[i] * dt
    return Kicks(kick, spin, moving(disks.mass), sqrt(strongest2) * abs(dt))


@compiled
def moving(mass):
    """(m, 2): the disks from .. to .., at most a `BLOCK`, without the static ones."""
    runs, count = np.zeros((len(mass), 2), np.uint32), 0
    for i in range(len(mass)):
        if mass[i] == inf:
            continue
        if count == 0 or runs[count - 1, 1] != i or i % BLOCK == 0:
            runs[count, 0] = i
            count += 1
        runs[count - 1, 1] = i + 1
    return runs[:count]


@kernel
def longest_stride(disks: Disks, dt: float) -> float:
    """m: no disk moves farther in a step as long as its velocity stays."""
    v, x, fastest2, farthest = disks.velocity, disks.position, 0.0, 0.0
    for i in range(len(disks.mass)):
        speed2 = v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1]
        if speed2 > fastest2 and disks.mass[i] != inf:
            fastest2 = speed2
        far = max(abs(x[i, 0]), abs(x[i, 1]))
        if far > farthest:
            farthest = far
    return sqrt(fastest2) * abs(dt) + farthest * ROUNDING


@kernel
def fly(disks: Disks, kicks: Kicks, dt: float) -> None:
    """As `exercise.integrate`, but for the angles."""
    x, v = disks.position.reshape(-1), disks.velocity.reshape(-1)
    for run in range(len(kicks.moving)):
        for c in range(2 * np.int64(kicks.moving[run, 0]), 2 * np.int64(kicks.moving[run, 1])):
            v[c] += kicks.velocity[c]
            x[c] += v[c] * dt


@kernel
def turn(disks: Disks, kicks: Kicks, dt: float, count: int) -> None:
    """The angles and spins of all steps, at last, as no collision asks for them: a block is fetched
    once for all of them."""
    angle, spin = disks.angle, disks.angular_velocity
    for run in range(len(kicks.moving)):
        begin, end = np.int64(kicks.moving[run, 0]), np.int64(kicks.moving[run, 1])
        for _ in range(count):
            for i in range(begin, end):
                spin[i] += kicks.spin[i]
                angle[i] += spin[i] * dt


@inlined
def collide_near(
    disks: Disks,
    world: World,
    dt: float,
    near: NeighbourList,
    k: int,
    p: int,
    count: int,
    collisions: list,
) -> None:
    """Collide the near pairs from number p on in order; where the list does not hold, all that are
    left."""
    if not holds(near):
        collide_from(disks, world, k, collisions, 0, 1)
        return
    p, rebuilds = next_touching(disks, near, p), 0
    while p < near.found[PAIRS]:
        i, j = int(near.first[p]), int(near.second[p])
        impulse = collide(disks, i, j, world)
        if impulse != 0.0:
            collisions.append((k, i, j, impulse))
        account(disks, near, i, dt)
        account(disks, near, j, dt)
        p += 1
        if not holds(near):
            if rebuilds <= len(disks.radius) // REBUILD:
                near.length[STRIDE] = longest_stride(disks, dt)
                build_list(near, disks.position, disks.radius, world, count - k)
                rebuilds += 1
                p = first_after(near, i, j)
            if not holds(near):
                collide_from(disks, world, k, collisions, i, j + 1)
                return
        p = next_touching(disks, near, p)


@kernel
def account(disks: Disks, near: NeighbourList, i: int, dt: float) -> None:
    """Of disk i, which a collision has moved."""
    v = disks.velocity
    stride = sqrt(v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1]) * abs(dt)
    account_for(near, disks.position, i, stride)


@kernel
def next_touching(disks: Disks, near: NeighbourList, p: int) -> int:
    """The number of the next near pair that is `touching`, from p on; their count if there is
    none."""
    x, first, second, reach = disks.position, near.first, near.second, near.reach
    while p < near.found[PAIRS]:
        i, j = np.uintp(first[p]), np.uintp(second[p])  # which are not negative: that is not asked
        dx, dy = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1]
        if dx * dx + dy * dy < reach[p] * reach[p]:
            break
        p += 1
    return p


@kernel
def first_after(near: NeighbourList, i: int, j: int) -> int:
    """The number of the first near pair after (i, j)."""
    p = 0
    while p < near.found[PAIRS] and (
        near.first[p] < i or (near.first[p] == i and near.second[p] <= j)
    ):
        p += 1
    return p


@compiled
def collide_from(disks: Disks, world: World, k: int, collisions: list, i: int, j: int) -> None:
    """Collide all pairs from (i, j) on, as the double loop of `exercise.step` does."""
    n = len(disks.radius)
    for a in range(i, n):
        for b in range(max(a + 1, j if a == i else 0), n):
            impulse = collide(disks, a, b, world)
            if impulse != 0.0:
                collisions.append((k, a, b, impulse))


@inlined
def collide_near_walls(
    disks: Disks, world: World, dt: float, near: NeighbourList, k: int, collisions: list
) -> None:
    """Collide the disks that are near a wall, in order; all, where the list does not hold."""
    if not holds(near):
        for i in range(len(disks.radius)):
            for w in range(len(world.walls)):
                impulse = collide_wall(disks, i, w, world)
                if impulse != 0.0:
                    collisions.append((k, i, -1 - w, impulse))
        return
    b = next_touching_wall(disks, world, near, 0)
    while b < near.found[WALLS]:
        i = int(near.disk[b])
        # as it is moved, it may touch a later one that it was not near
        for w in range(near.wall[b], len(world.walls)):
            impulse = collide_wall(disks, i, w, world)
            if impulse != 0.0:
                collisions.append((k, i, -1 - w, impulse))
        account(disks, near, i, dt)
        while b < near.found[WALLS] and near.disk[b] == i:
            b += 1
        b = next_touching_wall(disks, world, near, b)


@kernel
def next_touching_wall(disks: Disks, world: World, near: NeighbourList, b: int) -> int:
    """The number of the next disk that is `touching_wall` with one near it, from b on; their count
    if there is none."""
    while b < near.found[WALLS]:
        if touching_wall(disks.position, disks.radius, near.disk[b], world.walls, near.wall[b]):
            break
        b += 1
    return b


@inlined
def wrap_near(disks: Disks, world: World, near: NeighbourList) -> None:
    """Wrap the disks; with one that was set onto the opposite edge the list does not hold."""
    if not holds(near):
        wrap(disks.position, world)
    elif any_outside(disks.position, near, world):
        wrap(disks.position, world)
        near.length[SLACK] = -inf


@kernel
def any_outside(x, near: NeighbourList, world: World) -> bool:
    """Whether the centre of a disk that is near an edge of the box is beyond it."""
    for e in range(near.found[EDGES]):
        i = near.edge[e]
        for axis in range(2):
            if x[i, axis] < world.low[axis] or x[i, axis] > world.high[axis]:
                return True
    return False
