"""Progress: one changing line on a terminal, an occasional line in a log."""

from __future__ import annotations

from datetime import timedelta
from time import perf_counter
from types import TracebackType

from rich.progress import Progress as Bar
from rich.progress import ProgressColumn, Task
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.foreign_text import legible

QUIET = 30.0  # s between two lines if there is no terminal
BAR, WIDE = 10, 80  # columns of the bar; and of a terminal that has room for it


class OneLine(ProgressColumn):
    """What runs, a bar, and numbers, in one line; words that do not fit are left out."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self.console = console

    def render(self, task: Task) -> Table:
        numbers, bar, width = clock(task.elapsed), list[ProgressBar](), self.console.width
        if task.total and not task.finished:
            count = f"{task.completed:.0f}/{task.total:.0f}  {clock(task.time_remaining)} left"
            numbers = "  ".join(filter(None, (count, task.fields["each"], numbers)))
            if width >= WIDE:
                bar = [ProgressBar(total=task.total, completed=task.completed, width=BAR)]
        room = width - len(numbers) - (BAR + 4 if bar else 2)
        what = legible(task.description).replace("\n", " ")
        if len(what) > room:
            what = what[: max(room, 0) + 1].rpartition(" ")[0].rstrip()
        line = Table.grid(padding=(0, 2, 0, 0))
        line.add_row(Text(what), *bar, Text(numbers, "progress.remaining"))
        return line


def clock(seconds: float | None) -> str:
    """A time as 0:01:05; -:--:-- if it is not known yet."""
    return "-:--:--" if seconds is None else str(timedelta(seconds=int(seconds)))


class Progress:
    """Shows what runs, the time per task and the time left: on a terminal in a line that disappears
    at the end, in a log occasionally."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        self.live = console.is_interactive
        self.bar = Bar(
            OneLine(console), console=console, transient=True, expand=True, disable=not self.live
        )

    def __enter__(self) -> Progress:
        self.began = perf_counter()
        self.begin("starting")
        self.bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: object, trace: TracebackType | None
    ) -> None:
        self.bar.stop()

    def begin(self, what: str, total: int | None = None, completed: int = 0) -> None:
        """Replace the line by a new one, with its clocks at 0."""
        for task in self.bar.task_ids:
            self.bar.remove_task(task)
        self.task = self.bar.add_task(what, total=total, completed=completed, each="")

    def say(self, what: str) -> None:
        if self.bar.finished:
            self.begin(what)
        self.bar.update(self.task, description=what)

    def note(self, sentence: str) -> None:
        self.bar.console.print(sentence, highlight=False)

    def start(self, missing: int, total: int, what: str = "") -> None:
        """From now on count to `total`, of which only `missing` are still to do."""
        self.counted, self.since = 0, perf_counter()
        self.reported, self.missing = self.since, missing
        what = what or "starting workers (the first run compiles: some 40 s more)"
        self.begin(what, total, total - missing)

    def done(self, what: str, status: str = "ok", reason: str = "") -> None:
        """One more is done. The refusals of cells are told together at the end of a run."""
        if status not in ("ok", "unsupported"):
            self.bar.console.print(
                f"  {what}: {status} ({reason})", style="yellow", highlight=False
            )
        self.counted += 1
        now = perf_counter()
        each = (now - self.since) / self.counted
        if not self.live and now - self.reported > QUIET:
            self.reported = now
            self.note(f"{what}: {self.counted} of {self.missing}, {each:.2g} s each")
        self.bar.update(self.task, description=what, advance=1, each=f"{each:.2g} s each")

    @property
    def seconds(self) -> float:
        return perf_counter() - self.began
