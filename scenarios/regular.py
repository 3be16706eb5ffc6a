"""Opens regular files only: reading a pipe may block, and a device may have no end."""

from __future__ import annotations

import os
import stat
from errno import EINVAL
from pathlib import Path
from typing import BinaryIO


def opened(path: str | Path) -> BinaryIO:
    """The file, opened for reading bytes; raises `OSError` if that fails, or if it is a pipe or a
    device."""
    file = open(path, "rb", opener=_without_waiting)  # noqa: SIM115 - which the caller closes
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return file
    file.close()
    raise OSError(EINVAL, "is a pipe or a device", str(path))


def all_of(path: str | Path) -> bytes:
    """All bytes of the file; raises as `opened`."""
    with opened(path) as file:
        return file.read()


def _without_waiting(path: str, flags: int) -> int:
    """Opens as `open` does, but does not wait for a writer of a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))  # Windows has no such pipes
