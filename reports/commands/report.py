"""`crosscheck report OUT`, and how every run ends: tables and page from the journal, the summary,
the exit status."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from rich.table import Table

from adapters.play import STATUSES
from adapters.thrust_grid import off_grid_note
from reports.lessons.catalogue import LESSONS
from reports.page import overview
from reports.page.report import Report, make_report
from reports.run.archive import Archive
from reports.run.arguments import refusing
from reports.run.folders import found
from reports.terminal.console import Console
from reports.terminal.exits import DONE, FAILED, refuse, say
from reports.terminal.progress import Progress


def finish(report: Report, out: Path) -> NoReturn:
    """Print the summary; exit 1 if there is an engine, or a scene, of which not all that was asked
    for is compared."""
    print_summary(report, str((out / "report.html").resolve()))
    runs = [run for comparison in report.comparisons for run in comparison.runs]
    played = {run.name for run in runs if run.status == "ok"}
    if lost := sorted({run.name for run in runs} - played):
        say(
            f"no cell of {', '.join(lost)} was played to its end: see the status column of"
            f" {out / 'runs.csv'}"
        )
    for name, why in report.unjudged.items():
        say(f"{name} is not judged: {why}")
    sys.exit(FAILED if lost or report.unjudged else DONE)


def report_again(out: Path, scenes: Sequence[str], printed: bool) -> NoReturn:
    """Tables and page from the journal in `out`; `scenes` are on paper where it is printed."""
    if scenes and not printed:
        refuse([f"{' '.join(scenes)}: scenes are named after --print, to have them on paper"])
    if printed and not scenes:
        refuse(["--print: name the scenes that are to be on paper; the overview always is"])
    with refusing(str(out)), Progress() as progress:
        folder = found(out)
        played = sorted({record["scenario"] for record in Archive.read(folder).records})
        if missing := [scene for scene in scenes if scene not in played]:
            refuse(
                [
                    f"--print {scene}: not in {out}, which has {', '.join(played)}"
                    for scene in missing
                ]
            )
        report = make_report(folder, progress.say, LESSONS, tuple(dict.fromkeys(scenes)))
    finish(report, folder)


def print_summary(report: Report, page: str) -> None:
    """Medians over the scenarios at their middle step, the finding, and where the page is."""
    console = Console()
    title = (
        "Largest error, median over the scenarios, each at the middle of its dt ladder; lower is"
        " better"
    )
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("engine", no_wrap=True)
    for column in overview.SUMMARY.values():
        # ten engines are to fit into 80 columns
        heading = column.title.replace(" ", "\n").replace("collisions", "colli-\nsions")
        table.add_column(heading, justify="right", no_wrap=True)
    names = overview.names_of(report.comparisons)
    for name, cells in overview.summary(report.comparisons, names, report.untrusted).items():
        table.add_row(name, *(cell.text for cell in cells))
    console.print(table)
    for sentence in report.findings:
        console.print(sentence, highlight=False)
    for comparison in report.comparisons:
        if note := off_grid_note(comparison.scenario):
            console.print(f"{comparison.scenario.name}: {note}.", highlight=False)
    console.print(statuses(report), highlight=False)
    if failed := failures(report, Path(page).parent):
        console.print(failed, highlight=False, soft_wrap=True)
    console.print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)


def statuses(report: Report) -> str:
    """How many cells ended how, and whether all of them did."""
    counts = report.runs.status.value_counts()
    said = ", ".join(f"{counts[status]} {status}" for status in STATUSES if status in counts)
    if report.archive.complete:
        return f"All {len(report.runs)} cells have ended: {said}."
    return f"Not finished: {len(report.runs)} cells have ended so far: {said}."


def failures(report: Report, out: Path) -> str:
    """How to look into the first cell that failed; "" if none did."""
    runs = report.runs[~report.runs.status.isin(["ok", "unsupported"])]
    if runs.empty:
        return ""
    first = runs.iloc[0]
    what = f"{first.scenario} on {first.engine}:{first.profile}"
    return f"To look into one, e.g. {what}: crosscheck replay {first.cell} --out {out}"
