"""JSON as check.schema.json says: every question of every file, and the points."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from reports.check.marks import Marked
from reports.check.rows import CheckRow

SCHEMA = Path(__file__).parent / "check.schema.json"


def json_text(marked: Sequence[Marked]) -> str:
    """The text of `as_json`."""
    return json.dumps(as_json(marked), indent=2, allow_nan=False) + "\n"


def as_json(marked: Sequence[Marked]) -> dict[str, Any]:
    """All files with all rows; the same shape for one file and for many."""
    return {
        "crosscheck": version("crosscheck2d"),
        "passed": all(one.check.passed for one in marked),
        "files": [file_as_json(one) for one in marked],
        "not_read": list(marked[0].not_read),
    }


def file_as_json(one: Marked) -> dict[str, Any]:
    """A file, its fields in reading order."""
    check = one.check
    return {
        "file": str(check.path),
        "id": one.id,
        "passed": check.passed,
        "refused": check.refused,
        "points": one.points,
        "max_points": one.most,
        "seconds": round(check.seconds, 3),
        "tasks": check.tasks,
        "marks": {
            mark.task: {
                "points": mark.points,
                "max_points": mark.most,
                "not_judged": mark.not_judged,
            }
            for mark in one.tasks
        },
        "sentences": check.sentences,
        "rows": [row_as_json(row) for row in check.rows],
    }


def row_as_json(row: CheckRow) -> dict[str, Any]:
    """A row, its fields in reading order."""
    return {
        "name": row.name,
        "task": row.task,
        "asked": row.asked,
        "got": row.got,
        "expected": row.expected,
        "verdict": row.verdict,
        "cause": row.cause,
        "formula": row.formula,
        "lines": [{"line": line, "text": text} for line, text in row.lines],
        "read": row.read,
    }
