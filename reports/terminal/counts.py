"""Numbers of things and lists of names in sentences: "1 scene", "2 scenes", "a, b and c"."""

from __future__ import annotations

from collections.abc import Sequence


def counted(n: int, noun: str, plural: str = "") -> str:
    """The number and its noun, "1 search" or "2 searches"; `plural` where an s is not enough."""
    return f"{n} {noun if n == 1 else plural or f'{noun}s'}"


def listed(names: Sequence[str]) -> str:
    """a, b and c."""
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
