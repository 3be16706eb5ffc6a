"""The predicates for stacks, piles and overlaps."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.verdicts import (
    MOST_JITTER,
    MOST_RESIDUAL,
    MOST_SINKING,
    Verdict,
    own_speed,
)
from crosscheck2d.reports.stability.predicates import (
    Predicate,
    first_above,
    largest,
    read,
    worst_of,
)
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory

MOST_SPEED = 10.0  # radii/s


def fastest(played: Trajectory, scene: Scene) -> Array:
    """(k,) radii/s."""
    speed: Array = (laws.lengths(played.velocity) / scene.radius).max(axis=1)
    return speed


def stands(scenario: Scenario, played: Trajectory) -> Verdict:
    """A disk sinks by 0.1 radii, or jitters at 0.02 sqrt(g R)."""
    half, moved = len(played) // 2, laws.lengths(played.position - played.position[0])
    radii = (moved / scenario.scene.radius).max(axis=1)
    worst = int(np.argmax(moved[-1]))
    event = f"disk {worst} has moved by {radii.max():.3g} radii"
    speed = laws.lengths(played.velocity[half:]) / own_speed(scenario)
    jitter = float(np.sqrt((speed**2).mean(axis=1)).mean())
    says = f"jitters at {jitter:.3g} sqrt(g R)"
    return worst_of(
        [
            largest(played.t, radii, MOST_SINKING, event, worst, "sinks"),
            read(jitter / MOST_JITTER, played.t[half], says, None, "jitters"),
        ]
    )


def ejected(scenario: Scenario, played: Trajectory) -> Verdict:
    """Two disks that start at rest separate at a speed."""
    speed = fastest(played, scenario.scene)
    at = first_above(played.t, speed, EJECTED.bound)
    return read(speed[-1], at, f"the disks separate at {speed[-1]:.3g} radii/s")


def still_overlaps(scenario: Scenario, played: Trajectory) -> Verdict:
    """An overlap is left after a second."""
    overlap = float(laws.penetration(played, scenario.scene)[-1])
    return read(overlap, played.t[-1], f"an overlap of {overlap:.3g} radii is left")


def bursts(scenario: Scenario, played: Trajectory) -> Verdict:
    """A disk leaves the box, or flies at 10 radii/s."""
    walls, x = scenario.scene.walls, played.position
    low, high = walls.min(axis=(0, 1)), walls.max(axis=(0, 1))
    outside = ((x < low) | (x > high)).any(axis=2).sum(axis=1)
    speed, out = fastest(played, scenario.scene), f"{outside.max()} disks are out of the box"
    flies = f"a disk flies at {speed.max():.3g} radii/s"
    return worst_of(
        [
            largest(played.t, outside, 0.5, out, None, "escape"),
            largest(played.t, speed, MOST_SPEED, flies, None, "energy"),
        ]
    )


def not_at_rest(scenario: Scenario, played: Trajectory) -> Verdict:
    """A disk that should be at rest moves."""
    late = played.velocity[-max(1, len(played) // 10) :]
    speed = np.sqrt((late**2).sum(axis=2).mean(axis=1)) / own_speed(scenario)
    event = f"still moves at {speed.max():.3g} sqrt(g R)"
    return read(speed.max(), played.t[-len(late)], event, None)


STANDS = Predicate("does not stand", "of the bound", 1.0, stands)
EJECTED = Predicate("ejected", "radii/s", 0.1, ejected)
STILL_OVERLAP = Predicate("still overlap", "radii", 0.02, still_overlaps)
BURSTS = Predicate("bursts", "of the bound", 1.0, bursts)
NOT_AT_REST = Predicate("not at rest", "sqrt(g R)", MOST_RESIDUAL, not_at_rest)
