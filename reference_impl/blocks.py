"""Disks and world packed into one array each, so that a call of compiled code takes less time.

A call takes about 0.1 us for each array or number, because numba checks each argument in Python.
With the 17 fields of `Disks` and `World` that was four times the time of a step of 21 disks. Who
calls often keeps one block of each, and the functions of `ADVANCE` unpack them in compiled code. A
pointer (numba's cfunc through ctypes) was slower than two arrays.
"""

from collections.abc import Callable

import numpy as np

from . import coulomb, exercise, lesson, neighbours, ordered
from .compiled import compiled, inlined
from .state import Disks, World


def disks_block(disks: Disks) -> np.ndarray:
    """(14n,): a copy of all fields, one behind the other; `disks_of` gives views of it."""
    return np.concatenate([array.reshape(-1) for array in disks])


def world_block(world: World, dt: float) -> np.ndarray:
    """(11 + 4w,): the size of a step in s, then a copy of all fields, the walls last; `world_of`
    gives views of it."""
    free = [dt, world.restitution, world.friction, world.split, world.approaching_only]
    return np.concatenate([free, world.gravity, world.low, world.high, world.walls.reshape(-1)])


@inlined
def disks_of(block) -> Disks:
    """The disks of a block, as views: writing to them writes to the block."""
    n = len(block) // 14
    return Disks(
        block[: 2 * n].reshape((n, 2)),
        block[2 * n : 4 * n].reshape((n, 2)),
        block[4 * n : 6 * n].reshape((n, 2)),
        block[6 * n : 7 * n],
        block[7 * n : 8 * n],
        block[8 * n : 9 * n],
        block[9 * n : 10 * n],
        block[10 * n : 11 * n],
        block[11 * n : 12 * n],
        block[12 * n :].reshape((n, 2)),
    )


@inlined
def world_of(block) -> World:
    return World(
        restitution=block[1],
        friction=block[2],
        gravity=block[5:7],
        walls=block[11:].reshape(((len(block) - 11) // 4, 2, 2)),
        low=block[7:9],
        high=block[9:11],
        split=int(block[3]),
        approaching_only=block[4] != 0.0,
    )


@compiled
def exercise_advance(disks, world, count: int) -> list:
    return exercise.advance(disks_of(disks), world_of(world), world[0], count)


@compiled
def neighbours_advance(disks, world, count: int) -> list:
    return neighbours.advance(disks_of(disks), world_of(world), world[0], count)


@compiled
def coulomb_advance(disks, world, count: int) -> list:
    return coulomb.advance(disks_of(disks), world_of(world), world[0], count)


@compiled
def lesson_advance(disks, world, count: int) -> list:
    return lesson.advance(disks_of(disks), world_of(world), world[0], count)


@compiled
def ordered_advance(disks, world, count: int) -> list:
    return ordered.advance(disks_of(disks), world_of(world), world[0], count)


ADVANCE: dict[str, Callable[..., list]] = {  # by the variant's module
    exercise.__name__: exercise_advance,
    neighbours.__name__: neighbours_advance,
    coulomb.__name__: coulomb_advance,
    lesson.__name__: lesson_advance,
    ordered.__name__: ordered_advance,
}
