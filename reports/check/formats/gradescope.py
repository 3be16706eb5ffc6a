"""results.json of Gradescope: a test for each task, whose scores it adds up."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import version

from reports.check.marks import Marked, TaskMark
from reports.check.outcomes import OUTCOMES


def gradescope_text(marked: Sequence[Marked]) -> str:
    """The results of one submission."""
    (one,) = marked
    results = {
        "extra_data": {"crosscheck": version("crosscheck2d"), "id": one.id},
        "score": one.points,
        "execution_time": round(one.check.seconds, 3),
        "output": one.summary,
        "output_format": "text",
        "visibility": "visible",
        "tests": [test(one, mark) for mark in one.tasks],
    }
    return json.dumps(results, indent=2, allow_nan=False) + "\n"


def test(one: Marked, mark: TaskMark) -> dict[str, object]:
    """A task."""
    return {
        "name": mark.title,
        "number": mark.task,
        "score": mark.points,
        "max_score": mark.most,
        "status": OUTCOMES[mark.status].gradescope,
        "output": "\n".join(one.feedback(mark.task)),
        "output_format": "text",
        "visibility": "visible",
        "tags": [mark.status],
    }
