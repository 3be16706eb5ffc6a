"""What a disk may touch next, and not before when: float64 bounds, so that few contacts need many digits.

Every bound is lowered by far more than float64 rounds, so nothing is left out; what it lets through is only slower.
"""

from __future__ import annotations

import numpy as np

from scenarios.model import Array

PIECES = 32  # of a path, each with its box
SLACK = 1e-9  # of a distance; float64 is off by 1e-16 of the coordinates, see `_blur`


def moved(table: Array, now: float) -> tuple[Array, Array]:
    """Position (b, 2) m and velocity (b, 2) m/s at `now` s of the bodies of `table` (b, 7): x, y, vx, vy, ax, ay, t."""
    since = now - table[:, 6:7]
    return table[:, :2] + (table[:, 2:4] + table[:, 4:6] * since / 2) * since, table[:, 2:4] + table[:, 4:6] * since


def _blur(x: Array, distance: Array) -> Array:
    return SLACK * distance + 1e-13 * np.abs(x).max()


def earliest_bodies(table: Array, radius: Array, i: int, now: float) -> Array:
    """(b,) s from `now` before which disk i cannot touch each body; inf: never while both fly on."""
    x, v = moved(table, now)
    dr, dv, da = x - x[i], v - v[i], table[:, 4:6] - table[i, 4:6]
    reach, distance = radius + radius[i], np.hypot(dr[:, 0], dr[:, 1])
    speed, pull, blur = np.hypot(dv[:, 0], dv[:, 1]), np.hypot(da[:, 0], da[:, 1]), _blur(x, distance + reach)
    bound = _at_least(distance - reach - blur, speed, pull)
    # Of equal acceleration the time itself can be had: c / (-b + sqrt(b^2 - a2 c)), each part blurred downwards.
    b, c = (dr * dv).sum(axis=1) - blur * speed, np.maximum((distance - reach) * (distance + reach), 0)
    under = b * b - speed**2 * c
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        time = np.maximum(c - 3 * blur * distance, 0) / (np.sqrt(np.maximum(under, 0) + blur * distance * speed**2) - b)
    never = (b >= 0) | (under < -8 * blur * (distance + reach) * speed**2)
    bound = np.where(pull > 0, bound, np.where(never, np.inf, time))
    bound[i] = np.inf
    return bound


def earliest_walls(table: Array, radius: Array, walls: Array, i: int, now: float) -> Array:
    """(w,) s from `now` before which disk i cannot touch each wall of `walls` (w, 2, 2) m."""
    x, v = (part[0] for part in moved(table[i : i + 1], now))
    along = walls[:, 1] - walls[:, 0]
    share = np.clip(((x - walls[:, 0]) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    distance = np.hypot(*(x - walls[:, 0] - share[:, None] * along).T)
    gap = distance - radius[i] - _blur(np.append(walls.ravel(), x), distance)
    return _at_least(gap, np.hypot(*v), np.hypot(*table[i, 4:6]))


def passes_by(table: Array, radius: Array, i: int, j: int, now: float, limit: float) -> bool:
    """Whether body j stays clear of disk i for `limit` s from `now`: boxes around the pieces of its relative path."""
    x, v = moved(table[[i, j]], now)
    dr, dv, da = x[1] - x[0], v[1] - v[0], table[j, 4:6] - table[i, 4:6]
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.nan_to_num(-dv / da)
    cuts = np.linspace(0, limit * (1 + 1e-6), PIECES + 1)[:, None]
    # A piece of a parabola is widest, axis by axis, at its ends or where it turns back.
    instants = np.stack(np.broadcast_arrays(cuts[:-1], np.clip(turn, cuts[:-1], cuts[1:]), cuts[1:]))
    path = dr + (dv + da * instants / 2) * instants
    away = np.maximum(np.maximum(path.min(axis=0), -path.max(axis=0)), 0)
    reach = radius[i] + radius[j]
    return bool(np.hypot(*away.T).min() > reach + _blur(x, np.abs(path).max() + reach))


def _at_least(gap: Array, speed: Array | float, pull: Array | float) -> Array:
    """s to close `gap` m at the worst: speed t + pull t^2 / 2 = gap."""
    gap = np.maximum(gap, 0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        time = 2 * gap / (speed + np.sqrt(speed**2 + 2 * pull * gap))
    # 0 / 0: what touches and has no relative motion is looked at now.
    return np.nan_to_num(time * (1 - SLACK), nan=0.0, posinf=np.inf)
