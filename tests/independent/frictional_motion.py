"""Disks with Coulomb friction by two plain methods that share nothing with the project.

`collisions` finds contact times as roots of polynomials by numpy, and solves each collision as that
of two rigid bodies with a normal and a tangential impulse, stick first: no formula for disks is
used. `sliding` integrates a disk on an incline in tiny steps of impulses along the tangent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from crosscheck2d.scenarios.model import Array, Scene


class Motion(NamedTuple):
    """Where all disks are at `t` s, how they move, and the collisions so far."""

    t: float
    position: Array  # (n, 2)
    velocity: Array  # (n, 2)
    angle: Array  # (n,)
    spin: Array  # (n,)
    collisions: int


def first_fall(gap: Array) -> float:
    gap = np.trim_zeros(np.atleast_1d(gap), "f")
    roots = np.roots(gap) if len(gap) > 1 else np.zeros(0)
    times = roots[np.abs(roots.imag) < 1e-10].real
    falling = np.polyval(np.polyder(gap), times) < 0
    return float(min(times[(times > -1e-11) & falling], default=np.inf))


def next_contact(
    scene: Scene, x: Array, v: Array, images: Sequence[Array] = (np.zeros(2),)
) -> tuple[float, int, int, Array]:
    """s until the next contact, its disk, the other one or wall w as -1 - w, the direction to that
    then. images (2,) m: how far from a disk the images of it are that others meet."""
    found = [(np.inf, 0, 0, np.zeros(2))]
    g = np.where(scene.static[:, None], 0.0, scene.gravity)
    for i in np.flatnonzero(~scene.static):
        bodies = [
            (j, x[j] + shift, v[j], g[j], scene.radius[j])
            for j in range(scene.n)
            for shift in images
            if j != i
        ]
        ends = [
            (-1 - w, end, np.zeros(2), np.zeros(2), 0.0)
            for w, wall in enumerate(scene.walls)
            for end in wall
        ]
        for j, place, speed, acceleration, radius in [*bodies, *ends]:
            way = np.array([(acceleration - g[i]) / 2, speed - v[i], place - x[i]])
            gap = sum(np.convolve(way[:, axis], way[:, axis]) for axis in (0, 1))
            gap[-1] -= (radius + scene.radius[i]) ** 2
            if (t := first_fall(gap)) < np.inf:
                found.append((t, i, j, (way[0] * t + way[1]) * t + way[2]))
        for w, (start, end) in enumerate(scene.walls):
            along = (end - start) / np.hypot(*(end - start))
            for normal in (np.array([-along[1], along[0]]), np.array([along[1], -along[0]])):
                height = [g[i] @ normal / 2, v[i] @ normal, (x[i] - start) @ normal]
                t = first_fall(np.array(height) - [0, 0, scene.radius[i]])
                foot = (x[i] + (v[i] + g[i] * t / 2) * t - start) @ along if t < np.inf else -1
                if 0 <= foot <= np.hypot(*(end - start)):
                    found.append((t, i, -1 - w, -normal))
    return min(found, key=lambda each: each[0])


def resolve(scene: Scene, i: int, j: int, way: Array, v: Array, spin: Array) -> None:
    """Change velocities and spins by the collision of disk i with j, or a wall, in direction `way`.

    The impulses (normal, tangential) change the relative velocity of the contact points by a 2 x 2
    matrix; they are such that the normal part is reversed times e and the tangential one ends, or
    if that takes more than mu times the normal impulse, as much as that.
    """
    n = way / np.hypot(*way)
    t = np.array([-n[1], n[0]])
    weights = [1 / scene.mass[i], 1 / scene.mass[j] if j >= 0 else 0.0]
    turns = [1 / scene.inertia[i], 1 / scene.inertia[j] if j >= 0 and weights[1] else 0.0]
    arms = [scene.radius[i] * n, -scene.radius[j] * n if j >= 0 else 0 * n]
    # Rows: what the six speeds (of both: x, y, spin) make of the normal and tangential speed.
    levers = [[arm[0] * d[1] - arm[1] * d[0] for arm in arms] for d in (n, t)]
    rows = np.array([[*-d, -first, *d, second] for d, (first, second) in zip((n, t), levers)])
    speeds = np.array([*v[i], spin[i], *(v[j] if j >= 0 else (0, 0)), spin[j] if j >= 0 else 0])
    inverse = np.array([weights[0], weights[0], turns[0], weights[1], weights[1], turns[1]])
    matrix, relative = rows * inverse @ rows.T, rows @ speeds
    wanted = -np.array([(1 + scene.restitution) * relative[0], relative[1]])
    kick = np.linalg.solve(matrix, wanted)
    if abs(kick[1]) > scene.friction * kick[0]:
        cone = np.array([1.0, -np.sign(relative[1]) * scene.friction])
        kick = cone * wanted[0] / (matrix[0] @ cone)
    speeds = speeds + inverse * (kick @ rows)
    v[i], spin[i] = speeds[:2], speeds[2]
    if j >= 0:
        v[j], spin[j] = speeds[3:5], speeds[5]


def collisions(scene: Scene, count: int, until: float) -> Motion:
    """The motion up to just after `count` collisions, or up to `until` s."""
    x, v = scene.position.copy(), scene.velocity.copy()
    angle, spin = scene.angle.copy(), scene.angular_velocity.copy()
    g = np.where(scene.static[:, None], 0.0, scene.gravity)
    now = 0.0
    for found in range(count + 1):
        after, i, j, way = next_contact(scene, x, v)
        s = min(after, until - now) if found < count else min(after / 2, until - now, 0.01)
        x, v, angle, now = x + (v + g * s / 2) * s, v + g * s, angle + spin * s, now + s
        if found == count or s < after:
            return Motion(now, x, v, angle, spin, found)
        resolve(scene, i, j, way, v, spin)
    raise AssertionError("the loop returns")


def sliding(scene: Scene, until: float, steps: int) -> tuple[float, float, float]:
    """m along its wall, m/s along it and rad/s of disk 0, which lies on wall 0, after `until` s in
    so many steps."""
    start, end = scene.walls[0]
    along = (end - start) / np.hypot(*(end - start))
    side = np.sign(
        along[0] * (scene.position[0] - start)[1] - along[1] * (scene.position[0] - start)[0]
    )
    acceleration, load = (
        scene.gravity @ along,
        -side * (along[0] * scene.gravity[1] - along[1] * scene.gravity[0]),
    )
    r, turns = scene.radius[0], scene.mass[0] / scene.inertia[0]
    place, v, w = 0.0, float(scene.velocity[0] @ along), float(scene.angular_velocity[0])
    h = until / steps
    for _ in range(steps):
        before = v
        v += acceleration * h
        wanted = -(v + side * r * w) / (1 + r * r * turns)
        kick = min(max(wanted, -scene.friction * load * h), scene.friction * load * h)
        v, w = v + kick, w + side * r * turns * kick
        place += (before + v) / 2 * h
    return place, v, w
