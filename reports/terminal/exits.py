"""How a command ends: its exit status, its messages on standard error, and its reaction to
signals."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from crosscheck2d.adapters.system import REPEATED, every, signals_wait
from crosscheck2d.reports.terminal.foreign_text import legible

DONE, FAILED, BAD_INPUT, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143
STATUS = {signal.SIGINT: INTERRUPTED, signal.SIGTERM: TERMINATED}
AGAIN = 1.0  # s between two repetitions of a signal


class Stopped(KeyboardInterrupt):
    """Ctrl-C, or SIGTERM from a batch system or a shutdown: both end a command in the same way."""

    def __init__(self, status: int = INTERRUPTED) -> None:
        super().__init__()
        self.status = status


class FolderTaken(Exception):
    """An output folder or file may not be written to; says why."""


class Unusable(ValueError):
    """A file of a run does not fit the others; says which, why, and what to do."""


class SignalHandler:
    """The handler of both signals. `status`: of the first that came, 0 if none has."""

    def __init__(self) -> None:
        self.status = DONE

    def __call__(self, number: int, _: object) -> NoReturn:
        """Raise `Stopped`, and again every `AGAIN` s, because an exception in a destructor or a
        callback from C is lost."""
        self.status = self.status or STATUS.get(signal.Signals(number), INTERRUPTED)
        every(AGAIN)
        raise Stopped(self.status)


@contextmanager
def stoppable() -> Iterator[SignalHandler]:
    """Context in which Ctrl-C and SIGTERM raise `Stopped`; nesting changes nothing.

    An ignored SIGINT stays ignored, as in a shell's background job.
    """
    before = {number: signal.getsignal(number) for number in (*STATUS, REPEATED)}
    outer = before[signal.SIGTERM]
    if isinstance(outer, SignalHandler):
        yield outer
        return
    signals = SignalHandler()
    for number in {*STATUS, REPEATED}:
        if before[number] is not signal.SIG_IGN:
            signal.signal(number, signals)
    try:
        yield signals
    finally:
        with ignoring_signals():
            pass
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def ignoring_signals() -> Iterator[None]:
    """Context in which an ending command ignores both signals; the timer stays off afterwards."""
    every(0)
    before = {number: signal.signal(number, signal.SIG_IGN) for number in STATUS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def deferring_signals() -> Iterator[None]:
    """Context for short work that must not be interrupted: a signal is handled after it."""
    with signals_wait({*STATUS, REPEATED}):
        yield


@contextmanager
def ends_on_signals() -> Iterator[None]:
    """Context of a whole command: a signal ends it with status 130 or 143, without waiting for
    threads.

    The work of a thread is in another process, which ends with this one.
    """
    with stoppable() as signals:
        try:
            yield
            status: str | int | None = DONE
        except SystemExit as end:
            status = end.code
        except KeyboardInterrupt:
            status = INTERRUPTED
        with ignoring_signals():
            if not signals.status:
                sys.exit(status)
            for stream in (sys.stdout, sys.stderr):
                with suppress(OSError, ValueError):
                    stream.flush()
            # Typer makes 130 of any KeyboardInterrupt.
            os._exit(
                signals.status if status == INTERRUPTED or not isinstance(status, int) else status
            )


@contextmanager
def broken_off(part: Path, kept: Callable[[], str]) -> Iterator[None]:
    """Context for long work that writes into `part`: if it is interrupted, or the disk is full, it
    prints what is `kept`.

    Exits 130 after Ctrl-C, 143 after SIGTERM, 1 if something cannot or may no longer be written, 2
    if earlier files do not fit.
    """
    with stoppable():
        try:
            yield
        except KeyboardInterrupt as stopped:
            with ignoring_signals():
                status = stopped.status if isinstance(stopped, Stopped) else INTERRUPTED
                say(f"\n{'Terminated' if status == TERMINATED else 'Interrupted'}. {kept()}")
                sys.exit(status)
        except FolderTaken as fault:
            say(f"{fault}. {kept()}")
            sys.exit(FAILED)
        except OSError as fault:
            say(f"cannot write to {part}: {fault.strerror or fault}. {kept()}")
            sys.exit(FAILED)
        except Unusable as fault:
            say(f"{fault}. {kept()}")
            sys.exit(BAD_INPUT)


def refuse(faults: Sequence[str]) -> NoReturn:
    """Print the faults, one line each, and exit 2."""
    for fault in faults:
        say(fault)
    sys.exit(BAD_INPUT)


def say(line: str) -> None:
    """One line on standard error; on a terminal it is folded between words."""
    text = legible(line)
    if sys.stderr.isatty():
        width = shutil.get_terminal_size().columns
        text = "\n".join(folded(part, width) for part in text.split("\n"))
    print(text, file=sys.stderr)


def folded(line: str, width: int) -> str:
    """The line in lines of at most so many columns; a longer word, as a path, stays whole."""
    return textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False)
