"""`crosscheck stability`: check what is asked for, find the limits, write limits.csv, maps.csv and
stability.html."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import pandas as pd
from rich.table import Table

from adapters.engines import ENGINES, OWN
from reports.page.style import number
from reports.run.arguments import checked_engines, opening, unknown
from reports.run.folders import given_back, may_go_on, open_part, place_of, replace_folder
from reports.run.journal import Journal
from reports.run.made import Kind, writing
from reports.run.runner import affordable
from reports.stability.cases import CASES
from reports.stability.limits import Limit
from reports.stability.maps import MAPS
from reports.stability.page import write_page
from reports.stability.results import (
    StabilityPlan,
    StabilityResults,
    Task,
    carry_out,
    case_named,
    done_before,
    read,
    table,
)
from reports.stability.touching import TOUCHING, AtGap
from reports.stability.vary import VARIES, cannot_vary
from reports.terminal.console import Console
from reports.terminal.exits import DONE, FAILED, Unusable, broken_off, refuse, say
from reports.terminal.foreign_text import put_text
from reports.terminal.progress import Progress
from scenarios.files.scene_file import SceneFileError, read_scene_file

SEE = (
    "limits.csv and stability.html have the names of all, or tests/data/stability_limits.csv; for"
    " --vary see --help"
)
LIMITS, LAWS, MAP, PAGE = FILES = ("limits.csv", "laws.csv", "maps.csv", "stability.html")
PLAYED_BY = "|".join(re.escape(name.replace(":", "-")) for name in ENGINES)
STABILITY = Kind(
    "crosscheck stability",
    rf"journal\.jsonl|trajectories/.+\.({PLAYED_BY})[^/.]*\.npz",
    ("trajectories",),
)


def find_limits(
    names: Sequence[str],
    vary: Sequence[str],
    engines: Sequence[str],
    full: bool,
    resume: bool,
    out: Path,
    workers: int,
    command: str,
) -> NoReturn:
    """Find the limits of `names`, all cases and maps if there are none, into `out`; exits 0, 1, 2
    or 130."""
    cases, maps, touching = checked(names, vary)
    form = "full" if full else "quick"
    chosen = checked_engines(engines)
    if files := [name.removesuffix(OWN) for name in chosen if name not in ENGINES]:
        how = (
            "a file is not driven to its limits: crosscheck check judges it, crosscheck run"
            " plays it"
        )
        refuse([f"--engine {file}: {how}" for file in files])
    plan = StabilityPlan(
        cases, maps, touching, chosen, form, affordable(workers or os.cpu_count() or 1), command
    )
    with opening(out):
        out = place_of(out)
        journal = open_part(out, STABILITY)
        with given_back(journal):
            done = gone_on_with(journal, plan, resume)
    part = journal.path.parent
    kept = f"What has ended is kept in {part}: ask again with --resume"
    with broken_off(part, lambda: kept), journal, Progress() as progress:
        carry_out(plan, journal, done, progress)
        progress.say("writing the tables and the page")
        try:
            found = write_files(part)
        except SceneFileError as fault:  # it was there when all began
            raise Unusable(str(fault)) from fault
        replace_folder(part, out, STABILITY)
    finish(found, out)


def gone_on_with(journal: Journal, plan: StabilityPlan, resume: bool) -> set[Task]:
    """The tasks of the plan that ended well in an interrupted run; raises as `may_go_on`, lest
    others are lost."""
    had, done = done_before(journal.path.parent, plan)
    may_go_on(journal.path.parent, had, bool(done), resume)
    if not done:
        os.truncate(journal.path, 0)
    return done


def write_files(folder: Path) -> StabilityResults:
    """limits.csv, maps.csv, laws.csv and stability.html from the journal; returns what it holds."""
    results = read(folder)
    laws = [(one.name, one.engine, *at[:-1]) for one in results.laws for at in one.gaps]
    cells = [(one.name, one.engine, *cell) for one in results.maps for cell in one.cells]
    with writing(folder, FILES):
        put_text(folder / LIMITS, table(results.limits).to_csv(index=False))
        columns = ["scene", "engine", *AtGap._fields[:-1]]
        put_text(folder / LAWS, pd.DataFrame(laws, columns=columns).to_csv(index=False))
        columns = ["map", "engine", "x", "y", "reading", "failed", "event"]
        put_text(folder / MAP, pd.DataFrame(cells, columns=columns).to_csv(index=False))
        write_page(folder / PAGE, folder, results)
    return results


def checked(names: Sequence[str], vary: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """The cases, the maps and the scenes of touching disks that are meant; exits 2 with every
    fault, one line each."""
    faults = [unknown("--vary", what, VARIES) for what in vary if what not in VARIES]
    cases: list[str] = []
    maps, touching = (
        [name for name in names if name in MAPS],
        [name for name in names if name in TOUCHING],
    )
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
    return (
        (list(dict.fromkeys(cases)), maps, touching)
        if names
        else (list(CASES), list(MAPS), list(TOUCHING))
    )


def varied_of(path: str, vary: Sequence[str]) -> tuple[list[str], list[str]]:
    """The cases of a scene file, and why what was asked for cannot be varied; what nobody named is
    left out quietly."""
    one = read_scene_file(path)
    whys = {what: cannot_vary(one, what) for what in vary or VARIES if what in VARIES}
    faults = [f"{path}: --vary {what}: {why}" for what, why in whys.items() if why and vary]
    return [f"{path}:{what}" for what, why in whys.items() if not why], faults


def finish(results: StabilityResults, out: Path) -> NoReturn:
    """Print a table and where the page is; exit 1 if a task ended without a result."""
    # a row that is cut off would be no use to anybody
    console = Console(width=max(Console().width, 120))
    limits = results.limits
    rows = Table(title="Where they fail", title_justify="left", box=None, padding=(0, 1, 0, 0))
    shown = list(dict.fromkeys(limit.case for limit in limits))
    engines = [name for name in ENGINES if any(limit.engine == name for limit in limits)]
    rows.add_column("case, parameter", overflow="fold")  # this one, so that no number is cut
    for engine in engines:
        rows.add_column(engine.replace(":", "\n"), justify="right", no_wrap=True)
    found = {(limit.case, limit.engine): limit for limit in limits}
    for name in shown:
        cells = [
            in_words(found[name, engine]) if (name, engine) in found else "" for engine in engines
        ]
        case, parameter = Path(name).name, case_named(name).parameter
        rows.add_row(case + (", " if len(case + parameter) < 24 else ",\n") + parameter, *cells)
    console.print(rows)
    console.print(
        "A number: the first failure from gentle to harsh. ≤, ≥: fails up to there, works beyond."
        " –: does not"
    )
    console.print(
        "fail so far. never: fails everywhere. *: works again beyond, or fails before. Brackets,"
        " and how far apart"
    )
    console.print(
        "values were scanned, are in limits.csv (works_at, fails_at, spacing) and on the page."
    )
    console.print(
        f"\n{(out / 'stability.html').resolve()}", style="bold", highlight=False, soft_wrap=True
    )
    lost = [f"{one.case} on {one.engine}" for one in limits if one.status != "ok"]
    lost += [f"{one.name} on {one.engine}" for one in results.maps if one.status != "ok"]
    lost += [f"{one.name} on {one.engine}" for one in results.laws if one.status != "ok"]
    if lost:
        say(f"no result: {', '.join(lost)}")
    sys.exit(FAILED if lost else DONE)


def in_words(limit: Limit) -> str:
    """The limit in a few letters."""
    return limit.word or limit.sign + number(limit.fails_at) + ("" if limit.monotone else "*")
