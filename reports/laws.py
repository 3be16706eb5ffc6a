"""What is measured on trajectories, sample by sample: momentum, energy, penetration, deviation.

k samples, n disks; a static disk carries no momentum and no energy.
"""

from __future__ import annotations

import numpy as np

from scenarios.model import Array, Scene, Trajectory


def moving_mass(scene: Scene) -> Array:
    """(n,) kg, 0 for static disks."""
    return np.where(scene.static, 0.0, scene.mass)


def momentum(trajectory: Trajectory, scene: Scene) -> Array:
    """(k, 2) kg m/s: sum of m v."""
    return np.einsum("i,kia->ka", moving_mass(scene), trajectory.velocity)


def momentum_scale(trajectory: Trajectory, scene: Scene) -> float:
    """kg m/s: the largest sum of m |v| over the samples; what a momentum error is relative to."""
    speed = np.linalg.norm(trajectory.velocity, axis=2)
    return float((speed @ moving_mass(scene)).max())


def angular_momentum(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) kg m2/s about the origin: sum of m x cross v + I w."""
    x, v = trajectory.position, trajectory.velocity
    orbital = (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]) @ moving_mass(scene)
    return orbital + trajectory.angular_velocity @ np.where(scene.static, 0.0, scene.inertia)


def angular_momentum_scale(trajectory: Trajectory, scene: Scene) -> float:
    """kg m2/s: the largest sum of m |x| |v| + I |w| over the samples."""
    arm = np.linalg.norm(trajectory.position, axis=2) * np.linalg.norm(trajectory.velocity, axis=2)
    spin = np.abs(trajectory.angular_velocity) @ np.where(scene.static, 0.0, scene.inertia)
    return float((arm @ moving_mass(scene) + spin).max())


def kinetic_energy(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) J: sum of m v2 / 2 + I w2 / 2."""
    linear = (trajectory.velocity**2).sum(axis=2) @ moving_mass(scene) / 2
    return linear + trajectory.angular_velocity**2 @ np.where(scene.static, 0.0, scene.inertia) / 2


def energy(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) J: kinetic energy less sum of m g.x (zero at the origin)."""
    return kinetic_energy(trajectory, scene) - (trajectory.position @ scene.gravity) @ moving_mass(scene)


def energy_scale(trajectory: Trajectory, scene: Scene) -> float:
    """J: the energy at hand: the largest kinetic, plus what every disk can gain by falling to its lowest sample
    and one radius further, so that a scene at rest has a scale, too.
    """
    height = -(trajectory.position @ scene.gravity)
    fall = height.max(axis=0) - height.min(axis=0) + scene.radius * np.linalg.norm(scene.gravity)
    return float(kinetic_energy(trajectory, scene).max() + fall @ moving_mass(scene))


def penetration(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) largest overlap of two disks, or of a disk and a wall, in radii of the smaller disk; 0 without overlap."""
    x, r = trajectory.position, scene.radius
    worst = np.zeros(len(trajectory))
    for i in range(scene.n):
        if i + 1 < scene.n:
            gap = np.linalg.norm(x[:, i + 1 :] - x[:, i, None], axis=2) - (r[i] + r[i + 1 :])
            gap[:, scene.static[i + 1 :] & scene.static[i]] = 0.0
            worst = np.maximum(worst, (-gap / np.minimum(r[i], r[i + 1 :])).max(axis=1))
        if not scene.static[i]:
            for start, end in scene.walls:
                distance = distance_to_segment(x[:, i], start, end)
                worst = np.maximum(worst, 1 - distance / r[i])
    return worst


def distance_to_segment(x: Array, start: Array, end: Array) -> Array:
    """(k,) m from points x (k, 2) to the segment."""
    along = np.clip((x - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
    return np.linalg.norm(x - (start + along[:, None] * (end - start)), axis=1)


def deviation(a: Trajectory, b: Trajectory, scene: Scene) -> Array:
    """(k, n) m between the positions in the samples both have; across the nearer edge where the scene wraps."""
    k = min(len(a), len(b))
    apart = a.position[:k] - b.position[:k]
    if scene.wrap is not None:
        size = scene.wrap[1] - scene.wrap[0]
        apart = apart - size * np.round(apart / size)
    return np.linalg.norm(apart, axis=2)
