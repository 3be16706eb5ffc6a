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


def match(played: Collisions, true: Collisions, end: float, slack: float) -> Matched:
    """Match hits pair by pair, in order, up to `end` s.

    Where a pair has hit more often on one side, those hits are left over whose absence brings the others closest in
    time: they are the missed or the invented ones. Hits within `slack` s of `end` may be cut off by it: they are not
    blamed. A pair at rest against each other from the start (a true hit without impulse) is not counted: what a
    player reports there is weight, not hits.
    """
    delays: list[float] = []
    missed, invented = [], []
    resting = {(int(i), int(j)) for i, j, impulse in zip(true.i, true.j, true.impulse) if impulse == 0}
    pairs = {(int(i), int(j)) for hits in (played, true) for i, j in zip(hits.i, hits.j)} - resting
    for i, j in sorted(pairs):
        t_played = played.t[(played.i == i) & (played.j == j) & (played.t <= end)]
        t_true = true.t[(true.i == i) & (true.j == j) & (true.t <= end)]
        few, many = (t_played, t_true) if len(t_played) <= len(t_true) else (t_true, t_played)
        chosen = closest_in_order(few, many)
        delays += list((few - many[chosen]) * (1 if few is t_played else -1))
        left = [(float(t), i, j) for t in np.delete(many, chosen) if t < end - slack]
        if few is t_played:
            missed += left
        else:
            invented += left
    return Matched(np.array(delays), missed, invented)


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

    A hit can be read if neither disk has another one in the same sample interval: then the change of its velocity
    points along the normal n, and e = -(dv'.n) / (dv.n). Hits closing slower than `slowest` m/s are left out.
    """
    t, velocity, collisions = trajectory.t, trajectory.velocity, trajectory.collisions
    falling = np.where(scene.static[:, None], 0.0, scene.gravity)
    interval = np.searchsorted(t, collisions.t, side="left") - 1
    busy: dict[tuple[int, int], int] = {}
    for k, i, j in zip(interval, collisions.i, collisions.j):
        for disk in (i, j):
            if disk >= 0:
                busy[k, disk] = busy.get((k, disk), 0) + 1
    values, times = [], []
    for k, i, j, when in zip(interval, collisions.i, collisions.j, collisions.t):
        alone = busy[k, i] == 1 and (j < 0 or busy[k, j] == 1)
        if not alone or not 0 <= k < len(t) - 1:
            continue
        earlier, later = velocity[k] + falling * (when - t[k]), velocity[k + 1] - falling * (t[k + 1] - when)
        before, after = earlier[i], later[i]
        normal = after - before
        if j >= 0:
            before, after = before - earlier[j], after - later[j]
        closing = -before @ normal
        if closing > max(slowest * np.linalg.norm(normal), 0.0):
            values.append(after @ normal / closing)
            times.append(when)
    return np.array(values), np.array(times)
