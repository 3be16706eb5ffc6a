"""The formats in which a check is written: a function each, and the table of them."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from crosscheck2d.adapters.own_solver.file import printable
from crosscheck2d.reports.check.evidence import evidence
from crosscheck2d.reports.check.marks import Marked, number
from crosscheck2d.reports.check.outcomes import OUTCOMES
from crosscheck2d.reports.check.rows import TASKS
from crosscheck2d.reports.check.terminal import print_class, print_file
from crosscheck2d.reports.check.verdict import Tally
from crosscheck2d.reports.run.made import sealed

TITLE = "crosscheck check\n\n"


class TextFor(StringIO):
    """A text that is kept, for an output of this encoding."""

    def __init__(self, encoding: str) -> None:
        super().__init__()
        self.written_in = encoding

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """What `legible` asks for."""
        return self.written_in


def table_text(marked: Sequence[Marked]) -> str:
    """The table of a class, or the check of a file, under a title by which a file is known."""
    return TITLE + drawn(marked, "utf-8")


def show(marked: Sequence[Marked]) -> None:
    """Print it; a table in a pipe is as wide as its names need."""
    if sys.stdout.isatty():
        draw(marked)
    else:
        sys.stdout.write(drawn(marked, sys.stdout.encoding or "utf-8"))


def drawn(marked: Sequence[Marked], encoding: str) -> str:
    """It as text, without spaces at the end of lines."""
    text = TextFor(encoding)
    with redirect_stdout(text):
        draw(marked, wide=True)
    return "".join(f"{line.rstrip()}\n" for line in text.getvalue().split("\n")[:-1])


def draw(marked: Sequence[Marked], wide: bool = False) -> None:
    """Print it to whatever standard output is."""
    print_class(marked, wide) if marked[0].root.is_dir() else print_file(marked[0])


# what a spreadsheet takes for the beginning of a formula
FORMULA = ("=", "+", "-", "@")


def csv_text(marked: Sequence[Marked]) -> str:
    """A table for a spreadsheet, with a header, a row for each student."""
    tasks = [task for task in TASKS if any(task in one.worth for one in marked)]
    text = StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(
        ["id", *(f"task {task}" for task in tasks), "total", "of", *Tally._fields]
        + ["not judged", "begin with", "seconds", "file"]
    )
    for one in marked:
        points = {mark.task: number(mark.points) for mark in one.tasks}
        table.writerow(
            [cell(one.id), *(points.get(task, "0") for task in tasks)]
            + [number(one.points), number(one.most), *one.check.tally()]
            + [number(one.not_judged), cell(one.brief)]
            + [f"{one.check.seconds:.2f}", cell(str(one.check.path))]
        )
    return text.getvalue()


def cell(text: str) -> str:
    """A student's text that no spreadsheet takes for a formula, on one line."""
    return printable(f"'{text}" if text.startswith(FORMULA) else text)


def gradescope_text(marked: Sequence[Marked]) -> str:
    """results.json of Gradescope: a test for each task, whose scores it adds up."""
    (one,) = marked
    results = {
        "extra_data": {"crosscheck": version("crosscheck2d"), "id": one.id},
        "score": one.points,
        "execution_time": round(one.check.seconds, 3),
        "output": one.summary,
        "output_format": "text",
        "visibility": "visible",
        "tests": [
            {
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
            for mark in one.tasks
        ],
    }
    return json.dumps(results, indent=2, allow_nan=False) + "\n"


# what an earlier file of ours begins with, and nothing else does
JUNIT = b'<testsuites name="crosscheck check"'


def as_junit(marked: Sequence[Marked]) -> str:
    """A test suite for each file, a test case for each row; a fault is a failure, what was not
    asked or follows from a fault is skipped. The class of the cases is the student's id."""
    suites = ElementTree.Element("testsuites", name="crosscheck check")
    for student in marked:
        one = student.check
        skipped = sum(OUTCOMES[row.verdict].junit == "skipped" for row in one.rows)
        suite = ElementTree.SubElement(
            suites,
            "testsuite",
            name=plain(str(one.path)),
            tests=str(len(one.rows) or 1),
            failures=str(len(one.faults)),
            errors=str(int(bool(one.refused))),
            skipped=str(skipped),
        )
        if one.refused:
            case = ElementTree.SubElement(
                suite, "testcase", classname=plain(student.id), name="file: is a solver"
            )
            ElementTree.SubElement(case, OUTCOMES["refused"].junit, message=plain(one.refused))
        for row in one.rows:
            case = ElementTree.SubElement(
                suite,
                "testcase",
                classname=plain(student.id),
                name=plain(f"{row.task}: {row.name}"),
            )
            if OUTCOMES[row.verdict].junit == "failure":
                failure = ElementTree.SubElement(case, "failure", message=plain(row.cause))
                failure.text = plain("\n".join([row.asked, *evidence(row)]))
            elif OUTCOMES[row.verdict].junit == "skipped":
                ElementTree.SubElement(case, "skipped", message=plain(row.cause))
        ElementTree.SubElement(suite, "system-out").text = plain(student.total)
    ElementTree.indent(suites)
    return sealed(ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n")


def plain(text: str) -> str:
    """Text without the characters that XML 1.0 has no way to write."""
    return "".join(
        c if c in "\t\n\r" or " " <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" else "\ufffd"
        for c in text
    )


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
        "rows": [
            {
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
            for row in check.rows
        ],
    }


class Format(NamedTuple):
    """A format that is written.

    Attributes:
        text: of the marks.
        mark: what is near the beginning of a file of it, and of no other: such a file may be
            written over.
        single: whether it holds the marks of one student.
        sealed: whether a file that was changed since is known by its end, and kept.
    """

    text: Callable[[Sequence[Marked]], str]
    mark: bytes
    single: bool = False
    sealed: bool = False


FORMATS = {
    "table": Format(table_text, TITLE.encode()),
    "json": Format(json_text, b'{\n  "crosscheck": '),
    "junit": Format(as_junit, JUNIT, sealed=True),
    "gradescope": Format(gradescope_text, b'{\n  "extra_data": {\n    "crosscheck"', single=True),
    "csv": Format(csv_text, b"id,task "),
}
