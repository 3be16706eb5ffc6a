"""What a person sees in the terminal: progress while cells are played, and the summary after."""

from __future__ import annotations

from time import perf_counter
from types import TracebackType

import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Table

from reports.findings import at_middle_step
from reports.report import Report

SUMMARY = {  # metric: heading
    "position_max_radii": "position\nradii",
    "velocity_rms": "velocity\nm/s",
    "momentum_error": "momentum\nrelative",
    "energy_error": "energy\nrelative",
    "restitution_error": "restit.\n",
}


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

    def done(self, what: str, status: str) -> None:
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
    for heading in ("engine", *SUMMARY.values(), "wrong\nhits", "failed\ncells"):
        table.add_column(heading, justify="left" if heading == "engine" else "right", no_wrap=True)
    columns = {metric: at_middle_step(report.comparisons, metric) for metric in SUMMARY if metric not in VERSUS_TRUTH}
    columns |= {metric: at_middle_step(report.comparisons, metric, "truth") for metric in VERSUS_TRUTH}
    wrong = [at_middle_step(report.comparisons, f"collisions_{kind}", "truth") for kind in ("missed", "invented")]
    for name in report.runs.assign(name=report.runs.engine + ":" + report.runs.profile).name.unique():
        cells = [_median(columns[metric], name) for metric in SUMMARY]
        hits = sum(int(frame[name].sum()) for frame in wrong if name in frame)
        failed = report.runs[(report.runs.engine + ":" + report.runs.profile == name) & (report.runs.status != "ok")]
        table.add_row(name, *cells, str(hits) if not wrong[0].empty else "-", str(len(failed)))
    console.print(table)
    for sentence in report.findings:
        console.print(sentence, highlight=False)
    console.print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)


VERSUS_TRUTH = ("position_max_radii", "velocity_rms")


def _median(frame: pd.DataFrame, name: str) -> str:
    if name not in frame or frame[name].isna().all():
        return "-"
    median = frame[name].median()
    return f"{median:.2g}" if median == 0 or median >= 1e-3 else f"{median:.0e}"
