"""Which collisions of the truth an engine found or missed, which of its own are spurious, and the
delays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from crosscheck2d.reports.compare.delays import WINDOW
from crosscheck2d.reports.compare.faces import SAME
from crosscheck2d.scenarios.model import Array, Collisions

# Times of collisions are often whole or half multiples of dt. A bound that is such a multiple would
# leave the decision to rounding, so the bounds are irrational.
# dt; no step tells two true collisions of a pair apart that are closer
CROWDED = 5**0.5
FAR = 401**0.5  # dt; a match may always be this late or early
ROUNDING = 1e-12  # relative rounding of a sum of thousands of times
# of the time to the nearest other true collision; a match may be this late or early, too
HALF = 0.26**0.5


@dataclass(frozen=True, eq=False)
class Matched:
    """Collisions of an engine set against collisions of the truth.

    Attributes:
        delay: (m,) s, engine time minus true time of each collision found.
        missed: (time s, i, j) of true collisions not found.
        spurious: (time s, i, j) of engine collisions that the truth lacks.
        judged: how many true collisions would count as missed if they were not found.
    """

    delay: Array
    missed: list[tuple[float, int, int]]
    spurious: list[tuple[float, int, int]]
    judged: int

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
    """Collisions sorted by pair and then by time: one number that stands for the pair, the time in
    s, the pair."""

    key: np.ndarray
    t: Array
    i: np.ndarray
    j: np.ndarray


def listed(collisions: ByPair, chosen: np.ndarray) -> list[tuple[float, int, int]]:
    """(time s, i, j) of those chosen, in order of pairs."""
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
