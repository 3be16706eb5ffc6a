"""A row of the check: a question to a solver, its answer, the expected answer, and the likely
cause."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Verdict = Literal["right", "fault", "follows", "free choice", "not asked"]
# Single precision is allowed: a dozen operations of 6e-8 each. Mistakes are far larger
# than that.
TOLERANCE = 1e-6
FOLLOWS = "it follows from the faults above"
SAME_AGAIN = "same answer again"  # the row on state that a file keeps between calls
UNKNOWN = "unknown: no known mistake gives these numbers"
INTEGRATES = "the collision function calls integrate: spheres that collide move on in time, too"
TASKS = {
    "file": "the file",
    "1": "1 integrate",
    "2a": "2a detect",
    "2b": "2b project",
    "2c": "2c impulse",
    "2d": "2d velocities",
    "loop": "the step, performSimStep",
    "scenes": "whole scenes",
}
READ = {
    "file": "the exercise's text: only the two tasks are to be written",
    "1": "the exercise, task 1; reference_impl/exercise.py, integrate",
    "2a": "the exercise, task 2 (a); reference_impl/exercise.py, collide (a)",
    "2b": "the exercise, task 2 (b); reference_impl/exercise.py, collide (b)",
    "2c": "the exercise, task 2 (c); reference_impl/exercise.py, collide (c)",
    "2d": "the exercise, task 2 (d); reference_impl/exercise.py, collide (d)",
    "loop": "performSimStep and projectObjects as the exercise hands them out",
    "scenes": "scenarios/truth/closed_forms.py, scenarios/truth/exact.py",
}
# The formula of the exercise, by the row's name if it has its own, else by its task; a
# prime marks the value after the step or the collision.
FORMULAS = {
    "velocity": "v' = v + (F / mass) dt",
    "position": "x' = x + v' dt, with the new velocity v'",
    "spin": "w' = w + (torque / MoI) dt",
    "angle": "alpha' = alpha + w' dt, with the new angular velocity w'",
    "turns": "alpha' = alpha + w' dt; alpha and alpha + 2 pi are the same direction",
    "coasting": "v' = v + (F / mass) dt, w' = w + (torque / MoI) dt, with F = 0 and torque = 0",
    "2a": "the spheres collide if |xA - xB| < sizeA + sizeB",
    "2b": "|xA' - xB'| = sizeA + sizeB; both are moved along n = (xA - xB) / |xA - xB|",
    "2c": "J = -(1 + e) (vA - vB).n / (n.n (1/mA + 1/mB)), e = 0.9",
    "2d": "vA' = vA + J n / mA, vB' = vB - J n / mB",
    "all spheres": "integrate the ufo and every asteroid, once",
    "integration first": "integrate every sphere, then handle the collisions, then projectObjects",
    "pairs": "every asteroid with the ufo; for i < j the pair of asteroids i and j",
    "itself": "for i < j the pair of asteroids i and j: j begins at i + 1",
    "each pair once": "for i < j the pair of asteroids i and j: j begins at i + 1",
    "edges in a step": "projectObjects ends the step",
    "edges last": "projectObjects ends the step",
    "edges": "a centre beyond an edge is moved to the opposite edge",
    "ufo": "a ufo that leaves the box is moved back to its start",
}
WITHOUT_FORMULA = ("implemented", "input only", SAME_AGAIN, "rest kept", "sphere kept")


@dataclass(frozen=True)
class CheckRow:
    """One thing that was checked.

    Attributes:
        name: its name, the same for every solver.
        task: the key in `TASKS` of the part of the exercise it belongs to.
        asked: the question, one sentence.
        got, expected: the answer and the right one, with units.
        verdict: "right"; "fault"; "follows": another answer, because of a fault in another task
            (consequences.py); "free choice": the exercise leaves it to the author, so that no
            answer is wrong; "not asked": it could not be asked, and `cause` says why.
        cause: the likely cause of a fault; the choice, for a free choice.
        lines: for a fault the lines of the file concerned: number from 1, text.
    """

    name: str
    task: str
    asked: str
    got: str
    expected: str
    verdict: Verdict
    cause: str = ""
    lines: Sequence[tuple[int, str]] = ()

    @property
    def read(self) -> str:
        """The source of the expected answer."""
        return READ[self.task]

    @property
    def formula(self) -> str:
        """The exercise's formula for it; "" if it has none."""
        if self.name in WITHOUT_FORMULA:
            return ""
        return FORMULAS.get(self.name, FORMULAS.get(self.task, ""))


def judged(
    name: str, task: str, asked: str, got: str, expected: str, right: bool, cause: str = ""
) -> CheckRow:
    """A row that is right or a fault with its cause."""
    return CheckRow(
        name,
        task,
        asked,
        got,
        expected,
        "right" if right else "fault",
        "" if right else cause or UNKNOWN,
    )


def not_asked(name: str, task: str, why: str) -> CheckRow:
    """A row for what could not be asked."""
    return CheckRow(name, task, "", "", "", "not asked", why)


def near(got: object, expected: object, scale: float = 1.0) -> bool:
    """Whether all numbers agree to `TOLERANCE`, relative to themselves or to `scale`; NaN never
    does."""
    one, other = np.asarray(got, float), np.asarray(expected, float)
    return bool((np.abs(one - other) <= TOLERANCE * np.maximum(np.abs(other), scale)).all())


Law = Callable[..., object]


def follows(
    laws: Mapping[str, Law], asked: Sequence[Sequence[object]], answers: Sequence[object]
) -> str | None:
    """The first law that reproduces all answers; None if there is none."""
    with np.errstate(all="ignore"):
        for name, law in laws.items():
            if all(near(answer, law(*question), 0.1) for question, answer in zip(asked, answers)):
                return name
    return None


def shown(value: object) -> str:
    """Numbers as text: four digits, vectors in brackets."""
    array = np.asarray(value, float)
    if array.ndim:
        return "(" + ", ".join(shown(x) for x in array) + ")"
    x = float(array)
    return (
        ("NaN" if np.isnan(x) else "infinite")
        if not np.isfinite(x)
        else f"{0.0 if abs(x) < 1e-12 else x:.4g}"
    )


def worst(rows: Iterable[CheckRow]) -> Verdict:
    """The verdict of a group of rows: its worst."""
    found = {row.verdict for row in rows}
    order: tuple[Verdict, ...] = ("fault", "follows", "not asked", "right", "free choice")
    return next((verdict for verdict in order if verdict in found), "not asked")
