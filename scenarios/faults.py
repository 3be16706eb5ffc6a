"""Checks a scene, a thrust or a scenario: a `ValueError` names the field, its value and what it
must be.

Each function takes a type of `model.py`, which is not imported here because it imports this file.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np


def check_scene(scene: Any) -> None:
    if faults := shape_faults(scene) or [*disk_faults(scene), *surrounding_faults(scene)]:
        raise ValueError("; ".join(faults))


def shape_faults(scene: Any) -> list[str]:
    n = len(np.atleast_1d(scene.radius))
    shapes = {
        **dict.fromkeys(("position", "velocity"), (n, 2)),
        **dict.fromkeys(("radius", "mass", "angle", "angular_velocity", "inertia"), (n,)),
        "gravity": (2,),
        "wrap": (2, 2),
    }
    faults = [
        f"{name} has shape {getattr(scene, name).shape}, must be {shape}"
        for name, shape in shapes.items()
        if getattr(scene, name) is not None and getattr(scene, name).shape != shape
    ]
    if scene.walls.ndim != 3 or scene.walls.shape[1:] != (2, 2):
        faults.append(f"walls has shape {scene.walls.shape}, must be (w, 2, 2)")
    return faults


def disk_faults(scene: Any) -> list[str]:
    faults = [] if scene.n else ["radius is empty, must have at least one disk"]
    finite = ("position", "velocity", "angle", "angular_velocity", "walls", "gravity")
    faults += [
        f"{name} holds a value that is not finite"
        for name in finite
        if not np.isfinite(getattr(scene, name)).all()
    ]
    for i in range(scene.n):
        if not (0 < scene.radius[i] < np.inf):
            faults.append(f"radius[{i}] is {scene.radius[i]:g} m, must be positive and finite")
        if not scene.mass[i] > 0:
            faults.append(f"mass[{i}] is {scene.mass[i]:g} kg, must be positive (inf: static)")
        if not scene.inertia[i] > 0:
            faults.append(f"inertia[{i}] is {scene.inertia[i]:g} kg m2, must be positive")
        if np.isinf(scene.mass[i]) and (scene.velocity[i].any() or scene.angular_velocity[i]):
            faults.append(f"velocity[{i}] of a static disk (mass inf) must be zero")
    return faults


def surrounding_faults(scene: Any) -> list[str]:
    faults = []
    for name, most, must in (
        ("restitution", 1.0, "from 0 to 1"),
        ("friction", np.finfo(float).max, "at least 0 and finite"),
    ):
        value = getattr(scene, name)
        if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf":
            faults.append(f"{name} is {value!r}, must be a number {must}")
        elif not 0 <= value <= most:
            faults.append(f"{name} is {value:g}, must be {must}")
    for w in np.flatnonzero((scene.walls[:, 0] == scene.walls[:, 1]).all(axis=1)):
        faults.append(f"walls[{w}] has no length, must go from one point to another")
    if scene.wrap is None:
        return faults
    low, high = scene.wrap
    if not (low < high).all():
        corners = [low.tolist(), high.tolist()]
        return [*faults, f"wrap is {corners}, must be [low, high] with low below high"]
    outside = ((scene.position < low) | (scene.position > high)).any(axis=1)
    return faults + [
        f"position[{i}] is {scene.position[i].tolist()} m, must be inside the wrap box"
        for i in np.flatnonzero(outside)
    ]


def check_thrust(thrust: Any) -> None:
    force, torque = thrust.force, thrust.torque
    if force.shape != (2,) or not np.isfinite([*force, torque]).all():
        raise ValueError(
            f"thrust: force {force} and torque {torque} must be finite (2,) and scalar"
        )
    if not 0 <= thrust.start < thrust.stop:
        raise ValueError(
            f"thrust: start {thrust.start:g} s must be at least 0 and before stop {thrust.stop:g} s"
        )
    if thrust.frame not in ("world", "body"):
        raise ValueError(f"thrust: frame is {thrust.frame!r}, must be 'world' or 'body'")


def check_scenario(scenario: Any) -> None:
    if not re.fullmatch(r"[a-z0-9][a-z0-9_-]*", scenario.name):
        raise ValueError(
            f"name is {scenario.name!r}, must be lower-case letters, digits, '_' and '-'"
        )
    duration, interval = scenario.duration, scenario.sample_interval
    if not (0 < interval < np.inf and 0 < duration < np.inf):
        raise ValueError("duration and sample_interval must be positive and finite")
    if abs(duration / interval - scenario.intervals) > 1e-9 * scenario.intervals:
        raise ValueError(
            f"sample_interval {interval:g} s does not divide the duration {duration:g} s"
        )
    substeps = list(scenario.substeps)
    whole = all(k == int(k) and k >= 1 for k in substeps)
    if not substeps or not whole or sorted(set(substeps)) != substeps:
        raise ValueError(f"substeps is {substeps}, must be whole numbers from 1, increasing")
    for thrust in scenario.thrusts:
        if not 0 <= thrust.disk < scenario.scene.n:
            raise ValueError(
                f"thrust: disk {thrust.disk} is not one of the {scenario.scene.n} disks"
            )
