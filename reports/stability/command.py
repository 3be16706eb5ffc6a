"""`crosscheck stability`: check what is asked for, find the limits, write limits.csv, maps.csv and
stability.html."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import Any, NoReturn

import pandas as pd

from crosscheck2d.adapters.engines import ENGINES, OWN, row_of
from crosscheck2d.reports.run.arguments import checked_engines, opening, unknown
from crosscheck2d.reports.run.pool import affordable
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.stability.cases import CASES, VARIES, cannot_vary, case_named
from crosscheck2d.reports.stability.limits import WITH_FRICTION_ONLY, Limit, taking_part
from crosscheck2d.reports.stability.overview import MARKS, in_words
from crosscheck2d.reports.stability.page import write_page
from crosscheck2d.reports.stability.results import (
    StabilityPlan,
    StabilityResults,
    expected,
    read_results,
)
from crosscheck2d.reports.stability.tables import MAPS, TOUCHING, AtGap
from crosscheck2d.reports.terminal.console import Console, print_table, print_texts
from crosscheck2d.reports.terminal.exits import DONE, FAILED, Unusable, keeping, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.files.scene_file import SceneFileError, read_scene_file

SEE = "crosscheck list cases has the names of all; for --vary see --help"
COLUMNS = (
    *("engine", "profile", "case", "parameter", "works_at", "fails_at", "unit", "predicate"),
    *("seeds", "reason", "verdict", "failed_fraction", "runs", "monotone", "spacing", "tested"),
    *("source", "event", "form", "cause"),
)
PAGE = "stability.html"
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
    """Exits 0, 1, 2 or 130."""
    names, chosen = checked(names, vary), checked_engines(engines)
    added = {name: row_of(name) for name in chosen if name not in ENGINES}
    if files := [name.removesuffix(OWN) for name, row in added.items() if row.exercise]:
        how = "it does not test a solver of the exercise: crosscheck check judges it,"
        how += " crosscheck run plays it"
        refuse([f"--engine {file}: {how}" for file in files])
    form, count = "full" if full else "quick", affordable(workers or os.cpu_count() or 1)
    plan = StabilityPlan(names, chosen, form, count, command, added)
    with taking_part(added):
        if not plan.tasks() and {*chosen} <= {*WITH_FRICTION_ONLY}:
            refuse([f"--engine {name}: plays as {ENGINES[name].bits_of} here" for name in chosen])
        with opening(out, STABILITY, fresh) as store:
            done = plan.done_before(store)
            tasks = [task for task in plan.tasks() if task not in done]
            Console(stderr=True).print(f"{expected(tasks, count)}.", highlight=False)
            resume = "The finished part is kept: give the same command again"
            with keeping(out, lambda: resume), Progress() as progress:
                plan.carry_out(store, done, progress)
                progress.say("writing the tables and the page")
                try:
                    results = write_files(store)
                except SceneFileError as fault:  # it was there when all began
                    raise Unusable(str(fault)) from fault
            print_limits(Console(), results.limits)
            page = (store.folder / PAGE).resolve()
            Console().print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)
            lost = [
                f"{row.case if isinstance(row, Limit) else row.name} on {row.engine}"
                for row in results.all
                if row.status != "ok"
            ]
            if lost:
                say(f"no result: {', '.join(lost)}")
            sys.exit(FAILED if lost else DONE)


def write_files(store: Store) -> StabilityResults:
    results = read_results(store)
    laws = [(law.name, law.engine, *at[:-1]) for law in results.laws for at in law.gaps]
    cells = [(grid.name, grid.engine, *cell) for grid in results.maps for cell in grid.cells]
    maps = ("map", "engine", "x", "y", "reading", "failed", "verdict", "event")
    for name, frame in {
        "limits.csv": pd.DataFrame(
            [csv_row(limit) for limit in results.limits], columns=list(COLUMNS)
        ),
        "laws.csv": pd.DataFrame(laws, columns=["scene", "engine", *AtGap._fields[:-1]]),
        "maps.csv": pd.DataFrame(cells, columns=list(maps)),
    }.items():
        store.export(name, frame.to_csv(index=False))
    with store.exporting(PAGE) as path:
        write_page(path, results)
    return results


def csv_row(limit: Limit) -> dict[str, Any]:
    """Of limits.csv."""
    case, cause = case_named(limit.case), limit.cause
    failing = limit.failing if limit.status == "ok" else limit.trials[0]
    engine, profile = limit.engine.split(":")
    return {
        "engine": engine,
        "profile": profile,
        "case": limit.case,
        "parameter": case.parameter,
        "works_at": shortened(limit.works_at),
        "fails_at": shortened(limit.fails_at),
        "unit": case.unit,
        "predicate": failing.broken if failing else case.predicate.name,
        "seeds": max(trial.runs for trial in limit.trials),
        "reason": cause.sentence if cause else "",
        "verdict": limit.verdict,
        "failed_fraction": failing.failed / failing.runs if failing else 0.0,
        "runs": limit.runs,
        "monotone": limit.monotone,
        "spacing": shortened(limit.spacing),
        "tested": cause.shown if cause else "",
        "source": cause.source if cause else "",
        "event": failing.event if failing else "",
        "form": limit.form,
        "cause": str(cause.kind) if cause else "",
    }


def shortened(value: float) -> float:
    # six significant digits: no bracket is narrower
    return value if isnan(value) else float(f"{value:.6g}")


def checked(names: Sequence[str], vary: Sequence[str]) -> list[str]:
    """What to do, by default all; if a name is wrong, prints one line for each fault and exits 2.

    What can be varied in a scene file is named as FILE.toml:vary; what cannot, and was not asked
    for by name, is left out without a message.
    """
    known = [*CASES, *MAPS, *TOUCHING]
    faults = [
        f"{unknown('--vary', what, VARIES).removesuffix('; see: crosscheck list')}; allowed:"
        f" {', '.join(VARIES)}"
        for what in vary
        if what not in VARIES
    ]
    wanted: list[str] = []
    for name in names:
        if name in known:
            wanted.append(name)
        elif not name.endswith(".toml"):
            faults.append(f"{unknown('case', name, known)} (a scene file ends in .toml)")
        else:
            try:
                scene = read_scene_file(name)
            except SceneFileError as error:
                faults += error.faults
                continue
            for what in [what for what in vary or VARIES if what in VARIES]:
                if (reason := cannot_vary(scene, what)) is None:
                    wanted.append(f"{name}:{what}")
                elif vary:
                    faults.append(f"{name}: --vary {what}: {reason}")
    if vary and not any(name.endswith(".toml") for name in names):
        faults.append(f"--vary {vary[0]}: varies a scene file, and none is named; name FILE.toml")
    if faults:
        refuse([fault.replace("see: crosscheck list", SEE) for fault in faults])
    return list(dict.fromkeys(wanted)) if names else known


def print_limits(console: Console, limits: Sequence[Limit]) -> None:
    if not limits:
        return
    engines = [name for name in ENGINES if any(limit.engine == name for limit in limits)]
    words = {(limit.case, limit.engine): in_words(limit) for limit in limits}
    rows = []
    for name in dict.fromkeys(limit.case for limit in limits):
        case = case_named(name)
        label = name if name in CASES else Path(name.rpartition(":")[0]).name
        label = f"{label}: {case.with_unit(case.parameter)}"
        rows.append([label, *(words.get((name, engine), "") for engine in engines)])
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
