"""The checks for people, in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from adapters.solver_file import printable
from reports.check.rows import TASKS
from reports.check.verdict import FileCheck

STYLE = {"right": "green", "fault": "bold red", "note": "yellow", "not asked": "dim"}
SHORT = {"right": "ok", "note": "ok", "fault": "FAULT", "not asked": "-"}


def print_file(one: FileCheck) -> None:
    """The sentences, the verdict of every task, then the faults and the free choices."""
    console = Console()
    for k, sentence in enumerate(one.sentences):
        console.print(escape(sentence if one.passed else f"{k + 1}. {sentence}"), highlight=False)
    console.print()
    table = Table("task", "verdict", "questions", "faults", box=None, padding=(0, 2, 0, 0))
    for task, title in TASKS.items():
        rows, word = one.of(task), one.tasks[task]
        if rows:
            asked = sum(row.verdict != "not asked" for row in rows)
            faults = sum(row.verdict == "fault" for row in rows)
            table.add_row(title, f"[{STYLE[word]}]{word}", str(asked), str(faults or ""))
    console.print(table)
    details = Table("task", "row", "came", "expected", "cause or choice", box=None, padding=(0, 2, 0, 0))
    shown = [row for row in one.rows if row.verdict in ("fault", "note")]
    for row in shown:
        colour = STYLE[row.verdict]
        details.add_row(row.task, f"[{colour}]{row.name}", escape(row.got), escape(row.expected), escape(row.cause))
    if shown:
        console.print()
        console.print(details)


def print_class(folder: Path, checks: Sequence[FileCheck]) -> None:
    """A row a file: a verdict for every task and the sentence to begin with; "-" and the reason if it is no solver."""
    console = Console()
    table = Table("solver", *TASKS, "first of all", box=None, padding=(0, 1, 0, 0))
    table.columns[0].no_wrap = True
    for one in checks:
        words = [f"[{STYLE[word]}]{SHORT[word]}" for word in one.tasks.values()]
        first = one.refused or next((f"{row.name}: {row.cause}" for row in one.faults), "")
        table.add_row(escape(printable(str(one.path.relative_to(folder)))), *words, escape(first))
    console.print(table)
    right, refused = sum(one.passed for one in checks), sum(bool(one.refused) for one in checks)
    rest = f"; {refused} not checked" if refused else ""
    console.print(f"\n{right} of {len(checks) - refused} files without a fault{rest}.", highlight=False)
