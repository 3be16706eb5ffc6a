"""Whether a scene at large can be used as it was played: it is whole, and no hit is wrong."""

from __future__ import annotations

import numpy as np

from reports import laws, scales
from reports.collisions import match
from reports.comparison import answered, cut
from reports.stability.predicates import Predicate, Reading, first_above
from scenarios.model import Scenario, Trajectory

MOST_RISE, MOST_OVERLAP = 0.05, 0.1  # of the energy at hand; radii


def _usable(scenario: Scenario, played: Trajectory) -> Reading:
    parts = [part for part in (_rise(scenario, played), _overlap(scenario, played), _escape(scenario, played),
             _wrong_hits(scenario, played)) if part is not None]  # fmt: skip
    return max(parts, key=lambda part: part.value, default=Reading(0.0))  # a disk alone can do nothing wrong


def _rise(scenario: Scenario, played: Trajectory) -> Reading | None:
    if scenario.thrusts or (scenario.scene.wrap is not None and scenario.scene.gravity.any()):
        return None
    energy = laws.energy(played, scenario.scene)
    rise = (energy - energy[0]) / (scales.energy(scenario) or 1.0)
    at = first_above(played.t, rise, MOST_RISE)
    return Reading(
        float(rise.max()) / MOST_RISE, at, f"energy grows by {rise.max():.3g} of what is at hand", "energy", disk=-1
    )


def _overlap(scenario: Scenario, played: Trajectory) -> Reading | None:
    if scenario.scene.n + len(scenario.scene.walls) < 2:
        return None
    overlap = laws.penetration(played, scenario.scene)
    at = first_above(played.t, overlap, MOST_OVERLAP)
    return Reading(
        float(overlap.max()) / MOST_OVERLAP, at, f"an overlap of {overlap.max():.3g} radii", "penetration", disk=-1
    )


def _escape(scenario: Scenario, played: Trajectory) -> Reading | None:
    if not len(scenario.scene.walls):
        return None
    through = np.flatnonzero(laws.through_walls(played, scenario.scene))
    event = f"disk {through[0]} goes through a wall" if len(through) else ""
    return Reading(
        2.0 * len(through), float(played.t[-1]), event, "escape", disk=int(through[0]) if len(through) else -1
    )


def _wrong_hits(scenario: Scenario, played: Trajectory) -> Reading | None:
    scenario, true = answered(scenario)
    if true is None:
        return None
    k = min(len(played), len(true))
    played, true = cut(played, k), cut(true, k)
    found = match(played.collisions, true.collisions, float(true.t[-1]), scenario.dt(scenario.substeps[0]))
    if found.first_wrong is None:
        return None
    at, what = found.first_wrong
    kind, pair = what.split(maxsplit=1)
    wrong = len(found.missed) + len(found.invented)
    return Reading(2.0 * wrong, at, f"{kind} hit: {pair}", "hits", disk=int(pair.split("-")[0]))


USABLE = Predicate(
    "unusable", "of the bound", 1.0,
    "not finite, through a wall, 5 % more energy, an overlap of a tenth of a radius, or a wrong hit", _usable,
)  # fmt: skip
