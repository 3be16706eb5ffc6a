"""The metrics of collisions: restitution; collisions missed and spurious; detection delay.

Each is a row of `METRICS` (metrics.py).
"""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare.collisions import FAR, by_pair, pair_keys
from crosscheck2d.reports.compare.faces import SAME, thrown_off
from crosscheck2d.reports.compare.restitution import Restitutions
from crosscheck2d.reports.compare.view import LEAST_SHARE, Value, View, not_judged

UNHEARD = not_judged("an engine reports no collisions")
STICKS = 0.05  # e of a disk that lies is read as less, even if a step is as long as an interval


def restitution(view: View) -> Value | None:
    """Median e = -(dv after).n / (dv before).n over the collisions that can be read off the
    samples; where gravity leaves a range of e, its value nearest to what the scene states. Where a
    tenth or more bounce and a tenth or more do not (e below 0.05), the median of those that are
    farther from what the scene states; the note has the share and the range."""
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
    stated = view.scenario.scene.restitution
    value = _read(max(medians, key=lambda e: abs(e - stated)), read)
    return value._replace(note=note + value.note)


def restitution_error(view: View) -> Value | None:
    """Largest |e - what the scene states| over the collisions that can be read off the samples,
    beyond what gravity leaves open."""
    read = view.restitutions
    if not len(read.values):
        return _unread(read)
    off = np.abs(read.values - view.scenario.scene.restitution)
    worst = int(np.argmax(off))
    return _read(float(off[worst]), read)._replace(at=float(read.times[worst]))


def collision_count_error(view: View) -> Value | None:
    """Number of collisions minus that of the truth, or of the other engine, at any time; pairs at
    rest from the start are not counted."""
    if view.silent:
        return UNHEARD
    resting = pair_keys(view.collisions[1])[view.collisions[1].impulse == 0]
    counted = (
        by_pair(collisions, resting, view.end - SAME * view.dt) for collisions in view.collisions
    )
    played, true = (len(collisions.t) for collisions in counted)
    return Value(played - true, note=f"{played} of {true}")


def collisions_missed(view: View) -> Value | None:
    """Collisions of the truth, or of the other engine, that the engine does not have at that time.
    Collisions closer together than a step can resolve are not counted. Of a pair that collides
    seldom one counts as found up to half of the time to its next collision; the note has how many
    are more than 20 steps late or early."""
    if not view.collisions[1].t.size:
        return not_judged("no collision to miss")
    return _unjudged(view) or Value(len(view.matched.missed), note=_carried(view))


def collisions_spurious(view: View) -> Value | None:
    """Collisions of the engine that the truth, or the other engine, does not have at their time;
    and one if a disk that lies, slides or rolls on a floor of several walls is thrown off it."""
    spurious = len(view.matched.spurious)
    if view.jumps is not None and view.other is not None:
        share, at, disk, wall = thrown_off(view.played, view.other, view.scenario.scene)
        if share > 1.0:
            note = f"thrown off the surface of wall {wall}, where two of its walls meet"
            return Value(spurious + 1, disk, at, note)
    return _unjudged(view) or Value(spurious, note=_carried(view))


def first_wrong_collision_s(view: View) -> Value | None:
    """Time of the first missed or spurious collision, and its pair; `inf` if there is none."""
    if (unjudged := _unjudged(view)) is not None:
        return unjudged
    at, what = view.matched.first_wrong or (np.nan, "none")
    return Value(np.inf if np.isnan(at) else at, at=at, note=f"{what}, {_carried(view)}")


def collision_delay_dt(view: View) -> Value | None:
    """Median of engine time minus true time of the collisions, in dt; the engine time is the end of
    the step."""
    delay = view.matched.delay
    return (
        Value(float(np.median(delay)) / view.dt, note=f"{len(delay)} collisions")
        if len(delay)
        else None
    )


def collision_delay_max_dt(view: View) -> Value | None:
    """Largest difference in time of any collision from the true one, in dt."""
    delay = view.matched.delay
    return (
        Value(float(np.abs(delay).max()) / view.dt, note=f"{len(delay)} collisions")
        if len(delay)
        else None
    )


def _read(value: float, read: Restitutions) -> Value:
    spread = f", e known to {read.spread.max():.1g}" if read.spread.any() else ""
    return Value(value, note=f"{len(read.values)} collisions read{spread}{_unread_ones(read)}")


def _unread(read: Restitutions) -> Value | None:
    """Why no collision could be read; None without a collision."""
    unclear = _so_many(read.unclear, "not alone, too slow, or of an unclear normal")
    reasons = _unread_ones(read) + unclear
    return not_judged(f"no collision read{reasons}") if reasons else None


def _unread_ones(read: Restitutions) -> str:
    """How many collisions were not read, and why."""
    return _so_many(read.below, "below the floor") + _so_many(read.unfinished, "not over")


def _so_many(count: int, why: str) -> str:
    return f", {count} {why}" if count else ""


def _carried(view: View) -> str:
    """How many collisions would count as missed if the engine did not have them (collisions.py:
    `match`)."""
    far = int((np.abs(view.matched.delay) > FAR * view.dt).sum())
    late = _so_many(far, "found more than 20 steps late or early")
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
