"""The situation to which each scene belongs."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.model import Scenario, Trajectory

FLIGHT, SINGLE, ROWS, STACKS = "Flight", "Single collisions", "Rows", "Stacks and rest"
CROWDS, SPIN, FRICTION = "Crowds", "Spin", "Friction"
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
    met: dict[int, set[int]] = {}  # disk -> the other disks with which it collides, walls apart
    pairs = () if truth is None else zip(truth.collisions.i, truth.collisions.j)
    for i, j in pairs:
        for disk, partner in ((int(i), int(j)), (int(j), int(i))):
            if disk >= 0:
                met.setdefault(disk, set()).update({partner} if partner >= 0 else ())
    # centres, velocities and gravity: on one line if these vectors have rank 1
    along = [scene.position - scene.position[0], scene.velocity, scene.gravity[None]]
    scaled = np.vstack([rows / (np.abs(rows).max() or 1.0) for rows in along])
    one_line = int(np.linalg.matrix_rank(scaled, tol=1e-9)) <= 1
    if scene.gravity.any() and scene.restitution == 0:
        kind = STACKS
    elif truth is not None and not met:
        kind = FLIGHT
    elif moving > 1 and scene.n + len(scene.walls) > 2 and one_line:
        kind = ROWS
    elif moving <= 2 or (truth is not None and all(len(disks) < 2 for disks in met.values())):
        kind = SINGLE
    else:
        kind = CROWDS
    return [kind, SPIN] if turns else [kind]
