"""Mistakes in one part of a formula: in one product of the scalar product, or in one component of
one velocity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from crosscheck2d.reports.check.collisions import Impulse, PairCollision
from crosscheck2d.reports.check.rows import near, shown
from crosscheck2d.scenarios.model import Array

Change = Callable[[PairCollision, Array, float], tuple[Array, Array]]
# (velocity, of the other axis, of the other sphere, n, n of the other axis) -> one product of (vA -
# vB).n
PRODUCTS: dict[str, Callable[[float, float, float, float, float], float]] = {
    "is left out": lambda v, across, other, n, m: 0.0,
    "has the wrong sign": lambda v, across, other, n, m: -v * n,
    "uses the other component of n": lambda v, across, other, n, m: v * m,
    "uses the velocity along the other axis": lambda v, across, other, n, m: across * n,
    "uses the velocity of the other sphere": lambda v, across, other, n, m: other * n,
    "is not multiplied by n": lambda v, across, other, n, m: v,
}
PLACES = {  # (0: A, 1: B; 0: x, 1: y)
    "(vA.x - vB.x) n.x": {(0, 0), (1, 0)},
    "(vA.y - vB.y) n.y": {(0, 1), (1, 1)},
    "vA.x n.x": {(0, 0)},
    "vA.y n.y": {(0, 1)},
    "vB.x n.x": {(1, 0)},
    "vB.y n.y": {(1, 1)},
    "vA.n": {(0, 0), (0, 1)},
    "vB.n": {(1, 0), (1, 1)},
}


def scalar_products() -> dict[str, Impulse]:
    """Mistake -> the impulse with that one mistake in (vA - vB).n."""
    return {
        f"in the scalar product {where} {how}": with_slip(places, one)
        for (where, places), (how, one) in product(PLACES.items(), PRODUCTS.items())
    }


def with_slip(places: set[tuple[int, int]], one: Callable[..., float]) -> Impulse:
    """The right impulse, except that `one` computes the products at `places`."""

    def impulse(h: PairCollision, e: float) -> Array:
        v, total = (h.va, h.vb), 0.0
        for who, k in product((0, 1), (0, 1)):
            given = (v[who][k], v[who][1 - k], v[1 - who][k], h.n[k], h.n[1 - k])
            total += (1 - 2 * who) * (one(*given) if (who, k) in places else v[who][k] * h.n[k])
        return -(1 + e) * total * h.mu * h.n

    return impulse


# (p: its part of +J n for A, -J n for B; q: the part along the other axis; all of it along n; mass,
# mass of the other; velocity before; e) -> change of one velocity along one axis, m/s
COMPONENTS: dict[str, Callable[..., float]] = {
    "": lambda p, q, whole, m, other, v, e: p / m,
    "is never changed": lambda p, q, whole, m, other, v, e: 0.0,
    "has the wrong sign": lambda p, q, whole, m, other, v, e: -p / m,
    "uses the other component of n": lambda p, q, whole, m, other, v, e: q / m,
    "uses the other component of n, with the wrong sign": lambda p, q, whole, m, other, v, e: (
        -q / m
    ),
    "is set instead of changed (= for +=)": lambda p, q, whole, m, other, v, e: p / m - v,
    "is set instead of changed, with the wrong sign": lambda p, q, whole, m, other, v, e: (
        -p / m - v
    ),
    "is divided by the mass of the other": lambda p, q, whole, m, other, v, e: p / other,
    "is not divided by its mass": lambda p, q, whole, m, other, v, e: p,
    "is divided by its mass squared": lambda p, q, whole, m, other, v, e: p / m**2,
    "is multiplied by its mass": lambda p, q, whole, m, other, v, e: p * m,
    "is changed twice": lambda p, q, whole, m, other, v, e: 2 * p / m,
    "is changed along x and along y": lambda p, q, whole, m, other, v, e: (p + q) / m,
    "is not multiplied by n": lambda p, q, whole, m, other, v, e: whole / m,
    "is multiplied by e": lambda p, q, whole, m, other, v, e: e * p / m,
}


def components(
    seen: Sequence[tuple[PairCollision, Array]], right: Impulse, e: float
) -> tuple[str, Change] | None:
    """The mistakes in the components of both velocities, if the impulse is right, and their
    combined effect; None if a component follows no formula of `COMPONENTS`."""
    found = {}
    for who, axis in product((0, 1), (0, 1)):
        changed = [change[who, axis] for _, change in seen]
        fits = (
            name
            for name in COMPONENTS
            if near([component(name, h, right(h, e), who, axis, e) for h, _ in seen], changed, 0.1)
        )
        found[who, axis] = next(fits, None)
    if None in found.values():
        return None

    def change(h: PairCollision, P: Array, e: float) -> tuple[Array, Array]:
        a, b = (
            np.array([component(found[who, k], h, P, who, k, e) for k in (0, 1)]) for who in (0, 1)
        )
        return a, b

    slips = [f"v{'AB'[who]}.{'xy'[k]} {slip}" for (who, k), slip in found.items() if slip]
    return "; ".join(slips), change


def component(name: str | None, h: PairCollision, P: Array, who: int, axis: int, e: float) -> float:
    """The change by a formula of `COMPONENTS`, m/s."""
    sign, masses, v = 1 - 2 * who, (h.ma, h.mb), (h.va, h.vb)[who]
    own, other = masses[who], masses[1 - who]
    return COMPONENTS[name or ""](
        sign * P[axis], sign * P[1 - axis], sign * (P @ h.n), own, other, v[axis], e
    )


BEFORE = "before the impulse is computed"


def damping(
    seen: Sequence[tuple[PairCollision, Array]], right: Impulse, e: float
) -> tuple[str, Change] | None:
    """The mistake that the velocities of A and of B are each multiplied by a number, before the
    impulse or after it, and its effect; None if no numbers give the collisions.

    The new velocities are linear in the two numbers, which least squares finds.
    """
    for when, new in ((BEFORE, multiplied_before), ("after the impulse", multiplied_after)):
        terms = np.concatenate([new(h, right, e) for h, _ in seen])
        wanted = np.concatenate([[*h.va, *h.vb] + changed.ravel() for h, changed in seen])
        factors = np.linalg.lstsq(terms, wanted, rcond=None)[0]
        if near(terms @ factors, wanted, 0.1):
            return f"{multiplied_by(*factors)} {when}", effect(new, right, factors)
    return None


# (pair, law, e) -> (4, 2), its product with both numbers gives the new velocities, of A and of B
NewVelocities = Callable[[PairCollision, Impulse, float], Array]


def multiplied_before(h: PairCollision, right: Impulse, e: float) -> Array:
    """The new velocities for vA = 1 vA, vB = 0, and those for vA = 0, vB = 1 vB."""
    parts = []
    for va, vb in ((h.va, 0 * h.vb), (0 * h.va, h.vb)):
        P = right(h._replace(va=va, vb=vb), e)
        parts.append([*(va + P / h.ma), *(vb - P / h.mb)])
    return np.array(parts).T


def multiplied_after(h: PairCollision, right: Impulse, e: float) -> Array:
    """The right new velocity of A, and that of B."""
    P = right(h, e)
    a, b = h.va + P / h.ma, h.vb - P / h.mb
    return np.array([[*a, 0.0, 0.0], [0.0, 0.0, *b]]).T


def effect(new: NewVelocities, right: Impulse, factors: Array) -> Change:
    """The changes of both velocities with these two numbers."""

    def change(h: PairCollision, _P: Array, e: float) -> tuple[Array, Array]:
        after = new(h, right, e) @ factors
        return after[:2] - h.va, after[2:] - h.vb

    return change


def multiplied_by(a: float, b: float) -> str:
    """What happens to the velocities, in words."""
    if near(a, b):
        return f"both velocities are {done(a)}"
    parts = [
        f"the velocity of {who} is {done(factor)}"
        for who, factor in (("A", a), ("B", b))
        if not near(factor, 1.0)
    ]
    return " and ".join(parts)


def done(factor: float) -> str:
    """What a number does to a velocity."""
    return "set to 0" if near(factor, 0.0) else f"multiplied by {shown(factor)}"
