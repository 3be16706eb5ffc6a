"""Results as rows of one SQLite file: a row is there wholly or not at all, and one that was edited
or damaged is noticed."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import EACCES, EIO, ENOSPC, EROFS
from os import strerror
from pathlib import Path
from typing import Any, NamedTuple

FORMAT = 1  # of the file; another one is refused
TABLE = """create table if not exists results
    (kind text, key text, value text, blob blob, digest text, primary key (kind, key))"""
BUSY_TIMEOUT = 5.0  # s to wait for another process that writes at this moment
ERRNO = {
    sqlite3.SQLITE_FULL: ENOSPC,
    sqlite3.SQLITE_READONLY: EROFS,
    sqlite3.SQLITE_CANTOPEN: EACCES,
    sqlite3.SQLITE_PERM: EACCES,
    sqlite3.SQLITE_IOERR: EIO,
}
NO_LOCKS = (
    sqlite3.SQLITE_IOERR_LOCK,
    sqlite3.SQLITE_IOERR_RDLOCK,
    sqlite3.SQLITE_IOERR_UNLOCK,
    sqlite3.SQLITE_PROTOCOL,
    sqlite3.SQLITE_NOLFS,
)


class Damaged(ValueError):
    """The file is none of ours, or is damaged; says which, and what to do."""


class Row(NamedTuple):
    """What is stored under a kind and a key: a value of JSON, and bytes."""

    value: Any
    blob: bytes
    digest: str


class Rows:
    """An open file of rows; `writing` also makes it. A kind is a word such as "cell"; a key is a
    hash of all that decides the row. All of it raises `Damaged` or `OSError`."""

    def __init__(self, path: Path, writing: bool = True) -> None:
        self.path = path
        with self.faults():
            self.file = sqlite3.connect(
                f"{path.absolute().as_uri()}?mode={'rwc' if writing else 'rw'}",
                timeout=BUSY_TIMEOUT,
                isolation_level=None,
                uri=True,
            )
            try:
                self.begin(writing)
            except BaseException:
                self.file.close()
                raise

    def begin(self, writing: bool) -> None:
        # No wait for the disk (15 ms a row): a process that is killed loses nothing all the same.
        # After a power failure the file may be damaged, which is noticed.
        self.file.execute("pragma synchronous=off")
        [(version,)] = self.file.execute("pragma user_version")
        [(tables,)] = self.file.execute("select count(*) from sqlite_master")
        if version != FORMAT and (version or tables):
            raise Damaged(
                f"{self.path}: was written by another version of crosscheck, or by another program;"
                " delete it, or name another folder"
            )
        if writing and not version:
            self.file.execute("begin immediate")
            self.file.execute(TABLE)
            self.file.execute(f"pragma user_version={FORMAT}")
            self.file.execute("commit")

    @contextmanager
    def faults(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as fault:
            code = getattr(fault, "sqlite_errorcode", sqlite3.SQLITE_ERROR)
            path = str(self.path)
            if code in NO_LOCKS:
                raise OSError(EIO, "the file system cannot lock files", path) from None
            if code & 0xFF in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
                raise OSError(EACCES, "another program has locked it", path) from None
            if number := ERRNO.get(code & 0xFF):
                raise OSError(number, strerror(number), path) from None
            raise Damaged(
                f"{path}: is damaged ({fault}); delete it, or name another folder"
            ) from None

    def put(self, kind: str, key: str, value: Any, blob: bytes = b"", again: bool = True) -> str:
        """Unless `again`, a row that is there stays. Returns the digest of what was written."""
        text = json.dumps(value, default=lambda scalar: scalar.item())  # numpy's
        row = (kind, key, text, blob, digest_of(kind, key, text, blob))
        with self.faults():
            self.file.execute(
                f"insert or {'replace' if again else 'ignore'} into results values (?, ?, ?, ?, ?)",
                row,
            )
        return row[-1]

    def get(self, kind: str, key: str, warn: Callable[[str], None] | None = None) -> Row | None:
        """The row; None if there is none, or if it is not what was written, of which `warn` is
        told."""
        with self.faults():
            rows = self.file.execute(
                "select value, blob, digest from results where kind = ? and key = ?", [kind, key]
            ).fetchall()
        for text, blob, digest in rows:
            try:
                if digest == digest_of(kind, key, text, blob):
                    return Row(json.loads(text), blob, digest)
            except (TypeError, AttributeError, UnicodeError, ValueError):
                pass  # edited to another type
            if warn is not None:
                warn(f"{self.path}: {kind} {key} is not what was written: it is made again")
        return None

    def keys(self, kind: str) -> list[str]:
        """In the order in which they were written."""
        with self.faults():
            return [
                str(key)
                for (key,) in self.file.execute(
                    "select key from results where kind = ? order by rowid", [kind]
                )
            ]

    def delete(self, kind: str, key: str) -> None:
        with self.faults():
            self.file.execute("delete from results where kind = ? and key = ?", [kind, key])

    def close(self) -> None:
        self.file.close()


def digest_of(*parts: str | bytes) -> str:
    """32 hex digits of a hash over all parts."""
    hashed = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        hashed.update(len(data).to_bytes(8, "big") + data)
    return hashed.hexdigest()[:32]
