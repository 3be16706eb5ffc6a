"""Prints checks in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from adapters.own_solver.file import printable
from reports.check.outcomes import OUTCOMES
from reports.check.rows import TASKS, CheckRow
from reports.check.scene_words import faults_of, scene_lines, together
from reports.check.verdict import FileCheck, Tally, headline, named, numbers_of
from reports.terminal.console import Console
from reports.terminal.counts import counted
from reports.terminal.foreign_text import legible
from reports.terminal.tables import print_table

if TYPE_CHECKING:
    from reports.check.smallest_scene import Smallest

STYLE = {
    "right": "green",
    "fault": "bold red",
    "follows": "magenta",
    "free choice": "yellow",
    "not asked": "dim",
}
LEGEND = (
    "ok: no fault. FAULT: begin here. <-: wrong because of a FAULT to the left of it. -: not"
    " asked, or only in part: the file has no such part, or a FAULT hides it."
)
LEAST = 24  # columns of a name: student and file are told by its ends


def print_file(one: FileCheck) -> None:
    """Print the sentences with lines and numbers, the verdict of every task, the consequences of
    the faults, what could not be asked, and the free choices, each under an explaining title."""
    console = Console()
    if one.passed or one.refused:
        console.print(legible(one.sentences[0]), highlight=False)
    if one.refused:
        return
    for k, row in enumerate(one.findings, 1):
        print_fault(console, k, row, one.also(row))
    console.print()
    print_tasks(console, one)
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


def print_tasks(console: Console, one: FileCheck) -> None:
    """Print the verdict of every task, the number of questions asked and of wrong answers."""
    table = Table("task", "verdict", *Tally._fields, box=None, padding=(0, 2, 0, 0))
    for task, title in TASKS.items():
        if one.of(task):
            verdict = Text(one.word(task), STYLE[one.tasks[task]])
            table.add_row(title, verdict, *map(shown, one.tally(task)))
    console.print(table)


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


def name_in(folder: Path, one: FileCheck) -> str:
    """The name of a file within its class."""
    return printable(str(one.path.relative_to(folder)))


def elided(name: str, room: int) -> str:
    """A name that fits into `room` columns; a longer one loses its middle, because its ends name
    student and file."""
    if len(name) <= room:
        return name
    end = max(room // 2, 1)
    return f"{name[: max(room - end - 1, 1)]}…{name[-end:]}"


def print_class(folder: Path, checks: Sequence[FileCheck], not_read: Sequence[str] = ()) -> None:
    """Print a row for each file with a verdict for every task and the numbers of questions; below,
    the meaning of the signs, the first sentence of each file, the copies, and other entries of the
    folder."""
    console = Console()
    widest = {
        task: max(len(task), *(len(OUTCOMES[one.tasks[task]].short) for one in checks))
        for task in TASKS
    }
    columns = [*widest.values(), *map(len, Tally._fields)]
    beside = console.width - sum(width + 1 for width in columns)
    room = (
        beside if beside >= LEAST else console.width // 2
    )  # then in two tables, one below the other
    rows: list[list[str | Text]] = []
    for one in checks:
        words = [Text(OUTCOMES[word].short, STYLE[word]) for word in one.tasks.values()]
        rows.append([elided(name_in(folder, one), room), *words, *map(shown, one.tally())])
    print_table(console, ["solver", *TASKS, *Tally._fields], rows, left=list(TASKS))
    console.print(f"\n{LEGEND}", highlight=False)
    first = {
        name_in(folder, one): one.brief.removeprefix(f"{one.path}: ")
        for one in checks
        if not one.passed
    }
    if first:
        console.print("\nTo begin with:")
    for name, sentence in first.items():
        begin = Text.assemble((legible(name), "bold"), ": ", legible(sentence))
        console.print(Padding(begin, (0, 0, 0, 2)), highlight=False)
    console.print()
    for names in same_code(folder, checks):
        said = f"The same code, but for spaces and lines of comments: {', '.join(names)}."
        console.print(legible(said), highlight=False)
    print_total(checks, not_read)


def print_total(checks: Sequence[FileCheck], not_read: Sequence[str] = ()) -> None:
    """Print how many files have which result, and what is in the folder without a row."""
    console = Console()
    console.print(total(checks), highlight=False)
    if any(one.faults for one in checks):
        console.print("crosscheck check FILE shows the lines and the numbers of one.")
    if not_read:
        console.print(sentence_on(not_read), highlight=False)


def sentence_on(not_read: Sequence[str]) -> str:
    """A sentence on the entries of a class folder without a row."""
    return f"Not read, as no .js and no .py file: {named(not_read)}."


def total(checks: Sequence[FileCheck]) -> str:
    """A sentence with the number of files and of each result."""
    right, refused = sum(one.passed for one in checks), sum(bool(one.refused) for one in checks)
    parts = [f"{right} without a fault", f"{len(checks) - right - refused} with a fault"]
    parts += [f"{refused} that could not be checked"] * bool(refused)
    return f"{counted(len(checks), 'solver')}: {', '.join(parts)}."


def same_code(folder: Path, checks: Sequence[FileCheck]) -> list[list[str]]:
    """Lists of the names of files with the same code."""
    names: dict[str, list[str]] = {}
    for one in checks:
        if one.solver is not None:
            comment = "#" if one.path.suffix.lower() == ".py" else "//"
            names.setdefault(code_only(one.solver.text, comment), []).append(name_in(folder, one))
    return [alike for alike in names.values() if len(alike) > 1]


def code_only(text: str, comment: str) -> str:
    """A text without spaces and without lines that are comments. A comment after code stays,
    because its sign may be inside a string."""
    lines = ("".join(line.split()) for line in text.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith(comment))
