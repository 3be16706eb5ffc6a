"""Disks under thrusts, fixed in the world or in the disk; and the scenes of the exercise "Physics
based simulation": a spaceship among asteroids, and the ship alone."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import lay_out, scatter
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, body_thrust, flight, world_thrusts
from crosscheck2d.scenarios.truth.exact import with_oracle

SOURCE = 'Visual Computing, exercise 11, "Physics based simulation"'
LOW, HIGH = [-5.0, -3.0], [5.0, 3.0]
SHIP, SHIP_RADIUS = [-3.5, 0.0], 0.3
SHIP_MASS = np.pi * SHIP_RADIUS**2 * 5
SHIP_INERTIA = np.pi / 2 * SHIP_RADIUS**4
INTERVAL, SIXTIETH = 0.04, 1 / 60  # s
LADDER = (4, 10, 20, 40)  # down to the exercise's own step of 0.001 s

# Key down s, key up s, sign: whole numbers of sample intervals, so that in every step a thrust
# acts from start to end or not at all.
KEYS_DOWN = ((0.20, 1.40, 1), (2.60, 4.00, 1), (4.40, 5.40, -1))  # W, W, S
TURNS = ((0.60, 1.80, 1), (2.20, 3.40, -1), (4.80, 5.20, -1))  # A, D, D


def asteroids(seed: int = 0) -> Scenario:
    question = Scenario(
        "asteroids",
        "Do the engines agree on where a ship and twenty asteroids are after 10 s of collisions?",
        f"{SOURCE}; what overlaps is sampled again",
        asteroid_field(seed),
        duration=10.0,
        sample_interval=INTERVAL,
        substeps=LADDER,
        seed=seed,
    )
    return with_oracle(question)


def asteroid_field(seed: int, count: int = 20, restitution: float = 0.9) -> Scene:
    """The ship, disk 0, at rest among `count` asteroids; what overlaps is sampled again."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.08, 0.3, count)
    radius = np.append(SHIP_RADIUS, size)
    position = scatter(rng, LOW, HIGH, radius, first=SHIP)
    velocity = rng.uniform(0.25, 0.5, (count, 2)) * rng.choice([-1.0, 1.0], (count, 2))
    return lay_out(
        position,
        np.vstack([[0.0, 0.0], velocity]),
        radius,
        np.append(SHIP_MASS, 30 * np.pi * size**2),
        restitution,
        angular_velocity=np.append(0.0, rng.uniform(-0.5, 0.5, count)),
        inertia=np.append(SHIP_INERTIA, np.pi / 2 * size**4),
        wrap=[LOW, HIGH],
    )


def ship_thrust() -> Scenario:
    scene = lay_out(
        [SHIP], radius=SHIP_RADIUS, mass=SHIP_MASS, inertia=[SHIP_INERTIA], restitution=0.9
    )
    turns = [Thrust(0, down, up, np.zeros(2), SHIP_INERTIA * sign) for down, up, sign in TURNS]
    thrusts = list(turns)
    for down, up, sign in KEYS_DOWN:
        # The exercise aims the thrust once, when the key goes down; it does not turn with the ship.
        angle = world_thrusts(scene, turns, np.array([down])).angle[0, 0]
        aim = np.array([np.cos(angle), np.sin(angle)])
        thrusts.append(Thrust(0, down, up, sign * SHIP_MASS * 0.25 * aim))
    return Scenario(
        "ship_thrust",
        "Does a steered ship end where its thrusts and turns carry it?",
        f"{SOURCE}: keys W, S, A, D; x0 + v0 t + F t2 / 2m piece by piece",
        scene,
        duration=6.0,
        sample_interval=INTERVAL,
        substeps=LADDER,
        thrusts=thrusts,
        truth=lambda t: world_thrusts(scene, thrusts, t),
    )


EXERCISE = (ship_thrust(), asteroids())


def spin_under_torque() -> Scenario:
    scene = lay_out(
        [[-3.0, 0.0], [3.0, 1.0]],
        [[0.5, -0.25], [0.0, 0.0]],
        radius=[0.5, 0.3],
        mass=[2.0, 0.7],
        angle=[0.3, 0.0],
        angular_velocity=[-1.0, 0.0],
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
        Thrust(disk, first * SIXTIETH, last * SIXTIETH, np.array(force), torque)
        for disk, first, last, force, torque in table
    ]
    return Scenario(
        "spin_under_torque",
        "Do forces move and torques turn a disk as Newton's second law says?",
        "x0 + v0 t + F t2 / 2m and angle0 + spin0 t + torque t2 / 2I, piece by piece",
        scene,
        duration=4.0,
        thrusts=thrusts,
        truth=lambda t: world_thrusts(scene, thrusts, t),
    )


def body_frame_thrust() -> Scenario:
    force, burn = np.array([1.5, 0.5]), 240 * SIXTIETH
    scene = lay_out(
        [[-1.0, 0.5]], [0.3, -0.2], radius=0.5, mass=2.0, angle=[0.4], angular_velocity=[1.7]
    )

    def truth(t: Array) -> Trajectory:
        burnt, spin = np.minimum(t, burn), scene.angular_velocity[0]
        moved, gained = body_thrust(burnt, force / scene.mass[0], scene.angle[0], spin)
        position, velocity = flight(t[:, None], scene.position[0], scene.velocity[0])
        coast = np.maximum(t - burn, 0)[:, None] * gained
        return answer(scene, t, ((position + moved + coast)[:, None], (velocity + gained)[:, None]))

    return Scenario(
        "body_frame_thrust",
        "Does a jet fixed to a spinning disk drive it around the right curve?",
        "the integral of exp(i (angle + spin t)), twice",
        scene,
        duration=6.0,
        thrusts=[Thrust(0, 0.0, burn, force, frame="body")],
        truth=truth,
    )


THRUSTS = (spin_under_torque(), body_frame_thrust())
