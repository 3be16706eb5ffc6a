"""The surface of reference_impl: `advance` on arrays, here by numpy over the pairs and without numba."""

import numpy as np

from crosscheck2d.reference_impl.state import Disks, World


def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    collisions = []
    for k in range(count):
        moves = np.isfinite(disks.mass)
        acceleration = world.gravity + disks.force / disks.mass[:, None]
        disks.velocity[moves] += acceleration[moves] * dt
        disks.angular_velocity[moves] += (disks.torque / disks.inertia)[moves] * dt
        disks.position[moves] += disks.velocity[moves] * dt
        disks.angle[moves] += disks.angular_velocity[moves] * dt
        r = disks.position[:, None] - disks.position[None]
        near = np.triu((r**2).sum(axis=2) < 4 * disks.radius.max() ** 2 * 1.5, 1)
        collisions += [(k, i, j, J) for i, j in np.argwhere(near) if (J := collide(disks, world, i, j))]
        wrap(disks.position, world)
    return collisions


def collide(disks, world, i, j):
    r = disks.position[i] - disks.position[j]
    distance, reach = np.hypot(*r), disks.radius[i] + disks.radius[j]
    if distance >= reach:
        return 0.0
    n = r / distance if distance else np.array([0.0, 1.0])
    wi, wj = 1 / disks.mass[i], 1 / disks.mass[j]
    disks.position[i] += n * (reach - distance) * wi / (wi + wj)
    disks.position[j] -= n * (reach - distance) * wj / (wi + wj)
    vn = (disks.velocity[i] - disks.velocity[j]) @ n
    if vn >= 0:
        return 0.0
    J = -(1 + world.restitution) * vn / (wi + wj)
    disks.velocity[i] += J * wi * n
    disks.velocity[j] -= J * wj * n
    return J


def wrap(x, world):
    below, above = x < world.low, x > world.high
    x[below] = np.broadcast_to(world.high, x.shape)[below]
    x[above] = np.broadcast_to(world.low, x.shape)[above]
