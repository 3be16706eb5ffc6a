"""Where a run goes: into OUT.part while it lasts, which takes the place of OUT when all is done."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from reports.archive import FILES, Archive
from reports.exits import unbroken
from reports.journal import JOURNAL, Busy, Journal

OF_A_RUN = FILES.__contains__, "no run of crosscheck made"


class FolderTaken(Exception):
    """An output folder that may not be written to, and why."""


def part_of(out: Path) -> Path:
    """Where a run into `out` is while it lasts."""
    return out.parent / f"{out.name}.part"


def open_part(out: Path, ours: Callable[[str], bool], strangers: str) -> Journal:
    """The journal of what will be `out`, where that is while it is made; raises as `may_write`, or `OSError`."""
    part = part_of(out)
    for folder in (out, part):
        may_write(folder, ours, strangers)
    part.mkdir(parents=True, exist_ok=True)
    return held(part, out)


@contextmanager
def given_back(journal: Journal) -> Iterator[None]:
    """Give the journal back as it is if what is first done with it fails."""
    try:
        yield
    except BaseException:
        journal.__exit__()
        raise


def open_new(out: Path) -> Journal:
    """The journal of a new run into `out`; raises `FolderTaken`, or `OSError` where nothing can be written."""
    journal = open_part(out, *OF_A_RUN)
    part = journal.path.parent
    with given_back(journal):
        if had := ended_in(journal):
            raise FolderTaken(
                f"{part} holds an interrupted run, in which {had} cells have ended: to go on with it, crosscheck run "
                f"--resume {out}; to begin anew, name another --out, or delete it"
            )
        os.truncate(journal.path, 0)
    return journal


def ended_in(journal: Journal) -> int:
    """How many cells have ended in an interrupted run; raises `FolderTaken` if it is none, or cannot be read."""
    part = journal.path.parent
    try:
        return len(Archive.read(part).records)
    except ValueError as fault:
        if len(journal.path.read_bytes().splitlines()) <= 1:  # nothing, or a header
            return 0
        raise FolderTaken(
            f"{part} holds what is no run that can be gone on with ({fault}); name another --out"
        ) from None


def may_go_on(part: Path, had: int, fits: bool, resume: bool) -> None:
    """Raise `FolderTaken` where `had` results of an interrupted command would be lost: not asked for, or none fits."""
    holds = f"{part} holds {had} results of an interrupted run"
    if had and not resume:
        raise FolderTaken(
            f"{holds}: to go on with it, ask again with --resume; to begin anew, name another --out, or delete it"
        )
    if had and not fits:
        raise FolderTaken(
            f"{holds} of something else: other scenes or cases, a scene file that has changed, with or without --full, "
            "or other versions; name another --out, or delete it"
        )


def open_again(out: Path) -> Journal:
    """The journal of a run into `out` that is to be completed; raises as `open_new`, `ValueError` if there is none."""
    part = part_of(out)
    if not (part / JOURNAL).is_file():
        if not (out / JOURNAL).is_file():
            raise FolderTaken(f"--resume {out}: no run is there, neither finished nor interrupted ({part.name})")
        Archive.read(out)
        may_write(out, *OF_A_RUN)
        held(out, out).__exit__()
        out.rename(part)
    return held(part, out)


def held(folder: Path, out: Path) -> Journal:
    """The journal of a folder, locked; raises `FolderTaken` if another process has it."""
    try:
        return Journal(folder)
    except Busy:
        raise FolderTaken(f"{out} is being written by another crosscheck; wait for it, or name another --out") from None


def digest_of(path: str) -> str:
    """What tells whether a scene file is still the same; "" if it cannot be read."""
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return ""


def found(out: Path) -> Path:
    """The folder of a run into `out`: itself, or where it is while it lasts; raises `FolderTaken` if there is none."""
    for folder in (out, part_of(out)):
        if (folder / JOURNAL).is_file():
            return folder
    raise FolderTaken(f"{out}: has no {JOURNAL}, so it is not the folder of a run")


def replace_folder(made: Path, target: Path) -> None:
    """Put the finished folder `made` in the place of `target` in two renames; `target` is a run of ours or absent."""
    old = target.with_name(f".{target.name}.old-{os.getpid()}")
    with unbroken():
        if target.exists():
            target.rename(old)
        made.rename(target)
        shutil.rmtree(old, ignore_errors=True)


def may_write(target: Path, ours: Callable[[str], bool], strangers: str, option: str = "--out") -> None:
    """Raise `FolderTaken` unless `target`, named by `option`, is absent, empty, or holds only names that are `ours`.

    Every command has its own files; of any other it is said that they are `strangers`, as the end of a sentence.
    """
    if target == Path.cwd() or target in Path.cwd().parents:
        raise FolderTaken(f"{option} {target}: is where you are, or above it; name another folder, or go elsewhere")
    if target.is_file():
        raise FolderTaken(f"{option} {target}: is a file; name a folder that does not exist yet")
    strange = sorted(path.name for path in target.iterdir() if not ours(path.name)) if target.exists() else []
    if strange:
        raise FolderTaken(f"{option} {target}: holds {strange[0]}, which {strangers}; name another folder")
