"""The scene table is the part of deviations.csv for one scene. A worker makes it when the last cell
of the scene has ended.

It takes two tasks: the first computes the exact answer, within the time that a cell may take; the
second compares all runs of the scene with it. Both results are kept in files. If there is no
answer, or none in time, the table says why, and the other scenes go on.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.against import TRUTH
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.compare.table import status_row, table_of
from crosscheck2d.reports.compare.view import NOT_JUDGED
from crosscheck2d.reports.run.answers import (
    ExactAnswer,
    answer_here,
    no_answer,
    put_answer,
    read_answer,
)
from crosscheck2d.reports.run.archive import Archive, archived_run, as_found
from crosscheck2d.reports.run.cells import Cell, digest, versions
from crosscheck2d.reports.run.scenes import Records, scenario_of
from crosscheck2d.reports.run.worker_process import Failure, allow
from crosscheck2d.reports.terminal.foreign_text import put_bytes
from crosscheck2d.scenarios.regular import all_of

# The source that decides the numbers of a scene table; the patterns reach into subfolders.
JUDGE_SOURCE = ("reports/compare/**/*.py", "scenarios/**/*.py")
ROOT = Path(__file__).parents[2]
ANSWER = ".npz"  # the suffix of an answer's file
# columns of deviations.csv in which an empty field is NaN
NUMBERS = ("dt_s", "value", "at_s", "bound")
PATHS = "surrogateescape"  # keeps the path of a solver whose name is not UTF-8
# s that the comparison of a scene may take: all 38 of the default run take 30, on two cores
COMPARING = 300.0
Task = tuple[Path, Callable[[], Any]]  # its result's file, and what a worker calls


class SceneTasks:
    """The two tasks of each scene, its exact answer and its table, which start when all cells of
    the scene have ended.

    Attributes:
        unkept: scene -> its table, if the file of a trajectory is missing or damaged: such a table
            is not kept, because another copy of the file would change it.
        failed: scene -> why it could not be compared.
    """

    def __init__(
        self, archive: Archive, missing: Iterable[Cell], timeout: float, warn: Callable[[str], None]
    ) -> None:
        """`timeout`: s that an exact answer may take; an answer stopped at a shorter limit is
        computed again. `warn` is called with a sentence for each damaged file."""
        self.warn = warn
        self.folder, self.engines, self.timeout = archive.folder, archive.header["engines"], timeout
        self.missing = Counter(cell.scene for cell in missing)
        self.records: dict[str, dict[tuple[str, int], dict[str, Any]]] = {}
        self.scenes: dict[Path, str] = {}  # the scene of each task that was started
        self.done: set[Path] = set()  # those of these tasks that have ended
        self.unkept: dict[str, bytes] = {}
        self.failed: dict[str, Failure] = {}
        for record in archive.records:
            self.put(record)

    def put(self, record: dict[str, Any]) -> None:
        """Add the line of a cell; a later line of the same cell replaces an earlier one."""
        self.records.setdefault(record["scene"], {})[name_of(record), record["substeps"]] = record

    def tasks(self) -> Iterator[Task]:
        """The next task of every scene whose cells have all ended."""
        for scene in self.records:
            yield from self.next_task(scene)

    def cell_ended(self, record: dict[str, Any]) -> Iterator[Task]:
        """The next task of the scene of a cell that has just ended."""
        self.put(record)
        self.missing[record["scene"]] -= 1
        yield from self.next_task(record["scene"])

    def next_task(self, scene: str) -> Iterator[Task]:
        """When all cells of a scene have ended: first its answer, then its table, each once."""
        if self.missing[scene]:
            return
        records = in_order(self.records[scene].values(), self.engines)
        asked = answer_file(self.folder, records)
        answer = read_answer(asked)
        if answer is None and asked not in self.scenes and os.path.lexists(asked):
            self.warn(f"{asked.name} is not what was written: that exact answer is computed again")
        if asked not in self.scenes and (answer is None or answer.worth_another_try(self.timeout)):
            self.scenes[asked] = scene
            yield asked, partial(answer_here, self.folder, records)
        elif answer is not None and not is_kept(
            path := scene_table_file(self.folder, records, answer)
        ):
            self.scenes[path] = scene
            yield path, partial(scene_table_of, self.folder, records, asked)

    @property
    def playing(self) -> bool:
        """Whether any cell has not ended yet."""
        return any(self.missing.values())

    @property
    def asked(self) -> list[str]:
        """The scenes whose exact answer is being computed, or is about to be."""
        return [
            scene
            for path, scene in self.scenes.items()
            if path.suffix == ANSWER and path not in self.done
        ]

    def task_ended(self, path: Path, result: Any) -> Iterator[Task]:
        """Keep the result of a task, and return the next task of its scene."""
        scene = self.scenes[path]
        self.done.add(path)
        if path.suffix == ANSWER:
            delete_unless_file(path)
            put_answer(
                path, no_answer(result, self.timeout) if isinstance(result, Failure) else result
            )
            yield from self.next_task(scene)
        elif isinstance(result, Failure):
            self.failed[scene] = result
        elif result.damaged:
            self.unkept[scene] = result.csv
        else:
            delete_unless_file(path)
            keep_scene_table(path, result.csv)


def delete_unless_file(path: Path) -> None:
    """Delete a pipe or a link at the path of an answer or a scene table, so that nothing is written
    into it."""
    if path.is_symlink() or (path.exists() and not path.is_file()):
        path.unlink()


def in_order(records: Iterable[dict[str, Any]], engines: Sequence[str]) -> list[dict[str, Any]]:
    """The lines of a scene's cells in the requested order of engines, coarse dt first."""
    return sorted(records, key=lambda record: (engines.index(name_of(record)), record["substeps"]))


