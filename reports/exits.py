"""How a command ends: its exit status, and what it says on standard error."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

DONE, FAILED, BAD_INPUT, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143


class Terminated(KeyboardInterrupt):
    """SIGTERM, as a batch system or a shutdown sends it: ends a command as Ctrl-C does."""


@contextmanager
def broken_off(part: Path, kept: Callable[[], str]) -> Iterator[None]:
    """What writes into `part` for long: broken off, or without room on the disk, it says what is `kept` of it.

    Exits 130 after Ctrl-C, 143 after SIGTERM, 1 if something cannot be written.
    """

    def terminate(*_: object) -> NoReturn:
        raise Terminated

    before = signal.signal(signal.SIGTERM, terminate)
    try:
        yield
    except Terminated:
        say(f"\nTerminated. {kept()}")
        sys.exit(TERMINATED)
    except KeyboardInterrupt:
        say(f"\nInterrupted. {kept()}")
        sys.exit(INTERRUPTED)
    except OSError as fault:
        say(f"cannot write to {part}: {fault.strerror or fault}. {kept()}")
        sys.exit(FAILED)
    finally:
        signal.signal(signal.SIGTERM, before)


def refuse(faults: Sequence[str]) -> NoReturn:
    """Say what is wrong, one line each, and exit 2."""
    for fault in faults:
        say(fault)
    sys.exit(BAD_INPUT)


def say(line: str) -> None:
    """One line on standard error, as it is."""
    print(line, file=sys.stderr)
