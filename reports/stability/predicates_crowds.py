"""The predicates for stacks, piles and overlaps."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.verdicts import (
    MOST_JITTER,
    MOST_RESIDUAL,
    MOST_SINKING,
    own_speed,
)
from crosscheck2d.reports.stability.predicates import Predicate, Reading, first_above, largest
from crosscheck2d.scenarios.model import Scenario, Trajectory


def _stands(scenario: Scenario, played: Trajectory) -> Reading:
    scene = scenario.scene
    moved = (np.linalg.norm(played.position - played.position[0], axis=2) / scene.radius).max(
        axis=1
    )
    speed = np.linalg.norm(played.velocity[len(played) // 2 :], axis=2) / own_speed(scenario)
    jitter = float(np.sqrt((speed**2).mean(axis=1)).mean())
    worst = int(np.argmax(np.linalg.norm(played.position[-1] - played.position[0], axis=1)))
    event, most = f"disk {worst} has moved by {moved.max():.3g} radii", MOST_SINKING
    sinks = largest(played.t, moved, most, event, of=most, broken="sinks", disk=worst)
    jitters = Reading(
        jitter / MOST_JITTER,
        float(played.t[len(played) // 2]),
        f"jitters at {jitter:.3g} sqrt(g R)",
        "jitters",
        disk=-1,
    )
    return max(sinks, jitters)


def _ejected(scenario: Scenario, played: Trajectory) -> Reading:
    speed = (np.linalg.norm(played.velocity, axis=2) / scenario.scene.radius).max(axis=1)
    return Reading(
        float(speed[-1]),
        first_above(played.t, speed, EJECTED.bound),
        f"the disks separate at {speed[-1]:.3g} radii/s",
    )


def _still_overlap(scenario: Scenario, played: Trajectory) -> Reading:
    left = laws.penetration(played, scenario.scene)
    return Reading(
        float(left[-1]), float(played.t[-1]), f"an overlap of {left[-1]:.3g} radii is left"
    )


def _bursts(scenario: Scenario, played: Trajectory) -> Reading:
    scene = scenario.scene
    low, high = scene.walls.min(axis=(0, 1)), scene.walls.max(axis=(0, 1))
    outside = ((played.position < low) | (played.position > high)).any(axis=2).sum(axis=1)
    speed = (np.linalg.norm(played.velocity, axis=2) / scene.radius).max(axis=1)
    event = f"{outside.max()} disks are out of the box"
    escapes = largest(played.t, outside, 0.5, event, of=0.5, broken="escape", disk=-1)
    event = f"a disk flies at {speed.max():.3g} radii/s"
    flies = largest(played.t, speed, MOST_SPEED, event, of=MOST_SPEED, broken="energy", disk=-1)
    return max(escapes, flies)


def _not_at_rest(scenario: Scenario, played: Trajectory) -> Reading:
    late = played.velocity[-max(1, len(played) // 10) :]
    speed = np.sqrt((late**2).sum(axis=2).mean(axis=1)) / own_speed(scenario)
    return Reading(
        float(speed.max()),
        float(played.t[-len(late)]),
        f"still moves at {speed.max():.3g} sqrt(g R)",
        disk=-1,
    )


MOST_SPEED = 10.0  # radii/s

STANDS = Predicate(
    "does not stand",
    "of the bound",
    1.0,
    "a disk sinks by 0.1 radii, or jitters at 0.02 sqrt(g R)",
    _stands,
)
EJECTED = Predicate(
    "ejected", "radii/s", 0.1, "two disks that start at rest separate at a speed", _ejected
)
STILL_OVERLAP = Predicate(
    "still overlap", "radii", 0.02, "an overlap is left after a second", _still_overlap
)
BURSTS = Predicate(
    "bursts", "of the bound", 1.0, "a disk leaves the box, or flies at 10 radii/s", _bursts
)
NOT_AT_REST = Predicate(
    "not at rest", "sqrt(g R)", MOST_RESIDUAL, "a disk that should be at rest moves", _not_at_rest
)
