"""Text that others wrote (names of files, scenes, messages of engines), as a terminal and a file
can hold it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from adapters.own_solver.file import printable


def legible(text: str) -> str:
    """The text with what would act on a terminal (escape codes, bytes that are no UTF-8) as it is
    written in code.

    Line ends stay, as sentences of this program hold some.
    """
    return "\n".join(map(printable, text.split("\n")))


def encoded(text: str) -> bytes:
    """UTF-8; what that cannot hold, the bytes of a path that are none, as `\\udcff`."""
    return text.encode(errors="backslashreplace")


def put_text(path: Path, text: str) -> None:
    """Write a file, `encoded`, whole or not at all; raises `OSError`."""
    put_bytes(path, encoded(text))


def put_bytes(path: Path, data: bytes) -> None:
    """Write a file as `whole` does; a pipe or a device is written to as it comes. Raises
    `OSError`."""
    # asked before links are followed: /dev/stdout leads to no path at all
    if path.exists() and not path.is_file():
        path.write_bytes(data)
        return
    with whole(path.resolve()) as file:
        file.write(data)


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """A file to write to that takes the place of `path` when all of it is written; raises
    `OSError`."""
    part = path.with_name(f".crosscheck-{os.getpid()}.part")
    try:
        with part.open("xb") as file:
            yield file
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def is_part(path: Path) -> bool:
    """Whether it is what `whole` leaves where it was killed."""
    return re.fullmatch(r"\.crosscheck-\d+\.part", path.name) is not None
