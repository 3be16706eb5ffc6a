"""What a person sees in the terminal: progress while cells are played, and the summary after."""

from __future__ import annotations

from time import perf_counter
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Table

from reports import overview
from reports.report import Report


class Progress:
    """A bar that says what runs and how long it will take."""

    def __init__(self) -> None:
        self.bar = Bar(
            TextColumn("{task.description:<44.44}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
            TextColumn("left"), TimeRemainingColumn(), console=Console(stderr=True),
        )  # fmt: skip
        self.failed = 0

    def __enter__(self) -> Progress:
        self.began = perf_counter()
        self.task = self.bar.add_task("starting", total=None)
        self.bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: object, trace: TracebackType | None) -> None:
        self.bar.stop()

    def say(self, what: str) -> None:
        """Say what is being done."""
        self.bar.update(self.task, description=what)

    def start(self, total: int) -> None:
        """From now on count to `total`."""
        self.bar.update(self.task, total=total, description="starting workers (the first run compiles: some 20 s more)")

    def more(self, count: int) -> None:
        """Count so many more."""
        self.bar.update(self.task, total=(self.bar.tasks[0].total or 0) + count)

    def done(self, what: str, status: str = "ok") -> None:
        """One more is done."""
        if status != "ok":
            self.bar.console.print(f"  {what}: {status}", style="yellow", highlight=False)
        self.bar.update(self.task, description=what, advance=1)

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
    console.print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)
