"""Stores the results of a measurement, task by task, so that an interruption loses no finished
task."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from crosscheck2d.reports.run.cells import digest, source_hash
from crosscheck2d.reports.run.store import Store

SOURCE = (
    "reports/speed/**/*.py",
    "reports/compare/**/*.py",
    "reports/run/*.py",
    "scenarios/**/*.py",
)
TASK = "measurement"  # the kind of the rows


class Kept:
    """The results of tasks: those of an earlier measurement of the same plan, and new ones as they
    come.

    A task is a tuple of strings and whole numbers. A result is what JSON can hold.

    Attributes:
        first: when the first of the results that were used was measured.
    """

    def __init__(self, store: Store, plan: Mapping[str, Any]) -> None:
        """`plan`: all that decides the results: the request, versions and machine."""
        self.store, self.plan = store, json.dumps([plan, source_hash(SOURCE)], sort_keys=True)
        self.first = now()

    def key(self, task: tuple[Any, ...]) -> str:
        """The key of the row of a task."""
        return digest(f"{self.plan} {json.dumps(task)}".encode())

    def __contains__(self, task: tuple[Any, ...]) -> bool:
        """Whether the task has a result."""
        return self.store.get(TASK, self.key(task)) is not None

    def __getitem__(self, task: tuple[Any, ...]) -> Any:
        """The result of the task."""
        row = self.store.get(TASK, self.key(task))
        assert row is not None
        self.first = min(self.first, row.value["at"])
        return row.value["result"]

    def add(self, task: tuple[Any, ...], result: Any) -> None:
        """Store the result of a task."""
        self.store.put(TASK, self.key(task), {"at": now(), "result": result})


def now() -> str:
    """The date and time, in the form of `started` of a header, with which it is compared."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
