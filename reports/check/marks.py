"""The marks of a check: points for each task, and the id of the student."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from crosscheck2d.adapters.own_solver.file import printable
from crosscheck2d.reports.check.evidence import lines_and_formula
from crosscheck2d.reports.check.outcomes import OUTCOMES, Status
from crosscheck2d.reports.check.points import Points
from crosscheck2d.reports.check.rows import TASKS, UNKNOWN, CheckRow, Verdict
from crosscheck2d.reports.check.verdict import (
    WITHOUT_NUMBERS,
    FileCheck,
    headline,
    numbers_of,
    task_title,
)

if TYPE_CHECKING:
    from crosscheck2d.reports.check.smallest_scene import Smallest

# File names that do not identify the student; then the folder name does.
ANYBODYS = ("exercise", "solver")


# verdict -> what a student reads of a question, from its name and its cause, in this order
FEEDBACK: dict[Verdict, str] = {
    "follows": "{}: {}; it costs nothing",
    "free choice": "{}: free choice: {}",
    "not asked": "{}: not asked: {}",
}


class TaskMark(NamedTuple):
    """The points of one task.

    Attributes:
        task: its key in `TASKS`.
        status: the worst verdict of its questions.
        points, most: points given and points possible.
        not_judged: points of questions that could not be asked; not included in `points`.
    """

    task: str
    status: Status
    points: float
    most: float
    not_judged: float

    @property
    def title(self) -> str:
        """The name of the task."""
        return task_title(self.task)


@dataclass(frozen=True)
class Marked:
    """A check with the student's id and points.

    Attributes:
        root: the file or folder given.
        worth: points of each question.
        low: whether feedback omits causes, lines and formulas.
        not_read: what lies in `root` without a row.
        scenes: the smallest that show its faults, if a format has them.
        beside: other solvers in the student's folder, which are not judged.
        label: what tables call it, the id that a pattern took out of the path; "" for its place in
            `root`.
    """

    id: str
    check: FileCheck
    root: Path
    worth: Points
    low: bool = False
    not_read: Sequence[str] = ()
    scenes: Sequence[Smallest] = ()
    beside: Sequence[str] = ()
    label: str = ""

    @property
    def name(self) -> str:
        """What tables of a class call it."""
        return self.label or printable(place_of(self.check.path, self.root))

    @cached_property
    def tasks(self) -> list[TaskMark]:
        """The marks of the tasks that give points or have a fault."""
        found = self.check.tasks
        return [
            mark_of(self.check, task, self.worth.get(task, {}))
            for task in TASKS
            if self.worth.get(task) or found[task] == "fault"
        ]

    @property
    def points(self) -> float:
        """The sum of the tasks."""
        return rounded(sum(mark.points for mark in self.tasks))

    @property
    def most(self) -> float:
        """The points of a right solver."""
        return rounded(sum(mark.most for mark in self.tasks))

    @property
    def not_judged(self) -> float:
        """The points of all questions that could not be asked."""
        return rounded(sum(mark.not_judged for mark in self.tasks))

    @property
    def total(self) -> str:
        """A sentence with all points, and one with those that are not judged."""
        said = f"{number(self.points)} of {number(self.most)} points."
        return f"{said} {waiting(self.not_judged)}" if self.not_judged else said

    @property
    def status(self) -> Status:
        """The status of the whole file."""
        if self.check.refused:
            return "refused"
        return "right" if self.check.passed else "fault"

    @property
    def brief(self) -> str:
        """The first sentence, without the file's path; "" for a file without a fault."""
        if self.check.passed:
            return ""
        return self.check.brief.removeprefix(f"{self.check.path}: ")

    @property
    def summary(self) -> str:
        """The text for a student above the tasks."""
        if self.check.refused:
            return self.brief
        begin = self.check.sentences[0] if self.check.passed else "There are faults; see the tasks."
        said = [begin, self.total]
        said += [f"{title} gives no points." for title in self.without_points]
        if self.check.shared and not self.low:
            said.append(self.check.shared)
        if self.beside:
            judged = f"{self.check.path.name} is judged; not judged: {', '.join(self.beside)}."
            said.append(judged)
        return " ".join(said)

    @property
    def without_points(self) -> list[str]:
        """The tasks that have a fault and give no points."""
        return [mark.title for mark in self.tasks if mark.status == "fault" and not mark.most]

    def feedback(self, task: str) -> list[str]:
        """The lines for a student about a task: faults with their numbers, consequences, free
        choices, questions that could not be asked."""
        if self.check.refused:
            return [self.brief]
        rows = self.check.of(task)
        points = next((mark.not_judged for mark in self.tasks if mark.task == task), 0.0)
        lines = [line for row in self.check.causes if row.task == task for line in self.of(row)]
        for verdict, said in FEEDBACK.items():
            lines += [said.format(row.name, row.cause) for row in rows if row.verdict == verdict]
        if not rows:
            lines += ["not asked: the file could not be used", *self.of(self.check.faults[0])]
        return lines + [waiting(points)] * bool(points)

    def of(self, row: CheckRow) -> list[str]:
        """A fault for the student: question and numbers; unless `low` also the likely cause, the
        lines of the file and the exercise's formula."""
        if self.low:
            said = headline(row) if row.name in WITHOUT_NUMBERS else f"{row.name}: wrong answer."
            return [" ".join([said, *numbers_of(row)])]
        return [" ".join([headline(row), *numbers_of(row)]), *lines_and_formula(row)]


