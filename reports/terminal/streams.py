"""Makes the standard streams reliable: they may be closed, on a full disk, or have a small
character set."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from errno import EPIPE
from typing import Any

from crosscheck2d.reports.terminal.exits import DONE, FAILED, say


class Outlet(io.FileIO):
    """A file descriptor whose writes never fail: data that cannot be written is dropped, so that
    the work goes on.

    Attributes:
        fault: the first error, or None; nothing is written after it.
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
    """Context in which printing cannot end a command: characters that a stream lacks are escaped.

    Exits 1 with a message if standard output failed; a failure of standard error cannot be
    reported.
    """
    fill_gaps()
    outlet = open_stream("stdout", 1)
    open_stream("stderr", 2)
    try:
        yield
    except SystemExit as end:
        sys.stdout.flush()
        if outlet.fault is None or outlet.fault.errno == EPIPE:  # as of `crosscheck list | head`
            raise
        say(
            f"cannot write to standard output: {outlet.fault.strerror}; not all was printed, but"
            " every file is written"
        )
        sys.exit(FAILED if end.code in (None, DONE) else end.code)


def fill_gaps() -> None:
    """Replace each closed stream by an empty one that takes no output.

    Otherwise the next opened file would get its number, and be printed into.
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
