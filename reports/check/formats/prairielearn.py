"""results.json of PrairieLearn's external grading: a test for each task, the score as a share of 1,
and a picture of the smallest scene that shows each fault."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from reports.check.marks import Marked
from reports.check.picture import data_url, label

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
        if one.scenes:
            results["images"] = [{"label": label(it), "url": data_url(it)} for it in one.scenes]
    text = as_text(results)
    while len(text.encode(errors="backslashreplace")) > LARGEST and results.get("images"):
        results["images"].pop()
        text = as_text(results)
    return text


def as_text(results: dict[str, Any]) -> str:
    """The results as JSON."""
    return json.dumps(results, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
