"""The evidence of a fault, as lines of text."""

from __future__ import annotations

from crosscheck2d.reports.check.rows import CheckRow


def evidence(row: CheckRow) -> list[str]:
    """The evidence of a fault, a line each: the numbers, the file's lines, the formula."""
    numbers = [f"got: {row.got}", f"expected: {row.expected}"]
    return [*numbers, *lines_and_formula(row), f"read: {row.read}"]


def lines_and_formula(row: CheckRow) -> list[str]:
    """The file's lines that a fault is about, and the exercise's formula, a line each."""
    lines = [f"line {line}: {text}" for line, text in row.lines]
    return lines + [f"exercise: {row.formula}"] * bool(row.formula)
