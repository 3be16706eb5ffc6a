"""The summary of the rows of one file: a verdict for each task, and the most helpful sentences."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from crosscheck2d.adapters.host.file import NotASolver, SolverText, printable, read_solver
from crosscheck2d.adapters.host.gl_matrix import lacks_gl_matrix
from crosscheck2d.adapters.host.process import clock_endings
from crosscheck2d.adapters.host.restitution import code_of
from crosscheck2d.adapters.host.surface import holder_of, is_engine
from crosscheck2d.reports.check.functions import FUNCTIONS
from crosscheck2d.reports.check.questions import use_seed
from crosscheck2d.reports.check.rows import SAME_AGAIN, TASKS, UNKNOWN, CheckRow, Verdict, worst
from crosscheck2d.reports.check.solver import examine

ENGINE = "is an engine (create, step, read), and check is for solvers of the exercise"
RUN_INSTEAD = "to judge it: crosscheck run bouncing_ball_e09 --engine"
MOST = 3  # sentences
NONE = "holds no .js and no .py file"
NAMED = 3  # files that are none


class Tally(NamedTuple):
    """Questions: how many could be asked, and how many of them have a wrong answer. The names of
    the fields head these columns in every table of a check."""

    asked: int
    wrong: int


@dataclass(frozen=True)
class FileCheck:
    """The check of one file.

    Attributes:
        path: of the file.
        rows: what was checked; none of a file that is no solver.
        refused: why it is no solver; "" if it is one.
        restitution: used to judge its whole scenes; None if they cannot be judged.
        solver: the text that was checked; None if there is none.
        seconds: duration of the check.
        waited: the clock has ended a call of it, as it may on a busy machine.
    """

    path: Path
    rows: Sequence[CheckRow]
    refused: str = ""
    restitution: float | None = None
    solver: SolverText | None = None
    seconds: float = 0.0
    waited: bool = False

    @property
    def faults(self) -> list[CheckRow]:
        """The rows that found a fault, in order of the tasks."""
        return [row for row in self.rows if row.verdict == "fault"]

    @property
    def choices(self) -> list[CheckRow]:
        """The rows on free choices."""
        return [row for row in self.rows if row.verdict == "free choice"]

    @property
    def passed(self) -> bool:
        """Whether no fault was found."""
        return not self.refused and not self.faults

    @property
    def loaded(self) -> bool:
        """Whether the file was loaded, so that its tasks have rows."""
        return any(row.task != "file" for row in self.rows)

    @property
    def unjudged(self) -> bool:
        """Whether nothing is known of its tasks."""
        return bool(self.refused) or not self.loaded

    def of(self, task: str) -> list[CheckRow]:
        """The rows of a task."""
        return [row for row in self.rows if row.task == task]

    def tally(self, *tasks: str) -> Tally:
        """The questions of these tasks, of all without any; a choice that is free is asked and not
        wrong."""
        rows = [row for row in self.rows if not tasks or row.task in tasks]
        return Tally(
            sum(row.verdict != "not asked" for row in rows),
            sum(row.verdict in ("fault", "follows") for row in rows),
        )

    @property
    def tasks(self) -> dict[str, Verdict]:
        """Task -> its worst verdict."""
        return {task: worst(self.of(task)) for task in TASKS}

    def word(self, task: str) -> str:
        """The verdict of a task for people: "partly asked" if all that could be asked is right."""
        word = self.tasks[task]
        some = any(row.verdict != "not asked" for row in self.of(task))
        return "partly asked" if word == "not asked" and some else word

    @property
    def sentences(self) -> list[str]:
        """At most `MOST` sentences, in the order of the tasks. Each cause has one; consequences of
        a fault have none."""
        if self.refused:
            return [self.refused]
        if not self.faults:
            said = f"No fault found: {self.tally().asked} questions, {len(self.choices)} of them"
            return [f"{said} about free choices.{self.own_step}"]
        return [sentence(row) for row in self.findings]

    @property
    def shared(self) -> str:
        """A sentence with the functions in which one mistake may be behind several faults; "" if
        there are none."""
        return "" if self.solver is None else shared_functions(self.rows, self.solver.text)

    @property
    def own_step(self) -> str:
        """A sentence that the file's own performSimStep was not judged; "" if it was, or if the
        file has none."""
        why = next((row.cause for row in self.of("loop") if row.name == "step"), "")
        return f" Its performSimStep was not judged: {why}." if "initScene" in why else ""

    @property
    def brief(self) -> str:
        """The first sentence; without its numbers where the cause is known."""
        if self.passed or self.refused:
            return self.sentences[0]
        row = self.findings[0]
        return sentence(row) if row.cause == UNKNOWN else headline(row)

    @property
    def findings(self) -> list[CheckRow]:
        """The faults behind the sentences, in their order."""
        return self.causes[:MOST]

    @property
    def causes(self) -> list[CheckRow]:
        """The first row of each cause, in order of the tasks."""
        first = {(row.task, row.cause): row for row in reversed(self.faults)}
        return sorted(first.values(), key=self.faults.index)

    def also(self, finding: CheckRow) -> list[CheckRow]:
        """The other rows that the same fault has."""
        cause = (finding.task, finding.cause)
        return [row for row in self.faults if (row.task, row.cause) == cause and row != finding]

    def number_of(self, row: CheckRow) -> int:
        """The number, from 1, of the sentence that a row belongs to; 0 if it has none."""
        causes = [(one.task, one.cause) for one in self.findings]
        cause = (row.task, row.cause)
        return causes.index(cause) + 1 if row.verdict == "fault" and cause in causes else 0

    @property
    def consequences(self) -> list[CheckRow]:
        """The rows that follow from the faults."""
        return [row for row in self.rows if row.verdict == "follows"]


def sentence(row: CheckRow) -> str:
    """A sentence with task, likely cause, question and numbers."""
    return " ".join([headline(row), *numbers_of(row)])


def headline(row: CheckRow) -> str:
    """A sentence with task and likely cause."""
    what = f", {row.name}" if row.name in PARTS_OF_A_TASK else ""
    return f"{task_title(row.task)}{what}: {row.cause}."


# the noun for "it" in the causes
PARTS_OF_A_TASK = ("velocity", "position", "spin", "angle", "turns", "edges", "ufo")


def numbers_of(row: CheckRow) -> list[str]:
    """The question, the answer and the expected answer, a sentence each; nothing if the cause says
    it."""
    if row.name in WITHOUT_NUMBERS:
        return []
    return [row.asked, f"Got: {row.got}.", f"Expected: {row.expected}."]


WITHOUT_NUMBERS = ("implemented", "loads", "answers", SAME_AGAIN)


def task_title(task: str) -> str:
    """The name of a task at the beginning of a sentence."""
    return f"Task {TASKS[task]}" if task[0] in "12" else TASKS[task][0].upper() + TASKS[task][1:]


def check_file(
    path: Path, seed: int = 0, packages: Sequence[str] = (), within: Path | None = None
) -> FileCheck:
    """The check of one file, with its duration; a folder is refused.

    seed: of the numbers of its questions; packages: what it may import beside numpy; within: as of
    `read_solver`.
    """
    use_seed(seed)
    began, late = perf_counter(), clock_endings()
    check = check_of(path, packages, within)
    return replace(check, seconds=perf_counter() - began, waited=clock_endings() > late)


def check_of(path: Path, packages: Sequence[str], within: Path | None) -> FileCheck:
    """The check of one file, without its duration."""
    if path.is_dir():
        return FileCheck(path, [], f"{path}: {nothing_in(path)}")
    try:
        solver = replace(read_solver(path, within), packages=tuple(packages))
        if is_engine(solver) or holder_of(solver):
            raise NotASolver(f"{path}: {ENGINE}; {RUN_INSTEAD} {shlex.quote(str(path))}")
        rows, restitution = examine(solver)
        if lacking := next((row.cause for row in rows if lacks_gl_matrix(row.cause)), ""):
            raise NotASolver(
                f"{path}: cannot be judged without the gl-matrix that it calls: {lacking}"
            )
        return FileCheck(path, rows, restitution=restitution, solver=solver)
    except NotASolver as refusal:
        return FileCheck(path, [], str(refusal))


def nothing_in(folder: Path) -> str:
    """A sentence that a folder holds no solver, with its contents."""
    others = named(sorted(one.name for one in folder.rglob("*") if one.is_file()))
    return f"{NONE}, only {others}" if others else NONE


def named(names: Sequence[str]) -> str:
    """At most `NAMED` of the names, and the number of the others; "" if there are none."""
    more = f" and {len(names) - NAMED} more" * (len(names) > NAMED)
    return ", ".join(map(printable, names[:NAMED])) + more


DEFINED = re.compile(
    r"^([ \t]*)(?:(?:function|def)\s+(\w+)"
    r"|(?:const|let|var)\s+(\w+)\s*=\s*(?:function\b|\([^()]*\)\s*=>|\w+\s*=>))",
    re.MULTILINE,
)


class FunctionText(NamedTuple):
    """A function in a file: the line on which it begins, and its code after its name."""

    line: int
    code: str


def shared_functions(rows: Sequence[CheckRow], text: str) -> str:
    """A sentence with the functions of the file's own, and their lines, that all tasks with a
    fault call, and no right task; "" if there are none, or if the faults have causes of their own.

    Parts of task 2 are taken to share a mistake if the cause of the first of them is unknown;
    tasks 1 and 2 if both have a fault.
    """
    faults = [row for row in rows if row.verdict == "fault" and row.task[0] in "12"]
    unknown = any(row.cause == UNKNOWN for row in faults if row.task != "1")
    wrong = {row.task for row in faults}
    if len(wrong) < 2 or not (unknown or "1" in wrong):
        return ""
    functions = functions_in(text)
    called = {number: reached(functions, FUNCTIONS[task]) for number, task in TOP.items()}
    faulty = {task[0] for task in wrong}
    shared = set.intersection(*(called[number] for number in faulty))
    shared -= set().union(*(called[number] for number in {*TOP} - faulty))
    places = sorted((functions[name].line, name) for name in shared - {*FUNCTIONS.values()})
    if not places:
        return ""
    said = ", ".join(f"{name} (line {line})" for line, name in places)
    return f"One mistake may be behind these faults, in a function that they share: {said}."


TOP = {"1": "1", "2": "2a"}  # task -> its part of which `FUNCTIONS` has the function


def functions_in(text: str) -> dict[str, FunctionText]:
    """The functions that a file defines, by name. One ends where the next begins that is not
    indented more."""
    code = code_of(text)
    heads = [*DEFINED.finditer(code)]
    found: dict[str, FunctionText] = {}
    for k, head in enumerate(heads):
        after = (one.start() for one in heads[k + 1 :] if len(one[1]) <= len(head[1]))
        line = code.count("\n", 0, head.start()) + 1
        found[head[2] or head[3]] = FunctionText(line, code[head.end() : next(after, len(code))])
    return found


def reached(functions: Mapping[str, FunctionText], start: str) -> set[str]:
    """The functions that one calls, and those that these call."""
    found: set[str] = set()
    waiting = [start] if start in functions else []
    while waiting:
        code = functions[waiting.pop()].code
        new = {name for name in functions if re.search(rf"\b{name}\s*\(", code)} - found
        found |= new
        waiting += new
    return found
