"""`crosscheck run`: play, compare, report; or go on with a run that was broken off."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NoReturn

from adapters.engines import row_of
from reports.archive import Archive
from reports.commands import checked_engines, checked_scenes, finish, opening, refusing
from reports.exits import FAILED, broken_off, refuse, say
from reports.folders import open_again, open_new, part_of, replace_folder
from reports.journal import JOURNAL, Journal
from reports.report import make_report
from reports.runner import LEAST_MEMORY, NoScheduler, affordable, cluster
from reports.suite import Means, OtherVersions, Plan, carry_out
from reports.terminal import Progress
from scenarios.catalogue import SCENARIOS


def run_plan(
    scenes: Sequence[str],
    engines: Sequence[str],
    dts: Sequence[float],
    full: bool,
    seed: int,
    timings: int,
    out: Path,
    means: Means,
    command: str,
) -> NoReturn:
    """Play, compare, report into `out`; exits 0, 1 (an engine or a scene could not be compared), 2, 130 or 143."""
    plan = Plan(
        scenes=checked_scenes(scenes or list(SCENARIOS), dts, full, seed),
        engines={name: row_of(name) for name in checked_engines(engines)},
        seed=seed,
        dts=dts,
        full=full,
        timings=timings,
        command=command,
    )
    out = out.resolve()
    with opening(out):
        journal = open_new(out)
    carry_on(plan, means, journal, out)


def means_of(workers: int, timeout: float, memory: int, scheduler: str) -> Means:
    """The means that are asked for; exits 2 if no worker could start, or no scheduler answers.

    `workers` 0: one a core; `memory` in MB, 0: the share of a worker.
    """
    workers = affordable(workers or os.cpu_count() or 1)
    if 0 < memory < LEAST_MEMORY:
        refuse([f"--memory {memory}: a worker takes {LEAST_MEMORY} MB before it has played anything; allowed is more"])
    if scheduler:
        try:
            cluster(scheduler).close()
        except NoScheduler as fault:
            refuse([str(fault)])
    share = 0 if scheduler else os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // workers
    return Means(workers, timeout, memory * 1_000_000 or share, scheduler)


def resume(out: Path, means: Means, alone: bool) -> NoReturn:
    """Play what is missing or changed in the run of `out`, compare, report; exits as `run_plan`.

    `alone`: nothing is asked for but to resume, and with which means.
    """
    if not alone:
        refuse(["--resume goes on with a run as it was asked for: it takes no scenarios, --engine, --dt, --full, "
                "--seed, --timings and --out"])  # fmt: skip
    out = out.resolve()
    with refusing(f"--resume {out}"):
        journal = open_again(out)
        plan = plan_of(journal.path.parent)
    carry_on(plan, means, journal, out)


def plan_of(folder: Path) -> Plan:
    """What was asked for, as the journal has it; of a scene file that is gone the copy is played."""
    header = Archive.read(folder).header
    names = ("seed", "dts", "full", "timings", "command")
    scenes = checked_scenes(header["scenes"], header["dts"], header["full"], header["seed"])
    engines = {name: row_of(name) for name in checked_engines(header["engines"])}
    return Plan(scenes=scenes, engines=engines, **{name: header[name] for name in names})


def carry_on(plan: Plan, means: Means, journal: Journal, out: Path) -> NoReturn:
    """Carry out the plan, report, and put it all in its place; what was played is kept, whatever happens."""
    part = journal.path.parent
    try:
        with broken_off(part, partial(what_is_kept, out)), journal, Progress() as progress:
            carry_out(plan, means, journal, progress)
            report = make_report(part, progress.say)
            replace_folder(part, out)
    except (NoScheduler, OtherVersions) as fault:
        say(f"{fault}. {what_is_kept(out)}")
        sys.exit(FAILED)
    finish(report, out)


def what_is_kept(out: Path) -> str:
    """A sentence on what a run that was broken off has left, and how to go on."""
    part = part_of(out)
    if not part.exists() and (out / JOURNAL).exists():
        return f"All is done: {out}"
    ended = len(Archive.read(part).records) if (part / JOURNAL).exists() else 0
    if not ended:
        return "Nothing was played yet."
    return (
        f"The {ended} cells that were played are kept.\n"
        f"To go on:  crosscheck run --resume {out}\nTo look:   crosscheck report {part}"
    )
