"""Closed forms of disks on a line: equal masses, which exchange velocities, and Galperin's
billiard."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.model import Array
from crosscheck2d.scenarios.truth.closed_forms import Collision, Motion


def fold(place: Array, length: float) -> tuple[Array, Array]:
    """A free point reflected at 0 and `length` m: its position, and the sign (1 or -1) of its
    velocity.

    place: any shape, m, its position without walls. `length` inf: no walls.
    """
    if np.isinf(length):
        return place, np.ones_like(place)
    phase = np.mod(place, 2 * length)
    return length - np.abs(length - phase), np.where(phase < length, 1.0, -1.0)


def free_points(x: Array, radius: float) -> Array:
    """(n,) m, the positions of equal disks in a row less the widths of the disks before them:
    z_i = x_i - r - 2 r i, i from the left."""
    return x - radius - 2 * radius * np.arange(len(x))


def row(x: Array, v: Array, radius: float, length: float, t: Array) -> Motion:
    """Position and velocity (k, n) of equal disks on a line, e = 1, walls at 0 and `length` m (inf:
    none).

    Equal masses swap velocities: the free points z_i pass through each other, and disk i is the
    i-th of them from the left (Tonks, Phys. Rev. 50, 955, 1936; Jepsen, J. Math. Phys. 6, 405,
    1965). x, v (n,) m, m/s, from the left; t (k,) s.
    """
    z, sign = fold(free_points(x, radius) + np.multiply.outer(t, v), length - 2 * radius * len(x))
    order = np.argsort(z, axis=-1)
    place = np.take_along_axis(z, order, axis=-1)
    return (
        place + radius + 2 * radius * np.arange(len(x)),
        np.take_along_axis(sign * v, order, axis=-1),
    )


def row_collisions(
    x: Array, v: Array, radius: float, length: float, mass: float, until: float
) -> list[Collision]:
    """The collisions of `row` up to `until` s; wall 0 is the one at 0, wall 1 the one at `length`
    m.

    Two free points meet where one meets the other or its mirror image. The disks that collide are
    those at the ranks of the two points, counted from the left.
    """
    z, room = free_points(x, radius), length - 2 * radius * len(x)
    walled = np.isfinite(room)
    laps = int(until * np.abs(v).max() / room) + 2 if walled else 0
    shift = np.arange(-laps, laps + 1) * (room if walled else 0.0)
    collisions: list[Collision] = []
    for a, b in zip(*np.triu_indices(len(z), 1)):
        for mirror in (1, -1) if walled else (1,):
            closing = v[a] - mirror * v[b]
            if closing == 0:
                continue
            for t in (2 * shift - (z[a] - mirror * z[b])) / closing:
                if 0 < t <= until:
                    points, _ = fold(z + v * t, room)
                    rank = int((np.delete(points, [a, b]) < points[a]).sum())
                    collisions.append((float(t), rank, rank + 1, float(mass * abs(closing))))
    for a in np.flatnonzero(v) if walled else ():
        for lap, t in zip(range(-laps, laps + 1), (shift - z[a]) / v[a]):
            if 0 < t <= until:
                disk, wall = (0, 0) if lap % 2 == 0 else (len(z) - 1, 1)
                collisions.append((float(t), disk, -1 - wall, float(2 * mass * abs(v[a]))))
    return collisions


def galperin(gap: Array, speed: float, mass: Array, t: Array) -> Motion:
    """The gaps (k, 2) m of Galperin's billiard, and their rates (k, 2) m/s, at the times t (k,) s.

    A light disk is at rest between a wall and a heavy disk that approaches at `speed` m/s; e = 1.
    gap (2,) m, at the start: from the wall to the light disk, and from the wall to the heavy disk
    less the width of the light one. mass (2,) kg. With a = sqrt(M) X, b = sqrt(m) x the pair is one
    point in a wedge of the angle atan(sqrt(m / M)), and unfolding the wedge makes its path a
    straight line (Galperin, Regul. Chaotic Dyn. 8, 375, 2003).
    """
    root = np.sqrt(mass)
    wedge = np.arctan2(root[0], root[1])
    rate = complex(-root[1] * speed, 0)
    line = complex(root[1] * gap[1], root[0] * gap[0]) + rate * t
    sector = np.floor(np.angle(line) / wedge)
    # An even sector is rotated back onto the wedge, an odd one is rotated back and mirrored.
    turn = np.exp(-1j * wedge * (sector + sector % 2))
    mirrored = sector % 2 == 1
    folded, folded_rate = (np.where(mirrored, np.conj(z * turn), z * turn) for z in (line, rate))
    return (
        np.stack([folded.imag, folded.real], axis=-1) / root,
        np.stack([folded_rate.imag, folded_rate.real], axis=-1) / root,
    )


def galperin_collisions(gap: Array, speed: float, mass: Array) -> list[Collision]:
    """All collisions of `galperin`, ceil(pi / wedge) - 1: of the light disk 0 alternately with
    disk 1 and wall 0.

    The straight line crosses the k-th image of the wedge's sides at the angle k wedge, where it
    loses 2 sqrt(M) V sin(k wedge) of its mass-weighted velocity.
    """
    root = np.sqrt(mass)
    wedge = np.arctan2(root[0], root[1])
    k = np.arange(1, int(np.ceil(np.pi / wedge)))
    t = (gap[1] - root[0] * gap[0] / np.tan(k * wedge) / root[1]) / speed
    kick = 2 * root[1] * speed * np.sin(k * wedge)
    # 1 N s changes the mass-weighted velocity by 1 / sqrt(mu) between the disks, by 1 / sqrt(m) at
    # the wall.
    impulse = kick * np.where(k % 2 == 1, np.sqrt(1 / (1 / mass).sum()), root[0])
    return [(float(t[i]), 0, 1 if k[i] % 2 == 1 else -1, float(impulse[i])) for i in range(len(k))]
