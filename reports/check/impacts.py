"""What a solver may take for the impulse of a hit, and what it may do with it; and which of that it does.

J = -(1 + e) (vA - vB).n / (1/mA + 1/mB), vA' = vA + J n / mA, vB' = vB - J n / mB, n the unit vector from B to A
(Newton's law of impact; Landau & Lifshitz, Mechanics, 17).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from reports.check.questions import HITS, QUESTIONS, Answer, Ball, direction, finite
from reports.check.restitution import Restitution
from reports.check.rows import near
from scenarios.model import Array


class Hit(NamedTuple):
    """A pair before the call, m, m/s, kg: u = vA - vB, n from B to A, distance d, sum of sizes s; shifts of A and B."""

    va: Array
    vb: Array
    n: Array
    d: float
    s: float
    ma: float
    mb: float
    shift_a: Array
    shift_b: Array

    @property
    def u(self) -> Array:
        """Relative velocity."""
        return self.va - self.vb

    @property
    def vn(self) -> float:
        """Its part along n; negative where they approach."""
        return float(self.u @ self.n)

    @property
    def mu(self) -> float:
        """Reduced mass."""
        return 1 / (1 / self.ma + 1 / self.mb)


def hit_of(balls: tuple[Ball, ...], after: list[Ball]) -> Hit:
    """A pair and how it was displaced."""
    a, b = balls
    n, d = direction(a, b)
    shifts = (np.subtract(y.x, x.x) for x, y in zip(balls, after))
    return Hit(np.array(a.v), np.array(b.v), n, d, a.r + b.r, a.m, b.m, *shifts)


Impulse = Callable[[Hit, float], Array]


def scaled(factor: Callable[[Hit, float], float]) -> Impulse:
    """The right impulse times a factor."""
    return lambda h, e: -(1 + e) * h.vn * h.mu * h.n * factor(h, e)


def tangent(h: Hit) -> Array:
    """n turned by a quarter."""
    return np.array([-h.n[1], h.n[0]])


NEVER = "the velocities are never changed: not implemented"
APPROACH = "the test for approach has the wrong sign: only pairs that part get an impulse"
# What a solver may take for J n, N s
IMPULSES: dict[str, Impulse] = {
    "": scaled(lambda h, e: 1.0),
    NEVER: scaled(lambda h, e: 0.0),
    APPROACH: scaled(lambda h, e: 0.0),
    "the factor (1 + e) is missing": scaled(lambda h, e: 1 / (1 + e)),
    "the factor is e, not (1 + e)": scaled(lambda h, e: e / (1 + e)),
    "the factor is (1 - e), not (1 + e)": scaled(lambda h, e: (1 - e) / (1 + e)),
    "the sign of the normal or of J is wrong": scaled(lambda h, e: -1.0),
    "the impulse is counted twice": scaled(lambda h, e: 2.0),
    "the impulse is halved": scaled(lambda h, e: 0.5),
    "the masses are missing: J = -(1 + e) vn": scaled(lambda h, e: 1 / h.mu),
    "it multiplies by (mA + mB) instead of dividing by (1/mA + 1/mB)": scaled(lambda h, e: (h.ma + h.mb) / h.mu),
    "it divides by (mA + mB) instead of (1/mA + 1/mB)": scaled(lambda h, e: 1 / (h.ma + h.mb) / h.mu),
    "it multiplies by (1/mA + 1/mB) instead of dividing": scaled(lambda h, e: 1 / h.mu**2),
    "it multiplies by mA mB without dividing by mA + mB": scaled(lambda h, e: h.ma * h.mb / h.mu),
    "only the mass of A is used": scaled(lambda h, e: h.ma / h.mu),
    "only the mass of B is used": scaled(lambda h, e: h.mb / h.mu),
    "the mean of the masses is used": scaled(lambda h, e: (h.ma + h.mb) / 2 / h.mu),
    "half the reduced mass is used: right only for J of each": scaled(lambda h, e: 1 / 2),
    "the normal is not normalised": scaled(lambda h, e: h.d * h.d),
    "the normal is not normalised (taken after the displacement)": scaled(lambda h, e: h.s * h.s),
    "the normal is not normalised in one of its two places": scaled(lambda h, e: h.d),
    "the normal is not normalised in one of its two places (after the displacement)": scaled(lambda h, e: h.s),
    "it is divided by the distance once too often": scaled(lambda h, e: 1 / h.d),
    "it is divided by the distance once too often (after the displacement)": scaled(lambda h, e: 1 / h.s),
    "it is divided by n.n, though n is not what it multiplies": scaled(lambda h, e: 1 / h.d**2),
    "it is divided by n.n, though n is not what it multiplies (after the displacement)": scaled(
        lambda h, e: 1 / h.s**2
    ),
    "the velocity of B is left out": lambda h, e: -(1 + e) * (h.va @ h.n) * h.mu * h.n,
    "the velocity of A is left out": lambda h, e: (1 + e) * (h.vb @ h.n) * h.mu * h.n,
    "the velocities are added, not subtracted": lambda h, e: -(1 + e) * ((h.va + h.vb) @ h.n) * h.mu * h.n,
    "the whole relative velocity is taken, with its tangential part": lambda h, e: -(1 + e) * h.u * h.mu,
    "the relative speed is taken for its normal part": lambda h, e: (1 + e) * np.hypot(*h.u) * h.mu * h.n,
    "only x is used in the scalar product": lambda h, e: -(1 + e) * h.u[0] * h.n[0] * h.mu * h.n,
    "only y is used in the scalar product": lambda h, e: -(1 + e) * h.u[1] * h.n[1] * h.mu * h.n,
    "x and y are exchanged in the scalar product": lambda h, e: -(1 + e) * (h.u[::-1] @ h.n) * h.mu * h.n,
    "it acts along the tangent": lambda h, e: -(1 + e) * h.vn * h.mu * tangent(h),
    "the tangential part is thrown back, not the normal one": lambda h, e: (
        -(1 + e) * (h.u @ tangent(h)) * h.mu * tangent(h)
    ),
    "the tangential part is lost, too": lambda h, e: h.mu * (-(1 + e) * h.vn * h.n - (h.u - h.vn * h.n)),
    "the tangential part is thrown back, too, without e": lambda h, e: (
        h.mu * (-(1 + e) * h.vn * h.n - 2 * (h.u - h.vn * h.n))
    ),
}


class Update(NamedTuple):
    """What a solver may do with P = J n: the changes of both velocities, m/s; and the task the mistake is in."""

    change: Callable[[Hit, Array, float], tuple[Array, Array]]
    task: str = "2d"


ONES: Array = np.ones(2)
UPDATES: dict[str, Update] = {
    "": Update(lambda h, P, e: (P / h.ma, -P / h.mb)),
    "B gets the sign of A": Update(lambda h, P, e: (P / h.ma, P / h.mb)),
    "B is divided by the mass of A": Update(lambda h, P, e: (P / h.ma, -P / h.ma)),
    "A is divided by the mass of B": Update(lambda h, P, e: (P / h.mb, -P / h.mb)),
    "the masses are exchanged": Update(lambda h, P, e: (P / h.mb, -P / h.ma)),
    "B gets the sign and the mass of A": Update(lambda h, P, e: (P / h.ma, P / h.ma)),
    "B is not changed": Update(lambda h, P, e: (P / h.ma, 0 * P)),
    "A is not changed": Update(lambda h, P, e: (0 * P, -P / h.mb)),
    "they are not divided by the masses": Update(lambda h, P, e: (P, -P)),
    "A is not divided by its mass": Update(lambda h, P, e: (P, -P / h.mb)),
    "B is not divided by its mass": Update(lambda h, P, e: (P / h.ma, -P)),
    "they are multiplied by the masses": Update(lambda h, P, e: (P * h.ma, -P * h.mb)),
    "they are set to J n / m, not changed by it": Update(lambda h, P, e: (P / h.ma - h.va, -P / h.mb - h.vb)),
    "B is computed from the new velocity of A": Update(
        lambda h, P, e: (P / h.ma, -P * (1 - (1 + e) * h.mu / h.ma) / h.mb)
    ),
    "only x is changed": Update(lambda h, P, e: (P / h.ma * [1, 0], -P / h.mb * [1, 0])),
    "only y is changed": Update(lambda h, P, e: (P / h.ma * [0, 1], -P / h.mb * [0, 1])),
    "y gets the x part of the normal": Update(lambda h, P, e: (P[0] / h.ma * ONES, -P[0] / h.mb * ONES)),
    "x gets the y part of the normal": Update(lambda h, P, e: (P[1] / h.ma * ONES, -P[1] / h.mb * ONES)),
    "the velocities are exchanged": Update(lambda h, P, e: (-h.u, h.u)),
    "the displacement is added to the velocities, too": Update(
        lambda h, P, e: (P / h.ma + h.shift_a, -P / h.mb + h.shift_b), "2b"
    ),
}


@dataclass(frozen=True)
class Finding:
    """What the hits say: the mistake in the impulse, the one in the update and its task ("" : none), and the e used."""

    impulse: str
    update: str
    task: str
    e: float

    @property
    def sentence(self) -> str:
        """Both mistakes, the one in the impulse first."""
        return "; and ".join(part for part in (self.impulse, self.update) if part)


def explain(answers: dict[str, Answer], restitution: Restitution) -> Finding | None:
    """The impulse and the update that give every hit, fewest mistakes first; None if nothing does."""
    seen = [(hit_of(q.balls, answers[name].last), changes(q.balls, answers[name].last)) for name, q in HITS.items()]
    if not finite(answers, "v"):
        return None
    pairs = sorted(product(IMPULSES, UPDATES), key=lambda pair: (pair[0] != "") + (pair[1] != ""))
    for e in restitution.candidates:
        for impulse, update in pairs:
            row = UPDATES[update]
            if all(near(row.change(h, IMPULSES[impulse](h, e), e), came, 0.1) for h, came in seen):
                wrong_way = impulse == NEVER and follows_print(answers, e)
                return Finding(APPROACH if wrong_way else impulse, update, row.task, e)
    return None


def follows_print(answers: dict[str, Answer], e: float) -> bool:
    """Whether pairs that part get the impulse of the printed formula."""
    for name in PARTING:
        h, came = hit_of(QUESTIONS[name].balls, answers[name].last), changes(QUESTIONS[name].balls, answers[name].last)
        if not near(UPDATES[""].change(h, IMPULSES[""](h, e), e), came, 0.1):
            return False
    return True


PARTING = ("part", "part, other numbers")


def changes(balls: tuple[Ball, ...], after: list[Ball]) -> Array:
    """(2, 2) m/s, what was added to both velocities."""
    return np.array([np.subtract(y.v, x.v) for x, y in zip(balls, after)])
