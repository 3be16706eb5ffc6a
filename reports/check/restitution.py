"""The restitution of a file: what is written into it, and what comes out of its collisions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adapters.own_solver.restitution import EXERCISE, named_in, stated
from reports.check.questions import QUESTIONS, Answer
from reports.check.rows import CheckRow, judged, near, shown


@dataclass(frozen=True)
class Restitution:
    """Of a file.

    Attributes:
        own: the value written into it, or the exercise's if none is found.
        named: whether it is written in, by a name or as a number.
        absurd: whether what came is not from 0 to 1, and a name such as e or restitution gets it.
        came: separation over approach speed of two equal spheres that meet head-on at 2 m/s.
        slow, fast: the same at 2 mm/s and at 200 m/s.
    """

    own: float
    named: bool
    absurd: bool
    came: float
    slow: float
    fast: float

    @property
    def candidates(self) -> list[float]:
        """The values a collision is explained by: the file's own first, then what came, if nothing
        contradicts it."""
        free = 0 <= self.came <= 1 and not self.named
        return [self.own, self.came] if free and not near(self.came, self.own) else [self.own]

    @property
    def played(self) -> float | None:
        """The value that whole scenes are judged by; None if no number from 0 to 1 makes sense."""
        return next((e for e in (self.came, self.own) if 0 <= e <= 1), None)

    @property
    def mistake(self) -> str:
        """What is wrong with the number that is written in, "" if nothing is."""
        return (
            f"e = {shown(self.came)} is written into the file; it must be from 0 to 1"
            if self.absurd
            else ""
        )

    def row(self, mistake: str) -> CheckRow:
        """0.9 is right; another number is a free choice if the file says so, a fault if it says
        something else.

        `mistake`: what is known to be wrong with the collisions, if anything.
        """
        asked = "What is the restitution e, the speed of separation over that of approach?"
        if near(self.came, EXERCISE):
            return CheckRow("restitution", "2c", asked, shown(self.came), shown(EXERCISE), "right")
        if near(self.came, self.own) or len(self.candidates) > 1:
            note = (
                f"the file has e = {shown(self.came)}, the exercise 0.9; all is judged with the"
                " file's"
            )
            return CheckRow(
                "restitution", "2c", asked, shown(self.came), shown(EXERCISE), "free choice", note
            )
        cause = mistake if np.isfinite(self.came) else "the velocities become NaN or infinite"
        cause = cause or f"the file has e = {shown(self.own)}, but its collisions have another"
        return judged("restitution", "2c", asked, shown(self.came), shown(self.own), False, cause)

    def speeds(self, mistake: str) -> CheckRow:
        """The same at any speed; `mistake` as above."""
        return judged(
            "any speed",
            "2c",
            "Is it the same for pairs that close at 2 mm/s and at 200 m/s?",
            f"{shown(self.slow)} and {shown(self.fast)}",
            shown(self.came),
            near([self.slow, self.fast], self.came),
            mistake or "the restitution depends on the speed",
        )


def restitution_of(text: str, answers: dict[str, Answer]) -> Restitution:
    """What the file's text says and what its collisions give."""
    came, slow, fast = (separation(answers[name], name) for name in ("even", "slow", "fast"))
    named, found = named_in(text), stated(text)
    absurd = not 0 <= came <= 1 and any(near(e, came) for e in named)
    # A file may hold several such numbers, and use one of them.
    own = next((e for e in found if near(e, came)), found[0] if found else EXERCISE)
    return Restitution(own, bool(found), absurd, came, slow, fast)


def separation(answer: Answer, name: str) -> float:
    """Separation over approach speed; NaN if the call failed."""
    if answer.failed or not answer.balls:
        return float("nan")
    a, b = QUESTIONS[name].balls
    after = answer.last
    return float((after[1].v[0] - after[0].v[0]) / (a.v[0] - b.v[0]))
