"""The exercise's solver for many disks: the same steps, bit for bit, but only pairs near each other are asked.

`exercise` is the solver; read that. This leaves out what cannot touch, by the list of `neighbours`.
"""

from numba import njit

from reference_impl import exercise
from reference_impl.exercise import collide, collide_wall, collide_walls, integrate, touching, touching_wall, wrap
from reference_impl.neighbours import Near, astray, look_around
from reference_impl.state import Disks, World

CROWD = 64  # disks, from which on the list is cheaper than all pairs
EARLY = 0.8  # of the leash: the rest is for what the hits of a step move
LOOK = 256  # disks a look at all neighbours in mid-step: more looks would cost more than asking all pairs


@njit(cache=True, error_model="numpy")
def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    """As `exercise.advance`, to the bit."""
    if len(disks.radius) < CROWD:
        return exercise.advance(disks, world, dt, count)
    hits = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know what it will hold
    near = look_around(disks, world, dt)
    for k in range(count):
        near = step(disks, world, dt, k, hits, near)
    return hits


@njit(cache=True, error_model="numpy")
def step(disks: Disks, world: World, dt: float, k: int, hits: list, near: Near) -> Near:
    """One step, as `exercise.step`; returns what is near now."""
    integrate(disks, world, dt)
    if any_astray(disks.position, near, EARLY):
        near = look_around(disks, world, dt)

    # From (i, j) on nothing has been asked yet. A pair that is pushed apart may leave the leash: look again, go on.
    n, i, j, looks = len(disks.radius), 0, 0, 0
    while near.listed and i < n and looks <= n // LOOK:
        i, j = collide_near(disks, world, k, hits, near, i, j)
        if i < n:
            near = look_around(disks, world, dt)
            looks += 1

    if i < n:  # there is no list, or none that lasts
        collide_rest(disks, world, k, hits, i, j)
        collide_walls(disks, world, k, hits)
    else:
        collide_near_walls(disks, world, k, hits, near.walled)
    wrap(disks.position, world)
    return near


@njit(cache=True, error_model="numpy")
def any_astray(x, near: Near, part: float) -> bool:  # type: ignore[no-untyped-def]
    """Whether any disk is farther from its home than this part of the leash."""
    strays = 0  # all are counted: a loop without a way out is done in vectors
    for i in range(len(x)):
        strays += astray(x[i, 0], x[i, 1], near.home, i, part * near.leash)
    return strays > 0


@njit(cache=True, error_model="numpy")
def collide_near(disks: Disks, world: World, k: int, hits: list, near: Near, i: int, j: int) -> tuple[int, int]:
    """Collide the near pairs from (i, j) on until a disk goes astray; returns the next pair, (n, n) after the last."""
    x, home, leash = disks.position, near.home, near.leash
    p = 0
    while p < len(near.first) and (near.first[p] < i or (near.first[p] == i and near.second[p] < j)):
        p += 1
    p = next_touching(x, near.first, near.second, near.reach2, p)
    while p < len(near.first):
        a, b = int(near.first[p]), int(near.second[p])
        impulse = collide(disks, a, b, world)
        if impulse != 0.0:
            hits.append((k, a, b, impulse))
        if astray(x[a, 0], x[a, 1], home, a, leash) or astray(x[b, 0], x[b, 1], home, b, leash):
            return a, b + 1
        p = next_touching(x, near.first, near.second, near.reach2, p + 1)
    return len(x), len(x)


@njit(cache=True, error_model="numpy")
def next_touching(x, first, second, reach2, p: int) -> int:  # type: ignore[no-untyped-def]
    """The number of the next near pair that is `touching`, from p on; their count if there is none."""
    while p < len(first):
        dx, dy = x[first[p], 0] - x[second[p], 0], x[first[p], 1] - x[second[p], 1]
        if dx * dx + dy * dy < reach2[p]:
            break
        p += 1
    return p


@njit(cache=True, error_model="numpy")
def collide_rest(disks: Disks, world: World, k: int, hits: list, i: int, j: int) -> None:
    """Collide all pairs from (i, j) on, as the double loop of `exercise.step` does."""
    n = len(disks.radius)
    for a in range(i, n):
        for b in range(max(a + 1, j if a == i else 0), n):
            if touching(disks.position, disks.radius, a, b):
                impulse = collide(disks, a, b, world)
                if impulse != 0.0:
                    hits.append((k, a, b, impulse))


@njit(cache=True, error_model="numpy")
def collide_near_walls(disks: Disks, world: World, k: int, hits: list, walled) -> None:  # type: ignore[no-untyped-def]
    """Those near a wall against all walls, as `exercise.collide_walls`; no other disk moves meanwhile."""
    for i in walled:
        for w in range(len(world.walls)):
            if touching_wall(disks.position, disks.radius, i, world.walls, w):
                impulse = collide_wall(disks, i, w, world)
                if impulse != 0.0:
                    hits.append((k, i, -1 - w, impulse))
