"""The journal of a run: a line of JSON for each task that ends. One process at a time writes it;
any process may read it."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from adapters.system import BINARY, lock
from scenarios.regular import opened

JOURNAL = "journal.jsonl"
CLOSED = -1


class Busy(Exception):
    """Another process is writing the journal."""


class Journal:
    """The journal of a folder, open for writing and locked against every other writer.

    The operating system releases the lock when the process ends, however it ends, so no lock is
    ever stale.
    """

    def __init__(self, folder: Path) -> None:
        """Open or create it; an incomplete last line is cut off. Raises `Busy`, or `OSError` if it
        cannot be opened."""
        self.open_in(folder)

    def open_in(self, folder: Path) -> None:
        """Open it in a folder; raises as `__init__`."""
        self.path = folder / JOURNAL
        self.file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | BINARY, 0o644)
        try:
            lock(self.file)
            moved = not self.path.exists() or not os.path.samestat(
                os.fstat(self.file), self.path.stat()
            )
        except BlockingIOError:
            moved = True
        if moved:  # by the process that held the lock, when it had finished
            self.close()
            raise Busy
        whole = self.path.read_bytes()
        os.ftruncate(self.file, whole.rfind(b"\n") + 1)

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close it if it is open: Windows cannot move a folder that contains an open file."""
        if self.file != CLOSED:
            os.close(self.file)
            self.file = CLOSED

    def append(self, line: dict[str, Any]) -> None:
        """Append a line and flush it. If that fails, raises `OSError` and leaves no part of the
        line."""
        text = (json.dumps(plain(line), allow_nan=False) + "\n").encode()
        before = os.fstat(self.file).st_size
        try:
            while text:
                text = text[os.write(self.file, text) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self.file, before)
            raise


def lines_of(folder: Path, missed: str = "delete that line") -> Iterator[Any]:
    """The lines of a folder's journal without an incomplete last line.

    Raises:
        ValueError: another line is not JSON; names it, and adds `missed`, which says what to do.
    """
    with opened(folder / JOURNAL) as journal:
        for number, line in enumerate(journal, start=1):
            try:
                yield json.loads(line.decode())  # because null bytes would be read as UTF-32
            except (ValueError, RecursionError) as error:  # raised by deeply nested brackets
                if line.endswith(b"\n"):
                    raise ValueError(
                        f"{folder / JOURNAL}: line {number}: is not JSON: {error}; {missed}"
                    ) from error


def plain(value: Any) -> Any:
    """The value in a form that strict JSON can hold: numpy scalars as Python's, numbers that are
    not finite as text."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def numbers(value: Any) -> Any:
    """The inverse of `plain`: "nan", "inf" and "-inf" become numbers again, at any depth."""
    if isinstance(value, dict):
        return {key: numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [numbers(item) for item in value]
    return float(value) if value in ("nan", "inf", "-inf") else value
