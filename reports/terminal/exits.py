"""How a command ends: its exit status, what it says on standard error, and that it does end when it
is signalled to."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from adapters.system import REPEATED, every, signals_wait
from reports.terminal.foreign_text import legible

DONE, FAILED, BAD_INPUT, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143
STATUS = {signal.SIGINT: INTERRUPTED, signal.SIGTERM: TERMINATED}
AGAIN = 1.0  # s between two times that a command is signalled


class Stopped(KeyboardInterrupt):
    """Ctrl-C, or SIGTERM as a batch system or a shutdown sends it: they end a command alike."""

    def __init__(self, status: int = INTERRUPTED) -> None:
        super().__init__()
        self.status = status


class FolderTaken(Exception):
    """An output folder, or file, that may not be written to, and why."""


class Unusable(ValueError):
    """A file of a run that does not fit the others: which, why, and what to do."""


class Listening:
    """The handler of both signals. `status`: of the first that came, 0 if none has."""

    def __init__(self) -> None:
        self.status = DONE

    def __call__(self, number: int, _: object) -> NoReturn:
        """Raise `Stopped`, and again every `AGAIN` s: what is raised in a destructor or a callback
        from C is lost."""
        self.status = self.status or STATUS.get(signal.Signals(number), INTERRUPTED)
        every(AGAIN)
        raise Stopped(self.status)


@contextmanager
def stoppable() -> Iterator[Listening]:
    """Within it Ctrl-C and SIGTERM raise `Stopped`; one within another changes nothing.

    SIGINT stays ignored where it is ignored, as in what a shell has put into the background.
    """
    before = {number: signal.getsignal(number) for number in (*STATUS, REPEATED)}
    outer = before[signal.SIGTERM]
    if isinstance(outer, Listening):
        yield outer
        return
    listening = Listening()
    for number in {*STATUS, REPEATED}:
        if before[number] is not signal.SIG_IGN:
            signal.signal(number, listening)
    try:
        yield listening
    finally:
        with deaf():
            pass
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def deaf() -> Iterator[None]:
    """Within it a command that is ending is not signalled again; the timer is off for good."""
    every(0)
    before = {number: signal.signal(number, signal.SIG_IGN) for number in STATUS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def unbroken() -> Iterator[None]:
    """What must not be left half done and takes no time: a signal that comes meanwhile is heard
    after it."""
    with signals_wait({*STATUS, REPEATED}):
        yield


@contextmanager
def ends_on_signals() -> Iterator[None]:
    """A command from its first word to its last; signalled to stop it exits with 130 or 143 and
    waits for no thread.

    What a thread still has under way is in another process, which ends with this one.
    """
    with stoppable() as listening:
        try:
            yield
            status: str | int | None = DONE
        except SystemExit as end:
            status = end.code
        except KeyboardInterrupt:
            status = INTERRUPTED
        with deaf():
            if not listening.status:
                sys.exit(status)
            for stream in (sys.stdout, sys.stderr):
                with suppress(OSError, ValueError):
                    stream.flush()
            # Typer makes 130 of any KeyboardInterrupt.
            os._exit(
                listening.status if status == INTERRUPTED or not isinstance(status, int) else status
            )


@contextmanager
def broken_off(part: Path, kept: Callable[[], str]) -> Iterator[None]:
    """What writes into `part` for long: broken off, or without room on the disk, it says what is
    `kept` of it.

    Exits 130 after Ctrl-C, 143 after SIGTERM, 1 if something cannot be written, or may not any
    more, 2 if what was kept before does not fit.
    """
    with stoppable():
        try:
            yield
        except KeyboardInterrupt as stopped:
            with deaf():
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
    """Say what is wrong, one line each, and exit 2."""
    for fault in faults:
        say(fault)
    sys.exit(BAD_INPUT)


def say(line: str) -> None:
    """One line on standard error."""
    print(legible(line), file=sys.stderr)
