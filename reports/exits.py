"""How a command ends: its exit status, and what it says on standard error."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import NoReturn

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def refuse(faults: Sequence[str]) -> NoReturn:
    """Say what is wrong, one line each, and exit 2."""
    for fault in faults:
        say(fault)
    sys.exit(BAD_INPUT)


def say(line: str) -> None:
    """One line on standard error, as it is."""
    print(line, file=sys.stderr)
