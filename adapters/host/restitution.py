"""The restitution of a solver's file: the number in its text, and the measured one of its
collisions. Both playing and checking a file use it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isnan, nan

from crosscheck2d.adapters.host.file import SolverFailed, SolverText
from crosscheck2d.adapters.host.process import SolverProcess

# largest difference between two equal restitutions: that of a constant written 0.9
SAME = 1e-3
EXERCISE = 0.9
COMMENTS = re.compile(r"/\*.*?\*/|//[^\n]*|#[^\n]*", re.DOTALL)
NAMED = re.compile(
    r"\b(?:e|eps|epsilon|cor|restitution|elasticity|bounciness|bounce|coeff\w*|c_?r)\b"
    r"\s*(?::\s*\w+\s*)?[:=]\s*(-?\d*\.?\d+)",
    re.IGNORECASE,
)
NUMBER = re.compile(r"(?<![\w.])\d*\.?\d+(?![\w.])")


@dataclass(frozen=True)
class OwnRestitution:
    """The restitution of a file with the exercise's functions, which have no such argument.

    Attributes:
        stated: the numbers from 0 to 1 that its text assigns to a name such as e or restitution;
            then 0.9, if that or 1.9 occurs in it.
        measured: separation over approach speed of two equal spheres that meet head-on; NaN if
            there was no collision.
        occurs: whether `measured` or 1 + `measured` is a number in its text.
    """

    stated: tuple[float, ...]
    measured: float
    occurs: bool

    @property
    def own(self) -> float | None:
        """The restitution of the file: the stated number that equals the measured one, else the
        first stated; else the measured one, if it occurs in the text; else None."""
        first = next(iter(self.stated), self.measured if self.occurs else None)
        return next((e for e in self.stated if same(e, self.measured)), first)

    def fits(self, wanted: float) -> bool:
        """Whether the file can play a scene with this restitution.

        It cannot if its text states another one. A file whose text states none is played, and so is
        one that states or has the wanted one: a fault can change the measured number.
        """
        fitting = any(same(e, wanted) for e in (*self.stated, self.measured))
        return fitting or self.own is None

    def __str__(self) -> str:
        has = "none came" if isnan(self.measured) else f"its collisions have {self.measured:.6g}"
        if self.own is None:
            return f"none is found in the file; {has}"
        written = f"{self.own:g}, written into the file"
        return written if same(self.own, self.measured) else f"{written}; {has}"


def restitution_of(solver: SolverText, process: SolverProcess) -> OwnRestitution:
    return own_restitution(own_text(solver), probed(process))


def own_text(solver: SolverText) -> str:
    """All that its author wrote: beside it may be a gl-matrix, too."""
    beside = [module for file, module in solver.imported if file.endswith(".py")]
    return "\n".join([solver.text, *beside])


def own_restitution(text: str, measured: float) -> OwnRestitution:
    numbers = [float(number) for number in NUMBER.findall(code_of(text))]
    occurs = any(same(number, e) for number in numbers for e in (measured, 1 + measured))
    stated = [e for e in named_in(text) if 0 <= e <= 1]
    stated += [EXERCISE] * (EXERCISE in numbers or 1 + EXERCISE in numbers)
    return OwnRestitution(tuple(stated), measured, 0 <= measured <= 1 and occurs)


def named_in(text: str) -> list[float]:
    return [float(number) for number in NAMED.findall(code_of(text))]


def with_restitution(text: str, old: float, new: float) -> str:
    """The text with `new` where the code has `old` as its restitution."""
    for found in reversed([*NAMED.finditer(code_of(text))]):
        if float(found[1]) == old:
            text = f"{text[: found.start(1)]}{new}{text[found.end(1) :]}"
    return text


def code_of(text: str) -> str:
    """A file with comments replaced by blanks, so that line numbers stay the same."""
    return COMMENTS.sub(lambda comment: re.sub(r"[^\n]", " ", comment[0]), text)


def probed(process: SolverProcess) -> float:
    """Separation over approach speed of two equal spheres that meet head-on at 2 m/s; NaN if they
    do not collide."""
    pair = [[side * 0.45, 0.0, -side, *[0.0] * 6, 1.0, 1.0, 0.5] for side in (-1.0, 1.0)]
    question = {"spheres": pair, "calls": [["collide", 0, 1]], "world": False}
    try:
        answer = process.do("ask", question, 1.0)
    except SolverFailed:
        return nan
    if answer["error"] or [len(state) for state in answer["states"]] != [2]:
        return nan
    ((a, b),) = answer["states"]
    return separation(2.0, a[2], b[2])


def separation(closing: float, a: float, b: float) -> float:
    return float(b - a) / closing


def same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME
