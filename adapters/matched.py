"""The settings of matched profiles that `crosscheck tune` searches, and the table of results."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TABLE = Path(__file__).with_suffix(".csv")
GEOMETRY = (
    "it would move what the scene states, so that a late collision and a wrong place make up for"
    " each other"
)


@dataclass(frozen=True)
class Searched:
    """The public settings of an engine that `crosscheck tune` searches for its matched profile.

    Attributes:
        chosen: setting -> its present value in the matched profile; a test compares it with the
            table.
        settings: setting -> (the values tried besides the chosen one, meaning and unit).
        pairs: two settings with related effects, tried together: names, values of the first, of the
            second.
        left_alone: a setting that is not searched -> why.
    """

    chosen: Mapping[str, Any]
    settings: Mapping[str, tuple[tuple[Any, ...], str]]
    pairs: tuple[tuple[tuple[str, str], tuple[Any, ...], tuple[Any, ...]], ...]
    left_alone: Mapping[str, str]


def searched(path: Path = TABLE) -> list[dict[str, str]]:
    """The rows of the table, in reading order: see `crosscheck2d.reports.tune.command.COLUMNS`."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def chosen(engine: str, path: Path = TABLE) -> dict[str, str]:
    """Setting -> its value in the table, for the searched settings of an engine."""
    return {
        row["setting"]: row["value"]
        for row in searched(path)
        if row["engine"] == engine and row["verdict"] == "chosen"
    }
