"""What a scene says by itself: the scales, by which errors of momentum and energy are divided, and
which laws hold in it.

The scales come from the scene, not from a run or the exact answer: otherwise a run that explodes
would make its error look small, and one error would have two values.
"""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

SCALES = {
    "momentum at hand": "kg m/s: sum of m |v|, where |v| is the largest speed that a disk has by"
    " its velocity at the start, by thrusts, and by falling onto the lowest wall or static disk; if"
    " that is 0 for all, by free fall to the end.",
    "angular momentum at hand": "kg m2/s: sum of m (|x| + r) |v| + I |w|, with x at the start, from"
    " the centre of mass, and |v| as in the momentum at hand.",
    "energy at hand": "J: sum of m v2 / 2 + I w2 / 2 + m g h, with the largest speeds and spins by"
    " the start and by thrusts. h is how far a disk falls: until it touches the lowest point of the"
    " walls and static disks, or where none is below it, freely to the end; if the sum is 0, a"
    " radius.",
}


@laws.cached
def momentum(scenario: Scenario) -> float:
    return float(laws.moving_mass(scenario.scene) @ speed_at_hand(scenario))


@laws.cached
def angular_momentum(scenario: Scenario) -> float:
    scene = scenario.scene
    reach = laws.lengths(scene.position - laws.centre(scene)) + scene.radius
    spin = top_speeds(scenario)[1] @ laws.moving_inertia(scene)
    return float((laws.moving_mass(scene) * reach) @ speed_at_hand(scenario) + spin)


@laws.cached
def energy(scenario: Scenario) -> float:
    scene, t = scenario.scene, scenario.duration
    g, m = float(np.linalg.norm(scene.gravity)), laws.moving_mass(scene)
    speed, spin = top_speeds(scenario)
    kinetic = speed**2 @ m + spin**2 @ laws.moving_inertia(scene)
    freely = np.maximum(scene.velocity @ scene.gravity * t + (g * t) ** 2 / 2, 0.0)
    fall = drop(scenario)
    gained = np.where(np.isnan(fall), freely, g * fall) @ m
    return float(kinetic / 2 + gained) or float(g * scene.radius @ m)


def speed_at_hand(scenario: Scenario) -> Array:
    """(n,) m/s. Free fall counts only where nothing else moves: it moves all disks alike, so no
    collision is faster for it."""
    g = float(np.linalg.norm(scenario.scene.gravity))
    speed: Array = np.sqrt(top_speeds(scenario)[0] ** 2 + 2 * g * np.nan_to_num(drop(scenario)))
    return speed if speed.any() else np.full(scenario.scene.n, g * scenario.duration)


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
def top_speeds(scenario: Scenario) -> tuple[Array, Array]:
    """(n,) m/s and (n,) rad/s, the largest by the start and by thrusts; a thrust that turns with
    its disk counts as parallel to the velocity."""
    scene = scenario.scene
    edges = [edge for thrust in scenario.thrusts for edge in (thrust.start, thrust.stop)]
    t = np.clip([0.0, *edges], 0.0, scenario.duration)
    velocity = np.repeat(scene.velocity[None], len(t), axis=0)
    spin = np.repeat(scene.angular_velocity[None], len(t), axis=0)
    turning = np.zeros((len(t), scene.n))
    for thrust in scenario.thrusts:
        disk, time_on = thrust.disk, laws.time_on(thrust, t)
        gained = np.outer(time_on, thrust.force / scene.mass[disk])
        spin[:, disk] += time_on * thrust.torque / scene.inertia[disk]
        if thrust.frame == "world":
            velocity[:, disk] += gained
        else:
            turning[:, disk] += laws.lengths(gained)
    return (laws.lengths(velocity) + turning).max(axis=0), np.abs(spin).max(axis=0)


def knows_impulses(scenario: Scenario) -> bool:
    """Whether weight and world-frame thrust are all that acts from outside."""
    fixed = len(scenario.scene.walls) or scenario.scene.static.any()
    return not fixed and all(thrust.frame == "world" for thrust in scenario.thrusts)


def keeps_energy(scenario: Scenario) -> bool:
    """Whether neither collisions nor friction nor thrust change the energy."""
    scene = scenario.scene
    return scene.restitution == 1 and not scene.friction and not scenario.thrusts


def lifts(scenario: Scenario) -> bool:
    """Whether the wrap lifts disks against gravity: set onto the opposite edge, a disk has another
    height, and no law of energy holds."""
    return scenario.scene.wrap is not None and bool(scenario.scene.gravity.any())


def unexplained_momentum(scenario: Scenario, played: Trajectory) -> Array | None:
    """(k,) |P(t) - P(0) - impulse from outside| over the momentum at hand.

    Weight and world-frame thrust are known. None where walls, static disks or a turning thrust act,
    whose impulse only the engine knows.
    """
    if not knows_impulses(scenario):
        return None
    scene, actual = scenario.scene, laws.momentum(played, scenario.scene)
    expected = actual[0] + np.outer(played.t, laws.moving_mass(scene).sum() * scene.gravity)
    for thrust in scenario.thrusts:
        expected = expected + np.outer(laws.time_on(thrust, played.t), thrust.force)
    return laws.lengths(actual - expected) / (momentum(scenario) or 1.0)
