"""The solver of Visual Computing exercise 11: symplectic Euler; detect, project, impulse, update
for every pair.

Every function is compiled by numba from the source you read; with NUMBA_DISABLE_JIT=1 the same
source runs as plain Python and gives the same bits.
"""

from math import inf, sqrt

from .compiled import inlined, kernel, pasted
from .state import BY_INVERSE_MASS, EQUAL, Disks, World


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
    """One step, as `performSimStep`: integrate all, collide every pair i < j in order, then the
    edges of the world."""
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
    wrap(disks.position, world)


@kernel
def integrate(disks: Disks, world: World, dt: float) -> None:
    """Task 1, symplectic Euler: velocities from force and torque, then positions from the NEW
    velocities."""
    x, v, g = disks.position, disks.velocity, world.gravity
    force, torque = disks.force, disks.torque
    for i in range(len(disks.mass)):
        if disks.mass[i] == inf:
            continue
        v[i, 0] += (g[0] + force[i, 0] / disks.mass[i]) * dt
        v[i, 1] += (g[1] + force[i, 1] / disks.mass[i]) * dt
        disks.angular_velocity[i] += torque[i] / disks.inertia[i] * dt

        x[i, 0] += v[i, 0] * dt
        x[i, 1] += v[i, 1] * dt
        disks.angle[i] += disks.angular_velocity[i] * dt


@kernel
def collide(disks: Disks, a: int, b: int, world: World) -> float:
    """Task 2, one pair; returns the impulse J in N s (positive: repulsive), 0 where there is
    none."""
    x, v, mass = disks.position, disks.velocity, disks.mass

    # (a) Detect: closer than the sum of the radii? Two static disks never move.
    if not touching(x, disks.radius, a, b) or (mass[a] == inf and mass[b] == inf):
        return 0.0

    # (b) Project: displace them along n (from b to a) until they meet in one point; no velocity is
    # touched.
    distance, nx, ny = direction(x[a, 0] - x[b, 0], x[a, 1] - x[b, 1])
    overlap = disks.radius[a] + disks.radius[b] - distance
    share = share_of_a(mass[a], mass[b], world.split)
    move(x, a, nx, ny, overlap * share)
    move(x, b, nx, ny, -overlap * (1.0 - share))

    # (c) Impulse: J = -(1 + e) (va - vb).n / (n.n (1/ma + 1/mb)).
    speed = (v[a, 0] - v[b, 0]) * nx + (v[a, 1] - v[b, 1]) * ny
    if world.approaching_only and speed >= 0.0:
        return 0.0
    J = -(1.0 + world.restitution) * speed / ((nx * nx + ny * ny) * (1.0 / mass[a] + 1.0 / mass[b]))

    # (d) Update: equal and opposite, so that the momentum adds up to what it was.
    move(v, a, nx, ny, J / mass[a])
    move(v, b, nx, ny, -J / mass[b])
    return J


@kernel
def collide_wall(disks: Disks, i: int, w: int, world: World) -> float:
    """The same four parts for a disk and the nearest point of a wall, which acts as a static disk
    would."""
    x, v, mass = disks.position, disks.velocity, disks.mass
    if not touching_wall(x, disks.radius, i, world.walls, w) or mass[i] == inf:
        return 0.0
    px, py = nearest_point(world.walls, w, x[i, 0], x[i, 1])
    distance, nx, ny = direction(x[i, 0] - px, x[i, 1] - py)
    move(x, i, nx, ny, disks.radius[i] - distance)
    speed = v[i, 0] * nx + v[i, 1] * ny
    if world.approaching_only and speed >= 0.0:
        return 0.0
    J = -(1.0 + world.restitution) * speed / ((nx * nx + ny * ny) / mass[i])
    move(v, i, nx, ny, J / mass[i])
    return J


@kernel
def touching(x, radius, a: int, b: int) -> bool:
    """Whether the centres are closer than the sum of the radii (both sides squared)."""
    dx, dy = x[a, 0] - x[b, 0], x[a, 1] - x[b, 1]
    reach = radius[a] + radius[b]
    return dx * dx + dy * dy < reach * reach


@kernel
def touching_wall(x, radius, i: int, walls, w: int) -> bool:
    """Whether the nearest point of wall `w` is closer than the radius (both sides squared)."""
    px, py = nearest_point(walls, w, x[i, 0], x[i, 1])
    dx, dy = x[i, 0] - px, x[i, 1] - py
    return dx * dx + dy * dy < radius[i] * radius[i]


@kernel
def direction(dx: float, dy: float) -> tuple[float, float, float]:
    """Length and unit vector of (dx, dy); equal centres have no direction, so they are separated
    along x."""
    distance = sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return 0.0, 1.0, 0.0
    return distance, dx / distance, dy / distance


@kernel
def share_of_a(mass_a: float, mass_b: float, split: int) -> float:
    """The part of the overlap by which a moves, 0 to 1: free in the exercise, but a static disk
    never moves."""
    if split == BY_INVERSE_MASS or mass_a == inf or mass_b == inf:
        return (1.0 / mass_a) / (1.0 / mass_a + 1.0 / mass_b)
    return 0.5 if split == EQUAL else 1.0


@kernel
def nearest_point(walls, w: int, x: float, y: float) -> tuple[float, float]:
    """The point of segment `w` nearest to (x, y)."""
    ax, ay = walls[w, 0, 0], walls[w, 0, 1]
    ux, uy = walls[w, 1, 0] - ax, walls[w, 1, 1] - ay
    along = min(max(((x - ax) * ux + (y - ay) * uy) / (ux * ux + uy * uy), 0.0), 1.0)
    return ax + along * ux, ay + along * uy


@kernel
def move(rows, i: int, nx: float, ny: float, by: float) -> None:
    """Add `by` times n to row `i`."""
    rows[i, 0] += by * nx
    rows[i, 1] += by * ny


@kernel
def wrap(x, world: World) -> None:
    """As `projectObjects`: a centre beyond an edge of the box is set onto the opposite edge; its
    velocity stays."""
    for axis in range(2):
        if world.low[axis] == -inf and world.high[axis] == inf:
            continue
        for i in range(len(x)):
            if x[i, axis] < world.low[axis]:
                x[i, axis] = world.high[axis]
            elif x[i, axis] > world.high[axis]:
                x[i, axis] = world.low[axis]
