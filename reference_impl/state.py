"""What the solvers work on: the disks (arrays that a step edits in place) and the world they share.

n disks, w walls; SI units, float64, y up, angles counter-clockwise in rad.
"""

from typing import NamedTuple

import numpy as np

from reference_impl.compiled import pasted

# How an overlap is shared between the two disks. The exercise leaves it free.
BY_INVERSE_MASS, EQUAL, ONE_SIDED = 0, 1, 2


class Disks(NamedTuple):
    """One row a disk. A static disk has mass `inf`; it is struck but never moves.

    `force` (N) and `torque` (N m) act during every step until you change them.
    """

    position: np.ndarray  # (n, 2) m
    velocity: np.ndarray  # (n, 2) m/s
    force: np.ndarray  # (n, 2) N
    angle: np.ndarray  # (n,) rad
    angular_velocity: np.ndarray  # (n,) rad/s
    torque: np.ndarray  # (n,) N m
    radius: np.ndarray  # (n,) m
    mass: np.ndarray  # (n,) kg
    inertia: np.ndarray  # (n,) kg m2
    # (n, 2) m: what rounding has cut off the position; only `ordered` keeps account of it
    remainder: np.ndarray


class World(NamedTuple):
    """What all disks share; the defaults are the exercise's."""

    restitution: float = 0.9
    gravity: np.ndarray = np.zeros(2)  # (2,) m/s2
    walls: np.ndarray = np.zeros((0, 2, 2))  # (w, 2, 2) m: each a segment, start and end
    low: np.ndarray = np.full(2, -np.inf)  # (2,) m: a centre that leaves the box [low, high]
    high: np.ndarray = np.full(2, np.inf)  # is set onto the opposite edge
    split: int = BY_INVERSE_MASS
    # False: an impulse on separating pairs too, as the formula is printed
    approaching_only: bool = True


def make_disks(  # type: ignore[no-untyped-def]
    position, velocity, radius, mass, inertia=None, angle=None, angular_velocity=None
) -> Disks:
    """Disks from copies of the given arrays; no force, no torque; solid disks (m r2 / 2) where no
    inertia is given."""
    position, velocity, radius, mass = (
        np.array(a, float, order="C") for a in (position, velocity, radius, mass)
    )
    zero = np.zeros(len(radius))
    return Disks(
        position=position,
        velocity=velocity,
        force=np.zeros_like(position),
        angle=np.array(zero if angle is None else angle, dtype=float),
        angular_velocity=np.array(
            zero if angular_velocity is None else angular_velocity, dtype=float
        ),
        torque=zero.copy(),
        radius=radius,
        mass=mass,
        inertia=np.array(mass * radius**2 / 2 if inertia is None else inertia, dtype=float),
        remainder=np.zeros_like(position),
    )


# Entering compiled code takes about 0.1 us an array, as numba looks at each of them in Python; with
# the 17 fields of `Disks` and `World` that was four times as long as a step of 21 disks. So whoever
# calls often keeps both in one block each, and `advance_blocks` takes them apart when inside.
# A pointer (numba's cfunc through ctypes) was slower than two arrays.


def disks_block(disks: Disks) -> np.ndarray:
    """(14n,): a copy of all fields, one behind the other; `disks_of` gives views of it."""
    return np.concatenate([array.reshape(-1) for array in disks])


def world_block(world: World) -> np.ndarray:
    """(9 + 4w,): a copy of all fields, the walls last; `world_of` gives views of it."""
    free = [world.restitution, world.split, world.approaching_only]
    return np.concatenate([free, world.gravity, world.low, world.high, world.walls.reshape(-1)])


@pasted
def disks_of(block) -> Disks:  # type: ignore[no-untyped-def]
    """The disks that a block holds: what is done to them is done to it."""
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


@pasted
def world_of(block) -> World:  # type: ignore[no-untyped-def]
    """The world that a block holds."""
    return World(
        restitution=block[0],
        gravity=block[3:5],
        walls=block[9:].reshape(((len(block) - 9) // 4, 2, 2)),
        low=block[5:7],
        high=block[7:9],
        split=int(block[1]),
        approaching_only=block[2] != 0.0,
    )
