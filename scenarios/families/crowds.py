"""Many disks: a published benchmark, and a gas in a box."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, bouncing
from crosscheck2d.scenarios.truth.exact import with_oracle


def simbenchmark_bouncing() -> Scenario:
    n, radius, mass, g = 49, 0.1, 10.0, 9.81
    x, height = 0.5 * (np.arange(n) - n // 2), 5.0 - radius
    scene = lay_out(
        np.stack([x, np.full(n, 5.0)], axis=-1),
        radius=radius,
        mass=mass,
        walls=[[[-15, 0], [15, 0]]],
        gravity=[0.0, -g],
    )

    def truth(t: Array) -> Trajectory:
        legs = bouncing(height, g, 1.0, t[-1])
        gap, speed = legs.at(t)
        position = np.stack(np.broadcast_arrays(x, (gap + radius)[:, None]), axis=-1)
        velocity = np.stack(np.broadcast_arrays(0.0, np.tile(speed[:, None], n)), axis=-1)
        collisions = [c for i in range(n) for c in legs.wall_collisions(i, (0,), mass, 1.0)]
        return answer(scene, t, (position, velocity), collisions)

    return Scenario(
        "simbenchmark_bouncing",
        "Does every ball of forty-nine keep its energy over twenty seconds of bouncing?",
        'SimBenchmark (ETH Zurich, Robotic Systems Lab), "Bouncing", its 7 x 7 balls in one row',
        scene,
        duration=20.0,
        sample_interval=0.02,
        substeps=(2, 5, 10, 20),
        truth=truth,
    )


def gas_of_100(seed: int = 0) -> Scenario:
    """A hundred equal disks that cover a fifth of a box."""
    rng = np.random.default_rng(seed)
    radius = np.full(100, 0.1)
    scene = lay_out(
        scatter(rng, [-1.9, -1.9], [1.9, 1.9], radius),
        rng.normal(size=(100, 2)),
        radius,
        walls=box([-2, -2], [2, 2]),
    )
    question = Scenario(
        "gas_of_100",
        "Does a gas of a hundred disks keep its energy over hundreds of collisions?",
        "the hard-disk gas (Alder & Wainwright, J. Chem. Phys. 31, 459, 1959)",
        scene,
        duration=5.0,
        seed=seed,
    )
    return with_oracle(question)


CROWDS = (simbenchmark_bouncing(), gas_of_100())
