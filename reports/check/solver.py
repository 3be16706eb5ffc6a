"""`check_solver`: all rows of one solver's file."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from crosscheck2d.adapters.own_solver.file import SolverFailed, SolverText, read_solver
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.adapters.own_solver.restitution import code_of, own_text, with_restitution
from crosscheck2d.reports.check.consequences import with_consequences
from crosscheck2d.reports.check.detection import WRONG_WAY, detection_rows
from crosscheck2d.reports.check.failing import rows_until_failure
from crosscheck2d.reports.check.functions import failed_calls, implemented, same_again
from crosscheck2d.reports.check.impacts import (
    APPROACH,
    BACKWARDS,
    NEVER,
    CollisionExplanation,
    explain,
    in_call,
)
from crosscheck2d.reports.check.impulse import AS_PRINTED, impulse_rows
from crosscheck2d.reports.check.lines import Source, named_line
from crosscheck2d.reports.check.loop import loop_rows
from crosscheck2d.reports.check.motion import TURNED, motion_rows
from crosscheck2d.reports.check.projection import (
    DISPLACES_VELOCITY,
    TAKEN_TO_BE_APART,
    moved_together,
    overlap,
    projection_rows,
    reacts,
)
from crosscheck2d.reports.check.questions import (
    APART,
    CLOSER,
    COLLISIONS,
    ON_COLLISIONS,
    QUESTIONS,
    SolverAnswer,
    ask,
    ask_in_two_orders,
    renew,
    was_stopped,
)
from crosscheck2d.reports.check.restitution import Restitution, restitution_of
from crosscheck2d.reports.check.rows import INTEGRATES, UNKNOWN, CheckRow, judged, near, not_asked
from crosscheck2d.reports.check.scenes import scene_rows


def check_solver(path: Path | str) -> list[CheckRow]:
    """The check of a solver's file, task by task.

    Raises:
        NotASolver: the path is not JavaScript or Python text.
    """
    return examine(read_solver(Path(path)))[0]


def examine(solver: SolverText) -> tuple[list[CheckRow], float | None]:
    """The rows of a file, and the restitution for judging its scenes."""
    try:
        process = SolverProcess(solver)
    except SolverFailed as failure:
        row = judged("loads", "file", LOADS, f"no: {failure}", "yes", False, str(failure))
        return [replace(row, lines=named_line(row.cause, solver.text))], None
    try:
        with process:
            return rows_of(process, solver)
    except SolverFailed as failure:
        lost = judged(
            "answers",
            "file",
            "Does it answer when its functions are called?",
            "no",
            "yes",
            False,
            str(failure),
        )
        return [loads(process), lost], None


LOADS = "Can the file be loaded, and does it leave the built-in functions as they are?"


def rows_of(process: SolverProcess, solver: SolverText) -> tuple[list[CheckRow], float | None]:
    """The rows of a loaded file, and its restitution. Raises `SolverFailed` if its process is
    lost."""
    text = solver.text
    asked = {
        k: q
        for k, q in QUESTIONS.items()
        if process.functions["integrate" if k in MOTION else "collide"]
    }
    answers, others = ask_in_two_orders(process, asked)
    source = Source(process, text)
    rows = [loads(process), *task_1(process, answers, others, text)]
    contact, restitution = task_2(process, answers, others, source, solver)
    rows += contact
    faulty = any(row.verdict == "fault" for row in rows)
    if was_stopped(answers):
        rows.append(not_asked("step", "loop", "a call did not return"))
    else:
        kicks_apart = any(row.cause == AS_PRINTED for row in rows)
        rows += loop_rows(process, faulty, kicks_apart)
    e = restitution.for_scenes if restitution is not None else None
    rows = with_consequences([*rows, *scene_rows(process, rows, e)])
    rows = hinted(rows, text) if process.kind == "javascript" else rows
    return with_lines(rows, source), e


def with_lines(rows: list[CheckRow], source: Source) -> list[CheckRow]:
    """The rows, each fault with the lines of the file that it is about."""
    try:
        return [
            replace(row, lines=source.of(row)) if row.verdict == "fault" else row for row in rows
        ]
    except SolverFailed:  # the process is lost; the rows already say how the file fails
        return rows


def hinted(rows: list[CheckRow], text: str) -> list[CheckRow]:
    """The rows; if a condition of the file has = instead of ==, the cause of the first fault
    mentions it. Python does not load such a file.
    """
    slip, faulty = (
        SET_IN_CONDITION.search(code_of(text)),
        (row for row in rows if row.verdict == "fault"),
    )
    if slip is None or (first := next(faulty, None)) is None:
        return rows
    line = text.count("\n", 0, slip.start()) + 1
    hint = f"{first.cause} (line {line} has = in the condition of {slip[1]}: it sets, == compares)"
    return [replace(row, cause=hint) if row.cause == first.cause else row for row in rows]


SET_IN_CONDITION = re.compile(r"\b(if|while)\s*\(\s*[\w.]+\s*=(?![=>])")


MOTION = ("force", "force, other numbers", "coast", "force twice", *TURNED)


def loads(process: SolverProcess) -> CheckRow:
    """The row on loading the file, and on the built-ins that it replaces."""
    replaced = process.functions["replaced"]
    what = ", ".join(replaced)
    return judged(
        "loads",
        "file",
        LOADS,
        f"replaces {what}" if what else "yes",
        "yes",
        not replaced,
        f"the file replaces {what}, which the rest of the page uses, too",
    )


def task_1(
    process: SolverProcess,
    answers: dict[str, SolverAnswer],
    others: dict[str, SolverAnswer],
    text: str,
) -> list[CheckRow]:
    """The rows of integrate; `others`: the answers that differ after other questions."""
    mine = {name: answer for name, answer in answers.items() if name in MOTION}
    rows, usable = implemented("1", process.functions["integrate"], mine, text)
    if not usable:
        return [*rows, not_asked("velocity", "1", "integrate cannot be judged further")]
    return [*rows, *same_again("integrate", mine, others, text), *motion_rows(mine)]


def task_2(
    process: SolverProcess,
    answers: dict[str, SolverAnswer],
    others: dict[str, SolverAnswer],
    source: Source,
    solver: SolverText,
) -> tuple[list[CheckRow], Restitution | None]:
    """The rows of the collision function, and its restitution if its collisions have one."""
    mine, text = {k: answer for k, answer in answers.items() if k not in MOTION}, source.text
    if failed_calls(mine):
        return with_not_asked(rows_until_failure(process, mine, source), HIDDEN), None
    rows, usable = implemented("2a", process.functions["collide"], mine, text)
    if not usable:
        return with_not_asked(rows, NO_FURTHER), None
    rows += detection_rows(mine, text)
    if not reacts(mine):
        wrong_way = any(row.cause == WRONG_WAY for row in rows)
        source.questions |= (instead := APART if wrong_way else CLOSER)
        renew(process)
        mine |= ask(process, instead)
    if failed_calls(mine) or not reacts(mine):
        return with_not_asked(rows, TAKEN_TO_BE_APART), None
    restitution = restitution_of(own_text(solver), mine)
    found = explain(mine, restitution)
    if found is not None and found.impulse == NEVER and restitution.own == 1:
        found = zero_at_one(solver) or found
    if found is not None and found.impulse == APPROACH and moved_together(mine):
        found = replace(found, impulse=BACKWARDS)
    rows += same_again("sphereSphereCollisionHandling", mine, others, text)
    projected = projection_rows(mine, found)
    rows += projected if overlap(mine) else [seen_apart(row) for row in projected]
    computed, written = source.computes_with("velocity"), source.writes("velocity")
    rows += impulse_rows(mine, restitution, found, computed, written)
    if not any((row.name, row.verdict) == ("impulse", "right") for row in rows):
        rows = [unknown_at_touch(row) for row in rows]
    if any(row.name == "rest kept" and row.verdict == "fault" for row in rows):
        rows = [integrating(row) if source.integrates else row for row in rows]
    return sorted(rows, key=lambda row: row.task), restitution


def zero_at_one(solver: SolverText) -> CollisionExplanation | None:
    """The mistake of a file with e = 1 by which its J is 0 only because of this number: the one
    that explains the collisions of the same text with e = 0.75. None if there is none."""
    changed = with_restitution(solver.text, 1.0, 0.75)
    asked = {name: QUESTIONS[name] for name in ON_COLLISIONS}
    try:
        with SolverProcess(replace(solver, text=changed)) as process:
            answers = ask(process, asked)
    except SolverFailed:
        return None
    if failed_calls(answers):
        return None
    found = explain(answers, restitution_of(changed, answers))
    pair, _ = in_call(answers[next(iter(COLLISIONS))])
    if found is None or found.impulse == NEVER or not near(found.law(pair, 1.0), 0.0):
        return None
    return replace(found, e=1.0)


def seen_apart(row: CheckRow) -> CheckRow:
    """A row of (b) on pairs with a gap, which a right displacement closes: a wrong answer may be
    that to the gap only, so that it is no fault."""
    if row.verdict != "fault":
        return row
    return not_asked(row.name, row.task, TAKEN_TO_BE_APART)


def unknown_at_touch(row: CheckRow) -> CheckRow:
    """A row, if it is the one on spheres that just touch, without a claim about a pair that keeps
    its velocities: a wrong impulse may be 0."""
    if row.name != "just touching" or row.got == "yes":
        return row
    return replace(
        row,
        got="not known",
        cause="not known: the pair keeps its velocities, but the impulse is not the right one",
    )


def integrating(row: CheckRow) -> CheckRow:
    """A row of a collision function that calls integrate: its unexplained faults follow from
    that."""
    if row.verdict != "fault":
        return row
    if row.name == "rest kept":
        return replace(row, cause=INTEGRATES)
    late = row.cause == UNKNOWN or row.cause == DISPLACES_VELOCITY or "unknown:" in row.cause
    return replace(row, verdict="follows", cause=FOLLOWS_INTEGRATION) if late else row


FOLLOWS_INTEGRATION = "it follows from the call of integrate"
NO_FURTHER = "the collision function cannot be judged further"
HIDDEN = "the collision function fails, so that this cannot be seen"


def with_not_asked(rows: list[CheckRow], why: str) -> list[CheckRow]:
    """The rows of task 2, plus a "not asked" row for each part without one."""
    first = {"2a": "overlap", "2b": "one point", "2c": "impulse", "2d": "velocity of A"}
    judged_parts = {row.task for row in rows}
    added = [not_asked(name, part, why) for part, name in first.items() if part not in judged_parts]
    return sorted([*rows, *added], key=lambda row: row.task)
