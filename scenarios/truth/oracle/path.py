"""What the event loop finds: legs, collisions, and the reason where the motion has no answer any
more."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from scenarios.truth.oracle.bodies import Leg
from scenarios.truth.oracle.numbers import Number
from scenarios.truth.oracle.ties import Contact, Outcome

CROWDED = 64  # collisions of one disk ...
INSTANT = 1e-9  # ... within so many s: they pile up towards a point in time
PILE = 1e-5  # s before it; whom it strikes in between takes part


class Ends(Exception):
    """The motion has no answer from `t` s on; str() says why. `open` holds what it may become, if
    that is known."""

    def __init__(
        self, t: float, reason: str, disks: Sequence[int] = (), outcomes: Sequence[Outcome] = ()
    ) -> None:
        self.t, self.disks, self.outcomes = t, list(disks), list(outcomes)
        super().__init__(f"{reason} at t = {t:.9g} s")


class Event(NamedTuple):
    """A collision: t s, disk, other disk or -1 - wall, impulse N s, cosine of the impact angle;
    new: they come together now, and did not touch before."""

    t: Number
    i: int
    j: int
    impulse: Number
    cosine: float
    new: bool = False


class Record(NamedTuple):
    """What a disk touches first (several contacts if at once), when, and how often each partner had
    been struck then."""

    t: Number
    contacts: tuple[Contact, ...]
    counts: tuple[int, ...]


@dataclass
class Path:
    """What was found: the legs of each disk, the collisions; until when (s), why no further, whom
    it concerns, how it may go on, and by which collisions (disk, other disk or -1 - wall)."""

    legs: list[list[Leg]]
    events: list[Event] = field(default_factory=list)
    end: float = np.inf
    reason: str = ""
    disks: list[int] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    named: list[list[tuple[int, int]]] = field(default_factory=list)


class Recent:
    """The latest collisions of each of n disks."""

    def __init__(self, n: int) -> None:
        self.collisions: list[deque[tuple[float, str]]] = [
            deque(maxlen=4 * CROWDED) for _ in range(n)
        ]

    def add(self, i: int, t: float, other: str) -> None:
        """Disk i collisions `other` at t s. Raises `Ends` where its collisions pile up towards an
        instant."""
        collisions = self.collisions[i]
        collisions.append((t, other))
        if len(collisions) < CROWDED or t - collisions[-CROWDED][0] > INSTANT:
            return
        others = sorted({name for at, name in collisions if at > t - PILE})
        disks = [i, *(int(name[5:]) for name in others if name.startswith("disk"))]
        raise Ends(
            collisions[-CROWDED][0],
            f"the collisions of disk {i} on {' and '.join(others)} accumulate",
            disks,
        )


def ambiguous(disks: str, ends: Sequence[Outcome]) -> str:
    """Why a simultaneous contact has no answer."""
    if not ends[-1].velocities:
        return f"disks {disks} touch at once and their collisions do not end"
    return (
        f"disks {disks} touch at once and the outcome depends on the order of their collisions"
        f" ({len(ends)} outcomes)"
    )
