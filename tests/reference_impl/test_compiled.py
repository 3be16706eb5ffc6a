"""The compiled solver and the plain Python one are the same source and give the same bits."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCENE = """
import sys, numpy as np
from crosscheck2d.reference_impl import exercise, lesson, neighbours, ordered
from crosscheck2d.reference_impl.neighbour_list import FEW
from crosscheck2d.reference_impl.state import World, make_disks
SOLVERS = ((exercise, 4, 600), (lesson, 4, 600), (ordered, 4, 600), (neighbours, 9, 200))
for solver, side, steps in SOLVERS:
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
    n = np.arange(side**2)
    mass = np.where(n == 5, np.inf, 1 + n % 3)
    velocity = np.where(n == 5, 0, 1)[:, None] * np.stack([np.sin(1.0 + n), np.cos(2.0 * n)], -1)
    world = World(
        gravity=np.array([0.1, -0.7]),
        walls=np.array([[[-0.5, -0.5], [2.0, -0.5]], [[3.5, -0.5], [3.2, 3.0]]]),
        low=np.array([-0.9, -0.9]), high=np.array([side - 0.1, side - 0.1]),
    )
    disks = make_disks(grid, velocity, 0.3 + 0.1 * np.sin(n), mass, angular_velocity=np.cos(n))
    disks.force[3], disks.torque[7] = [0.3, 0.2], 0.05
    collisions = solver.advance(disks, world, 0.01, steps)
    assert {min(j, 0) for _, _, j, _ in collisions} == {0, -1, -2} and len(collisions) > 100
    assert solver is not neighbours or len(n) > FEW
    played = b"".join(array.tobytes() for array in disks)
    sys.stdout.buffer.write(played + np.array(collisions).tobytes())
# what lasts: a stack with friction, and a heap
n = np.arange(9)
stack = np.stack([np.zeros(4), 0.6 + 1.1 * np.arange(4)], -1)
heap = np.stack([0.6 + 1.05 * (n % 3) + 0.02 * np.sin(n), 0.6 + 1.05 * (n // 3)], -1)
box = np.array([[[-5, 0], [5, 0]], [[0, 0], [0, 9]], [[3.3, 0], [3.3, 9]]], float)
LASTING = ((stack, box[:1], 0.3, 0.3), (heap, box, 0.5, 0.0), (heap, box, 0.0, 0.3))
for x, walls, e, friction in LASTING:
    world = World(gravity=np.array([0, -10.0]), walls=walls, restitution=e, friction=friction)
    disks = make_disks(x, np.zeros_like(x), np.full(len(x), 0.5), 1.0 + np.arange(len(x)) % 3)
    collisions = ordered.advance(disks, world, 1 / 60, 60)
    played = b"".join(array.tobytes() for array in disks)
    sys.stdout.buffer.write(played + np.array(collisions).tobytes())
"""


def printed(code: str, *, compiled: bool) -> bytes:
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        check=True,
        cwd=Path(__file__).parents[2],
        env=os.environ | {"NUMBA_DISABLE_JIT": "01"[not compiled]},
    ).stdout


@pytest.mark.slow
def test_plain_python_gives_the_same_bits_as_the_compiled_solver():
    compiled = printed(SCENE, compiled=True)
    assert len(compiled) > 2 * 16 * 13 * 8
    assert compiled == printed(SCENE, compiled=False)
