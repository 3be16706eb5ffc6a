"""The next contact of a body and its present contacts: first by float64 bounds, then in many digits
where these do not decide."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from crosscheck2d.scenarios.truth.oracle.bodies import Bodies, rational
from crosscheck2d.scenarios.truth.oracle.contacts import Pressed, crossing, falling_meeting, meeting
from crosscheck2d.scenarios.truth.oracle.filter import soonest, touching
from crosscheck2d.scenarios.truth.oracle.numbers import Number
from crosscheck2d.scenarios.truth.oracle.ties import Contact, Touch, key

# of two equal products: by how much float64 may make them differ, some roundings
NOT_EXCLUDED = 1e-12
LATE = 1e-6  # relative; a search goes so far beyond its limit, to find contacts at the limit itself


class ContactFinder:
    """Finds the next and the present contacts of `bodies`."""

    def __init__(self, bodies: Bodies) -> None:
        self.bodies, self.k, self.scene = bodies, bodies.k, bodies.scene
        most = len(bodies.legs) + 2 * len(bodies.walls)
        self.bounds, self.codes = np.empty(most), np.empty(most, np.int64)
        # what the filter reads, which `bodies` keeps up to date
        self.arrays = bodies.table, bodies.radii, bodies.asleep, self.scene.walls
        # For each wall the ends of walls on its line: a disk that rests on the wall slides over
        # them, or off them.
        n, walls = self.scene.n, self.scene.walls
        ends = bodies.table[n : len(bodies.legs), :2]
        self.in_line = [{n + k for k in points_in_line(wall, ends)} for wall in walls]
        ending_at: dict[tuple[float, ...], set[int]] = defaultdict(set)
        for w, wall in enumerate(walls.tolist()):
            for end in wall:
                ending_at[tuple(end)].add(w)
        self.surface = [self._surface(w, ending_at) for w in range(len(walls))]

    def _surface(self, w: int, ending_at: Mapping[tuple[float, ...], set[int]]) -> list[int]:
        """The walls that lie in line with wall w and overlap it or share an end with it, directly
        or through others, with wall w itself: a disk slides over them as over one wall.

        ending_at: a point -> the walls that end there.
        """
        walls = self.scene.walls
        points = {tuple(self.bodies.table[j, :2].tolist()) for j in self.in_line[w]}
        ends = Counter(k for point in points for k in ending_at[point])
        spans = {k: line_span(walls[w], walls[k]) for k, count in ends.items() if count == 2}
        (low, high), found = spans[w], {w}
        while more := {
            k for k, (a, b) in spans.items() if k not in found and a <= high and b >= low
        }:
            found |= more
            low, high = min(spans[k][0] for k in found), max(spans[k][1] for k in found)
        return sorted(found)

    def contact(self, i: int, code: int) -> Contact:
        wall, right = divmod(code - len(self.bodies.legs), 2)
        return Contact("wall", i, wall, 1 - 2 * right) if wall >= 0 else Contact("body", i, code)

    def candidates(self, i: int, now: float, left: float) -> Iterator[tuple[float, Contact]]:
        """The possible contacts of disk i within `left` s, each with a lower bound on the time to
        it, s, soonest first."""
        bodies = self.bodies
        if self.scene.wrap is not None:
            yield from ((0.0, edge) for edge in self._edges(i))
        held = bodies.held[i]
        walls = [c.j for c in held if c.kind == "wall"]
        yield from ((0.0, Contact("end", i, wall, side)) for wall in walls for side in (1, -1))
        if bodies.sliding[i]:
            yield from ((0.0, c._replace(kind="slip end")) for c in held)
        count = soonest(*self.arrays, i, now, left, self.bounds, self.codes)
        for bound, code in zip(self.bounds[:count].tolist(), self.codes[:count].tolist()):
            contact = self.contact(i, code)
            if not held or not self._holds(contact):
                yield bound, contact

    def _edges(self, i: int) -> Iterator[Contact]:
        velocity, acceleration = self.bodies.table[i, 2:4], self.bodies.table[i, 4:6]
        for axis in (0, 1):
            for side in (1, -1):
                if acceleration[axis] or side * velocity[axis] >= 0:
                    yield Contact("edge", i, axis, side)

    def _holds(self, contact: Contact) -> bool:
        held = self.bodies.held[contact.i]
        if contact.kind == "body":
            return contact in held or any(
                c.kind == "wall" and contact.j in self.in_line[c.j] for c in held
            )
        return any(c.kind == "wall" and contact.j in self.surface[c.j] for c in held)

    def time_to(self, contact: Contact, now: Number, limit: float) -> Number | None:
        """s from `now`; None if the contact does not come within `limit` s. Raises `Pressed`."""
        if contact.kind == "body":
            return self._time_to_body(contact, now, limit)
        return {
            "edge": self._time_to_edge,
            "end": self._time_to_end,
            "slip end": self._time_to_grip,
            "wall": self._time_to_wall,
        }[contact.kind](contact, now)

    def _time_to_body(self, contact: Contact, now: Number, limit: float) -> Number | None:
        bodies, i, j = self.bodies, contact.i, contact.j
        pair = (min(i, j), max(i, j))
        counts = bodies.count[pair[0]], bodies.count[pair[1]]
        separated = bodies.separated.get(pair) == counts
        alike = bodies.kind[i] == bodies.kind[j]
        if separated and alike:
            return None
        (x, y, u, v), (px, py, pu, pv) = bodies.state_at(i, now), bodies.state_at(j, now)
        dx, dy, du, dv = px - x, py - y, pu - u, pv - v
        at_once = bodies.legs[i].t is now or bodies.legs[j].t is now
        if at_once and bodies.in_step.get(pair) == counts:
            du, dv = self.k.exact(0.0), self.k.exact(0.0)
        reach = bodies.reach(contact)
        c, b, a2 = dx * dx + dy * dy - reach * reach, dx * du + dy * dv, du * du + dv * dv
        if alike:
            return meeting(self.k, c, b, a2)
        if separated and at_once:
            c = self.k.exact(0.0)
        ax, ay = bodies.legs[j].ax - bodies.legs[i].ax, bodies.legs[j].ay - bodies.legs[i].ay
        gap = [c, 2 * b, a2 + dx * ax + dy * ay, du * ax + dv * ay, (ax * ax + ay * ay) / 4]
        return falling_meeting(self.k, gap, limit * (1 + LATE))

    def _time_to_wall(self, contact: Contact, now: Number) -> Number | None:
        bodies, i, leg = self.bodies, contact.i, self.bodies.legs[contact.i]
        x, y, u, v = bodies.state_at(i, now)
        fall = bodies.outward(contact, leg.ax, leg.ay)
        leans = contact in bodies.leaning[i] and leg.t is now
        gap = self.k.exact(0.0) if leans else bodies.height(contact, x, y) - bodies.reach(contact)
        try:
            after = crossing(self.k, gap, bodies.outward(contact, u, v), fall)
        except Pressed:
            if self._above(contact.j, x, y, u, v):
                raise
            return None
        if after is None:
            return None
        x, y = x + (u + leg.ax * after / 2) * after, y + (v + leg.ay * after / 2) * after
        return after if bodies.foot_on(contact.j, x, y) else None

    def _above(self, wall: int, x: Number, y: Number, u: Number, v: Number) -> bool:
        """Whether the foot of (x, y) lies on the wall and (u, v) does not move it off an end."""
        frame, foot = self.bodies.walls[wall], self.bodies.foot(wall, x, y)
        heading = frame.tx * u + frame.ty * v
        for left, leaving in ((foot, -heading), (frame.length - foot, heading)):
            if (side := self.k.sign(left)) < 0 or (side == 0 and self.k.sign(leaving) > 0):
                return False
        return True

    def _time_to_end(self, contact: Contact, now: Number) -> Number | None:
        """s until the foot of a resting disk reaches its wall's end (side 1) or start (side -1)."""
        bodies, leg, wall = self.bodies, self.bodies.legs[contact.i], self.bodies.walls[contact.j]
        x, y, u, v = bodies.state_at(contact.i, now)
        foot, speed = bodies.foot(contact.j, x, y), wall.tx * u + wall.ty * v
        acceleration = wall.tx * leg.ax + wall.ty * leg.ay
        left = wall.length - foot if contact.side > 0 else foot
        return crossing(self.k, left, -contact.side * speed, -contact.side * acceleration)

    def _time_to_grip(self, contact: Contact, now: Number) -> Number | None:
        bodies, i = self.bodies, contact.i
        leg, way = bodies.legs[i], bodies.sliding[i]
        assert leg.turn is not None
        slower = -way * bodies.slip(contact, (leg.ax, leg.ay, leg.turn.rate))
        if self.k.sign(slower) <= 0:
            return None
        return way * bodies.slip(contact, bodies.velocity_at(i, now)) / slower

    def _time_to_edge(self, contact: Contact, now: Number) -> Number | None:
        i, axis, side = contact.i, contact.j, contact.side
        assert self.scene.wrap is not None
        edge = self.k.exact(float(self.scene.wrap[1 if side > 0 else 0, axis]))
        state, leg = self.bodies.state_at(i, now), self.bodies.legs[i]
        acceleration = -side * (leg.ax, leg.ay)[axis]
        gap, speed = side * (edge - state[axis]), -side * state[2 + axis]
        # A centre at rest on an edge is not beyond it.
        if self.k.sign(gap) == 0 and self.k.sign(speed) == 0:
            return None
        return crossing(self.k, gap, speed, acceleration)

    def touch(self, contact: Contact, now: Number) -> Touch:
        bodies = self.bodies
        if contact.kind == "body":
            x, y, _, _ = bodies.state_at(contact.i, now)
            px, py, _, _ = bodies.state_at(contact.j, now)
            return Touch(contact, px - x, py - y)
        wall = bodies.walls[contact.j]
        return Touch(contact, contact.side * wall.ty, -contact.side * wall.tx)

    def touching(self, i: int, now: float) -> list[Contact]:
        count = touching(*self.arrays, i, now, self.codes)
        return [self.contact(i, code) for code in self.codes[:count].tolist()]

    def alone(self, contact: Contact, now: float) -> bool:
        return not any(
            self.bodies.held[i] or {key(other) for other in self.touching(i, now)} - {key(contact)}
            for i in contact.disks
        )

    def near(self, i: int, now: Number, sure: Sequence[Contact] = ()) -> list[tuple[Contact, int]]:
        """The contacts of disk i that touch (0) or overlap (-1) now, except those in `sure`, which
        are known to touch."""
        bodies, found = self.bodies, list[tuple[Contact, int]]()
        x, y, _, _ = bodies.state_at(i, now)
        known = {key(contact) for contact in sure}
        for contact in self.touching(i, float(now)):
            if key(contact) in known:
                continue
            if contact.kind == "body":
                (a, b), legs = sorted((contact.i, contact.j)), bodies.legs
                # a pair that is known to touch at this instant, without approach
                counts = bodies.count[a], bodies.count[b]
                at_once = legs[a].t is now or legs[b].t is now
                if at_once and bodies.separated.get((a, b)) == counts:
                    found.append((contact, 0))
                    continue
                touch, reach = self.touch(contact, now), bodies.reach(contact)
                gap = self.k.sign(touch.dx * touch.dx + touch.dy * touch.dy - reach * reach)
                within = True
            else:
                gap = self.k.sign(bodies.height(contact, x, y) - bodies.reach(contact))
                within = bodies.foot_on(contact.j, x, y)
            found += [(contact, gap)] if gap <= 0 and within else []
        return found

    def cluster(self, contacts: Sequence[Contact], now: Number) -> list[Touch]:
        """All contacts that touch now, of the disks in `contacts` and of all disks connected to
        them by contacts; only one of those of a disk on one surface, a held one if there is one."""
        done: set[int] = set()
        waiting = {contact.i for contact in contacts} | {c.j for c in contacts if c.kind == "body"}
        found = {key(contact): contact for contact in contacts}
        resting = {key(c): c for held in self.bodies.held for c in held}
        while todo := [i for i in waiting - done if i < self.scene.n and not self.scene.static[i]]:
            i = todo[0]
            found |= {name: c for name, c in resting.items() if i in c.disks}
            sure = list(found.values())
            found |= {key(contact): contact for contact, _ in self.near(i, now, sure)}
            waiting |= {j for c in found.values() if c.kind == "body" for j in (c.i, c.j)}
            done.add(i)
        once: dict[tuple[int, int], Contact] = {}
        for contact in (c for c in found.values() if c.kind == "wall"):
            place = contact.i, self.surface[contact.j][0]
            if place not in once or contact in resting.values():
                once[place] = contact
        return [
            self.touch(contact, now)
            for contact in found.values()
            if contact.kind != "wall" or contact in once.values()
        ]


def line_span(along: np.ndarray, wall: np.ndarray) -> tuple[float, float]:
    """The least and the largest coordinate, m, of a wall (2, 2) on the axis nearest to the wall
    `along`, in line with it; negative if `along` runs that way, so that they grow along it."""
    way = along[1] - along[0]
    axis = int(np.argmax(np.abs(way)))
    low, high = sorted((np.sign(way[axis]) * wall[:, axis]).tolist())
    return low, high


def points_in_line(wall: np.ndarray, points: np.ndarray) -> list[int]:
    """The points (p, 2) on the line of a wall: in rationals, of those float64 does not exclude."""
    (px, py), (qx, qy) = wall
    one, other = (qx - px) * (points[:, 1] - py), (qy - py) * (points[:, 0] - px)
    possible = np.abs(one - other) <= NOT_EXCLUDED * (np.abs(one) + np.abs(other))
    return [int(k) for k in np.flatnonzero(possible) if collinear(wall, points[k])]


def collinear(wall: np.ndarray, point: np.ndarray) -> bool:
    (px, py), (qx, qy), (x, y) = (rational(each) for each in (*wall, point))
    return (qx - px) * (y - py) == (qy - py) * (x - px)
