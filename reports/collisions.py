"""Which hits of the truth a player found, which it missed, which it invented, and how late it was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenarios.model import Array, Collisions, Scene, Trajectory


@dataclass(frozen=True, eq=False)
class Matched:
    """Hits of a player set against hits of the truth.

    Attributes:
        delay: (m,) s, played time less true time of each hit found.
        missed: (time s, i, j) of true hits not found.
        invented: (time s, i, j) of played hits that are not true.
    """

    delay: Array
    missed: list[tuple[float, int, int]]
    invented: list[tuple[float, int, int]]

    @property
    def first_wrong(self) -> tuple[float, str] | None:
        """Time and description of the first missed or invented hit, or None."""
        wrong = [(t, f"missed {who(i, j)}") for t, i, j in self.missed]
        wrong += [(t, f"invented {who(i, j)}") for t, i, j in self.invented]
        return min(wrong) if wrong else None


def who(i: int, j: int) -> str:
    """ "3-7" for two disks, "3-wall 0" for a wall."""
    return f"{i}-{j}" if j >= 0 else f"{i}-wall {-1 - j}"


def match(played: Collisions, true: Collisions, end: float, dt: float) -> Matched:
    """Match hits pair by pair, in order, up to `end` s, for a player with steps of `dt` s.

    Where a pair has hit more often on one side, those hits are left over whose absence brings the others closest in
    time. A match is no match if it is further off than half the time to the nearest other true hit of the pair (or
    to the start), and than 20 dt: then one hit is missed and one invented.

    Three kinds of hits are not judged: of a pair at rest against each other from the start (a true hit without
    impulse), as what a player reports there is weight; true hits of a pair closer together than 2 dt, as no step
    can tell them apart, with all that a player makes of them; and hits within 3 dt of `end`, which may be cut off.
    """
    delays: list[float] = []
    missed: list[tuple[float, int, int]] = []
    invented: list[tuple[float, int, int]] = []
    resting = {(int(i), int(j)) for i, j, impulse in zip(true.i, true.j, true.impulse) if impulse == 0}
    pairs = {(int(i), int(j)) for hits in (played, true) for i, j in zip(hits.i, hits.j)} - resting
    for i, j in sorted(pairs):
        t_played = played.t[(played.i == i) & (played.j == j) & (played.t <= end)]
        t_true = true.t[(true.i == i) & (true.j == j) & (true.t <= end)]
        mine, its = pair_up(t_played, t_true, 20 * dt)
        delays += list(t_played[mine] - t_true[its])
        crowded = too_close(t_true, 2 * dt)
        lost = np.setdiff1d(np.flatnonzero(~crowded), its)
        extra = np.setdiff1d(np.arange(len(t_played)), mine)
        among = [near_any(t, t_true[crowded], 3 * dt) for t in t_played[extra]]
        missed += [(float(t), i, j) for t in t_true[lost] if t < end - 3 * dt]
        invented += [
            (float(t), i, j) for t, in_crowd in zip(t_played[extra], among) if t < end - 3 * dt and not in_crowd
        ]
    return Matched(np.array(delays), missed, invented)


def pair_up(played: Array, true: Array, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices (m,) into `played` and (m,) into `true` (both s, sorted) of the hits that are the same."""
    if len(played) <= len(true):
        mine, its = np.arange(len(played)), closest_in_order(played, true)
    else:
        mine, its = closest_in_order(true, played), np.arange(len(true))
    gap = np.diff(true, prepend=0.0, append=np.inf)
    allowed = np.maximum(np.minimum(gap[:-1], gap[1:])[its] / 2, least)
    same = np.abs(played[mine] - true[its]) <= allowed
    return mine[same], its[same]


def too_close(t: Array, least: float) -> np.ndarray:
    """(h,) True for times closer than `least` to a neighbour."""
    gap = np.diff(t, prepend=-np.inf, append=np.inf)
    return np.minimum(gap[:-1], gap[1:]) < least


def near_any(t: float, times: Array, least: float) -> bool:
    """Whether `t` lies within `least` of one of `times`."""
    return bool(len(times)) and bool(np.abs(times - t).min() <= least)


