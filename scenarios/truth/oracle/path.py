"""The motion that the event loop computes: legs, collisions, and why and when it ends; and the
limits on the work for it: a number of steps, the same on every machine, and a time limit where
somebody waits for the answer."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from time import monotonic
from typing import NamedTuple

import numpy as np

from crosscheck2d.scenarios.model import Scene
from crosscheck2d.scenarios.truth.oracle.bodies import Leg
from crosscheck2d.scenarios.truth.oracle.numbers import Number
from crosscheck2d.scenarios.truth.oracle.ties import ENDLESS, TOO_MANY, Contact, TieOutcome, key

ACCUMULATED = 64  # collisions of one disk ...
INSTANT = 1e-9  # ... within this many s accumulate; in a fast scene ...
SHARE = 1e-7  # ... within this share of the time in which a disk moves by its radius
SUSPECT, OFTEN = 16, 4  # collisions of a disk, and of one contact of it, that may accumulate
NAMED = 1e-5  # s before that; the bodies it collides with in this time are named in the reason
# collisions, edges crossed, records made anew, orders of simultaneous collisions tried
MOST_STEPS = 60_000


class MotionEnds(Exception):
    """The motion has no exact answer from `t` s on; str() says why.

    disks: those it concerns. outcomes: the possible outcomes, if they are known. few_bits: whether
    numbers of more bits would go on.
    """

    few_bits = False

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
    """A computed motion."""

    legs: list[list[Leg]]  # of each disk, in order of time
    events: list[Event] = field(default_factory=list)
    end: float = np.inf  # s, up to when there is an exact answer
    reason: str = ""  # why it ends there
    disks: list[int] = field(default_factory=list)  # those that the reason concerns
    outcomes: list[TieOutcome] = field(default_factory=list)  # at the end, if they are known
    # the collisions of each outcome: disk, other disk or -1 - wall
    named: list[list[tuple[int, int]]] = field(default_factory=list)
    few_bits: bool = False  # whether it ends because its numbers have too few bits
    searched: float = np.inf  # s, from when on it rests on a search, see `TieOutcome`

    def cut(self, end: float, reason: str) -> Path:
        return Path(self.legs, self.events, end, reason, searched=self.searched)


class RecentCollisions:
    """The latest collisions of each disk of a scene."""

    def __init__(self, scene: Scene) -> None:
        self.collisions: list[deque[tuple[float, Contact]]] = [
            deque(maxlen=4 * ACCUMULATED) for _ in range(scene.n)
        ]
        radius = float(scene.radius.min())
        fastest = max(
            float(np.hypot(*scene.velocity.T).max()),
            float(np.sqrt(np.hypot(*scene.gravity) * radius)),
        )
        # s; so many collisions within it accumulate. At e = 1 it is 0: there are finitely many
        # collisions in a finite time (Vaserstein, Commun. Math. Phys. 69, 31, 1979).
        self.instant = min(INSTANT, SHARE * radius / fastest) if fastest else INSTANT
        if scene.restitution == 1:
            self.instant = 0.0
        self.since: dict[int, float] = {}  # s, when the collisions of a disk began to accumulate
        # the latest contacts of each disk whose collisions have died out
        self.closed: list[deque[tuple[float, Contact]]] = [deque(maxlen=OFTEN) for _ in scene.mass]

    def add(self, t: float, contact: Contact) -> list[int]:
        """Note a collision at t s; those of its disks whose collisions may accumulate."""
        disks = [i for i in contact.disks if i < len(self.collisions)]
        for i in disks:
            self.collisions[i].append((t, contact))
            if i not in self.since and self.within(i, ACCUMULATED, t):
                self.since[i] = self.collisions[i][-ACCUMULATED][0]
        return [i for i in disks if self.within(i, SUSPECT, t)]

    def within(self, i: int, count: int, t: float) -> bool:
        collisions = self.collisions[i]
        return len(collisions) >= count and t - collisions[-count][0] <= self.instant

    def close(self, contacts: Sequence[Contact], t: float) -> None:
        closed = {key(contact) for contact in contacts}
        for i in {i for c in contacts for i in c.disks if i < len(self.collisions)}:
            collisions = self.collisions[i]
            open_ones = [entry for entry in collisions if key(entry[1]) not in closed]
            self.collisions[i] = deque(open_ones, collisions.maxlen)
            self.since.pop(i, None)
            self.closed[i].extend((t, contact) for contact in contacts if i in contact.disks)

    def dying(self, i: int, t: float) -> list[Contact]:
        """The contacts, connected to disk i by others of them, whose collisions accumulate at t s:
        those with `OFTEN` or more within an instant, and those that have closed in it: a disk in
        a wedge may bounce to its rest on one wall between two bounces on the other one."""
        contacts, waiting = dict[tuple[object, ...], Contact](), [i]
        for disk in waiting:
            count = Counter(c for at, c in self.collisions[disk] if t - at <= self.instant)
            shortly = [c for at, c in self.closed[disk] if t - at <= self.instant]
            often = Counter[tuple[object, ...]]()
            for contact in count:
                often[key(contact)] += count[contact]
            for contact in dict.fromkeys([*count, *shortly]):
                if contact in shortly or often[key(contact)] >= OFTEN:
                    contacts.setdefault(key(contact), contact)
                    more = {j for j in contact.disks if j < len(self.collisions)}
                    waiting += sorted(more - {*waiting})
        return list(contacts.values())

    def ends(self, i: int, t: float, name: Callable[[Contact], str]) -> MotionEnds:
        latest = [contact for at, contact in self.collisions[i] if at > t - NAMED]
        others = sorted({name(c) if c.i == i else f"disk {c.i}" for c in latest})
        disks = [i, *(int(other[5:]) for other in others if other.startswith("disk"))]
        reason = f"the collisions of disk {i} on {' and '.join(others)} accumulate"
        return MotionEnds(self.since[i], reason, disks)


def ambiguous(disks: Sequence[int], ends: Sequence[TieOutcome]) -> str:
    what, their = f"disks {', '.join(map(str, disks))} touch at once", "their"
    if len(disks) == 1:
        what, their = f"disk {disks[0]} touches several walls at once", "its"
    if ends[-1].unresolved == ENDLESS:
        return f"{what} and {their} collisions do not end"
    if ends[-1].unresolved == TOO_MANY:
        return (
            f"{what}, {their} collisions have more orders than can be tried, and the outcome may"
            " depend on the order"
        )
    return (
        f"{what} and the outcome depends on the order of {their} collisions ({len(ends)} outcomes)"
    )


class TimeLimit:
    """A time limit for all attempts at an answer, from the creation of the object on. An answer
    that it cuts short, for this reason, depends on the machine, and is never cached."""

    def __init__(self, seconds: float = inf, reason: str = "") -> None:
        self.end, self.reason = monotonic() + seconds, reason
        self.expired = False  # whether an attempt was cut short


class WorkLimit:
    """The limits of one attempt: `left` steps, and a share of the time that its clock has left."""

    def __init__(
        self, left: int = MOST_STEPS, clock: TimeLimit | None = None, share: float = 1.0
    ) -> None:
        self.left, self.clock, now = left, clock or TimeLimit(), monotonic()
        self.stop = now + share * (self.clock.end - now)

    def step(self, t: float, bits: int) -> None:
        """Count a step that led to `t` s in numbers of `bits` bits; raises `MotionEnds` if none is
        left."""
        self.left -= 1
        if self.left < 0:
            raise MotionEnds(t, f"the work allowed for an answer in {bits} bits is used up")
        if monotonic() > self.stop:
            self.clock.expired = True
            raise MotionEnds(t, self.clock.reason)