def name_of(record: dict[str, Any]) -> str:
    """`engine:profile`."""
    return f"{record['engine']}:{record['profile']}"


class SceneTable(NamedTuple):
    """A scene's part of deviations.csv; `damaged`: the file of a trajectory is missing or damaged,
    so the part is not kept."""

    csv: bytes
    damaged: bool


def scene_table_of(folder: Path, records: Records, answered: Path) -> SceneTable:
    """Compare a scene with its answer, kept in the file `answered`; called in a worker."""
    allow(COMPARING)
    answer = read_answer(answered)
    assert answer is not None
    comparison = compared(folder, records, answer)
    table = comparison.table
    if answer.lost and not (lost := rows_not_judged(comparison.runs, answer.lost, TRUTH)).empty:
        table = pd.concat([table, lost])
    damaged = any(run.status != record["status"] for run, record in zip(comparison.runs, records))
    return SceneTable(csv_of(table), damaged)


def csv_of(table: pd.DataFrame, header: bool = True) -> bytes:
    """A table as the text that `read_scene_table` reads."""
    return table.to_csv(index=False, header=header).encode(errors=PATHS)


def compared(folder: Path, records: Records, answer: ExactAnswer) -> Comparison:
    """The runs of a scene's cells, compared with its answer and with each other."""
    scenario = answer.put_into(scenario_of(folder, records))
    return compare(scenario, [archived_run(folder, record) for record in records])


def rows_not_judged(runs: Iterable[Run], why: str, versus: str) -> pd.DataFrame:
    """A row with the reason `why` for each run that is "ok" but not compared with `versus`."""
    says = f"{NOT_JUDGED}: {why}"
    return table_of([status_row(run, says, versus) for run in runs if run.status == "ok"])


def keep_scene_table(path: Path, csv: bytes) -> None:
    """Write a scene table atomically, after a line with its digest."""
    put_bytes(path, f"{digest(csv)}\n".encode() + csv)


def kept_scene_table(path: Path) -> bytes:
    """What `keep_scene_table` wrote; raises `OSError`, or `ValueError` if the digest differs."""
    first, _, csv = all_of(path).partition(b"\n")
    if first != digest(csv).encode():
        raise ValueError(f"{path}: is not what was written; delete it, and it is made again")
    return csv


def is_kept(path: Path) -> bool:
    """Whether the file of a scene table exists unchanged."""
    try:
        return bool(kept_scene_table(path))
    except (OSError, ValueError):
        return False


def read_scene_table(csv: bytes) -> pd.DataFrame:
    """A scene table, bit for bit as written."""
    empty = {column: [""] for column in NUMBERS}
    return pd.read_csv(
        io.BytesIO(csv), keep_default_na=False, na_values=empty, encoding_errors=PATHS
    )


def answer_file(folder: Path, records: Records) -> Path:
    """The file of the answer to a scene; its name depends on the scene and the judge's source."""
    return named_by(folder, records, (records[0]["scene_hash"], judge_hash()), ANSWER)


def scene_table_file(folder: Path, records: Records, answer: ExactAnswer) -> Path:
    """The file of a scene table; its name depends on all that decides the table: runs, answer,
    judge."""
    found = [as_found(folder, record) for record in records]
    files = [
        tuple(record[name] for name in ("cell", "status", "reason", "file", "damage"))
        for record in found
    ]
    return named_by(folder, records, (files, judge_hash(), answer.lost), ".csv")


def named_by(folder: Path, records: Records, what: tuple[Any, ...], suffix: str) -> Path:
    """A file of a scene, with a hash of `what` in its name."""
    return folder / "compared" / f"{records[0]['scenario']}-{digest(repr(what).encode())}{suffix}"


@cache
def judge_hash(root: Path = ROOT) -> str:
    """A hash of the source and versions that compare runs: if a metric changes, scene tables are
    made again."""
    files = sorted(path for pattern in JUDGE_SOURCE for path in root.glob(pattern))
    source = b"".join(path.read_bytes() for path in files)
    return hashlib.sha256(source + repr((versions(), pd.__version__)).encode()).hexdigest()
