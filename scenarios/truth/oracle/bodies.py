"""Disks and the ends of walls in many digits: the leg of each, the contacts it rests on, and which
contacts touch exactly."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from crosscheck2d.scenarios.model import Array, Scene, Thrust
from crosscheck2d.scenarios.truth.oracle.jets import count_pieces, push
from crosscheck2d.scenarios.truth.oracle.numbers import Number, Numbers
from crosscheck2d.scenarios.truth.oracle.ties import (
    CollisionLaw,
    Contact,
    Friction,
    Touch,
    Velocity,
    limited,
)

STATIC, FALLING = 0, 1
"""Kinds of acceleration: none, gravity; each disk under a thrust is a kind of its own, from 2 on;
below 0: slides on a wall."""


STILL, STRAIGHT, CURVED = range(3)
"""Shapes of legs."""


class Hop(NamedTuple):
    """A series of bounces on a wall, from the start of a leg on: normal (nx, ny), speed m/s after
    the first bounce, acceleration m/s2 towards the wall (`fall`)."""

    nx: Number
    ny: Number
    speed: Number
    fall: Number


class Turn(NamedTuple):
    """The rotation of a disk from the start of a leg on: angle rad, spin rad/s, its rate rad/s2."""

    angle: Number
    spin: Number
    rate: Number


class Leg(NamedTuple):
    """A flight from t s on: x, y m, vx, vy m/s, ax, ay m/s2 (with a `hop`, only the motion along
    the wall); the contacts on which the disk rests; its rotation, where it matters; and the
    acceleration, m/s2 in the axes of the disk, by a thrust that turns with it."""

    t: Number
    x: Number
    y: Number
    vx: Number
    vy: Number
    ax: Number
    ay: Number
    hop: Hop | None = None
    held: tuple[Contact, ...] = ()
    turn: Turn | None = None
    jet: tuple[Number, Number] | None = None


class Frame(NamedTuple):
    """A wall: start (x, y) m, unit direction (x, y), length m."""

    px: Number
    py: Number
    tx: Number
    ty: Number
    length: Number


class Bodies:
    """n disks and, as static disks of radius 0, the ends of the walls; each list has an entry for
    each of them."""

    def __init__(self, scene: Scene, k: Numbers, turning: bool = False) -> None:
        self.k, self.scene, exact = k, scene, k.exact
        ends = np.unique(scene.walls.reshape(-1, 2), axis=0)
        # The wall that a collision with an end point is listed under: the first with this end.
        self.owner = [int(np.argmax((scene.walls == end).all(axis=2).any(axis=1))) for end in ends]
        nought, still = exact(0.0), ~scene.static
        positions = np.concatenate([scene.position, ends])
        velocities = np.concatenate([scene.velocity, np.zeros_like(ends)])
        accelerations = np.concatenate([still[:, None] * scene.gravity, np.zeros_like(ends)])
        rows = [
            [nought, *map(exact, row)]
            for row in np.hstack([positions, velocities, accelerations]).tolist()
        ]
        self.legs = [Leg(*row) for row in rows]
        self.turning = turning or scene.friction > 0
        if self.turning:
            turns = np.zeros((len(ends) + scene.n, 3))
            turns[: scene.n, :2] = np.stack([scene.angle, scene.angular_velocity], axis=-1)
            rotations = [Turn(*map(exact, turn)) for turn in turns.tolist()]
            self.legs = [leg._replace(turn=turn) for leg, turn in zip(self.legs, rotations)]
        self.kind = [FALLING if moves else STATIC for moves in still] + [STATIC] * len(ends)
        if not scene.gravity.any():
            self.kind = [STATIC] * len(self.legs)
        # The kind and the acceleration of each in free flight.
        self.free = [(kind, leg.ax, leg.ay) for kind, leg in zip(self.kind, self.legs)]
        self.count = [0] * len(self.legs)  # events each has had
        self.radii = np.append(scene.radius, np.zeros(len(ends)))
        self.radius = [exact(r) for r in self.radii.tolist()]
        # the legs as float64, see `filter.py`
        self.table = np.array([[float(x) for x in (*leg[1:7], leg.t)] for leg in self.legs])
        self.shape = [shape_of(row) for row in self.table.tolist()]
        # whether the bounces of each die out without another contact: left out of all searches
        self.asleep = np.zeros(len(self.legs), bool)
        mass = [exact(m) if np.isfinite(m) else None for m in scene.mass.tolist()]
        inverse = [nought if m is None else exact(1.0) / m for m in mass] + [nought] * len(ends)
        self.law = CollisionLaw(
            k, inverse, exact(scene.restitution), scene.restitution == 0, self._friction()
        )
        self.walls = [_frame(k, wall) for wall in scene.walls.tolist()]
        # pair -> the event counts of both when they touched and did not approach; or when they had
        # exactly the same velocity
        self.separated: dict[tuple[int, int], tuple[int, int]] = {}
        self.in_step: dict[tuple[int, int], tuple[int, int]] = {}
        # the disks that move as one with each, because forces keep them in contact; and the kind of
        # such a group and its acceleration, m/s2
        self.group: list[frozenset[int]] = [frozenset() for _ in self.legs]
        self.common: list[tuple[int, Number, Number] | None] = [None for _ in self.legs]
        # the walls that each touched without approach at the start of its leg
        self.leaning: list[set[Contact]] = [set() for _ in self.legs]
        # the contacts each rests on: gap 0, no speed and no acceleration along the normal
        self.held: list[tuple[Contact, ...]] = [() for _ in self.legs]
        # rad/s2, angular acceleration by torques; used only with friction
        self.nought, self.rates = nought, [nought for _ in self.legs]
        self.jet: list[tuple[Number, Number] | None] = [None for _ in self.legs]
        # the wall on which each has exactly no slip since the collision at the start of its leg
        self.no_slip_on: list[Contact | None] = [None for _ in self.legs]
        self.sliding = [0 for _ in self.legs]  # sign of the slip on a wall with friction
        # the bodies of a pair, or disk, wall and side -> m, the distance of their centres, or of
        # centre and wall, where they touch at the start but for a rounding
        self.snug: dict[tuple[int, ...], Number] = {}

    def _friction(self) -> Friction | None:
        scene, exact = self.scene, self.k.exact
        if not scene.friction:
            return None
        turns = np.isfinite(scene.inertia) & ~scene.static
        inertia = zip(scene.inertia.tolist(), turns.tolist())
        inverse = [exact(1.0) / exact(each) if turn else exact(0.0) for each, turn in inertia]
        none = [exact(0.0)] * (len(self.legs) - scene.n)
        return Friction(exact(scene.friction), self.radius, inverse + none)

    def partner(self, contact: Contact) -> int:
        """The other disk, or -1 - wall."""
        if contact.kind != "body":
            return -1 - contact.j
        n = self.scene.n
        return contact.j if contact.j < n else -1 - self.owner[contact.j - n]

    def pair(self, contact: Contact) -> tuple[int, int]:
        i, j = contact.i, self.partner(contact)
        return (i, j) if j < 0 or i < j else (j, i)

    def name(self, contact: Contact) -> str:
        j = self.partner(contact)
        return f"disk {j}" if j >= 0 else f"wall {-1 - j}"

    def state_at(self, i: int, now: Number) -> tuple[Number, Number, Number, Number]:
        leg = self.legs[i]
        if leg.jet is not None and leg.t is not now:
            return self.pushed(leg, now)
        if leg.t is now or self.shape[i] == STILL:
            return leg.x, leg.y, leg.vx, leg.vy
        s = now - leg.t
        if self.shape[i] == STRAIGHT:
            return leg.x + leg.vx * s, leg.y + leg.vy * s, leg.vx, leg.vy
        ux, uy = leg.ax * s, leg.ay * s
        x, y = leg.x + (leg.vx + ux / 2) * s, leg.y + (leg.vy + uy / 2) * s
        return x, y, leg.vx + ux, leg.vy + uy

    def pushed(self, leg: Leg, now: Number) -> tuple[Number, Number, Number, Number]:
        s, k, turn = now - leg.t, self.k, leg.turn
        assert turn is not None
        assert leg.jet is not None
        pieces = count_pieces(float(turn.spin), float(turn.rate), float(s))
        gain = push(leg.jet, turn.angle, turn.spin, turn.rate, s, pieces, k.bits)
        # The series are cut at 2^-bits of the size of their sum.
        cut = 2.0 ** -min(k.bits, 1000) * pieces * sum(abs(float(f)) for f in leg.jet)
        (dx, dy), (du, dv) = [[x + k.between(-cut, cut) for x in part] for part in gain]
        vx, vy = leg.vx + leg.ax * s, leg.vy + leg.ay * s
        x, y = leg.x + (leg.vx + vx) * s / 2 + dx, leg.y + (leg.vy + vy) * s / 2 + dy
        return x, y, vx + du, vy + dv

    def velocity_at(self, i: int, now: Number) -> Velocity:
        _, _, vx, vy = self.state_at(i, now)
        return vx, vy, self.turn_at(i, now).spin

    def turn_at(self, i: int, now: Number) -> Turn:
        leg = self.legs[i]
        if leg.turn is None:
            return Turn(self.nought, self.nought, self.nought)
        if leg.t is now:
            return leg.turn
        (angle, spin, rate), s = leg.turn, now - leg.t
        return Turn(angle + (spin + rate * s / 2) * s, spin + rate * s, rate)

    def fly(self, i: int, now: Number, v: Velocity, beside: Contact | None = None) -> None:
        x, y, _, _ = self.state_at(i, now)
        if beside is not None:
            x, y = self.beside(beside, x, y)
        self.common[i] = None
        self.begin(i, self.leg(i, now, x, y, v))

    def leg(self, i: int, now: Number, x: Number, y: Number, v: Velocity) -> Leg:
        (vx, vy, spin), (ax, ay, rate) = v, self.acceleration(i)
        turn = Turn(self.turn_at(i, now).angle, spin, rate) if self.turning else None
        return Leg(now, x, y, vx, vy, ax, ay, turn=turn, jet=self.jet[i])

    def across(self, edge: Contact, now: Number) -> None:
        assert self.scene.wrap is not None
        i, place = edge.i, list(self.state_at(edge.i, now))
        place[edge.j] = self.k.exact(float(self.scene.wrap[0 if edge.side > 0 else 1, edge.j]))
        spin = self.turn_at(i, now).spin
        self.held[i], self.common[i] = (), None
        x, y, vx, vy = place
        self.begin(i, self.leg(i, now, x, y, (vx, vy, spin)))

    def set_thrusts(self, i: int, now: Number, thrusts: Sequence[Thrust]) -> None:
        exact, inverse = self.k.exact, self.law.inverse_mass[i]
        a = [exact(g) for g in (self.scene.gravity * (not self.scene.static[i])).tolist()]
        jet = [self.nought, self.nought]
        for thrust in thrusts:
            force = [exact(float(each)) * inverse for each in thrust.force]
            if thrust.frame == "body":
                jet = [each + more for each, more in zip(jet, force)]
            else:
                a = [each + more for each, more in zip(a, force)]
        kind = 2 + i if thrusts else (FALLING if self.scene.gravity.any() else STATIC)
        self.free[i] = kind, a[0], a[1]
        if self.turning:
            torque = exact(float(sum(thrust.torque for thrust in thrusts)))
            inertia = exact(float(self.scene.inertia[i]))
            self.rates[i] = torque / inertia if any(p.torque for p in thrusts) else self.nought
        v, rolls = self.velocity_at(i, now), bool(self.held[i]) and not self.sliding[i]
        turns = any(p.frame == "body" and p.force.any() for p in thrusts)
        self.jet[i] = (jet[0], jet[1]) if turns else None
        walls = [c for c in self.held[i] if c.kind == "wall"]
        held = tuple(c for c in walls if self.k.sign(self.outward(c, *a)) < 0)
        self.hold(i, now, held, v, rolls)
        self.asleep[i] = turns  # contacts of such a disk are found by `probe`
        # The walls on which it rested still touch it.
        self.leaning[i] = {c for c in self.held[i] if c.kind == "wall"}

    def hold(
        self,
        i: int,
        now: Number,
        contacts: tuple[Contact, ...],
        v: Velocity,
        rolls: bool = False,
        common: tuple[int, Number, Number] | None = None,
    ) -> None:
        """Body i goes on with velocity v, resting on these contacts.

        rolls: it has exactly no slip on the one wall on which it rests with friction.
        common: kind and acceleration of its group.
        """
        self.asleep[i] = False
        self.held[i], self.common[i] = contacts, common
        # What has been noted at this instant holds on another acceleration, too.
        noted = [
            (pairs, pair)
            for pairs in (self.separated, self.in_step)
            for pair, counts in pairs.items()
            if i in pair
            and counts == (self.count[pair[0]], self.count[pair[1]])
            and self.legs[i].t is now
        ]
        if contacts and self.law.friction is not None:
            self.sliding[i] = 0 if rolls else self.k.sign(self.slip(contacts[0], v))
        x, y, _, _ = self.state_at(i, now)
        self.begin(i, self.leg(i, now, x, y, v))
        for pairs, pair in noted:
            pairs[pair] = self.count[pair[0]], self.count[pair[1]]

    def slip(self, contact: Contact, v: Velocity) -> Number:
        """m/s, the velocity of the contact point along the wall, positive from its start to its
        end."""
        _, _, tx, ty, _ = self.walls[contact.j]
        return tx * v[0] + ty * v[1] + contact.side * self.radius[contact.i] * v[2]

    def begin(self, i: int, leg: Leg) -> None:
        self.legs[i] = leg = leg._replace(held=self.held[i])
        row = [float(x) for x in (*leg[1:7], leg.t)]
        self.table[i], self.shape[i] = row, shape_of(row)
        self.count[i] += 1
        self.leaning[i] = set()
        self.no_slip_on[i] = None

    def acceleration(self, i: int) -> tuple[Number, Number, Number]:
        """m/s2, m/s2 and rad/s2 on the contacts that body i rests on; also sets its kind."""
        if (common := self.common[i]) is not None:
            self.kind[i] = common[0]
            return common[1], common[2], self.rates[i]
        kind, ax, ay = self.free[i]
        rate = self.rates[i]
        walls = [c for c in self.held[i] if c.kind == "wall"]
        if len(self.held[i]) > 1 or len(walls) < len(self.held[i]):
            kind, ax, ay = STATIC, self.k.exact(0.0), self.k.exact(0.0)
        elif walls:
            _, _, tx, ty, _ = self.walls[walls[0].j]
            along, load = tx * ax + ty * ay, -self.outward(walls[0], ax, ay)
            if kind == FALLING:
                level = square_to(self.scene.walls[walls[0].j], self.scene.gravity)
                kind, along = (STATIC, self.k.exact(0.0)) if level else (-1 - walls[0].j, along)
            # On a level wall friction does not act without slip and torque.
            lies = kind == STATIC and not self.sliding[i] and self.rates[i] is self.nought
            if self.law.friction is not None and not lies:
                kind = 2 + i
                along, rate = self.rubbed(walls[0], along, load, self.law.friction)
            ax, ay = along * tx, along * ty
        self.kind[i] = kind
        return ax, ay, rate

    def rubbed(
        self, contact: Contact, along: Number, load: Number, friction: Friction
    ) -> tuple[Number, Number]:
        """m/s2 along a wall and rad/s2 of a disk that rests on it, with friction; sets `sliding`.

        along, load: m/s2, its acceleration along the wall without friction, and into the wall.
        """
        i, k, w = contact.i, self.k, self.law.inverse_mass[contact.i]
        # All per mass: 1 m/s2 of friction changes the slip by `inverse_effective_mass` m/s2.
        inverse_effective_mass = 1 + friction.rim_inverse_mass(i) / w
        most = friction.coefficient * load
        driven = along + contact.side * self.radius[i] * self.rates[i]
        if self.sliding[i]:
            force = -self.sliding[i] * most
        else:
            force, rolls = limited(k, -driven / inverse_effective_mass, most)
            self.sliding[i] = 0 if rolls else k.sign(driven)
        turning = contact.side * self.radius[i] * friction.inverse_inertia[i] * force / w
        return along + force, self.rates[i] + turning

    def remember(self, touches: Sequence[Touch], collided: set[int]) -> None:
        """Note, after the collisions of one instant, that these contacts touch exactly and do not
        approach."""
        for contact, _, _ in touches:
            if contact.kind == "body":
                i, j = sorted((contact.i, contact.j))
                self.separated[i, j] = self.count[i], self.count[j]
            elif contact.i in collided or not collided:
                self.leaning[contact.i].add(contact)

    def keep_in_step(self, contact: Contact) -> None:
        i, j = sorted((contact.i, contact.j))
        self.separated[i, j] = self.in_step[i, j] = self.count[i], self.count[j]

    def height(self, contact: Contact, x: Number, y: Number) -> Number:
        """m from the line of the wall, positive on the contact's side of it."""
        px, py, tx, ty, _ = self.walls[contact.j]
        return contact.side * (tx * (y - py) - ty * (x - px))

    def reach(self, contact: Contact) -> Number:
        """m, the distance of two centres, or of a centre from a wall, that touch each other."""
        i, j = contact.i, contact.j
        if contact.kind == "body":
            return self.snug.get((min(i, j), max(i, j))) or self.radius[i] + self.radius[j]
        return self.snug.get((i, j, contact.side)) or self.radius[i]

    def foot(self, wall: int, x: Number, y: Number) -> Number:
        px, py, tx, ty, _ = self.walls[wall]
        return tx * (x - px) + ty * (y - py)

    def foot_on(self, wall: int, x: Number, y: Number) -> bool:
        foot, sign = self.foot(wall, x, y), self.k.sign
        return sign(foot) >= 0 and sign(self.walls[wall].length - foot) >= 0

    def outward(self, contact: Contact, x: Number, y: Number) -> Number:
        _, _, tx, ty, _ = self.walls[contact.j]
        return contact.side * (tx * y - ty * x)

    def slide(self, contact: Contact, x: Number, y: Number) -> tuple[Number, Number]:
        _, _, tx, ty, _ = self.walls[contact.j]
        part = tx * x + ty * y
        return part * tx, part * ty

    def beside(self, contact: Contact, x: Number, y: Number) -> tuple[Number, Number]:
        px, py, tx, ty, _ = self.walls[contact.j]
        foot, away = self.foot(contact.j, x, y), contact.side * self.reach(contact)
        return px + foot * tx - away * ty, py + foot * ty + away * tx

    def stays_still(self, one: Contact, other: Contact) -> bool:
        """Whether a collision on one wall leaves the speed along the normal of the other unchanged:
        they are exactly perpendicular, and there is no friction."""
        if one.kind != "wall" or other.kind != "wall" or self.law.friction is not None:
            return False
        direction = self.scene.walls[other.j, 1], self.scene.walls[other.j, 0]
        return square_to(self.scene.walls[one.j], *direction)


