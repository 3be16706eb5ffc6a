"""Disks under thrusts, fixed in the world or in the disk."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Thrust, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, body_thrust, flight, world_thrusts

INTERVAL = 1 / 60


def spin_under_torque() -> Scenario:
    """Two disks, under overlapping thrusts with a torque each."""
    scene = lay_out(
        position=[[-3.0, 0.0], [3.0, 1.0]],
        velocity=[[0.5, -0.25], [0.0, 0.0]],
        angle=[0.3, 0.0],
        angular_velocity=[-1.0, 0.0],
        radius=[0.5, 0.3],
        mass=[2.0, 0.7],
        restitution=1.0,
    )
    # Disk, first and last sample, force N, torque N m: whole intervals, so that every step is under
    # a thrust from its start to its end or not at all.
    table = (
        (0, 0, 240, [0.0, 0.0], 0.125),
        (0, 30, 90, [0.6, 0.2], 0.0),
        (0, 60, 150, [-0.4, 0.5], -0.25),
        (1, 45, 105, [0.1, -0.3], 0.05),
        (1, 105, 180, [-0.2, 0.1], -0.04),
    )
    thrusts = [
        Thrust(disk, first * INTERVAL, last * INTERVAL, np.array(force), torque)
        for disk, first, last, force, torque in table
    ]

    def truth(t: Array) -> Trajectory:
        return world_thrusts(scene, thrusts, t)

    return Scenario(
        name="spin_under_torque",
        asks="Do forces move and torques turn a disk as Newton's second law says?",
        source="x0 + v0 t + F t2 / 2m and angle0 + spin0 t + torque t2 / 2I, piece by piece",
        scene=scene,
        duration=4.0,
        sample_interval=INTERVAL,
        thrusts=thrusts,
        truth=truth,
    )


def body_frame_thrust() -> Scenario:
    """A spinning disk with a jet fixed to it, which burns for 4 s; then it coasts."""
    force, burn = np.array([1.5, 0.5]), 240 * INTERVAL
    scene = lay_out(
        position=[[-1.0, 0.5]],
        velocity=[[0.3, -0.2]],
        angle=[0.4],
        angular_velocity=[1.7],
        radius=[0.5],
        mass=[2.0],
        restitution=1.0,
    )

    def truth(t: Array) -> Trajectory:
        burnt, spin = np.minimum(t, burn), scene.angular_velocity[0]
        moved, gained = body_thrust(burnt, force / scene.mass[0], scene.angle[0], spin)
        position, velocity = flight(t[:, None], scene.position[0], scene.velocity[0])
        coast = np.maximum(t - burn, 0)[:, None] * gained
        return answer(scene, t, ((position + moved + coast)[:, None], (velocity + gained)[:, None]))

    return Scenario(
        name="body_frame_thrust",
        asks="Does a jet fixed to a spinning disk drive it around the right curve?",
        source="the integral of exp(i (angle + spin t)), twice",
        scene=scene,
        duration=6.0,
        sample_interval=INTERVAL,
        thrusts=[Thrust(0, 0.0, burn, force, frame="body")],
        truth=truth,
    )


THRUSTS = (spin_under_torque, body_frame_thrust)
