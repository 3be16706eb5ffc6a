"""The predicates for friction: a disk is slowed, turned or moved in another way than by Coulomb's
law."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare.verdicts import SETTLED
from crosscheck2d.reports.stability.predicates import (
    Predicate,
    Reading,
    first_above,
    largest,
    truth_of,
)
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory


def _friction_off(scenario: Scenario, played: Trajectory) -> Reading:
    true, scene = truth_of(scenario), scenario.scene
    tangent = tangent_of(scene)
    found, ought = impulses(played, scene, tangent), impulses(true, scene, tangent)
    off = np.abs(found - ought) / np.abs(ought)
    way, disk = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(off), off, -1))), off.shape)
    share, what = found[way, disk] / ought[way, disk], ("speed along the surfaces", "spin")[way]
    return Reading(
        float(off[way, disk]),
        float(true.collisions.t[0]),
        f"friction changes the {what} of disk {disk} by {share + 0.0:.3g} times the right amount",
        disk=int(disk),
    )


def tangent_of(scene: Scene) -> Array:
    """(2,) unit vector along the contact in these scenes: along the floor, or between two disks
    side by side."""
    return np.array([1.0, 0.0] if len(scene.walls) else [0.0, 1.0])


def impulses(trajectory: Trajectory, scene: Scene, tangent: Array) -> Array:
    """(2, n) N s of friction from start to end, once from the disks' velocities (m dv) and once
    from their spins (I dw / r). The two have the same size if friction acts at the rim."""
    dv = (trajectory.velocity[-1] - trajectory.velocity[0]) @ tangent
    dw = trajectory.angular_velocity[-1] - trajectory.angular_velocity[0]
    return np.array([scene.mass * dv, scene.inertia * dw / scene.radius])


def _rolling_off(scenario: Scenario, played: Trajectory) -> Reading:
    true, scene = truth_of(scenario), scenario.scene
    speed, rim = (
        np.stack([one.velocity[:, 0, 0], -scene.radius[0] * one.angular_velocity[:, 0]])
        for one in (played, true)
    )
    off = np.abs(speed - rim).max(axis=0) / np.abs(scene.velocity[0, 0])
    return Reading(
        float(off[-1]),
        first_above(played.t, off, ROLLING_OFF.bound),
        f"it moves at {speed[0, -1] / rim[0, -1]:.4g}, and its rim at"
        f" {speed[1, -1] / rim[1, -1]:.4g}, of the speed of rolling",
    )


def _slips(scenario: Scenario, played: Trajectory) -> Reading:
    along = played.velocity[1:, 0, 0]
    slip = along + scenario.scene.radius[0] * played.angular_velocity[1:, 0]
    share = np.abs(slip) / np.where(along, np.abs(along), np.nan)
    return Reading(
        float(share[-1]),
        first_above(played.t[1:], share, SLIPS.bound),
        f"the rim slips at {share[-1]:.3g} of the speed of the disk",
    )


def _creeps(scenario: Scenario, played: Trajectory) -> Reading:
    first = int(np.ceil(SETTLED * (len(played) - 1)))
    x, turned = played.position[:, 0], played.angle[:, 0]
    radius = scenario.scene.radius[0]
    moved = np.hypot(*(x - x[first]).T) / radius + np.abs(turned - turned[first])
    moved[:first] = 0.0
    return largest(played.t, moved, CREEPS.bound, f"it has moved by {moved.max():.3g} radii")


FRICTION_OFF = Predicate(
    "friction off",
    "of the impulse",
    0.1,
    "the impulse of friction is not that of Coulomb's law",
    _friction_off,
)
ROLLING_OFF = Predicate(
    "rolling off",
    "of the start speed",
    0.01,
    "a disk does not roll at the right speed after it has slid",
    _rolling_off,
)
SLIPS = Predicate(
    "slips", "of the speed", 0.05, "a disk slips on a slope on which it should roll", _slips
)
CREEPS = Predicate(
    "creeps",
    "radii",
    0.01,
    "a disk at rest moves or turns after the first tenth of the run",
    _creeps,
)
