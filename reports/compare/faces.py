"""Collisions by what a disk can distinguish: walls along one line count as one, however many
segments they have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reports.compare import laws
from scenarios.model import Array, Collisions, Scene, Trajectory, frozen

ALONG = 1e-12
"""Fraction of the largest coordinate: an end of a wall this close to the line of another wall lies
on it. A few thousand roundings: a wall cut in two at any of its points stays on its line."""
SAME = 1e-9
"""Fraction of a sample interval, or a step: events closer in time are simultaneous up to the
rounding of the grid."""


def first_on_line(walls: Array, one: int) -> int:
    """The first of the walls (w, 2, 2) that lie on the line of wall `one`."""
    start, span = walls[one, 0], walls[one, 1] - walls[one, 0]
    off = np.abs(laws.cross(walls - start, span)) / np.hypot(*span)
    return int(np.argmax((off <= ALONG * np.abs(walls).max()).all(axis=1)))


@laws.cached
def on_faces(trajectory: Trajectory, scene: Scene) -> Collisions:
    """The collisions of a trajectory, with each wall replaced by the first on its line, and one for
    each pair and instant.

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
    again = (np.diff(collisions.i[order]) == 0) & (np.diff(j[order]) == 0) & near
    kept = np.ones(len(collisions), bool)
    kept[order[1:][again]] = False
    columns = {"t": collisions.t[kept], "impulse": collisions.impulse[kept]}
    whole = {"i": frozen(collisions.i[kept], np.int64), "j": frozen(j[kept], np.int64)}
    return replace(
        collisions, **{name: frozen(column) for name, column in columns.items()}, **whole
    )


def interval(trajectory: Trajectory) -> float:
    """s between two samples."""
    return float(trajectory.t[1] - trajectory.t[0]) if len(trajectory) > 1 else 0.0
