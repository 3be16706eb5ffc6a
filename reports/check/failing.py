"""Task 2 of a file whose collision function fails: the parts before the failure are judged, too."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from adapters.own_solver.file import SolverFailed
from adapters.own_solver.process import SolverProcess
from reports.check import impulse, projection
from reports.check.detection import detection_rows
from reports.check.functions import arguments, failed_calls, failure
from reports.check.lines import SHOWN, Source
from reports.check.questions import (
    LIMIT,
    QUESTIONS,
    Answer,
    answered,
    ball,
    fresh_world,
    stuck,
)
from reports.check.rows import CheckRow

# s that a call may take where others are known to take for ever; a right one takes microseconds
SOON = 0.1
FAR = "reach/25"  # two spheres four times as far from each other, in x and in y, as they touch


def rows_until_failure(
    process: SolverProcess, answers: dict[str, Answer], source: Source
) -> list[CheckRow]:
    """The fault in the part that fails, and the rows of the parts before it, as far as they can be
    judged.

    A pair for which the call fails is taken to collide, and has the places and the velocities that
    the call had given it. Raises `SolverFailed` if the process is lost.
    """
    failed = failed_calls(answers)
    shown = SHOWN["2"] if SHOWN["2"] in failed else next(iter(failed))
    stopped = failed[shown].failed
    assert stopped is not None
    part = source.part_of(shown, stopped.line)
    detection: list[CheckRow] = []
    if stopped.kind != "memory":  # after which nobody knows what state the process is in
        limit = SOON if stuck(answers) else LIMIT
        left = left_by(process, [FAR, SHOWN["2"]], limit)
        if fails_at_once(left):
            part = "2a"
        else:
            left |= left_by(process, needed(answers), limit)
            left |= left_by(process, doubtful(left), LIMIT)
            detection = detection_rows(left, source.text)
            part = beyond_detection(part, detection, left)
    rows = [failure("2a", part, answers)]
    if part == "2a" or not detection:
        return rows
    rows += [arguments("2a", "sphereSphereCollisionHandling", left.values()), *detection]
    if part != "2b":
        rows += projection.rows_before_failure(left)
    if part == "2d":
        rows += impulse.rows_before_failure(left)
    return sorted(rows, key=lambda row: row.task)


def left_by(process: SolverProcess, names: Iterable[str], limit: float) -> dict[str, Answer]:
    """The answers to these questions in a fresh world; of a call that fails with the spheres as it
    has left them, if they still have all their numbers.

    limit: s that a call may take. Each question is a request of its own: the worker answers none
    after a call that it had to stop.
    """
    process.request(fresh_world(process))
    found: dict[str, Answer] = {}
    for name in names:
        reply, spheres = process.request(
            [("ask", QUESTIONS[name].request, limit), ("left", None, LIMIT)]
        )
        found[name] = answered(reply)
        if found[name].failed and not isinstance(spheres, SolverFailed):
            found[name] = replace(found[name], balls=[[ball(numbers) for numbers in spheres]])
    return found


def needed(answers: dict[str, Answer]) -> list[str]:
    """The questions that (a) and (b) are judged by; where each call has to be waited for, one in
    four of the pairs that tell which are taken to collide."""
    pairs = [name for name in answers if name.startswith("reach/")]
    return ["touch", "same centre", *projection.DISPLACED, *pairs[:: 4 if stuck(answers) else 1]]


def fails_at_once(left: dict[str, Answer]) -> bool:
    """Whether the call fails for two spheres that are far from each other as it does for two that
    overlap, before it moves any: it fails before it knows which of the two it has."""
    return all(bool(left[name].failed) and not moved(left, name) for name in (FAR, SHOWN["2"]))


def doubtful(left: dict[str, Answer]) -> list[str]:
    """The questions to ask once more with more time: those whose call failed before it moved a
    sphere, except overlapping pairs that only tell whether they are taken to collide.

    On a busy machine a call may be stopped before it has done anything.
    """
    idle = (name for name, answer in left.items() if answer.failed and not moved(left, name))
    return [name for name in idle if name in projection.DISPLACED or apart(name)]


def apart(name: str) -> bool:
    """Whether the two spheres of a question do not overlap."""
    a, b = QUESTIONS[name].balls
    return bool(np.hypot(*np.subtract(a.x, b.x)) > a.r + b.r)


def moved(left: dict[str, Answer], name: str) -> bool:
    """Whether the call of a question has changed a position."""
    before, after = QUESTIONS[name].balls, left[name].balls
    return bool(after) and not np.array_equal([b.x for b in before], [b.x for b in after[-1]])


def beyond_detection(part: str, detection: list[CheckRow], left: dict[str, Answer]) -> str:
    """The part that fails: none that comes out right, whatever was read before the failure."""
    if part != "2a" or any(row.verdict == "fault" for row in detection):
        return part
    return "2c" if moved(left, SHOWN["2"]) else "2b"