def mark_of(check: FileCheck, task: str, worth: Mapping[str, float]) -> TaskMark:
    """The mark of a task with the points `worth` of each question.

    A question that could not be asked gives no points. A cause costs the points of one question: of
    the wrong answers it explains, the one with most points; if these have no points, the question
    of the task with fewest. A task that is not implemented, or fails, gives no points. Consequences
    of a fault cost nothing.
    """
    most, rows = sum(worth.values()), check.of(task)
    cheapest = min(filter(None, worth.values()), default=0.0)
    costs: dict[str, float] = {}
    for row in rows:
        if OUTCOMES[row.verdict].points == "lost":
            cost = most if row.name == "implemented" else worth.get(row.name) or cheapest
            mistake = row.name if row.cause == UNKNOWN else row.cause
            costs[mistake] = max(cost, costs.get(mistake, 0.0))
    lost = min(most, sum(costs.values()))
    unasked = sum(points for name, points in worth.items() if not asked(name, rows))
    not_judged = min(unasked, most - lost)
    status: Status = "refused" if check.refused else check.tasks[task]
    return TaskMark(
        task, status, rounded(most - lost - not_judged), rounded(most), rounded(not_judged)
    )


def asked(name: str, rows: Sequence[CheckRow]) -> bool:
    """Whether a question was asked, according to the rows of its task. One without a row counts as
    asked if all rows of the task were asked."""
    verdicts = {row.name: row.verdict for row in rows}
    if name in verdicts:
        return OUTCOMES[verdicts[name]].points != "not judged"
    return bool(rows) and "not asked" not in verdicts.values()


def id_of(file: Path, root: Path, pattern: re.Pattern[str] | None = None) -> str:
    """The id of the student whose file or folder `file` is at or below `root`.

    It is what `pattern` has `matched` in the path. Without a match it is the name of
    the student's folder, or of the file; for an Exercise.js or solver.py without a student's
    folder, the name of its folder.
    """
    if found := matched(file, root, pattern):
        return found
    within = Path(place_of(file, root))
    if len(within.parts) > 1:
        return within.parts[0]
    if file.stem.lower() in ANYBODYS and not file.is_dir():
        return file.resolve().parent.name or file.stem
    return within.name if file.is_dir() else within.stem


def matched(file: Path, root: Path, pattern: re.Pattern[str] | None) -> str:
    """The match of a pattern in the path of a file, or its first group; "" if there is none."""
    match = pattern.search(place_of(file, root)) if pattern is not None else None
    if match is None:
        return ""
    return match[1] if match.re.groups and match[1] is not None else match[0]


def place_of(file: Path, root: Path) -> str:
    """The path of a file relative to the folder given; for a file given directly, its folder and
    name."""
    return "/".join(file.relative_to(root).parts) if file != root else file.resolve().name


def rounded(points: float) -> float:
    """Points without the last bits of their sum."""
    return round(points, 6)


def waiting(points: float) -> str:
    """The sentence on points that are neither given nor lost."""
    noun = "point" if points == 1 else "points"
    return f"{number(points)} {noun} could not be judged: a person decides."


def number(points: float) -> str:
    """Points for people."""
    return f"{points:.2f}".rstrip("0").rstrip(".")
