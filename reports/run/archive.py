"""The files of a run, read back; everything is made from the journal and the trajectories.

journal.jsonl   a header, a line for each cell when it ends, a footer; a resumed run adds another
                header and footer; run_lines.py defines the lines
trajectories/   an .npz for each cell, with the fields of `Trajectory` as keys; of a failed cell up
                to its last good state. The line of the cell has the file's digest: a file that
                does not match it is not used
scenes/         copies of the scene files
machine.json    machine, versions, command, seed
made.json       which of these files the command wrote, so that no other file is replaced
compared/       the scenarios' exact answers and parts of deviations.csv, so that a report need not
                compute them again
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from adapters.run import Run
from reports.run.cells import digest
from reports.run.journal import JOURNAL
from reports.run.journal_lines import checked_lines, no_use
from reports.run.run_lines import KINDS
from reports.run.trajectories import load_trajectory
from scenarios.model import Trajectory
from scenarios.regular import all_of

# subject of a line -> its number, and the line
Numbered = dict[Hashable, tuple[int, dict[str, Any]]]


@dataclass(frozen=True)
class Archive:
    """The folder of one run, as read from its journal. If two lines are about the same thing, the
    later one counts.

    Attributes:
        folder: where it is.
        header: command, seed, machine, versions, and the request.
        records: the lines of the cells that ended, `as_found`.
        conformance: `engine:profile` -> its line.
        known_answers: the lines of the reproduced known answers.
        checked: solver's file, `PATH:own` -> its line with the verdict of `crosscheck check`.
        timings: key of a cell -> number of the timing (0; also 1 if timed twice) -> its line.
        overheads: (what, `engine:profile`, scenario or "") -> s in each round, see stepping.py.
        seconds: duration of the run; NaN if it is not complete.
        complete: whether everything requested has ended.
    """

    folder: Path
    header: dict[str, Any]
    records: list[dict[str, Any]]
    conformance: dict[str, dict[str, Any]]
    known_answers: list[dict[str, Any]]
    checked: dict[str, dict[str, Any]]
    timings: dict[str, dict[int, dict[str, Any]]]
    overheads: dict[tuple[str, str, str], list[float]]
    seconds: float
    complete: bool

    @staticmethod
    def read(folder: Path) -> Archive:
        """Read the journal of a folder, once; raises `ValueError`, naming the line, if it cannot be
        used."""
        header: dict[str, Any] = {}
        last: dict[str, Numbered] = {
            kind: {} for kind in ("cell", "conformance", "known_answer", "checked")
        }
        timings: dict[str, dict[int, dict[str, Any]]] = {}
        overheads: dict[tuple[str, str, str], list[float]] = {}
        seconds, complete = 0.0, False
        for number, kind, line in checked_lines(folder, KINDS):
            complete = kind == "footer"
            if complete:
                seconds += line["footer"]["seconds"]
            elif kind == "header":
                header = line["header"]
            elif kind == "timing":
                timings.setdefault(line["timing"], {})[line["copy"]] = line
            elif kind == "overhead":
                overheads[line["overhead"], line["of"], line["scenario"]] = line["cost"]
            else:
                last[kind][what_of(line) if kind == "cell" else line["of"]] = number, line
        if not header:
            raise ValueError(f"{folder / JOURNAL}: has no header, so nothing was played")
        for number, record in last["cell"].values():
            if fault := foreign_cell(record, header):
                raise ValueError(no_use(folder, number, fault, KINDS.missed))
        records, conformance, known, checked = (
            [line for _, line in last[kind].values()] for kind in last
        )
        records = [as_found(folder, record) for record in records]
        by_engine = {line["of"]: line for line in conformance}
        return Archive(
            folder,
            header,
            records,
            by_engine,
            known,
            {line["of"]: line for line in checked},
            timings,
            overheads,
            seconds if complete else float("nan"),
            complete,
        )


def what_of(record: dict[str, Any]) -> tuple[Any, ...]:
    """What identifies the cell of a line."""
    return tuple(record[name] for name in ("scene", "seed", "engine", "profile", "substeps"))


def foreign_cell(record: dict[str, Any], header: dict[str, Any]) -> str:
    """Why the line of a cell does not belong to its run; "" if it does."""
    name = f"{record['engine']}:{record['profile']}"
    if record["scene"] not in header["scenes"]:
        return f"scene = {record['scene']!r}: must be one of the scenes of the header"
    if name not in header["engines"]:
        return f"engine = {name!r}: must be one of the engines of the header"
    return (
        ""
        if record["seed"] == header["seed"]
        else f"seed = {record['seed']}: must be that of the header"
    )


def as_found(folder: Path, record: dict[str, Any]) -> dict[str, Any]:
    """The line of a cell with the key `damage`: why its trajectory cannot be used, or "". A damaged
    cell that was played has the status "error".

    The digest of a file is computed again only if the file changes.
    """
    path = trajectory_file(folder, record["cell"])
    why = f"{path.name} was never written" if record["status"] == "ok" else ""
    if record["file"]:
        try:
            found = path.stat()
            same = (
                digest_of_file(path, found.st_ino, found.st_size, found.st_mtime_ns)
                == record["file"]
            )
            why = "" if same else f"{path.name} is not what was written"
        except OSError as fault:
            gone = isinstance(fault, FileNotFoundError)
            why = f"{path.name} {'is missing' if gone else f'cannot be read: {fault.strerror}'}"
    failed = {"status": "error", "reason": why} if why and record["status"] == "ok" else {}
    return record | failed | {"damage": why}


@cache
def digest_of_file(path: Path, *_: int) -> str:
    """The digest of an existing file, cached by inode, size and time of change."""
    return digest(all_of(path))


def archived_run(folder: Path, record: dict[str, Any], with_trajectory: bool = True) -> Run:
    """The run of a line, with its trajectory if it has one and `with_trajectory` is set."""
    record = as_found(folder, record)
    trajectory = stored_trajectory(folder, record) if with_trajectory else None
    return Run(
        engine=record["engine"],
        profile=record["profile"],
        scenario=record["scenario"],
        dt=record["dt_s"],
        status=record["status"],
        reason=record["reason"],
        trajectory=trajectory,
        seconds=record["seconds"],
        settings={name: tuple(pair) for name, pair in record["settings"].items()},
        versions=record["versions"],
    )


def stored_trajectory(folder: Path, record: dict[str, Any]) -> Trajectory | None:
    """The stored samples of a cell, given its line from `as_found`; None if the file is missing or
    damaged."""
    whole = record["file"] and not record["damage"]
    return load_trajectory(trajectory_file(folder, record["cell"])) if whole else None


def trajectory_file(folder: Path, key: str) -> Path:
    """The path of the trajectory of the cell with this key."""
    return folder / "trajectories" / f"{key}.npz"


def stored_scene(folder: Path, name: str) -> Path:
    """The path of the copy of the scene file with this name."""
    return folder / "scenes" / f"{name}.toml"
