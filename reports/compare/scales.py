"""The scales of a scenario, by which errors of momentum and energy are divided.

They come from the scene, not from a run or the exact answer: otherwise a run that explodes would
make its error look small, and one error would have two values.
"""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.scenarios.model import Array, Scenario


@laws.cached
def momentum(scenario: Scenario) -> float:
    """kg m/s: sum of m |v|, where |v| is the largest speed that a disk has by its velocity at the
    start, by thrusts, and by falling onto the lowest wall or static disk; if that is 0 for all, by
    free fall to the end."""
    return float(laws.moving_mass(scenario.scene) @ _speed_at_hand(scenario))


@laws.cached
def angular_momentum(scenario: Scenario) -> float:
    """kg m2/s: sum of m (|x| + r) |v| + I |w|, with x at the start, from the centre of mass, and
    |v| as in the momentum at hand."""
    scene = scenario.scene
    reach = laws.lengths(scene.position - laws.centre(scene)) + scene.radius
    spin = top_spin(scenario) @ laws.moving_inertia(scene)
    return float((laws.moving_mass(scene) * reach) @ _speed_at_hand(scenario) + spin)


@laws.cached
def energy(scenario: Scenario) -> float:
    """J: sum of m v2 / 2 + I w2 / 2 + m g h, with the largest speeds and spins by the start and by
    thrusts. h is how far a disk falls: until it touches the lowest point of the walls and static
    disks, or where none is below it, freely to the end; if the sum is 0, a radius."""
    scene, t = scenario.scene, scenario.duration
    g, m = float(np.linalg.norm(scene.gravity)), laws.moving_mass(scene)
    kinetic = top_speed(scenario) ** 2 @ m + top_spin(scenario) ** 2 @ laws.moving_inertia(scene)
    freely = np.maximum(scene.velocity @ scene.gravity * t + (g * t) ** 2 / 2, 0.0)
    fall = drop(scenario)
    gained = np.where(np.isnan(fall), freely, g * fall) @ m
    return float(kinetic / 2 + gained) or float(g * scene.radius @ m)


@laws.cached
def drop(scenario: Scenario) -> Array:
    """(n,) m that a disk can fall until it touches the lowest point of the walls and static disks;
    nan where none is below it, or where the scene wraps."""
    scene = scenario.scene
    down = scene.gravity / (float(np.linalg.norm(scene.gravity)) or 1.0)
    fixed = np.append(scene.walls @ down, (scene.position @ down - scene.radius)[scene.static])
    lowest = fixed.max(initial=-np.inf) if scene.wrap is None else -np.inf
    below = lowest - scene.position @ down
    return np.where(below > 0, np.maximum(below - scene.radius, 0.0), np.nan)


@laws.cached
def top_speed(scenario: Scenario) -> Array:
    """(n,) m/s, the largest by the start and by thrusts; one that turns with its disk counts as
    parallel to the velocity."""
    scene, t = scenario.scene, _edges(scenario)
    velocity = np.repeat(scene.velocity[None], len(t), axis=0)
    turning = np.zeros((len(t), scene.n))
    for thrust in scenario.thrusts:
        gained = np.outer(laws.time_on(thrust, t), thrust.force / scene.mass[thrust.disk])
        if thrust.frame == "world":
            velocity[:, thrust.disk] += gained
        else:
            turning[:, thrust.disk] += laws.lengths(gained)
    speed: Array = (laws.lengths(velocity) + turning).max(axis=0)
    return speed


@laws.cached
def top_spin(scenario: Scenario) -> Array:
    """(n,) rad/s, the largest by the start and by thrusts."""
    scene, t = scenario.scene, _edges(scenario)
    spin = np.repeat(scene.angular_velocity[None], len(t), axis=0)
    for thrust in scenario.thrusts:
        spin[:, thrust.disk] += laws.time_on(thrust, t) * thrust.torque / scene.inertia[thrust.disk]
    largest: Array = np.abs(spin).max(axis=0)
    return largest


def _edges(scenario: Scenario) -> Array:
    """(t,) s, the start, and when each thrust begins and ends."""
    edges = [edge for thrust in scenario.thrusts for edge in (thrust.start, thrust.stop)]
    return np.clip([0.0, *edges], 0.0, scenario.duration)


def _speed_at_hand(scenario: Scenario) -> Array:
    """(n,) m/s. Free fall counts only where nothing else moves: it moves all disks alike, so no
    collision is faster for it."""
    g = float(np.linalg.norm(scenario.scene.gravity))
    speed: Array = np.sqrt(top_speed(scenario) ** 2 + 2 * g * np.nan_to_num(drop(scenario)))
    return speed if speed.any() else np.full(scenario.scene.n, g * scenario.duration)
