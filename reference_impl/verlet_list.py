"""The exercise's solver with a neighbour list, for many disks: the same steps, bit for bit.

`exercise` is the solver; read that. This leaves out what cannot touch, by the list of `neighbours`,
and divides by the masses once a call.
"""

from math import inf
from typing import NamedTuple

import numpy as np

from reference_impl import exercise
from reference_impl.compiled import compiled, kernel
from reference_impl.exercise import collide, collide_wall, collide_walls, touching_wall, wrap
from reference_impl.neighbours import NeighbourList, beyond_skin, build_list
from reference_impl.state import Disks, World

LISTED_FROM = (
    # disks, from which on the list is cheaper than all pairs, even if a call is one step; if long,
    # from 16 on
    64
)
EARLY = 0.8  # of half the skin: the rest is for what the collisions of a step move
# disks a look at all neighbours in mid-step: more rebuilds would cost more than asking all pairs
REBUILD = 256
NONE = -1  # in place of a number
BLOCK = 256  # disks that fly at a time: few enough for the nearest cache


@compiled
def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    """As `exercise.advance`, to the bit."""
    if len(disks.radius) < LISTED_FROM:
        return exercise.advance(disks, world, dt, count)
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know what it will hold
    advance_listed(disks, world, dt, count, collisions)
    return collisions


