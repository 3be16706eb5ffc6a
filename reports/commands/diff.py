"""`crosscheck diff A B`: what changed between two runs, as a table; exit 1 if something got
worse."""

from __future__ import annotations

import sys
from collections import Counter
from math import inf
from pathlib import Path
from typing import NoReturn

from crosscheck2d.reports.run.diff import FACTOR, ROUNDING, Change, Difference, Timing, difference
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import DONE, FAILED, FolderTaken, Unusable, refuse, say
from crosscheck2d.reports.terminal.tables import print_list, print_table
from crosscheck2d.scenarios.rows import Damaged

SHOWN = 12  # changes, the worst first
HEADINGS = (
    "engine",
    "status\nworse",
    "status\nbetter",
    "numbers\nthe same",
    "in\nrounding",
    "numbers\nworse",
    "numbers\nbetter",
    "numbers\nother",
    "time\ntaken",
)


def show_difference(before: Path, after: Path) -> NoReturn:
    """Print the difference; exits 0, 1 (something got worse, or the runs share no cell) or 2 (a
    folder cannot be used)."""
    try:
        changed = difference(before, after)
    except OSError as fault:
        refuse([f"{fault.filename or f'{before}, {after}'}: {fault.strerror or fault}"])
    except (Damaged, FolderTaken, Unusable) as fault:
        refuse([str(fault)])
    if not changed.shared:
        say(
            f"{before} and {after} share no cell (scene, engine and step size), so that nothing can"
            " be compared"
        )
        sys.exit(FAILED)
    console = Console()
    for warning in changed.warnings:
        console.print(warning, style="yellow", highlight=False)
    title = "What changed; a number between two engines counts for both"
    print_table(console, HEADINGS, by_engine(changed), title, left=HEADINGS[-1:])
    console.print()
    total = len(changed.statuses) + len(changed.numbers)
    if worst := sorted((*changed.statuses, *changed.numbers), key=severity)[:SHOWN]:
        shown = f"The {len(worst)} largest of {total} changes" if total > SHOWN else "The changes"
        console.print(f"{shown}, before → after", style="italic", highlight=False)
        print_list(console, map(in_words, worst))
        console.print()
    console.print(sentence(changed), highlight=False)
    sys.exit(FAILED if changed.worse else DONE)


def by_engine(changed: Difference) -> list[list[str]]:
    timings = {timing.engine: timing for timing in changed.timings}
    changes = *changed.statuses, *changed.numbers
    engines = [*changed.same, *(change.engine for change in changes)]
    engines += [change.beside for change in changes if change.beside]
    rows = []
    for engine in dict.fromkeys((*engines, *timings)):
        statuses, numbers = (
            Counter(x.verdict for x in kind if engine in (x.engine, x.beside))
            for kind in (changed.statuses, changed.numbers)
        )
        counts = [statuses["worse"], statuses["better"]]
        same = str(changed.same[engine])
        others = [numbers[verdict] for verdict in (ROUNDING, "worse", "better", "other")]
        texts = [*(str(n or "") for n in counts), same, *(str(n or "") for n in others)]
        rows.append([engine, *texts, said_of(timings.get(engine))])
    return rows


def in_words(change: Change) -> str:
    values = f"{change.before or 'nan'} → {change.after or 'nan'}"
    return f"{change.verdict}: {change.engine}, {change.what}: {values}"


def said_of(timing: Timing | None) -> str:
    if timing is None:
        return ""
    if timing.high == inf:
        return f"×{timing.factor:.2f} (of {timing.n}: too few)"
    verdict = "" if timing.verdict == "same" else f" {timing.verdict}"
    return f"×{timing.factor:.2f} ({timing.low:.2f}–{timing.high:.2f}){verdict}"


def severity(change: Change) -> tuple[bool, bool, bool, float]:
    # worse changes first, rounding last, then statuses first, then by size
    return (
        change.verdict != "worse",
        change.verdict == ROUNDING,
        not change.what.endswith("status"),
        -change.factor,
    )


def sentence(changed: Difference) -> str:
    said = f"{counted(changed.worse, 'result') if changed.worse else 'Nothing'} got worse."
    if not changed.timings:
        return f"{said} No times were compared: run both on one machine that is idle."
    return (
        f"{said} A time counts as worse if its factor is above {FACTOR:g} and its whole 99 %"
        " interval above 1."
    )