def shape_of(row: Sequence[float]) -> int:
    if row[4] or row[5]:
        return CURVED
    return STRAIGHT if row[2] or row[3] else STILL


def rational(vector: Array) -> tuple[Fraction, Fraction]:
    return Fraction(float(vector[0])), Fraction(float(vector[1]))


def nearest(points: Array, walls: Array) -> tuple[Array, Array]:
    """(p, w) each: where on each of the walls (w, 2, 2) the foot of each of the points (p, 2) lies,
    from 0 at its start to 1 at its end, or beyond; and the distance, m, of the two."""
    start, span = walls[:, 0], walls[:, 1] - walls[:, 0]
    away = points[:, None] - start
    share = (away * span).sum(axis=-1) / (span**2).sum(axis=-1)
    dx, dy = np.moveaxis(away - np.clip(share, 0, 1)[..., None] * span, -1, 0)
    return share, np.hypot(dx, dy)


def square_to(wall: Array, tip: Array, foot: Array | None = None) -> bool:
    """Whether a wall is perpendicular to the vector from `foot` (default 0, 0) to `tip`,
    exactly."""
    (px, py), (qx, qy) = rational(wall[0]), rational(wall[1])
    (x, y), (ox, oy) = rational(tip), rational(np.zeros(2) if foot is None else foot)
    return (qx - px) * (x - ox) + (qy - py) * (y - oy) == 0


def _frame(k: Numbers, wall: list[list[float]]) -> Frame:
    (px, py), (qx, qy) = [[k.exact(x) for x in end] for end in wall]
    dx, dy = qx - px, qy - py
    length = k.sqrt(dx * dx + dy * dy)
    return Frame(px, py, dx / length, dy / length, length)
