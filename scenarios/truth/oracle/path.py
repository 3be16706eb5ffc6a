"""The motion that the event loop computes: legs, collisions, and why and when it ends."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from scenarios.model import Scene
from scenarios.truth.oracle.bodies import Leg
from scenarios.truth.oracle.numbers import Number
from scenarios.truth.oracle.ties import Contact, TieOutcome

ACCUMULATED = 64  # collisions of one disk ...
INSTANT = 1e-9  # ... within this many s accumulate; in a fast scene ...
SHARE = 1e-7  # ... within this share of the time in which a disk moves by its radius
NAMED = 1e-5  # s before that; the bodies it collides with in this time are named in the reason


class MotionEnds(Exception):
    """The motion has no exact answer from `t` s on; str() says why.

    disks: those it concerns. outcomes: the possible outcomes, if they are known.
    """

    def __init__(
        self, t: float, reason: str, disks: Sequence[int] = (), outcomes: Sequence[TieOutcome] = ()
    ) -> None:
        self.t, self.disks, self.outcomes = t, list(disks), list(outcomes)
        super().__init__(f"{reason} at t = {t:.9g} s")


class Event(NamedTuple):
    """A collision: t s, disk, other disk or -1 - wall, impulse N s, cosine of the impact angle;
    new: whether the two did not touch before."""

    t: Number
    i: int
    j: int
    impulse: Number
    cosine: float
    new: bool = False


class Record(NamedTuple):
    """The next contact of a disk (several if simultaneous), its time t s, and the event count of
    each partner when it was computed."""

    t: Number
    contacts: tuple[Contact, ...]
    counts: tuple[int, ...]


@dataclass
class Path:
    """A computed motion.

    Attributes:
        legs: of each disk, in order of time.
        events: the collisions.
        end, reason: s, up to when there is an exact answer, and why it ends there.
        disks: those that the reason concerns.
        outcomes: the possible outcomes at the end, if they are known.
        named: the collisions of each outcome: disk, other disk or -1 - wall.
    """

    legs: list[list[Leg]]
    events: list[Event] = field(default_factory=list)
    end: float = np.inf
    reason: str = ""
    disks: list[int] = field(default_factory=list)
    outcomes: list[TieOutcome] = field(default_factory=list)
    named: list[list[tuple[int, int]]] = field(default_factory=list)

    def cut(self, end: float, reason: str) -> Path:
        """The motion up to an earlier end, for another reason."""
        return Path(self.legs, self.events, end, reason)


class RecentCollisions:
    """The latest collisions of each disk of a scene.

    Attributes:
        instant: s; so many collisions within it accumulate. At e = 1 it is 0: there are finitely
            many collisions in a finite time (Vaserstein, Commun. Math. Phys. 69, 31, 1979).
    """

    def __init__(self, scene: Scene) -> None:
        self.collisions: list[deque[tuple[float, str]]] = [
            deque(maxlen=4 * ACCUMULATED) for _ in range(scene.n)
        ]
        radius = float(scene.radius.min())
        fastest = max(
            float(np.hypot(*scene.velocity.T).max()),
            float(np.sqrt(np.hypot(*scene.gravity) * radius)),
        )
        self.instant = min(INSTANT, SHARE * radius / fastest) if fastest else INSTANT
        if scene.restitution == 1:
            self.instant = 0.0

    def add(self, i: int, t: float, other: str) -> None:
        """Disk i collides with `other` at t s. Raises `MotionEnds` where its collisions
        accumulate."""
        collisions = self.collisions[i]
        collisions.append((t, other))
        if len(collisions) < ACCUMULATED or t - collisions[-ACCUMULATED][0] > self.instant:
            return
        others = sorted({name for at, name in collisions if at > t - NAMED})
        disks = [i, *(int(name[5:]) for name in others if name.startswith("disk"))]
        raise MotionEnds(
            collisions[-ACCUMULATED][0],
            f"the collisions of disk {i} on {' and '.join(others)} accumulate",
            disks,
        )


def ambiguous(disks: Sequence[int], ends: Sequence[TieOutcome]) -> str:
    """The reason why simultaneous contacts of these disks have no exact answer."""
    what, their = f"disks {', '.join(map(str, disks))} touch at once", "their"
    if len(disks) == 1:
        what, their = f"disk {disks[0]} touches several walls at once", "its"
    if not ends[-1].velocities:
        return f"{what} and {their} collisions do not end"
    return (
        f"{what} and the outcome depends on the order of {their} collisions ({len(ends)} outcomes)"
    )
