"""Text that others wrote (names of files, scenes, messages of engines), as a terminal and a file can hold it."""

from __future__ import annotations

import os
from pathlib import Path

from adapters.solver_file import printable


def legible(text: str) -> str:
    """The text with what would act on a terminal (escape codes, bytes that are no UTF-8) as it is written in code.

    Line ends stay, as sentences of this program hold some.
    """
    return "\n".join(map(printable, text.split("\n")))


def encoded(text: str) -> bytes:
    """UTF-8; what that cannot hold, the bytes of a path that are none, as `\\udcff`."""
    return text.encode(errors="backslashreplace")


def put_text(path: Path, text: str) -> None:
    """Write a file of a run, `encoded`, whole or not at all; raises `OSError`."""
    put_bytes(path, encoded(text))


def put_bytes(path: Path, data: bytes) -> None:
    """Write a file of a run whole or not at all, as a part would be taken for the whole; raises `OSError`."""
    new = path.with_name(f"{path.name}.new")
    try:
        new.write_bytes(data)
        os.replace(new, path)
    except OSError:
        new.unlink(missing_ok=True)
        raise
