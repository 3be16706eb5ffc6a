"""The table of what was searched for the matched profiles, by `crosscheck tune`; a test holds the adapters to it."""

from __future__ import annotations

import csv
from pathlib import Path

TABLE = Path(__file__).with_suffix(".csv")


def searched(path: Path = TABLE) -> list[dict[str, str]]:
    """The rows of the table, in reading order: see `reports.tune.search.COLUMNS`."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def chosen(engine: str, path: Path = TABLE) -> dict[str, str]:
    """Setting -> its value as the table has it, of what was searched for an engine."""
    return {
        row["setting"]: row["value"]
        for row in searched(path) if row["engine"] == engine and row["verdict"] == "chosen"
    }  # fmt: skip
