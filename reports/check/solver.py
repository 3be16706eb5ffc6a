"""`check_solver`: all rows of one solver's file."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from adapters.own_solver.file import SolverFailed, SolverText, read_solver
from adapters.own_solver.process import SolverProcess
from reports.check.detection import detection_rows
from reports.check.functions import implemented
from reports.check.impacts import APPROACH, BACKWARDS, explain
from reports.check.impulse import impulse_not_asked, impulse_rows
from reports.check.loop import loop_rows
from reports.check.motion import motion_rows
from reports.check.projection import moved_together, projection_rows
from reports.check.questions import COLLISIONS, QUESTIONS, Answer, ask
from reports.check.restitution import Restitution, code_of, restitution_of
from reports.check.rows import CheckRow, judged, not_asked
from reports.check.scenes import scene_rows


def check_solver(path: Path | str) -> list[CheckRow]:
    """What was asked of a solver's file and what came of it, task by task.

    Raises:
        NotASolver: the path is no JavaScript or Python text.
    """
    return examine(read_solver(Path(path)))[0]


def examine(solver: SolverText) -> tuple[list[CheckRow], float | None]:
    """The rows of a file, and the restitution that its scenes are judged by."""
    try:
        process = SolverProcess(solver)
    except SolverFailed as failure:
        return [judged("loads", "file", LOADS, f"no: {failure}", "yes", False, str(failure))], None
    try:
        with process:
            return rows_of(process, solver.text)
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


LOADS = "Can the file be loaded, and does it leave the language as it is?"


def rows_of(process: SolverProcess, text: str) -> tuple[list[CheckRow], float | None]:
    """The rows of a file that is loaded, and its restitution; raises `SolverFailed` if its process
    is lost."""
    # Makes the globals that must not change; judged with the step.
    begun = process.request([("begin", None, 2.0)])[0] if process.functions["begin"] else None
    asked = {
        k: q
        for k, q in QUESTIONS.items()
        if process.functions["integrate" if k in MOTION else "collide"]
    }
    answers = ask(process, asked)
    rows = [loads(process), *task_1(process, answers, text)]
    contact, restitution = task_2(process, answers, text)
    rows += contact
    faulty = any(row.verdict == "fault" for row in rows)
    if stuck(answers):
        rows.append(not_asked("step", "loop", "a call did not come back"))
    else:
        rows += loop_rows(process, faulty, begun)
    e = restitution.played if restitution is not None else None
    rows += scene_rows(process, rows, e)
    return hinted(rows, text) if process.kind == "javascript" else rows, e


def hinted(rows: list[CheckRow], text: str) -> list[CheckRow]:
    """The rows, the first fault with a word on a condition that sets a variable, if the file has
    one.

    Python takes no such condition.
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


MOTION = ("force", "force, other numbers", "coast", "force twice")


def stuck(answers: dict[str, Answer]) -> bool:
    """Whether a call had to be stopped: whatever makes it again would have to be stopped, too."""
    return any(
        answer.failed and answer.failed.kind in ("timeout", "memory") for answer in answers.values()
    )


def loads(process: SolverProcess) -> CheckRow:
    """Loaded, and which built-ins it has replaced for everybody."""
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


def task_1(process: SolverProcess, answers: dict[str, Answer], text: str) -> list[CheckRow]:
    """The rows of integrate."""
    mine = {name: answer for name, answer in answers.items() if name in MOTION}
    rows, usable = implemented("1", process.functions["integrate"], mine, text)
    return rows + (
        motion_rows(mine)
        if usable
        else [not_asked("velocity", "1", "integrate cannot be judged further")]
    )


def task_2(
    process: SolverProcess, answers: dict[str, Answer], text: str
) -> tuple[list[CheckRow], Restitution | None]:
    """The rows of the collision function, and its restitution where it has one."""
    mine = {name: answer for name, answer in answers.items() if name not in MOTION}
    rows, usable = implemented("2a", process.functions["collide"], mine, text)
    if not usable:
        why = "the collision function cannot be judged further"
        return rows + [not_asked("one point", "2b", why), *impulse_not_asked(why)], None
    rows += detection_rows(mine, text)
    if not reacts(mine):
        why = "the overlapping pairs of these questions are taken to be apart"
        return rows + [not_asked("one point", "2b", why), *impulse_not_asked(why)], None
    restitution = restitution_of(text, mine)
    found = explain(mine, restitution)
    if found is not None and found.impulse == APPROACH and moved_together(mine):
        found = replace(found, impulse=BACKWARDS)
    rows += projection_rows(mine, found)
    return rows + impulse_rows(mine, restitution, found), restitution


def reacts(answers: dict[str, Answer]) -> bool:
    """Whether every pair that is asked about beyond detection does something."""
    return all(
        not np.array_equal(
            [b.numbers() for b in answers[name].last], [b.numbers() for b in QUESTIONS[name].balls]
        )
        for name in COLLISIONS
    )
