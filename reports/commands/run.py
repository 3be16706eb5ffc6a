"""`crosscheck run`: play what has no row yet, compare, report."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import psutil

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.reports.commands.own_solvers import checks_of
from crosscheck2d.reports.commands.report import finish
from crosscheck2d.reports.page.report import make_report
from crosscheck2d.reports.run.arguments import checked_engines, checked_scenes, of_main_job, opening
from crosscheck2d.reports.run.bits import kept_bits, write_bits
from crosscheck2d.reports.run.cluster import NoScheduler, connect
from crosscheck2d.reports.run.pool import LEAST_MEMORY, affordable
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.run.suite import Means, OtherVersions, RunPlan, carry_out
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import DONE, FAILED, keeping, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.truth import cache


def run_plan(
    scenes: Sequence[str],
    engines: Sequence[str],
    dts: Sequence[float],
    full: bool,
    seed: int,
    timings: float,
    out: Path,
    fresh: bool,
    trajectories: bool,
    bits: bool,
    means: Means,
    command: str,
) -> NoReturn:
    """Play, compare, report into `out`; exits 0, 1 (an engine or a scene could not be compared, or
    with `bits` an engine has others than those kept), 2, 130 or 143."""
    names = checked_engines(engines) if engines else of_main_job()
    rows = {name: row_of(name) for name in names}
    plan = RunPlan(
        checked_scenes(scenes or list(SCENARIOS), dts, full, seed),
        rows,
        seed,
        dts,
        full,
        # starting and calling a JavaScript engine is slow
        timings * (2 if any(row.package for row in rows.values()) else 1),
        command,
        checks_of([name for name, row in rows.items() if row.exercise]),
        trajectories,
    )
    if fault := cache.fault():
        say(fault)
    with opening(out, COMMAND, fresh) as store:
        try:
            with keeping(out, lambda: what_is_kept(store)), Progress() as progress:
                carry_out(plan, means, store, progress)
                results = RunResults.read(store)
                report = make_report(results, progress.say)
                if bits:
                    write_bits(results)
        except (NoScheduler, OtherVersions) as fault:
            say(f"{fault}. {what_is_kept(store)}")
            sys.exit(FAILED)
        finish(report, FAILED if bits and not kept_bits(store.folder) else DONE)


def means_of(workers: int, timeout: float, memory: int, scheduler: str) -> Means:
    """The `Means` of these options; exits 2 if no worker can start, or no scheduler answers.

    `workers` 0: one per core; `memory` in MB, 0: an equal share.
    """
    workers = affordable(workers or os.cpu_count() or 1)
    if 0 < memory < LEAST_MEMORY:
        refuse(
            [
                f"--memory {memory}: a worker needs {LEAST_MEMORY} MB before it plays"
                " anything; must be more"
            ]
        )
    if scheduler:
        try:
            connect(scheduler).close()
        except NoScheduler as fault:
            refuse([str(fault)])
    share = 0 if scheduler else psutil.virtual_memory().total // workers
    return Means(workers, timeout, memory * 1_000_000 or share, scheduler)


def what_is_kept(store: Store) -> str:
    try:
        ended = len(RunResults.read(store).records)
    except ValueError:
        ended = 0
    if not ended:
        return "Nothing was played yet."
    return (
        f"Kept: {counted(ended, 'finished cell')}.\n"
        "To go on:               the same command again\n"
        f"To see what there is:   crosscheck report {store.folder}"
    )
