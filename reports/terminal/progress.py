"""Progress in the terminal: a bar while something runs, a line now and then in a log."""

from __future__ import annotations

from time import perf_counter
from types import TracebackType

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar

from reports.terminal.console import Console
from reports.terminal.foreign_text import legible

QUIET = 30.0  # s between two lines where there is no terminal that a bar could be drawn on


class Progress:
    """A bar that says what runs, how long one takes and how long all will; in a log, a line now and
    then."""

    def __init__(self) -> None:
        self.bar = Bar(
            TextColumn("{task.description:<44.44}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[each]}"),
            console=Console(stderr=True),
        )

    def __enter__(self) -> Progress:
        self.began = perf_counter()
        self.task = self.bar.add_task("starting", total=None, each="")
        self.bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: object, trace: TracebackType | None
    ) -> None:
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
        self.reported, self.missing = self.since, missing
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
        if not self.bar.console.is_terminal and now - self.reported > QUIET:
            self.reported = now
            self.note(f"{what}: {self.counted} of {self.missing}, {each:.2g} s each")
        self.bar.update(self.task, description=what, advance=1, each=f"{each:.2g} s each")

    @property
    def seconds(self) -> float:
        """Since the start."""
        return perf_counter() - self.began
