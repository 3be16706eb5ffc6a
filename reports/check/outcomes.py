"""The one table of what a verdict means in points, in the table of a class, in JUnit, and in
grading systems."""

from __future__ import annotations

from typing import Literal, NamedTuple

from crosscheck2d.reports.check.rows import Verdict

Status = Verdict | Literal["refused"]


class Outcome(NamedTuple):
    """The meaning of a status in other systems.

    Attributes:
        short: in the table of a class.
        points: the effect on the points of a question: "not judged" points are not given.
        junit: the element that a JUnit test case holds; "" for none.
        gradescope: the status of a test of Gradescope.
    """

    short: str
    points: Literal["given", "lost", "not judged"]
    junit: str
    gradescope: str


OUTCOMES: dict[Status, Outcome] = {
    "right": Outcome("ok", "given", "", "passed"),
    "free choice": Outcome("ok", "given", "", "passed"),
    # wrong because of a fault in another task, which costs its points there
    "follows": Outcome("<-", "given", "skipped", "passed"),
    "fault": Outcome("FAULT", "lost", "failure", "failed"),
    # nothing is known: a person may look
    "not asked": Outcome("-", "not judged", "skipped", "failed"),
    # no solver at all
    "refused": Outcome("-", "not judged", "error", "failed"),
}
