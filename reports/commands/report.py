"""`crosscheck report OUT`, and the end of every run: tables and page from the rows, summary,
exit status."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from crosscheck2d.adapters.advance import off_grid_note
from crosscheck2d.adapters.engines import OWN, row_of
from crosscheck2d.adapters.run import STATUSES
from crosscheck2d.reports.commands.medians import medians
from crosscheck2d.reports.commands.own_solvers import lines
from crosscheck2d.reports.compare.fast_disks import fast_note
from crosscheck2d.reports.page.report import PAGE, Report, make_report, take_times
from crosscheck2d.reports.page.scenes import SceneScores
from crosscheck2d.reports.run.arguments import (
    checked_engines,
    default_engines,
    opening,
    started_where,
)
from crosscheck2d.reports.run.plan import Means
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.suite import take_timings
from crosscheck2d.reports.run.timing_pass import cells_to_time
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import DONE, FAILED, keeping, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.reports.terminal.tables import print_list, print_table


def finish(report: Report, status: int = DONE) -> NoReturn:
    """Print the summary; exit 1 if an engine or a scene is not compared completely, else
    `status`."""
    folder = report.results.folder
    print_summary(report, str((folder / PAGE).resolve()))
    by_name = report.results.header["engines"] != default_engines()
    if lost := never_played(report.summary.scenes, by_name):
        say(
            f"no cell of {', '.join(lost)} was played to its end: see the status column of"
            f" {folder / 'runs.csv'}"
        )
    for name, why in report.unjudged.items():
        say(f"{name} is not judged: {why}")
    sys.exit(FAILED if lost or report.unjudged else status)


def never_played(scenes: Sequence[SceneScores], by_name: bool) -> list[str]:
    """The engines of which no cell was played to its end. One that models no friction may refuse
    it, unless engines were asked for `by_name`."""
    runs = [run for scene in scenes for run in scene.comparison.runs]
    played = {run.name for run in runs if run.status == "ok"}
    asked = {run.name for run in runs if by_name or not run.frictionless}
    return sorted(asked - played)


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
    with started_where(results.header["folder"]):
        rows = {name: row_of(name) for name in checked_engines(results.header["engines"])}
    cells = cells_to_time(results, rows)
    if not cells:
        refuse(
            [
                f"{results.folder}: its engines have changed since they were played; crosscheck run"
                " plays them again"
            ]
        )
    take_timings(results.store, cells, seconds, Means(1), progress, again=True)
    return RunResults.read(results.store)


def print_summary(report: Report, page: str) -> None:
    """Print the medians over the scenarios at their middle step, the findings, and the path of the
    page."""
    console = Console()
    of_kind: dict[bool, list[SceneScores]] = {False: [], True: []}
    for scene in report.summary.scenes:
        of_kind[bool(scene.comparison.scenario.scene.friction)].append(scene)
    for rough, scenes in of_kind.items():
        headings, rows, without = medians(scenes, report.summary.names, report.summary.untrusted)
        if rows and scenes:
            print_table(console, headings, rows, title_of(len(scenes), rough))
        if without and scenes:
            console.print(f"Without a model of friction: {', '.join(without)}.", highlight=False)
        if scenes:
            console.print()
    checks = ["\n".join(lines(name, says)) for name, says in report.said.items()]
    print_list(console, [*report.findings, *checks, *notes(report), statuses(report)])
    for line in filter(None, (failures(report, Path(page).parent), times(report))):
        console.print(line, highlight=False, soft_wrap=True)
    console.print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)


def title_of(scenes: int, rough: bool = False) -> str:
    """The title of the summary; `rough`: of scenes with friction."""
    kind = " with friction" if rough else ""
    if scenes == 1:
        return f"Largest error in the scene{kind}, at its middle step size; lower is better"
    return (
        f"Largest error in a scene, at its middle step size: median of up to {scenes} scenes"
        f"{kind} (last row: of how many); lower is better"
    )


def notes(report: Report) -> list[str]:
    """A sentence for each scene whose thrusts start or stop inside a step, or whose disks are fast
    for their step."""
    found = [
        (scene.name, note)
        for scene in report.summary.scenes
        for note in (off_grid_note(scene.comparison.scenario), fast_note(scene.comparison))
    ]
    return [f"{name}: {note.removesuffix('.')}." for name, note in found if note]


def statuses(report: Report) -> str:
    """The number of cells of each status, and whether all have ended."""
    counts = report.runs.status.value_counts()
    said = ", ".join(f"{counts[status]} {status}" for status in STATUSES if status in counts)
    ended = counted(len(report.runs), "cell")
    if report.results.complete:
        return f"{ended} ended: {said}."
    return f"Not finished: {ended} ended so far: {said}."


def times(report: Report) -> str:
    """When the times were taken before this run, and how to take them again; or ""."""
    taken, again = report.results.timing.get("taken", ""), take_times(report.results.folder)
    if not taken:
        return f"No times were taken. To take them: {again}"
    if taken >= report.results.header["started"]:
        return ""
    return f"The times are of {taken}. To take them again: {again}"


def failures(report: Report, out: Path) -> str:
    """How to play the first cell that failed again, beside the run in `out`; "" if none did."""
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