@compiled
def advance_listed(disks: Disks, world: World, dt: float, count: int, collisions: list) -> int:
    """Advance by near pairs, however few the disks are; returns in how many steps all pairs had to
    be asked."""
    acceleration, n, unlisted = accelerations_of(disks, world, dt), len(disks.radius), 0
    k, i, j, rebuilds = 0, 0, 0, 0  # in step k nothing has been asked from the pair (i, j) on
    # in place of homes while there is no list: nobody is far from where it is
    here = disks.position.reshape(-1)
    if count > 0:
        fly(disks, dt, acceleration, here, inf)
    while k < count:
        near, began = build_list(disks, world, dt, count - k), k
        if near.listed:
            k, i, j = play(disks, world, dt, count, collisions, acceleration, near, k, i, j)
        rebuilds = rebuilds + 1 if k == began else 0
        if k < count and (not near.listed or rebuilds > n // REBUILD):
            collide_rest(disks, world, k, collisions, i, j)
            collide_walls(disks, world, k, collisions)
            wrap(disks.position, world)
            k, i, j, rebuilds, unlisted = k + 1, 0, 0, 0, unlisted + 1
            if k < count:
                fly(disks, dt, acceleration, here, inf)
    turn(disks, dt, count, acceleration)
    return unlisted


class Accelerations(NamedTuple):
    """What force, torque and gravity do in a step, and to whom; the same in every step of a
    call."""

    kick: np.ndarray  # (2n,) m/s, x and y in turn
    turn: np.ndarray  # (n,) rad/s
    # (m, 2) who moves: the disks from .. to .., at most a block, without the static ones
    moving: np.ndarray


@compiled
def accelerations_of(disks: Disks, world: World, dt: float) -> Accelerations:
    """Rounded as in `exercise.integrate`."""
    n, g = len(disks.mass), world.gravity
    kick, turn, moving, runs = np.zeros(2 * n), np.zeros(n), np.zeros((n, 2), np.uint32), 0
    for i in range(n):
        if disks.mass[i] == inf:
            continue
        kick[2 * i] = (g[0] + disks.force[i, 0] / disks.mass[i]) * dt
        kick[2 * i + 1] = (g[1] + disks.force[i, 1] / disks.mass[i]) * dt
        turn[i] = disks.torque[i] / disks.inertia[i] * dt
        if runs == 0 or moving[runs - 1, 1] != i or i % BLOCK == 0:
            moving[runs, 0] = i
            runs += 1
        moving[runs - 1, 1] = i + 1
    return Accelerations(kick, turn, moving[:runs].copy())


@compiled
def play(
    disks: Disks,
    world: World,
    dt: float,
    count: int,
    collisions: list,
    acceleration: Accelerations,
    near: NeighbourList,
    k: int,
    i: int,
    j: int,
) -> tuple[int, int, int]:
    """Go on from the pair (i, j) of step k up to `count` or until a disk has moved by half the
    skin; returns where that is."""
    pairs, p = len(near.first), first_from(near, i, j)
    while True:
        k, p = next_touch(disks, world, dt, count, acceleration, near, k, p)
        if p == NONE:
            return k, 0, 0
        if p < pairs:
            a, b = pair(near, p)
            impulse = collide(disks, a, b, world)
            if impulse != 0.0:
                collisions.append((k, a, b, impulse))
            if pair_beyond_skin(disks, near, a, b):
                return k, a, b + 1
            p += 1
        else:
            i, w = by_wall(near, p)
            # as it is moved, it may touch one that it was not near
            for later in range(w, len(world.walls)):
                impulse = collide_wall(disks, i, later, world)
                if impulse != 0.0:
                    collisions.append((k, i, -1 - later, impulse))
            p = past(near, i, p)


@kernel
def next_touch(
    disks: Disks,
    world: World,
    dt: float,
    count: int,
    acceleration: Accelerations,
    near: NeighbourList,
    k: int,
    p: int,
) -> tuple[int, int]:
    """(step, number) of the next near pair that touches, from number p of step k on; walls are
    numbered after pairs.

    Flies from step to step; (step, `NONE`) at the start of one where a disk is nearly beyond half
    the skin, or of `count`.
    """
    pairs, walls = len(near.first), len(near.disk)
    while True:
        p = next_touching(disks, near, p)
        if p >= pairs:
            p = next_touching_wall(disks, world, near, p)
        if p < pairs + walls:
            return k, p
        wrap(disks.position, world)
        k, p = k + 1, 0
        if k == count or fly(disks, dt, acceleration, near.home, EARLY * near.half_skin) > 0:
            return k, NONE


@kernel
def fly(disks: Disks, dt: float, acceleration: Accelerations, home, half_skin: float) -> int:  # type: ignore[no-untyped-def]
    """As `exercise.integrate`, but for the angles; returns how many disks are then farther from
    home than half the skin.

    One thing at a time and no way out of a loop, so that it is done in vectors; and in blocks, so
    that the next loop finds in the nearest cache what the one before has left there.
    """
    x, v, beyond = disks.position.reshape(-1), disks.velocity.reshape(-1), 0
    for run in range(len(acceleration.moving)):
        begin, end = np.int64(acceleration.moving[run, 0]), np.int64(acceleration.moving[run, 1])
        for c in range(2 * begin, 2 * end):
            v[c] += acceleration.kick[c]
            x[c] += v[c] * dt
        for i in range(begin, end):
            beyond += beyond_skin(x, home, i, half_skin)
    return beyond


@kernel
def turn(disks: Disks, dt: float, count: int, acceleration: Accelerations) -> None:
    """The angles and spins of all steps, at last, as no collision asks for them: a block is fetched
    once for all of them."""
    angle, spin = disks.angle, disks.angular_velocity
    for run in range(len(acceleration.moving)):
        begin, end = np.int64(acceleration.moving[run, 0]), np.int64(acceleration.moving[run, 1])
        for _ in range(count):
            for i in range(begin, end):
                spin[i] += acceleration.turn[i]
                angle[i] += spin[i] * dt


@kernel
def next_touching(disks: Disks, near: NeighbourList, p: int) -> int:
    """The number of the next near pair that is `touching`, from p on; their count or p if there is
    none."""
    x, first, second, reach2 = disks.position.reshape(-1), near.first, near.second, near.reach2
    while p < len(first):
        a, b = 2 * np.int64(first[p]), 2 * np.int64(second[p])
        dx, dy = x[a] - x[b], x[a + 1] - x[b + 1]
        if dx * dx + dy * dy < reach2[p]:
            break
        p += 1
    return p


@kernel
def next_touching_wall(disks: Disks, world: World, near: NeighbourList, p: int) -> int:
    """The number of the next disk that is `touching_wall` with one near it, from p on; of the end
    if there is none."""
    x, radius, pairs = disks.position, disks.radius, len(near.first)
    while p < pairs + len(near.disk):
        if touching_wall(x, radius, near.disk[p - pairs], world.walls, near.wall[p - pairs]):
            break
        p += 1
    return p


@kernel
def first_from(near: NeighbourList, i: int, j: int) -> int:
    """The number of the first near pair from (i, j) on."""
    p = 0
    while p < len(near.first) and (
        near.first[p] < i or (near.first[p] == i and near.second[p] < j)
    ):
        p += 1
    return p


@kernel
def pair(near: NeighbourList, p: int):  # type: ignore[no-untyped-def]
    """The two disks of a number."""
    return np.int64(near.first[p]), np.int64(near.second[p])


@kernel
def by_wall(near: NeighbourList, p: int):  # type: ignore[no-untyped-def]
    """Disk and wall of a number."""
    return np.int64(near.disk[p - len(near.first)]), np.int64(near.wall[p - len(near.first)])


@kernel
def past(near: NeighbourList, i: int, p: int) -> int:
    """The number after those of disk i and its walls."""
    while p - len(near.first) < len(near.disk) and near.disk[p - len(near.first)] == i:
        p += 1
    return p


@kernel
def pair_beyond_skin(disks: Disks, near: NeighbourList, a: int, b: int) -> bool:
    """Whether one of two disks is."""
    x = disks.position.reshape(-1)
    return beyond_skin(x, near.home, a, near.half_skin) or beyond_skin(
        x, near.home, b, near.half_skin
    )


@compiled
def collide_rest(disks: Disks, world: World, k: int, collisions: list, i: int, j: int) -> None:
    """Collide all pairs from (i, j) on, as the double loop of `exercise.step` does."""
    n = len(disks.radius)
    for a in range(i, n):
        for b in range(max(a + 1, j if a == i else 0), n):
            impulse = collide(disks, a, b, world)
            if impulse != 0.0:
                collisions.append((k, a, b, impulse))
