"""The checks for people, in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from adapters.own_solver.file import printable
from reports.check.rows import FOLLOWS, TASKS, CheckRow
from reports.check.scene_words import scene_lines
from reports.check.verdict import FileCheck, named
from reports.terminal.console import Console
from reports.terminal.counts import counted
from reports.terminal.foreign_text import legible
from reports.terminal.tables import print_table

if TYPE_CHECKING:
    from reports.check.smallest import Smallest

STYLE = {"right": "green", "fault": "bold red", "free choice": "yellow", "not asked": "dim"}
SHORT = {"right": "ok", "free choice": "ok", "fault": "FAULT", "not asked": "-"}


def print_file(one: FileCheck) -> None:
    """The sentences with the lines they are about, the verdict of every task, all faults, and the
    free choices under a title that says what they are."""
    console = Console()
    if one.passed:
        console.print(one.sentences[0], highlight=False)
    for k, (sentence, row) in enumerate(zip(one.sentences, one.findings), 1):
        console.print(f"{k}. {sentence}", highlight=False)
        print_source(console, row)
    console.print()
    table = Table("task", "verdict", "asked", "faults", box=None, padding=(0, 2, 0, 0))
    for task, title in TASKS.items():
        rows, word = one.of(task), one.tasks[task]
        if rows:
            asked = sum(row.verdict != "not asked" for row in rows)
            faults = sum(row.verdict == "fault" for row in rows)
            table.add_row(title, Text(word, STYLE[word]), str(asked), str(faults or ""))
    console.print(table)
    if one.faults:
        print_rows(console, "All faults:", [row for row in one.faults if row.cause != FOLLOWS])
        follow = [row.name for row in one.faults if row.cause == FOLLOWS]
        if follow:
            console.print(f"  These follow from the faults above: {', '.join(follow)}.")
    if one.choices:
        print_rows(
            console, "Free choices. The exercise leaves them open; none is a fault:", one.choices
        )


def print_source(console: Console, row: CheckRow) -> None:
    """The lines of the file that a fault is about, and the formula of the exercise."""
    given = [(f"line {line}", text) for line, text in row.lines]
    given += [("exercise", row.formula)] * bool(row.formula)
    grid = Table.grid(padding=(0, 2, 0, 0))
    for name, text in given:
        grid.add_row(Text(name, "dim"), text)
    if given:
        console.print(Padding(grid, (0, 0, 0, 3)))


def print_scene(one: Smallest, page: Path) -> None:
    """The smallest scene of the first fault in words, and where the replay is."""
    console = Console()
    which = " and ".join(map(str, one.of))
    title = f"\nThe smallest scene that shows fault {which}, played in {page.name}:"
    console.print(title, highlight=False)
    grid = Table.grid(padding=(0, 2, 0, 0))
    for k, line in enumerate(scene_lines(one.scenario)):
        grid.add_row(Text(f"sphere {k}", "dim"), line)
    grid.add_row(Text("wrong", STYLE["fault"]), legible(one.fault))
    console.print(Padding(grid, (0, 0, 0, 3)), highlight=False)


def print_rows(console: Console, title: str, rows: Sequence[CheckRow]) -> None:
    """A title, and a row a paragraph: its verdict in a word, where it belongs, what is said."""
    console.print(f"\n{title}", highlight=False)
    grid = Table.grid(padding=(0, 2, 0, 0))
    for row in rows:
        numbers = f" (came: {row.got}; expected: {row.expected})" if row.verdict == "fault" else ""
        said = Text.assemble((row.name, "bold"), f": {legible(row.cause + numbers)}")
        grid.add_row(Text(row.verdict, STYLE[row.verdict]), row.task, said)
    console.print(Padding(grid, (0, 0, 0, 2)))


def name_in(folder: Path, one: FileCheck) -> str:
    """A file as its class knows it."""
    return printable(str(one.path.relative_to(folder)))


def elided(name: str, room: int) -> str:
    """A name that fits, without its middle if it is too long: who it is and which file stand at its
    ends."""
    if len(name) <= room:
        return name
    end = max(room // 2, 1)
    return f"{name[: max(room - end - 1, 1)]}…{name[-end:]}"


def print_class(folder: Path, checks: Sequence[FileCheck], others: Sequence[str]) -> None:
    """A row a file, a verdict for every task or "-" if it is no solver; below, of each the sentence
    to begin with. `others`: the files that lie beside them and are no solvers."""
    console = Console()
    widest = {
        task: max(len(task), *(len(SHORT[one.tasks[task]]) for one in checks)) for task in TASKS
    }
    # beside all tasks, or on a narrow terminal beside some of them
    room = max(console.width // 2, console.width - sum(width + 1 for width in widest.values()))
    rows: list[list[str | Text]] = []
    for one in checks:
        words = [Text(SHORT[word], STYLE[word]) for word in one.tasks.values()]
        rows.append([elided(name_in(folder, one), room), *words])
    print_table(console, ["solver", *TASKS], rows, left=list(TASKS))
    first = {
        name_in(folder, one): one.sentences[0].removeprefix(f"{one.path}: ")
        for one in checks
        if not one.passed
    }
    if first:
        console.print("\nTo begin with:")
    for name, sentence in first.items():
        begin = Text.assemble((name, "bold"), ": ", legible(sentence))
        console.print(Padding(begin, (0, 0, 0, 2)), highlight=False)
    right, refused = sum(one.passed for one in checks), sum(bool(one.refused) for one in checks)
    rest = f"; {refused} not checked" if refused else ""
    files = counted(len(checks) - refused, "file")
    console.print(f"\n{right} of {files} without a fault{rest}.", highlight=False)
    if others:
        console.print(f"No .js and no .py file, so not read: {named(others)}.", highlight=False)
