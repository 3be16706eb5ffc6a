"""Numbers of things in sentences: "1 scene", "2 scenes", "no scene"."""

from __future__ import annotations


def counted(n: int, noun: str, plural: str = "") -> str:
    """The number and its noun, "1 search" or "2 searches"; `plural` where an s is not enough."""
    return f"{n} {noun if n == 1 else plural or f'{noun}s'}"
