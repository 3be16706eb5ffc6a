"""What is printed for people, as text without colours."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO

from reports.check.marks import Marked
from reports.check.terminal import print_class, print_file

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
