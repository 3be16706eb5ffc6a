"""Disks and the ends of walls in many digits: where they are, what they touch and when, how a leg begins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scenarios.model import Scene, Thrust
from scenarios.no_truth import NoTruth
from scenarios.numbers import Number, Numbers
from scenarios.oracle_contacts import crossing, falling_meeting, meeting
from scenarios.oracle_filter import earliest_bodies, earliest_walls, moved, passes_by
from scenarios.oracle_ties import Contact, Matter, Touch, Velocity

STATIC, FALLING = 0, 1
"""Kinds of acceleration; each pushed disk is a kind of its own, from 2 on."""


class Leg(NamedTuple):
    """A flight from t s on: x, y m, vx, vy m/s, ax, ay m/s2."""

    t: Number
    x: Number
    y: Number
    vx: Number
    vy: Number
    ax: Number
    ay: Number


class Bodies:
    """n disks and, as static disks of radius 0, the ends of the walls; b of them together.

    Attributes:
        legs: (b,) the leg each body is on.
        count: (b,) events each has had.
        table, radii: (b, 7) and (b,) the legs as float64 x, y, vx, vy, ax, ay, t, and m, for the filter.
        matter: masses and restitution.

    Raises:
        NoTruth: bodies overlap at the start.
    """

    def __init__(self, scene: Scene, k: Numbers) -> None:
        self.k, self.scene, exact = k, scene, k.exact
        ends = np.unique(scene.walls.reshape(-1, 2), axis=0)
        # The wall that is blamed for a hit on its end: the first that has it.
        self.owner = [int(np.argmax((scene.walls == end).all(axis=2).any(axis=1))) for end in ends]
        nought, still = exact(0.0), ~scene.static
        positions = np.concatenate([scene.position, ends])
        velocities = np.concatenate([scene.velocity, np.zeros_like(ends)])
        pulls = np.concatenate([still[:, None] * scene.gravity, np.zeros_like(ends)])
        rows = [[nought, *map(exact, row)] for row in np.hstack([positions, velocities, pulls]).tolist()]
        self.legs = [Leg(*row) for row in rows]
        self.pull = [FALLING if moves else STATIC for moves in still] + [STATIC] * len(ends)
        if not scene.gravity.any():
            self.pull = [STATIC] * len(self.legs)
        self.count = [0] * len(self.legs)
        self.radii = np.append(scene.radius, np.zeros(len(ends)))
        self.radius = [exact(r) for r in self.radii.tolist()]
        self.table = np.array([[float(x) for x in (*leg[1:], leg.t)] for leg in self.legs])
        mass = [exact(m) if np.isfinite(m) else None for m in scene.mass.tolist()]
        inverse = [nought if m is None else exact(1.0) / m for m in mass] + [nought] * len(ends)
        self.matter = Matter(k, inverse, exact(scene.restitution))
        self.walls = [_frame(k, wall) for wall in scene.walls.tolist()]
        self.parted: dict[tuple[int, int], tuple[int, int]] = {}
        self.leaning: list[set[Contact]] = [set() for _ in self.legs]
        self._refuse_overlaps()

    def _refuse_overlaps(self) -> None:
        now, faults = self.k.exact(0.0), []
        for i in np.flatnonzero(~self.scene.static).tolist():
            for contact in self.standing_on(i, now):
                j = self.partner(contact)
                if contact.kind != "body" or j < 0 or j > i or self.scene.static[j]:
                    other = f"disk {j}" if j >= 0 else f"wall {-1 - j}"
                    gap = self.distance(contact, now) - float(self.radii[i])
                    gap -= float(self.radii[contact.j]) if contact.kind == "body" else 0.0
                    faults.append(f"disk {i} and {other} overlap by {-gap:.3g} m at the start: move them apart by that")
        if faults:
            raise NoTruth(faults[0] + (f" ({len(faults) - 1} more)" if len(faults) > 1 else ""))

    def distance(self, contact: Contact, now: Number) -> float:
        """m from the centre of contact.i to the other centre or the line of the wall."""
        touch = self.touch(contact, now)
        if contact.kind == "body":
            return float(self.k.sqrt(touch.dx * touch.dx + touch.dy * touch.dy))
        return float(self._height(contact, now))

    def leg(self, i: int) -> Leg:
        """The leg body i is on."""
        return self.legs[i]

    def partner(self, contact: Contact) -> int:
        """The other disk, or -1 - wall."""
        if contact.kind != "body":
            return -1 - contact.j
        n = self.scene.n
        return contact.j if contact.j < n else -1 - self.owner[contact.j - n]

    def state_at(self, i: int, now: Number) -> tuple[Number, Number, Number, Number]:
        """x, y m and vx, vy m/s of body i: x + v t + a t^2 / 2, v + a t."""
        leg = self.legs[i]
        if leg.t is now or (self.count[i] == 0 and self.pull[i] == STATIC and not self.table[i, 2:4].any()):
            return leg.x, leg.y, leg.vx, leg.vy
        s = now - leg.t
        if not self.table[i, 4:6].any():
            return leg.x + leg.vx * s, leg.y + leg.vy * s, leg.vx, leg.vy
        ux, uy = leg.ax * s, leg.ay * s
        return leg.x + (leg.vx + ux / 2) * s, leg.y + (leg.vy + uy / 2) * s, leg.vx + ux, leg.vy + uy

    def velocity_at(self, i: int, now: Number) -> Velocity:
        """vx, vy m/s."""
        return self.state_at(i, now)[2:]

    def start_leg(self, i: int, now: Number, v: Velocity, edge: Contact | None = None) -> None:
        """Body i flies on from here with velocity v; over an edge of the wrap it is set onto the opposite one."""
        place = list(self.state_at(i, now)[:2])
        if edge is not None:
            assert self.scene.wrap is not None
            place[edge.j] = self.k.exact(float(self.scene.wrap[0 if edge.side > 0 else 1, edge.j]))
        self._set(i, Leg(now, place[0], place[1], v[0], v[1], self.legs[i].ax, self.legs[i].ay))

    def push(self, i: int, now: Number, thrusts: Sequence[Thrust]) -> None:
        """Body i is pushed by all of `thrusts` from now on."""
        exact, inverse = self.k.exact, self.matter.inverse_mass[i]
        a = [exact(g) for g in (self.scene.gravity * (not self.scene.static[i])).tolist()]
        for thrust in thrusts:
            a = [each + exact(float(force)) * inverse for each, force in zip(a, thrust.force)]
        self.pull[i] = 2 + i if thrusts else (FALLING if self.scene.gravity.any() else STATIC)
        self._set(i, Leg(now, *self.state_at(i, now), *a))

    def _set(self, i: int, leg: Leg) -> None:
        self.legs[i] = leg
        self.table[i] = [float(x) for x in (*leg[1:], leg.t)]
        self.count[i] += 1
        self.leaning[i] = set()

    def remember(self, touches: Sequence[Touch], hit: set[int]) -> None:
        """After the hits of one instant: these contacts touch, exactly, and do not approach."""
        for contact, _, _ in touches:
            if contact.kind == "body":
                i, j = sorted((contact.i, contact.j))
                self.parted[i, j] = self.count[i], self.count[j]
            if contact.i in hit or not hit:
                self.leaning[contact.i].add(contact)

    def time_to(self, contact: Contact, now: Number, limit: float) -> Number | None:
        """s from `now` to this contact, or None if it does not come within `limit` s. Raises `Pressed`."""
        if contact.kind == "edge":
            return self._time_to_edge(contact, now)
        if contact.kind == "wall":
            return self._time_to_wall(contact, now)
        i, j = contact.i, contact.j
        pair = (min(i, j), max(i, j))
        parted = self.parted.get(pair) == (self.count[pair[0]], self.count[pair[1]])
        alike = self.pull[i] == self.pull[j]
        if parted and alike:
            return None
        (x, y, u, v), (px, py, pu, pv) = self.state_at(i, now), self.state_at(j, now)
        dx, dy, du, dv = px - x, py - y, pu - u, pv - v
        reach = self.radius[i] + self.radius[j]
        c, b, a2 = dx * dx + dy * dy - reach * reach, dx * du + dy * dv, du * du + dv * dv
        if alike:
            return meeting(self.k, c, b, a2)
        if passes_by(self.table, self.radii, i, j, float(now), limit):
            return None
        if parted and self.legs[i].t is now:
            c = self.k.exact(0.0)
        ax, ay = self.legs[j].ax - self.legs[i].ax, self.legs[j].ay - self.legs[i].ay
        gap = [c, 2 * b, a2 + dx * ax + dy * ay, du * ax + dv * ay, (ax * ax + ay * ay) / 4]
        # A little beyond the limit, so that what meets at the limit itself is seen as simultaneous.
        return falling_meeting(self.k, gap, self.k.exact(limit * (1 + 1e-6)))

    def _height(self, contact: Contact, now: Number) -> Number:
        """m from the line of the wall to the centre, positive on the contact's side of it."""
        px, py, tx, ty, _ = self.walls[contact.j]
        x, y, _, _ = self.state_at(contact.i, now)
        return contact.side * (tx * (y - py) - ty * (x - px))

    def _time_to_wall(self, contact: Contact, now: Number) -> Number | None:
        i, side, leg = contact.i, contact.side, self.legs[contact.i]
        px, py, tx, ty, length = self.walls[contact.j]
        x, y, u, v = self.state_at(i, now)
        fall = self.k.exact(0.0) if self.pull[i] == STATIC else side * (tx * leg.ay - ty * leg.ax)
        touching = contact in self.leaning[i] and leg.t is now
        gap = self.k.exact(0.0) if touching else self._height(contact, now) - self.radius[i]
        after = crossing(self.k, gap, side * (tx * v - ty * u), fall)
        if after is None:
            return None
        x, y = x + (u + leg.ax * after / 2) * after, y + (v + leg.ay * after / 2) * after
        foot = tx * (x - px) + ty * (y - py)
        beside = self.k.sign(foot) < 0 or self.k.sign(length - foot) < 0
        return None if beside else after

    def _time_to_edge(self, contact: Contact, now: Number) -> Number | None:
        i, axis, side = contact.i, contact.j, contact.side
        assert self.scene.wrap is not None
        edge = self.k.exact(float(self.scene.wrap[1 if side > 0 else 0, axis]))
        state, leg = self.state_at(i, now), self.legs[i]
        pull = self.k.exact(0.0) if self.pull[i] == STATIC else -side * leg[5 + axis]
        gap, speed = side * (edge - state[axis]), -side * state[2 + axis]
        # A centre that stands on an edge is not beyond it.
        if self.k.sign(gap) == 0 and self.k.sign(speed) == 0:
            return None
        return crossing(self.k, gap, speed, pull)

    def touch(self, contact: Contact, now: Number) -> Touch:
        """The contact with its direction, at `now`."""
        if contact.kind == "body":
            x, y, _, _ = self.state_at(contact.i, now)
            px, py, _, _ = self.state_at(contact.j, now)
            return Touch(contact, px - x, py - y)
        _, _, tx, ty, _ = self.walls[contact.j]
        return Touch(contact, contact.side * ty, -contact.side * tx)

    def near(self, i: int, now: Number) -> list[tuple[Contact, int]]:
        """What disk i touches (0) or overlaps (-1) now."""
        t, found = float(now), list[tuple[Contact, int]]()
        x, y, _, _ = self.state_at(i, now)
        # With no motion but a fall of 1 m/s2 the filter's time is 0 only where the gap is below its slack.
        frozen = np.zeros_like(self.table)
        frozen[:, :2], frozen[i, 4], frozen[:, 6] = moved(self.table, t)[0], 1.0, t
        for j in np.flatnonzero(earliest_bodies(frozen, self.radii, i, t) == 0).tolist():
            touch, reach = self.touch(Contact("body", i, j), now), self.radius[i] + self.radius[j]
            gap = self.k.sign(touch.dx * touch.dx + touch.dy * touch.dy - reach * reach)
            found += [(touch.contact, gap)] if gap <= 0 else []
        bounds = earliest_walls(frozen, self.radii, self.scene.walls, i, t) if self.walls else np.zeros(0)
        for w in np.flatnonzero(bounds == 0).tolist():
            px, py, tx, ty, length = self.walls[w]
            side = 1 if self._height(Contact("wall", i, w, 1), now) >= 0 else -1
            contact, foot = Contact("wall", i, w, side), tx * (x - px) + ty * (y - py)
            gap = self.k.sign(self._height(contact, now) - self.radius[i])
            if gap <= 0 and self.k.sign(foot) >= 0 and self.k.sign(length - foot) >= 0:
                found.append((contact, gap))
        return found

    def standing_on(self, i: int, now: Number) -> list[Contact]:
        """What disk i overlaps now."""
        return [contact for contact, gap in self.near(i, now) if gap < 0]

    def cluster(self, contacts: Sequence[Contact], now: Number) -> list[Touch]:
        """All contacts that touch now, of these disks and of all that touch those."""
        done: set[int] = set()
        waiting = {contact.i for contact in contacts} | {c.j for c in contacts if c.kind == "body"}
        found: dict[tuple, Contact] = {}
        while todo := [i for i in waiting - done if i < self.scene.n and not self.scene.static[i]]:
            for contact, _ in self.near(todo[0], now):
                if contact.kind == "body":
                    waiting.add(contact.j)
                    found.setdefault(("body", *sorted((contact.i, contact.j))), contact)
                else:
                    found.setdefault(tuple(contact), contact)
            done.add(todo[0])
        return [self.touch(contact, now) for contact in found.values()]


def _frame(k: Numbers, wall: list[list[float]]) -> tuple[Number, Number, Number, Number, Number]:
    """Start (x, y) m, unit direction (x, y), length m of a wall."""
    (px, py), (qx, qy) = [[k.exact(x) for x in end] for end in wall]
    dx, dy = qx - px, qy - py
    length = k.sqrt(dx * dx + dy * dy)
    return px, py, dx / length, dy / length, length
