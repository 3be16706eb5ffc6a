"""Checks for both Box2Ds, which compute in float32."""

from __future__ import annotations

import numpy as np

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.scenarios.model import Array, Scene


def must_fit(scene: Scene, length: float = 1.0, time: float = 1.0) -> None:
    """Raise `Unsupported` if a number of the scene, in the engine's units, overflows in float32, or
    a size or mass underflows.

    length, time: units of length in a metre, seconds in a unit of time.
    """
    quantities = {
        "position": scene.position * length,
        "velocity": scene.velocity * (time * length),
        "radius": scene.radius * length,
        "mass": scene.mass,
        "inertia": scene.inertia * length**2,
        "angle": scene.angle,
        "angular_velocity": scene.angular_velocity * time,
        "walls": scene.walls * length,
        "gravity": scene.gravity * (time * length) * time,
    }
    largest, smallest = float(np.finfo(np.float32).max), float(np.finfo(np.float32).tiny)
    for name, given in quantities.items():
        values = np.abs(given)
        sized = name in ("radius", "mass", "inertia")
        too_small = (values < smallest) & sized
        for bad in values[too_small | (np.isfinite(values) & (values > largest))]:
            raise Unsupported(f"{name} {bad:g} does not fit into float32")


def must_not_be_cut(what: str, values: Array, cap: float, unit: str, by: str) -> None:
    """Raise `Unsupported` if the engine has reduced `values` to its cap: an engine plays a scene as
    stated or refuses it. `by`: what sets the cap, the end of the sentence."""
    # in float32 a cut value is a little below the cap
    if np.abs(values).max() > cap * (1 - 1e-5):
        raise Unsupported(
            f"a disk reaches a {what} of {cap:.4g} {unit}, the most that Box2D allows at this dt:"
            f" {by}"
        )


def rounding(scene: Scene) -> float:
    """m, the largest change of a start position by rounding to float32."""
    nearest: Array = scene.position.astype(np.float32).astype(np.float64)
    return float(np.abs(nearest - scene.position).max())


def vector(array: Array) -> tuple[float, float]:
    """A pair of Python floats: the binding takes no numpy scalars."""
    return float(array[0]), float(array[1])
