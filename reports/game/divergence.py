"""Finds the collision at which two engines part: the first after which a disk moves on differently
in the two."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from adapters.engine import ContactImpulse
from scenarios.model import Array, Scene, State

# m/s: disks that move on differently by less have not diverged, they were found a step early or
# late
DIVERGED = 0.01
# frames without a collision of a disk before its velocities are compared: engines find a collision
# some steps apart
WAIT = 6


class LastCollision(NamedTuple):
    """A disk's latest collision: frame, its disks (wall w as -1 - w), and where the two touched,
    (x, y) m."""

    frame: int
    i: int
    j: int
    x: float
    y: float


class Divergence(NamedTuple):
    """Where a ghost left the solid ship's engine: the collision, and whose it was."""

    collision: LastCollision
    shared: bool  # both engines had it, and made different velocities of it
    solid_only: bool


class Touches:
    """The latest collision of every disk in one engine. scene: whose radii tell where two disks
    touch."""

    def __init__(self, scene: Scene) -> None:
        self.radius = scene.radius
        self.frame = np.full(scene.n, -WAIT)
        self.last: dict[int, LastCollision] = {}

    def note(self, collisions: Iterable[ContactImpulse], frame: int, state: State) -> None:
        """`collisions` happened in frame `frame`, which ended in `state`."""
        for collision in collisions:
            i, j = (collision.i, collision.j) if collision.i >= 0 else (collision.j, collision.i)
            x, y = contact(state.position, self.radius, i, j)
            for disk in (i, j):
                if disk >= 0:
                    self.frame[disk] = frame
                    self.last[disk] = LastCollision(frame, i, j, x, y)


def contact(position: Array, radius: Array, i: int, j: int) -> tuple[float, float]:
    """(x, y) m where disks i and j touch; of a wall, only the disk's centre is known here."""
    share = radius[i] / (radius[i] + radius[j]) if j >= 0 else 0.0
    x, y = position[i] + share * (position[max(j, 0)] - position[i])
    return float(x), float(y)


def divergence(
    solid: Touches, ghost: Touches, velocity: Array, other: Array, frame: int
) -> Divergence | None:
    """The collision after which the velocities (n, 2) m/s of solid and ghost differ, if they do by
    frame `frame`."""
    latest = np.maximum(solid.frame, ghost.frame)
    diverged = np.hypot(*(velocity - other).T) > DIVERGED
    found = np.flatnonzero(diverged & (latest >= 0) & (frame - latest >= WAIT))
    if not len(found):
        return None
    disk = int(found[np.argmin(latest[found])])
    mine, theirs = solid.last.get(disk), ghost.last.get(disk)
    both = bool(
        mine and theirs and {*mine[1:3]} == {*theirs[1:3]} and abs(mine.frame - theirs.frame) < WAIT
    )
    solid_later = mine is not None and (theirs is None or mine.frame >= theirs.frame)
    collision = mine if both or solid_later else theirs
    assert collision is not None
    return Divergence(collision, both, not both and solid_later)
