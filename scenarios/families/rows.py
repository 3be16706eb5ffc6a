"""Disks on one line that collide in turn: the line gas, Galperin's billiard, the cradle."""

from __future__ import annotations

from functools import partial

import numpy as np

from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import Motion, answer
from crosscheck2d.scenarios.truth.exact import with_oracle
from crosscheck2d.scenarios.truth.lines import galperin, galperin_collisions, row, row_collisions

EPS = float(np.finfo(float).eps)


def _on_line(x: Array, v: Array) -> Motion:
    """(..., 2) m, m/s: positions or velocities x and v (...,) along the line y = 0."""
    zero = np.zeros_like(x)
    return np.stack([x, zero], axis=-1), np.stack([v, zero], axis=-1)


def _row_answer(scene: Scene, length: float, t: Array) -> Trajectory:
    x, v, radius = scene.position[:, 0], scene.velocity[:, 0], float(scene.radius[0])
    collisions = row_collisions(x, v, radius, length, 1.0, t[-1])
    return answer(scene, t, _on_line(*row(x, v, radius, length, t)), collisions)


def line_gas() -> Scenario:
    n, radius, length = 15, 0.25, 12.0
    # Irregular without random numbers; plain multiples i sqrt(2) would cause simultaneous
    # collisions.
    squares = np.arange(1, n + 2) ** 2
    gap = 0.2 + (squares * np.sqrt(5)) % 1
    v = 4 * ((squares[:n] * np.sqrt(2)) % 1) - 2
    x = (
        np.cumsum(gap)[:-1] / gap.sum() * (length - 2 * radius * n)
        + radius
        + 2 * radius * np.arange(n)
    )
    scene = lay_out(*_on_line(x, v), walls=[[[0, -1], [0, 1]], [[length, -1], [length, 1]]])

    return Scenario(
        "line_gas",
        "How does the error grow over hundreds of collisions where there is no chaos?",
        "Tonks, Phys. Rev. 50, 955 (1936); Jepsen, J. Math. Phys. 6, 405 (1965)",
        scene,
        duration=9.15,  # 278 collisions
        truth=partial(_row_answer, scene, length),
    )


def counting_pi(
    collisions: int, ratio: float, duration: float, ladder: tuple[int, ...]
) -> Scenario:
    """A wall, a light disk and one 100^k times as heavy, whose number of collisions has the digits
    of pi."""
    radius, speed = np.array([0.25, 0.5]), 0.25
    mass, gap = np.array([1.0, ratio]), np.array([1.0, 1.4246])
    # From free room to centres: the light disk's width is in front of the heavy one.
    shift = np.array([radius[0], 2 * radius[0] + radius[1]])
    start = _on_line(gap + shift, np.array([0.0, -speed]))
    scene = lay_out(*start, radius, mass, walls=[[[0, -2], [0, 2]]])

    def truth(t: Array) -> Trajectory:
        room, rate = galperin(gap, speed, mass, t)
        motion, all_collisions = _on_line(room + shift, rate), galperin_collisions(gap, speed, mass)
        # The unfolding angle, up to pi, is rounded; its lever is the heavy disk's weighted
        # distance.
        lever = float(np.sqrt(mass[1] / mass[0])) * float(np.abs(gap[1] - speed * t).max())
        return answer(scene, t, motion, all_collisions, error_bound=4 * EPS * lever)

    return Scenario(
        f"galperin_{collisions}",
        f"Do a wall, a light disk and a heavy one collide exactly {collisions} times?",
        "Galperin, Playing pool with pi, Regul. Chaotic Dyn. 8, 375 (2003)",
        scene,
        duration,
        substeps=ladder,
        truth=truth,
    )


IN_CRADLE = np.array([1.0, 1.0, 0.0, 0.0, 0.0])  # m/s: two of five disks move in


def cradle_with_gaps() -> Scenario:
    x = np.array([-2.355, -1.8447, 0.0, 0.5169, 1.0317])
    scene = lay_out(*_on_line(x, IN_CRADLE))
    return Scenario(
        "cradle_with_gaps",
        "Do two disks leave a cradle when two come in, if a centimetre lies between its disks?",
        "equal masses swap velocities at e = 1: they stay sorted",
        scene,
        duration=4.0,
        truth=partial(_row_answer, scene, np.inf),
    )


ROWS = (
    line_gas(),
    counting_pi(3, 1.0, 12.0, (1, 2, 4, 8)),
    counting_pi(31, 1e2, 15.0, (1, 2, 4, 8)),
    # its collisions follow each other by 0.4 ms
    counting_pi(314, 1e4, 31.0, (1, 4, 16, 64)),
    cradle_with_gaps(),
    with_oracle(
        Scenario(
            "cradle_touching",
            "Do two disks leave a cradle when two come in, if its disks touch?",
            "the limit of small gaps, which is the same in whatever order the collisions come",
            # Binary fractions, so that the disks touch exactly.
            lay_out(*_on_line(np.array([-2.2587890625, -1.7587890625, 0.0, 0.5, 1.0]), IN_CRADLE)),
            duration=4.0,
        )
    ),
    # A disk, a resting one and a wall, 1 cm apart each, so that three collisions follow within a
    # step.
    with_oracle(
        Scenario(
            "two_disks_and_a_wall",
            "Do two disks that meet a wall and each other within one step keep their energy?",
            "keenon/nimblephysics#143, where the energy doubles; collisions moved off the steps",
            lay_out(
                [[0.7786, 0.0], [0.9897, 0.0]],
                [[2.0, 0.0], [0.0, 0.0]],
                radius=0.1,
                walls=[[[1.1, -1.0], [1.1, 1.0]]],
            ),
            duration=1.0,
            sample_interval=0.04,  # so that two of the collisions share the middle step too
        )
    ),
)
