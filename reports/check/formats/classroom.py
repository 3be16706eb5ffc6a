"""What the grading reporter of GitHub Classroom reads, once it is encoded as base64."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import version

from reports.check.marks import Marked
from reports.check.outcomes import OUTCOMES


def classroom_text(marked: Sequence[Marked]) -> str:
    """The results of one submission. The reporter adds up the scores of the tests."""
    (one,) = marked
    results = {
        "crosscheck": version("crosscheck2d"),
        "status": OUTCOMES[one.status].classroom,
        "max_score": one.most,
        "tests": [
            {
                "name": mark.title,
                "status": OUTCOMES[mark.status].classroom,
                "score": mark.points,
                "message": "\n".join(one.feedback(mark.task)),
            }
            for mark in one.tasks
        ],
    }
    return json.dumps(results, indent=2, allow_nan=False) + "\n"
