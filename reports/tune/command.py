"""`crosscheck tune`: search the settings of engines, print what is chosen, write the table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import NoReturn

import pandas as pd

from crosscheck2d.reports.run.arguments import opening, unknown
from crosscheck2d.reports.run.folders import made_anew, place_of
from crosscheck2d.reports.run.made import FolderKind, may_replace, writing
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import DONE, broken_off, refuse
from crosscheck2d.reports.terminal.foreign_text import put_text
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.reports.terminal.tables import print_table
from crosscheck2d.reports.tune.search import (
    BETTER,
    BREAKS,
    CHOSEN,
    NO_BETTER,
    TUNED,
    UNASKED,
    SettingsSearch,
)

NAME = "matched.csv"
TUNE = FolderKind("crosscheck tune")


def tune(engines: Sequence[str], out: Path) -> NoReturn:
    """Search the settings of `engines`, `UNASKED` if none is named; write matched.csv into
    `out`; exits 0.

    The table of an engine is written as soon as its search has ended. Exits 2 on a name that is no
    engine with settings, or where `out` may not be written, 130 and 143 when broken off.
    """
    if faults := [unknown("engine", name, TUNED) for name in engines if name not in TUNED]:
        refuse(faults)
    with opening(out):
        out = place_of(out)
        may_replace(out, TUNE)
        out.parent.mkdir(parents=True, exist_ok=True)
        # so that it is known before the search whether it can be written
        with TemporaryFile(dir=out.parent):
            pass
    tables: list[pd.DataFrame] = []
    with (
        broken_off(
            out,
            lambda: (
                f"The finished searches are in {out / NAME}." if tables else "No search finished."
            ),
        ),
        Progress() as bar,
    ):
        for engine in dict.fromkeys(engines or UNASKED):
            bar.say(f"{engine}: the exact answers, and the present settings")
            search = SettingsSearch(engine, say=bar.note)
            bar.say(f"{engine}: pairs of settings, and setting by setting")
            found = pd.concat([*tables, search.run()])
            with made_anew(out, TUNE, "--out") as part, writing(part, [NAME]):
                put_text(part / NAME, found.to_csv(index=False))
            tables = [found]
    show(found)
    Console().print(f"\n{out / NAME}", style="bold", highlight=False, soft_wrap=True)
    sys.exit(DONE)


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
