"""What the solvers work on: the disks (arrays that a step edits in place) and the world they share.

n disks, w walls; SI units, float64, y up, angles counter-clockwise in rad.
"""

from typing import NamedTuple

import numpy as np

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
    high: np.ndarray = np.full(2, np.inf)  # enters it again at the opposite edge
    split: int = BY_INVERSE_MASS
    # False: an impulse on separating pairs too, as the formula is printed
    approaching_only: bool = True
    friction: float = 0.0  # Coulomb's coefficient; only `coulomb` and `ordered` know it


def make_disks(
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
