"""Numbers with any number of digits behind one interface: mpfr of gmpy2, and balls (intervals) of
arb.

`Numbers` converts float64 exactly, takes square roots and determines signs. A number below `tie`
counts as zero: no precision can distinguish an exact equality from a small difference, and two
numbers that agree in half of their digits do not do so by chance. Balls need no `tie`: where zero
lies inside one, its sign raises `Undecided`.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import flint
import gmpy2

Number = Any
"""An mpfr or arb. They share only the operators of arithmetic."""


class Undecided(ArithmeticError):
    """A ball contains zero, so its sign is not proven; at `t` s of a motion, computed so far as
    `path`."""

    def __init__(self, t: float = 0.0, path: Any = None) -> None:
        super().__init__(t)
        self.t, self.path = t, path


@dataclass(frozen=True)
class Numbers:
    """One kind of numbers at one precision."""

    bits: int  # of each number
    exact: Callable[[float], Number]  # the same number, unrounded
    sqrt: Callable[[Number], Number]
    sign: Callable[[Number], int]  # -1, 0 or 1; 0 below `tie`
    precise: Callable[[], AbstractContextManager[Any]]  # in which all arithmetic is done
    tie: Number  # smaller numbers count as zero; in s, m and m/s, as scenes are of the order of 1
    between: Callable[[float, float], Number]  # for balls, one that contains both
    spread: Callable[[Number], float]  # the radius of a ball; 0 for other numbers
    proves: bool = False  # whether these are balls


def mpfr(bits: int) -> Numbers:
    """MPFR's correctly rounded numbers."""

    def exact(x: float) -> Number:
        return gmpy2.mpfr(x, 53)  # fewer bits than any precision used here: nothing is rounded

    tie = exact(2.0) ** -(bits // 2)
    return Numbers(
        bits=bits,
        exact=exact,
        sqrt=gmpy2.sqrt,
        sign=lambda x: 1 if x > tie else -1 if x < -tie else 0,
        precise=lambda: gmpy2.context(gmpy2.get_context(), precision=bits),
        tie=tie,
        between=lambda a, b: exact((a + b) / 2),
        spread=lambda _x: 0.0,
    )


def balls(bits: int) -> Numbers:
    nought = flint.arb(0)

    def sign(x: Number) -> int:
        if x > nought:
            return 1
        if x < nought:
            return -1
        if x.is_zero():
            return 0
        raise Undecided

    @contextmanager
    def precise() -> Any:
        before, flint.ctx.prec = flint.ctx.prec, bits
        try:
            yield
        finally:
            flint.ctx.prec = before

    return Numbers(
        bits=bits,
        exact=flint.arb,
        sqrt=lambda x: x.sqrt(),
        sign=sign,
        precise=precise,
        tie=nought,
        between=lambda a, b: flint.arb(a).union(flint.arb(b)),
        spread=lambda x: float(x.rad()),
        proves=True,
    )
