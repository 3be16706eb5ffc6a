"""The event loop: exact flights between collisions, in any numbers, with one next event per disk.

Each body keeps its motion since its own last event; each moving disk keeps a record of its next
contact. A record is stale if the partner has had an event since; it is predicted again when its
time comes. Of every pair, the disk that was predicted last has the valid record (Lubachevsky, J.
Comput. Phys. 94, 255, 1991).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenarios.model import Scene, Thrust
from scenarios.truth.oracle.bodies import Bodies
from scenarios.truth.oracle.contact_finder import ContactFinder, key
from scenarios.truth.oracle.contacts import Pressed
from scenarios.truth.oracle.numbers import Number, Numbers, Undecided
from scenarios.truth.oracle.path import Event, MotionEnds, Path, RecentCollisions, Record, ambiguous
from scenarios.truth.oracle.resting import (
    below,
    lie_down,
    nearly_in_line,
    next_in_line,
    press,
    settle,
)
from scenarios.truth.oracle.ties import Collision, Contact, TieOutcome, Touch, Velocities
from scenarios.truth.oracle.work import WorkLimit

MOST_IDLE = 100  # contacts in a row without a collision: the digits no longer decide


class Motion:
    """The motion of a scene up to `until` s, in the numbers `k`, within the limits of `work`; used
    only within `k.precise()`."""

    def __init__(
        self, scene: Scene, thrusts: Sequence[Thrust], until: float, k: Numbers, work: WorkLimit
    ) -> None:
        self.k, self.until, self.scene, self.work = k, until, scene, work
        self.bodies = Bodies(scene, k)
        self.finder = ContactFinder(self.bodies)
        self.records: list[Record | None] = [None] * scene.n
        self.due = np.full(scene.n, np.inf)
        self.now = k.exact(0.0)
        self.path = Path([[self.bodies.legs[i]] for i in range(scene.n)])
        self.recent = RecentCollisions(scene)
        # From the last to the first, so that the next one can be popped.
        self.starts_and_stops = sorted(
            ((t, p.disk) for p in thrusts for t in (p.start, p.stop) if t < until), reverse=True
        )
        self.thrusts = thrusts
        self.idle = 0
        self.by_itself = {
            "edge": self.wrap,
            "end": self.leave,
            "rest": self.stop,
            "slip end": self.roll,
        }

    def run(self) -> Path:
        """The motion up to `until`, or up to where it has no exact answer."""
        try:
            self.begin()
            while self.advance():
                self.work.step(float(self.now), self.k.bits)
        except MotionEnds as end:
            advice = [nearly_in_line(self.finder, i, float(self.now)) for i in end.disks[:1]]
            self.path.end, self.path.reason = end.t, "".join([str(end), *advice])
            self.path.disks, self.path.outcomes = end.disks, end.outcomes
            self.path.named = [
                [self.bodies.pair(collision.contact) for collision in one.collisions]
                for one in end.outcomes
            ]
        except Undecided:
            raise Undecided(float(self.now), self.path) from None
        return self.path

    def begin(self) -> None:
        """Begin the thrusts of t = 0, find the disks that rest, and predict all."""
        while self.starts_and_stops and self.starts_and_stops[-1][0] == 0:
            self.set_thrusts(self.starts_and_stops.pop()[1])
        for contact in lie_down(self.finder):
            self.rest(contact)
        self.follow_up(set(np.flatnonzero(~self.scene.static).tolist()))

    def advance(self) -> bool:
        """Carry out the next event; False if there is none before `until`."""
        soonest = self.due.min()
        if self.starts_and_stops and self.starts_and_stops[-1][0] <= soonest:
            t, disk = self.starts_and_stops.pop()
            self.now = self.k.exact(t)
            self.set_thrusts(disk)
            self.follow_up({disk})
            return True
        if soonest == np.inf:
            return False
        i, contacts = self.next_contacts(soonest)
        if not contacts:
            self.predict(i)
        elif len(contacts) == 1 and contacts[0].kind in self.by_itself:
            self.by_itself[contacts[0].kind](contacts[0])
        else:
            self.collide(contacts)
        return True

    def next_contacts(self, soonest: float) -> tuple[int, list[Contact]]:
        """The disk with the earliest event, and the contacts of that; none if its record is stale
        and must be predicted again.

        The times in float64 only select the records that are compared in many digits.
        """
        near = [int(i) for i in np.flatnonzero(self.due <= soonest + 1e-9 * max(1.0, soonest))]
        first = near[0]
        for i in near[1:]:
            if self.order(self.record(i), self.record(first)) < 0:
                first = i
        record = self.record(first)
        if self.k.proves or self.k.sign(record.t - self.now):
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
        """-1, 0 or 1 if `one` is before, simultaneous with or after `other`. Balls that overlap are
        simultaneous if they belong to the same disks, or to none in common."""
        try:
            return self.k.sign(one.t - other.t)
        except Undecided:
            mine, theirs = (
                set().union(*(c.disks for c in record.contacts)) for record in (one, other)
            )
            if mine == theirs or not mine & theirs:
                return 0
            raise

    def stale(self, record: Record) -> bool:
        """Whether a partner has had an event since the record was made."""
        counts = self.bodies.count
        return any(
            c.kind == "body" and counts[c.j] != then
            for c, then in zip(record.contacts, record.counts)
        )

    def predict(self, i: int) -> None:
        """Find the next contact of disk i."""
        k = self.k
        now = float(self.now)
        left = self.until - now
        best: list[tuple[Number, Contact]] = []
        try:
            for bound, contact in self.finder.candidates(i, now, left):
                limit = float(best[0][0]) if best else left
                if bound > limit * (1 + 1e-9) + 1e-12:
                    break
                if (after := self.finder.time_to(contact, self.now, limit)) is None:
                    continue
                place = k.sign(after - best[0][0]) if best else -1
                best = (
                    [(after, contact)]
                    if place < 0
                    else [*best, (after, contact)]
                    if place == 0
                    else best
                )
        except Pressed:
            self.press(contact)
            return
        self.records[i], self.due[i] = None, np.inf
        if best and float(best[0][0]) <= left:
            after, contacts = best[0][0], tuple(contact for _, contact in best)
            at_once = after.is_zero() if k.proves else not k.sign(after)
            self.expect(i, self.now if at_once else self.now + after, contacts)

    def expect(self, i: int, t: Number, contacts: tuple[Contact, ...]) -> None:
        """Set the record of disk i."""
        counts = self.bodies.count
        self.records[i] = Record(
            t, contacts, tuple(counts[c.j] if c.kind == "body" else 0 for c in contacts)
        )
        self.due[i] = float(t) if float(t) <= self.until else np.inf

    def press(self, contact: Contact) -> None:
        """Begin a lasting contact: from now on the disk rests on the wall."""
        if not press(self.finder, contact, self.now):
            on = [self.bodies.name(held) for held in self.bodies.held[contact.i]]
            where = f" while it rests on {on[0]}" if on else ""
            others = [contact.j] if contact.kind == "body" and contact.j < self.scene.n else []
            reason = f"disk {contact.i} is pressed onto {self.bodies.name(contact)}{where}"
            raise MotionEnds(float(self.now), reason, [contact.i, *others])
        self.rest(contact)
        self.follow_up({contact.i})

    def collide(self, contacts: list[Contact]) -> None:
        """Resolve the contacts of one instant; if their order matters there is no exact answer."""
        self.refuse_corners(contacts)
        alone = len(contacts) == 1 and self.finder.alone(contacts[0], float(self.now))
        if alone:
            touches = [self.finder.touch(contacts[0], self.now)]
        else:
            touches = self.finder.cluster(contacts, self.now)
        disks = sorted({i for touch in touches for i in touch.contact.disks})
        v = {i: self.bodies.velocity_at(i, self.now) for i in disks}
        outcome = self.after_one(touches[0], v) if alone else self.after_all(touches, v)
        self.log_all(outcome.collisions, contacts)
        touched = {i for collision in outcome.collisions for i in collision.contact.disks} or set(
            disks
        )
        self.go_on(outcome, touches, touched)

    def refuse_corners(self, contacts: Sequence[Contact]) -> None:
        """Raise `MotionEnds` if a disk reaches an edge of the wrap or the end of its wall, or stops
        sliding, at the instant at which it touches another."""
        comes = {
            "edge": "reaches the edge of the wrap",
            "end": "reaches the end of wall {}",
            "slip end": "stops sliding along wall {}",
        }
        for contact in contacts:
            if contact.kind in comes:
                what = comes[contact.kind].format(contact.j)
                reason = f"disk {contact.i} {what} while it touches another"
                raise MotionEnds(float(self.now), reason, [contact.i])

    def after_one(self, touch: Touch, v: Velocities) -> TieOutcome:
        """The outcome of a single contact."""
        law = self.bodies.law
        after, collision = law.collide(touch, v)
        return TieOutcome(after, [collision], frozenset([touch.contact] if law.sticks else ()))

    def after_all(self, touches: Sequence[Touch], v: Velocities) -> TieOutcome:
        """The outcome of contacts at one instant, if it is the same in every order."""
        bodies = self.bodies
        resting = frozenset(contact for held in bodies.held for contact in held)
        ends, tried = bodies.law.outcomes(touches, v, resting, bodies.stays_still)
        self.work.left -= tried
        if len(ends) == 1 and ends[0].velocities:
            return ends[0]
        disks = [i for i in v if i < self.scene.n]
        known = [end for end in ends if end.velocities]
        raise MotionEnds(float(self.now), ambiguous(disks, ends), list(v), known)

    def log_all(self, collisions: Sequence[Collision], contacts: Sequence[Contact]) -> None:
        """Log the collisions of one instant; the first one of each of `contacts` is new."""
        arriving = {key(contact) for contact in contacts}
        for collision in collisions:
            self.log(collision, key(collision.contact) in arriving)
            arriving.discard(key(collision.contact))
        self.idle = 0 if collisions else self.idle + 1
        if self.idle > MOST_IDLE:
            reason = f"numbers of {self.k.bits} bits have used up their digits"
            raise MotionEnds(float(self.now), reason)

    def go_on(self, outcome: TieOutcome, touches: Sequence[Touch], touched: set[int]) -> None:
        """Begin new legs after the collisions of one instant; after a bounce off a wall, check
        whether the bounces die out without another contact."""
        bodies = self.bodies
        walls = [
            collision.contact
            for collision in outcome.collisions
            if collision.contact.kind == "wall"
        ]
        bounce = walls[0] if len(outcome.collisions) == 1 and walls else None
        for i in sorted(touched):
            bodies.held[i] = tuple(c for c in bodies.held[i] if c in outcome.still)
            vx, vy, spin = outcome.velocities[i]
            for still in (c for c in outcome.still if c.kind == "wall" and c.i == i):
                vx, vy = bodies.slide(still, vx, vy)
            if bodies.law.friction is not None:
                bodies.held[i] = ()  # `press` decides whether it slides
            bodies.fly(i, self.now, (vx, vy, spin), bounce)
        bodies.remember(touches, touched)
        if bounce is not None and outcome.collisions[0].slip_ended:
            bodies.no_slip_on[bounce.i] = bounce
        # A disk no longer rests on a disk that has collided.
        dropped = {
            i
            for i, held in enumerate(bodies.held)
            if i not in touched and any(c.disks & touched for c in held)
        }
        for i in sorted(dropped):
            bodies.hold(i, self.now, (), bodies.velocity_at(i, self.now))
        stop = None
        if bounce is not None and 0 < self.scene.restitution < 1:
            stop = settle(self.finder, bounce, self.now, self.thrusts)
        self.follow_up(touched | dropped)
        if stop is not None and bounce is not None:
            self.expect(bounce.i, stop, (bounce._replace(kind="rest"),))

    def log(self, collision: Collision, new: bool) -> None:
        """Log a collision; raises `MotionEnds` where those of a disk accumulate."""
        contact, j = collision.contact, self.bodies.partner(collision.contact)
        self.path.events.append(
            Event(self.now, contact.i, j, collision.impulse, float(collision.cosine), new)
        )
        self.recent.add(contact.i, float(self.now), self.bodies.name(contact))
        if j >= 0:
            self.recent.add(j, float(self.now), f"disk {contact.i}")

    def rest(self, contact: Contact) -> None:
        """Log that a disk comes to rest: a contact that begins without an impulse."""
        self.path.events.append(
            Event(self.now, contact.i, self.bodies.partner(contact), self.k.exact(0.0), 0.0)
        )

    def stop(self, contact: Contact) -> None:
        """Let a disk rest on a wall on which its bounces have died out."""
        bodies, i = self.bodies, contact.i
        wall = below(self.finder, contact._replace(kind="wall"), self.now)
        bodies.hold(i, self.now, (*bodies.held[i], wall), bodies.velocity_at(i, self.now), True)
        self.rest(wall)
        self.follow_up({i})

    def roll(self, contact: Contact) -> None:
        """End the slip of a disk on a wall with friction: it rolls, if friction is large enough."""
        bodies, i, side = self.bodies, contact.i, contact.side
        vx, vy, spin = bodies.velocity_at(i, self.now)
        # The spin without slip, to all digits.
        spin = spin - side * bodies.slip(contact, (vx, vy, spin)) / bodies.radius[i]
        bodies.hold(i, self.now, bodies.held[i], (vx, vy, spin), True)
        self.follow_up({i})

    def leave(self, contact: Contact) -> None:
        """Move a disk off the end of the wall it rests on: onto the next wall in line, or into free
        flight."""
        bodies, i, k = self.bodies, contact.i, self.k
        held = [c for c in bodies.held[i] if c.j == contact.j]
        v, end = (
            bodies.velocity_at(i, self.now),
            self.scene.walls[contact.j, 1 if contact.side > 0 else 0],
        )
        following = next_in_line(self.finder, held[0], contact.side)
        if following is None:
            _, ax, ay = bodies.free[i]
            slow = v[0] * v[0] + v[1] * v[1] + bodies.radius[i] * bodies.outward(held[0], ax, ay)
            if k.sign(slow) <= 0 or len(bodies.held[i]) > 1:
                raise MotionEnds(
                    float(self.now),
                    f"disk {i} slides off the end of wall {contact.j} so slowly that it turns about"
                    " it",
                    [i],
                )
            bodies.hold(i, self.now, (), v)
            corner = next(
                j
                for j in range(self.scene.n, len(bodies.legs))
                if (bodies.table[j, :2] == end).all()
            )
            bodies.remember([self.finder.touch(Contact("body", i, corner), self.now)], set())
        else:
            bodies.hold(i, self.now, (following,), v, not bodies.sliding[i])
        self.follow_up({i})

    def wrap(self, contact: Contact) -> None:
        """Move a disk to the opposite edge of the wrap; if it overlaps another one there, there is
        no exact answer."""
        i = contact.i
        self.bodies.across(contact, self.now)
        for other, gap in self.finder.near(i, self.now):
            if gap < 0:
                reason = (
                    f"disk {i} re-enters over the edge of the wrap onto {self.bodies.name(other)}"
                )
                raise MotionEnds(float(self.now), reason, sorted(other.disks))
        self.follow_up({i})

    def set_thrusts(self, disk: int) -> None:
        """Begin or end a thrust."""
        on = [p for p in self.thrusts if p.disk == disk and p.start <= float(self.now) < p.stop]
        self.bodies.set_thrusts(disk, self.now, on)

    def follow_up(self, disks: set[int]) -> None:
        """Add the new legs of these disks to the path, and predict the disks again."""
        moving = sorted(i for i in disks if i < self.scene.n and not self.scene.static[i])
        for i in moving:
            self.path.legs[i].append(self.bodies.legs[i])
        for i in moving:
            if not self.bodies.asleep[i]:
                self.predict(i)


def trace(
    scene: Scene, thrusts: Sequence[Thrust], until: float, k: Numbers, work: WorkLimit | None = None
) -> Path:
    """The motion of `scene` under `thrusts` up to `until` s, within the limits of `work`. Raises as
    `Bodies`."""
    with k.precise():
        return Motion(scene, thrusts, until, k, work or WorkLimit()).run()
