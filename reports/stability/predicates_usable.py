"""The predicate for whole scenes: the run is complete, plausible, and has no wrong collision."""

from __future__ import annotations

import numpy as np

from reports.compare import laws, scales
from reports.compare.collisions import match, pair_keys, who
from reports.compare.view import cut
from reports.stability.predicates import Predicate, Reading, first_above
from scenarios.model import Collisions, Scenario, Trajectory
from scenarios.no_truth import answered

MOST_RISE, MOST_OVERLAP, MOST_LOST = 0.05, 0.1, 0.5  # of the energy at hand; radii; of a distance
LEAST_WAY = 0.01  # radii between two samples; smaller distances are rounding


def _usable(scenario: Scenario, played: Trajectory) -> Reading:
    parts = [
        part
        for part in (
            _rise(scenario, played),
            _overlap(scenario, played),
            _escape(scenario, played),
            _stuck(scenario, played),
            _wrong_collisions(scenario, played),
        )
        if part is not None
    ]
    # for a single free disk nothing is checked
    return max(parts, key=lambda part: part.value, default=Reading(0.0))


def _rise(scenario: Scenario, played: Trajectory) -> Reading | None:
    if scenario.thrusts or (scenario.scene.wrap is not None and scenario.scene.gravity.any()):
        return None
    energy = laws.energy(played, scenario.scene)
    rise = (energy - energy[0]) / (scales.energy(scenario) or 1.0)
    at = first_above(played.t, rise, MOST_RISE)
    return Reading(
        float(rise.max()) / MOST_RISE,
        at,
        f"energy grows by {rise.max():.3g} of the energy at hand",
        "energy",
        disk=-1,
    )


def _overlap(scenario: Scenario, played: Trajectory) -> Reading | None:
    if scenario.scene.n + len(scenario.scene.walls) < 2:
        return None
    overlap = laws.penetration(played, scenario.scene)
    at = first_above(played.t, overlap, MOST_OVERLAP)
    return Reading(
        float(overlap.max()) / MOST_OVERLAP,
        at,
        f"an overlap of {overlap.max():.3g} radii",
        "penetration",
        disk=-1,
    )


def _escape(scenario: Scenario, played: Trajectory) -> Reading | None:
    if not len(scenario.scene.walls):
        return None
    through = np.flatnonzero(laws.tunnelled(played, scenario.scene))
    event = f"disk {through[0]} goes through a wall" if len(through) else ""
    return Reading(
        2.0 * len(through),
        float(played.t[-1]),
        event,
        "escape",
        disk=int(through[0]) if len(through) else -1,
    )


def _stuck(scenario: Scenario, played: Trajectory) -> Reading | None:
    """The largest part of its distance that a disk loses in a sample interval although it keeps its
    velocity, because its position has too few digits.

    Only before the first collision of a disk: two collisions between two samples may restore its
    velocity.
    """
    scene, v, collisions = scenario.scene, played.velocity, played.collisions
    if len(played) < 2 or scene.wrap is not None:
        return None
    first_collision = np.full(scene.n, np.inf)
    for disks in (collisions.i, collisions.j):
        np.minimum.at(first_collision, disks[disks >= 0], collisions.t[disks >= 0])
    steady = (v[1:] == v[:-1]).all(axis=2) & ~scene.static & (played.t[1:, None] < first_collision)
    ought = np.linalg.norm(v[1:], axis=2) * scenario.sample_interval / scene.radius
    went = np.linalg.norm(np.diff(played.position, axis=0), axis=2) / scene.radius
    lost = np.where(steady & (ought > LEAST_WAY), 1 - went / np.where(ought > 0, ought, 1.0), 0.0)
    k, disk = np.unravel_index(int(lost.argmax()), lost.shape)
    event = f"disk {disk} moves by {max(1 - float(lost[k, disk]), 0.0):.3g} of its distance"
    return Reading(
        float(lost.max()) / MOST_LOST,
        float(played.t[k + 1]),
        event,
        "wrong distance",
        disk=int(disk),
    )


def _wrong_collisions(scenario: Scenario, played: Trajectory) -> Reading | None:
    scenario, true = answered(scenario)
    if true is None:
        return None
    k = min(len(played), len(true))
    played, true = cut(played, k), cut(true, k)
    dt = scenario.dt(scenario.substeps[0])
    found = match(played.collisions, true.collisions, float(true.t[-1]), dt)
    wrong = found.first_wrong or never_collision(
        played.collisions, true.collisions, float(true.t[-1]) - 3 * dt
    )
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
    "a number is not finite, a disk goes through a wall, energy grows by 5 %, disks overlap by a"
    " tenth of a radius, a disk moves by half its distance only, or a collision is wrong",
    _usable,
)
