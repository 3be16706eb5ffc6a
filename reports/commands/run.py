"""`crosscheck run`: play what has no row yet, compare, report. `crosscheck report`: tables, page
and summary again, from the rows."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterable, Sequence, Set
from contextlib import chdir, nullcontext
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
import pandas as pd
import psutil

from crosscheck2d.adapters.advance import off_grid_note
from crosscheck2d.adapters.engines import OWN, row_of
from crosscheck2d.adapters.run import STATUSES
from crosscheck2d.reports.commands.own_solvers import checks_of, lines
from crosscheck2d.reports.compare.fast_disks import fast_note
from crosscheck2d.reports.page.report import PAGE, Report, make_report, take_times
from crosscheck2d.reports.page.scenes import SceneScores, values
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.arguments import (
    checked_engines,
    checked_scenes,
    default_engines,
    of_main_job,
    opening,
)
from crosscheck2d.reports.run.bits import kept_bits, write_bits
from crosscheck2d.reports.run.cluster import NoScheduler, connect
from crosscheck2d.reports.run.pool import LEAST_MEMORY, affordable
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.run.suite import Means, OtherVersions, RunPlan, carry_out, take_timings
from crosscheck2d.reports.run.timing_pass import cells_to_time
from crosscheck2d.reports.terminal.console import Console, print_list, print_table
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import DONE, FAILED, keeping, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.truth import cache

MAPPED = "position_max_radii"


class Column(NamedTuple):
    """A column, lower is better: heading, unit in nine letters, and the metrics whose sum it is."""

    title: str
    unit: str
    metrics: tuple[str, ...]


COLUMNS = (
    Column("Position", "radii", (MAPPED,)),
    Column("Momentum", "of Σ m|v|", ("momentum_error",)),
    Column("Energy", "of energy", ("energy_error",)),
    Column("Restitution", "in e", ("restitution_error",)),
    Column("Wrong collisions", "number", ("collisions_missed", "collisions_spurious")),
)
COUNTED = (Column("Fails", "scenes", ()), Column("Not played", "scenes", ()))


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
            f"--memory {memory}: a worker needs {LEAST_MEMORY} MB before it plays"
            " anything; must be more"
        )
    if scheduler:
        try:
            connect(scheduler).close()
        except NoScheduler as fault:
            refuse(str(fault))
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


def report_again(out: Path, timings: float | None) -> NoReturn:
    """Make tables and page of the run in `out` from its rows; with `timings` its engines are timed
    again, in at most so many s."""
    with opening(out, COMMAND, there=True) as store:
        with keeping(out, lambda: "The rows are kept."), Progress() as progress:
            results = RunResults.read(store)
            if timings is not None:
                results = time_again(results, timings, progress)
            report = make_report(results, progress.say)
        finish(report)


def time_again(results: RunResults, seconds: float, progress: Progress) -> RunResults:
    """The results with new times; exits 2 if the engines have changed since they were played."""
    # the paths of solvers' files are relative to the folder in which the run was started
    started = Path(results.header["folder"])
    with chdir(started) if started.is_dir() else nullcontext():
        rows = {name: row_of(name) for name in checked_engines(results.header["engines"])}
    cells = cells_to_time(results, rows)
    if not cells:
        refuse(
            f"{results.folder}: its engines have changed since they were played; crosscheck run"
            " plays them again"
        )
    take_timings(results.store, cells, seconds, Means(1), progress, again=True)
    return RunResults.read(results.store)


def finish(report: Report, status: int = DONE) -> NoReturn:
    """Print the summary; exit 1 if an engine or a scene is not compared completely, else
    `status`."""
    folder = report.results.folder
    print_summary(report)
    # an engine that models no friction may refuse it, unless it was asked for by name
    by_name = report.results.header["engines"] != default_engines()
    runs = [run for scene in report.summary.scenes for run in scene.comparison.runs]
    played = {run.name for run in runs if run.status == "ok"}
    if lost := sorted({r.name for r in runs if by_name or not r.frictionless} - played):
        say(
            f"no cell of {', '.join(lost)} was played to its end: see the status column of"
            f" {folder / 'runs.csv'}"
        )
    for name, why in report.unjudged.items():
        say(f"{name} is not judged: {why}")
    sys.exit(FAILED if lost or report.unjudged else status)


def print_summary(report: Report) -> None:
    """Print the medians over the scenarios at their middle step, the findings, and the path of the
    page."""
    console, scenes, results = Console(), report.summary.scenes, report.results
    names, untrusted = report.summary.names, report.summary.untrusted
    for rough in (False, True):
        some = [s for s in scenes if bool(s.comparison.scenario.scene.friction) == rough]
        if not some:
            continue
        headings, rows, without = medians(some, names, untrusted)
        if rows:
            kind = " with friction" if rough else ""
            title = f"Largest error in the scene{kind}, at its middle step size; lower is better"
            if len(some) > 1:
                title = (
                    "Largest error in a scene, at its middle step size: median of up to"
                    f" {len(some)} scenes{kind} (last row: of how many); lower is better"
                )
            print_table(console, headings, rows, title)
        if without:
            console.print(f"Without a model of friction: {', '.join(without)}.", highlight=False)
        console.print()
    checks = ["\n".join(lines(name, says)) for name, says in report.said.items()]
    notes = [  # of thrusts that start or stop inside a step, and of disks that are fast for it
        f"{scene.name}: {note.removesuffix('.')}."
        for scene in scenes
        for note in (off_grid_note(scene.comparison.scenario), fast_note(scene.comparison))
        if note
    ]
    counts = report.runs.status.value_counts()
    statuses = ", ".join(f"{counts[status]} {status}" for status in STATUSES if status in counts)
    ended = f"{counted(len(report.runs), 'cell')} ended"
    ended = f"{ended}: " if results.complete else f"Not finished: {ended} so far: "
    print_list(console, [*report.findings, *checks, *notes, f"{ended}{statuses}."])
    page = (results.folder / PAGE).resolve()
    taken, again = results.timing.get("taken", ""), take_times(results.folder)
    times = f"No times were taken. To take them: {again}"
    if taken:
        times = f"The times are of {taken}. To take them again: {again}"
    for line in (failures(report, page.parent), times if taken < results.header["started"] else ""):
        if line:
            console.print(line, highlight=False, soft_wrap=True)
    console.print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)


def failures(report: Report, out: Path) -> str:
    runs = report.runs[~report.runs.status.isin(["ok", "unsupported"])]
    if runs.empty:
        return ""
    first = next(line for line in report.results.records if line["cell"] == runs.iloc[0].cell)
    engine = f"{first['engine']}:{first['profile']}"
    words = ["run", first["scene"], "--engine", engine.removesuffix(OWN)]
    words += ["--dt", f"{first['dt_s']:.12g}"]  # as many digits as `with_steps` asks for
    if first["seed"]:
        words += ["--seed", str(first["seed"])]
    again = shlex.join(["crosscheck", *words, "--out", f"{out}-again"])
    return f"To play the failure of {first['scenario']} on {engine} again: {again}"


def medians(
    scenes: Sequence[SceneScores], names: Sequence[str], untrusted: Set[str]
) -> tuple[list[str], list[list[str]], list[str]]:
    """The headings and rows of the table, the last with the numbers of scenes, and the engines
    without a row because they do not model friction.

    A scene that an engine fails or does not play counts as infinitely far off; one that a solver's
    own file refuses does not count, as the exercise does not ask for it. Engines in `untrusted`
    broke the protocol or a law, and are not scored.
    """
    without = [name for name in names if all(name in s.frictionless for s in scenes)]
    names = [name for name in names if name not in without]
    scores = {
        column: pd.DataFrame([[score(s, name, column) for s in scenes] for name in names], names)
        for column in COLUMNS
    }
    scores = {column: frame for column, frame in scores.items() if frame.notna().any(axis=None)}
    rows = []
    for name in names:
        own, refused = name.endswith(OWN), sum(name in scene.refused for scene in scenes)
        fails = sum(bool(scene.verdicts(name)) for scene in scenes)
        played = len(scenes) - refused
        texts = {np.inf: "fails" if fails else "not played"}
        middle = [frame.median(axis=1)[name] for frame in scores.values()]
        cells = ["–" if np.isnan(value) else texts.get(value, number(value)) for value in middle]
        cells.append(f"{fails} of {played}" if played else "–")
        if name in untrusted:
            cells = ["breaks"] * len(cells)
        refusals = f"0 of {played}" if own else f"{refused} of {len(scenes)}"
        cells.append(refusals if played or not own else "not asked")
        rows.append([name, *cells])
    if rows and len(scenes) > 1:
        counts = [numbers_of_scenes(frame.count(axis=1)) for frame in scores.values()]
        rows.append(["in scenes", *counts, "", ""])
    return ["engine", *map(heading, [*scores, *COUNTED])], rows, without


def score(scene: SceneScores, name: str, column: Column) -> float:
    """The value of an engine in a scene, inf if it is lost there, nan where it is not judged. Wrong
    collisions are the missed and the spurious ones together, without collisions in the exact answer
    the spurious ones."""
    judged = {key: v.value for key, v in values(scene.comparison).items() if v.judged}
    own = [judged[name, metric] for metric in column.metrics if (name, metric) in judged]
    applies = any(metric in column.metrics for _, metric in judged)
    fails = bool(scene.verdicts(name))
    lost = fails or (name in scene.refused and not name.endswith(OWN))
    if lost and (applies or (column.metrics == (MAPPED,) and fails)):
        return np.inf
    return float(sum(own)) if own else np.nan


def numbers_of_scenes(counts: Iterable[int]) -> str:
    """Of how many scenes the medians of a column are: "9", "5–8", or "" if there is none."""
    least = [count for count in counts if count]
    return "–".join(map(str, dict.fromkeys((min(least), max(least))))) if least else ""


def heading(column: Column) -> str:
    title = column.title.replace(" ", "\n").replace("collisions", "colli-\nsions")
    return f"{title}\n{column.unit}"
