"""`crosscheck run`: play, compare, report; or continue an interrupted run."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import psutil

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.reports.commands.own_solvers import checks_of
from crosscheck2d.reports.commands.report import finish
from crosscheck2d.reports.page.report import make_report
from crosscheck2d.reports.run.archive import Archive, stored_scene
from crosscheck2d.reports.run.arguments import (
    checked_engines,
    checked_scenes,
    go_where_files_are,
    of_main_job,
    opening,
    refusing,
)
from crosscheck2d.reports.run.bits import BITS, kept_bits, write_bits
from crosscheck2d.reports.run.folders import (
    RUN,
    given_back,
    open_again,
    open_new,
    part_of,
    place_of,
    reopened,
    replace_folder,
)
from crosscheck2d.reports.run.journal import JOURNAL, Journal
from crosscheck2d.reports.run.results import OtherVersions
from crosscheck2d.reports.run.runner import LEAST_MEMORY, NoScheduler, affordable, cluster
from crosscheck2d.reports.run.suite import carry_out
from crosscheck2d.reports.run.tasks import Means, RunPlan
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import DONE, FAILED, broken_off, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS


@dataclass(frozen=True)
class RunRequest:
    """The arguments of the command, as typed, and the folder for the results."""

    scenes: Sequence[str]
    engines: Sequence[str]
    dts: Sequence[float]
    full: bool
    seed: int
    timings: float
    out: Path


def run_plan(request: RunRequest, means: Means, command: str, bits: bool) -> NoReturn:
    """Play, compare, report into `request.out`; exits 0, 1 (an engine or a scene could not be
    compared, or with `bits` an engine has others than those kept), 2, 130 or 143."""
    with opening(request.out):
        out, folder = place_of(request.out), os.getcwd()
    scenes = request.scenes or list(SCENARIOS)
    rows = {name: row_of(name) for name in checked_engines(request.engines or of_main_job())}
    plan = RunPlan(
        scenes=checked_scenes(scenes, request.dts, request.full, request.seed),
        engines=rows,
        checks=checks_of([name for name, row in rows.items() if row.exercise]),
        seed=request.seed,
        dts=request.dts,
        full=request.full,
        # starting and calling a JavaScript engine is slow
        timings=request.timings * (2 if any(row.package for row in rows.values()) else 1),
        command=command,
        folder=folder,
    )
    with opening(out):
        journal = open_new(out)
    carry_on(plan, means, journal, out, bits)


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
            cluster(scheduler).close()
        except NoScheduler as fault:
            refuse([str(fault)])
    share = 0 if scheduler else psutil.virtual_memory().total // workers
    return Means(workers, timeout, memory * 1_000_000 or share, scheduler)


def resume(out: Path, means: Means, bits: bool, alone: bool) -> NoReturn:
    """Play what is missing or changed in the run of `out`, compare, report; exits as `run_plan`.

    `alone`: whether no other options but those of `Means` and `bits` are given.
    """
    if not alone:
        refuse(
            [
                "--resume continues a run as it was started: it takes no scenarios, and none of"
                " --engine, --dt, --full, --seed, --timings and --out"
            ]
        )
    with refusing(f"--resume {out}"):
        out = place_of(out, "--resume")
        journal = open_again(out)
        with given_back(journal):
            plan = plan_of(journal.path.parent, part_of(out))
            reopened(journal, out)
    carry_on(plan, means, journal, out, bits or (part_of(out) / BITS).exists())


def plan_of(folder: Path, part: Path) -> RunPlan:
    """The plan in the journal, independent of the current folder; for a missing scene file its copy
    is played.

    `part`: the path of `folder` during the run. Exits 2 if a scene file or a solver's file is at
    fault.
    """
    header = Archive.read(folder).header
    files = {
        scene: file_of(scene, folder, header)
        for scene in header["scenes"]
        if scene.endswith(".toml")
    }
    scenes = checked_scenes(header["scenes"], header["dts"], header["full"], header["seed"], files)
    go_where_files_are(header, header["engines"])
    engines = {name: row_of(name) for name in checked_engines(header["engines"])}
    moved = {
        scene: part / path.relative_to(folder) if path.is_relative_to(folder) else path
        for scene, path in files.items()
    }
    names = ("seed", "dts", "full", "timings", "command", "folder")
    return RunPlan(
        scenes=scenes,
        engines=engines,
        files=moved,
        checks=checks_of([name for name, row in engines.items() if row.exercise]),
        **{name: header[name] for name in names},
    )


def file_of(scene: str, folder: Path, header: Mapping[str, Any]) -> Path:
    """The file of a scene, relative to the folder where the run was started; if it is missing, the
    copy in the run's folder."""
    path = Path(header["folder"], scene)
    copy = stored_scene(folder, header["names"].get(scene, ""))
    return copy if not path.exists() and copy.exists() else path


def carry_on(plan: RunPlan, means: Means, journal: Journal, out: Path, bits: bool) -> NoReturn:
    """Carry out the plan, report, and move the result to `out`, with `bits` also their hashes;
    finished cells are kept, whatever happens."""
    part = journal.path.parent
    try:
        with broken_off(part, partial(what_is_kept, out)), journal, Progress() as progress:
            carry_out(plan, means, journal, progress)
            report = make_report(part, progress.say)
            if bits:
                write_bits(part)
            journal.close()
            replace_folder(part, out, RUN)
    except (NoScheduler, OtherVersions) as fault:
        say(f"{fault}. {what_is_kept(out)}")
        sys.exit(FAILED)
    finish(report, out, FAILED if bits and not kept_bits(out) else DONE)


def what_is_kept(out: Path) -> str:
    """A sentence on what an interrupted run has left, and how to continue."""
    part = part_of(out)
    if not part.exists() and (out / JOURNAL).exists():
        return f"All is done: {out}"
    journal = part / JOURNAL
    # the journal is empty until the copies of the scenes are written
    begun = journal.exists() and journal.stat().st_size > 0
    ended = len(Archive.read(part).records) if begun else 0
    if not ended:
        return "Nothing was played yet."
    return (
        f"Kept: {counted(ended, 'finished cell')}.\n"
        f"To go on:               crosscheck run --resume {out}\n"
        f"To see what there is:   crosscheck report {part}"
    )
