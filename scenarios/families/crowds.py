"""Many disks: a published benchmark, and a gas in a box."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, bouncing
from crosscheck2d.scenarios.truth.exact import with_oracle


def simbenchmark_bouncing() -> Scenario:
    """Forty-nine balls dropped side by side from 5 m."""
    n, radius, mass, g = 49, 0.1, 10.0, 9.81
    x, height = 0.5 * (np.arange(n) - n // 2), 5.0 - radius
    scene = lay_out(
        position=np.stack([x, np.full(n, 5.0)], axis=-1),
        velocity=np.zeros((n, 2)),
        radius=np.full(n, radius),
        mass=np.full(n, mass),
        walls=[[[-15, 0], [15, 0]]],
        gravity=[0.0, -g],
        restitution=1.0,
    )

    def truth(t: Array) -> Trajectory:
        legs = bouncing(height, g, 1.0, t[-1])
        gap, speed = legs.at(t)
        position = np.stack(np.broadcast_arrays(x, (gap + radius)[:, None]), axis=-1)
        velocity = np.stack(np.broadcast_arrays(0.0, np.tile(speed[:, None], n)), axis=-1)
        collisions = [
            collision
            for disk in range(n)
            for collision in legs.wall_collisions(disk, (0,), mass, 1.0)
        ]
        return answer(scene, t, (position, velocity), collisions)

    return Scenario(
        name="simbenchmark_bouncing",
        asks="Does every ball of forty-nine keep its energy over twenty seconds of bouncing?",
        source=(
            'SimBenchmark (ETH Zurich, Robotic Systems Lab), "Bouncing", its 7 x 7 balls in one row'
        ),
        scene=scene,
        duration=20.0,
        sample_interval=0.02,
        substeps=(2, 5, 10, 20),
        truth=truth,
    )


def gas_of_100(seed: int = 0) -> Scenario:
    """A hundred equal disks that cover a fifth of a box."""
    rng = np.random.default_rng(seed)
    n = 100
    radius = np.full(n, 0.1)
    position = scatter(rng, [-1.9, -1.9], [1.9, 1.9], radius)
    scene = lay_out(
        position=position,
        velocity=rng.normal(size=(n, 2)),
        radius=radius,
        mass=np.ones(n),
        walls=box([-2, -2], [2, 2]),
        restitution=1.0,
    )
    question = Scenario(
        name="gas_of_100",
        asks="Does a gas of a hundred disks keep its energy over hundreds of collisions?",
        source="the hard-disk gas (Alder & Wainwright, J. Chem. Phys. 31, 459, 1959)",
        scene=scene,
        duration=5.0,
        sample_interval=1 / 60,
        seed=seed,
    )
    return with_oracle(question)


CROWDS = (simbenchmark_bouncing, gas_of_100)
