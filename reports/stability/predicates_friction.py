"""The predicates for friction: a disk is slowed, turned or moved in another way than by Coulomb's
law."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare.verdicts import SETTLED, Verdict
from crosscheck2d.reports.stability.predicates import (
    Predicate,
    first_above,
    largest,
    read,
    truth_of,
)
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory


def friction_off(scenario: Scenario, played: Trajectory) -> Verdict:
    """The impulse of friction is not that of Coulomb's law."""
    true, scene = truth_of(scenario), scenario.scene
    impulse, expected = friction_impulses(played, scene), friction_impulses(true, scene)
    off = np.abs(impulse - expected) / np.abs(expected)
    way, disk = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(off), off, -1))), off.shape)
    share = impulse[way, disk] / expected[way, disk] + 0.0
    what = ("speed along the surfaces", "spin")[way]
    event = f"friction changes the {what} of disk {disk} by {share:.3g} times the right amount"
    return read(off[way, disk], true.collisions.t[0], event, int(disk))


def friction_impulses(trajectory: Trajectory, scene: Scene) -> Array:
    """(2, n) N s of friction from start to end, once from the disks' velocities (m dv) and once
    from their spins (I dw / r). The two have the same size if friction acts at the rim. Along the
    contact: the floor, or between two disks side by side."""
    tangent = np.array([1.0, 0.0] if len(scene.walls) else [0.0, 1.0])
    dv = (trajectory.velocity[-1] - trajectory.velocity[0]) @ tangent
    dw = trajectory.angular_velocity[-1] - trajectory.angular_velocity[0]
    return np.array([scene.mass * dv, scene.inertia * dw / scene.radius])


def rolling_off(scenario: Scenario, played: Trajectory) -> Verdict:
    """A disk does not roll at the right speed after it has slid."""
    scene = scenario.scene
    speed, rim = (
        np.stack([each.velocity[:, 0, 0], -scene.radius[0] * each.angular_velocity[:, 0]])
        for each in (played, truth_of(scenario))
    )
    off = np.abs(speed - rim).max(axis=0) / np.abs(scene.velocity[0, 0])
    moves, turns = speed[:, -1] / rim[:, -1]
    event = f"it moves at {moves:.4g}, and its rim at {turns:.4g}, of the speed of rolling"
    return read(off[-1], first_above(played.t, off, ROLLING_OFF.bound), event)


def slips(scenario: Scenario, played: Trajectory) -> Verdict:
    """A disk slips on a slope on which it should roll."""
    along = played.velocity[1:, 0, 0]
    slip = along + scenario.scene.radius[0] * played.angular_velocity[1:, 0]
    share = np.abs(slip) / np.where(along, np.abs(along), np.nan)
    at = first_above(played.t[1:], share, SLIPS.bound)
    return read(share[-1], at, f"the rim slips at {share[-1]:.3g} of the speed of the disk")


def creeps(scenario: Scenario, played: Trajectory) -> Verdict:
    """A disk at rest moves or turns after the first tenth of the run."""
    first = int(np.ceil(SETTLED * (len(played) - 1)))
    x, turned = played.position[:, 0], played.angle[:, 0]
    radius = scenario.scene.radius[0]
    moved = np.hypot(*(x - x[first]).T) / radius + np.abs(turned - turned[first])
    moved[:first] = 0.0
    return largest(played.t, moved, CREEPS.bound, f"it has moved by {moved.max():.3g} radii")


FRICTION_OFF = Predicate("friction off", "of the impulse", 0.1, friction_off)
ROLLING_OFF = Predicate("rolling off", "of the start speed", 0.01, rolling_off)
SLIPS = Predicate("slips", "of the speed", 0.05, slips)
CREEPS = Predicate("creeps", "radii", 0.01, creeps)
