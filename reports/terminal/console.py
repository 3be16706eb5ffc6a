"""The console that all commands print to, and tables that fit: no line is wider than the terminal,
and no number is cut."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.cells import cell_len
from rich.console import Console as RichConsole
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from crosscheck2d.reports.terminal.foreign_text import legible

GAPS = 2, 1  # gap between two columns of a table: the wider one if all fits
TEXT = 28  # least width of a text beside its name


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


def print_table(
    console: Console,
    headings: Sequence[str],
    rows: Sequence[Sequence[str | Text]],
    title: str = "",
    left: Sequence[str] = (),
) -> None:
    """Print a row for each name, with its numbers to the right; columns with `left` headings are
    aligned left.

    What does not fit beside the names goes into a second table below, with the names again. A name
    wider than half of the terminal is folded if its numbers need the room.
    """
    if title:
        console.print(title, style="italic", highlight=False)
    widths = [
        max(map(width_of, (heading, *(row[k] for row in rows))))
        for k, heading in enumerate(headings)
    ]
    numbers = range(1, len(headings))
    beside = {gap: sum(widths[k] + gap for k in numbers) for gap in GAPS}
    gap = next((gap for gap in GAPS if widths[0] + beside[gap] <= console.width), GAPS[-1])
    names = min(widths[0], max(console.width // 2, console.width - beside[gap]))
    groups: list[list[int]] = [[]]
    for column in numbers:
        if (
            groups[-1]
            and names + sum(widths[k] + gap for k in (*groups[-1], column)) > console.width
        ):
            groups.append([])
        groups[-1].append(column)
    for k, group in enumerate(groups):
        table = Table(box=None, padding=(0, gap, 0, 0), pad_edge=False)
        table.add_column(headings[0], width=names, overflow="fold", vertical="top")
        for column in group:
            table.add_column(
                headings[column],
                width=widths[column],
                justify="left" if headings[column] in left else "right",
                no_wrap=True,
            )
        for row in rows:
            table.add_row(row[0], *(row[column] for column in group))
        if k:
            console.print()
        console.print(table)


def width_of(cell: str | Text) -> int:
    text = cell.plain if isinstance(cell, Text) else legible(cell)
    return max(map(cell_len, text.split("\n")))


def print_texts(console: Console, texts: Mapping[str, str | Text], title: str = "") -> None:
    """Print a name and its text in each row; on a narrow terminal the text is below, indented."""
    if title:
        console.print(title, style="italic", highlight=False)
    names = max(map(width_of, texts), default=0)
    if console.width - names - 2 < TEXT:
        for name, text in texts.items():
            console.print(Text(legible(name), "bold"), soft_wrap=False)
            console.print(Padding(text, (0, 0, 0, 2)), highlight=False)
        return
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, show_header=False)
    table.add_column(width=names, no_wrap=True)
    table.add_column()
    for name, text in texts.items():
        table.add_row(name, text)
    console.print(table)


def print_list(console: Console, sentences: Iterable[str]) -> None:
    table = Table.grid(padding=(0, 1, 0, 0))
    for sentence in sentences:
        table.add_row("-", sentence)
    console.print(table)
