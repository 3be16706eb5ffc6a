"""The restitution of somebody's file: the number that is written into it, beside the one that its
collisions have. What plays a file and what checks it read it here."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import nan

from adapters.own_solver.file import SolverFailed, SolverText
from adapters.own_solver.process import SolverProcess

# largest difference between two restitutions that are the same: that of a constant written 0.9
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
    """Of a file with the exercise's functions, which take none.

    Attributes:
        stated: the numbers from 0 to 1 that its text gives to a name such as e or restitution; then
            0.9, if that or 1.9 occurs in it.
        came: separation over approach speed of two equal spheres that meet head-on; NaN where no
            collision came of it.
        occurs: whether what came, or 1 more, is a number of its text.
    """

    stated: tuple[float, ...]
    came: float
    occurs: bool

    @property
    def own(self) -> float | None:
        """The number that the file is written for: of those that are stated the one that came, else
        the first; else what came, if it occurs. None if its text holds none."""
        first = next(iter(self.stated), self.came if self.occurs else None)
        return next((e for e in self.stated if same(e, self.came)), first)

    def fits(self, wanted: float) -> bool:
        """Whether the file can be played where a scene wants this restitution.

        It cannot if it is written for another one. A file whose text says nothing is played, and so
        is one whose collisions have what is wanted, or ought to have it: a fault makes any number
        of them.
        """
        fitting = any(same(e, wanted) for e in (*self.stated, self.came))
        return fitting or self.own is None

    def __str__(self) -> str:
        """What a table of settings says."""
        has = f"its collisions have {self.came:.6g}" if self.came == self.came else "none came"
        if self.own is None:
            return f"none is found in the file; {has}"
        written = f"{self.own:g}, written into the file"
        return written if same(self.own, self.came) else f"{written}; {has}"


def restitution_of(solver: SolverText, process: SolverProcess) -> OwnRestitution:
    """What the text of a file says, and what its collisions give."""
    return own_restitution(own_text(solver), probed(process))


def own_text(solver: SolverText) -> str:
    """All that its author wrote."""
    return "\n".join([solver.text, *(module for file, module in solver.beside if is_own(file))])


def own_restitution(text: str, came: float) -> OwnRestitution:
    """What a text says of the restitution, beside the one that `came` of its collisions."""
    occurs = any(same(number, came) or same(number, 1 + came) for number in numbers_in(text))
    return OwnRestitution(tuple(stated(text)), came, 0 <= came <= 1 and occurs)


def is_own(file: str) -> bool:
    """Whether what lies beside a solver is its author's: the other thing that is read is
    gl-matrix."""
    return file.endswith(".py")


def stated(text: str) -> list[float]:
    """The numbers from 0 to 1 that a name such as e or restitution gets; then 0.9 if that or 1.9
    occurs."""
    numbers = numbers_in(text)
    named = [e for e in named_in(text) if 0 <= e <= 1]
    return named + [EXERCISE] * (EXERCISE in numbers or 1 + EXERCISE in numbers)


def named_in(text: str) -> list[float]:
    """The numbers that a name such as e or restitution gets."""
    return [float(number) for number in NAMED.findall(code_of(text))]


def numbers_in(text: str) -> list[float]:
    """All numbers of the code."""
    return [float(number) for number in NUMBER.findall(code_of(text))]


def code_of(text: str) -> str:
    """A file with blanks for its comments, so that its lines keep their numbers."""
    return COMMENTS.sub(lambda comment: re.sub(r"[^\n]", " ", comment[0]), text)


def probed(process: SolverProcess) -> float:
    """Separation over approach speed of two equal spheres that meet head-on at 2 m/s; NaN where no
    collision comes out of it."""
    pair = [
        [-0.45, 0.0, 1.0, *[0.0] * 6, 1.0, 1.0, 0.5],
        [0.45, 0.0, -1.0, *[0.0] * 6, 1.0, 1.0, 0.5],
    ]
    try:
        answer = process.do(
            "ask", {"spheres": pair, "calls": [["collide", 0, 1]], "world": False}, 1.0
        )
    except SolverFailed:
        return nan
    if answer["error"] or not answer["states"]:
        return nan
    a, b = answer["states"][-1]
    return separation(2.0, a[2], b[2])


def separation(closing: float, a: float, b: float) -> float:
    """The speed of separation of two that now move at `a` and `b` m/s along x, over the speed at
    which they closed."""
    return float(b - a) / closing


def same(one: float, other: float) -> bool:
    """Whether two restitutions agree; NaN agrees with nothing."""
    return abs(one - other) <= SAME
