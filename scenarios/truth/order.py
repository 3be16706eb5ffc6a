"""Up to when float64 can follow an exact motion: until a disk diverges (`horizon.py`), or until the
rounding of the initial state decides the order of collisions.

Two collisions that share a disk, directly or through a chain of contacts, may follow each other
within the deviation of their times. A start that is rounded otherwise then exchanges them. Where
the other order gives other velocities, no float64 solver can know the motion from then on: it is as
with disks that touch, in which the order of collisions matters. The derivative does not show it,
because it is that of one order.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crosscheck2d.scenarios.model import Array, Scenario
from crosscheck2d.scenarios.truth.horizon import DIVERGED, EPS, TangentVectors
from crosscheck2d.scenarios.truth.oracle.bodies import Bodies
from crosscheck2d.scenarios.truth.oracle.numbers import mpfr
from crosscheck2d.scenarios.truth.oracle.path import Event, Path
from crosscheck2d.scenarios.truth.oracle.ties import (
    ENDLESS,
    TOO_MANY,
    Contact,
    TieOutcome,
    Touch,
    Velocities,
)

DEVIATIONS = 4  # a gap is within the rounding below so many of its deviations: 1 start in 16000 not
CLOSE = 1e-6  # radii of the smallest disk; no deviation is as large before a disk diverges
# The numbers in which all orders are tried. Walls that are perpendicular but for a rounding change
# a velocity by 1e-17: that must be far above the tie.
BITS = 512


def float64_horizon(scenario: Scenario, path: Path) -> tuple[float, Path]:
    """s, the time at which the first disk diverges along `path`, see `DIVERGED`; inf: none does.
    And the path, cut where rounding decides the order of collisions before that.

    Contacts that last stay closed: a disk that rests on a wall, or on another disk, has no
    deviation along the normal.
    """
    tangents = TangentVectors(scenario, path)
    order = CollisionOrder(scenario, path, tangents)
    end = min(path.end, scenario.duration)
    for event in path.events:
        t = float(event.t)
        if t >= min(end, tangents.diverged):
            break
        if not float(event.impulse):  # a contact begins
            continue
        if t > tangents.instant and (cut := order.cut(event)) and t < tangents.diverged:
            return tangents.diverged, cut
        tangents.collide(event)
    for i in tangents.moving:
        tangents.carry(i, min(end, tangents.diverged))
    return tangents.diverged, path


class Near(NamedTuple):
    """A contact whose gap is within the rounding: the direction (2,) m from its disk to the other
    side, and the speed, m/s, at which the two approach each other."""

    contact: Contact
    way: Array
    closing: float


class CollisionOrder:
    """Whether rounding decides the order of the collisions of a path, from its `tangents`."""

    def __init__(self, scenario: Scenario, path: Path, tangents: TangentVectors) -> None:
        self.scene, self.path, self.tangents = scenario.scene, path, tangents
        self.end = min(path.end, scenario.duration)
        # (l, 8) t s, disk, x, y m, vx, vy m/s, ax, ay m/s2, sorted by time
        rows = [
            # A thrust that turns with its disk ends before the disk touches anything.
            [*map(float, (leg.t, i, *((np.nan,) * 6 if leg.jet else leg[1:7])))]
            for i, legs in enumerate(path.legs)
            for leg in legs
        ]
        self.legs = np.array(sorted(rows, key=lambda row: row[0]))
        # how many of the legs have begun, and (n, 8) the latest of these of each disk
        self.begun, self.now = 0, np.zeros((self.scene.n, 8))
        self.span = self.scene.walls[:, 1] - self.scene.walls[:, 0]
        # 1/m; the share of the wall at which the foot of a vector lies
        self.way = self.span / (self.span**2).sum(axis=1)[:, None]

    def cut(self, event: Event) -> Path | None:
        """The path up to a collision, the first one of its instant, if rounding decides which other
        ones come before it, and the velocities after them depend on that; else None."""
        t, near = float(event.t), self.contacts(event)
        fastest = max((one.closing for one in near), default=0.0)
        if fastest * (self.end - t) <= DIVERGED * self.scene.radius.min():
            return None
        ends, named = self.outcomes(near, t)
        if len(ends) == 1 and ends[0].velocities:
            return None
        disks = sorted({i for one in near for i in one.contact.disks})
        which = f"the outcome depends on it ({len(ends)} outcomes)"
        if ends[-1].unresolved:
            which = {
                ENDLESS: "they do not end",
                TOO_MANY: "the outcome may depend on it (more orders than can be tried)",
            }[ends[-1].unresolved]
        reason = (
            f"rounding decides the order of the collisions of disk{'s' * (len(disks) > 1)}"
            f" {', '.join(map(str, disks))}, and {which} at t = {t:.9g} s"
        )
        known = [end for end in ends if end.velocities]
        return replace(
            self.path, end=t, reason=reason, disks=disks, outcomes=known, named=named[: len(known)]
        )

    def contacts(self, event: Event) -> list[Near]:
        """The contact of a collision, here with speed 0, and those within the rounding of it that
        are connected to it by disks; none if it is the only one."""
        t, own = float(event.t), {event.i, event.j}
        # Each disk is put on its latest leg that begins before.
        while self.begun < len(self.legs) and (row := self.legs[self.begun])[0] < t:
            self.now[int(row[1])] = row
            self.begun += 1
        waiting, done, found = [i for i in own if i >= 0], set[int](), list[Near]()
        if not any(own - {i, j} or j not in own for i in waiting for j in self.close(i, t)):
            return []
        one = self.tangents.body(event.i, t)
        late = self.tangents.delay(event, one, self.tangents.other(event, one)[0])
        while waiting:
            if (i := waiting.pop()) in done or self.scene.static[i]:
                continue
            for j in self.close(i, t):
                if j not in done and (near := self.near(i, j, t, late)):
                    found.append(near._replace(closing=0.0) if {i, j} == own else near)
                    waiting += [j] * (j >= 0)
            done.add(i)
        return found

    def close(self, i: int, t: float) -> list[int]:
        """The disks, and -1 - wall, whose gap to disk i is at most `CLOSE` at `t` s."""
        scene, since = self.scene, (t - self.now[:, 0])[:, None]
        x = self.now[:, 2:4] + (self.now[:, 4:6] + self.now[:, 6:8] * since / 2) * since
        most = CLOSE * scene.radius.min() + scene.radius[i]
        disks = np.flatnonzero(np.hypot(*(x - x[i]).T) <= most + scene.radius)
        away = x[i] - scene.walls[:, 0]
        share = np.minimum(np.maximum((away * self.way).sum(axis=1), 0.0), 1.0)
        walls = np.flatnonzero(np.hypot(*(away - share[:, None] * self.span).T) <= most)
        return [j for j in disks.tolist() if j != i] + [-1 - w for w in walls.tolist()]

    def near(self, i: int, j: int, t: float, late: Array) -> Near | None:
        """The contact of disk i with disk j, or with wall -1 - j at its point nearest to the disk,
        if its gap at `t` s is within the rounding; else None.

        late: (d,) s, the delay of the collision at `t` for each deviation. Until then both fly on.
        """
        nothing, tangents, radius = 0.0, self.tangents, self.scene.radius
        one = tangents.body(i, t)
        two, _ = tangents.other(Event(t, i, j, nothing, nothing), one)
        way = two.x - one.x
        distance = float(np.hypot(*way))
        normal, reach = way / distance, radius[i] + (radius[j] if j >= 0 else 0.0)
        closing = -float((two.v - one.v) @ normal)
        deviation = np.sqrt((((two.dx - one.dx) @ normal - closing * late) ** 2).sum())
        rounding = EPS * np.abs(self.scene.position).max()  # of the path itself in float64
        if abs(distance - reach) > DEVIATIONS * max(deviation, rounding):
            return None
        for held in (c for k in {i, max(i, j)} for c in self.held(k)):
            if {held.i, held.j if held.kind == "body" else -1 - held.j} == {i, j}:
                return Near(held, way if held.i == i else -way, 0.0)
        contact = Contact("body", i, j) if j >= 0 else Contact("wall", i, -1 - j)
        return Near(contact, way, max(closing, 0.0))

    def held(self, i: int) -> tuple[Contact, ...]:
        return self.path.legs[i][self.tangents.leg[i]].held

    def outcomes(
        self, near: list[Near], t: float
    ) -> tuple[list[TieOutcome], list[list[tuple[int, int]]]]:
        """Over all orders; without those from which no disk diverges until the end. And
        `Path.named`."""
        k, scene = mpfr(BITS), self.scene
        with k.precise():
            bodies, v, ends = Bodies(scene, k), Velocities(), list[TieOutcome]()
            for i in {i for one in near for i in one.contact.disks}:
                body = self.tangents.body(i, t)
                v[i] = k.exact(float(body.v[0])), k.exact(float(body.v[1])), k.exact(body.spin)
            touches = [Touch(one.contact, *map(k.exact, one.way.tolist())) for one in near]
            held = frozenset(c for i in v for c in self.held(i))
            for end in bodies.law.outcomes(touches, v, held, bodies.stays_still)[0]:
                if not any(self.alike(end.velocities, other.velocities, t) for other in ends):
                    ends.append(end)
            named = [[bodies.pair(each.contact) for each in end.collisions] for end in ends]
        return ends, named

    def alike(self, one: Velocities, other: Velocities, t: float) -> bool:
        """Whether no disk diverges from `t` s to the end by the difference of these velocities."""
        return one.keys() == other.keys() and all(
            abs(float(a - b)) * (self.end - t) <= DIVERGED * self.scene.radius[i]
            for i in one
            for a, b in zip(one[i][:2], other[i][:2])
        )
