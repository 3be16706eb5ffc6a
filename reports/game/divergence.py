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


class Edge(NamedTuple):
    """Where a ship left the field: frame, and where it was last seen inside, (x, y) m."""

    frame: int
    x: float
    y: float


class Divergence(NamedTuple):
    """Where a ghost left the solid ship's engine: the collision, or the edge that the ship of only
    one of them left the field by, and whose it was."""

    at: LastCollision | Edge
    shared: bool  # both engines had it, and made different velocities of it
    solid_only: bool


class Touches:
    """The latest collision of every disk in one engine, and how many there were.

    scene: whose radii tell where two disks touch.
    weight: N s, of `weight_impulse`.
    """

    def __init__(self, scene: Scene, weight: float) -> None:
        self.radius, self.weight, self.count = scene.radius, weight, 0
        self.frame = np.full(scene.n, -WAIT)
        self.last: dict[int, LastCollision] = {}
        # by pair: step of the latest impulse, and size of the strongest
        self.step: dict[tuple[int, int], int] = {}
        self.strongest: dict[tuple[int, int], float] = {}

    def note(self, collisions: Iterable[ContactImpulse], frame: int, state: State) -> None:
        """`collisions` happened in frame `frame`, which ended in `state`."""
        for collision in collisions:
            i, j = (collision.i, collision.j) if collision.i >= 0 else (collision.j, collision.i)
            self.count += self.begins(collision)
            x, y = contact(state.position, self.radius, i, j)
            for disk in (i, j):
                if disk >= 0:
                    self.frame[disk] = frame
                    self.last[disk] = LastCollision(frame, i, j, x, y)

    def begins(self, collision: ContactImpulse) -> bool:
        """Whether an impulse is a collision of its own, as `first_collisions` counts
        them, but for one that only a later impulse shows to be rounding.

        One by one: a faulty solver may have thousands a second, which are not counted anew in every
        frame.
        """
        i, j, size = collision.i, collision.j, abs(collision.impulse)
        pair = (min(i, j), max(i, j))
        self.strongest[pair] = strongest = max(size, self.strongest.get(pair, 0.0))
        if size < 1e-6 * strongest:
            return False
        before, self.step[pair] = self.step.get(pair, -2), collision.step
        return collision.step - before > 1 or size > self.weight

    def begin_again(self, disk: int) -> None:
        """The engine counts its steps from 0 again, and `disk` is at its start: nothing has struck
        it yet."""
        self.step.clear()
        self.frame[disk] = -WAIT
        self.last.pop(disk, None)


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
