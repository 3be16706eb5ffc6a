"""The exercise's ship and twenty asteroids between walls instead of the wrap: the scene of the
oracle's figures."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.exercise import HIGH, LOW, SHIP, SHIP_MASS, SHIP_RADIUS
from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Scenario, Scene

COUNT = 20


def boxed(seed: int, restitution: float = 1.0, gravity: float = 0.0) -> Scene:
    """Twenty-one disks in a box of 10 m by 6 m; sizes, speeds and masses as the exercise samples
    them."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.08, 0.3, COUNT)
    radius, room = np.append(SHIP_RADIUS, size), np.array([SHIP_RADIUS, SHIP_RADIUS])
    position = scatter(rng, (LOW + room).tolist(), (HIGH - room).tolist(), radius, first=SHIP)
    velocity = rng.uniform(0.25, 0.5, (COUNT, 2)) * rng.choice([-1.0, 1.0], (COUNT, 2))
    return lay_out(
        position,
        np.vstack([[0.0, 0.0], velocity]),
        radius=radius,
        mass=np.append(SHIP_MASS, 30 * np.pi * size**2),
        restitution=restitution,
        walls=box(LOW, HIGH),
        gravity=[0.0, -gravity],
    )


def lasting(scene: Scene, duration: float) -> Scenario:
    return Scenario("boxed", "?", "the exercise between walls", scene, duration, duration / 100)