def closest_in_order(few: Array, many: Array) -> np.ndarray:
    """(len(few),) indices into `many`, increasing, with the least sum of |few - many[index]|; both sorted, in s.

    Dynamic programming over how many of `many` have been skipped so far, one row per element of `few`.
    """
    spare = len(many) - len(few)
    cost, skipped = np.zeros(spare + 1), np.zeros((len(few), spare + 1), dtype=int)
    for k, t in enumerate(few):
        best = np.minimum.accumulate(cost)
        skipped[k] = np.maximum.accumulate(np.where(cost == best, np.arange(spare + 1), 0))
        cost = best + np.abs(t - many[k : k + spare + 1])
    chosen = np.zeros(len(few), dtype=int)
    skips = int(np.argmin(cost)) if len(few) else 0
    for k in reversed(range(len(few))):
        chosen[k] = k + skips
        skips = skipped[k, skips]
    return chosen


def effective_restitution(trajectory: Trajectory, scene: Scene, slowest: float) -> tuple[Array, Array]:
    """Restitution of each hit that can be read off the samples, and its time: ((m,), (m,) s).

    A hit can be read if neither disk has another one in the same sample interval or the next, and none of them
    changes its spin (friction): then the change of velocity points along the normal n, and e = -(dv'.n) / (dv.n).
    Two disks must also change their momenta by as much, and a disk at a wall along the wall's normal: else
    something was hit of which the player did not tell. Hits closing slower than `slowest` m/s are left out.
    """
    t, collisions = trajectory.t, trajectory.collisions
    interval = np.searchsorted(t, collisions.t, side="left") - 1
    busy: dict[tuple[int, int], int] = {}
    for k, i, j in zip(interval, collisions.i, collisions.j):
        for disk in (i, j):
            busy[k, disk] = busy.get((k, disk), 0) + 1
    values, times = [], []
    for k, i, j, when in zip(interval, collisions.i, collisions.j, collisions.t):
        disks = (i, j) if j >= 0 else (i,)
        alone = all(busy[k, disk] == 1 and (k + 1, disk) not in busy for disk in disks)
        if alone and 0 <= k < len(t) - 1:
            closing, parting = speeds_along_normal(trajectory, scene, k, int(i), int(j), when)
            if closing > max(slowest, 0.0):
                values.append(parting / closing)
                times.append(when)
    return np.array(values), np.array(times)


CLEAN = 1e-4  # of the change of velocity; float32 leaves about 1e-7 of the velocity, an untold hit far more


def speeds_along_normal(
    trajectory: Trajectory, scene: Scene, k: int, i: int, j: int, when: float
) -> tuple[float, float]:
    """m/s at which disk i and disk or wall j close before and part after a hit between samples k and k + 1.

    (nan, nan) if the change is not that of one frictionless hit.
    """
    t, velocity, spin = trajectory.t, trajectory.velocity, trajectory.angular_velocity
    falling = np.where(scene.static[:, None], 0.0, scene.gravity)
    earlier, later = velocity[k] + falling * (when - t[k]), velocity[k + 1] - falling * (t[k + 1] - when)
    change = later - earlier
    normal = change[i] / (np.linalg.norm(change[i]) or 1.0)
    if j >= 0 and not scene.static[j]:
        untold = np.linalg.norm(scene.mass[i] * change[i] + scene.mass[j] * change[j]) / scene.mass[i]
    elif j < 0:
        start, end = scene.walls[-1 - j]
        untold = abs(change[i] @ (end - start)) / np.linalg.norm(end - start)
    else:
        untold = 0.0
    turned = np.abs(spin[k + 1] - spin[k])[[i, j] if j >= 0 else [i]].max() * scene.radius[i]
    if max(untold, turned) > CLEAN * np.linalg.norm(change[i]):
        return np.nan, np.nan
    before, after = (earlier[i] - earlier[j], later[i] - later[j]) if j >= 0 else (earlier[i], later[i])
    return float(-before @ normal), float(after @ normal)
