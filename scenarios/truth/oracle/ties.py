"""Collisions: of one contact, and of several contacts at one instant, resolved in every possible
order; with Coulomb friction.

There is one coefficient mu, and no rolling resistance. In a collision the impulse of friction
opposes the slip s, the relative speed of the contact points along the tangent:

    J_t = min(mu J_n, |s| / (1/m_a + 1/m_b + r_a^2/I_a + r_b^2/I_b)),

where J_n = (1 + e) m_n v_n is the impulse along the normal (Foerster, Louge, Chang & Allia, Phys.
Fluids 6, 1108, 1994, with no tangential restitution). For disks this is the integral of Coulomb's
law over the collision: the normal passes through the centre, so J_n gives no torque and changes no
slip, and J_t changes no speed along the normal. The slip decreases in proportion to J_t, whatever
the course of the normal force, and once it is 0 it stays 0 (Stronge, Impact Mechanics, 2000, ch. 3
and 4).

On a wall the same law gives a force: mu N against the slip; without slip the force that keeps it 0,
if that is at most mu N (any textbook of mechanics, under "rolling").
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.scenarios.truth.oracle.clusters import collapse, complementary, is_m_matrix
from crosscheck2d.scenarios.truth.oracle.numbers import Number, Numbers, Undecided

MOST_ORDERS = 3000  # collisions tried in all orders together
LARGEST_COLLAPSE = 0.5  # restitution; a larger one needs more contacts than are tried
LONGEST = 200  # collisions of one order at one instant, and more where one order stands for all
ENDLESS, TOO_MANY = "endless", "too many"
DECAYED = 1e-6  # of the largest approach: an order that is as long by then does not end
MERGE_FROM = 50  # collisions tried; few orders are found faster than whether their states repeat


class Contact(NamedTuple):
    """What disk `i` meets next.

    kind: "body", disk j or an end point (j from n on); "wall", a side of wall j; "edge", of the
    wrap across axis j; "end", of wall j on which it rests; "rest", its bounces on a side of wall j
    have died out; "slip end", its slip on wall j ends; "probe", until then it touches nothing.
    """

    kind: str
    i: int
    j: int
    side: int = 0

    @property
    def disks(self) -> set[int]:
        """The bodies whose motion it changes; an end point may be among them."""
        return {self.i, self.j} if self.kind == "body" else {self.i}


def key(contact: Contact) -> tuple[Any, ...]:
    """A key for a contact: the same from both disks of a pair, different for the two sides of a
    wall."""
    return ("body", *sorted((contact.i, contact.j))) if contact.kind == "body" else tuple(contact)


class Touch(NamedTuple):
    """A contact at its instant, with the direction (dx, dy) from the centre of i to the other side,
    of any length but 0."""

    contact: Contact
    dx: Number
    dy: Number


class Collision(NamedTuple):
    """A collision that was carried out: its impulse along the normal, N s; the cosine of the impact
    angle, |v_n| / |v|; and whether friction ended the slip of the contact points (`slip_ended`)."""

    contact: Contact
    impulse: Number
    cosine: Number
    slip_ended: bool = False


Velocity = tuple[Number, Number, Number]
Velocities = dict[int, Velocity]
"""Body -> its velocity: vx, vy m/s, and rad/s, which is 0 where there is no friction."""


class TieOutcome(NamedTuple):
    """A possible outcome of simultaneous contacts: velocities, the collisions in one order, and the
    contacts with exactly no speed along their normal (`still`).

    unresolved: `ENDLESS` or `TOO_MANY` for orders that were not followed to an outcome; "" else.
    searched: whether a search, no proof, says that the contacts close.
    """

    velocities: Velocities
    collisions: list[Collision]
    still: frozenset[Contact]
    unresolved: str = ""
    searched: bool = False


class Friction(NamedTuple):
    """The data for friction: mu, and the radius, m, and 1 / inertia, 1/(kg m2), of each body."""

    coefficient: Number
    radius: Sequence[Number]
    inverse_inertia: Sequence[Number]

    def rim_inverse_mass(self, i: int) -> Number:
        """1/kg, the speed that 1 N s along its rim gives the rim of body i by rotation."""
        return self.radius[i] * self.radius[i] * self.inverse_inertia[i]


def limited(k: Numbers, wanted: Number, most: Number) -> tuple[Number, bool]:
    """`wanted`, the friction that keeps the slip 0, limited to `most` either way; and whether it
    was within the limit."""
    if k.sign(most - wanted) < 0:
        return most, False
    if k.sign(most + wanted) < 0:
        return -most, False
    return wanted, True


@dataclass(frozen=True)
class CollisionLaw:
    """The law of collisions for a set of bodies: 1 / mass (b,) 1/kg; the restitution; whether that
    is 0 (`sticks`); and the data for friction, if there is any (`friction`)."""

    numbers: Numbers
    inverse_mass: Sequence[Number]
    restitution: Number
    sticks: bool
    friction: Friction | None = None

    @cached_property
    def least_approach(self) -> Number:
        """m2/s; a slower approach is about to decay below `tie`."""
        return self.numbers.sqrt(self.numbers.tie)

    def approach(self, touch: Touch, v: Mapping[int, Velocity]) -> Number:
        """dr.dv m2/s (m/s at a wall, where the direction has length 1); negative: the two
        approach."""
        (ux, uy, _), (px, py, _) = self._pair(touch, v)
        return touch.dx * (px - ux) + touch.dy * (py - uy)

    def _pair(self, touch: Touch, v: Mapping[int, Velocity]) -> tuple[Velocity, Velocity]:
        nought = self.numbers.exact(0.0)
        contact = touch.contact
        return v[contact.i], v[contact.j] if contact.kind == "body" else (nought,) * 3

    def collide(self, touch: Touch, v: Velocities) -> tuple[Velocities, Collision]:
        """The velocities after the collision, and the collision.

        q = -(1 + e) b / (dr.dr (w_i + w_j)) times dr: no square root, which in float64 would make
        the energy drift.
        """
        contact, dx, dy = touch
        (ux, uy, spin), (px, py, turn) = self._pair(touch, v)
        w = self.inverse_mass
        other = w[contact.j] if contact.kind == "body" else 0
        b, square, root = self.approach(touch, v), dx * dx + dy * dy, self.numbers.sqrt
        q = -(1 + self.restitution) * b / (square * (w[contact.i] + other))
        after = {**v, contact.i: (ux - q * w[contact.i] * dx, uy - q * w[contact.i] * dy, spin)}
        if contact.kind == "body":
            after[contact.j] = (px + q * other * dx, py + q * other * dy, turn)
        speed2 = (px - ux) * (px - ux) + (py - uy) * (py - uy)
        collision = Collision(contact, q * root(square), -b / root(square * speed2))
        if self.friction is None:
            return after, collision
        return self.rubbed(touch, v, after, collision, self.friction)

    def rubbed(
        self,
        touch: Touch,
        v: Velocities,
        after: Velocities,
        collision: Collision,
        friction: Friction,
    ) -> tuple[Velocities, Collision]:
        """`after` and `collision` of a collision from velocities v, with friction added."""
        contact, i, body = touch.contact, touch.contact.i, touch.contact.kind == "body"
        (ux, uy, spin), (px, py, turn) = self._pair(touch, v)
        distance = self.numbers.sqrt(touch.dx * touch.dx + touch.dy * touch.dy)
        tx, ty = -touch.dy / distance, touch.dx / distance
        slip = tx * (px - ux) + ty * (py - uy) - friction.radius[i] * spin
        inverse_effective_mass = self.inverse_mass[i] + friction.rim_inverse_mass(i)
        if body:
            j = contact.j
            slip -= friction.radius[j] * turn
            inverse_effective_mass += self.inverse_mass[j] + friction.rim_inverse_mass(j)
        most = friction.coefficient * collision.impulse
        kick, slip_ended = limited(self.numbers, -slip / inverse_effective_mass, most)
        after, sides = dict(after), [(i, -kick * tx, -kick * ty), (contact.j, kick * tx, kick * ty)]
        for k, jx, jy in sides[: len(contact.disks)]:
            w, turns = self.inverse_mass[k], friction.radius[k] * friction.inverse_inertia[k]
            vx, vy, spin = after[k]
            after[k] = vx + w * jx, vy + w * jy, spin - turns * kick
        return after, collision._replace(slip_ended=slip_ended)

    def outcomes(
        self,
        touches: Sequence[Touch],
        v: Velocities,
        still: frozenset[Contact] = frozenset(),
        stays_still: Callable[[Contact, Contact], bool] = lambda _one, _other: False,
    ) -> tuple[list[TieOutcome], int]:
        """Every distinct outcome of resolving the approaching contacts, over all orders, each with
        one of its orders; and the number of collisions that were tried.

        still: contacts with exactly no speed along their normal.
        stays_still: whether a collision on one contact keeps another one `still`.

        If some order does not end, or there are too many, the last outcome has no velocities. Equal
        states are followed once only; where the contacts form a Coxeter group, one order is.
        """
        if len(touches) > 1 and (closed := self.closed(touches, v, still)):
            return [closed], len(touches)
        sign, ends = self.numbers.sign, list[TieOutcome]()
        waiting, known = [TieOutcome(v, [], still)], dict[tuple[float, ...], list[TieOutcome]]()
        one_order, unresolved, first = self.any_order_will_do(touches), TOO_MANY, 0.0
        for tried in range(MOST_ORDERS):
            if not waiting:
                return ends, tried
            now, collisions, still = waiting.pop()[:3]
            speeds = [(touch, self.approach(touch, now)) for touch in touches]
            closing = [
                (t, speed) for t, speed in speeds if t.contact not in still and sign(speed) < 0
            ]
            fastest = max((abs(float(speed)) for _, speed in closing), default=0.0)
            first = first or fastest
            # Collisions whose speed decays to the tie have no end: more digits would give more of
            # them.
            decays = not self.numbers.proves and any(
                abs(speed) < self.least_approach for _, speed in closing
            )
            if collisions and (decays or (len(collisions) > LONGEST and not one_order)):
                unresolved = ENDLESS if decays or fastest < DECAYED * first else TOO_MANY
                break
            for touch, _ in closing[-1:] if one_order else closing:
                after, collision = self.collide(touch, now)
                hit = touch.contact
                kept = {c for c in still if not c.disks & hit.disks or stays_still(c, hit)}
                kept |= {hit} if self.sticks else set()
                state = TieOutcome(after, [*collisions, collision], frozenset(kept))
                if one_order or tried < MERGE_FROM or not self._repeats(state, known):
                    waiting.append(state)
            if not closing and not any(self._same(now, end.velocities) for end in ends):
                ends.append(TieOutcome(now, collisions, still))
        return [*ends, TieOutcome({}, [], frozenset(), unresolved)], MOST_ORDERS

    def any_order_will_do(self, touches: Sequence[Touch]) -> bool:
        """Whether elastic collisions of these contacts are reflections that generate a Coxeter
        group: all angles between two of them are 180 / k degrees, k = 2, 3, 4 or 6. Then every
        order leads to the same velocities, in as many collisions (Humphreys, Reflection Groups and
        Coxeter Groups, 1990, 1.8 and 5.13)."""
        k = self.numbers
        if len(touches) < 3 or float(self.restitution) != 1 or self.friction is not None:
            return False
        a, pairs = delassus(self, touches), combinations(range(len(touches)), 2)
        try:
            return all(
                not k.sign(a[i][j])
                or (
                    k.sign(a[i][j]) < 0
                    and any(not k.sign(4 * a[i][j] ** 2 - n * a[i][i] * a[j][j]) for n in (1, 2, 3))
                )
                for i, j in pairs
            )
        except Undecided:
            return False

    def _repeats(self, state: TieOutcome, known: dict[tuple[float, ...], list[TieOutcome]]) -> bool:
        """Whether a state is certainly one of the known ones; if not, it is added."""
        place = tuple(
            round(float(x), 9) for i in sorted(state.velocities) for x in state.velocities[i]
        )
        same = known.setdefault(place, [])
        try:
            if any(
                state.still == other.still and self._same(state.velocities, other.velocities)
                for other in same
            ):
                return True
        except Undecided:
            pass
        same.append(state)
        return False

    def closed(
        self, touches: Sequence[Touch], v: Velocities, still: frozenset[Contact]
    ) -> TieOutcome | None:
        """The outcome where the collisions close contacts for good, the same in every order: at e =
        0, or where no order of collisions ends. None where this is not known to be so, or where
        friction acts."""
        k, e = self.numbers, float(self.restitution)
        if e >= LARGEST_COLLAPSE or any(k.sign(self.slip(touch, v)) for touch in touches):
            return None
        matrix = delassus(self, touches)
        if not is_m_matrix(k, matrix):
            return None
        q = [k.exact(0.0) if t.contact in still else self.approach(t, v) for t in touches]
        impulses = complementary(k, matrix, q)
        if impulses is None:
            return None
        if not self.sticks:
            # The contacts without impulse are never touched, as no impulse is larger than these.
            active = list(impulses)
            part = np.array([[float(matrix[a][b]) for b in active] for a in active])
            most = np.array([float(impulses[a]) for a in active])
            if len(active) < 2 or not collapse(part, most, e):
                return None
        end = self.close(touches, v, still, impulses)
        return end and end._replace(searched=not self.sticks)

    def close(
        self,
        touches: Sequence[Touch],
        v: Velocities,
        still: frozenset[Contact],
        impulses: Mapping[int, Number],
    ) -> TieOutcome | None:
        """The outcome of these impulses, after which their contacts have no speed along the normal;
        None if friction would act then."""
        k, root = self.numbers, self.numbers.sqrt
        after = apply(self, touches, impulses, v)
        if any(k.sign(self.slip(touch, after)) for touch in touches):
            return None
        moved = {i for a in impulses for i in touches[a].contact.disks}
        at_rest = {c for c in still if not c.disks & moved}
        closed, collisions = {touches[a].contact for a in impulses}, list[Collision]()
        for a, impulse in sorted(impulses.items()):
            contact, dx, dy = touches[a]
            (ux, uy, _), (px, py, _) = self._pair(touches[a], v)
            square, b = dx * dx + dy * dy, self.approach(touches[a], v)
            # A contact that was closed before has no angle.
            meets = contact not in still and k.sign(b) < 0
            speed2 = (px - ux) * (px - ux) + (py - uy) * (py - uy)
            cosine = -b / root(square * speed2) if meets else float("nan")
            collisions.append(Collision(contact, impulse * root(square), cosine))
        others = {
            t.contact
            for a, t in enumerate(touches)
            if t.contact in still - at_rest
            and a not in impulses
            and not k.sign(self.approach(t, after))
        }
        return TieOutcome(after, collisions, frozenset(at_rest | closed | others))

    def slip(self, touch: Touch, v: Mapping[int, Velocity]) -> Number:
        """m2/s (m/s at a wall), the speed of the contact points along the tangent times |dr|; 0
        without friction."""
        if self.friction is None:
            return self.numbers.exact(0.0)
        (ux, uy, spin), (px, py, turn) = self._pair(touch, v)
        radius, i, j = self.friction.radius, touch.contact.i, touch.contact.j
        turning = radius[i] * spin + (radius[j] * turn if touch.contact.kind == "body" else 0)
        distance = self.numbers.sqrt(touch.dx * touch.dx + touch.dy * touch.dy)
        return touch.dx * (py - uy) - touch.dy * (px - ux) - distance * turning

    def _same(self, one: Mapping[int, Velocity], other: Mapping[int, Velocity]) -> bool:
        return all(self.numbers.sign(a - b) == 0 for i in one for a, b in zip(one[i], other[i]))


def delassus(law: CollisionLaw, touches: Sequence[Touch]) -> list[list[Number]]:
    """(K, K) the change of dr.dv of each contact by 1 impulse, times dr, at each."""
    rows: list[list[Number]] = []
    for row in touches:
        rows.append([])
        for touch in touches:
            a, b, total = row.contact, touch.contact, law.numbers.exact(0.0)
            for body in a.disks & b.disks:
                product = law.inverse_mass[body] * (row.dx * touch.dx + row.dy * touch.dy)
                total = total + product if (body == a.i) == (body == b.i) else total - product
            rows[-1].append(total)
    return rows


def apply(
    law: CollisionLaw, touches: Sequence[Touch], forces: Mapping[int, Number], v: Velocities
) -> Velocities:
    """The vectors v (x, y, spin) of bodies after these impulses, or under these forces."""
    after = dict(v)
    for a, force in forces.items():
        contact, dx, dy = touches[a]
        for body, way in ((contact.i, -1), (contact.j, 1))[: len(contact.disks)]:
            x, y, spin = after[body]
            kick = way * force * law.inverse_mass[body]
            after[body] = x + kick * dx, y + kick * dy, spin
    return after
