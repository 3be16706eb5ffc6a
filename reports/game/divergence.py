"""Finds the collision at which two engines diverge: the first after which the velocity of a disk
differs in the two."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse
from crosscheck2d.scenarios.model import Array, Scene, State

# m/s: disks whose velocities differ by less have not diverged, they were found a step early or late
DIVERGED = 0.01
# frames on end in which a velocity differs before it counts: engines find a collision some steps
# apart
WAIT = 6
NEVER = 2**31  # a frame that no flight has


class FlightEvent(NamedTuple):
    """What happened in a frame at (x, y) m.

    disks: the two that collided for the first time in that frame (wall w as -1 - w); the one whose
    velocity came to differ without a collision; or none: the ship left the field, and was seen
    there last. t: s on the flight's clock, of a collision.
    """

    frame: int
    x: float
    y: float
    disks: tuple[int, ...] = ()
    t: float = 0.0


class Divergence(NamedTuple):
    """Where a ghost diverged from the engine that was solid then, and what happened there; `only`:
    the engine in which alone it happened, "" in both."""

    at: FlightEvent
    solid: str
    only: str


class Touches:
    """The first collision of every disk in each of the last frames of one engine, and how many
    collisions there were.

    scene: whose radii tell where two disks touch.
    dt: s, of a step.
    weight: N s, of `weight_impulse`.
    """

    def __init__(self, scene: Scene, dt: float, weight: float) -> None:
        self.radius, self.dt, self.weight, self.count = scene.radius, dt, weight, 0
        self.since = 0.0  # s on the flight's clock from which the engine counts its steps
        self.recent: list[FlightEvent] = []
        # by pair: step of the latest impulse, and size of the strongest
        self.step: dict[tuple[int, int], int] = {}
        self.strongest: dict[tuple[int, int], float] = {}

    def note(
        self, collisions: Iterable[ContactImpulse], frame: int, before: State, began: float
    ) -> None:
        """`collisions` happened in frame `frame`, after `before`, the state at `began` s.

        Where two disks touched is found from `before`: afterwards a faulty solver may have thrown
        them across the field.
        """
        self.recent = [touch for touch in self.recent if touch.frame >= frame - WAIT]
        struck = {disk for touch in self.recent if touch.frame == frame for disk in touch.disks}
        for collision in collisions:
            i, j = (collision.i, collision.j) if collision.i >= 0 else (collision.j, collision.i)
            self.count += self.begins(collision)
            t = self.since + (collision.step + 1) * self.dt
            if not {i, max(i, j)} <= struck:
                position = before.position + (t - began) * before.velocity
                # of a wall, only the disk's centre is known here
                share = self.radius[i] / (self.radius[i] + self.radius[j]) if j >= 0 else 0.0
                place = position[i] + share * (position[max(j, 0)] - position[i])
                x, y = place.tolist()
                self.recent.append(FlightEvent(frame, x, y, (i, j), t))
                struck |= {i, j}

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

    def begin_again(self, disk: int, now: float) -> None:
        """The engine counts its steps from 0 again, from `now` s of the flight on, and `disk` is
        placed anew: nothing has struck it yet."""
        self.since = now
        self.step.clear()
        self.recent = [touch for touch in self.recent if disk not in touch.disks]


def differing_since(since: Array, velocity: Array, other: Array, frame: int) -> Array:
    """(n,) the frame since which each disk has had another velocity, (n, 2) m/s, in two engines,
    `NEVER` where it has the same; `since`: the same of the frame before `frame`."""
    differs = np.hypot(*(velocity - other).T) > DIVERGED
    return np.where(differs, np.minimum(since, frame), NEVER)


def cause_of(
    since: Array, solid: Touches, ghost: Touches, state: State, frame: int
) -> tuple[FlightEvent, bool, bool] | None:
    """What made a disk differ that has done so for `WAIT` frames by the end of frame `frame`, and
    whether it happened in the solid engine and in the ghost; None if no disk has. `state`: the
    ghost's."""
    first = int(since.min())
    if frame - first + 1 < WAIT:
        return None
    disks = set(np.flatnonzero(since == first).tolist())
    touches = [touch for touch in (*solid.recent, *ghost.recent) if touch.frame == first]
    touches = [touch for touch in touches if disks & set(touch.disks)]
    if not touches:
        disk = min(disks)
        x, y = state.position[disk].tolist()
        return FlightEvent(first, x, y, (disk,)), True, True
    # both its disks, if others of them met a right one in the same frame
    at = min(
        touches, key=lambda touch: (any(k >= 0 and k not in disks for k in touch.disks), touch.t)
    )
    pair = set(at.disks)
    happened = [any(set(x.disks) == pair for x in noted.recent) for noted in (solid, ghost)]
    return at, happened[0], happened[1]
