"""What a page says of a solver's own file: the sentences of `crosscheck check`, with their
evidence."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

Said = tuple[str, Sequence[str]]
"""A sentence of the check, and the lines of the file and the exercise's formula behind it."""


def sourced(sentence: str, lines: Sequence[str]) -> Markup:
    small = Markup("<br><small>{} <code>{}</code></small>")
    return Markup("").join([sentence, *(small.format(*line.split(": ", 1)) for line in lines)])


def with_lines(says: Sequence[str], shown: Sequence[Sequence[str]]) -> list[Said]:
    """Each sentence with its lines; a sentence that is no fault has none."""
    none: list[Sequence[str]] = [[]] * len(says)
    return list(zip(says, [*shown, *none]))
