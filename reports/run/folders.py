"""The folder of a run: OUT.part during the run; it replaces OUT when the run is complete."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from crosscheck2d.reports.run.archive import Archive
from crosscheck2d.reports.run.journal import JOURNAL, Busy, Journal
from crosscheck2d.reports.run.made import (
    MADE,
    FolderKind,
    Made,
    foreign_file_in,
    may_replace,
    may_write,
    put_made,
    read_made,
)
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import FolderTaken, deferring_signals

RUN = FolderKind(
    "crosscheck run",
    r"journal\.jsonl|trajectories/[0-9a-f]{16}\.npz|compared/([a-z0-9_-]+-[0-9a-f]{16}\.(npz|csv)|deviations\.digest)",
    ("trajectories", "scenes", "compared"),
)


def part_of(out: Path) -> Path:
    """The folder into which a run with `--out OUT` writes until it is complete."""
    return out.parent / f"{out.name}.part"


def place_of(out: Path, option: str = "--out") -> Path:
    """The folder that `out` names, with links resolved.

    Raises:
        FolderTaken: `out` is a dangling link that no interrupted command left.
        OSError: the current folder is gone.
    """
    # Path.resolve raises RuntimeError, not OSError, for a link to itself
    place = Path(os.path.realpath(out))
    if out.is_symlink() and not out.exists() and not part_of(place).exists():
        raise FolderTaken(f"{option} {out}: is a link to nothing; name a folder")
    return place


def open_part(out: Path, kind: FolderKind) -> Journal:
    """Open the journal of `out` in its OUT.part; raises as `may_replace`, or `OSError`."""
    part = part_of(out)
    may_replace(out, kind)
    may_be_part(part, out, kind)
    part.mkdir(parents=True, exist_ok=True)
    journal = held(part, out)
    with given_back(journal):
        begun(part, kind, out)
    return journal


def may_be_part(part: Path, out: Path, kind: FolderKind, option: str = "--out") -> None:
    """Raise as `may_write`, and also if `part` holds a finished result."""
    may_write(part, kind, option)
    if not is_interrupted(part, out):
        raise FolderTaken(
            f"{option} {out}: {part} is for unfinished results, but holds a finished one; move it"
            " elsewhere, or name another folder"
        )


def is_interrupted(part: Path, out: Path) -> bool:
    """Whether `part` holds an unfinished `out`, and not a finished result of `--out OUT.part`.

    A command killed after its last result, but before `part` replaced `out`, is unfinished: its
    record still names `out`.
    """
    made = read_made(part)
    return made is None or not made.finished or made.out == out.name


def begun(part: Path, kind: FolderKind, out: Path) -> None:
    """Record in `part` which command makes it, that it will replace `out`, and that it is not
    finished. Other records stay."""
    made = read_made(part) or Made(kind.command, False, {})
    if (anew := made._replace(finished=False, out=out.name)) != made or not (part / MADE).exists():
        put_made(part, anew)


@contextmanager
def given_back(journal: Journal) -> Iterator[None]:
    """Context that closes the journal unchanged if the block fails."""
    try:
        yield
    except BaseException:
        journal.__exit__()
        raise


def open_new(out: Path) -> Journal:
    """The journal of a new run into `out`; raises `FolderTaken`, or `OSError` where nothing can be
    written."""
    journal = open_part(out, RUN)
    part = journal.path.parent
    with given_back(journal):
        if had := ended_in(journal):
            raise FolderTaken(
                f"{part} holds an interrupted run with {counted(had, 'finished cell')}: to go on"
                f" with it, crosscheck run --resume {out}; to begin anew, name another --out, or"
                " delete it"
            )
        os.truncate(journal.path, 0)
    return journal


def ended_in(journal: Journal) -> int:
    """How many cells have ended in an interrupted run; raises `FolderTaken` if the folder holds no
    run that can be read."""
    part = journal.path.parent
    try:
        return len(Archive.read(part).records)
    except ValueError as fault:
        if len(journal.path.read_bytes().splitlines()) <= 1:  # no line, or only a header
            return 0
        raise FolderTaken(
            f"{part} holds something that cannot be continued as a run ({fault}); name another"
            " --out"
        ) from None


def may_go_on(part: Path, had: int, fits: bool, resume: bool) -> None:
    """Raise `FolderTaken` if `had` results of an interrupted command would be lost: without
    --resume, or if none fits."""
    holds = f"{part} holds {had} results of an interrupted run"
    if had and not resume:
        raise FolderTaken(
            f"{holds}: to go on with it, ask again with --resume; to begin anew, name another"
            " --out, or delete it"
        )
    if had and not fits:
        raise FolderTaken(
            f"{holds} of something else: other scenes or cases, a scene file that has changed, with"
            " or without --full, or other versions; name another --out, or delete it"
        )


def open_again(out: Path) -> Journal:
    """Open and lock the journal of a run into `out`, to complete the run; nothing is moved yet.

    Raises:
        FolderTaken: there is no run, another process writes to it, or the folder holds other files.
        OSError: the journal cannot be opened.
    """
    part = part_of(out)
    may_be_part(part, out, RUN, "--resume")
    may_replace(out, RUN, "--resume")
    if (part / JOURNAL).is_file():
        return held(part, out)
    if not (out / JOURNAL).is_file():
        raise FolderTaken(
            f"--resume {out}: no run is there, neither finished nor interrupted ({part.name})"
        )
    return held(out, out)


def reopened(journal: Journal, out: Path) -> None:
    """Rename a finished run to OUT.part, so that it can be completed. The journal is closed
    meanwhile; raises `FolderTaken` if another process locks it then."""
    part = part_of(out)
    if journal.path.parent == out:
        with deferring_signals():
            journal.close()
            out.rename(part)
            try:
                journal.open_in(part)
            except Busy:
                raise FolderTaken(f"{out} is being written by another crosscheck") from None
    begun(part, RUN, out)


def held(folder: Path, out: Path) -> Journal:
    """Open and lock the journal of a folder; raises `FolderTaken` if another process holds the
    lock."""
    try:
        return Journal(folder)
    except Busy:
        raise FolderTaken(
            f"{out} is being written by another crosscheck; wait for it, or name another --out"
        ) from None


def found(out: Path) -> Path:
    """The folder of a run into `out`: OUT, or OUT.part if the run is not complete. Raises
    `FolderTaken` if there is none."""
    part = part_of(out)
    if (out / JOURNAL).is_file():
        return out
    if (part / JOURNAL).is_file() and is_interrupted(part, out):
        return part
    raise FolderTaken(f"{out}: has no {JOURNAL}, so it is not the folder of a run")


def replace_folder(made: Path, target: Path, kind: FolderKind) -> None:
    """Replace `target` by the finished folder `made`; the old `target` is kept until that is done.

    Raises:
        FolderTaken: `target` holds files that the command did not make; both folders stay.
        OSError: the folder cannot be moved; `target` stays.
    """
    may_replace(target, kind)
    record = read_made(made)
    assert record is not None
    with deferring_signals():
        put_made(made, record._replace(finished=True, out=target.name))
        old = next(
            old
            for k in count()
            if not os.path.lexists(old := target.with_name(f"{target.name}.old{k or ''}"))
        )
        replaced = target.exists()
        if replaced:
            target.rename(old)
        try:
            made.rename(target)
        except OSError:
            if replaced:
                old.rename(target)
            raise
        put_made(target, record._replace(finished=True, out=""))
        if replaced:
            shutil.rmtree(old, ignore_errors=True)


@contextmanager
def made_anew(target: Path, kind: FolderKind, option: str) -> Iterator[Path]:
    """Context that makes a folder beside `target`. The folder replaces `target` at the end of the
    block, or is deleted if the block fails.

    Raises:
        FolderTaken: as `may_replace`, before and after the block.
        OSError: the folder cannot be made.
    """
    may_replace(target, kind, option)
    part = target.with_name(f"{target.name}.part-{os.getpid()}")
    part.mkdir(parents=True)
    try:
        begun(part, kind, target)
        yield part
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    try:
        replace_folder(part, target, kind)
    except FolderTaken as fault:
        raise FolderTaken(f"{fault}; what was made is in {part}") from None


def discard(part: Path, kind: FolderKind) -> None:
    """Delete an unneeded folder, unless it holds files of another origin."""
    if not foreign_file_in(part, kind):
        shutil.rmtree(part)
