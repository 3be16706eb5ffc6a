"""results.json of PrairieLearn's external grading: a test a task, and the score as a share of 1."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from reports.check.marks import Marked

LARGEST = 1_000_000  # bytes that PrairieLearn reads
LONGEST = 20_000  # characters of what is said of a task: eight tasks of four bytes a letter fit


def prairielearn_text(marked: Sequence[Marked]) -> str:
    """The results of one submission; one that cannot be loaded costs no attempt."""
    (one,) = marked
    results: dict[str, Any] = {"crosscheck": version("crosscheck2d")}
    if one.check.refused or not one.check.loaded:
        results |= {"gradable": False, "format_errors": [one.brief]}
    else:
        results |= {
            "gradable": True,
            "score": one.points / one.most,
            "message": one.summary,
            "tests": [
                {
                    "name": mark.title,
                    "description": f"Verdict: {mark.status}.",
                    "points": mark.points,
                    "max_points": mark.most,
                    "message": "\n".join(one.feedback(mark.task))[:LONGEST],
                }
                for mark in one.tasks
            ],
        }
    return json.dumps(results, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
