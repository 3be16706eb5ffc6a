"""Command lines that ask for what is not there, or cannot be."""

from __future__ import annotations

from tests.hostile.played import Input

LINES = (
    Input("a command that does not exist", ("jump",)),
    Input("an option that does not exist", ("run", "--fast")),
    Input("a scenario that is misspelt", ("run", "free_fal"), says="free_fall"),
)
