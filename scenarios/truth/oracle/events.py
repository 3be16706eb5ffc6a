"""The event loop: exact flights between collisions, in any numbers, with one next event per disk.

Each body keeps its motion since its own last event; each moving disk keeps a record of its next
contact. A record is stale if the partner has had an event since; it is predicted again when its
time comes. Of every pair, the disk that was predicted last has the valid record (Lubachevsky, J.
Comput. Phys. 94, 255, 1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from crosscheck2d.scenarios.model import Scene, Thrust
from crosscheck2d.scenarios.truth.oracle import resting
from crosscheck2d.scenarios.truth.oracle.bodies import Bodies
from crosscheck2d.scenarios.truth.oracle.contact_finder import ContactFinder
from crosscheck2d.scenarios.truth.oracle.contacts import Pressed
from crosscheck2d.scenarios.truth.oracle.numbers import Number, Numbers, Undecided
from crosscheck2d.scenarios.truth.oracle.path import (
    Event,
    MotionEnds,
    Path,
    RecentCollisions,
    Record,
    WorkLimit,
    ambiguous,
)
from crosscheck2d.scenarios.truth.oracle.ties import (
    ENDLESS,
    Collision,
    Contact,
    TieOutcome,
    Touch,
    Velocities,
    key,
)

MOST_IDLE = 100  # contacts in a row without a collision: the digits no longer decide


class Motion:
    """The motion of a scene up to `until` s, in the numbers `k`, within the limits of `work`; used
    only within `k.precise()`."""

    def __init__(
        self, scene: Scene, thrusts: Sequence[Thrust], until: float, k: Numbers, work: WorkLimit
    ) -> None:
        self.k, self.until, self.scene, self.work = k, until, scene, work
        self.bodies = Bodies(scene, k, turns_with_disk(thrusts))
        self.finder = ContactFinder(self.bodies)
        self.records: list[Record | None] = [None] * scene.n
        self.due = np.full(scene.n, np.inf)
        self.now = self.bodies.nought
        self.path = Path([[self.bodies.legs[i]] for i in range(scene.n)])
        self.recent = RecentCollisions(scene)
        # From the last to the first, so that the next one can be popped.
        self.starts_and_stops = sorted(
            ((t, p.disk) for p in thrusts for t in (p.start, p.stop) if t < until), reverse=True
        )
        self.thrusts = thrusts
        self.idle = 0
        self.accumulating: list[int] = []  # disks
        self.by_itself = {
            "edge": self.wrap,
            "end": self.leave,
            "rest": self.stop,
            "slip end": self.roll,
            "probe": self.probe,
        }

    def run(self) -> Path:
        try:
            self.begin()
            while self.advance():
                self.work.step(float(self.now), self.k.bits)
        except MotionEnds as end:
            advice = [
                resting.nearly_in_line(self.finder, i, float(self.now)) for i in end.disks[:1]
            ]
            self.path.end, self.path.reason = end.t, "".join([str(end), *advice])
            self.path.disks, self.path.outcomes = end.disks, end.outcomes
            self.path.few_bits = end.few_bits
            self.path.named = [
                [self.bodies.pair(collision.contact) for collision in one.collisions]
                for one in end.outcomes
            ]
        except Undecided:
            raise Undecided(float(self.now), self.path) from None
        return self.path

    def begin(self) -> None:
        while self.starts_and_stops and self.starts_and_stops[-1][0] == 0:
            self.set_thrusts(self.starts_and_stops.pop()[1])
        for contact in resting.lie_down(self.finder):
            self.rest(contact)
        self.follow_up(set(np.flatnonzero(~self.scene.static).tolist()))

    def advance(self) -> bool:
        soonest = self.due.min()
        if self.starts_and_stops and self.starts_and_stops[-1][0] <= soonest:
            t, disk = self.starts_and_stops.pop()
            self.now = self.k.exact(t)
            self.follow_up(self.set_thrusts(disk))
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
        counts = self.bodies.count
        return any(
            c.kind == "body" and counts[c.j] != then
            for c, then in zip(record.contacts, record.counts)
        )

    def predict(self, i: int) -> None:
        k = self.k
        if self.bodies.jet[i] is not None:
            return self.probe(Contact("probe", i, i))
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
                if place < 0:
                    best = [(after, contact)]
                elif place == 0:
                    best.append((after, contact))
        except Pressed:
            self.press(contact)
            return
        self.records[i], self.due[i] = None, np.inf
        if best and float(best[0][0]) <= left:
            after, contacts = best[0][0], tuple(contact for _, contact in best)
            at_once = after.is_zero() if k.proves else not k.sign(after)
            self.expect(i, self.now if at_once else self.now + after, contacts)

    def expect(self, i: int, t: Number, contacts: tuple[Contact, ...]) -> None:
        counts = self.bodies.count
        self.records[i] = Record(
            t, contacts, tuple(counts[c.j] if c.kind == "body" else 0 for c in contacts)
        )
        self.due[i] = float(t) if float(t) <= self.until else np.inf

    def press(self, contact: Contact) -> None:
        if not resting.press(self.finder, contact, self.now):
            if self.join(contact):
                return
            on = [self.bodies.name(held) for held in self.bodies.held[contact.i]]
            where = f" while it rests on {on[0]}" if on else ""
            others = [contact.j] if contact.kind == "body" and contact.j < self.scene.n else []
            reason = f"disk {contact.i} is pressed onto {self.bodies.name(contact)}{where}"
            raise MotionEnds(float(self.now), reason, [contact.i, *others])
        self.rest(contact)
        self.follow_up({contact.i})

    def join(self, contact: Contact) -> bool:
        """Let the disks that forces keep in contact move as one; False if none do."""
        bodies, before = self.bodies, {key(c) for held in self.bodies.held for c in held}
        groups = resting.lasting(self.finder, contact, self.now)
        for group in groups:
            for i in group.disks:
                ours = [c for c in group.contacts if i in c.disks]
                held = tuple(c if c.i == i else c._replace(i=c.j, j=c.i) for c in ours)
                v = (*group.velocity, self.bodies.turn_at(i, self.now).spin)
                bodies.hold(i, self.now, held, v, True, group.common)
                bodies.group[i] = frozenset(group.disks)
            for c in group.contacts:
                if c.kind == "body":
                    bodies.keep_in_step(c)
                if key(c) not in before:
                    self.rest(c)
        self.follow_up({i for group in groups for i in group.disks})
        return bool(groups)

    def ungroup(self, disks: set[int]) -> set[int]:
        """Let these disks' groups go on one by one, each on the wall it is pressed onto; those
        disks."""
        bodies, k = self.bodies, self.k
        members = disks.union(*(bodies.group[i] for i in disks))
        pairs = {key(c): c for i in members for c in bodies.held[i] if bodies.group[i]}
        v = {
            group: bodies.velocity_at(min(group), self.now)
            for group in {bodies.group[i] for i in members}
            if group
        }
        for i in sorted(members):
            if group := bodies.group[i]:
                _, ax, ay = bodies.free[i]
                walls = [c for c in bodies.held[i] if c.kind == "wall"]
                walls = [c for c in walls if k.sign(bodies.outward(c, ax, ay)) < 0]
                spin = bodies.turn_at(i, self.now).spin
                bodies.group[i] = frozenset()
                bodies.hold(i, self.now, tuple(walls[:1]), (*v[group][:2], spin), True)
                bodies.leaning[i] = {*walls}
        for contact in pairs.values():
            if contact.kind == "body":
                bodies.keep_in_step(contact)
        return members

    def collide(self, contacts: list[Contact]) -> None:
        self.refuse_corners(contacts)
        alone = len(contacts) == 1 and self.finder.alone(contacts[0], float(self.now))
        if alone:
            touches = [self.finder.touch(contacts[0], self.now)]
        else:
            touches = self.finder.cluster(contacts, self.now)
        disks = sorted({i for touch in touches for i in touch.contact.disks})
        v = {i: self.bodies.velocity_at(i, self.now) for i in disks}
        if alone:
            after, collision = self.bodies.law.collide(touches[0], v)
            still = frozenset(contacts if self.bodies.law.sticks else ())
            outcome = TieOutcome(after, [collision], still)
        else:
            outcome = self.after_all(touches, v)
        self.log(outcome.collisions, contacts)
        touched = {i for collision in outcome.collisions for i in collision.contact.disks} or set(
            disks
        )
        first = outcome.collisions[0] if len(outcome.collisions) == 1 else None
        bounce = first.contact if first and first.contact.kind == "wall" else None
        self.go_on(
            outcome, touches, touched, bounce, bounce if first and first.slip_ended else None
        )
        if self.accumulating:
            self.die_out(self.accumulating[0])
            self.accumulating = []

    def die_out(self, i: int) -> None:
        """Close the contacts of disk i, and of disks connected to it, whose collisions accumulate,
        as soon as the rest of their series is far below the rounding of float64.

        Raises `MotionEnds` where this is not known to be their limit.
        """
        bodies, recent, now = self.bodies, self.recent, float(self.now)
        if bodies.asleep[i]:
            return
        contacts = recent.dying(i, now)
        touches = [self.finder.touch(contact, self.now) for contact in contacts]
        disks = {k for contact in contacts for k in contact.disks}
        v = {k: bodies.velocity_at(k, self.now) for k in disks}
        try:
            limit = resting.limit_of_series(self.finder, touches, v, self.until - now)
        except resting.NoLimit as fault:
            if i in recent.since:
                end = recent.ends(i, now, bodies.name)
                end.few_bits = fault.few_bits
                raise end from None
            return
        if limit is None and len(touches) > 1:
            closes = resting.gap_of(self.finder, touches, self.now) <= resting.NO_GAP
            limit = bodies.law.closed(touches, v, frozenset()) if closes else None
        if limit is None:
            return
        contacts = [contact for contact in contacts if contact in limit.still]
        touches = [touch for touch in touches if touch.contact in limit.still]
        disks = {k for contact in contacts for k in contact.disks}
        # As of bounces that die out, those that cannot be told apart are not listed.
        since, pairs = recent.since.get(i, now - recent.instant), {bodies.pair(c) for c in contacts}
        self.path.events = [
            event
            for event in self.path.events
            if float(event.t) <= since or not pairs & {(event.i, event.j), (event.j, event.i)}
        ]
        self.log(limit.collisions, [])
        recent.close(contacts, now)
        first = contacts[0]
        rolls = len(contacts) == 1 and bodies.no_slip_on[first.i] == first
        self.go_on(limit, touches, disks, None, first if rolls else None)

    def refuse_corners(self, contacts: Sequence[Contact]) -> None:
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

    def after_all(self, touches: Sequence[Touch], v: Velocities) -> TieOutcome:
        bodies = self.bodies
        held = frozenset(contact for contacts in bodies.held for contact in contacts)
        ends, tried = bodies.law.outcomes(touches, v, held, bodies.stays_still)
        self.work.left -= tried
        if len(ends) == 1 and ends[0].velocities:
            return ends[0]
        with suppress(resting.NoLimit):
            rest = self.until - float(self.now)
            if limit := resting.limit_of_series(self.finder, touches, v, rest, resting.NO_MATTER):
                return limit
        disks = [i for i in v if i < self.scene.n]
        known = [end for end in ends if end.velocities]
        end = MotionEnds(float(self.now), ambiguous(disks, ends), list(v), known)
        end.few_bits = ends[-1].unresolved == ENDLESS and not self.k.proves
        raise end

    def log(self, collisions: Sequence[Collision], contacts: Sequence[Contact]) -> None:
        arriving = {key(contact) for contact in contacts}
        for contact, impulse, cosine, _ in collisions:
            j, new = self.bodies.partner(contact), key(contact) in arriving
            self.path.events.append(Event(self.now, contact.i, j, impulse, float(cosine), new))
            self.accumulating += self.recent.add(float(self.now), contact)
            arriving.discard(key(contact))
        self.idle = 0 if collisions else self.idle + 1
        if self.idle > MOST_IDLE:
            reason = f"numbers of {self.k.bits} bits have used up their digits"
            end = MotionEnds(float(self.now), reason)
            end.few_bits = True
            raise end

    def go_on(
        self,
        outcome: TieOutcome,
        touches: Sequence[Touch],
        touched: set[int],
        bounce: Contact | None,
        rolls_on: Contact | None,
    ) -> None:
        """Begin new legs after the collisions of one instant; after a `bounce` off a wall, check
        whether the bounces die out without another contact.

        rolls_on: the wall on which its disk has exactly no slip now.
        """
        bodies = self.bodies
        if outcome.searched:
            self.path.searched = min(self.path.searched, float(self.now))
        members, still_keys = self.ungroup(touched) - touched, {key(c) for c in outcome.still}
        velocities, in_step = resting.in_step_after(self.finder, outcome, touches)
        for i in sorted(touched):
            bodies.held[i] = tuple(c for c in bodies.held[i] if key(c) in still_keys)
            vx, vy, spin = velocities[i]
            if bodies.law.friction is not None:
                bodies.held[i] = ()  # `press` decides whether it slides
            bodies.fly(i, self.now, (vx, vy, spin), bounce)
        bodies.remember(touches, touched)
        for contact in in_step:
            bodies.keep_in_step(contact)
        if rolls_on is not None:
            bodies.no_slip_on[rolls_on.i] = rolls_on
        stop = None
        if bounce is not None and 0 < self.scene.restitution < 1:
            stop = resting.settle(self.finder, bounce, self.now, self.thrusts)
        self.follow_up(touched | members)
        if stop is not None and bounce is not None:
            self.expect(bounce.i, stop, (bounce._replace(kind="rest"),))

    def rest(self, contact: Contact) -> None:
        """Log a contact that begins without an impulse."""
        self.path.events.append(
            Event(self.now, contact.i, self.bodies.partner(contact), self.k.exact(0.0), 0.0)
        )

    def stop(self, contact: Contact) -> None:
        bodies, i = self.bodies, contact.i
        wall = resting.below(self.finder, contact._replace(kind="wall"), self.now)
        bodies.hold(i, self.now, (*bodies.held[i], wall), bodies.velocity_at(i, self.now), True)
        self.rest(wall)
        self.follow_up({i})

    def roll(self, contact: Contact) -> None:
        bodies, i, side = self.bodies, contact.i, contact.side
        vx, vy, spin = bodies.velocity_at(i, self.now)
        # The spin without slip, to all digits.
        spin = spin - side * bodies.slip(contact, (vx, vy, spin)) / bodies.radius[i]
        bodies.hold(i, self.now, bodies.held[i], (vx, vy, spin), True)
        self.follow_up({i})

    def leave(self, contact: Contact) -> None:
        bodies, i, k = self.bodies, contact.i, self.k
        held = [c for c in bodies.held[i] if c.kind == "wall" and c.j == contact.j]
        v = bodies.velocity_at(i, self.now)
        end = self.scene.walls[contact.j, 1 if contact.side > 0 else 0]
        following = resting.next_in_line(self.finder, held[0], contact.side)
        if bodies.group[i]:
            reason = f"disk {i} reaches the end of wall {contact.j} while it touches another"
            raise MotionEnds(float(self.now), reason, [i])
        if following is None:
            _, ax, ay = bodies.free[i]
            slow = v[0] * v[0] + v[1] * v[1] + bodies.radius[i] * bodies.outward(held[0], ax, ay)
            if k.sign(slow) <= 0 or len(bodies.held[i]) > 1:
                off = f"slides off the end of wall {contact.j}"
                reason = f"disk {i} {off} so slowly that it turns about it"
                raise MotionEnds(float(self.now), reason, [i])
            bodies.hold(i, self.now, (), v)
            ends = range(self.scene.n, len(bodies.legs))
            corner = next(j for j in ends if (bodies.table[j, :2] == end).all())
            bodies.remember([self.finder.touch(Contact("body", i, corner), self.now)], set())
        else:
            bodies.hold(i, self.now, (following,), v, not bodies.sliding[i])
        self.follow_up({i})

    def wrap(self, contact: Contact) -> None:
        i = contact.i
        if self.bodies.group[i]:
            reason = f"disk {i} crosses the edge of the wrap while it touches another"
            raise MotionEnds(float(self.now), reason, [i])
        self.bodies.across(contact, self.now)
        for other, gap in self.finder.near(i, self.now):
            if gap < 0:
                onto = self.bodies.name(other)
                reason = f"disk {i} re-enters over the edge of the wrap onto {onto}"
                raise MotionEnds(float(self.now), reason, sorted(other.disks))
        self.follow_up({i})

    def probe(self, contact: Contact) -> None:
        """Find how long a disk under a thrust that turns with it certainly touches nothing."""
        after = resting.probe(self.finder, contact.i, self.now)
        self.expect(contact.i, self.now + self.k.exact(after), (contact,))

    def set_thrusts(self, disk: int) -> set[int]:
        members = self.ungroup({disk})
        on = [p for p in self.thrusts if p.disk == disk and p.start <= float(self.now) < p.stop]
        self.bodies.set_thrusts(disk, self.now, on)
        return members

    def follow_up(self, disks: set[int]) -> None:
        moving = sorted(i for i in disks if i < self.scene.n and not self.scene.static[i])
        for i in moving:
            self.path.legs[i].append(self.bodies.legs[i])
        # Others may have become faster than a disk under a thrust that turns with it was told.
        jets = [i for i, jet in enumerate(self.bodies.jet) if jet is not None and i not in moving]
        for i in moving + jets:
            if not self.bodies.asleep[i] or self.bodies.jet[i] is not None:
                self.predict(i)


def turns_with_disk(thrusts: Sequence[Thrust]) -> bool:
    return any(thrust.frame == "body" and thrust.force.any() for thrust in thrusts)


def trace(
    scene: Scene, thrusts: Sequence[Thrust], until: float, k: Numbers, work: WorkLimit | None = None
) -> Path:
    with k.precise():
        return Motion(scene, thrusts, until, k, work or WorkLimit()).run()
