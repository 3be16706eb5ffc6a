"""Recorded results of engines that a reader of a lesson need not have: a line with date and
versions, then CSV."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date
from functools import cache
from pathlib import Path

import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.terminal.foreign_text import put_text


def keep(path: Path, found: pd.DataFrame, runs: Iterable[Run]) -> None:
    """Write a table, dated, with the versions that made `runs`."""
    versions = {library: version for run in runs for library, version in run.versions.items()}
    made = ", ".join(f"{library} {version}" for library, version in versions.items())
    text = found.to_csv(index=False, float_format="%.6g")
    put_text(path, f"# {date.today().isoformat()} with {made}\n{text}")


@cache
def table_in(path: Path) -> pd.DataFrame:
    """The table as it was last written."""
    return pd.read_csv(path, comment="#")


def made_with(path: Path) -> str:
    """When and with which versions it was written."""
    with path.open(encoding="utf-8") as file:
        return file.readline().rstrip("\n").removeprefix("# ")
