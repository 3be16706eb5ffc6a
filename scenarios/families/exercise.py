"""The scenes of the exercise "Physics based simulation": a spaceship among asteroids, and the ship
alone."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import lay_out, scatter
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import world_thrusts
from crosscheck2d.scenarios.truth.exact import with_oracle

SOURCE = 'Visual Computing, exercise 11, "Physics based simulation"'
LOW, HIGH = [-5.0, -3.0], [5.0, 3.0]
SHIP, SHIP_RADIUS = [-3.5, 0.0], 0.3
SHIP_MASS = np.pi * SHIP_RADIUS**2 * 5
SHIP_INERTIA = np.pi / 2 * SHIP_RADIUS**4
INTERVAL = 0.04
LADDER = (4, 10, 20, 40)  # down to the exercise's own step of 0.001 s

# Key down s, key up s, sign: whole numbers of sample intervals, so that in every step a thrust
# acts from start to end or not at all.
KEYS_DOWN = ((0.20, 1.40, 1), (2.60, 4.00, 1), (4.40, 5.40, -1))  # W, W, S
TURNS = ((0.60, 1.80, 1), (2.20, 3.40, -1), (4.80, 5.20, -1))  # A, D, D


def asteroids(seed: int = 0) -> Scenario:
    """The ship at rest among twenty asteroids, sampled as in the exercise, but without overlaps."""
    question = Scenario(
        name="asteroids",
        asks=(
            "Do the engines agree on where a ship and twenty asteroids are after 10 s of"
            " collisions?"
        ),
        source=f"{SOURCE}; what overlaps is sampled again",
        scene=asteroid_field(seed),
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
        position=position,
        velocity=np.vstack([[0.0, 0.0], velocity]),
        angular_velocity=np.append(0.0, rng.uniform(-0.5, 0.5, count)),
        radius=radius,
        mass=np.append(SHIP_MASS, 30 * np.pi * size**2),
        inertia=np.append(SHIP_INERTIA, np.pi / 2 * size**4),
        restitution=restitution,
        wrap=[LOW, HIGH],
    )


def ship_thrust() -> Scenario:
    """The ship alone, steered by keys held for known times."""
    scene = lay_out(
        position=[SHIP],
        velocity=[[0.0, 0.0]],
        radius=[SHIP_RADIUS],
        mass=[SHIP_MASS],
        inertia=[SHIP_INERTIA],
        restitution=0.9,
    )
    turns = [Thrust(0, down, up, np.zeros(2), SHIP_INERTIA * sign) for down, up, sign in TURNS]
    thrusts = list(turns)
    for down, up, sign in KEYS_DOWN:
        # The exercise aims the thrust once, when the key goes down; it does not turn with the ship.
        angle = world_thrusts(scene, turns, np.array([down])).angle[0, 0]
        aim = np.array([np.cos(angle), np.sin(angle)])
        thrusts.append(Thrust(0, down, up, sign * SHIP_MASS * 0.25 * aim))

    def truth(t: Array) -> Trajectory:
        return world_thrusts(scene, thrusts, t)

    return Scenario(
        name="ship_thrust",
        asks="Does a steered ship end where its thrusts and turns carry it?",
        source=f"{SOURCE}: keys W, S, A, D; x0 + v0 t + F t2 / 2m piece by piece",
        scene=scene,
        duration=6.0,
        sample_interval=INTERVAL,
        substeps=LADDER,
        thrusts=thrusts,
        truth=truth,
    )


EXERCISE = (ship_thrust, asteroids)
