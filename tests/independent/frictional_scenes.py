"""Random scenes with friction: disks that fly and collide, and disks that slide on an incline."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import box, scatter
from crosscheck2d.scenarios.model import Scene

# Sides a, b and hypotenuse c of right triangles in whole numbers: on a wall along (b, a) a disk of
# radius c k rests exactly in float64, as its centre is at k (-a, b).
TRIANGLES = ((0, 1, 1), (3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25), (20, 21, 29))


def flying(seed: int) -> Scene:
    """Up to five disks in a box or between two loose walls, some static, with gravity or none.

    Not at e = 0, where contacts last, which the plain method does not know.
    """
    draw = np.random.default_rng([19, seed])
    n = int(draw.integers(1, 6))
    radius = draw.uniform(0.05, 0.3, n)
    walls = box([-1.6, -1.3], [1.7, 1.5])
    if seed % 2:
        walls = draw.uniform(-1, 1, (2, 2, 2)) + [[[0, -2.4]], [[0, 2.4]]]
    fixed = (draw.random(n) < 0.2) & (np.arange(n) > 0)
    mass = np.where(fixed, np.inf, draw.uniform(0.3, 5, n))
    spin = np.where(fixed, 0.0, draw.normal(size=n) * draw.choice([0.0, 5.0, 50.0]))
    return Scene(
        position=scatter(draw, [-1.2, -0.9], [1.3, 1.1], radius),
        velocity=np.where(fixed[:, None], 0.0, draw.normal(size=(n, 2)) * 2),
        angular_velocity=spin,
        radius=radius,
        mass=mass,
        inertia=mass * radius**2 * draw.uniform(0.3, 1.0),
        walls=walls,
        restitution=float(draw.choice([0.3, 0.6, 0.9, 1.0])),
        friction=float(draw.choice([0.02, 0.1, 0.3, 1.0, 3.0])),
        gravity=draw.normal(size=2) * (draw.random() < 0.6),
    )


def lying(seed: int) -> Scene:
    """A disk that lies on an incline, above or below the angle at which it rolls; it slides and
    spins on a level floor only, where that is exact."""
    draw = np.random.default_rng([20, seed])
    a, b, c = TRIANGLES[seed % len(TRIANGLES)]
    scale, mirror = 2.0 ** -int(np.ceil(np.log2(4 * c))), 1 - 2 * (seed % 4 // 2)
    radius, level = c * scale, a == 0
    return Scene(
        position=[[-a * mirror * scale, b * scale]],
        velocity=[[draw.normal() * 3 * level, 0.0]],
        angular_velocity=[draw.normal() * 20],
        radius=[radius],
        mass=[draw.uniform(0.3, 5)],
        inertia=[radius**2 * draw.uniform(0.3, 1.5)],
        walls=[[[-512.0 * b, -512.0 * a * mirror], [512.0 * b, 512.0 * a * mirror]]],
        restitution=0.5,
        friction=float(draw.uniform(0.02, 0.6)),
        gravity=[0.0, -10.0],
    )
