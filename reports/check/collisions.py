"""A pair before a collision and what the collision changed, in the form that the laws of impact
use."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from crosscheck2d.reports.check.questions import Ball, SolverAnswer, direction
from crosscheck2d.scenarios.model import Array


class PairCollision(NamedTuple):
    """A pair before the call, SI: u = vA - vB, n from B to A, distance d, sum of sizes s; shifts of
    A and B; sizes and MoI of both."""

    va: Array
    vb: Array
    n: Array
    d: float
    s: float
    ma: float
    mb: float
    shift_a: Array
    shift_b: Array
    sizes: tuple[float, float]
    inertias: tuple[float, float]

    @property
    def u(self) -> Array:
        """Relative velocity."""
        return self.va - self.vb

    @property
    def vn(self) -> float:
        """The component of u along n; negative if they approach."""
        return float(self.u @ self.n)

    @property
    def mu(self) -> float:
        """Reduced mass."""
        return 1 / (1 / self.ma + 1 / self.mb)


def collision_of(balls: tuple[Ball, ...], after: list[Ball]) -> PairCollision:
    """The `PairCollision` of a pair, with its displacement."""
    a, b = balls
    n, d = direction(a, b)
    shift_a, shift_b = (np.subtract(y.x, x.x) for x, y in zip(balls, after))
    sizes, inertias = (a.r, b.r), (a.MoI, b.MoI)
    return PairCollision(
        np.array(a.v), np.array(b.v), n, d, a.r + b.r, a.m, b.m, shift_a, shift_b, sizes, inertias
    )


Impulse = Callable[[PairCollision, float], Array]
"""A law: (pair, restitution) -> impulse on A from B, N s."""


def changes(balls: tuple[Ball, ...], after: list[Ball]) -> Array:
    """(2, 2) m/s, the changes of both velocities."""
    return np.array([np.subtract(y.v, x.v) for x, y in zip(balls, after)])


def outcome(answer: SolverAnswer) -> tuple[PairCollision, Array]:
    """The pair of a question, and what the call changed: (2, 2) m/s."""
    balls = answer.asked.balls
    return collision_of(balls, answer.last), changes(balls, answer.last)
