"""Prints checks in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from crosscheck2d.adapters.host.file import KINDS, printable
from crosscheck2d.reports.check.marks import Marked, TaskMark, number
from crosscheck2d.reports.check.outcomes import OUTCOMES
from crosscheck2d.reports.check.rows import TASKS, CheckRow
from crosscheck2d.reports.check.scene_words import faults_of, scene_lines, together
from crosscheck2d.reports.check.verdict import FileCheck, Tally, headline, named, numbers_of
from crosscheck2d.reports.terminal.console import Console, print_table, print_texts, width_of
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.foreign_text import legible

if TYPE_CHECKING:
    from crosscheck2d.reports.check.smallest_scene import Smallest

STYLE = {
    "right": "green",
    "fault": "bold red",
    "follows": "magenta",
    "free choice": "yellow",
    "not asked": "dim",
}
LEGEND = {
    "ok": "no fault",
    "FAULT": "begin here",
    "<-": "wrong because of a FAULT to the left of it",
    "-": "not asked, or only in part: the file has no such part, or a FAULT hides it",
    "total": "points; what is not judged is in none of them: a person decides",
}
WIDE = 1000  # columns of a table that is no terminal's: no name is cut
LEAST = 24  # columns of a name: student and file are told by its ends


def print_file(marked: Marked) -> None:
    """Print the sentences with lines and numbers, the verdict of every task, the consequences of
    the faults, what could not be asked, and the free choices, each under an explaining title."""
    console, one = Console(), marked.check
    if one.passed or one.refused:
        console.print(legible(one.sentences[0]), highlight=False)
    if one.refused:
        return
    for k, row in enumerate(one.findings, 1):
        print_fault(console, k, row, one.also(row))
    if one.shared:
        console.print(f"\n{one.shared}", highlight=False)
    console.print()
    print_tasks(console, marked)
    if more := one.causes[len(one.findings) :]:
        print_rows(console, "More faults:", more)
    if one.consequences:
        names: dict[str, list[str]] = {}
        for row in one.consequences:
            names.setdefault(TASKS[row.task], []).append(row.name)
        follow = "; ".join(f"{title} ({', '.join(rows)})" for title, rows in names.items())
        console.print(f"\nThese follow from the faults above: {follow}.", highlight=False)
    if unasked := [row for row in one.rows if row.verdict == "not asked"]:
        print_rows(console, "Not asked:", unasked)
    if one.choices:
        print_rows(
            console, "Free choices. The exercise leaves them open; none is a fault:", one.choices
        )


def print_fault(console: Console, number: int, row: CheckRow, also: Sequence[CheckRow]) -> None:
    """Print a numbered fault; below it the lines of the file, the formula of the exercise, and the
    numbers of each question that shows it."""
    numbered = Table.grid(padding=(0, 1, 0, 0))
    numbered.add_row(f"{number}.", legible(headline(row)))
    console.print(numbered)
    grid = Table.grid(padding=(0, 2, 0, 0))
    for line, text in row.lines:
        grid.add_row(Text(f"line {line}", "dim"), legible(text))
    if row.formula:
        grid.add_row(Text("exercise", "dim"), row.formula)
    for name, one in (("seen in", row), *(("also in", other) for other in also)):
        if numbers := numbers_of(one):
            grid.add_row(Text(name, "dim"), legible(" ".join(numbers)))
    if grid.rows:
        console.print(Padding(grid, (0, 0, 0, 3)), highlight=False)


def print_tasks(console: Console, marked: Marked) -> None:
    """Print the verdict of every task, its points, and the number of questions asked and of wrong
    answers; below, the sum of the points."""
    one, marks = marked.check, {mark.task: mark for mark in marked.tasks}
    rows: list[list[str | Text]] = []
    for task, title in TASKS.items():
        if one.of(task):
            verdict = Text(one.word(task), STYLE[one.tasks[task]])
            points = points_of(marks[task]) if task in marks else ""
            rows.append([title, verdict, points, *map(shown, one.tally(task))])
    headings = ["task", "verdict", "points", *Tally._fields]
    print_table(console, headings, rows, left=["verdict", "points"])
    console.print(f"\n{marked.total}", highlight=False)


def points_of(mark: TaskMark) -> str:
    """The points of a task, and the points possible; "" if it gives none."""
    return f"{number(mark.points)} of {number(mark.most)}" if mark.most else ""


def shown(count: int) -> str:
    """A count in a table; 0 is left empty, so that faults are easy to see."""
    return str(count or "")


def print_scene(scenes: Sequence[Smallest], page: Path) -> None:
    """Print the smallest scene of the first fault in words, and where its replay and the other
    scenes are."""
    console, one = Console(), scenes[0]
    title = f"\nThe smallest scene that shows {faults_of(one)}, played in {page.name}:"
    console.print(title, highlight=False)
    grid = Table.grid(padding=(0, 2, 0, 0))
    for k, line in enumerate(scene_lines(one.scenario)):
        grid.add_row(Text(f"sphere {k}", "dim"), line)
    if one.scenario.scene.n > 1:
        grid.add_row(Text("e", "dim"), f"{one.scenario.scene.restitution:g}")
    grid.add_row(Text("wrong", STYLE["fault"]), legible(one.fault))
    console.print(Padding(grid, (0, 0, 0, 3)), highlight=False)
    if len(one.of) > 1:
        console.print(f"   {together(one)}", highlight=False)
    if others := " and ".join(map(faults_of, scenes[1:])):
        console.print(f"{page.name} also has the smallest scene of {others}.", highlight=False)


def print_rows(console: Console, title: str, rows: Sequence[CheckRow]) -> None:
    """Print a title, and a paragraph for each row: verdict, task, text."""
    console.print(f"\n{title}", highlight=False)
    grid = Table.grid(padding=(0, 2, 0, 0))
    for row in rows:
        said = Text.assemble((row.name, "bold"), f": {legible(row.cause)}")
        grid.add_row(Text(row.verdict, STYLE[row.verdict]), row.task, said)
    console.print(Padding(grid, (0, 0, 0, 2)))


def elided(name: str, room: int) -> str:
    """A name that fits into `room` columns; a longer one loses its middle, because its ends name
    student and file."""
    if len(name) <= room:
        return name
    end = max(room // 2, 1)
    return f"{name[: max(room - end - 1, 1)]}…{name[-end:]}"


def print_class(marked: Sequence[Marked], wide: bool = False) -> None:
    """Print a row for each file with a verdict for every task, its points, and the numbers of
    questions; below, the meaning of the signs, the first sentence of each file, the copies, and
    other entries of the folder. wide: whether lines may be as long as the table needs."""
    console, checks = Console(), [one.check for one in marked]
    table = Console(width=WIDE) if wide else console
    headings = [*TASKS, "total", *Tally._fields, "not judged"]
    rows: list[list[str | Text]] = []
    for one in marked:
        words = [Text(OUTCOMES[word].short, STYLE[word]) for word in one.check.tasks.values()]
        waits = number(one.not_judged) if one.not_judged else ""
        numbers = [number(one.points), *map(shown, one.check.tally()), waits]
        rows.append([one.name, *words, *numbers])
    room = room_for_names(table.width, headings, rows)
    rows = [[elided(one.name, room), *row[1:]] for one, row in zip(marked, rows)]
    print_table(table, ["solver", *headings], rows, left=list(TASKS))
    console.print()
    print_texts(console, LEGEND)
    first = {
        one.name: one.check.brief.removeprefix(f"{one.check.path}: ")
        for one in marked
        if not one.check.passed
    }
    if first:
        console.print("\nTo begin with:")
    for name, sentence in first.items():
        begin = Text.assemble((legible(name), "bold"), ": ", legible(sentence))
        console.print(Padding(begin, (0, 0, 0, 2)), highlight=False)
    console.print()
    for names in same_code(marked[0].root, checks):
        said = f"The same code, but for spaces and lines of comments: {', '.join(names)}."
        console.print(legible(said), highlight=False)
    print_total(marked)


def room_for_names(
    width: int, headings: Sequence[str], rows: Sequence[Sequence[str | Text]]
) -> int:
    """Columns for the names beside the other columns; half of the width if these leave too few, so
    that the table becomes two, one below the other."""
    beside = width - sum(
        max(map(width_of, (heading, *(row[k] for row in rows)))) + 1
        for k, heading in enumerate(headings, 1)
    )
    return beside if beside >= LEAST else width // 2


def print_total(marked: Sequence[Marked]) -> None:
    """Print how many files have which result, and what is in the folder without a row."""
    console, not_read = Console(), marked[0].not_read
    console.print(total([one.check for one in marked]), highlight=False)
    if waits := sum(bool(one.not_judged) for one in marked):
        said = f"In {counted(waits, 'submission')} points are not judged: a person decides."
        console.print(said, highlight=False)
    if any(one.check.faults for one in marked):
        console.print("crosscheck check FILE shows the lines and the numbers of one.")
    if not_read:
        console.print(sentence_on(not_read), highlight=False)


def sentence_on(not_read: Sequence[str]) -> str:
    """A sentence on the entries of a class folder without a row, and one on the solvers that are
    not judged."""
    solvers = [name for name in not_read if Path(name).suffix.lower() in KINDS]
    others = [name for name in not_read if name not in solvers]
    said = [f"Not read, as no .js and no .py file: {named(others)}."] * bool(others)
    beside = f"Not judged, as an Exercise.js or solver.py is beside it: {named(solvers)}."
    return " ".join(said + [beside] * bool(solvers))


def total(checks: Sequence[FileCheck]) -> str:
    """A sentence with the number of submissions and of each result."""
    return f"{counted(len(checks), 'submission')}: {results(checks)}."


def results(checks: Sequence[FileCheck]) -> str:
    """How many are without a fault, with one, and not judged at all."""
    right, unjudged = sum(one.passed for one in checks), sum(one.unjudged for one in checks)
    parts = [f"{right} without a fault", f"{len(checks) - right - unjudged} with a fault"]
    return ", ".join(parts + [f"{unjudged} that could not be judged"] * bool(unjudged))


def same_code(folder: Path, checks: Sequence[FileCheck]) -> list[list[str]]:
    """Lists of the names of files with the same code."""
    names: dict[str, list[str]] = {}
    for one in checks:
        if one.solver is not None:
            comment = "#" if one.path.suffix.lower() == ".py" else "//"
            names.setdefault(code_only(one.solver.text, comment), []).append(
                printable(str(one.path.relative_to(folder)))
            )
    return [alike for alike in names.values() if len(alike) > 1]


def code_only(text: str, comment: str) -> str:
    """A text without spaces and without lines that are comments. A comment after code stays,
    because its sign may be inside a string."""
    lines = ("".join(line.split()) for line in text.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith(comment))
