"""Stores the results of a measurement on disk, task by task, so that an interruption loses no
finished task."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from reports.run.folders import may_go_on
from reports.run.journal import Journal, plain
from reports.run.journal_lines import checked_lines, no_use
from reports.speed.lines import KINDS, misfit, numbered
from scenarios.model import Scenario


class Kept:
    """The results of tasks: those of an interrupted measurement of the same plan, and new ones
    as they come.

    A task is a tuple of strings and whole numbers. A result is what JSON can hold, and numbers
    that are not finite.
    """

    def __init__(
        self,
        journal: Journal,
        header: dict[str, Any],
        resume: bool,
        scenarios: Mapping[str, Scenario],
    ) -> None:
        """Go on, if `resume` and the journal is of a measurement with the very same `header`, of
        these `scenarios`.

        Raises:
            FolderTaken: as `may_go_on`.
            ValueError: naming a line of the journal that does not fit.
        """
        self.journal, folder = journal, journal.path.parent
        lines = []
        for number, kind, line in checked_lines(folder, KINDS):
            if kind != "header" and number == 1:
                raise ValueError(
                    no_use(folder, number, "the first line must be the header", KINDS.asked)
                )
            if kind == "header" and number > 1:
                raise ValueError(
                    no_use(folder, number, "only the first line may be the header", KINDS.missed)
                )
            lines.append(line)
        header_before, tasks = (lines[0]["header"], lines[1:]) if lines else (None, [])
        same = header_before == json.loads(json.dumps(plain(header)))
        may_go_on(folder, len(tasks), same, resume)
        self.results: dict[str, Any] = {}
        if not same:
            os.truncate(journal.path, 0)
            journal.append({"header": header})
            return
        for number, line in enumerate(tasks, start=2):
            if fault := misfit(line, scenarios):
                raise ValueError(no_use(folder, number, fault, KINDS.missed))
            self.results[json.dumps(line["task"])] = line["result"]

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
