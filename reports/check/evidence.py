"""The evidence of a fault, as lines of text."""

from __future__ import annotations

from reports.check.rows import CheckRow


def evidence(row: CheckRow) -> list[str]:
    """The evidence of a fault, a line each: the numbers, the file's lines, the formula."""
    lines = [f"got: {row.got}", f"expected: {row.expected}"]
    lines += [f"line {line}: {text}" for line, text in row.lines]
    lines += [f"exercise: {row.formula}"] * bool(row.formula)
    return [*lines, f"read: {row.read}"]
