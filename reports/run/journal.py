"""The journal of a command: a line of JSON for each task that ends. One process at a time writes
it; any process may read it.

The first key of a line is its kind. The last, `sum`, is a digest of the text before it, so that a
line that was torn or edited is noticed.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from crosscheck2d.adapters.system import BINARY, lock
from crosscheck2d.reports.run.cells import digest
from crosscheck2d.scenarios.regular import opened

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
        text = written(line)
        before = os.fstat(self.file).st_size
        try:
            while text:
                text = text[os.write(self.file, text) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self.file, before)
            raise


def written(line: Mapping[str, Any]) -> bytes:
    """A line as it stands in a journal, with its `sum`."""
    text = json.dumps(plain(line), allow_nan=False).removesuffix("}").encode()
    return text + end_of(text)


def end_of(text: bytes) -> bytes:
    """The end of the line that begins with this text."""
    return f', "sum": "{digest(text)}"}}\n'.encode()


END = len(end_of(b""))


def lines_of(
    folder: Path, kinds: Mapping[str, Collection[str]]
) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Number, kind and content of each line of a folder's journal, the header first. An incomplete
    last line is left out.

    kinds: kind -> the names that such a line has, itself or in its first value.

    Raises:
        ValueError: a line is not what was written, or another version has written it; says which
            line, and what to do.
    """
    with opened(folder / JOURNAL) as journal:
        for number, line in enumerate(journal, start=1):
            if not line.endswith(b"\n"):
                return
            text = line[:-END]
            if line != text + end_of(text):
                without_sum = number == 1 and parsed(line).keys() == {"header"}
                raise (of_another_version if without_sum else unusable)(folder, number)
            content = parsed(text + b"}")
            kind, value = next(iter(content.items()), ("", None))
            if number == 1 and kind != "header":
                raise unusable(folder, number)
            names = {*content, *(value if isinstance(value, dict) else ())}
            if kind not in kinds or not names.issuperset(kinds[kind]):
                raise of_another_version(folder, number)
            yield number, kind, content


def parsed(line: bytes) -> dict[str, Any]:
    """The table in a line of JSON; an empty one if there is none."""
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):  # the last is raised by deeply nested brackets
        return {}
    return content if isinstance(content, dict) else {}


def of_another_version(folder: Path, number: int) -> ValueError:
    """That another version has written a line."""
    return ValueError(
        f"{folder / JOURNAL}: line {number}: was written by another version of crosscheck; run it"
        " again"
    )


def unusable(folder: Path, number: int, why: str = "is not what was written") -> ValueError:
    """That a line cannot be used, why, and what to do."""
    remedy = (
        "delete that line, and --resume plays again what it was of"
        if number > 1
        else "without it the plan is not known: run it again"
    )
    return ValueError(f"{folder / JOURNAL}: line {number}: {why}; {remedy}")


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
