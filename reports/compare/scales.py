"""The scales of a scenario, by which errors of momentum and energy are divided.

They come from the scene, not from a run: otherwise a run that explodes would make its error look
small.
"""

from __future__ import annotations

import numpy as np

from reports.compare import laws
from scenarios.model import Array, Scenario, Trajectory


@laws.cached
def momentum(scenario: Scenario) -> float:
    """kg m/s: sum of m |v|, with the largest speed that each disk can reach without collisions."""
    return float(laws.moving_mass(scenario.scene) @ top_speed(scenario))


def angular_momentum(scenario: Scenario) -> float:
    """kg m2/s about the centre of mass: sum of m |x||v| + I |w|, with the largest distance and
    speed that each disk can reach without collisions."""
    scene, t = scenario.scene, scenario.duration
    reach = laws.lengths(scene.position - laws.centre(scene)) + top_speed(scenario) * t
    spin = np.abs(scene.angular_velocity) @ laws.moving_inertia(scene)
    return float((laws.moving_mass(scene) * reach) @ top_speed(scenario) + spin)


@laws.cached
def energy(scenario: Scenario, truth: Trajectory | None = None) -> float:
    """J, the energy at hand: the kinetic energy, and what each disk gains by falling, with one
    radius added to each fall.

    With the truth: its largest kinetic energy and the height range of each disk. Without: the
    kinetic energy at the start, and a fall to the lowest wall or disk.
    """
    scene = scenario.scene
    g, m = float(np.linalg.norm(scene.gravity)), laws.moving_mass(scene)
    if truth is not None:
        height = -(truth.position @ scene.gravity)
        fall = height.max(axis=0) - height.min(axis=0)
        return float(laws.kinetic_energy(truth, scene).max() + (fall + scene.radius * g) @ m)
    speed = np.linalg.norm(scene.velocity, axis=1)
    kinetic = speed**2 @ m / 2 + scene.angular_velocity**2 @ laws.moving_inertia(scene) / 2
    if len(scene.walls):
        points = np.concatenate([scene.position, scene.walls.reshape(-1, 2)])
        fall = (points @ scene.gravity).max() - scene.position @ scene.gravity
    else:
        fall = g * (speed * scenario.duration + g * scenario.duration**2 / 2)
    return float(kinetic + (fall + scene.radius * g) @ m)


@laws.cached
def top_speed(scenario: Scenario) -> Array:
    """(n,) m/s, upper bound for each disk in free flight: start velocity, gravity and thrusts added
    up as if parallel."""
    scene = scenario.scene
    speed = (
        np.linalg.norm(scene.velocity, axis=1) + np.linalg.norm(scene.gravity) * scenario.duration
    )
    for thrust in scenario.thrusts:
        burns = min(thrust.stop, scenario.duration) - min(thrust.start, scenario.duration)
        speed[thrust.disk] += np.linalg.norm(thrust.force) * burns / scene.mass[thrust.disk]
    return np.where(scene.static, 0.0, speed)
