"""`crosscheck diff A B`: what changed between two runs, as a table; exit 1 if something got
worse."""

from __future__ import annotations

import sys
from math import inf
from pathlib import Path
from typing import NoReturn

from rich.table import Table

from reports.run.diff import FACTOR, Change, Difference, Timing, difference
from reports.run.folders import found
from reports.terminal.console import Console
from reports.terminal.exits import DONE, FAILED, FolderTaken, refuse

SHOWN = 12  # changes, the worst first


def show_difference(before: Path, after: Path) -> NoReturn:
    """Print it; exits 0, 1 (something got worse) or 2 (a folder cannot be used)."""
    try:
        changed = difference(found(before), found(after))
    except OSError as fault:
        refuse([f"{fault.filename or f'{before}, {after}'}: {fault.strerror or fault}"])
    except (FolderTaken, ValueError) as fault:
        refuse([str(fault)])
    console = Console()
    for warning in changed.warnings:
        console.print(
            f"differs in {warning}" if ":" in warning else warning, style="yellow", highlight=False
        )
    console.print(by_engine(changed))
    if worst := sorted((*changed.statuses, *changed.numbers), key=gravity)[:SHOWN]:
        console.print(changes_of(worst, len(changed.statuses) + len(changed.numbers)))
    console.print(sentence(changed), highlight=False)
    sys.exit(FAILED if changed.worse else DONE)


def by_engine(changed: Difference) -> Table:
    """A row an engine: statuses and numbers that changed, and how much longer it takes."""
    table = Table(box=None, padding=(0, 1, 0, 0), title="What changed", title_justify="left")
    for column in (
        "engine",
        "status worse",
        "better",
        "numbers the same",
        "worse",
        "better",
        "other",
        "time taken",
    ):
        left = column in ("engine", "time taken")
        table.add_column(column, justify="left" if left else "right", no_wrap=column == "engine")
    timings = {timing.engine: timing for timing in changed.timings}
    every = (
        *changed.same,
        *(change.engine for change in (*changed.statuses, *changed.numbers)),
        *timings,
    )
    for engine in dict.fromkeys(every):
        statuses, numbers = (
            [one for one in kind if one.engine == engine]
            for kind in (changed.statuses, changed.numbers)
        )
        counts = [
            count(statuses, "worse"),
            count(statuses, "better"),
            str(changed.same[engine]),
            count(numbers, "worse"),
            count(numbers, "better"),
            count(numbers, "other"),
        ]
        table.add_row(engine, *counts, said_of(timings.get(engine)))
    return table


def count(changes: list[Change], verdict: str) -> str:
    """How many of them, or nothing."""
    return str(sum(one.verdict == verdict for one in changes) or "")


def said_of(timing: Timing | None) -> str:
    """The factor, its interval, and what it means."""
    if timing is None:
        return ""
    if timing.high == inf:
        return f"×{timing.factor:.2f} (of {timing.n}: too few)"
    verdict = "" if timing.verdict == "same" else f" {timing.verdict}"
    return f"×{timing.factor:.2f} ({timing.low:.2f}–{timing.high:.2f}){verdict}"


def gravity(change: Change) -> tuple[bool, bool, float]:
    """The order of the list: worse first, of these statuses first, then by how much."""
    return change.verdict != "worse", not change.what.endswith("status"), -change.factor


def changes_of(changes: list[Change], total: int) -> Table:
    """The changes, a row each."""
    title = (
        f"The gravest {len(changes)} of {total} changes" if total > len(changes) else "The changes"
    )
    table = Table(box=None, padding=(0, 1, 0, 0), title=title, title_justify="left")
    for column in ("engine", "what", "before", "after", ""):
        table.add_column(column, overflow="fold")
    for change in changes:
        table.add_row(
            change.engine,
            change.what,
            change.before or "nan",
            change.after or "nan",
            change.verdict,
        )
    return table


def sentence(changed: Difference) -> str:
    """What it comes to."""
    said = f"{changed.worse} got worse." if changed.worse else "Nothing got worse."
    if not changed.timings:
        return (
            f"{said} Timings were not compared: that takes two runs on one machine with"
            " --timings 5."
        )
    return (
        f"{said} A time is called worse if the 99 % interval of its rounds lies above 1, "
        f"and the least of them has grown by more than ×{FACTOR:g}."
    )
