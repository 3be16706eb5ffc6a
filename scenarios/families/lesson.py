"""The scenes of the lesson "Simple body dynamics": a body, its flight, a boundary, a box of falling
disks."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, flight, to_and_fro
from crosscheck2d.scenarios.truth.exact import with_oracle

SOURCE = 'the lesson "Simple body dynamics"'


def free_fall(spin: float = 2.0) -> Scenario:
    """One disk, thrown: with a spin (rad/s), or without for engines that model no rotation."""
    scene = lay_out(
        [[-4.0, 1.0]],
        [3.0, 7.0],
        mass=2.0,
        angle=[0.5],
        angular_velocity=[spin],
        gravity=[0.0, -9.81],
    )

    def truth(t: Array) -> Trajectory:
        return answer(
            scene, t, flight(t[:, None, None], scene.position, scene.velocity, scene.gravity)
        )

    return Scenario(
        "free_fall" if spin else "free_fall_without_spin",
        "How far off the parabola does a thrown disk fly"
        f"{'' if spin else ', if it does not turn'}?",
        f"{SOURCE}, part 3; x + v t + g t2 / 2",
        scene,
        duration=1.5,
        truth=truth,
    )


def ping_pong() -> Scenario:
    radius, low, high = 0.25, 1.0, 11.0
    scene = lay_out(
        [[0.0, 6.3213]],
        [0.0, 1.0],
        walls=[[[-5, low - radius], [5, low - radius]], [[-5, high + radius], [5, high + radius]]],
    )

    def truth(t: Array) -> Trajectory:
        legs = to_and_fro(scene.position[0, 1] - low, 1.0, high - low, 1.0, t[-1])
        y, speed = legs.at(t)
        position, velocity = (
            np.stack([np.zeros_like(y), a], axis=-1)[:, None] for a in (y + low, speed)
        )
        return answer(scene, t, (position, velocity), legs.wall_collisions(0, (1, 0), 1.0, 1.0))

    return Scenario(
        "ping_pong",
        "Does a disk that ping-pongs between two walls keep its speed and its period of 20 s?",
        f"{SOURCE}, part 2",
        scene,
        duration=40.0,
        sample_interval=1 / 30,
        truth=truth,
    )


def falling_box(seed: int = 0) -> Scenario:
    rng = np.random.default_rng(seed)
    radius = np.full(30, 0.03)
    scene = lay_out(
        scatter(rng, [0.03, 0.03], [0.97, 0.97], radius),
        rng.uniform(-1, 1, (30, 2)),
        radius,
        restitution=0.95,
        walls=box([0, 0], [1, 1]),
        gravity=[0.0, -9.81],
    )
    question = Scenario(
        "falling_box",
        "Do thirty disks that fall in a box stay inside without overlap, and lose energy only by"
        " collisions?",
        f"{SOURCE}, parts 3 and 4, in two dimensions",
        scene,
        duration=2.0,
        seed=seed,
    )
    return with_oracle(question)


LESSON = (free_fall(), free_fall(spin=0.0), ping_pong(), falling_box())
