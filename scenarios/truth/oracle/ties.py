"""Collisions: one contact at a time, and contacts that touch at the same instant, resolved in every
order there is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from scenarios.truth.oracle.friction import Grip, limited
from scenarios.truth.oracle.numbers import Number, Numbers

MOST_ORDERS = 3000  # collisions tried in all orders together
LONGEST = 200  # collisions of one order at one instant; more do not end


class Contact(NamedTuple):
    """What disk `i` comes to: kind "body", a disk j or an end point (j from n on); "wall", a side
    of wall j; "edge" of the wrap across axis j; "end" of the wall j it rests on; "rest", where its
    bounces on a side of wall j die out; "grip", where it slides along that no more.
    """

    kind: str
    i: int
    j: int
    side: int = 0

    @property
    def disks(self) -> set[int]:
        """The bodies whose motion it changes; an end point among them does no harm."""
        return {self.i, self.j} if self.kind == "body" else {self.i}


class Touch(NamedTuple):
    """A contact at its instant: the direction (dx, dy) from the centre of i to the other, any
    length but 0."""

    contact: Contact
    dx: Number
    dy: Number


class Blow(NamedTuple):
    """A collision that was carried out: its impulse N s along the normal, and the cosine of the
    impact angle, |v_n| / |v|; whether friction has ended the slip of the contact points."""

    contact: Contact
    impulse: Number
    cosine: Number
    grips: bool = False


Velocity = tuple[Number, Number, Number]
Velocities = dict[int, Velocity]
"""Body -> its velocity: vx, vy m/s, and rad/s, which is 0 where there is no friction."""


class Outcome(NamedTuple):
    """How a simultaneous contact may end: velocities, the collisions in one order, contacts with no
    speed across, exactly."""

    velocities: Velocities
    blows: list[Blow]
    still: frozenset[Contact]


@dataclass(frozen=True)
class Matter:
    """What a collision needs to know of the bodies: 1 / mass (b,) 1/kg and the restitution, in
    numbers; whether that is 0; and what friction needs, if there is any."""

    numbers: Numbers
    inverse_mass: Sequence[Number]
    restitution: Number
    sticks: bool
    grip: Grip | None = None

    @cached_property
    def faint(self) -> Number:
        """m2/s, what is slower is on its way to the tie."""
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

    def collision(self, touch: Touch, v: Velocities) -> tuple[Velocities, Blow]:
        """The velocities after the collision, and the collision.

        q = -(1 + e) b / (dr.dr (w_i + w_j)) times dr: no root, which in float64 would make energy
        drift.
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
        blow = Blow(contact, q * root(square), -b / root(square * speed2))
        return (after, blow) if self.grip is None else self.rubbed(touch, v, after, blow, self.grip)

    def rubbed(
        self, touch: Touch, v: Velocities, after: Velocities, blow: Blow, grip: Grip
    ) -> tuple[Velocities, Blow]:
        """`after` and `blow` of a collision from velocities v, with what friction adds; see
        `friction`."""
        contact, i, body = touch.contact, touch.contact.i, touch.contact.kind == "body"
        (ux, uy, spin), (px, py, turn) = self._pair(touch, v)
        distance = self.numbers.sqrt(touch.dx * touch.dx + touch.dy * touch.dy)
        tx, ty = -touch.dy / distance, touch.dx / distance
        slip = tx * (px - ux) + ty * (py - uy) - grip.radius[i] * spin
        softness = self.inverse_mass[i] + grip.softness(i)
        if body:
            slip -= grip.radius[contact.j] * turn
            softness += self.inverse_mass[contact.j] + grip.softness(contact.j)
        kick, grips = limited(self.numbers, -slip / softness, grip.friction * blow.impulse)
        after = {**after, i: self._kicked(after[i], i, -kick * tx, -kick * ty, kick)}
        if body:
            j = contact.j
            after[j] = self._kicked(after[j], j, kick * tx, kick * ty, kick)
        return after, blow._replace(grips=grips)

    def _kicked(self, v: Velocity, i: int, jx: Number, jy: Number, kick: Number) -> Velocity:
        """A velocity after the impulse (jx, jy) N s on the rim of body i, which turns it by r
        `kick`, clockwise."""
        assert self.grip is not None
        w, turns = self.inverse_mass[i], self.grip.radius[i] * self.grip.inverse_inertia[i]
        return v[0] + w * jx, v[1] + w * jy, v[2] - turns * kick

    def outcomes(
        self,
        touches: Sequence[Touch],
        v: Velocities,
        still: frozenset[Contact] = frozenset(),
        upright: Callable[[Contact, Contact], bool] = lambda _one, _other: False,
    ) -> tuple[list[Outcome], int]:
        """Every different end that resolving the approaching contacts in some order can have, with
        one such order.

        And how many collisions were tried for that.

        still: contacts with no speed across, exactly. upright: whether a collision on one contact
        leaves the other so. The last element has no velocities where some order does not end.
        """
        sign, ends = self.numbers.sign, list[Outcome]()
        waiting = [Outcome(v, [], still)]
        for tried in range(MOST_ORDERS):
            if not waiting:
                return ends, tried
            now, blows, still = waiting.pop()
            if len(blows) > LONGEST:
                break
            closing = [
                touch
                for touch in touches
                if touch.contact not in still and sign(self.approach(touch, now)) < 0
            ]
            # Collisions that die out towards the tie do not end: with more digits there would be
            # more of them.
            if (
                blows
                and not self.numbers.proves
                and any(abs(self.approach(t, now)) < self.faint for t in closing)
            ):
                break
            for touch in closing:
                after, blow = self.collision(touch, now)
                kept = {
                    c
                    for c in still
                    if not c.disks & touch.contact.disks or upright(c, touch.contact)
                }
                kept |= {touch.contact} if self.sticks else set()
                waiting.append(Outcome(after, [*blows, blow], frozenset(kept)))
            if not closing and not any(self._same(now, end.velocities) for end in ends):
                ends.append(Outcome(now, blows, still))
        return [*ends, Outcome({}, [], frozenset())], MOST_ORDERS

    def _same(self, one: Mapping[int, Velocity], other: Mapping[int, Velocity]) -> bool:
        return all(self.numbers.sign(a - b) == 0 for i in one for a, b in zip(one[i], other[i]))
