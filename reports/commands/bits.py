"""`crosscheck run --bits`: which engines give the same bits on this machine as those kept in the
repository."""

from __future__ import annotations

import platform
from collections import Counter
from pathlib import Path

from reports.run.archive import Archive
from reports.run.bits import KEPT, ChangedBits, about_of, differences, read, rows_of, written
from reports.run.cells import versions
from reports.run.made import writing
from reports.terminal.console import Console
from reports.terminal.counts import counted, listed
from reports.terminal.foreign_text import put_text
from reports.terminal.tables import print_list, print_table

BITS = "bits.csv"  # in the folder of a run
SHOWN = 12  # differences


def write_bits(folder: Path) -> None:
    """Write the table of a run to its folder, below the system, architecture and versions, which
    may affect the bits."""
    made_by = {
        "system": platform.system(),
        "architecture": platform.machine(),
        "Python": platform.python_version(),
        **versions(),
    }
    with writing(folder, [BITS]):
        put_text(folder / BITS, written(rows_of(Archive.read(folder)), made_by))


def kept_bits(folder: Path) -> bool:
    """Print in how many scenes the bits of a run equal the kept ones; whether all that can be
    compared do, and there is something to compare."""
    kept, here = KEPT.read_text("utf-8"), (folder / BITS).read_text("utf-8")
    table, made_by = read(here), about_of(here)
    changed, both = differences(read(kept), table)
    console = Console()
    counts = Counter((both.engine + ":" + both.profile).tolist())
    show(console, changed, counts)
    if new := {*(table.engine + ":" + table.profile)} - {*counts}:
        names = listed(sorted(new))
        console.print(f"No bits are kept of {names} in these scenes and steps.", highlight=False)
    others = [
        f"{key} {value} (here {made_by.get(key)})"
        for key, value in about_of(kept).items()
        if made_by.get(key) != value
    ]
    if others:
        console.print(f"The kept bits were made with {', '.join(others)}.", highlight=False)
    console.print()
    return not changed and not both.empty


def show(console: Console, found: list[ChangedBits], counts: Counter[str]) -> None:
    """Print a row for each engine, and the first differences."""
    other = Counter(each.name for each in found)
    rows = [[name, str(n - other[name]), str(n)] for name, n in counts.items()]
    title = "In how many scenes the bits are those kept in reports/bits.csv"
    print_table(console, ["engine", "the same", "of"], rows, title)
    console.print()
    print_list(console, [in_words(each) for each in found[:SHOWN]])
    if len(found) > SHOWN:
        console.print(f"and {counted(len(found) - SHOWN, 'more difference')}")


def in_words(one: ChangedBits) -> str:
    """A sentence on where the bits differ."""
    if one.other < 0:
        return f"{one.name} in {one.scenario}: it did not play to the same sample"
    if one.same < 0:
        return f"{one.name} in {one.scenario}: other bits from the start on"
    return (
        f"{one.name} in {one.scenario}: the same bits up to sample {one.same}, others by sample"
        f" {one.other}"
    )
