"""The exact motion of hard disks, written from the definitions alone: event-driven, in 420 bits.

A disk flies on a parabola until something happens. To know what happens first, every disk is asked
of every other disk, of both faces and both ends of every wall, and of every edge of the wrapping
box when it would get there; the earliest wins, and after it all are asked again. Nothing is
remembered and nothing is sorted, so that there is nothing to get wrong but the physics. All of that
is the first root of a polynomial in the time from now.

It takes from the project the scene, and nothing else. It has no rule for contacts that last, nor
for several collisions at one instant: see `Stop`.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import gmpy2
from gmpy2 import mpc, mpfr

from crosscheck2d.scenarios.model import Scenario, Scene, Thrust

BITS = 420
TINY = mpfr(2) ** -380  # s: two times that are closer are the same; 420 bits hold 10 s to 2 ** -416
OVERLAP = mpfr(2) ** -300  # m2: a gap below minus that is an overlap and no rounding of 420 bits
# s between two collisions of a pair: they follow each other ever faster, and never end
ACCUMULATION = 1e-9

Number = mpfr
Vector = mpc  # x + i y
Polynomial = list[Number]  # constant first


class Stop(Exception):
    """Why the motion is not followed any further from here."""


class Disk(NamedTuple):
    """Where a disk is and how it moves: m, m/s, m/s2; `radius` m, `weight` 1/kg (0: static)."""

    x: Vector
    v: Vector
    a: Vector
    radius: Number = mpfr(0)
    weight: Number = mpfr(0)


class Event(NamedTuple):
    """A collision at `t` s of disk `i` with disk `j`, or wall -1 - j: N s, and |v_n| / |v| of the
    approach."""

    t: Number
    i: int
    j: int
    impulse: Number
    cosine: Number


class Found(NamedTuple):
    """What comes first: `after` s from now disk `i` meets disk or wall `j` at `other`, or is
    `wrapped` to there."""

    after: Number
    i: int = -1
    j: int = -1
    other: Disk | None = None
    wrapped: Vector | None = None


class Wall(NamedTuple):
    """A segment, m; `length` m along it, and the directions in which its two faces look."""

    start: Vector
    end: Vector
    length: Number
    faces: tuple[Vector, Vector]


def dot(p: Vector, q: Vector) -> Number:
    return p.real * q.real + p.imag * q.imag


def exact(p: Sequence[float]) -> Vector:
    return mpc(mpfr(float(p[0])), mpfr(float(p[1])))


def value(p: Polynomial, t: Number) -> Number:
    total = mpfr(0)
    for c in reversed(p):
        total = total * t + c
    return total


def derivative(p: Polynomial) -> Polynomial:
    return [c * k for k, c in enumerate(p)][1:]


def marks(p: Polynomial, until: Number) -> list[Number]:
    """0, the turning points of p, `until`: between two of them p only rises or only falls."""
    while len(p) > 1 and p[-1] == 0:
        p = p[:-1]
    if len(p) <= 2:
        return [mpfr(0), until]
    slope = derivative(p)
    pieces = [
        (a, b)
        for a, b in pairwise(marks(slope, until))
        if (value(slope, a) > 0) != (value(slope, b) > 0)
    ]
    turns = [root(slope, a, b) for a, b in pieces]
    return [mpfr(0), *turns, until]


def root(p: Polynomial, low: Number, high: Number) -> Number:
    """Where p, of opposite signs at both and monotone between, is 0: Newton's steps, or halves
    where they leave."""
    slope, rising, t = derivative(p), value(p, high) > 0, (low + high) / 2
    while True:
        here, steepness = value(p, t), value(slope, t)
        low, high = (low, t) if (here > 0) == rising else (t, high)
        better = t - here / steepness if steepness else low
        # first: a last step of a rounding may leave the interval, whose middle is far from the root
        if steepness and abs(better - t) < TINY:
            return better
        if not low < better < high:
            better = (low + high) / 2
            if abs(better - t) < TINY:
                return better
        t = better


def first_fall(p: Polynomial, until: Number) -> Number | None:
    lowest, power = p[0], until
    for c in p[1:]:
        lowest, power = lowest - abs(c) * power, power * until
    if lowest > 0:  # it cannot get there
        return None
    for low, high in pairwise(marks(p, until)):
        if value(p, low) > 0 >= value(p, high):
            return root(p, low, high)
    return None


def distance_squared(p: Disk, q: Disk) -> Polynomial:
    """|x + v t + a t2 / 2|2 - (r + r)2 of two disks: above 0 while they are apart."""
    x, v, a, reach = q.x - p.x, q.v - p.v, q.a - p.a, p.radius + q.radius
    return [
        dot(x, x) - reach * reach,
        2 * dot(x, v),
        dot(v, v) + dot(x, a),
        dot(v, a),
        dot(a, a) / 4,
    ]


def height(p: Disk, point: Vector, normal: Vector, least: Number) -> Polynomial:
    return [dot(p.x - point, normal) - least, dot(p.v, normal), dot(p.a, normal) / 2]


def flown(p: Disk, t: Number) -> Disk:
    return p._replace(x=p.x + p.v * t + p.a * (t * t / 2), v=p.v + p.a * t)


def walls_of(scene: Scene) -> list[Wall]:
    walls = []
    for start, end in ((exact(start), exact(end)) for start, end in scene.walls):
        along = end - start
        length = gmpy2.sqrt(dot(along, along))
        faces = mpc(0, 1) * along / length, mpc(0, -1) * along / length
        walls.append(Wall(start, end, length, faces))
    return walls


def first(disks: Sequence[Disk], scene: Scene, walls: Sequence[Wall], until: Number) -> Found:
    """What happens first within `until` s, if anything does."""
    best = Found(until)
    for i, p in enumerate(disks):
        for j, q in enumerate(disks[i + 1 :], i + 1):
            if p.weight or q.weight:
                gap = distance_squared(p, q)
                if gap[0] < -OVERLAP:
                    raise Stop(f"disks {i} and {j} overlap")
                if (t := first_fall(gap, best.after)) is not None:
                    best = Found(t, i, j, q)
        if p.weight:
            for w, wall in enumerate(walls):
                for t, point in wall_contacts(p, wall, best.after):
                    if t < best.after:
                        best = Found(t, i, -1 - w, Disk(point, mpc(0), mpc(0)))
            if scene.wrap is not None:
                for inward, edge, opposite in edges(*scene.wrap):
                    if (t := first_fall(height(p, edge, inward, mpfr(0)), best.after)) is not None:
                        best = Found(t, i, wrapped=opposite - edge)
    return best


def wall_contacts(p: Disk, wall: Wall, until: Number) -> Iterator[tuple[Number, Vector]]:
    """When a disk first touches each face and each end of a wall, and the point of the wall that it
    touches."""
    along = wall.end - wall.start
    for normal in wall.faces:
        if (t := first_fall(height(p, wall.start, normal, p.radius), until)) is not None:
            share = dot(flown(p, t).x - wall.start, along) / (wall.length * wall.length)
            if 0 <= share <= 1:
                yield t, wall.start + along * share
    for point in (wall.start, wall.end):
        if (t := first_fall(distance_squared(p, Disk(point, mpc(0), mpc(0))), until)) is not None:
            yield t, point


def edges(low: Sequence[float], high: Sequence[float]) -> Iterator[tuple[Vector, Vector, Vector]]:
    """Of each edge of the wrapping box: the way in, a point on it, and the point across from
    that."""
    (left, bottom), (right, top) = low, high
    yield mpc(1, 0), exact((left, 0)), exact((right, 0))
    yield mpc(-1, 0), exact((right, 0)), exact((left, 0))
    yield mpc(0, 1), exact((0, bottom)), exact((0, top))
    yield mpc(0, -1), exact((0, top)), exact((0, bottom))


class Motion:
    """The motion of a scenario, up to `end` s, where it is `reason` that stops it; "" at the end of
    the scenario.

    `events` in order of time; `at(t)` the disks at any time before the end. `nudge` moves the start
    of each disk by (dx, dv), m and m/s.
    """

    def __init__(
        self, scenario: Scenario, most: int, nudge: Sequence[tuple[Vector, Vector]] = ()
    ) -> None:
        self.events: list[Event] = []
        # when `disks` became what `states` says, each on a flight of its own from there
        self.times: list[Number] = []
        self.states: list[list[Disk]] = []
        self.reason = ""
        with gmpy2.context(precision=BITS):
            self.now = mpfr(0)
            try:
                self.follow(scenario, most, nudge or [(mpc(0), mpc(0))] * scenario.scene.n)
            except Stop as stop:
                self.reason = str(stop)
        self.end = self.now

    def follow(self, scenario: Scenario, most: int, nudge: Sequence[tuple[Vector, Vector]]) -> None:
        scene, stop = scenario.scene, mpfr(scenario.duration)
        walls = walls_of(scene)
        sizes = [(mpfr(float(r)), 1 / mpfr(float(m))) for r, m in zip(scene.radius, scene.mass)]
        starts = zip(scene.position, scene.velocity, nudge, sizes)
        disks = [
            Disk(exact(x) + dx, exact(v) + dv, mpc(0), *size) for x, v, (dx, dv), size in starts
        ]
        breaks = {
            mpfr(t)
            for thrust in scenario.thrusts
            for t in (thrust.start, thrust.stop)
            if 0 < t < stop
        }
        for until in (*sorted(breaks), stop):
            accelerations = [
                acceleration(scene, scenario.thrusts, i, self.now) for i in range(scene.n)
            ]
            disks = [disk._replace(a=a) for disk, a in zip(disks, accelerations)]
            while self.now < until:
                self.times.append(self.now)
                self.states.append(disks)
                found = first(disks, scene, walls, until - self.now)
                disks = [flown(disk, found.after) for disk in disks]
                self.now = self.now + found.after if found.i >= 0 else until
                if found.wrapped is not None:
                    disks[found.i] = disks[found.i]._replace(x=disks[found.i].x + found.wrapped)
                elif found.i >= 0:
                    self.collide(disks, found, mpfr(scene.restitution))
                    if len(self.events) == most:
                        raise Stop("enough events")

    def collide(self, disks: list[Disk], found: Found, restitution: Number) -> None:
        i, j, p = found.i, found.j, disks[found.i]
        q = disks[j] if j >= 0 else found.other
        assert q is not None
        x, v = q.x - p.x, q.v - p.v
        normal = x / gmpy2.sqrt(dot(x, x))
        closing = -dot(v, normal)
        impulse = (1 + restitution) * closing / (p.weight + q.weight)
        disks[i] = p._replace(v=p.v - normal * (impulse * p.weight))
        if j >= 0:
            disks[j] = q._replace(v=q.v + normal * (impulse * q.weight))
        if any((e.i, e.j) == (i, j) and self.now - e.t < ACCUMULATION for e in self.events):
            raise Stop("accumulation")
        self.events.append(Event(self.now, i, j, impulse, closing / gmpy2.sqrt(dot(v, v))))

    def at(self, t: float) -> list[Disk]:
        with gmpy2.context(precision=BITS):
            k = bisect_right(self.times, mpfr(t)) - 1
            return [flown(disk, mpfr(t) - self.times[k]) for disk in self.states[k]]


def acceleration(scene: Scene, thrusts: Sequence[Thrust], i: int, now: Number) -> Vector:
    if scene.static[i]:
        return mpc(0)
    assert all(thrust.frame == "world" for thrust in thrusts)
    on = [
        thrust
        for thrust in thrusts
        if thrust.disk == i and mpfr(thrust.start) <= now < mpfr(thrust.stop)
    ]
    return sum(
        (exact(thrust.force) / mpfr(float(scene.mass[i])) for thrust in on), exact(scene.gravity)
    )
