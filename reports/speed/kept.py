"""What a measurement has got so far, on disk task by task, so that an interrupt loses nothing that has ended."""

from __future__ import annotations

import json
import os
from typing import Any

from reports.run.folders import may_go_on
from reports.run.journal import Journal, lines_of, numbers, plain


class Kept:
    """The results of tasks: those of an interrupted measurement of the same, and those of this one as they come.

    A task is a tuple of strings and whole numbers, a result what JSON can hold, numbers that are not finite included.
    """

    def __init__(self, journal: Journal, header: dict[str, Any], resume: bool) -> None:
        """Go on, if `resume` and the journal is of a measurement with the very same `header`.

        Raises:
            FolderTaken: as `may_go_on`.
            ValueError: the journal is none of a measurement.
        """
        self.journal = journal
        lines = list(lines_of(journal.path.parent))
        for number, line in enumerate(lines, start=1):
            if not isinstance(line, dict) or not line.keys() >= ({"task", "result"} if number > 1 else {"header"}):
                raise ValueError(f"{journal.path}: line {number} is no line of a measurement")
        same = bool(lines) and lines[0].get("header") == json.loads(json.dumps(plain(header)))
        may_go_on(journal.path.parent, len(lines[1:]), same, resume)
        self.results = {json.dumps(line["task"]): line["result"] for line in lines[1:]} if same else {}
        if not same:
            os.truncate(journal.path, 0)
            journal.append({"header": header})

    def __len__(self) -> int:
        """How many had ended before."""
        return len(self.results)

    def __contains__(self, task: tuple) -> bool:
        """Whether it had ended."""
        return json.dumps(task) in self.results

    def __getitem__(self, task: tuple) -> Any:
        """What it gave."""
        return numbers(self.results[json.dumps(task)])

    def add(self, task: tuple, result: Any) -> None:
        """Keep what a task gave."""
        self.journal.append({"task": task, "result": result})
