"""Collisions: of one contact, and of several contacts at one instant, resolved in every possible
order."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from scenarios.truth.oracle.friction import Friction, limited
from scenarios.truth.oracle.numbers import Number, Numbers

MOST_ORDERS = 3000  # collisions tried in all orders together
LONGEST = 200  # collisions of one order at one instant; more count as endless


class Contact(NamedTuple):
    """What disk `i` meets next.

    kind: "body", disk j or an end point (j from n on); "wall", a side of wall j; "edge", of the
    wrap across axis j; "end", of wall j on which it rests; "rest", its bounces on a side of wall j
    have died out; "slip end", its slip on wall j ends.
    """

    kind: str
    i: int
    j: int
    side: int = 0

    @property
    def disks(self) -> set[int]:
        """The bodies whose motion it changes; an end point may be among them."""
        return {self.i, self.j} if self.kind == "body" else {self.i}


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
    contacts with exactly no speed along their normal (`still`)."""

    velocities: Velocities
    collisions: list[Collision]
    still: frozenset[Contact]


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
        return (
            (after, collision)
            if self.friction is None
            else self.rubbed(touch, v, after, collision, self.friction)
        )

    def rubbed(
        self,
        touch: Touch,
        v: Velocities,
        after: Velocities,
        collision: Collision,
        friction: Friction,
    ) -> tuple[Velocities, Collision]:
        """`after` and `collision` of a collision from velocities v, with friction added; see
        `friction.py`."""
        contact, i, body = touch.contact, touch.contact.i, touch.contact.kind == "body"
        (ux, uy, spin), (px, py, turn) = self._pair(touch, v)
        distance = self.numbers.sqrt(touch.dx * touch.dx + touch.dy * touch.dy)
        tx, ty = -touch.dy / distance, touch.dx / distance
        slip = tx * (px - ux) + ty * (py - uy) - friction.radius[i] * spin
        inverse_effective_mass = self.inverse_mass[i] + friction.rim_inverse_mass(i)
        if body:
            slip -= friction.radius[contact.j] * turn
            inverse_effective_mass += self.inverse_mass[contact.j] + friction.rim_inverse_mass(
                contact.j
            )
        kick, slip_ended = limited(
            self.numbers, -slip / inverse_effective_mass, friction.coefficient * collision.impulse
        )
        after = {**after, i: self._kicked(after[i], i, -kick * tx, -kick * ty, kick)}
        if body:
            j = contact.j
            after[j] = self._kicked(after[j], j, kick * tx, kick * ty, kick)
        return after, collision._replace(slip_ended=slip_ended)

    def _kicked(self, v: Velocity, i: int, jx: Number, jy: Number, kick: Number) -> Velocity:
        """A velocity after the impulse (jx, jy) N s on the rim of body i, whose angular impulse is
        r `kick`, clockwise."""
        assert self.friction is not None
        w, turns = self.inverse_mass[i], self.friction.radius[i] * self.friction.inverse_inertia[i]
        return v[0] + w * jx, v[1] + w * jy, v[2] - turns * kick

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

        If some order does not end, the last outcome has no velocities.
        """
        sign, ends = self.numbers.sign, list[TieOutcome]()
        waiting = [TieOutcome(v, [], still)]
        for tried in range(MOST_ORDERS):
            if not waiting:
                return ends, tried
            now, collisions, still = waiting.pop()
            if len(collisions) > LONGEST:
                break
            closing = [
                touch
                for touch in touches
                if touch.contact not in still and sign(self.approach(touch, now)) < 0
            ]
            # Collisions whose speed decays to the tie have no end: more digits would give more of
            # them.
            if (
                collisions
                and not self.numbers.proves
                and any(abs(self.approach(t, now)) < self.least_approach for t in closing)
            ):
                break
            for touch in closing:
                after, collision = self.collide(touch, now)
                kept = {
                    c
                    for c in still
                    if not c.disks & touch.contact.disks or stays_still(c, touch.contact)
                }
                kept |= {touch.contact} if self.sticks else set()
                waiting.append(TieOutcome(after, [*collisions, collision], frozenset(kept)))
            if not closing and not any(self._same(now, end.velocities) for end in ends):
                ends.append(TieOutcome(now, collisions, still))
        return [*ends, TieOutcome({}, [], frozenset())], MOST_ORDERS

    def _same(self, one: Mapping[int, Velocity], other: Mapping[int, Velocity]) -> bool:
        return all(self.numbers.sign(a - b) == 0 for i in one for a, b in zip(one[i], other[i]))
