"""The rows on the restitution of a file: the number written in it, and that of its collisions."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from crosscheck2d.adapters.own_solver.restitution import (
    EXERCISE,
    NAMED,
    OwnRestitution,
    code_of,
    named_in,
    own_restitution,
    separation,
)
from crosscheck2d.reports.check.questions import SolverAnswer
from crosscheck2d.reports.check.rows import FOLLOWS, CheckRow, judged, near, shown


@dataclass(frozen=True)
class Restitution:
    """The restitution of a file.

    Attributes:
        read: e in its text, and e of a pair that closes at 2 m/s.
        out_of_range: whether that is outside 0 to 1, and the text assigns it to a name such as e.
        comma: where the text assigns a number with a decimal comma to such a name; else "".
        slow, fast: e of pairs that close at 2 mm/s and at 200 m/s.
    """

    read: OwnRestitution
    out_of_range: bool
    comma: str
    slow: float
    fast: float

    @property
    def measured(self) -> float:
        """Separation over approach speed of two equal spheres that meet head-on at 2 m/s."""
        return self.read.measured

    @property
    def own(self) -> float:
        """The e that the file states, or that of the exercise if it states none, because other
        numbers in the file may mean something else."""
        if self.comma:
            return EXERCISE
        return self.read.own if self.read.stated and self.read.own is not None else EXERCISE

    @property
    def candidates(self) -> list[float]:
        """The values of e that may explain the collisions: the file's own, then the measured one,
        unless the file states another."""
        free = 0 <= self.measured <= 1 and not self.read.stated
        return (
            [self.own, self.measured] if free and not near(self.measured, self.own) else [self.own]
        )

    @property
    def for_scenes(self) -> float | None:
        """The e for judging whole scenes: the measured one if that is right or a free choice, else
        the one that the file should have; None if none is from 0 to 1."""
        measured = [self.measured] if self.as_stated else []
        return next((e for e in (*measured, self.own) if 0 <= e <= 1), None)

    @property
    def as_stated(self) -> bool:
        """Whether the file's collisions have the restitution that the file states."""
        if self.comma:
            return False
        right = near(self.measured, EXERCISE) or near(self.measured, self.own)
        return right or len(self.candidates) > 1

    @property
    def mistake(self) -> str:
        """What is wrong with the number in the file; "" if nothing is."""
        if self.comma:
            return f"{self.comma}: the decimal sign is a point, so that e is {shown(self.measured)}"
        return (
            f"e = {shown(self.measured)} is written into the file; it must be from 0 to 1"
            if self.out_of_range
            else ""
        )

    def row(self, mistake: str) -> CheckRow:
        """The row on e: 0.9 is right; another number is a free choice if the file states it, and
        else a fault.

        `mistake`: the known mistake in the collisions, or "".
        """
        asked = (
            "Two spheres of 1 kg meet head-on at 2 m/s: what is the restitution e, their speed of"
            " separation over that of approach?"
        )
        if near(self.measured, EXERCISE):
            return CheckRow(
                "restitution", "2c", asked, shown(self.measured), shown(EXERCISE), "right"
            )
        if self.as_stated:
            note = (
                f"the file has e = {shown(self.measured)}, the exercise 0.9; all is judged with the"
                " file's"
            )
            return CheckRow(
                "restitution",
                "2c",
                asked,
                shown(self.measured),
                shown(EXERCISE),
                "free choice",
                note,
            )
        cause = mistake if np.isfinite(self.measured) else "the velocities become NaN or infinite"
        cause = cause or f"the file has e = {shown(self.own)}, but its collisions have another"
        return judged(
            "restitution", "2c", asked, shown(self.measured), shown(self.own), False, cause
        )

    def speeds(self, mistake: str) -> CheckRow:
        """The row on e at other speeds; `mistake` as above. A wrong e at every speed is the fault
        of the row before."""
        right, alike = (
            self.row(mistake).verdict != "fault",
            near([self.slow, self.fast], self.measured),
        )
        row = judged(
            "restitution at other speeds",
            "2c",
            "Do the same two spheres have the right restitution at 2 mm/s and at 200 m/s, too?",
            f"{shown(self.slow)} and {shown(self.fast)}",
            shown(self.measured if right else self.own),
            right and alike,
            mistake or "the restitution depends on the speed",
        )
        return replace(row, verdict="follows", cause=FOLLOWS) if alike and not right else row


def restitution_of(text: str, answers: dict[str, SolverAnswer]) -> Restitution:
    """The `Restitution` from the file's text and its collisions."""
    measured, slow, fast = (restitution_in(answers[name]) for name in ("even", "slow", "fast"))
    out_of_range = not 0 <= measured <= 1 and any(near(e, measured) for e in named_in(text))
    return Restitution(
        own_restitution(text, measured), out_of_range, decimal_comma(text), slow, fast
    )


DECIMAL_COMMA = re.compile(NAMED.pattern.rpartition("(")[0] + r"\d+,\d+\s*(?:;|$)", re.I | re.M)


def decimal_comma(text: str) -> str:
    """Which line of a file assigns a number with a decimal comma to a name such as e, in words; ""
    if none does."""
    code = code_of(text)
    found = DECIMAL_COMMA.search(code)
    if found is None:
        return ""
    return f"line {code.count(chr(10), 0, found.start()) + 1} has {found[0].rstrip('; ')}"


def restitution_in(answer: SolverAnswer) -> float:
    """The e of a head-on pair; NaN if the call failed."""
    if answer.failed or not answer.balls:
        return float("nan")
    a, b = answer.asked.balls
    after = answer.last
    return separation(a.v[0] - b.v[0], after[0].v[0], after[1].v[0])
