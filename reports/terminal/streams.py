"""The standard streams as a command can rely on them: they may be closed, on a full disk, or know
few letters."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from reports.terminal.exits import DONE, FAILED, say


class Outlet(io.FileIO):
    """A file descriptor that takes all it is given: what fails to be written is dropped, for the
    work goes on.

    Attributes:
        fault: the first that was met, or None; after it nothing more is tried.
    """

    fault: OSError | None = None

    def write(self, data: Any) -> int | None:  # type: ignore[override]
        """Write it, or drop it."""
        if self.fault is None:
            try:
                return super().write(data)
            except OSError as fault:
                self.fault = fault
        return memoryview(data).nbytes


@contextmanager
def printing() -> Iterator[None]:
    """Within it nothing that a command prints ends it: letters that a stream does not know are
    written in code.

    Exits 1, and says why, if standard output did not take all; what fails on standard error has
    nowhere to be reported.
    """
    fill_gaps()
    outlet = open_stream("stdout", 1)
    open_stream("stderr", 2)
    try:
        yield
    except SystemExit as end:
        sys.stdout.flush()
        if outlet.fault is None:
            raise
        say(
            f"cannot write to standard output: {outlet.fault.strerror}; not all was printed, but"
            " every file is written"
        )
        sys.exit(FAILED if end.code in (None, DONE) else end.code)


def fill_gaps() -> None:
    """Put something that nothing can be written to, and that is at its end, where a stream was
    closed.

    The next file that is opened would have its number else, and would be printed into.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDONLY), True)


def open_stream(name: str, number: int) -> Outlet:
    """Make `sys.stdout` or `sys.stderr` print through an `Outlet`, in the encoding that it has."""
    before = getattr(sys, name)
    outlet = Outlet(number, "w", closefd=False)
    stream = io.TextIOWrapper(
        io.BufferedWriter(outlet),
        encoding=before.encoding if before is not None else "utf-8",
        errors="backslashreplace",
        line_buffering=name == "stderr" or outlet.isatty(),
    )
    setattr(sys, name, stream)
    return outlet
