"""The predicate for whole scenes: the run is complete, plausible, and has no wrong collision."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.collisions import match, on_faces, pair_keys, thrown_off, who
from crosscheck2d.reports.compare.verdicts import MOST_LOST, MOST_OVERLAP, Verdict, verdicts
from crosscheck2d.reports.compare.view import cut
from crosscheck2d.reports.stability.predicates import Predicate, largest, read, worst_of
from crosscheck2d.scenarios.model import Array, Collisions, Scenario, Scene, Trajectory
from crosscheck2d.scenarios.no_truth import answered

GHOST = "ghost collision"
LEAST_WAY = 0.01  # radii between two samples; smaller distances are rounding
STEADY = 1e-9  # of a velocity; a smaller change between two samples is the rounding of the answer


def usable(scenario: Scenario, played: Trajectory) -> Verdict:
    """A number is not finite, a disk goes through a wall or a disk, energy grows by 5 %, disks
    overlap by a tenth of a radius, a disk in free flight moves by half its distance only (its speed
    is capped, or its position has too few digits), or a collision is wrong."""
    parts = [
        overlaps(scenario, played),
        slowed(scenario, played),
        wrong_collisions(scenario, played),
        thrown(scenario, played),
    ]
    for verdict in verdicts(scenario, played, scenario.dt(scenario.substeps[0])):
        if verdict.id in ("tunnelled", "energy_gained"):
            value = verdict.value / verdict.bound if verdict.bound else 2 * verdict.value
            disk = verdict.disks[0] if verdict.disks else None
            parts.append(read(value, verdict.at, verdict.text, disk, verdict.id))
    # for a single free disk nothing is checked
    return worst_of([part for part in parts if part] or [read(0.0, np.nan, "")])


def overlaps(scenario: Scenario, played: Trajectory) -> Verdict | None:
    """Any overlap in any sample: a verdict allows for the approach in a step, but here the step is
    what is too large."""
    if scenario.scene.n + len(scenario.scene.walls) < 2:
        return None
    overlap = laws.penetration(played, scenario.scene)
    event = f"an overlap of {overlap.max():.3g} radii"
    return largest(played.t, overlap, MOST_OVERLAP, event, None, "penetration")


def slowed(scenario: Scenario, played: Trajectory) -> Verdict | None:
    """The largest part of its distance that a disk loses in a sample interval of free flight: its
    position has too few digits, or the engine caps its speed.

    The distance is that of the exact answer, as long as the disk has met nothing but walls, as
    often as there: its speed must be the same. It is also that of the engine's own velocity, before
    the first collision of a disk: two collisions between two samples may restore its velocity.
    """
    scene = scenario.scene
    if len(played) < 2 or scene.wrap is not None:
        return None
    expected = np.maximum(own_distance(scenario, played), exact_distance(scenario, played))
    expected /= scene.radius
    moved = laws.lengths(np.diff(played.position, axis=0)) / scene.radius
    lost = np.where(expected > LEAST_WAY, 1 - moved / np.where(expected > 0, expected, 1.0), 0.0)
    k, disk = np.unravel_index(int(lost.argmax()), lost.shape)
    event = f"disk {disk} moves by {max(1 - float(lost[k, disk]), 0.0):.3g} of its distance"
    return read(lost.max() / MOST_LOST, played.t[k + 1], event, int(disk), "wrong distance")


def own_distance(scenario: Scenario, played: Trajectory) -> Array:
    """(samples - 1, n) m, how far each disk moves between two samples by its own velocity, where
    that stays the same and the disk has not yet collided; else 0."""
    scene, v = scenario.scene, played.velocity
    steady = (v[1:] == v[:-1]).all(axis=2) & ~collided(played, scene, played.t[1:]).any(axis=2)
    distance = laws.lengths(v[1:]) * scenario.sample_interval
    return np.where(steady & ~scene.static, distance, 0.0)


def exact_distance(scenario: Scenario, played: Trajectory) -> Array:
    """(samples - 1, n) m, how far each disk moves between two samples of the exact answer, where it
    flies freely there and in the run, and has met the same walls as often, and no disk; else 0."""
    distance = np.zeros((len(played) - 1, scenario.scene.n))
    _, true = answered(scenario)
    if true is None or len(true) < 2:
        return distance
    t, v = true.t, true.velocity
    met, expected = (collided(run, scenario.scene, t) for run in (played, true))
    alike = (met == expected).all(axis=2) & (expected[:, :, 0] == 0)
    free = (np.diff(expected, axis=0) == 0).all(axis=2)
    change = laws.lengths(np.diff(v, axis=0))
    steady = change <= STEADY * laws.lengths(v[1:])
    where = alike[1:] & alike[:-1] & free & steady
    distance[: len(t) - 1] = np.where(where, laws.lengths(np.diff(true.position, axis=0)), 0.0)
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


def wrong_collisions(scenario: Scenario, played: Trajectory) -> Verdict | None:
    """A collision is missed or spurious."""
    scenario, true = answered(scenario)
    if true is None:
        return None
    k = min(len(played), len(true))
    played, true = cut(played, k), cut(true, k)
    actual, exact = (on_faces(run, scenario.scene) for run in (played, true))
    end, dt = float(true.t[-1]), scenario.dt(scenario.substeps[0])
    matched = match(actual, exact, end, dt)
    wrong = matched.first_wrong or never_collision(actual, exact, end - 3 * dt)
    if wrong is None:
        return None
    at, what = wrong
    kind, pair = what.split(maxsplit=1)
    count = len(matched.missed) + len(matched.spurious)
    disk = int(pair.split("-")[0])
    return read(2.0 * max(count, 1), at, f"{kind} collision: {pair}", disk, "collisions")


def thrown(scenario: Scenario, played: Trajectory) -> Verdict | None:
    """A ghost collision: the disk hits the end of the next wall of a floor."""
    scenario, true = answered(scenario)
    if true is None:
        return None
    value, at, disk, wall = thrown_off(played, true, scenario.scene)
    event = f"disk {disk} is thrown off the surface of wall {wall}, where two of its walls meet"
    return read(value, at, event, disk, GHOST)


def never_collision(played: Collisions, true: Collisions, end: float) -> tuple[float, str] | None:
    """The first true collision up to `end` s of a pair that never collides in the run. `match`
    leaves out such a collision near the start."""
    hard = (true.impulse > 0) & (true.t < end)
    missed = np.flatnonzero(hard & ~np.isin(pair_keys(true), pair_keys(played)))
    if not len(missed):
        return None
    first = missed[0]
    return float(true.t[first]), f"missed {who(true.i[first], true.j[first])}"


USABLE = Predicate("unusable", "of the bound", 1.0, usable)
