"""Makes foreign text (names of files and scenes, messages of engines) safe for a terminal and a
file."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from crosscheck2d.adapters.host.file import printable


def legible(text: str) -> str:
    """The text with escape codes and bytes that are not UTF-8 escaped, which would act on a
    terminal, and with what standard output cannot encode, which would be escaped after a table is
    laid out.

    Line ends stay, because messages of this program contain some.
    """
    safe = "\n".join(map(printable, text.split("\n")))
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    return safe.encode(encoding, "backslashreplace").decode(encoding)


def encoded(text: str) -> bytes:
    """The text in UTF-8; bytes of a path that are not UTF-8 become `\\udcff`."""
    return text.encode(errors="backslashreplace")


def put_text(path: Path, text: str) -> None:
    """Write a file, `encoded`, whole or not at all; a pipe or a device is written to directly.
    Raises `OSError`."""
    # tested before links are resolved: /dev/stdout resolves to no path
    if path.exists() and not path.is_file():
        path.write_bytes(encoded(text))
    else:
        put_whole(path.resolve(), encoded(text))


def put_whole(path: Path, data: bytes) -> None:
    """Write a file, which replaces `path` when it is complete; raises `OSError`."""
    part = path.with_name(f".crosscheck-{os.getpid()}.part")
    try:
        with part.open("xb") as file:
            file.write(data)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
