"""The situation to which each scene belongs."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.model import Scenario, Trajectory

FLIGHT, SINGLE, ROWS, STACKS, CROWDS, SPIN, FRICTION = (
    "Flight",
    "Single collisions",
    "Rows",
    "Stacks and rest",
    "Crowds",
    "Spin",
    "Friction",
)
SITUATIONS = {
    FLIGHT: "no collisions in the exact answer",
    SINGLE: "at most two disks move, or no disk meets two others",
    ROWS: "two or more disks on one line, and a third body",
    STACKS: "gravity and e = 0: contacts that last",
    CROWDS: "disks that meet many others",
    SPIN: "a disk turns; these scenes also count above",
    FRICTION: "with friction; these scenes count in no other row",
}


def situations_of(scenario: Scenario, truth: Trajectory | None) -> list[str]:
    """The situation of a scene, of the first five of `SITUATIONS`, and `SPIN` if a disk turns;
    `FRICTION` alone of a scene with friction.

    truth: its collisions say which disks meet; without it all disks may meet.
    """
    scene = scenario.scene
    if scene.friction:
        return [FRICTION]
    moving = int(np.isfinite(scene.mass).sum())
    turns = bool(scene.angular_velocity.any()) or any(t.torque for t in scenario.thrusts)
    met = None if truth is None else partners(truth)
    if scene.gravity.any() and scene.restitution == 0:
        found = STACKS
    elif met == {}:
        found = FLIGHT
    elif moving > 1 and scene.n + len(scene.walls) > 2 and on_one_line(scenario):
        found = ROWS
    elif moving <= 2 or (met is not None and all(len(others) < 2 for others in met.values())):
        found = SINGLE
    else:
        found = CROWDS
    return [found, SPIN] if turns else [found]


def partners(truth: Trajectory) -> dict[int, set[int]]:
    """Disk -> the other disks with which it collides; empty if it meets walls only."""
    met: dict[int, set[int]] = {}
    for i, j in zip(truth.collisions.i.tolist(), truth.collisions.j.tolist()):
        for one, other in ((i, j), (j, i)):
            if one >= 0:
                met.setdefault(one, set()).update({other} if other >= 0 else ())
    return met


def on_one_line(scenario: Scenario) -> bool:
    """Whether all centres lie on one line, with all velocities and gravity along it."""
    scene = scenario.scene
    spread = scene.position - scene.position[0]
    along = [spread, scene.velocity, scene.gravity[None]]
    rows = np.vstack([each / (np.abs(each).max() or 1.0) for each in along])
    return int(np.linalg.matrix_rank(rows, tol=1e-9)) <= 1
