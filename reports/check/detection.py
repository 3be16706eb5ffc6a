"""Task 2 (a): which spheres collide according to a solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product

import numpy as np

from crosscheck2d.adapters.own_solver.restitution import code_of
from crosscheck2d.reports.check.functions import failed_calls
from crosscheck2d.reports.check.questions import Ball, SolverAnswer
from crosscheck2d.reports.check.rows import CheckRow, judged, near, shown
from crosscheck2d.scenarios.model import Array

Rule = Callable[[float, float, float, float], bool | None]

WRONG_WAY = "the comparison is the wrong way round"
NOT_OF_THE_CENTRES = "the distance is not that of the centres"
# (dx, dy, size of A, size of B) in m -> whether they collide by the rule, None if either
RULES: dict[str, Rule] = {
    "": lambda x, y, a, b: np.hypot(x, y) < a + b,
    "only the size of A is used": lambda x, y, a, b: np.hypot(x, y) < a,
    "only the size of B is used": lambda x, y, a, b: np.hypot(x, y) < b,
    "the squared distance is compared with a size that is not squared": lambda x, y, a, b: (
        x * x + y * y < a + b
    ),
    "the distance is compared with a squared size": lambda x, y, a, b: (
        np.hypot(x, y) < (a + b) ** 2
    ),
    "the squares of the sizes are added, not their sum squared": lambda x, y, a, b: (
        x * x + y * y < a * a + b * b
    ),
    "the sizes are used as diameters": lambda x, y, a, b: np.hypot(x, y) < (a + b) / 2,
    "the sizes are doubled": lambda x, y, a, b: np.hypot(x, y) < 2 * (a + b),
    "the larger size is used alone": lambda x, y, a, b: np.hypot(x, y) < max(a, b),
    "the smaller size is used alone": lambda x, y, a, b: np.hypot(x, y) < min(a, b),
    "the size of A is used twice": lambda x, y, a, b: np.hypot(x, y) < 2 * a,
    "the size of B is used twice": lambda x, y, a, b: np.hypot(x, y) < 2 * b,
    "the sizes are subtracted": lambda x, y, a, b: np.hypot(x, y) < abs(a - b),
    "the sizes are multiplied": lambda x, y, a, b: np.hypot(x, y) < a * b,
    "x and y are compared separately, as for boxes": lambda x, y, a, b: (
        abs(x) < a + b and abs(y) < a + b
    ),
    "dx is used for dy, too": lambda x, y, a, b: np.hypot(x, x) < a + b,
    "dy is used for dx, too": lambda x, y, a, b: np.hypot(y, y) < a + b,
    "|dx| + |dy| is used as the distance": lambda x, y, a, b: abs(x) + abs(y) < a + b,
    "dx + dy is used as the distance": lambda x, y, a, b: abs(x + y) < a + b,
    "only x is compared": lambda x, y, a, b: abs(x) < a + b,
    "only y is compared": lambda x, y, a, b: abs(y) < a + b,
    WRONG_WAY: lambda x, y, a, b: np.hypot(x, y) > a + b,
    "nothing is compared: all pairs collide": lambda x, y, a, b: True,
    "no pair is taken to collide": lambda x, y, a, b: False,
}

# As JavaScript reads it: + binds before ^, and ^ truncates its operands to integers.
SQUARES: dict[str, Callable[[float, float], float]] = {
    "dx ^ 2 + dy ^ 2": lambda x, y: int(x) ^ int(2 + y) ^ 2,
    "(dx ^ 2) + (dy ^ 2)": lambda x, y: (int(x) ^ 2) + (int(y) ^ 2),
    "dx * dx + dy * dy": lambda x, y: x * x + y * y,
}
REACHES: dict[str, Callable[[float], float]] = {
    "the squared sum of the sizes": lambda s: s * s,
    "(sizeA + sizeB) ^ 2": lambda s: int(s) ^ 2,
}


def rooted(square: Callable[[float, float], float]) -> Rule:
    """Whether the root is below the sum of the sizes; the root of a negative number is NaN, which
    may compare either way."""
    return lambda x, y, a, b: None if square(x, y) < 0 else bool(square(x, y) < (a + b) ** 2)


def compared(square: Callable[[float, float], float], reach: Callable[[float], float]) -> Rule:
    """The same without a root."""
    return lambda x, y, a, b: bool(square(x, y) < reach(a + b))


BITS = "^ is not a power but XOR, which acts on bits"
# Only for a file that contains a ^: some of these match a file that compares nothing.
XOR = {
    f"{BITS}: the root of {left}": rooted(square) for left, square in SQUARES.items() if "^" in left
}
XOR |= {
    f"{BITS}: {left} is compared with {right}": compared(square, reach)
    for (left, square), (right, reach) in product(SQUARES.items(), REACHES.items())
    if "^" in left + right
}
# >= and < bind before ^, too: the comparison is with the 2.
XOR |= {
    f"{BITS}: dx ^ 2 + dy ^ 2 < (sizeA + sizeB) ^ 2": lambda x, y, a, b: (
        (int(x) ^ int(2 + y) ^ (a + b > 2) ^ 2) != 0
    ),
    f"{BITS}: dx ^ 2 + dy ^ 2 >= (sizeA + sizeB) ^ 2": lambda x, y, a, b: (
        (int(x) ^ int(2 + y) ^ (a + b <= 2) ^ 2) == 0
    ),
    f"{BITS}: dx ^ 2 + dy ^ 2 > (sizeA + sizeB) ^ 2": lambda x, y, a, b: (
        (int(x) ^ int(2 + y) ^ (a + b < 2) ^ 2) == 0
    ),
    f"{BITS}: the condition is (a < b) ^ 2, which is never zero": lambda x, y, a, b: True,
}


def acts(question: tuple[Ball, ...], after: list[Ball]) -> bool:
    """Whether a call changed the positions or velocities of two spheres."""
    return any(not (near(b.x, a.x) and near(b.v, a.v)) for a, b in zip(question, after))


def reached(answers: Mapping[str, SolverAnswer]) -> list[SolverAnswer]:
    """The answers on pairs at many distances."""
    return [answer for name, answer in answers.items() if name.startswith("reach/")]


def reacted(answer: SolverAnswer) -> bool:
    """Whether a pair collides according to the solver: it changes, or the call fails after the
    comparison."""
    return bool(answer.failed) or acts(answer.asked.balls, answer.last)


def detection_rows(answers: dict[str, SolverAnswer], text: str) -> list[CheckRow]:
    """The rows of (a); `text`: of the file."""
    return [
        reach(answers, (XOR if "^" in code_of(text) else {}) | RULES),
        touch(answers["touch"]),
        same_centre(answers["same centre"], bool(failed_calls(answers))),
    ]


def reach(answers: dict[str, SolverAnswer], rules: Mapping[str, Rule]) -> CheckRow:
    """The row on which of many pairs react; its cause is the first of the rules that gives this
    pattern."""
    seen = []
    for answer in reached(answers):
        a, b = answer.asked.balls
        (dx, dy), size = np.subtract(a.x, b.x), (a.r, b.r)
        seen.append(((dx, dy, *size), reacted(answer)))
    cause = next(
        (name for name, rule in rules.items() if all(rule(*q) in (was, None) for q, was in seen)),
        None,
    )
    wrong = [(q, was) for q, was in seen if was != RULES[""](*q)]
    if no_number(answers):
        cause = "the distance is not a number (a field that does not exist, a division by zero?)"
    cause = cause or mixed_up(answers) or margin(seen)
    if not wrong:
        return judged(
            "overlap", "2a", ASKED, "the pairs that overlap", "the pairs that overlap", True
        )
    (dx, dy, ra, rb), was = wrong[0]
    case = f"sizes {shown(ra)} and {shown(rb)} m at a distance of {shown(np.hypot(dx, dy))} m"
    got, expected = ("collide", "do not collide") if was else ("do not collide", "collide")
    return judged(
        "overlap",
        "2a",
        ASKED,
        f"{case}: {got} ({len(wrong)} of {len(seen)} pairs wrong)",
        expected,
        False,
        cause or "",
    )


ASKED = "Which pairs collide, according to the file?"


def no_number(answers: dict[str, SolverAnswer]) -> bool:
    """Whether the positions of all pairs, near or far, become NaN or infinite."""
    places = [[b.x for b in answer.last] for answer in reached(answers) if answer.balls]
    return bool(places) and not np.isfinite(places).any()


# (position of A, position of B) -> a wrong vector between them
MIXED: dict[str, Callable[[Array, Array], Array]] = {
    "the positions are added, not subtracted": lambda a, b: a + b,
    "dx is xA + xB": lambda a, b: a + b * [1, -1],
    "dy is yA + yB": lambda a, b: a + b * [-1, 1],
    "x and y of B are exchanged": lambda a, b: a - b[::-1],
    "dx is xA - yB": lambda a, b: a - b[[1, 1]],
    "dy is yA - xB": lambda a, b: a - b[[0, 0]],
    "dx is xA - yA": lambda a, b: np.array([a[0] - a[1], a[1] - b[1]]),
    "dy is xB - yB": lambda a, b: np.array([a[0] - b[0], b[0] - b[1]]),
}


def mixed_up(answers: dict[str, SolverAnswer]) -> str | None:
    """The cause that the vector between the centres has the wrong terms; None if no vector of
    `MIXED` gives the pairs that react."""
    seen = [(answer.asked.balls, reacted(answer)) for answer in reached(answers)]
    for name, vector in MIXED.items():
        if all(
            (np.hypot(*vector(np.array(a.x), np.array(b.x))) < a.r + b.r) == was
            for (a, b), was in seen
        ):
            return f"{NOT_OF_THE_CENTRES}: {name}"
    return None


def margin(seen: list[tuple[tuple[float, float, float, float], bool]]) -> str | None:
    """The cause that a length is added to the sizes, or that they are multiplied by a factor, as
    far as the distances asked tell it; None if neither gives the pairs that react."""
    distances, sizes = (
        np.array([np.hypot(x, y) for (x, y, _, _), _ in seen]),
        np.array([a + b for (_, _, a, b), _ in seen]),
    )
    was = np.array([reacts for _, reacts in seen])
    if was.all() or not was.any():
        return None
    far, near_by = (distances - sizes)[was].max(), (distances - sizes)[~was].min()
    if far < near_by and far > 0:
        return f"pairs with a gap of {shown(far)} m between them are taken to collide, too"
    if far < near_by < 0:
        return f"pairs that overlap by only {shown(-near_by)} m are not taken to collide"
    largest, smallest = (distances / sizes)[was].max(), (distances / sizes)[~was].min()
    if largest < smallest:
        between = f"{shown(largest)} and {shown(smallest)}"
        return f"the sum of the sizes is multiplied by a number between {between}"
    return None


def touch(answer: SolverAnswer) -> CheckRow:
    """Whether spheres that just touch collide: a free choice."""
    reacts = reacted(answer)
    asked = "Do spheres collide whose distance is exactly the sum of the sizes?"
    sign = "<=" if reacts else "<"
    said = f"the comparison is {sign}"
    got = "yes" if reacts else "no"
    return CheckRow("just touching", "2a", asked, got, "yes or no", "free choice", said)


def same_centre(answer: SolverAnswer, others_fail: bool) -> CheckRow:
    """Two spheres at the same position have no normal, and the exercise does not define the result;
    but the call must return. `others_fail`: it fails for other pairs, too."""
    asked = "What happens to two spheres whose centres coincide?"
    if answer.failed and answer.failed.kind == "timeout" and not others_fail:
        cause = f"for two spheres at the same place the function {answer.failed}"
        return judged("same centre", "2a", asked, "the call goes on", "anything", False, cause)
    values = [] if answer.failed else [x for b in answer.last for x in (*b.x, *b.v, b.alpha, b.w)]
    guarded = bool(values) and bool(np.isfinite(values).all())
    said = (
        "the file handles this case"
        if guarded
        else "the call fails for other pairs, too, so that nothing is known about this case"
        if answer.failed and others_fail
        else "the file does not handle this case; the direction between the two is 0 / 0"
    )
    got = (
        "they keep finite numbers"
        if guarded
        else f"the call fails: {answer.failed}"
        if answer.failed
        else "their numbers become NaN or infinite"
    )
    return CheckRow("same centre", "2a", asked, got, "anything", "free choice", said)
