"""The exercise with friction: to its four parts of a collision comes a fifth, the impulse along the
surfaces.

Read it beside `exercise.py`, from which everything else is taken; with friction 0 it gives the same
bits. It asks every pair, so this is for some hundred disks. Compiled by numba, as `exercise` is.
"""

from . import exercise
from .compiled import inlined, kernel, pasted
from .exercise import direction, integrate, move, nearest_point
from .state import Disks, World


@pasted
def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    """Advance `count` steps of `dt` s; return the collisions as (step, i, j, impulse along the
    normal in N s), wall w as j = -1 - w."""
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know what it will hold
    for k in range(count):
        step(disks, world, dt, k, collisions)
    return collisions


@inlined
def step(disks: Disks, world: World, dt: float, k: int, collisions: list) -> None:
    """One step of the exercise, with its two kinds of collision replaced by those below."""
    integrate(disks, world, dt)
    n = len(disks.radius)
    for i in range(n):
        for j in range(i + 1, n):
            impulse = collide(disks, i, j, world)
            if impulse != 0.0:
                collisions.append((k, i, j, impulse))
    for i in range(n):
        for w in range(len(world.walls)):
            impulse = collide_wall(disks, i, w, world)
            if impulse != 0.0:
                collisions.append((k, i, -1 - w, impulse))
    carry_over(disks.position, world)


@kernel
def carry_over(x, world: World) -> None:
    """A centre beyond an edge of the box goes on from the opposite edge; its velocity stays."""
    for i in range(len(x)):
        for axis in range(2):
            low, high = world.low[axis], world.high[axis]
            if x[i, axis] < low or x[i, axis] > high:
                x[i, axis] -= (x[i, axis] - low) // (high - low) * (high - low)


@kernel
def collide(disks: Disks, a: int, b: int, world: World) -> float:
    """Parts (a) to (d) as in the exercise, then (e); returns the impulse along the normal."""
    x, v, w = disks.position, disks.velocity, disks.angular_velocity
    r, mass, inertia = disks.radius, disks.mass, disks.inertia
    J = exercise.collide(disks, a, b, world)
    if J <= 0.0 or world.friction == 0.0:
        return J

    # (e) Rub: J_t = min(mu J, |slip| / (1/ma + 1/mb + ra2/Ia + rb2/Ib)) against the slip of the two
    # points that touch, along t = (-ny, nx).
    _, nx, ny = direction(x[a, 0] - x[b, 0], x[a, 1] - x[b, 1])
    slip = (v[a, 1] - v[b, 1]) * nx - (v[a, 0] - v[b, 0]) * ny - r[a] * w[a] - r[b] * w[b]
    stop = slip / (1.0 / mass[a] + 1.0 / mass[b] + r[a] ** 2 / inertia[a] + r[b] ** 2 / inertia[b])
    rub = min(max(-stop, -world.friction * J), world.friction * J)
    move(v, a, -ny, nx, rub / mass[a])
    move(v, b, -ny, nx, -rub / mass[b])
    w[a] -= r[a] * rub / inertia[a]
    w[b] -= r[b] * rub / inertia[b]
    return J


@kernel
def collide_wall(disks: Disks, i: int, k: int, world: World) -> float:
    """The same for a disk and the nearest point of wall k, which does not move."""
    x, v, w = disks.position, disks.velocity, disks.angular_velocity
    r, mass, inertia = disks.radius, disks.mass, disks.inertia
    J = exercise.collide_wall(disks, i, k, world)
    if J <= 0.0 or world.friction == 0.0:
        return J
    px, py = nearest_point(world.walls, k, x[i, 0], x[i, 1])
    _, nx, ny = direction(x[i, 0] - px, x[i, 1] - py)
    slip = v[i, 1] * nx - v[i, 0] * ny - r[i] * w[i]
    stop = slip / (1.0 / mass[i] + r[i] ** 2 / inertia[i])
    rub = min(max(-stop, -world.friction * J), world.friction * J)
    move(v, i, -ny, nx, rub / mass[i])
    w[i] -= r[i] * rub / inertia[i]
    return J
