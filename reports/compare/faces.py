"""Collisions by what a disk can distinguish: walls along one line count as one, however many
segments they have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.scenarios.model import Array, Collisions, Scene, Trajectory, frozen

ALONG = 2.0**-23
"""Fraction of the largest coordinate: an end of a wall this close to the line of another wall lies
on it. Engines in float32 cannot tell it from the line, nor can a file with seven digits."""
SAME = 1e-9
"""Fraction of a sample interval, or a step: events closer in time are simultaneous up to the
rounding of the grid."""
GRAZING = 1e-3
"""Of the speed: a disk that slides moves across its floor by less. Engines in float32 keep the
direction of a velocity to 1e-7; a collision as flat as this loses 1e-6 of the energy."""


def first_on_line(walls: Array, one: int) -> int:
    """The first of the walls (w, 2, 2) that lie on the line of wall `one`."""
    start, span = walls[one, 0], walls[one, 1] - walls[one, 0]
    off = np.abs(laws.cross(walls - start, span)) / np.hypot(*span)
    return int(np.argmax((off <= ALONG * np.abs(walls).max()).all(axis=1)))


@laws.cached
def on_faces(trajectory: Trajectory, scene: Scene) -> Collisions:
    """The collisions of a trajectory, with each wall replaced by the first on its line, and one for
    each pair and contact: a disk that slides from one piece of a floor to the next does not collide
    with it.

    A floor of one segment, of two end to end, or of two on top of each other gives the same
    pairs.
    """
    collisions, walls = trajectory.collisions, np.unique(trajectory.collisions.j)
    firsts = np.array(
        [-1 - first_on_line(scene.walls, -1 - j) if j < 0 else j for j in walls], np.int64
    )
    if np.array_equal(firsts, walls):
        return collisions
    j = firsts[np.searchsorted(walls, collisions.j)]
    order = np.lexsort((collisions.t, j, collisions.i))
    near = np.diff(collisions.t[order]) <= SAME * interval(trajectory)
    pair = (np.diff(collisions.i[order]) == 0) & (np.diff(j[order]) == 0)
    again = pair & near
    for k in np.flatnonzero(pair & ~near & (np.diff(collisions.j[order]) != 0)):
        before, at = collisions.t[order[k : k + 2]]
        wall = scene.walls[-1 - j[order[k]]]
        again[k] = slides(trajectory, scene, int(collisions.i[order[k]]), wall, (before, at))
    kept = np.ones(len(collisions), bool)
    kept[order[1:][again]] = False
    columns = {"t": collisions.t[kept], "impulse": collisions.impulse[kept]}
    whole = {"i": frozen(collisions.i[kept], np.int64), "j": frozen(j[kept], np.int64)}
    return replace(
        collisions, **{name: frozen(column) for name, column in columns.items()}, **whole
    )


def slides(
    trajectory: Trajectory, scene: Scene, disk: int, wall: Array, span: tuple[float, float]
) -> bool:
    """Whether a disk neither approaches the line of a wall nor leaves it in the samples of a span
    of time, in s; in the nearest sample where it holds none."""
    every = interval(trajectory)
    first, last = int(np.ceil(span[0] / every)), int(np.floor(span[1] / every))
    velocity = trajectory.velocity[min(first, last) : last + 1, disk]
    across = np.abs(velocity @ normal(wall))
    return bool((across <= slow(trajectory, scene, wall, velocity)).all())


def normal(wall: Array) -> Array:
    """(2,) the unit vector to the left of a wall, seen from its start."""
    x, y = wall[1] - wall[0]
    unit: Array = np.array([-y, x]) / np.hypot(x, y)
    return unit


def slow(trajectory: Trajectory, scene: Scene, wall: Array, velocity: Array) -> Array:
    """(k,) m/s, the most that a disk that lies on a wall moves across it: gravity acts in the
    interval of two samples, the contact that bears it may act an interval later; and `GRAZING` of
    its velocity (k, 2)."""
    falls = 2 * interval(trajectory) * abs(float(scene.gravity @ normal(wall)))
    return falls + GRAZING * laws.lengths(velocity)


def thrown_off(played: Trajectory, true: Trajectory, scene: Scene) -> tuple[float, float, int, int]:
    """The hardest jump of a disk off a surface of several walls on which it lies, slides or rolls
    in the exact answer: its speed off the surface over the most that a contact may cause, the time
    in s, the disk, and the first wall of the surface; the speed is 0 if there is none.

    It is read off the velocities: engines report the collisions of a lasting contact as they like.
    """
    worst, hits = (0.0, 0.0, -1, -1), on_faces(true, scene)
    lines = np.array([first_on_line(scene.walls, w) for w in range(len(scene.walls))])
    for i, j in {*zip(hits.i[hits.impulse == 0].tolist(), hits.j[hits.impulse == 0].tolist())}:
        if j >= 0 or (lines == -1 - j).sum() < 2:
            continue
        wall = scene.walls[-1 - j]
        outward = normal(wall) * np.sign((true.position[0, i] - wall[0]) @ normal(wall))
        above = (true.position[:, i] - wall[0]) @ outward / scene.radius[i] - 1
        struck = hits.t[(hits.impulse > 0) & ((hits.i == i) | (hits.j == i))].min(initial=np.inf)
        leaves = (np.abs(above) > laws.ON_THE_WALL) | (true.t >= struck)
        k = min(len(played), int(np.append(leaves, True).argmax()))
        if not k:
            continue
        off = (played.velocity[:k, i] - true.velocity[:k, i]) @ outward
        most = slow(played, scene, wall, true.velocity[:k, i])
        share = off / np.maximum(most, np.finfo(float).tiny)
        at = int(share.argmax())
        worst = max(worst, (float(share[at]), float(played.t[at]), i, -1 - j))
    return worst


def interval(trajectory: Trajectory) -> float:
    """s between two samples."""
    return float(trajectory.t[1] - trajectory.t[0]) if len(trajectory) > 1 else 0.0
