"""Checks before a function is judged: does it exist, does it return, does it change its arguments
and nothing else?"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from difflib import get_close_matches

from crosscheck2d.adapters.own_solver.restitution import code_of
from crosscheck2d.reports.check.questions import Ball, SolverAnswer, was_stopped
from crosscheck2d.reports.check.rows import SAME_AGAIN, CheckRow, judged, near

FUNCTIONS = {"1": "integrate", "2a": "sphereSphereCollisionHandling"}
MAY_FAIL = ("same centre",)  # judged by its own row


def implemented(
    task: str, there: bool, answers: dict[str, SolverAnswer], text: str
) -> tuple[list[CheckRow], bool]:
    """The rows on the function of a task and its arguments, and whether further checks are
    possible."""
    function = FUNCTIONS[task]
    if not there:
        missing = (
            f"not implemented: the file has no function {function}{similar_name(function, text)}"
        )
        return [not_implemented(task, "there is no such function", missing)], False
    if failed_calls(answers):
        return [failure(task, task, answers)], False
    if not any(
        changed(answer.asked.balls, answer.last) for answer in answers.values() if answer.balls
    ):
        idle = why_unchanged(function, answers.values())
        return [not_implemented(task, "nothing is changed", idle)], False
    return [arguments(task, function, answers.values())], True


def failed_calls(answers: dict[str, SolverAnswer]) -> dict[str, SolverAnswer]:
    """The answers of failed calls, among those from which a right function returns."""
    return {
        name: answer for name, answer in answers.items() if answer.failed and name not in MAY_FAIL
    }


def failure(task: str, part: str, answers: dict[str, SolverAnswer]) -> CheckRow:
    """The fault of a function that fails in a part of its task."""
    failed = failed_calls(answers)
    got = f"it fails in {len(failed)} of {len(answers)} calls"
    if was_stopped(failed):
        got = "a call does not return; those after it are not tried"
    why = next(answer.failed for answer in failed.values())
    asked = f"Does {FUNCTIONS[task]} return from every call?"
    cause = f"{FUNCTIONS[task]}: {why}"
    return judged("implemented", part, asked, got, "yes", False, cause)


def not_implemented(task: str, got: str, cause: str) -> CheckRow:
    """The fault that a function is missing, or changes nothing."""
    asked = f"Does {FUNCTIONS[task]} change the spheres it is given?"
    return judged("implemented", task, asked, got, "it changes them", False, cause)


def same_again(
    function: str, answers: dict[str, SolverAnswer], others: dict[str, SolverAnswer], text: str
) -> list[CheckRow]:
    """A fault if answers depend on earlier questions, in the part of the task that they affect;
    else nothing. `others`: the answers that differ; `text`: of the file."""
    mine = {name: other for name, other in others.items() if name in answers}
    if not mine:
        return []
    # After a question that made it NaN, later calls leave it as it is.
    kept = {name for k, other in mine.items() for name in (*other.kept, *answers[k].kept)}
    kept = kept or globals_changed(text)
    kept = {name for name in kept if is_read(name, text)}
    where = f" in the global {min(kept)}" if len(kept) == 1 else ""
    return [
        judged(
            SAME_AGAIN,
            "1" if function == "integrate" else changed_part(answers, mine),
            f"Does {function} give the same result for the same spheres, whatever the earlier"
            " calls?",
            f"{len(mine)} of {len(answers)} answers depend on earlier calls",
            "none does",
            False,
            f"{function} keeps a value{where} from one call to the next, so every question was"
            " asked in a fresh world",
        )
    ]


def globals_changed(text: str) -> set[str]:
    """The variables that a file defines outside functions and changes, or has a field changed, in
    indented lines, as far as its text shows."""
    code = code_of(text)
    defined = set(re.findall(r"^(?:let |var |const )?(\w+)\s*=(?!=)", code, re.MULTILINE))
    inside = [line for line in code.splitlines() if line[:1].isspace() and len(line) <= LONGEST]
    own = {name for line in inside for name in re.findall(r"\b(?:let|var|const)\s+(\w+)", line)}
    changed = {name for line in inside for name in re.findall(rf"\b(\w+){CHANGED}", line)}
    return defined & changed - own - {"ufo", "asteroids"}


def is_read(name: str, text: str) -> bool:
    """Whether a file uses a variable elsewhere than where it is defined or changed, as far as its
    text shows: one that only counts or collects affects no answer."""
    changed_only = re.compile(rf"\b{name}{CHANGED}|\bglobal {name}\b")
    return bool(re.search(rf"\b{name}\b", changed_only.sub("", code_of(text))))


LONGEST = 200  # characters of a line that is searched
# n = ..., n.x += ..., n[0]++, n.push(...)
CHANGED = r"(?:(?:\.\w+|\[[^\]]*\])*\s*(?:[-+*/]?=(?!=)|\+\+|--)|\.(?:push|append|add)\()"


def keeps_state(rows: Iterable[CheckRow]) -> bool:
    """Whether a row says that the file keeps state between calls."""
    return any(row.name == SAME_AGAIN and row.verdict == "fault" for row in rows)


def changed_part(answers: dict[str, SolverAnswer], others: dict[str, SolverAnswer]) -> str:
    """The part of task 2 whose outcome depends on earlier calls."""

    def differs(read: Callable[[SolverAnswer], object]) -> bool:
        return any(
            not near(read(answers[name]), read(other))
            for name, other in others.items()
            if answers[name].balls and other.balls
        )

    if differs(lambda answer: [b.x for b in answer.last]):
        return "2b"
    return "2c" if differs(lambda answer: [b.v for b in answer.last]) else "2d"


def similar_name(function: str, text: str) -> str:
    """A similar name in the file that may have been meant; "" if there is none."""
    names = re.findall(r"\b(?:function\s*\*?|def|const|let|var)\s+(\w+)", text)
    if function in names:
        return ", but one inside another function or class, where it cannot be called"
    near_ones = get_close_matches(function.lower(), [name.lower() for name in names], 1, 0.8)
    meant = next((name for name in names if name.lower() in near_ones), "")
    return f", but {meant}" if meant else ""


def why_unchanged(function: str, answers: Iterable[SolverAnswer]) -> str:
    """A likely reason why nothing changed."""
    answers = list(answers)
    if any(answer.returned for answer in answers):
        return f"{function} returns something new; it must change the spheres it is given"
    if any(answer.strayed for answer in answers):
        return f"{function} changes the global ufo or asteroids, not the spheres it is given"
    strange = sorted({name for answer in answers for name in answer.strange})
    if strange:
        return f"{function} writes the field {strange[0]!r}, which a sphere does not have"
    return f"not implemented: {function} does nothing, or changes only copies"


def arguments(task: str, function: str, answers: Iterable[SolverAnswer]) -> CheckRow:
    """Whether only the given spheres are changed, and only fields that they have."""
    answers = list(answers)
    strange = sorted({name for answer in answers for name in answer.strange})
    strayed = any(answer.strayed for answer in answers)
    cause = f"it writes the field {strange[0]!r}, which a sphere does not have" if strange else ""
    cause = "it changes the global ufo or asteroids, too" if strayed else cause
    return judged(
        "input only",
        task,
        f"Does {function} change the spheres it is given and nothing else?",
        "no" if cause else "yes",
        "yes",
        not cause,
        cause,
    )


def changed(before: tuple[Ball, ...], after: list[Ball]) -> bool:
    """Whether any number of any sphere differs."""
    return any(not near(y.numbers(), x.numbers()) for x, y in zip(before, after))
