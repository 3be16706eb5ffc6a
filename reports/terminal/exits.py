"""How a command prints and ends: its exit status, its messages on standard error, streams that may
be closed or full, and signals."""

from __future__ import annotations

import io
import os
import shutil
import signal
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import EPIPE
from pathlib import Path
from typing import Any, NoReturn

from crosscheck2d.reports.terminal.foreign_text import legible

DONE, FAILED, BAD_INPUT, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143
STATUS = {signal.SIGINT: INTERRUPTED, signal.SIGTERM: TERMINATED}


class FolderTaken(Exception):
    """An output folder or file may not be written to; says why."""


class Unusable(ValueError):
    """A file of a run does not fit the others; says which, why, and what to do."""


_status = DONE  # the exit status of the first signal that came


def stop(number: int, _: object) -> NoReturn:
    """The handler of Ctrl-C and of SIGTERM, with which a batch system or a shutdown ends a
    command."""
    global _status
    _status = _status or STATUS[signal.Signals(number)]
    raise KeyboardInterrupt


def signal_status() -> int:
    """The exit status of the signal that stops this command; 0 if none has come."""
    return _status


@contextmanager
def ends_on_signals() -> Iterator[None]:
    """Context of a whole command: a signal ends it with status 130 or 143, without waiting for
    threads. An ignored signal stays ignored, as in a shell's background job."""
    before = {number: signal.getsignal(number) for number in STATUS}
    for number in STATUS:
        if before[number] is not signal.SIG_IGN:
            signal.signal(number, stop)
    status: str | int | None = DONE
    try:
        yield
    except SystemExit as end:
        status = end.code
    except KeyboardInterrupt:
        status = INTERRUPTED
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if _status else handler)
    if not _status:
        sys.exit(status)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    # Typer makes 130 of any KeyboardInterrupt.
    os._exit(_status if status == INTERRUPTED or not isinstance(status, int) else status)


@contextmanager
def keeping(out: Path, kept: Callable[[], str]) -> Iterator[None]:
    """Context for long work that writes into `out`: if it is interrupted, or the disk is full, it
    prints what is `kept`.

    Exits 130 after a signal, 1 if something cannot or may no longer be written, 2 if what is there
    cannot be used.
    """
    try:
        yield
    except KeyboardInterrupt:
        say(f"\nInterrupted. {kept()}")
        sys.exit(INTERRUPTED)
    except FolderTaken as fault:
        say(f"{fault}. {kept()}")
        sys.exit(FAILED)
    except OSError as fault:
        say(f"cannot write to {fault.filename or out}: {fault.strerror or fault}. {kept()}")
        sys.exit(FAILED)
    except Unusable as fault:
        say(f"{fault}. {kept()}")
        sys.exit(BAD_INPUT)


class Outlet(io.FileIO):
    """A file descriptor whose writes never fail: after the first `fault` data is dropped, so that
    the work goes on."""

    fault: OSError | None = None

    def write(self, data: Any) -> int | None:  # type: ignore[override]
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
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # closed: else the next file would get its number, and be printed into
            os.set_inheritable(os.open(os.devnull, os.O_RDONLY), True)
    outlets = []
    for number, name in ((1, "stdout"), (2, "stderr")):
        before, outlet = getattr(sys, name), Outlet(number, "w", closefd=False)
        stream = io.TextIOWrapper(
            io.BufferedWriter(outlet),
            encoding=before.encoding if before is not None else "utf-8",
            errors="backslashreplace",
            line_buffering=number == 2 or outlet.isatty(),
        )
        setattr(sys, name, stream)
        outlets.append(outlet)
    try:
        yield
    except SystemExit as end:
        sys.stdout.flush()
        fault = outlets[0].fault
        if fault is None or fault.errno == EPIPE:  # as of `crosscheck list | head`
            raise
        say(
            f"cannot write to standard output: {fault.strerror}; not all was printed, but every"
            " file is written"
        )
        sys.exit(FAILED if end.code in (None, DONE) else end.code)


def refuse(faults: str | Sequence[str]) -> NoReturn:
    """Print the faults, one line each, and exit 2."""
    for fault in [faults] if isinstance(faults, str) else faults:
        say(fault)
    sys.exit(BAD_INPUT)


def say(line: str) -> None:
    """One line on standard error. On a terminal it is folded between words; a longer word, as a
    path, stays whole."""
    text = legible(line)
    if sys.stderr.isatty():
        fold = textwrap.TextWrapper(
            shutil.get_terminal_size().columns, break_long_words=False, break_on_hyphens=False
        )
        text = "\n".join(map(fold.fill, text.split("\n")))
    print(text, file=sys.stderr)
