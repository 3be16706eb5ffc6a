"""The predicate for whole scenes: the run is complete, plausible, and has no wrong collision."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.collisions import match, pair_keys, who
from crosscheck2d.reports.compare.faces import on_faces, thrown_off
from crosscheck2d.reports.compare.verdicts import MOST_LOST, MOST_OVERLAP, Verdict, verdicts
from crosscheck2d.reports.compare.view import cut
from crosscheck2d.reports.stability.predicates import Predicate, Reading, largest
from crosscheck2d.scenarios.model import Array, Collisions, Scenario, Scene, Trajectory
from crosscheck2d.scenarios.no_truth import answered

GHOST = "ghost collision"
LEAST_WAY = 0.01  # radii between two samples; smaller distances are rounding
STEADY = 1e-9  # of a velocity; a smaller change between two samples is the rounding of the answer


def _usable(scenario: Scenario, played: Trajectory) -> Reading:
    judged = verdicts(scenario, played, scenario.dt(scenario.substeps[0]))
    parts = [
        _overlap(scenario, played),
        _slowed(scenario, played),
        _wrong_collisions(scenario, played),
        _thrown(scenario, played),
        *(_reading(verdict) for verdict in judged if verdict.id in ("tunnelled", "energy_gained")),
    ]
    # for a single free disk nothing is checked
    return max(filter(None, parts), key=lambda part: part.value, default=Reading(0.0))


def _reading(verdict: Verdict) -> Reading:
    """A verdict in units of its bound."""
    value = verdict.value / verdict.bound if verdict.bound else 2 * verdict.value
    disk = verdict.disks[0] if verdict.disks else -1
    return Reading(value, verdict.at, verdict.text, verdict.id, disk=disk)


def _overlap(scenario: Scenario, played: Trajectory) -> Reading | None:
    """Any overlap in any sample: a verdict allows for the approach in a step, but here the step is
    what is too large."""
    if scenario.scene.n + len(scenario.scene.walls) < 2:
        return None
    overlap = laws.penetration(played, scenario.scene)
    event, most = f"an overlap of {overlap.max():.3g} radii", MOST_OVERLAP
    return largest(played.t, overlap, most, event, of=most, broken="penetration", disk=-1)


def _slowed(scenario: Scenario, played: Trajectory) -> Reading | None:
    """The largest part of its distance that a disk loses in a sample interval of free flight: its
    position has too few digits, or the engine caps its speed.

    The distance is that of the exact answer, as long as the disk has met nothing but walls, as
    often as there: its speed must be the same. It is also that of the engine's own velocity, before
    the first collision of a disk: two collisions between two samples may restore its velocity.
    """
    scene = scenario.scene
    if len(played) < 2 or scene.wrap is not None:
        return None
    ought = np.maximum(own_distance(scenario, played), exact_distance(scenario, played))
    ought /= scene.radius
    went = np.linalg.norm(np.diff(played.position, axis=0), axis=2) / scene.radius
    lost = np.where(ought > LEAST_WAY, 1 - went / np.where(ought > 0, ought, 1.0), 0.0)
    k, disk = np.unravel_index(int(lost.argmax()), lost.shape)
    event = f"disk {disk} moves by {max(1 - float(lost[k, disk]), 0.0):.3g} of its distance"
    return Reading(
        float(lost.max()) / MOST_LOST,
        float(played.t[k + 1]),
        event,
        "wrong distance",
        disk=int(disk),
    )


def own_distance(scenario: Scenario, played: Trajectory) -> Array:
    """(samples - 1, n) m, how far each disk moves between two samples by its own velocity, where
    that stays the same and the disk has not yet collided; else 0."""
    scene, v = scenario.scene, played.velocity
    steady = (v[1:] == v[:-1]).all(axis=2) & ~collided(played, scene, played.t[1:]).any(axis=2)
    return np.where(
        steady & ~scene.static,
        np.linalg.norm(v[1:], axis=2) * scenario.sample_interval,
        0.0,
    )


def exact_distance(scenario: Scenario, played: Trajectory) -> Array:
    """(samples - 1, n) m, how far each disk moves between two samples of the exact answer, where it
    flies freely there and in the run, and has met the same walls as often, and no disk; else 0."""
    distance = np.zeros((len(played) - 1, scenario.scene.n))
    _, true = answered(scenario)
    if true is None or len(true) < 2:
        return distance
    t, v = true.t, true.velocity
    met, ought = (collided(each, scenario.scene, t) for each in (played, true))
    alike = (met == ought).all(axis=2) & (ought[:, :, 0] == 0)
    free = (np.diff(ought, axis=0) == 0).all(axis=2)
    change = np.linalg.norm(np.diff(v, axis=0), axis=2)
    steady = change <= STEADY * np.linalg.norm(v[1:], axis=2)
    distance[: len(t) - 1] = np.where(
        alike[1:] & alike[:-1] & free & steady,
        np.linalg.norm(np.diff(true.position, axis=0), axis=2),
        0.0,
    )
    return distance


def collided(played: Trajectory, scene: Scene, t: Array) -> Array:
    """(times, n, 1 + walls): how often each disk has met other disks, and each wall, up to and
    including the times `t` (s)."""
    counts = np.zeros((len(t) + 1, scene.n, 1 + len(scene.walls)))
    hits = on_faces(played, scene)
    when = np.searchsorted(t, hits.t)
    for disk, other in ((hits.i, hits.j), (hits.j, hits.i)):
        of_disk = disk >= 0
        np.add.at(counts, (when[of_disk], disk[of_disk], np.maximum(-other[of_disk], 0)), 1)
    return counts.cumsum(axis=0)[:-1]


def _wrong_collisions(scenario: Scenario, played: Trajectory) -> Reading | None:
    scenario, true = answered(scenario)
    if true is None:
        return None
    k = min(len(played), len(true))
    played, true = cut(played, k), cut(true, k)
    dt = scenario.dt(scenario.substeps[0])
    mine, its = (on_faces(one, scenario.scene) for one in (played, true))
    found = match(mine, its, float(true.t[-1]), dt)
    wrong = found.first_wrong or never_collision(mine, its, float(true.t[-1]) - 3 * dt)
    if wrong is None:
        return None
    at, what = wrong
    kind, pair = what.split(maxsplit=1)
    count = len(found.missed) + len(found.spurious)
    return Reading(
        2.0 * max(count, 1),
        at,
        f"{kind} collision: {pair}",
        "collisions",
        disk=int(pair.split("-")[0]),
    )


def _thrown(scenario: Scenario, played: Trajectory) -> Reading | None:
    """A ghost collision: the disk hits the end of the next wall of a floor."""
    scenario, true = answered(scenario)
    if true is None:
        return None
    value, at, disk, wall = thrown_off(played, true, scenario.scene)
    event = f"disk {disk} is thrown off the surface of wall {wall}, where two of its walls meet"
    return Reading(value, at, event, GHOST, disk=disk)


def never_collision(played: Collisions, true: Collisions, end: float) -> tuple[float, str] | None:
    """The first true collision up to `end` s of a pair that never collides in the run. `match`
    leaves out such a collision near the start."""
    hard = (true.impulse > 0) & (true.t < end)
    missed = np.flatnonzero(hard & ~np.isin(pair_keys(true), pair_keys(played)))
    return (
        (float(true.t[missed[0]]), f"missed {who(true.i[missed[0]], true.j[missed[0]])}")
        if len(missed)
        else None
    )


USABLE = Predicate(
    "unusable",
    "of the bound",
    1.0,
    "a number is not finite, a disk goes through a wall or a disk, energy grows by 5 %, disks"
    " overlap by a tenth of a radius, a disk in free flight moves by half its distance only (its"
    " speed is capped, or its position has too few digits), or a collision is wrong",
    _usable,
)
