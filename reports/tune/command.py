"""`crosscheck tune`: search the settings of engines, print what is chosen, write the table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import NoReturn

import pandas as pd

from crosscheck2d.reports.run.arguments import opening, unknown
from crosscheck2d.reports.run.cells import content_key, source_hash
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.terminal.console import Console, print_table
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import DONE, keeping, refuse
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.reports.tune.search import (
    BETTER,
    BREAKS,
    CHOSEN,
    NO_BETTER,
    TUNED,
    UNASKED,
    SettingsSearch,
)

NAME, TUNE = "matched.csv", "crosscheck tune"
SOURCE = ("reports/tune/*.py", "reports/compare/**/*.py", "scenarios/**/*.py")
NUMBERS = ("same_dt", "cost", "equal_cost")  # columns in which an empty field is NaN


def tune(engines: Sequence[str], fresh: bool, out: Path) -> NoReturn:
    """Search the settings of `engines`, `UNASKED` if none is named; write matched.csv into
    `out`; exits 0.

    The table of an engine is written as soon as its search has ended. Exits 2 on a name that is no
    engine with settings, or where `out` may not be written, 130 and 143 when interrupted.
    """
    if faults := [unknown("engine", name, TUNED) for name in engines if name not in TUNED]:
        refuse(faults)
    tables: list[pd.DataFrame] = []
    with (
        opening(out, TUNE, fresh) as store,
        keeping(out, lambda: f"{counted(len(tables), 'search', 'searches')} finished."),
        Progress() as bar,
    ):
        for engine in dict.fromkeys(engines or UNASKED):
            tables.append(read_table(searched(engine, store, bar)))
            found = pd.concat(tables)
            store.export(NAME, found.to_csv(index=False))
    show(found)
    Console().print(f"\n{out / NAME}", style="bold", highlight=False, soft_wrap=True)
    sys.exit(DONE)


def searched(engine: str, store: Store, bar: Progress) -> bytes:
    """The table of an engine, from its row or from a new search."""
    key = content_key(engine, source_hash(SOURCE))
    row = store.get("search", key)
    if row is None:
        bar.say(f"{engine}: the exact answers, and the present settings")
        search = SettingsSearch(engine, say=bar.note)
        bar.say(f"{engine}: pairs of settings, and setting by setting")
        row = store.put("search", key, None, search.run().to_csv(index=False).encode())
    return row.blob


def read_table(csv: bytes) -> pd.DataFrame:
    """A table of a search, bit for bit as written."""
    empty = {column: [""] for column in NUMBERS}
    return pd.read_csv(
        BytesIO(csv),
        keep_default_na=False,
        na_values=empty,
        dtype={"value": str},
        float_precision="round_trip",
    )


def show(table: pd.DataFrame) -> None:
    """Print what is chosen, and why not the others."""
    rows = []
    for _, row in table[table.verdict.isin([CHOSEN, BETTER, NO_BETTER, BREAKS])].iterrows():
        numbers = [
            "" if pd.isna(row[name]) else f"{row[name]:.3g}"
            for name in ("equal_cost", "cost", "harmed")
        ]
        rows.append([f"{row.engine}, {row.setting}: {row.value}", *numbers, row.verdict])
    headings = ["setting", "error", "cost\nof a step", "runs\nworse", "verdict"]
    title = "Errors at equal cost, and costs, as factors of those of the chosen settings"
    print_table(Console(), headings, rows, title, left=headings[-1:])
