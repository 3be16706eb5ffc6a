"""What is printed for people, as text without colours."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO

from reports.check.marks import Marked
from reports.check.terminal import print_class, print_file

TITLE = "crosscheck check\n\n"


def table_text(marked: Sequence[Marked]) -> str:
    """The table of a class, or the check of a file, under a title by which a file is known."""
    text = StringIO()
    with redirect_stdout(text):
        show(marked)
    return TITLE + text.getvalue()


def show(marked: Sequence[Marked]) -> None:
    """Print it."""
    root, checks = marked[0].root, [one.check for one in marked]
    print_class(root, checks, marked[0].not_read) if root.is_dir() else print_file(checks[0])
