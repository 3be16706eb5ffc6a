"""The event loop: exact flights between hits, in any numbers, from one next event per disk.

Each body keeps its motion since its own last event; each moving disk keeps a record of what it touches first. A
record is stale when a partner has had an event since; it is then made anew when its turn comes. Every pair is covered
by whichever of the two was predicted last (Lubachevsky, J. Comput. Phys. 94, 255, 1991).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from scenarios.model import Scene, Thrust
from scenarios.numbers import Number, Numbers, Undecided
from scenarios.oracle_bodies import Bodies, Leg
from scenarios.oracle_contacts import Pressed
from scenarios.oracle_filter import earliest_bodies, earliest_walls
from scenarios.oracle_ties import Blow, Contact

MOST_HITS = 10_000
MOST_STEPS = 20_000  # hits, edges crossed, records made anew
CROWDED = 64  # hits of one disk ...
INSTANT = 1e-9  # ... within so many s: they pile up towards a point in time


class Ends(Exception):
    """The motion has no answer from `t` s on; str() says why."""

    def __init__(self, t: float, reason: str) -> None:
        self.t = t
        super().__init__(f"{reason} at t = {t:.9g} s")


class Event(NamedTuple):
    """A hit: t s, disk, other disk or -1 - wall, impulse N s, cosine of the impact angle."""

    t: Number
    i: int
    j: int
    impulse: Number
    cosine: float


class Record(NamedTuple):
    """What a disk touches first (several contacts if at once), when, and how often each partner had been hit then."""

    t: Number
    contacts: tuple[Contact, ...]
    counts: tuple[int, ...]


@dataclass
class Path:
    """What was found: the legs of each disk, the hits, and until when (s) and why no further."""

    legs: list[list[Leg]]
    events: list[Event] = field(default_factory=list)
    end: float = np.inf
    reason: str = ""


class Motion:
    """A scene on its way to `until` s, in the numbers `k`; all arithmetic must be done within `k.precise()`."""

    def __init__(self, scene: Scene, thrusts: Sequence[Thrust], until: float, k: Numbers) -> None:
        self.k, self.until, self.scene = k, until, scene
        self.bodies = Bodies(scene, k)
        self.moving = np.flatnonzero(~scene.static)
        self.records: list[Record | None] = [None] * scene.n
        self.due = np.full(scene.n, np.inf)
        self.now = k.exact(0.0)
        self.path = Path([[self.bodies.leg(i)] for i in range(scene.n)])
        self.recent: list[deque[float]] = [deque(maxlen=CROWDED) for _ in range(scene.n)]
        # From the last to the first, so that the next one can be popped.
        self.switches = sorted(((t, p.disk) for p in thrusts for t in (p.start, p.stop) if t < until), reverse=True)
        self.thrusts = thrusts

    def run(self) -> Path:
        """Everything up to `until`, or up to where the motion has no answer."""
        try:
            for i in self.moving:
                self.predict(int(i))
            for _ in range(MOST_STEPS):
                if not self.advance():
                    return self.path
                if len(self.path.events) >= MOST_HITS:
                    raise Ends(float(self.now), f"more than {MOST_HITS} hits")
            raise Ends(float(self.now), f"more than {MOST_STEPS} events")
        except Ends as end:
            self.path.end, self.path.reason = end.t, str(end)
        return self.path

    def advance(self) -> bool:
        """Do what comes next; False if nothing does before `until`."""
        soonest = self.due.min()
        if self.switches and self.switches[-1][0] <= soonest:
            t, disk = self.switches.pop()
            self.switch(self.k.exact(t), disk)
            return True
        if soonest == np.inf:
            return False
        i, contacts = self.next_contacts(soonest)
        if not contacts:
            self.predict(i)
        elif len(contacts) == 1 and contacts[0].kind == "edge":
            self.wrap(contacts[0])
        else:
            self.collide(contacts)
        return True

    def next_contacts(self, soonest: float) -> tuple[int, list[Contact]]:
        """The first disk and the contacts of its event; none if its record is stale and must be made anew.

        float64 clocks only tell which records are worth comparing.
        """
        near = [int(i) for i in np.flatnonzero(self.due <= soonest + 1e-9 * max(1.0, soonest))]
        first = near[0]
        for i in near[1:]:
            if self.order(self.record(i), self.record(first)) < 0:
                first = i
        record = self.record(first)
        if self.k.name == "arb" or self.k.sign(record.t - self.now):
            self.now = record.t
        if self.stale(record):
            return first, []
        found = dict.fromkeys(record.contacts)
        for i in near:
            other = self.record(i)
            shares = any(a.disks & b.disks for a in other.contacts for b in found)
            if i != first and shares and self.order(other, record) == 0:
                if self.stale(other):
                    return i, []
                found |= dict.fromkeys(other.contacts)
        # Both members of a pair may have recorded it.
        once = {(c.kind, *sorted((c.i, c.j)), c.side) if c.kind == "body" else c: c for c in found}
        return first, list(once.values())

    def record(self, i: int) -> Record:
        """The record of a disk that is due."""
        record = self.records[i]
        assert record is not None
        return record

    def order(self, one: Record, other: Record) -> int:
        """-1, 0 or 1 as `one` comes before, with or after `other`; balls that overlap are the same time if the same."""
        try:
            return self.k.sign(one.t - other.t)
        except Undecided:
            mine, theirs = (set().union(*(c.disks for c in record.contacts)) for record in (one, other))
            if mine == theirs or not mine & theirs:
                return 0
            raise

    def stale(self, record: Record) -> bool:
        """Whether a partner has had an event since the record was made."""
        counts = self.bodies.count
        return any(c.kind == "body" and counts[c.j] != then for c, then in zip(record.contacts, record.counts))

    def predict(self, i: int) -> None:
        """Find what disk i touches first from now on."""
        bodies, k = self.bodies, self.k
        now = float(self.now)
        left = self.until - now
        best: list[tuple[Number, Contact]] = []
        try:
            for bound, contact in self.candidates(i, now):
                limit = float(best[0][0]) if best else left
                if bound > limit * (1 + 1e-9) + 1e-12:
                    break
                if (after := bodies.time_to(contact, self.now, limit)) is None:
                    continue
                place = k.sign(after - best[0][0]) if best else -1
                best = [(after, contact)] if place < 0 else [*best, (after, contact)] if place == 0 else best
        except Pressed:
            raise Ends(now, f"disk {i} is pressed onto {self.name(contact)}") from None
        self.records[i], self.due[i] = None, np.inf
        if best and float(best[0][0]) <= left:
            after, contacts = best[0][0], tuple(contact for _, contact in best)
            t = self.now + after
            if k.name != "arb" and not k.sign(after):
                t = self.now
            self.records[i] = Record(t, contacts, tuple(bodies.count[c.j] if c.kind == "body" else 0 for c in contacts))
            self.due[i] = float(t)

    def candidates(self, i: int, now: float) -> list[tuple[float, Contact]]:
        """What disk i may touch, with the s from now before which it cannot, soonest first."""
        bodies = self.bodies
        bounds = earliest_bodies(bodies.table, bodies.radii, i, now)
        found = [(float(bounds[j]), Contact("body", i, int(j))) for j in np.flatnonzero(bounds < np.inf)]
        if len(self.scene.walls):
            bounds = earliest_walls(bodies.table, bodies.radii, self.scene.walls, i, now)
            found += [(float(bounds[w]), Contact("wall", i, int(w), s)) for w in np.argsort(bounds) for s in (1, -1)]
        if self.scene.wrap is not None:
            found += [(0.0, Contact("edge", i, axis, side)) for axis in (0, 1) for side in (1, -1)]
        return sorted(found, key=lambda each: each[0])

    def collide(self, contacts: list[Contact]) -> None:
        """Resolve the contacts of one instant; where their order matters there is no answer."""
        bodies, now = self.bodies, float(self.now)
        if any(contact.kind == "edge" for contact in contacts):
            raise Ends(now, f"disk {contacts[0].i} crosses the edge of the wrap while it touches another")
        alone = len(contacts) == 1
        touches = [bodies.touch(c, self.now) for c in contacts] if alone else bodies.cluster(contacts, self.now)
        disks = sorted({i for touch in touches for i in touch.contact.disks})
        v = {i: bodies.velocity_at(i, self.now) for i in disks}
        if alone:
            after, blow = bodies.matter.hit(touches[0], v)
            blows = [blow]
        else:
            ends = bodies.matter.outcomes(touches, v)
            if len(ends) != 1 or not ends[0][0]:
                raise Ends(now, self.undecided(disks, len(ends), all(end for end, _ in ends)))
            after, blows = ends[0]
        for blow in blows:
            self.log(blow)
        touched = {i for blow in blows for i in blow.contact.disks}
        for i in sorted(touched or set(disks)):
            bodies.start_leg(i, self.now, after[i])
        bodies.remember(touches, touched)
        self.follow_up(touched or set(disks))

    def undecided(self, disks: list[int], outcomes: int, ending: bool) -> str:
        """Why a simultaneous contact has no answer."""
        names = ", ".join(str(i) for i in disks if i < self.scene.n)
        if not ending:
            return f"disks {names} touch at once and their hits do not end"
        return f"disks {names} touch at once and the outcome depends on the order of their hits ({outcomes} outcomes)"

    def log(self, blow: Blow) -> None:
        """Write a hit down; refuse where those of a disk pile up."""
        contact, now = blow.contact, float(self.now)
        j = self.bodies.partner(contact)
        self.path.events.append(Event(self.now, contact.i, j, blow.impulse, float(blow.cosine)))
        for i in (contact.i, j):
            if i >= 0:
                recent = self.recent[i]
                if len(recent) == CROWDED and now - recent[0] < INSTANT:
                    other = self.name(contact) if i == contact.i else f"disk {contact.i}"
                    raise Ends(recent[0], f"the hits of disk {i} on {other} accumulate")
                recent.append(now)

    def wrap(self, contact: Contact) -> None:
        """Set a disk onto the opposite edge; where another stands there, the exercise gives no answer."""
        i, bodies = contact.i, self.bodies
        bodies.start_leg(i, self.now, bodies.velocity_at(i, self.now), edge=contact)
        for other in bodies.standing_on(i, self.now):
            raise Ends(float(self.now), f"disk {i} re-enters over the edge of the wrap onto {self.name(other)}")
        self.follow_up({i})

    def switch(self, t: Number, disk: int) -> None:
        """Begin or end a push."""
        self.now = t
        on = [p for p in self.thrusts if p.disk == disk and p.start <= float(t) < p.stop]
        self.bodies.push(disk, t, on)
        self.follow_up({disk})

    def follow_up(self, disks: set[int]) -> None:
        """Write down the new legs and predict the disks anew."""
        for i in sorted(i for i in disks if i < self.scene.n and not self.scene.static[i]):
            self.path.legs[i].append(self.bodies.leg(i))
            self.predict(i)

    def name(self, contact: Contact) -> str:
        """The other side of a contact, in words."""
        j = self.bodies.partner(contact)
        return f"disk {j}" if j >= 0 else f"wall {-1 - j}"


def trace(scene: Scene, thrusts: Sequence[Thrust], until: float, k: Numbers) -> Path:
    """The motion of `scene` under `thrusts` up to `until` s, in the numbers `k`. Raises what `Bodies` raises."""
    with k.precise():
        return Motion(scene, thrusts, until, k).run()
