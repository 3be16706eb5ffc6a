"""Files that a command writes outside a folder of results: a seal shows that such a file was not
changed, so that no file of another origin is ever replaced."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path

from crosscheck2d.reports.terminal.exits import FolderTaken
from crosscheck2d.reports.terminal.foreign_text import encoded

HEAD = 4096  # bytes at the start of a file in which its mark is searched


def digest_of(path: str | Path) -> str:
    """SHA-256 of a file, 64 hex digits; "" if it cannot be read or is not a regular file."""
    with suppress(OSError, ValueError):
        if Path(path).is_file():
            with Path(path).open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
    return ""


def sealed(text: str) -> str:
    """The text of a page or of XML with a comment at its end, a digest that shows `may_overwrite`
    whether it was changed."""
    return f"{text}<!-- as it was written: sha256 {hashlib.sha256(encoded(text)).hexdigest()} -->\n"


def is_sealed(data: bytes) -> bool:
    text, seal, _ = data.rpartition(b"<!-- as it was written: ")
    return bool(seal) and data == encoded(sealed(text.decode(errors="replace")))


def may_overwrite(path: Path, mark: bytes, what: str, option: str, seals: bool = True) -> None:
    """Raise `FolderTaken` unless the file `path` is absent, a pipe, a device, or one of ours; with
    `seals` it must also be unchanged.

    `OSError` if it cannot be looked into, or its folder is not there.
    """
    if path.is_symlink() and not path.exists():
        raise FolderTaken(f"{option} {path}: is a link to nothing; name another file")
    if path.is_file():
        with path.open("rb") as file:
            if mark not in file.read(HEAD):
                raise FolderTaken(f"{option} {path}: exists and is no {what}; name another file")
            file.seek(0)
            if seals and not is_sealed(file.read()):
                raise FolderTaken(
                    f"{option} {path}: is a {what} that was changed since; name another file, or"
                    " move it"
                )
    path.parent.stat()
