"""The table of formats: a row and a file each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from reports.check.formats.gradescope import gradescope_text
from reports.check.formats.junit import JUNIT, as_junit
from reports.check.formats.marks_csv import csv_text
from reports.check.formats.questions_json import json_text
from reports.check.formats.table import TITLE, table_text
from reports.check.marks import Marked


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
