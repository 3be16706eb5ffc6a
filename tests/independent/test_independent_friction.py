"""Exact answers with friction against two plain methods that share nothing with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.scenarios.model import Scenario, Scene, Trajectory
from crosscheck2d.scenarios.truth.exact import computed
from tests.independent.frictional_motion import Motion, collisions, sliding
from tests.independent.frictional_scenes import flying, lying

MOST = 8  # collisions
STEPS = 4000


def asked(scene: Scene, until: float) -> Scenario:
    return Scenario("asked", "?", "", scene, until, until)


def exact(scene: Scene, until: float) -> Trajectory:
    record = replace(computed(asked(scene, until)), float64_horizon=np.inf)
    return record.sampled(scene, (), np.array([0.0, until]))


def largest_difference(found: Motion, truth: Trajectory) -> float:
    """Of all positions, velocities, angles and spins at the end, relative to the largest of each
    kind, or to 1."""
    pairs = (
        (found.position, truth.position[-1]),
        (found.velocity, truth.velocity[-1]),
        (found.angle, truth.angle[-1]),
        (found.spin, truth.angular_velocity[-1]),
    )
    return max(float(np.abs(a - b).max() / max(1.0, np.abs(b).max())) for a, b in pairs)


def compare_flying(seed: int) -> int:
    """How many collisions were compared, or -1 where the oracle ends before."""
    scene = flying(seed)
    found = collisions(scene, MOST, 3.0)
    truth = exact(scene, found.t)
    if len(truth) < 2:
        return -1
    assert len(truth.collisions) == found.collisions, seed
    # Each collision of disks a tenth as large as their paths takes a digit or so of the sixteen.
    assert largest_difference(found, truth) < 1e-6, seed
    return found.collisions


def compare_lying(seed: int) -> None:
    scene = lying(seed)
    truth = exact(scene, 1.0)
    place, v, spin = sliding(scene, 1.0, STEPS)
    along = scene.walls[0, 1] / np.hypot(*scene.walls[0, 1])
    # The step in which the slide ends is half wrong: accelerations of 10 m/s2 and 100 rad/s2 times
    # a step, and the way as much for a second.
    off = 4 * 10 / STEPS
    assert len(truth) == 2, seed
    assert abs((truth.position[-1, 0] - truth.position[0, 0]) @ along - place) < off, seed
    assert abs(truth.velocity[-1, 0] @ along - v) < off, seed
    assert abs(truth.angular_velocity[-1, 0] - spin) < 10 * off, seed


def compare_all(count: int) -> None:
    met = [compare_flying(seed) for seed in range(count // 2)]
    for seed in range(count // 2):
        compare_lying(seed)
    print(
        f"{count} scenes with friction: {sum(met)} collisions the same, {met.count(-1)} scenes end"
    )
    assert met.count(-1) <= len(met) // 5
    assert sum(met) > 2 * len(met)


def test_exact_answers_with_friction_are_those_of_plain_methods():
    compare_all(20)


@pytest.mark.independent
def test_two_hundred_exact_answers_with_friction_are_those_of_plain_methods():
    compare_all(200)


@pytest.mark.parametrize(
    "change", [dict(friction=0.101), dict(inertia=1.01), dict(restitution=0.89)]
)
def test_a_slightly_wrong_law_of_friction_would_be_seen(change: dict[str, float]):
    scene = next(
        one for one in map(flying, range(99)) if one.friction == 0.1 and one.restitution == 0.9
    )
    found = collisions(scene, MOST, 3.0)
    wrong = {
        name: scene.inertia * value if name == "inertia" else value
        for name, value in change.items()
    }
    assert largest_difference(found, exact(scene, found.t)) < 1e-6
    assert (
        largest_difference(
            collisions(replace(scene, **wrong), MOST, found.t), exact(scene, found.t)
        )
        > 1e-4
    )
