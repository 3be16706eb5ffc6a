"""The console that all commands print to."""

from __future__ import annotations

from typing import Any

from rich.console import Console as RichConsole
from rich.text import Text

from crosscheck2d.reports.terminal.foreign_text import legible


class Console(RichConsole):
    """A console that prints every string `legible` and without markup or emoji; coloured text is a
    `Text`."""

    def __init__(self, *, stderr: bool = False, width: int | None = None) -> None:
        """Print on standard output, or on standard error; `width` in columns, default the
        terminal's."""
        super().__init__(stderr=stderr, width=width, markup=False, emoji=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """Called for all strings: printed ones, and those in tables, titles and headings."""
        return super().render_str(legible(text), **options | {"markup": False, "emoji": False})
