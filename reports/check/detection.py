"""Task 2 (a): which spheres a solver takes to collide."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reports.check.questions import QUESTIONS, Answer, Ball, named
from reports.check.rows import Row, judged, near, shown

Rule = Callable[[float, float, float, float], bool]
# (dx, dy, size of A, size of B) in m -> whether they would be taken to collide
RULES: dict[str, Rule] = {
    "": lambda x, y, a, b: np.hypot(x, y) < a + b,
    "only the size of A is used": lambda x, y, a, b: np.hypot(x, y) < a,
    "only the size of B is used": lambda x, y, a, b: np.hypot(x, y) < b,
    "the squared distance is compared with a size that is not squared": lambda x, y, a, b: x * x + y * y < a + b,
    "the distance is compared with a squared size": lambda x, y, a, b: np.hypot(x, y) < (a + b) ** 2,
    "the squares of the sizes are added, not their sum squared": lambda x, y, a, b: x * x + y * y < a * a + b * b,
    "the sizes are taken for diameters": lambda x, y, a, b: np.hypot(x, y) < (a + b) / 2,
    "the sizes are doubled": lambda x, y, a, b: np.hypot(x, y) < 2 * (a + b),
    "the larger size is used alone": lambda x, y, a, b: np.hypot(x, y) < max(a, b),
    "the smaller size is used alone": lambda x, y, a, b: np.hypot(x, y) < min(a, b),
    "the size of A is used twice": lambda x, y, a, b: np.hypot(x, y) < 2 * a,
    "the size of B is used twice": lambda x, y, a, b: np.hypot(x, y) < 2 * b,
    "the sizes are subtracted": lambda x, y, a, b: np.hypot(x, y) < abs(a - b),
    "the sizes are multiplied": lambda x, y, a, b: np.hypot(x, y) < a * b,
    "x and y are compared one by one, as of boxes": lambda x, y, a, b: abs(x) < a + b and abs(y) < a + b,
    "|dx| + |dy| is taken for the distance": lambda x, y, a, b: abs(x) + abs(y) < a + b,
    "dx + dy is taken for the distance": lambda x, y, a, b: abs(x + y) < a + b,
    "only x is compared": lambda x, y, a, b: abs(x) < a + b,
    "only y is compared": lambda x, y, a, b: abs(y) < a + b,
    "the comparison is the wrong way round": lambda x, y, a, b: np.hypot(x, y) > a + b,
    "nothing is compared: all pairs collide": lambda x, y, a, b: True,
    "every pair is taken to be apart": lambda x, y, a, b: False,
}


def acts(question: tuple[Ball, ...], after: list[Ball]) -> bool:
    """Whether a call changed where two spheres are or how they move."""
    return any(not (near(b.x, a.x) and near(b.v, a.v)) for a, b in zip(question, after))


def detection_rows(answers: dict[str, Answer]) -> list[Row]:
    """The rows of (a)."""
    return [reach(answers), touch(answers["touch"]), same_centre(answers["same centre"])]


def reach(answers: dict[str, Answer]) -> Row:
    """Which of many pairs react, and the rule that gives this pattern."""
    seen = []
    for question, answer in named(answers, "reach/"):
        a, b = question.balls
        (dx, dy), size = np.subtract(a.x, b.x), (a.r, b.r)
        seen.append(((dx, dy, *size), bool(answer.balls) and acts(question.balls, answer.last)))
    cause = next((name for name, rule in RULES.items() if all(bool(rule(*q)) == was for q, was in seen)), None)
    wrong = [(q, was) for q, was in seen if was != RULES[""](*q)]
    if cause is None and mixed_up(answers):
        cause = "the distance is not the one between the centres: positions are added or mixed up"
    if not wrong:
        return judged("reach", "2a", ASKED, "the pairs that overlap", "the pairs that overlap", True)
    (dx, dy, ra, rb), was = wrong[0]
    case = f"sizes {shown(ra)} and {shown(rb)} m at a distance of {shown(np.hypot(dx, dy))} m"
    got, expected = ("collide", "do not collide") if was else ("do not collide", "collide")
    return judged(
        "reach", "2a", ASKED, f"{case}: {got} ({len(wrong)} of {len(seen)} pairs wrong)", expected, False, cause or ""
    )


ASKED = "Which pairs are taken to collide?"


def mixed_up(answers: dict[str, Answer]) -> bool:
    """Whether the sum of the positions decides, as printed by a slip in the lesson."""
    for question, answer in named(answers, "reach/"):
        a, b = question.balls
        summed = float(np.hypot(*np.add(a.x, b.x)))
        if (summed < a.r + b.r) != (bool(answer.balls) and acts(question.balls, answer.last)):
            return False
    return True


def touch(answer: Answer) -> Row:
    """Exactly touching: free."""
    reacts = acts(QUESTIONS["touch"].balls, answer.last)
    asked = "Do spheres collide whose distance is exactly the sum of the sizes?"
    note = f"compares with {'<=' if reacts else '<'}, which is free"
    return Row("touch", "2a", asked, "yes" if reacts else "no", "either", "note", note)


def same_centre(answer: Answer) -> Row:
    """Two spheres at one place have no normal; nothing may become NaN for that."""
    asked = "Are all numbers finite where two centres are at the same place?"
    values = [] if answer.failed else [x for b in answer.last for x in (*b.x, *b.v, b.alpha, b.w)]
    if values and np.isfinite(values).all():
        return judged("same centre", "2a", asked, "yes", "yes", True)
    cause = "divides by a distance of zero; the exercise does not say what to do, but the page loses both spheres"
    got = f"fails: {answer.failed}" if answer.failed else "no, NaN or infinite"
    return Row("same centre", "2a", asked, got, "yes, by a guard", "note", cause)
