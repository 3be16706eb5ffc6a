"""The collisions of a run: which of them a disk can tell apart, which of the truth's they are, and
which are missed or spurious; with the delays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from crosscheck2d.reports.compare import laws
from crosscheck2d.scenarios.model import Array, Collisions, Scene, Trajectory, frozen

# Times of collisions are often whole or half multiples of dt. A bound that is such a multiple would
# leave the decision to rounding, so the bounds are irrational.
WINDOW = 10**0.5
"""dt by which a collision may be late or early: 3.2 steps. Collisions and samples often lie on the
grid of the steps: no multiple of dt, or of a fraction of it, falls on the edge."""
# dt; no step tells two true collisions of a pair apart that are closer
CROWDED = 5**0.5
FAR = 401**0.5  # dt; a match may always be this late or early
# of the time to the nearest other true collision; a match may be this late or early, too
HALF = 0.26**0.5
ROUNDING = 1e-12  # relative rounding of a sum of thousands of times
ALONG = 2.0**-23
"""Fraction of the largest coordinate: an end of a wall this close to the line of another wall lies
on it. Engines in float32 cannot tell it from the line, nor can a file with seven digits."""
SAME = 1e-9
"""Fraction of a sample interval, or a step: events closer in time are simultaneous up to the
rounding of the grid."""
GRAZING = 1e-3
"""Of the speed: a disk that slides moves across its floor by less. Engines in float32 keep the
direction of a velocity to 1e-7; a collision as flat as this loses 1e-6 of the energy."""


# By what a disk can distinguish: walls along one line count as one, however many segments they
# have.


def interval(trajectory: Trajectory) -> float:
    """s between two samples."""
    return float(trajectory.t[1] - trajectory.t[0]) if len(trajectory) > 1 else 0.0


def first_on_line(walls: Array, wall: int) -> int:
    """The first of the walls (w, 2, 2) that lie on the line of `wall`."""
    start, span = walls[wall, 0], walls[wall, 1] - walls[wall, 0]
    off = np.abs(laws.cross(walls - start, span)) / np.hypot(*span)
    return int(np.argmax((off <= ALONG * np.abs(walls).max()).all(axis=1)))


@laws.cached
def on_faces(trajectory: Trajectory, scene: Scene) -> Collisions:
    """The collisions of a trajectory, with each wall replaced by the first on its line, and one for
    each pair and contact: a disk that slides from one piece of a floor to the next does not collide
    with it.

    A floor of one segment, of two end to end, or of two on top of each other gives the same
    pairs.
    """
    collisions, walls = trajectory.collisions, np.unique(trajectory.collisions.j)
    firsts = np.array(
        [-1 - first_on_line(scene.walls, -1 - j) if j < 0 else j for j in walls], np.int64
    )
    if np.array_equal(firsts, walls):
        return collisions
    j = firsts[np.searchsorted(walls, collisions.j)]
    order = np.lexsort((collisions.t, j, collisions.i))
    t, touched = collisions.t[order], collisions.j[order]
    near = np.diff(t) <= SAME * interval(trajectory)
    pair = (np.diff(collisions.i[order]) == 0) & (np.diff(j[order]) == 0)
    again = pair & near
    # the walls of the surface that are touched at once
    at_once = np.split(touched, np.flatnonzero(~again) + 1)
    for k, before, after in zip(np.flatnonzero(~again), at_once, at_once[1:]):
        if pair[k] and set(before).isdisjoint(after):
            wall = scene.walls[-1 - j[order[k]]]
            span = (float(t[k]), float(t[k + 1]))
            again[k] = slides(trajectory, scene, int(collisions.i[order[k]]), wall, span)
    first = np.ones(len(collisions), bool)
    first[order[1:][again]] = False
    return Collisions(
        frozen(collisions.t[first]),
        frozen(collisions.i[first], np.int64),
        frozen(j[first], np.int64),
        frozen(collisions.impulse[first]),
    )


def slides(
    trajectory: Trajectory, scene: Scene, disk: int, wall: Array, span: tuple[float, float]
) -> bool:
    """Whether a disk neither approaches the line of a wall nor leaves it in the samples of a span
    of time, in s; in the nearest sample where it holds none."""
    every = interval(trajectory)
    first, last = int(np.ceil(span[0] / every)), int(np.floor(span[1] / every))
    velocity = trajectory.velocity[min(first, last) : last + 1, disk]
    across = np.abs(velocity @ normal(wall))
    return bool((across <= slow(trajectory, scene, wall, velocity)).all())


def normal(wall: Array) -> Array:
    """(2,) the unit vector to the left of a wall, seen from its start."""
    x, y = wall[1] - wall[0]
    unit: Array = np.array([-y, x]) / np.hypot(x, y)
    return unit


def slow(trajectory: Trajectory, scene: Scene, wall: Array, velocity: Array) -> Array:
    """(k,) m/s, the most that a disk that lies on a wall moves across it: gravity acts in the
    interval of two samples, the contact that bears it may act an interval later; and `GRAZING` of
    its velocity (k, 2)."""
    falls = 2 * interval(trajectory) * abs(float(scene.gravity @ normal(wall)))
    return falls + GRAZING * laws.lengths(velocity)


def thrown_off(played: Trajectory, true: Trajectory, scene: Scene) -> tuple[float, float, int, int]:
    """The hardest jump of a disk off a surface of several walls on which it lies, slides or rolls
    in the exact answer: its speed off the surface over the most that a contact may cause, the time
    in s, the disk, and the first wall of the surface; the speed is 0 if there is none.

    It is read off the velocities: engines report the collisions of a lasting contact as they like.
    """
    worst, hits = (0.0, 0.0, -1, -1), on_faces(true, scene)
    lines = np.array([first_on_line(scene.walls, w) for w in range(len(scene.walls))])
    for i, j in {*zip(hits.i[hits.impulse == 0].tolist(), hits.j[hits.impulse == 0].tolist())}:
        if j >= 0 or (lines == -1 - j).sum() < 2:
            continue
        wall = scene.walls[-1 - j]
        outward = normal(wall) * np.sign((true.position[0, i] - wall[0]) @ normal(wall))
        above = (true.position[:, i] - wall[0]) @ outward / scene.radius[i] - 1
        struck = hits.t[(hits.impulse > 0) & ((hits.i == i) | (hits.j == i))].min(initial=np.inf)
        leaves = (np.abs(above) > laws.ON_THE_WALL) | (true.t >= struck)
        k = min(len(played), int(np.append(leaves, True).argmax()))
        if not k:
            continue
        off = (played.velocity[:k, i] - true.velocity[:k, i]) @ outward
        most = slow(played, scene, wall, true.velocity[:k, i])
        share = off / np.maximum(most, np.finfo(float).tiny)
        at = int(share.argmax())
        worst = max(worst, (float(share[at]), float(played.t[at]), i, -1 - j))
    return worst


# Against the truth.


@dataclass(frozen=True, eq=False)
class Matched:
    """Collisions of an engine set against collisions of the truth."""

    delay: Array  # (m,) s, engine time minus true time of each collision found
    missed: list[tuple[float, int, int]]  # (time s, i, j) of true collisions not found
    spurious: list[tuple[float, int, int]]  # of engine collisions that the truth lacks
    judged: int  # how many true collisions would count as missed if they were not found

    @property
    def first_wrong(self) -> tuple[float, str] | None:
        """Time and description of the first missed or spurious collision, or None."""
        wrong = (*self.missed, *self.spurious)
        if not wrong:
            return None
        first = min(t for t, _, _ in wrong)
        words = [f"missed {who(i, j)}" for t, i, j in self.missed if t == first]
        words += [f"spurious {who(i, j)}" for t, i, j in self.spurious if t == first]
        return first, min(words)


def who(i: int, j: int) -> str:
    """ "3-7" for two disks, "3-wall 0" for a wall."""
    return f"{i}-{j}" if j >= 0 else f"{i}-wall {-1 - j}"


def match(played: Collisions, true: Collisions, end: float, dt: float) -> Matched:
    """Match collisions pair by pair, in order, up to `end` s, for an engine with steps of `dt` s.

    Where a pair has more collisions on one side, the ones left unmatched are chosen so that the
    others are closest in time; on a tie, the earlier. A match is rejected if its delay exceeds both
    `FAR` dt and `HALF` the time to the nearest other true collision of the pair (or to the start):
    then one collision is missed and one is spurious.

    Three kinds of collisions are not judged: those of a pair in contact at rest from the start (a
    true collision without impulse), where an engine reports the weight; true collisions of a pair
    closer together than `CROWDED` dt, which a step cannot resolve, and the engine's collisions near
    them; and collisions within `WINDOW` dt of `end`, which may be cut off.
    """
    resting = pair_keys(true)[true.impulse == 0]
    mine, its = (by_pair(collisions, resting, end - SAME * dt) for collisions in (played, true))
    pairs = np.union1d(mine.key, its.key)
    limits = [np.append(np.searchsorted(side.key, pairs), len(side.key)) for side in (mine, its)]
    partner, lost, extra, judged = judge(mine.t, limits[0], its.t, limits[1], dt, end)
    found = partner >= 0
    return Matched(
        delay=mine.t[found] - its.t[partner[found]],
        missed=listed(its, lost),
        spurious=listed(mine, extra),
        judged=int(judged),
    )


class ByPair(NamedTuple):
    """Collisions sorted by pair, for which `key` stands, and then by time in s."""

    key: np.ndarray
    t: Array
    i: np.ndarray
    j: np.ndarray


def listed(collisions: ByPair, chosen: np.ndarray) -> list[tuple[float, int, int]]:
    return list(zip(*(column[chosen].tolist() for column in collisions[1:])))


def pair_keys(collisions: Collisions) -> np.ndarray:
    """(h,) a number for the pair of each collision."""
    return (collisions.i << 32) + collisions.j


def by_pair(collisions: Collisions, resting: np.ndarray, end: float) -> ByPair:
    """The collisions before `end` s of pairs that are not `resting`."""
    key = pair_keys(collisions)
    order = np.argsort(key, kind="stable")
    order = order[collisions.t[order] < end]
    if len(resting):
        order = order[~np.isin(key[order], resting)]
    return ByPair(key[order], collisions.t[order], collisions.i[order], collisions.j[order])


@njit(cache=True)
def judge(played, played_limits, true, true_limits, dt, end):  # type: ignore[no-untyped-def]
    """Pair by pair: (partner of each played collision or -1, true collisions that are missed,
    played collisions that are spurious, how many true collisions are judged)."""
    judged = 0
    partner = np.full(len(played), -1)
    lost, extra = np.zeros(len(true), dtype=np.bool_), np.zeros(len(played), dtype=np.bool_)
    for k in range(len(played_limits) - 1):
        p, q = played_limits[k], played_limits[k + 1]
        a, b = true_limits[k], true_limits[k + 1]
        mine, its = played[p:q], true[a:b]
        gap = gap_to_nearest(its)
        if q - p <= b - a:
            chosen = closest_in_order(mine, its, SAME * dt)
            for m in range(q - p):
                partner[p + m] = a + chosen[m]
        else:
            chosen = closest_in_order(its, mine, SAME * dt)
            for m in range(b - a):
                partner[p + chosen[m]] = a + m
        for m in range(a, b):
            lost[m] = gap[m - a] >= CROWDED * dt and true[m] < end - WINDOW * dt
            judged += lost[m]
        for m in range(p, q):
            t, other = played[m], partner[m]
            if other >= 0 and abs(t - true[other]) > max(HALF * gap[other - a], FAR * dt):
                partner[m] = other = -1
            if other >= 0:
                lost[other] = False
            else:
                extra[m] = t < end - WINDOW * dt and not among_crowded(t, its, gap, dt)
    return partner, lost, extra, judged


@njit(cache=True)
def gap_to_nearest(t):  # type: ignore[no-untyped-def]
    """(h,) s from each of the sorted times to the nearest other, or to the start."""
    gap = np.empty(len(t))
    for k in range(len(t)):
        gap[k] = t[k] - (t[k - 1] if k > 0 else 0.0)
        if k + 1 < len(t):
            gap[k] = min(gap[k], t[k + 1] - t[k])
    return gap


@njit(cache=True)
def among_crowded(t, times, gap, dt):  # type: ignore[no-untyped-def]
    """Whether `t` is within `WINDOW` dt of one of `times` that is too close to its neighbour to
    resolve."""
    for k in range(len(times)):
        if gap[k] < CROWDED * dt and abs(times[k] - t) <= WINDOW * dt:
            return True
    return False


@njit(cache=True)
def closest_in_order(few, many, same):  # type: ignore[no-untyped-def]
    """(len(few),) indices into `many`, increasing, with the least sum of |few - many[index]|; both
    sorted, in s.

    If two sums differ by less than `same` s, the one that skips later counts: a collision midway
    between two true ones on the grid is equally far from both. Dynamic programming over how many of
    `many` have been skipped so far, one row per element of `few`.
    """
    spare = len(many) - len(few)
    cost = np.zeros(spare + 1)
    skipped = np.zeros((len(few), spare + 1), dtype=np.int64)
    for k in range(len(few)):
        best = 0
        lowest = cost[0]
        for s in range(spare + 1):
            if cost[s] < lowest - same - ROUNDING * lowest:
                best, lowest = s, cost[s]
            skipped[k, s] = best
            cost[s] = lowest + abs(few[k] - many[k + s])
    chosen = np.zeros(len(few), dtype=np.int64)
    skips = np.argmax(cost <= cost.min() * (1 + ROUNDING) + same)
    for k in range(len(few) - 1, -1, -1):
        chosen[k] = k + skips
        skips = skipped[k, skips]
    return chosen
