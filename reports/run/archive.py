"""The files of a run, read back; everything is made from the journal and the trajectories.

journal.jsonl   a header, a line for each cell when it ends, a footer; a resumed run adds another
                header and footer; `LINES` has what a line holds
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

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run.cells import digest
from crosscheck2d.reports.run.journal import JOURNAL, lines_of, unusable
from crosscheck2d.reports.run.trajectories import load_trajectory
from crosscheck2d.scenarios.model import Trajectory
from crosscheck2d.scenarios.regular import all_of

LINES = {
    # the request, and the versions that played it
    "header": (
        *("command", "seed", "started", "versions", "machine"),
        *("scenes", "engines", "dts", "full", "timings", "folder", "names", "tasks"),
    ),
    # how a cell ended, as `keep_cell` of results.py writes it
    "cell": (
        *("scene_hash", "scene", "seed", "substeps", "scenario", "engine", "profile", "dt_s"),
        *("status", "reason", "step", "until_s", "seconds", "timeout_s", "outside", "file"),
        *("settings", "versions"),
    ),
    # the findings of the probes of an engine; a known answer, with the number computed here; the
    # verdict of `crosscheck check` on a solver's file
    "conformance": ("of", "key"),
    "known_answer": ("of", "key", "column", "dt_s", "published_J2", "made_by", "source", "ours_J2"),
    "checked": ("of", "key", "passed", "says", "shown"),
    # the cost of a cell in the first `timed_s` of its scenario, s per simulated second, a number
    # for each round; and the part spent in Python on wrapping disks at the edges
    "timing": ("copy", "timed_s", "cost", "wrapping"),
    # an overhead of an engine, as `stepping.overheads` times it, s, a number for each round
    "overhead": ("of", "scenario", "cost"),
    "footer": ("tasks", "played", "seconds"),
}
"""The kinds of lines of a run's journal -> what they hold."""
CELL = ("scene", "seed", "engine", "profile", "substeps")  # what identifies the cell of a line


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
        cells: dict[Hashable, tuple[int, dict[str, Any]]] = {}
        about: dict[str, dict[str, dict[str, Any]]] = {
            kind: {} for kind in ("conformance", "known_answer", "checked")
        }
        timings: dict[str, dict[int, dict[str, Any]]] = {}
        overheads: dict[tuple[str, str, str], list[float]] = {}
        seconds, complete = 0.0, False
        for number, kind, line in lines_of(folder, LINES):
            complete = kind == "footer"
            if complete:
                seconds += line["footer"]["seconds"]
            elif kind == "header":
                header = line["header"]
            elif kind == "cell":
                cells[tuple(line[name] for name in CELL)] = number, line
            elif kind == "timing":
                timings.setdefault(line["timing"], {})[line["copy"]] = line
            elif kind == "overhead":
                overheads[line["overhead"], line["of"], line["scenario"]] = line["cost"]
            else:
                about[kind][line["of"]] = line
        if not header:
            raise ValueError(f"{folder / JOURNAL}: has no header, so nothing was played")
        for number, record in cells.values():
            if not is_of_run(record, header):
                raise unusable(folder, number, "is of another run")
        return Archive(
            folder,
            header,
            [as_found(folder, record) for _, record in cells.values()],
            about["conformance"],
            list(about["known_answer"].values()),
            about["checked"],
            timings,
            overheads,
            seconds if complete else float("nan"),
            complete,
        )


def is_of_run(record: dict[str, Any], header: dict[str, Any]) -> bool:
    """Whether the line of a cell belongs to the run: somebody may have joined two journals."""
    return (
        record["scene"] in header["scenes"]
        and f"{record['engine']}:{record['profile']}" in header["engines"]
        and record["seed"] == header["seed"]
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
