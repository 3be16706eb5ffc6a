"""The metrics of collisions: restitution; the height of a bounce; collisions missed and spurious;
detection delay.

Each is a row of `METRICS` (metrics.py), with the sentence that says what it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.collisions import (
    ALONG,
    FAR,
    SAME,
    by_pair,
    interval,
    on_faces,
    pair_keys,
    thrown_off,
)
from crosscheck2d.reports.compare.restitution import Restitutions
from crosscheck2d.reports.compare.view import LEAST_SHARE, Value, View, not_judged
from crosscheck2d.scenarios.model import Array

UNHEARD = not_judged("an engine reports no collisions")
STICKS = 0.05  # e of a disk that lies is read as less, even if a step is as long as an interval
LEAST = 5  # sample intervals that the rise to an apex takes; a lower one has too few samples
FLIES = 0.01  # of g: by so much the acceleration at an apex may differ from it


def restitution(view: View) -> Value | None:
    read = view.restitutions
    if not len(read.values):
        return _unread(read)
    bounces, note = read.values > STICKS, ""
    groups = [read.values]
    if bounces.any() and not bounces.all():
        least, most = read.values.min(), read.values.max()
        note = f"{bounces.sum()} of {len(bounces)} bounce, e from {least:.2g} to {most:.2g}, "
        if LEAST_SHARE <= bounces.mean() <= 1 - LEAST_SHARE:
            groups = [read.values[~bounces], read.values[bounces]]
    medians = [float(np.median(group)) for group in groups]
    stated = view.scene.restitution
    return Value(max(medians, key=lambda e: abs(e - stated)), note=note + _read(read))


def restitution_error(view: View) -> Value | None:
    read = view.restitutions
    if not len(read.values):
        return _unread(read)
    off = np.abs(read.values - view.scene.restitution)
    worst = int(np.argmax(off))
    return Value(float(off[worst]), at=float(read.times[worst]), note=_read(read))


def _read(read: Restitutions) -> str:
    spread = f", e known to {read.spread.max():.1g}" if read.spread.any() else ""
    return f"{len(read.values)} collisions read{spread}{_not_read(read)}"


def _unread(read: Restitutions) -> Value | None:
    """Why no collision could be read; None without a collision."""
    reasons = _not_read(read) + _count(read.unclear, "not alone, too slow, or of an unclear normal")
    return not_judged(f"no collision read{reasons}") if reasons else None


def _not_read(read: Restitutions) -> str:
    return _count(read.below, "below the floor") + _count(read.unfinished, "not over")


def _count(count: int, reason: str) -> str:
    return f", {count} {reason}" if count else ""


def apex_change(view: View) -> Value | None:
    disks = np.flatnonzero(~view.scene.static)
    changes = {int(disk): bounce_changes(view, int(disk)) for disk in disks}
    means = {disk: 100 * float(change.mean()) for disk, change in changes.items() if len(change)}
    if not means:
        return None
    disk = max(means, key=lambda disk: abs(means[disk]))
    change = 100 * changes[disk]
    whole = 100 * (np.prod(changes[disk] + 1) - 1)
    note = f"{len(change)} bounces, from {change.min():+.2g} to {change.max():+.2g} %,"
    return Value(means[disk], disk, note=f"{note} in all {whole:+.2g} %")


def bounce_changes(view: View, disk: int) -> Array:
    """(m,) for each bounce of a disk on a level wall, with nothing else between two apexes: height
    after over e2 times the height before, minus 1.

    Heights are those of the disk's lowest point over the wall, at the vertex of the parabola
    through three samples (`laws.apexes`). If no apex follows by the time at which it is due, the
    highest sample until then counts: a disk that does not bounce loses all.
    """
    scene, played = view.scene, view.played
    g, h = float(np.linalg.norm(scene.gravity)), interval(played)
    if not g or not scene.restitution or view.scenario.thrusts or not len(scene.walls):
        return np.zeros(0)
    up, e = -scene.gravity / g, scene.restitution
    y, collisions = played.position[:, disk] @ up, on_faces(played, scene)
    of_disk = (collisions.i == disk) | (collisions.j == disk)
    top, vertex = laws.apexes(y)
    flies = np.abs((y[top - 1] - 2 * y[top] + y[top + 1]) / (g * h**2) + 1) < FLIES
    top, vertex = top[flies], vertex[flies]
    changes = []
    for k, (start, height) in enumerate(zip(played.t[top], vertex)):
        later = of_disk & (collisions.t > start)
        times, walls = collisions.t[later], collisions.j[later]
        if not len(times) or walls[0] >= 0:
            continue
        a, b = scene.walls[-1 - walls[0]]
        level = a @ up + scene.radius[disk]
        fall = np.sqrt(2 * max(height - level, 0.0) / g)
        due = times[0] + e * fall
        tilted = abs((b - a) @ up) > ALONG * laws.lengths(b - a)
        if tilted or e * fall < LEAST * h or due + h > played.t[-1]:
            continue
        until = played.t[top[k + 1]] if k + 1 < len(top) else np.inf
        follows = not (times[times < until] > times[0] + 2 * h).any() and until < np.inf
        until = until if follows else due
        if (walls[times <= until] != walls[0]).any():
            continue
        flight = (played.t > times[0]) & (played.t <= due)
        reached = vertex[k + 1] if follows else y[flight].max()
        changes.append((reached - level) / (height - level) / e**2 - 1)
    return np.array(changes)


def collision_count_error(view: View) -> Value | None:
    if view.silent:
        return UNHEARD
    played, true = view.collisions
    resting = pair_keys(true)[true.impulse == 0]  # pairs at rest from the start are not counted
    counts = [len(by_pair(of, resting, view.end - SAME * view.dt).t) for of in (played, true)]
    return Value(counts[0] - counts[1], note=f"{counts[0]} of {counts[1]}")


def collisions_missed(view: View) -> Value | None:
    if not view.collisions[1].t.size:
        return not_judged("no collision to miss")
    return _unjudged(view) or Value(len(view.matched.missed), note=_carried(view))


def collisions_spurious(view: View) -> Value | None:
    spurious = len(view.matched.spurious)
    if view.jumps is not None:
        share, at, disk, wall = thrown_off(view.played, view.reference, view.scene)
        if share > 1.0:
            note = f"thrown off the surface of wall {wall}, where two of its walls meet"
            return Value(spurious + 1, disk, at, note)
    return _unjudged(view) or Value(spurious, note=_carried(view))


def first_wrong_collision_s(view: View) -> Value | None:
    if (unjudged := _unjudged(view)) is not None:
        return unjudged
    at, what = view.matched.first_wrong or (np.nan, "none")
    return Value(np.inf if np.isnan(at) else at, at=at, note=f"{what}, {_carried(view)}")


def collision_delay_dt(view: View) -> Value | None:
    return _delay(view, np.median)


def collision_delay_max_dt(view: View) -> Value | None:
    return _delay(view, lambda delay: np.abs(delay).max())


def _delay(view: View, of: Callable[[Array], Any]) -> Value | None:
    delay = view.matched.delay
    note = f"{len(delay)} collisions"
    return Value(float(of(delay)) / view.dt, note=note) if len(delay) else None


def _carried(view: View) -> str:
    """How many collisions would count as missed if the engine did not have them (collisions.py:
    `match`)."""
    far = int((np.abs(view.matched.delay) > FAR * view.dt).sum())
    late = _count(far, "found more than 20 steps late or early")
    return f"{view.matched.judged} of {len(view.collisions[1])} collisions judged{late}"


def _unjudged(view: View) -> Value | None:
    """Why the collisions are not judged: too few can be. None if enough can, or if the truth has
    none at all: then every collision of the engine is spurious.

    Collisions closer together than a step can resolve, and those of contacts at rest, are not
    judged. Where most are such, "none missed, none spurious" would say nothing.
    """
    if view.silent:
        return UNHEARD
    few = view.matched.judged < LEAST_SHARE * len(view.collisions[1])
    return not_judged(f"only {_carried(view)}") if few else None
