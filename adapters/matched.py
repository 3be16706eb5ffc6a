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
    """The public settings of an engine that `crosscheck tune` searches for its matched profile."""

    chosen: Mapping[str, Any]  # setting -> its value in the matched profile; a test compares it
    # setting -> (the values tried besides the chosen one, meaning and unit)
    settings: Mapping[str, tuple[tuple[Any, ...], str]]
    # two settings with related effects, tried together: names, values of the first, of the second
    pairs: tuple[tuple[tuple[str, str], tuple[Any, ...], tuple[Any, ...]], ...]
    left_alone: Mapping[str, str]  # a setting that is not searched -> why


def searched(path: Path = TABLE) -> list[dict[str, str]]:
    """The rows of the table, as `crosscheck2d.reports.tune.command.COLUMNS`."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def chosen(engine: str, path: Path = TABLE) -> dict[str, str]:
    return {
        row["setting"]: row["value"]
        for row in searched(path)
        if row["engine"] == engine and row["verdict"] == "chosen"
    }
