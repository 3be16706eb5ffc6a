"""A trajectory as the bytes of a file, and as the trail of a cell that did not end."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from crosscheck2d.scenarios.model import Collisions, Scenario, State, Trajectory, frozen
from crosscheck2d.scenarios.regular import all_of

STATE = ("position", "velocity", "angle", "angular_velocity")
COLLISIONS = {
    "t": "collision_t",
    "i": "collision_i",
    "j": "collision_j",
    "impulse": "collision_impulse",
}


def packed(trajectory: Trajectory, small: bool = False) -> bytes:
    """An .npz with the arrays of `Trajectory`; its collisions as collision_t, _i, _j, _impulse.
    `small` compresses it, which is slower."""
    arrays = {name: getattr(trajectory, name) for name in ("t", *STATE)}
    collisions = {key: getattr(trajectory.collisions, name) for name, key in COLLISIONS.items()}
    file = io.BytesIO()
    (np.savez_compressed if small else np.savez)(file, **arrays, **collisions)
    return file.getvalue()


def load_trajectory(file: Path | bytes) -> Trajectory:
    """The trajectory that `packed` gave, from its bytes or a file."""
    with np.load(io.BytesIO(all_of(file) if isinstance(file, Path) else file)) as saved:
        columns = {name: saved[key] for name, key in COLLISIONS.items()}
        collisions = Collisions(
            **{name: frozen(column, column.dtype) for name, column in columns.items()}
        )
        t, position, velocity, angle, angular_velocity = (
            frozen(saved[name]) for name in ("t", *STATE)
        )
        return Trajectory(t, position, velocity, angle, angular_velocity, collisions)


def parts_of(state: State) -> list[np.ndarray]:
    """The arrays of a state as bytes of a trail."""
    return [np.ascontiguousarray(getattr(state, name), np.float64) for name in STATE]


def from_trail(trail: bytes, scenario: Scenario) -> Trajectory | None:
    """The samples whose `parts_of` a trail holds, without collisions; None if the trail lacks even
    the start."""
    n = scenario.scene.n
    k = len(trail) // (6 * n * 8)
    if not k:
        return None
    table = np.frombuffer(trail[: k * 6 * n * 8]).reshape(k, 6 * n)
    position, velocity, angle, angular_velocity = np.split(table, [2 * n, 4 * n, 5 * n], axis=1)
    return Trajectory(
        t=scenario.times[:k],
        position=frozen(position.reshape(k, n, 2)),
        velocity=frozen(velocity.reshape(k, n, 2)),
        angle=frozen(angle),
        angular_velocity=frozen(angular_velocity),
    )
