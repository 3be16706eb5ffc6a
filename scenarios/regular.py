"""Opens regular files only: reading a pipe may block, and a device may have no end."""

from __future__ import annotations

import os
import stat
from errno import EINVAL
from pathlib import Path
from typing import BinaryIO


def opened(path: str | Path) -> BinaryIO:
    """For reading bytes; raises `OSError` if that fails, or if it is a pipe or a device."""

    def without_waiting(path: str, flags: int) -> int:  # for a writer of a pipe
        return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))  # Windows has no such pipes

    file = open(path, "rb", opener=without_waiting)  # noqa: SIM115 - which the caller closes
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return file
    file.close()
    raise OSError(EINVAL, "is a pipe or a device", str(path))


def all_of(path: str | Path) -> bytes:
    with opened(path) as file:
        return file.read()
