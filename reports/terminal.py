"""What a person sees in the terminal: progress while cells are played, and the summary after."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from types import TracebackType

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Table

from adapters.play import STATUSES
from reports import overview
from reports.console import Console
from reports.foreign_text import legible
from reports.report import Report

QUIET = 30.0  # s between two lines where there is no terminal that a bar could be drawn on


class Progress:
    """A bar that says what runs, how long one takes and how long all will; in a log, a line now and then."""

    def __init__(self) -> None:
        self.bar = Bar(
            TextColumn("{task.description:<44.44}", markup=False), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(), TextColumn("{task.fields[each]}"),
            console=Console(stderr=True),
        )  # fmt: skip

    def __enter__(self) -> Progress:
        self.began = perf_counter()
        self.task = self.bar.add_task("starting", total=None, each="")
        self.bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: object, trace: TracebackType | None) -> None:
        self.bar.stop()

    def say(self, what: str) -> None:
        """Say what is being done."""
        self.bar.update(self.task, description=legible(what))

    def note(self, sentence: str) -> None:
        """A line that stays."""
        self.bar.console.print(sentence, highlight=False)

    def start(self, missing: int, total: int, what: str = "") -> None:
        """From now on count to `total`, of which some may be `missing` only."""
        self.counted, self.since = 0, perf_counter()
        self.told, self.missing = self.since, missing
        what = what or "starting workers (the first run compiles: some 20 s more)"
        self.bar.reset(self.task, total=total, completed=total - missing, description=what, each="")

    def done(self, what: str, status: str = "ok", reason: str = "") -> None:
        """One more is done."""
        if status != "ok":
            why = f" ({reason})" if status not in ("unsupported", "ok") else ""
            self.bar.console.print(f"  {what}: {status}{why}", style="yellow", highlight=False)
        self.counted += 1
        now = perf_counter()
        each = (now - self.since) / self.counted
        if not self.bar.console.is_terminal and now - self.told > QUIET:
            self.told = now
            self.note(f"{what}: {self.counted} of {self.missing}, {each:.2g} s each")
        self.bar.update(self.task, description=what, advance=1, each=f"{each:.2g} s each")

    @property
    def seconds(self) -> float:
        """Since the start."""
        return perf_counter() - self.began


def print_summary(report: Report, page: str) -> None:
    """Medians over the scenarios at their middle step, the finding, and where the page is."""
    console = Console()
    title = "Largest error, median over the scenarios, each at the middle of its dt ladder; lower is better"
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("engine", no_wrap=True)
    for column in overview.SUMMARY.values():
        table.add_column(column.title.replace(" ", "\n"), justify="right", no_wrap=True)
    names = overview.names_of(report.comparisons)
    for name, cells in overview.summary(report.comparisons, names, report.untrusted).items():
        table.add_row(name, *(cell.text for cell in cells))
    console.print(table)
    for sentence in report.findings:
        console.print(sentence, highlight=False)
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
