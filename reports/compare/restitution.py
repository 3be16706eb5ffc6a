"""The restitution of each collision of a trajectory, read off the samples before and after it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reports.compare import laws
from reports.compare.faces import SAME, interval, on_faces
from scenarios.model import Array, Scene, Trajectory


class Restitutions(NamedTuple):
    """What was read off the samples.

    Attributes:
        values: (m,) e of each collision that was read.
        spread: (m,) by how much e depends on when in its step the collision was.
        times: (m,) s, the end of that step.
        below: how many were below the floor.
        unfinished: how many did not end before the next collision of a disk, or before the end of
            the run.
    """

    values: Array
    spread: Array
    times: Array
    below: int
    unfinished: int


# relative to the change of velocity; float32 leaves about 1e-7 of the velocity, an unreported
# collision far more
CLEAN = 1e-4
# a change of velocity must be this many times its rounding: e is then accurate to about 0.01
FLOOR = 100


def effective_restitution(
    trajectory: Trajectory, scene: Scene, dt: float, slowest: float, rounding: float
) -> Restitutions:
    """Restitution of each collision that can be read off the samples.

    A collision can be read if neither disk has another in the same sample interval or the next, and
    neither changes its spin (friction): then the change of velocity points along the normal n, and
    e = -(dv'.n) / (dv.n). Two disks must also change their momenta by opposite amounts, and a disk
    at a wall must change its momentum along the wall's normal: else the engine did not report
    another collision. Collisions closing slower than `slowest` m/s are left out.

    The time of a collision is known to one step of `dt` s. In this time gravity changes the closing
    speed v by g dt and the separating speed by as much, so that e is known to (1 + e) g dt / v
    only. Of these values the one nearest to what the scene states is taken: an engine that is exact
    reads as exact, whenever in a step its disk meets the floor.

    An engine with soft contacts takes several steps for a collision: it is read at the first sample
    at which the two no longer approach. If the bodies still approach after the impulse, they pass
    through each other and then separate; this gives e < 0. A collision is unfinished if it does not
    end, if it does not end before the next collision of either disk, or if it ends so late that
    gravity matters: one that takes m sample intervals must close m times as fast.

    A collision is below the floor if it changes the velocities by at most `FLOOR` times their
    rounding: the normal, and so e, would be noise. The velocity that gravity adds is subtracted,
    with the same relative rounding. Engines report such collisions during a lasting contact: Box2D
    3.1 does so when a disk slides along a wall and approaches it at any speed.
    """
    t, spin, collisions = trajectory.t, trajectory.angular_velocity, on_faces(trajectory, scene)
    slowest = max(slowest, 0.0)
    # A collision at the instant of a sample, at the end of its step, belongs to the interval that
    # ends there.
    before = np.searchsorted(t, collisions.t - SAME * interval(trajectory), side="left") - 1
    every = Pairs(before, collisions.i, collisions.j, collisions.t)
    count = in_intervals(every, len(t), scene.n)
    read = every.of((before >= 0) & (before < len(t) - 1) & ~scene.static[every.i])
    read = read.of(is_alone(read, count))
    noise = is_rounding(trajectory, scene, read, rounding)
    read = read.of(~noise)
    after = first_apart(trajectory, scene, read, count, rounding)
    over = after < len(t)
    read, after = read.of(over), after[over]
    turned = np.abs(spin[after] - spin[read.k]) * scene.radius
    closing, separating, gained = speeds_along_normal(
        velocities(trajectory, scene, read, read.k),
        velocities(trajectory, scene, read, after),
        scene,
        read,
        turned,
    )
    gained *= dt
    fast = closing > np.maximum(slowest * (after - read.k), gained)
    late = (closing > slowest) & ~fast
    closing, separating, gained = closing[fast], separating[fast], gained[fast]
    ends = np.stack([separating / closing, (separating + gained) / (closing - gained)])
    return Restitutions(
        values=np.clip(scene.restitution, ends.min(axis=0), ends.max(axis=0)),
        spread=np.ptp(ends, axis=0),
        times=read.when[fast],
        below=int(noise.sum()),
        unfinished=int((~over).sum() + late.sum()),
    )


class Pairs(NamedTuple):
    """m collisions.

    Attributes:
        k: (m,) the last sample before each.
        i: (m,) a disk.
        j: (m,) a disk, or a wall (-1: the first).
        when: (m,) s.
    """

    k: np.ndarray
    i: np.ndarray
    j: np.ndarray
    when: Array

    def of(self, chosen: np.ndarray) -> Pairs:
        """Those that a mask or indices choose."""
        return Pairs(*(column[chosen] for column in self))

    @property
    def other(self) -> np.ndarray:
        """(m,) the second disk; the first disk again if the other side is a wall."""
        return np.where(self.j >= 0, self.j, self.i)


def in_intervals(every: Pairs, samples: int, n: int) -> np.ndarray:
    """(samples + 2, n) number of collisions of each disk: in row k + 1 after sample k, in row 0
    before the first sample."""
    count = np.zeros((samples + 2, n), np.int64)
    np.add.at(count, (every.k + 1, every.i), 1)
    disks = every.of(every.j >= 0)
    np.add.at(count, (disks.k + 1, disks.j), 1)
    return count


def is_alone(read: Pairs, count: np.ndarray) -> np.ndarray:
    """(m,) whether neither disk has another collision in the same interval or the next."""
    one, two = (
        (count[read.k + 1, disk] == 1) & (count[read.k + 2, disk] == 0)
        for disk in (read.i, read.other)
    )
    alone: np.ndarray = one & two
    return alone


def first_apart(
    trajectory: Trajectory, scene: Scene, read: Pairs, count: np.ndarray, rounding: float
) -> np.ndarray:
    """(m,) the first sample after each collision at which the two do not approach; the number of
    samples if there is none before another collision of either."""
    samples, after = len(trajectory), read.k + 1
    left = np.arange(len(after))  # the pairs that approach at every sample so far
    while len(left):
        left = left[approach(trajectory, scene, read.of(left), after[left], rounding)]
        pairs, following = read.of(left), after[left] + 1
        again = (count[following + 1, pairs.i] > 0) | (count[following + 1, pairs.other] > 0)
        after[left] = np.where(again, samples, following)
        left = left[after[left] < samples]
    return after


def approach(
    trajectory: Trajectory, scene: Scene, pairs: Pairs, k: np.ndarray, rounding: float
) -> np.ndarray:
    """(m,) whether the two of each pair still approach in sample k, (m,), by more than `FLOOR`
    roundings."""
    x, other = (trajectory.position[k, disk] for disk in (pairs.i, pairs.other))
    for wall in np.unique(pairs.j[pairs.j < 0]):
        at = pairs.j == wall
        other[at] = laws.nearest_on_segment(x[at], *scene.walls[-1 - wall])
    way = laws.nearer_way(x - other, scene)
    v = velocities(trajectory, scene, pairs, k)
    floor = FLOOR * rounding * laws.lengths(v).sum(axis=1)
    nearing: np.ndarray = np.vecdot(way, v[:, 0] - v[:, 1]) < -floor * laws.lengths(way)
    return nearing


def velocities(trajectory: Trajectory, scene: Scene, pairs: Pairs, k: np.ndarray) -> Array:
    """(m, 2, 2) m/s of both sides of each pair, carried by gravity from sample k, (m,), to the time
    of their collision; 0 for a wall."""
    disks = np.stack([pairs.i, pairs.other], axis=1)
    v: Array = trajectory.velocity[k[:, None], disks]
    v[pairs.j < 0, 1] = 0.0
    carried: Array = v + falling(scene, pairs) * (pairs.when - trajectory.t[k])[:, None, None]
    return carried


def falling(scene: Scene, pairs: Pairs) -> Array:
    """(m, 2, 2) m/s2, the acceleration by gravity of both sides of each pair."""
    moving = np.stack([~scene.static[pairs.i], second_moves(scene, pairs)], axis=1)
    return np.where(moving[..., None], scene.gravity, 0.0)


def is_rounding(trajectory: Trajectory, scene: Scene, read: Pairs, rounding: float) -> np.ndarray:
    """(m,) whether the change of velocity of a moving disk, or of the relative velocity, is below
    the floor."""
    earlier, later = (velocities(trajectory, scene, read, k) for k in (read.k, read.k + 1))
    moving = np.stack([np.ones(len(read.k), bool), second_moves(scene, read)], axis=1)
    change = np.where(moving[..., None], later - earlier, 0.0)
    speed = np.where(moving, laws.lengths(earlier) + laws.lengths(later), 0.0)
    floor, between = FLOOR * rounding, laws.lengths(change[:, 0] - change[:, 1])
    alone = (moving & (laws.lengths(change) <= floor * speed)).any(axis=1)
    below: np.ndarray = alone | (between <= floor * speed.sum(axis=1))
    return below


def second_moves(scene: Scene, pairs: Pairs) -> np.ndarray:
    """(m,) whether the second of each pair is a disk that moves."""
    moving: np.ndarray = (pairs.j >= 0) & ~scene.static[pairs.other]
    return moving


def speeds_along_normal(
    earlier: Array, later: Array, scene: Scene, pairs: Pairs, turned: Array
) -> tuple[Array, Array, Array]:
    """(m,) m/s, closing speed before and separating speed after each collision, and m/s2, what
    gravity adds to the first and takes from the second; `turned` (m, n) m/s by friction.

    The normal is the direction of the change of their relative velocity, whichever of the two is
    named first. The speeds are nan if the change is not that of one frictionless collision.
    """
    number, both, wall = np.arange(len(pairs.k)), second_moves(scene, pairs), pairs.j < 0
    change = later - earlier
    one, two = change[:, 0], change[:, 1]
    slid = turned[number, pairs.i] > CLEAN * laws.lengths(one)
    slid |= both & (turned[number, pairs.other] > CLEAN * laws.lengths(two))
    mass = laws.moving_mass(scene)
    kicks = mass[pairs.i, None] * one, mass[pairs.other, None] * two
    strongest = np.maximum(*map(laws.lengths, kicks))
    unreported = both & (laws.lengths(kicks[0] + kicks[1]) > CLEAN * strongest)
    span = np.diff(scene.walls[-1 - pairs.j[wall]], axis=1)[:, 0]
    slack = CLEAN * laws.lengths(span) * laws.lengths(one[wall])
    unreported[wall] = np.abs(np.vecdot(one[wall], span)) > slack
    between = one - two
    length = np.sqrt(np.vecdot(between, between))
    normal = between / np.where(length == 0.0, 1.0, length)[:, None]
    closing, separating = (
        sign * np.vecdot(v[:, 0] - v[:, 1], normal) for sign, v in ((-1, earlier), (1, later))
    )
    strange = unreported | slid
    fall = falling(scene, pairs)
    gained = -np.vecdot(fall[:, 0] - fall[:, 1], normal)
    return np.where(strange, np.nan, closing), np.where(strange, np.nan, separating), gained
