"""The restitution of each collision of a trajectory, read off the samples before and after it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.collisions import SAME, interval, on_faces
from crosscheck2d.scenarios.model import Array, Scene, Trajectory


class Restitutions(NamedTuple):
    values: Array  # (m,) e of each collision that was read
    spread: Array  # (m,) by how much e depends on when in its step the collision was
    times: Array  # (m,) s, the end of that step
    below: int  # how many were below the floor, or, with friction, only graze
    unfinished: int  # did not end before the next collision of a disk, or before the end of the run
    unclear: int = 0  # not alone, too slow for gravity, or not the change of one collision


# relative to the change of velocity; float32 leaves about 1e-7 of the velocity, an unreported
# collision far more
CLEAN = 1e-4
# a change of velocity must be this many times its rounding: e is then accurate to about 0.01
FLOOR = 100
TINY = 1e-300  # in place of 0 in a denominator
# of the closing speed: two that come nearer by less have stopped, e is 0 to that
STOPPED = 0.01
GRAZE = 0.1  # of the relative speed: two disks that close more slowly graze each other
# of an impulse: by so much friction's share of it may differ from what the spins say
RUBBED = 0.2
# of the velocity that gravity gives: a disk that gains less lies on something
FREE = 0.9


def effective_restitution(
    trajectory: Trajectory, scene: Scene, dt: float, slowest: float, rounding: float
) -> Restitutions:
    """Restitution of each collision that can be read off the samples.

    A collision can be read if neither disk has another in the same sample interval or the next.
    Without friction the change of velocity points along the normal n, and e = -(dv'.n) / (dv.n);
    with friction the spins tell n (`speeds_along_normal`). Two disks must also change their momenta
    by opposite amounts, and a disk at a wall must change its momentum along the wall's normal: else
    the engine did not report another collision. Collisions closing slower than `slowest` m/s are
    left out.

    The time of a collision is known to one step of `dt` s. In this time gravity changes the closing
    speed v by g dt and the separating speed by as much, so that e is known to (1 + e) g dt / v
    only. Of these values the one nearest to what the scene states is taken: an engine that is exact
    reads as exact, whenever in a step its disk meets the floor. A disk that lies on something
    before or after the collision does not fall there: its own acceleration counts, and at the last
    sample, where it is not known, both are possible.

    An engine with soft contacts takes several steps for a collision: it is read at the first sample
    at which the two no longer approach. If the bodies still approach after the impulse, they pass
    through each other and then separate; this gives e < 0. If they come no nearer although their
    velocities approach, an engine holds them by position correction alone: e = 0. A collision is
    unfinished if it does not end, if it does not end before the next collision of either disk, or
    if it ends so late that gravity matters: one that takes m sample intervals must close m times as
    fast.

    A collision is below the floor if it changes the velocities by at most `FLOOR` times their
    rounding: the normal, and so e, would be noise. The velocity that gravity adds is subtracted,
    with the same relative rounding. Engines report such collisions during a lasting contact: Box2D
    3.1 does so when a disk slides along a wall and approaches it at any speed.
    """
    t, collisions = trajectory.t, on_faces(trajectory, scene)
    slowest = max(slowest, 0.0)
    # A collision at the instant of a sample, at the end of its step, belongs to the interval that
    # ends there.
    before = np.searchsorted(t, collisions.t - SAME * interval(trajectory), side="left") - 1
    i, j = collisions.i, collisions.j
    fixed = scene.static[i]  # then the second is the disk that moves
    every = Pairs(before, np.where(fixed, j, i), np.where(fixed, i, j), collisions.t)
    count = np.zeros((len(t) + 2, scene.n), np.int64)
    disks = every.of(every.j >= 0)
    np.add.at(count, (every.k + 1, every.i), 1)
    np.add.at(count, (disks.k + 1, disks.j), 1)
    reader = Reader(trajectory, scene, rounding, count)
    within = every.of((before >= 0) & (before < len(t) - 1) & (every.i >= 0))
    k, both = within.k[:, None], within.disks
    alone = (count[k + 1, both] == 1) & (count[k + 2, both] == 0)  # in the interval and the next
    read = within.of(alone.all(axis=1))
    noise = reader.is_rounding(read)
    read = read.of(~noise)
    after, held = reader.first_apart(read)
    over = after < len(t)
    read, after, held = read.of(over), after[over], held[over]
    spin = trajectory.angular_velocity
    turned = spin[after[:, None], read.disks] - spin[read.k[:, None], read.disks]
    falls = [reader.acceleration(read, k) for k in (read.k - 1, after)]
    earlier = reader.velocities(read, read.k, falls[0])
    later = reader.velocities(read, after, falls[1])
    closing, separating, normal = speeds_along_normal(earlier, later, scene, read, turned)
    closing, separating = np.where(held > 0, [held, 0 * held], [closing, separating])
    gained, lost = (-np.vecdot(fall[:, 0] - fall[:, 1], normal) * dt for fall in falls)
    lost[held > 0] = 0.0
    # with friction: noise of a contact, or a graze, whose normal the spins do not tell well enough
    speed = laws.lengths(earlier[:, 0] - earlier[:, 1])
    grazes = np.abs(turned[:, 0]) * scene.radius[read.i] > CLEAN * speed
    grazes &= closing <= np.where(read.j < 0, STOPPED, GRAZE) * speed
    fast = (closing > np.maximum(slowest * (after - read.k), gained)) & ~grazes
    late = (closing > slowest) & ~fast & ~grazes
    lies = closing <= slowest / 5  # the weight of a disk that lies
    below, unfinished = int(noise.sum() + grazes.sum()), int((~over).sum() + late.sum())
    still = reader.velocities(read, after, 0 * falls[1])
    lying = np.vecdot(still[:, 0] - still[:, 1], normal)
    lying = np.where((after == len(t) - 1) & (held == 0), lying, separating)
    first, third = separating[fast] / closing[fast], lying[fast] / closing[fast]
    second = (separating + lost)[fast] / (closing - gained)[fast]
    least, most = (of([first, second, third], axis=0) for of in (np.min, np.max))
    return Restitutions(
        values=np.clip(scene.restitution, least, most),
        spread=most - least,
        times=read.when[fast],
        below=below,
        unfinished=unfinished,
        unclear=len(within.k) - int(fast.sum() + (lies & ~grazes).sum()) - below - unfinished,
    )


class Pairs(NamedTuple):
    """m collisions."""

    k: np.ndarray  # (m,) the last sample before each
    i: np.ndarray  # (m,) a disk
    j: np.ndarray  # (m,) a disk, or a wall (-1: the first)
    when: Array  # (m,) s

    def of(self, chosen: np.ndarray) -> Pairs:
        return Pairs(*(column[chosen] for column in self))

    @property
    def disks(self) -> np.ndarray:
        """(m, 2) both disks; the first disk twice if the other side is a wall."""
        return np.stack([self.i, np.where(self.j >= 0, self.j, self.i)], axis=1)

    def moves(self, scene: Scene) -> np.ndarray:
        """(m, 2) whether each side is a disk that moves."""
        is_disk = np.stack([self.i >= 0, self.j >= 0], axis=1)
        return np.asarray(~scene.static[self.disks] & is_disk)


@dataclass(frozen=True, eq=False)
class Reader:
    """Reads collisions off a trajectory. A sample k is (m,), one for each pair."""

    trajectory: Trajectory
    scene: Scene
    rounding: float
    # (samples + 2, n) collisions of each disk: in row k + 1 after sample k, in row 0 before them
    count: np.ndarray

    def first_apart(self, read: Pairs) -> tuple[np.ndarray, Array]:
        """(m,) the first sample after each collision at which the two do not approach, or are held;
        the number of samples if there is none before another collision of either. (m,) m/s, the
        closing speed of those that are held, else 0."""
        samples, after = len(self.trajectory), read.k + 1
        held = np.zeros(len(after))
        left = np.arange(len(after))  # the pairs that approach at every sample so far
        while len(left):
            left = left[self.approach(read.of(left), after[left])]
            held[left] = self.held_speed(read.of(left), after[left])
            left = left[held[left] == 0]
            pairs, following = read.of(left), after[left] + 1
            again = (self.count[following[:, None] + 1, pairs.disks] > 0).any(axis=1)
            after[left] = np.where(again, samples, following)
            left = left[after[left] < samples]
        return after, held

    def approach(self, pairs: Pairs, k: np.ndarray) -> np.ndarray:
        """(m,) whether the two still approach, by more than `FLOOR` roundings."""
        way, v = self.separation(pairs, k), self.velocities(pairs, k, self.falling(pairs))
        floor = FLOOR * self.rounding * laws.lengths(v).sum(axis=1)
        nearing: np.ndarray = np.vecdot(way, v[:, 0] - v[:, 1]) < -floor * laws.lengths(way)
        return nearing

    def held_speed(self, pairs: Pairs, k: np.ndarray) -> Array:
        """(m,) m/s, the closing speed of those whose velocities approach at sample k and at the
        next, but who come nearer by less than half of that, or than `STOPPED` of their closing
        speed; else 0."""
        nexts = np.minimum(k + 1, len(self.trajectory) - 1)
        gaps, speeds = [], []
        for sample in (pairs.k, k, nexts):
            way = self.separation(pairs, sample)
            v = self.velocities(pairs, sample, np.zeros((len(k), 2, 2)))
            gaps.append(laws.lengths(way))
            speeds.append(-np.vecdot(way, v[:, 0] - v[:, 1]) / np.maximum(gaps[-1], TINY))
        least = np.minimum(speeds[1], speeds[2])
        nearer = (gaps[1] - gaps[2]) / interval(self.trajectory)
        held = (nexts > k) & (least > 0) & (nearer < np.maximum(least / 2, STOPPED * speeds[0]))
        return np.where(held, np.maximum(speeds[0], 0.0), 0.0)

    def separation(self, pairs: Pairs, k: np.ndarray) -> Array:
        """(m, 2) m, from the second of each pair to the first."""
        x, other = np.moveaxis(self.trajectory.position[k[:, None], pairs.disks], 1, 0)
        for wall in np.unique(pairs.j[pairs.j < 0]):
            at = pairs.j == wall
            other[at] = laws.nearest_on_segment(x[at], *self.scene.walls[-1 - wall])
        return laws.nearer_way(x - other, self.scene)

    def velocities(self, pairs: Pairs, k: np.ndarray, fall: Array) -> Array:
        """(m, 2, 2) m/s of both sides of each pair, carried by `fall` (m, 2, 2) m/s2 from sample k
        to the time of their collision; 0 for a wall."""
        v: Array = self.trajectory.velocity[k[:, None], pairs.disks]
        v[pairs.j < 0, 1] = 0.0
        carried: Array = v + fall * (pairs.when - self.trajectory.t[k])[:, None, None]
        return carried

    def falling(self, pairs: Pairs) -> Array:
        """(m, 2, 2) m/s2, the acceleration by gravity of both sides of each pair."""
        return np.where(pairs.moves(self.scene)[..., None], self.scene.gravity, 0.0)

    def acceleration(self, pairs: Pairs, k: np.ndarray) -> Array:
        """(m, 2, 2) m/s2 of both sides of each pair between sample k and the next: gravity, or what
        the samples say of a disk that gains less than `FREE` of it and has no collision there."""
        fall, inside = self.falling(pairs), (k >= 0) & (k + 1 < len(self.trajectory))
        k, disks = np.where(inside, k, 0)[:, None], pairs.disks
        change = self.trajectory.velocity[k + 1, disks] - self.trajectory.velocity[k, disks]
        gained = change / interval(self.trajectory)
        lies = inside[:, None] & (laws.lengths(gained) < FREE * laws.lengths(fall))
        lies &= self.count[k + 1, disks] == 0
        return np.where(lies[..., None], gained, fall)

    def is_rounding(self, pairs: Pairs) -> np.ndarray:
        """(m,) whether the change of velocity of a moving disk, or of the relative velocity, is
        below the floor."""
        fall, moves = self.falling(pairs), pairs.moves(self.scene)
        earlier, later = (self.velocities(pairs, k, fall) for k in (pairs.k, pairs.k + 1))
        change = np.where(moves[..., None], later - earlier, 0.0)
        speed = np.where(moves, laws.lengths(earlier) + laws.lengths(later), 0.0)
        floor, between = FLOOR * self.rounding, laws.lengths(change[:, 0] - change[:, 1])
        alone = (moves & (laws.lengths(change) <= floor * speed)).any(axis=1)
        below: np.ndarray = alone | (between <= floor * speed.sum(axis=1))
        return below


def speeds_along_normal(
    earlier: Array, later: Array, scene: Scene, pairs: Pairs, turned: Array
) -> tuple[Array, Array, Array]:
    """(m,) m/s, closing speed before and separating speed after each collision, and (m, 2) the
    normal; `turned` (m, 2) rad/s is the change of spin of both sides.

    The normal is the direction of the change of their relative velocity, whichever of the two is
    named first. Friction adds an impulse J along the tangent, which turns both disks by -J r / I,
    so that the spins tell the angle; a wall's normal is known. The speeds are nan if the change is
    not that of one collision.
    """
    moves, wall, disks = pairs.moves(scene), pairs.j < 0, pairs.disks
    change = np.where(moves[..., None], later - earlier, 0.0)
    turned = np.where(moves, turned, 0.0)
    slid = (np.abs(turned) * scene.radius[disks] > CLEAN * laws.lengths(change)).any(axis=1)
    kicks = laws.moving_mass(scene)[disks][..., None] * change
    size, strongest = laws.lengths(kicks[:, 0]), laws.lengths(kicks).max(axis=1)
    strange = moves[:, 1] & (laws.lengths(kicks.sum(axis=1)) > CLEAN * strongest)
    rubs = -turned * laws.moving_inertia(scene)[disks] / scene.radius[disks]
    rub = np.where(rubs[:, 0] == 0.0, rubs[:, 1], rubs[:, 0])
    strange |= slid & (np.abs(rub) >= size)
    strange |= slid & (rubs != 0.0).all(axis=1) & (np.abs(np.diff(rubs)[:, 0]) > RUBBED * size)
    between = change[:, 0] - change[:, 1]
    ahead = between / np.maximum(np.sqrt(np.vecdot(between, between)), TINY)[:, None]
    sine = np.where(slid & ~strange, rub / np.maximum(size, TINY), 0.0)[:, None]
    normal = np.sqrt(1 - sine**2) * ahead + sine * np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    span = np.diff(scene.walls[-1 - pairs.j[wall]], axis=1)[:, 0]
    across = np.stack([-span[:, 1], span[:, 0]], axis=1) / laws.lengths(span)[:, None]
    # friction changes velocity and spin by the same impulse; else the disk met something else, too
    tilt = np.abs(laws.cross(across, normal[wall]))
    strange[wall] |= tilt > np.where(slid[wall], RUBBED, CLEAN)
    across *= np.sign(np.vecdot(across, normal[wall]))[:, None]
    normal[wall] = np.where(slid[wall, None], across, normal[wall])
    closing, separating = (
        sign * np.vecdot(v[:, 0] - v[:, 1], normal) for sign, v in ((-1, earlier), (1, later))
    )
    return np.where(strange, np.nan, closing), np.where(strange, np.nan, separating), normal
