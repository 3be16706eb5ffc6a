"""`crosscheck stability`: check what is asked for, find the limits, write limits.csv, maps.csv and
stability.html."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import pandas as pd

from crosscheck2d.adapters.engines import ENGINES, OWN, row_of
from crosscheck2d.reports.run.arguments import checked_engines, opening, unknown
from crosscheck2d.reports.run.pool import affordable
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import Limit
from crosscheck2d.reports.stability.maps import MAPS
from crosscheck2d.reports.stability.overview import MARKS, in_words
from crosscheck2d.reports.stability.page import write_page
from crosscheck2d.reports.stability.results import (
    StabilityPlan,
    StabilityResults,
    carry_out,
    case_named,
    done_before,
    expected,
    read,
    table,
    tasks_of,
)
from crosscheck2d.reports.stability.touching import TOUCHING, AtGap
from crosscheck2d.reports.stability.variants import WITH_FRICTION_ONLY, taking_part
from crosscheck2d.reports.stability.vary import VARIES, cannot_vary
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import DONE, FAILED, Unusable, keeping, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.reports.terminal.tables import print_table, print_texts
from crosscheck2d.scenarios.files.scene_file import SceneFileError, read_scene_file

SEE = (
    "limits.csv and stability.html have the names of all, or tests/data/stability_limits.csv; for"
    " --vary see --help"
)
LIMITS, LAWS, MAP, PAGE = ("limits.csv", "laws.csv", "maps.csv", "stability.html")
STABILITY = "crosscheck stability"


def find_limits(
    names: Sequence[str],
    vary: Sequence[str],
    engines: Sequence[str],
    full: bool,
    fresh: bool,
    out: Path,
    workers: int,
    command: str,
) -> NoReturn:
    """Find the limits of `names`, all cases and maps if there are none, into `out`; exits 0, 1, 2
    or 130."""
    cases, maps, touching = checked(names, vary)
    form = "full" if full else "quick"
    chosen = checked_engines(engines)
    added = {name: row_of(name) for name in chosen if name not in ENGINES}
    if files := [name.removesuffix(OWN) for name, row in added.items() if row.exercise]:
        how = "it does not test a solver of the exercise: crosscheck check judges it,"
        how += " crosscheck run plays it"
        refuse([f"--engine {file}: {how}" for file in files])
    plan = StabilityPlan(
        cases, maps, touching, chosen, form, affordable(workers or os.cpu_count() or 1), command
    )
    with taking_part(added):
        find(plan, fresh, out)


def find(plan: StabilityPlan, fresh: bool, out: Path) -> NoReturn:
    """Find what was asked for, which was checked; exits as `find_limits`."""
    if not tasks_of(plan) and {*plan.engines} <= {*WITH_FRICTION_ONLY}:
        refuse([f"--engine {name}: plays as {ENGINES[name].bits_of} here" for name in plan.engines])
    with opening(out, STABILITY, fresh) as store:
        tasks = [task for task in tasks_of(plan) if task not in done_before(plan, store)]
        Console(stderr=True).print(f"{expected(tasks, plan.workers)}.", highlight=False)
        kept = "The finished part is kept: give the same command again"
        with keeping(out, lambda: kept), Progress() as progress:
            carry_out(plan, store, progress)
            progress.say("writing the tables and the page")
            try:
                found = write_files(store)
            except SceneFileError as fault:  # it was there when all began
                raise Unusable(str(fault)) from fault
        finish(found, store.folder)


def write_files(store: Store) -> StabilityResults:
    """limits.csv, maps.csv, laws.csv and stability.html from the rows; returns what they hold."""
    results = read(store)
    laws = [(one.name, one.engine, *at[:-1]) for one in results.laws for at in one.gaps]
    cells = [(one.name, one.engine, *cell) for one in results.maps for cell in one.cells]
    store.export(LIMITS, table(results.limits).to_csv(index=False))
    columns = ["scene", "engine", *AtGap._fields[:-1]]
    store.export(LAWS, pd.DataFrame(laws, columns=columns).to_csv(index=False))
    columns = ["map", "engine", "x", "y", "reading", "failed", "verdict", "event"]
    store.export(MAP, pd.DataFrame(cells, columns=columns).to_csv(index=False))
    with store.exporting(PAGE) as path:
        write_page(path, results)
    return results


def checked(names: Sequence[str], vary: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """The cases, maps and scenes of touching disks that were asked for; if a name is wrong,
    prints one line for each fault and exits 2."""
    faults = [not_varied(what) for what in vary if what not in VARIES]
    cases: list[str] = []
    for name in names:
        if name.endswith(".toml"):
            try:
                kept, whys = varied_of(name, vary)
                cases, faults = cases + kept, faults + whys
            except SceneFileError as error:
                faults += error.faults
        elif name in CASES:
            cases.append(name)
        elif name not in MAPS and name not in TOUCHING:
            faults.append(
                unknown("case", name, [*CASES, *MAPS, *TOUCHING]) + " (a scene file ends in .toml)"
            )
    if vary and not any(name.endswith(".toml") for name in names):
        faults.append(f"--vary {vary[0]}: varies a scene file, and none is named; name FILE.toml")
    if faults:
        refuse([fault.replace("see: crosscheck list", SEE) for fault in faults])
    if not names:
        return list(CASES), list(MAPS), list(TOUCHING)
    maps = [name for name in names if name in MAPS]
    touching = [name for name in names if name in TOUCHING]
    return list(dict.fromkeys(cases)), maps, touching


def not_varied(what: str) -> str:
    """A sentence on a word that `--vary` does not take, with those that it does."""
    said = unknown("--vary", what, VARIES).removesuffix("; see: crosscheck list")
    return f"{said}; allowed: {', '.join(VARIES)}"


def varied_of(path: str, vary: Sequence[str]) -> tuple[list[str], list[str]]:
    """The cases of a scene file, and why something that was asked for cannot be varied; what was
    not asked for by name is left out without a message."""
    one = read_scene_file(path)
    whys = {what: cannot_vary(one, what) for what in vary or VARIES if what in VARIES}
    faults = [f"{path}: --vary {what}: {why}" for what, why in whys.items() if why and vary]
    return [f"{path}:{what}" for what, why in whys.items() if not why], faults


def finish(results: StabilityResults, out: Path) -> NoReturn:
    """Print a table and where the page is; exit 1 if a task ended without a result."""
    print_limits(Console(), results.limits)
    Console().print(f"\n{(out / PAGE).resolve()}", style="bold", highlight=False, soft_wrap=True)
    lost = [
        f"{one.case if isinstance(one, Limit) else one.name} on {one.engine}"
        for one in results.all
        if one.status != "ok"
    ]
    if lost:
        say(f"no result: {', '.join(lost)}")
    sys.exit(FAILED if lost else DONE)


def print_limits(console: Console, limits: Sequence[Limit]) -> None:
    """A row for each case, a column for each engine, and what the marks mean."""
    engines = [name for name in ENGINES if any(limit.engine == name for limit in limits)]
    found = {(limit.case, limit.engine): limit for limit in limits}
    rows = []
    for name in dict.fromkeys(limit.case for limit in limits):
        cells = [
            in_words(found[name, engine]) if (name, engine) in found else "" for engine in engines
        ]
        rows.append([label_of(name), *cells])
    if not rows:
        return
    headings = ["case: parameter", *(engine.replace(":", "\n") for engine in engines)]
    print_table(console, headings, rows, "The first value, from gentle to harsh, that fails")
    text = "".join(cell for row in rows for cell in row[1:])
    console.print()
    print_texts(console, {mark: meaning for mark, meaning in MARKS.items() if mark in text})
    console.print(
        "The bracket of each limit, and how far apart the values were scanned, are in limits.csv"
        " (works_at, fails_at, spacing) and on the page.",
        highlight=False,
    )


def label_of(name: str) -> str:
    """The case and what is varied in it; for a scene file its name without the folder."""
    case = case_named(name)
    unit = "" if case.unit == "1" else f", {case.unit}"
    shown = name if name in CASES else Path(name.rpartition(":")[0]).name
    return f"{shown}: {case.parameter}{unit}"
