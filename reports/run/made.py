"""The record of the files that a command wrote into a folder, so that no other file is ever
replaced.

A folder that a command makes holds `made.json`: the command, whether it has finished, and for each
file the SHA-256 of what was written, or null while it is being written. Files with names that only
this program uses are not recorded. Every other file in the folder or below it is foreign.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from crosscheck2d.reports.run.journal import JOURNAL
from crosscheck2d.reports.terminal.exits import FolderTaken
from crosscheck2d.reports.terminal.foreign_text import encoded, is_part, put_text

MADE = "made.json"
HEAD = 4096  # bytes at the start of a file in which its mark is searched


class FolderKind(NamedTuple):
    """A kind of result folder.

    Attributes:
        command: the command that makes it.
        named: pattern of the relative paths that only this program uses; these files are not
            recorded.
        folders: the folders in it.
    """

    command: str
    named: str = r"(?!)"
    folders: tuple[str, ...] = ()

    def names(self, path: str) -> bool:
        """Whether the name alone of a file with this relative path shows that it is ours."""
        return re.fullmatch(self.named, path) is not None


class Made(NamedTuple):
    """made.json.

    Attributes:
        command: that made the folder.
        finished: whether the command has written everything.
        files: path -> SHA-256, None while it is written.
        out: name of the folder that this one will replace; "" once it has.
    """

    command: str
    finished: bool
    files: dict[str, str | None]
    out: str = ""


def read_made(folder: Path) -> Made | None:
    """The record of a folder; None if there is no usable one."""
    path = folder / MADE
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            return None
        made = Made(**json.loads(path.read_bytes()))
    except (
        OSError,
        ValueError,
        TypeError,
        RecursionError,
    ):  # the last is raised by deeply nested brackets
        return None
    types = {"command": str, "finished": bool, "files": dict, "out": str}
    return (
        made if all(isinstance(getattr(made, name), kind) for name, kind in types.items()) else None
    )


def put_made(folder: Path, made: Made) -> None:
    """Write the record of a folder atomically."""
    put_text(folder / MADE, json.dumps(made._asdict(), indent=1) + "\n")


def foreign_file_in(folder: Path, kind: FolderKind) -> str:
    """What in a folder the command did not make, as the rest of a sentence; "" if there is nothing
    foreign.

    Raises:
        OSError: something cannot be read.
    """
    made = read_made(folder)
    if made is None:
        inside = sorted(path.name for path in folder.iterdir() if not is_begun(path))
        return (
            f"holds {inside[0]}, and no {MADE} says that {kind.command} made it" if inside else ""
        )
    if made.command != kind.command:
        return f"was made by {made.command}, not by {kind.command}"
    for path in files_below(folder, kind.folders):
        name = path.relative_to(folder).as_posix()
        mode = path.lstat().st_mode
        if not stat.S_ISREG(mode) or not (
            name == MADE or is_part(path) or kind.names(name) or name in made.files
        ):
            return f"holds {name}, which {kind.command} did not make"
        if not as_written(path, made.files.get(name)):
            return f"holds {name}, which is not as {kind.command} left it"
    return ""


def is_begun(path: Path) -> bool:
    """Whether it is an empty journal, which is created before the record."""
    about = path.lstat()
    return path.name == JOURNAL and stat.S_ISREG(about.st_mode) and not about.st_size


def files_below(folder: Path, folders: Sequence[str]) -> Iterator[Path]:
    """All entries of a folder except `folders`, and all entries of those, sorted by name; links are
    not followed."""
    for path in sorted(folder.iterdir()):
        if path.name in folders and stat.S_ISDIR(path.lstat().st_mode):
            yield from files_below(path, ())
        else:
            yield path


def as_written(path: Path, digest: str | None) -> bool:
    """Whether a file has the recorded digest; True if none was recorded."""
    return digest is None or digest == digest_of(path)


def digest_of(path: str | Path) -> str:
    """SHA-256 of a file, 64 hex digits; "" if it cannot be read or is not a regular file."""
    with suppress(OSError, ValueError):
        if Path(path).is_file():
            with Path(path).open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
    return ""


@contextmanager
def writing(folder: Path, names: Sequence[str]) -> Iterator[None]:
    """Context in which the files of these names are written: they count as this program's even if
    it is interrupted.

    A folder without a record gets none.

    Raises:
        FolderTaken: one of them exists and is not as this program left it.
    """
    made = read_made(folder)
    if made is None:
        yield
        return
    for name in names:
        path = folder / name
        if os.path.lexists(path) and (path.is_symlink() or name not in made.files):
            raise FolderTaken(
                f"{folder}: holds {name}, which {made.command} did not make; {MOVE_IT}"
            )
        if path.exists() and not as_written(path, made.files[name]):
            raise FolderTaken(
                f"{folder}: holds {name}, which is not as {made.command} left it; {MOVE_IT}"
            )
    put_made(folder, made._replace(files=made.files | dict.fromkeys(names)))
    try:
        yield
    finally:  # also after a refusal, which has written nothing: the record is then unchanged
        written: dict[str, str | None] = {
            name: digest_of(folder / name) for name in names if (folder / name).exists()
        }
        put_made(folder, made._replace(files=made.files | written))


MOVE_IT = "move it to another folder, or delete it"


def may_write(target: Path, kind: FolderKind, option: str = "--out") -> None:
    """Raise `FolderTaken` unless `target`, the value of `option`, is absent, empty, or made by the
    same command alone.

    `OSError` if it cannot be looked into.
    """
    if target == Path.cwd() or target in Path.cwd().parents:
        raise FolderTaken(
            f"{option} {target}: is the current folder, or above it; name another folder, or go"
            " elsewhere"
        )
    if not os.path.lexists(target):
        return
    if target.is_symlink():
        raise FolderTaken(f"{option} {target}: is a link; name a folder")
    if not target.is_dir():
        raise FolderTaken(f"{option} {target}: is a file; name a folder that does not exist yet")
    if os.path.ismount(target):
        raise FolderTaken(f"{option} {target}: is a mount point, which stays; name a folder in it")
    if foreign := foreign_file_in(target, kind):
        raise FolderTaken(
            f"{option} {target}: {foreign}; name another folder, or move it elsewhere"
        )


def may_replace(target: Path, kind: FolderKind, option: str = "--out") -> None:
    """Raise as `may_write`, and also if `target` holds an interrupted result, so that no finished
    part is lost."""
    may_write(target, kind, option)
    made = read_made(target)
    if made is not None and not made.finished:
        whose = target.name.removesuffix(".part")
        hint = (
            f"to go on with it, name {target.with_name(whose)} to --resume"
            if whose != target.name
            else "delete it"
        )
        raise FolderTaken(f"{option} {target}: holds what {kind.command} has not finished; {hint}")


def sealed(text: str) -> str:
    """The text of a page or of XML with a comment at its end, a digest that shows `may_overwrite`
    whether it was changed."""
    return f"{text}<!-- as it was written: sha256 {hashlib.sha256(encoded(text)).hexdigest()} -->\n"


def is_sealed(data: bytes) -> bool:
    """Whether a file has the bytes that `sealed` gave."""
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
