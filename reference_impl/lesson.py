"""The solver of the lesson "Simple body dynamics": explicit Euler, walls that flip, collisions from
two equations.

Every function is compiled by numba from the source you read; with NUMBA_DISABLE_JIT=1 the same
source runs as plain Python and gives the same bits. It shares no kernel with `exercise`: read one
file, know one method.
"""

from math import inf, sqrt

from .compiled import compiled, inlined, pasted
from .state import Disks, World


@pasted
def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    """Advance `count` steps of `dt` s; return the collisions as (step, i, j, impulse in N s), wall
    w as j = -1 - w."""
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know what it will hold
    for k in range(count):
        step(disks, world, dt, k, collisions)
    return collisions


@inlined
def step(disks: Disks, world: World, dt: float, k: int, collisions: list) -> None:
    """One step: move, accelerate, bounce off the walls, collide every pair i < j, then the edges of
    the world."""
    integrate(disks, world, dt)
    bounce(disks, world, k, collisions)
    x, r = disks.position, disks.radius
    for i in range(len(r)):
        for j in range(i + 1, len(r)):
            # Colliding when the DISTANCE is below r1 + r2. (Printed is the sum of the positions: a
            # slip.)
            if sqrt((x[i, 0] - x[j, 0]) ** 2 + (x[i, 1] - x[j, 1]) ** 2) < r[i] + r[j]:
                impulse = collide(disks, i, j, world)
                if impulse != 0.0:
                    collisions.append((k, i, j, impulse))
    wrap(x, world)


@compiled
def integrate(disks: Disks, world: World, dt: float) -> None:
    """x += v dt with the OLD velocity, then v += F/m dt; the same for the angle."""
    x, v, g = disks.position, disks.velocity, world.gravity
    for i in range(len(disks.mass)):
        if disks.mass[i] == inf:
            continue
        x[i, 0] += v[i, 0] * dt
        x[i, 1] += v[i, 1] * dt
        disks.angle[i] += disks.angular_velocity[i] * dt

        v[i, 0] += (g[0] + disks.force[i, 0] / disks.mass[i]) * dt
        v[i, 1] += (g[1] + disks.force[i, 1] / disks.mass[i]) * dt
        disks.angular_velocity[i] += disks.torque[i] / disks.inertia[i] * dt


@inlined
def bounce(disks: Disks, world: World, k: int, collisions: list) -> None:
    """A wall flips the normal velocity of a disk that comes in, v' = -c_r v; the position stays as
    it is."""
    x, v, mass = disks.position, disks.velocity, disks.mass
    for i in range(len(mass)):
        for w in range(len(world.walls)):
            ax, ay = world.walls[w, 0, 0], world.walls[w, 0, 1]
            ux, uy = world.walls[w, 1, 0] - ax, world.walls[w, 1, 1] - ay
            along = min(
                max(((x[i, 0] - ax) * ux + (x[i, 1] - ay) * uy) / (ux * ux + uy * uy), 0.0), 1.0
            )
            nx, ny = x[i, 0] - (ax + along * ux), x[i, 1] - (ay + along * uy)
            distance = sqrt(nx * nx + ny * ny)
            speed = v[i, 0] * nx + v[i, 1] * ny
            if distance >= disks.radius[i] or speed >= 0.0 or mass[i] == inf:
                continue
            change = -(1.0 + world.restitution) * speed / (distance * distance)
            v[i, 0] += change * nx
            v[i, 1] += change * ny
            collisions.append((k, i, -1 - w, mass[i] * change * distance))


@compiled
def collide(disks: Disks, a: int, b: int, world: World) -> float:
    """Part an overlapping pair and exchange its normal velocities; returns the impulse in N s, or
    0."""
    x, v = disks.position, disks.velocity
    w1, w2, e = 1.0 / disks.mass[a], 1.0 / disks.mass[b], world.restitution
    nx, ny = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1]
    distance = sqrt(nx * nx + ny * ny)
    if w1 + w2 == 0.0 or distance == 0.0:
        return 0.0
    nx, ny = nx / distance, ny / distance

    # Each is moved out along n by its part w / (w1 + w2) of the overlap.
    delta = (disks.radius[a] + disks.radius[b]) - distance
    move(x, a, nx, ny, -w1 / (w1 + w2) * delta)
    move(x, b, nx, ny, w2 / (w1 + w2) * delta)

    # The tangential parts stay. The normal parts follow from m1 v1 + m2 v2 = m1 V1 + m2 V2 and
    # e = (V2 - V1) / (v1 - v2); divided by m1 m2, so that a static disk (w = 0) needs no case of
    # its own.
    v1, v2 = v[a, 0] * nx + v[a, 1] * ny, v[b, 0] * nx + v[b, 1] * ny
    if world.approaching_only and v1 <= v2:
        return 0.0
    V1 = (w2 * v1 + w1 * v2 - w1 * (v1 - v2) * e) / (w1 + w2)
    V2 = (w2 * v1 + w1 * v2 - w2 * (v2 - v1) * e) / (w1 + w2)
    move(v, a, nx, ny, V1 - v1)
    move(v, b, nx, ny, V2 - v2)
    return (1.0 + e) * (v1 - v2) / (w1 + w2)


@compiled
def move(rows, i: int, nx: float, ny: float, by: float) -> None:
    """Add `by` times n to row `i`."""
    rows[i, 0] += by * nx
    rows[i, 1] += by * ny


@compiled
def wrap(x, world: World) -> None:
    """A centre beyond an edge of the box goes on from the opposite edge; its velocity stays."""
    for i in range(len(x)):
        for axis in range(2):
            low, high = world.low[axis], world.high[axis]
            if x[i, axis] < low or x[i, axis] > high:
                x[i, axis] -= (x[i, axis] - low) // (high - low) * (high - low)
