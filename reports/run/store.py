"""The folder of a command's results: its rows in one SQLite file, and the files that are made from
them. What has a row is not done again.

results.sqlite   the rows, each with a key: a hash of all that decides it
other files      exports, written whole and renamed; the digest of each is a row, so that no file of
                 another origin is ever overwritten or deleted
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from crosscheck2d.adapters.system import BINARY, lock
from crosscheck2d.reports.terminal.exits import FolderTaken, say
from crosscheck2d.reports.terminal.foreign_text import encoded, put_whole
from crosscheck2d.scenarios.regular import all_of
from crosscheck2d.scenarios.rows import Row, Rows, digest_of

FILE, LOCK = "results.sqlite", ".crosscheck.lock"
OWN = re.compile(
    rf"{re.escape(FILE)}(-journal)?|{re.escape(LOCK)}|\.crosscheck-\d+(-export)?\.part"
)
OLD = "journal.jsonl"  # of versions before the store
EXPORT = "export"  # the kind of the row of a file: the digests that it may have
MOVE_IT = "move it to another folder, or delete it"
MOVE_OR_NAME = "name another folder, or move it elsewhere"
OF_OLD_FORMAT = (
    f"was made by an earlier version of crosscheck, which kept {OLD}; name another folder, or"
    " delete it"
)

_locks: set[int] = set()  # open files of this process; a fork must not hold its locks


class Store:
    """The rows of a folder. Use `writing` or `reading` to open one.

    Attributes:
        fresh: whether rows that were there before are ignored.
    """

    def __init__(self, folder: Path, rows: Rows, fresh: bool = False) -> None:
        self.folder, self.rows, self.fresh = folder, rows, fresh
        self.written: set[tuple[str, str]] = set()
        self.warned: set[tuple[str, str]] = set()

    def put(self, kind: str, key: str, value: Any, blob: bytes = b"") -> Row:
        """Write a row, or replace it: it is there wholly or not at all. Raises `OSError`."""
        digest = self.rows.put(kind, key, value, blob)
        self.written.add((kind, key))
        return Row(value, blob, digest)

    def get(self, kind: str, key: str) -> Row | None:
        """The row that the task with this key need not make again; None if there is none. One that
        is damaged is named once. Raises `OSError` or `Damaged`."""
        if self.fresh and (kind, key) not in self.written:
            return None

        def warn(sentence: str) -> None:
            if (kind, key) not in self.warned:
                say(sentence)
            self.warned.add((kind, key))

        return self.rows.get(kind, key, warn)

    def export(self, name: str, data: str | bytes) -> None:
        """Write a file of the folder, whole or not at all.

        Raises:
            FolderTaken: there is a file that was not written here, or was changed since.
            OSError: it cannot be written.
        """
        path = self.folder / name
        data = encoded(data) if isinstance(data, str) else data
        digest = digest_of(data)
        if path.is_symlink() or (os.path.lexists(path) and not self.is_ours(name)):
            raise FolderTaken(f"{path}: {changed(path)}; {MOVE_IT}")
        before = [digest_of(all_of(path))] if path.exists() else []
        if before == [digest]:
            return
        self.rows.put(EXPORT, name, [*before, digest])
        path.parent.mkdir(exist_ok=True)
        put_whole(path, data)

    @contextmanager
    def exporting(self, name: str) -> Iterator[Path]:
        """Context with a path to write to, whose file becomes the export at its end."""
        part = self.folder / f".crosscheck-{os.getpid()}-export.part"
        try:
            yield part
            self.export(name, part.read_bytes())
        finally:
            part.unlink(missing_ok=True)

    def is_ours(self, name: str) -> bool:
        """Whether a file has bytes that were exported under its name."""
        row = self.rows.get(EXPORT, name)
        try:
            return row is not None and digest_of(all_of(self.folder / name)) in row.value
        except OSError:
            return False

    def delete_exports(self, folder: str, used: Collection[str]) -> None:
        """Delete the exports in a folder below this one that are not `used`, but those that were
        changed since."""
        names = [name for name in self.rows.keys(EXPORT) if name.startswith(f"{folder}/")]
        unused = [name for name in names if name not in used]
        for name in unused:
            if self.is_ours(name):
                (self.folder / name).unlink()
        if not used:
            with suppress(OSError):  # it is not there, or somebody has put something into it
                (self.folder / folder).rmdir()
        for name in unused:
            self.rows.delete(EXPORT, name)

    def refuse_foreign(self, option: str) -> None:
        """Raise `FolderTaken` if the folder holds anything but the rows and their exports."""
        exports = set(self.rows.keys(EXPORT))
        folders = {name.partition("/")[0] for name in exports if "/" in name}
        paths: list[Path] = []
        for path in sorted(self.folder.iterdir()):
            below = path.name in folders and path.is_dir() and not path.is_symlink()
            paths += sorted(path.iterdir()) if below else [path]
        for path in paths:
            name = path.relative_to(self.folder).as_posix()
            if OWN.fullmatch(path.name):
                if path.suffix == ".part":  # of a command that was killed
                    path.unlink()
            elif name not in exports or not self.is_ours(name):
                why = changed(path) if name in exports else "crosscheck did not make"
                raise FolderTaken(
                    f"{option}{self.folder}: holds {name}, which {why}; {MOVE_OR_NAME}"
                )


def changed(path: Path) -> str:
    """Why a file may not be overwritten."""
    return "is a link" if path.is_symlink() else "is not as crosscheck left it"


def is_usable(row: Row, timeout: float) -> bool:
    """Whether a task with this row need not be done again: unless it was stopped at a shorter time
    limit than `timeout` s, or failed for a reason outside the engine."""
    late = row.value.get("status") == "timeout" and row.value["timeout_s"] < timeout
    return not (late or row.value.get("outside"))


@contextmanager
def writing(
    out: Path, command: str, fresh: bool = False, option: str = "--out "
) -> Iterator[Store]:
    """Context of the only process that writes into the folder `out` for `command`, which makes it.

    Raises:
        FolderTaken: the folder is used by another process, or holds something else.
        Damaged: the file of its rows is damaged.
        OSError: it cannot be made, written or locked.
    """
    folder = place_of(out, option)
    if folder.exists() and not (folder / FILE).exists():
        names = sorted(path.name for path in folder.iterdir())
        if inside := [name for name in names if not OWN.fullmatch(name)]:
            what = f"holds {inside[0]}, which crosscheck did not make; {MOVE_OR_NAME}"
            raise FolderTaken(f"{option}{folder}: {OF_OLD_FORMAT if OLD in inside else what}")
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder, option), closing(Rows(folder / FILE)) as rows:
        made_by = rows.get("folder", "command")
        if made_by is None:
            rows.put("folder", "command", command)
        elif made_by.value != command:
            raise FolderTaken(
                f"{option}{out}: was made by {made_by.value}, not by {command}; name another folder"
            )
        store = Store(folder, rows, fresh)
        store.refuse_foreign(option)
        yield store


@contextmanager
def reading(folder: Path, command: str) -> Iterator[Store]:
    """Context in which the rows of `command` in a folder are read, while another process may write;
    raises as `writing`."""
    missing = f"{folder}: has no {FILE} of {command}, so it is not the folder of one"
    if not (folder / FILE).is_file():
        old = (folder / OLD).exists()
        raise FolderTaken(f"{folder}: {OF_OLD_FORMAT}" if old else missing)
    with closing(Rows(folder / FILE, writing=False)) as rows:
        made_by = rows.get("folder", "command")
        if made_by is None or made_by.value != command:
            raise FolderTaken(missing)
        yield Store(folder, rows)


def place_of(out: Path, option: str = "--out ") -> Path:
    """The folder that `out` names, with links resolved; raises `FolderTaken` unless results may go
    into it, or it can be made."""
    # Path.resolve raises RuntimeError, not OSError, for a link to itself
    if out.is_symlink() and not out.exists():
        raise FolderTaken(f"{option}{out}: is a link to nothing; name a folder")
    folder = Path(os.path.realpath(out))
    if folder == Path.cwd() or folder in Path.cwd().parents:
        raise FolderTaken(
            f"{option}{folder}: is the current folder, or above it; name another folder, or go"
            " elsewhere"
        )
    if folder.exists() and not folder.is_dir():
        raise FolderTaken(f"{option}{folder}: is a file; name a folder that does not exist yet")
    return folder


@contextmanager
def locked(folder: Path, option: str) -> Iterator[None]:
    """Context in which no other process writes into the folder. The lock ends with the process."""
    file = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | BINARY, 0o644)
    _locks.add(file)
    try:
        try:
            lock(file)
        except BlockingIOError:
            raise FolderTaken(
                f"{option}{folder} is being written by another crosscheck; wait for it, or name"
                " another folder"
            ) from None
        yield
    finally:
        _locks.discard(file)
        with suppress(OSError):
            os.close(file)


def _close_locks() -> None:
    """In a fork: the lock is its parent's alone."""
    for file in _locks:
        with suppress(OSError):
            os.close(file)
    _locks.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_close_locks)
