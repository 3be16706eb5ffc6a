"""Task 2 of a file whose collision function fails: the parts before the failure are judged, too."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from crosscheck2d.adapters.host.file import SolverFailed
from crosscheck2d.adapters.host.process import SolverProcess
from crosscheck2d.reports.check import impulse, projection
from crosscheck2d.reports.check.detection import detection_rows
from crosscheck2d.reports.check.functions import arguments, failed_calls, failure
from crosscheck2d.reports.check.lines import SHOWN, Source
from crosscheck2d.reports.check.questions import (
    LIMIT,
    QUESTIONS,
    SolverAnswer,
    answered,
    ball,
    fresh_world,
    was_stopped,
)
from crosscheck2d.reports.check.rows import CheckRow

# s that a call may take if others are known not to return; a right one takes microseconds
SOON = 0.02
FAR = "reach/25"  # two spheres four times as far apart, in x and in y, as when they touch


def rows_until_failure(
    process: SolverProcess, answers: dict[str, SolverAnswer], source: Source
) -> list[CheckRow]:
    """The fault in the part that fails, and the rows of the parts before it, as far as they can be
    judged.

    If the call fails for a pair, the pair counts as colliding, with the positions and velocities at
    the failure. Raises `SolverFailed` if the process is lost.
    """
    failed = failed_calls(answers)
    shown = SHOWN["2"] if SHOWN["2"] in failed else next(iter(failed))
    stopped = failed[shown].failed
    assert stopped is not None
    part = source.part_of(shown, stopped.line)
    detection: list[CheckRow] = []
    if stopped.kind != "memory":  # after that the state of the process is unknown
        limit = SOON if was_stopped(answers) else LIMIT
        # the first must not be stopped before it has begun, as it may be on a busy machine
        left = left_by(process, [FAR], LIMIT) | left_by(process, [SHOWN["2"]], limit)
        # for distant spheres as for those that overlap: it fails before it compares distances
        if all(left[name].failed and not moved(left, name) for name in (FAR, SHOWN["2"])):
            part = "2a"
        else:
            left |= left_by(process, needed(answers), limit)
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


def left_by(process: SolverProcess, names: Iterable[str], limit: float) -> dict[str, SolverAnswer]:
    """The answers to these questions in a fresh world; for a call that fails, with the spheres as
    it left them, if they still have all their numbers.

    limit: s that a call may take. Each question is a separate request, because the worker answers
    none after a call that it had to stop.
    """
    process.request(fresh_world(process))
    found: dict[str, SolverAnswer] = {}
    for name in names:
        reply, spheres = process.request(
            [("ask", QUESTIONS[name].request, limit), ("left", None, LIMIT)]
        )
        found[name] = answered(reply, QUESTIONS[name])
        if found[name].failed and not isinstance(spheres, SolverFailed):
            found[name] = replace(found[name], balls=[[ball(numbers) for numbers in spheres]])
    return found


def needed(answers: dict[str, SolverAnswer]) -> list[str]:
    """The questions that judge (a) and (b); if every call runs into its time limit, only one in
    four of the pairs that judge (a)."""
    pairs = [name for name in answers if name.startswith("reach/")]
    return [
        "touch",
        "same centre",
        *projection.DISPLACED,
        *pairs[:: 4 if was_stopped(answers) else 1],
    ]


def moved(left: dict[str, SolverAnswer], name: str) -> bool:
    """Whether the call of a question has changed a position."""
    before, after = QUESTIONS[name].balls, left[name].balls
    return bool(after) and not np.array_equal([b.x for b in before], [b.x for b in after[-1]])


def beyond_detection(part: str, detection: list[CheckRow], left: dict[str, SolverAnswer]) -> str:
    """The part that fails; a part that gives right results does not, whatever was read before the
    failure."""
    if part != "2a" or any(row.verdict == "fault" for row in detection):
        return part
    return "2c" if moved(left, SHOWN["2"]) else "2b"
