"""Stores the results of a measurement on disk, task by task, so that an interruption loses no
finished task."""

from __future__ import annotations

import json
import os
from typing import Any

from crosscheck2d.reports.run.folders import may_go_on
from crosscheck2d.reports.run.journal import Journal, lines_of, plain

LINES = {"header": (), "task": ("result",)}
"""The kinds of lines of the journal -> what they hold: the measurement that was asked for; a task,
and what it gave: rows as `ladder.errors_of`, `budget.budget_of`, `measure.sample_row`,
`cheapest.closed_form` and `measure.size_rows` return them."""
TEXT = {
    *("scenario", "engine", "profile", "kind", "change", "status", "reason"),
    *("contribution", "note", "truth", "stopped"),
}
"""The columns of results that hold text, which may be "nan"."""


class Kept:
    """The results of tasks: those of an interrupted measurement of the same plan, and new ones
    as they come.

    A task is a tuple of strings and whole numbers. A result is what JSON can hold, and numbers
    that are not finite.
    """

    def __init__(self, journal: Journal, header: dict[str, Any], resume: bool) -> None:
        """Go on, if `resume` and the journal is of a measurement with the very same `header`.

        Raises:
            FolderTaken: as `may_go_on`.
            ValueError: as `lines_of`.
        """
        self.journal, folder = journal, journal.path.parent
        lines = [line for _, _, line in lines_of(folder, LINES)]
        headers = [line["header"] for line in lines if "header" in line]
        tasks = [line for line in lines if "task" in line]
        # two, if somebody has joined two journals
        same = headers == [json.loads(json.dumps(plain(header)))]
        may_go_on(folder, len(tasks), same, resume)
        self.results = {json.dumps(line["task"]): line["result"] for line in tasks if same}
        if not same:
            os.truncate(journal.path, 0)
            journal.append({"header": header})

    def __len__(self) -> int:
        """The number of tasks that the interrupted measurement finished."""
        return len(self.results)

    def __contains__(self, task: tuple[Any, ...]) -> bool:
        """Whether the interrupted measurement finished this task."""
        return json.dumps(task) in self.results

    def __getitem__(self, task: tuple[Any, ...]) -> Any:
        """The result of the task."""
        return numbered(self.results[json.dumps(task)])

    def add(self, task: tuple[Any, ...], result: Any) -> None:
        """Store the result of a task."""
        self.journal.append({"task": task, "result": result})


def numbered(value: Any) -> Any:
    """The inverse of `plain`: "nan", "inf" and "-inf" become numbers again, except in columns of
    text."""
    if isinstance(value, dict):
        return {key: item if key in TEXT else numbered(item) for key, item in value.items()}
    if isinstance(value, list):
        return [numbered(item) for item in value]
    return float(value) if value in ("nan", "inf", "-inf") else value
