"""A table of marks for a spreadsheet: a row for each student."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO

from adapters.own_solver.file import printable
from reports.check.marks import Marked, number
from reports.check.rows import TASKS
from reports.check.verdict import Tally

# what a spreadsheet takes for the beginning of a formula
FORMULA = ("=", "+", "-", "@")


def csv_text(marked: Sequence[Marked]) -> str:
    """The table, with a header; comma, and double quotes where they are needed."""
    tasks = [task for task in TASKS if any(task in one.worth for one in marked)]
    text = StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(
        ["id", *(f"task {task}" for task in tasks), "total", "of", *Tally._fields]
        + ["not judged", "begin with", "seconds", "file"]
    )
    for one in marked:
        points = {mark.task: number(mark.points) for mark in one.tasks}
        table.writerow(
            [cell(one.id), *(points.get(task, "0") for task in tasks)]
            + [number(one.points), number(one.most), *one.check.tally()]
            + [number(one.not_judged), cell(one.brief)]
            + [f"{one.check.seconds:.2f}", cell(str(one.check.path))]
        )
    return text.getvalue()


def cell(text: str) -> str:
    """A student's text that no spreadsheet takes for a formula, on one line."""
    return printable(f"'{text}" if text.startswith(FORMULA) else text)
