"""`crosscheck bits`: which engines give the same bits on this machine as those kept in the
repository."""

from __future__ import annotations

import os
import platform
import sys
from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from adapters.engines import ENGINES, UNASKED, told_apart
from reports.run.bits import (
    COLUMNS,
    KEPT,
    ChangedBits,
    about_of,
    bits_here,
    differences,
    read,
    written,
)
from reports.run.cells import Cell, versions
from reports.run.runner import run_all
from reports.run.scenes import open_scene
from reports.run.worker_process import Failure
from reports.terminal.console import Console
from reports.terminal.counts import counted, listed
from reports.terminal.exits import DONE, FAILED, refuse, stoppable
from reports.terminal.foreign_text import put_text
from reports.terminal.progress import Progress
from reports.terminal.tables import print_list, print_table
from scenarios.catalogue import SCENARIOS

SHOWN = 12  # differences


def compare_bits(out: Path | None) -> NoReturn:
    """Play every scene through every engine at its middle step size, and print in how many the bits
    equal the kept ones; write the table to `out`, if given.

    Exits 0, 1 (other bits, or no row to compare) or 2 (`out` cannot be written).
    """
    made_by = made_here()
    with stoppable():
        rows = play_all()
    if out is not None:
        try:
            put_text(out, written(rows, made_by))
        except OSError as fault:
            refuse([f"{out}: {fault.strerror or fault}"])
    kept = KEPT.read_text(encoding="utf-8")
    found, both = differences(read(kept), read(written(rows, made_by)))
    console = Console()
    counts = Counter((both.engine + ":" + both.profile).tolist())
    show(console, found, counts)
    if new := {f"{row['engine']}:{row['profile']}" for row in rows} - {*counts}:
        console.print(f"No bits are kept of {listed(sorted(new))}.", highlight=False)
    others = [
        f"{key} {value} (here {made_by.get(key)})"
        for key, value in about_of(kept).items()
        if str(made_by.get(key)) != value
    ]
    if others:
        console.print(f"The kept bits were made with {', '.join(others)}.", highlight=False)
    sys.exit(FAILED if found or both.empty else DONE)


def made_here() -> dict[str, str]:
    """System, architecture and versions, which may affect the bits."""
    return {
        "system": platform.system(),
        "architecture": platform.machine(),
        "Python": platform.python_version(),
        **versions(),
    }


def play_all() -> list[dict[str, Any]]:
    """A row of the table for each scene of the catalogue and each engine, in order."""
    tasks: dict[Hashable, Callable[[], Any]] = {}
    for scene in SCENARIOS:
        scenario = open_scene(scene, 0)
        middle = scenario.substeps[len(scenario.substeps) // 2]
        for name in told_apart(UNASKED, scenario.scene):
            cell = Cell(scene, 0, name, middle)
            bare = replace(scenario, truth=None)  # workers do not need it
            tasks[scene, name] = partial(bits_here, cell, ENGINES[name], bare)
    rows: dict[Any, dict[str, Any]] = {}
    with Progress() as progress:
        progress.start(len(tasks), len(tasks), "playing")
        for key, result in run_all(tasks, os.cpu_count() or 1):
            if isinstance(result, Failure):
                engine, profile = key[1].split(":")
                lost = (key[0], engine, profile, "", result.status, "", "")
                progress.done(" ".join(key), result.status, result.reason)
                result = dict(zip(COLUMNS, lost))
            else:
                progress.done(" ".join(key), result["status"])
            rows[key] = result
    return [rows[key] for key in tasks]


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
