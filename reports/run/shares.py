"""A scene's share of deviations.csv: made in a worker as soon as the last cell of the scene has
ended, and kept.

First the scene's exact answer is had, within the time that a cell may take, then all runs are set
against it: two tasks of a worker. What could not be had in time, or at all, is said in the share,
and the other scenes go on.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from adapters.run import Run
from reports.compare.comparison import Comparison, compare
from reports.compare.table import status_row, table_of
from reports.compare.view import NOT_JUDGED
from reports.run.answers import Answer, answer_of, no_answer, put_answer, read_answer
from reports.run.archive import Archive, as_found, digest, run_of
from reports.run.cells import Cell, versions
from reports.run.scenes import must_fit, played_scenario
from reports.run.worker_process import Failure, allow
from reports.terminal.foreign_text import put_bytes
from scenarios.model import Scenario
from scenarios.regular import all_of

# By which runs are compared.
JUDGES = ("reports/compare/**/*.py", "scenarios/**/*.py")  # wherever in these folders a file lies
ROOT = Path(__file__).parents[2]
ANSWER = ".npz"  # how the file of an answer ends
NUMBERS = ("dt_s", "value", "at_s")  # columns of deviations.csv in which nothing means NaN
# so that the path of a solver that is not UTF-8 is the same when it is read back
PATHS = "surrogateescape"
# s that the comparison of a scene may take: all 38 of the default run take 30, on two cores
COMPARING = 300.0
Records = Sequence[dict[str, Any]]  # the lines of a scene's cells, in the order of the tables
Task = tuple[Path, Callable[[], Any]]  # where its result is kept, and what makes it in a worker


class Gathering:
    """The cells of a run as they come in; of each scene that is whole, the tasks that answer and
    compare it.

    Attributes:
        unkept: scene -> its share, where that may not be kept, as a file of a trajectory is gone or
            torn.
        failed: scene -> why it could not be compared.
    """

    def __init__(
        self, archive: Archive, missing: Iterable[Cell], timeout: float, warn: Callable[[str], None]
    ) -> None:
        """`timeout`: s that an exact answer may take; what has had less is tried again; `warn`
        hears what is torn."""
        self.warn = warn
        self.folder, self.engines, self.timeout = archive.folder, archive.header["engines"], timeout
        self.missing = Counter(cell.scene for cell in missing)
        self.records: dict[str, dict[tuple[str, int], dict[str, Any]]] = {}
        self.scenes: dict[Path, str] = {}  # of the tasks that were given out
        self.had: set[Path] = set()  # of these, those that have ended
        self.unkept: dict[str, bytes] = {}
        self.failed: dict[str, Failure] = {}
        for record in archive.records:
            self.put(record)

    def put(self, record: dict[str, Any]) -> None:
        """Note the line of a cell, in the place of an earlier one."""
        self.records.setdefault(record["scene"], {})[name_of(record), record["substeps"]] = record

    def whole(self) -> Iterator[Task]:
        """Of every scene of which nothing is missing, what is to be done first."""
        for scene in self.records:
            yield from self.task_of(scene)

    def ended(self, record: dict[str, Any]) -> Iterator[Task]:
        """The same, of the scene of a cell that has ended now."""
        self.put(record)
        self.missing[record["scene"]] -= 1
        yield from self.task_of(record["scene"])

    def task_of(self, scene: str) -> Iterator[Task]:
        """The next task of a scene, if it is whole: its answer, then its share; each is given out
        once."""
        if self.missing[scene]:
            return
        records = in_order(self.records[scene].values(), self.engines)
        asked = answer_file(self.folder, records)
        answer = read_answer(asked)
        if answer is None and asked not in self.scenes and os.path.lexists(asked):
            self.warn(f"{asked.name} is not what was written: that exact answer is computed again")
        if asked not in self.scenes and (answer is None or answer.may_be_had(self.timeout)):
            self.scenes[asked] = scene
            yield asked, partial(answer_here, self.folder, records)
        elif answer is not None and not is_kept(path := share_file(self.folder, records, answer)):
            self.scenes[path] = scene
            yield path, partial(share_of, self.folder, records, asked)

    @property
    def playing(self) -> bool:
        """Whether a cell has not ended yet."""
        return any(self.missing.values())

    @property
    def asked(self) -> list[str]:
        """The scenes whose exact answer is being computed, or is about to be."""
        return [
            scene
            for path, scene in self.scenes.items()
            if path.suffix == ANSWER and path not in self.had
        ]

    def came(self, path: Path, result: Any) -> Iterator[Task]:
        """Keep what came of a task, and give out the next of its scene."""
        scene = self.scenes[path]
        self.had.add(path)
        if path.suffix == ANSWER:
            away_with_what_is_no_file(path)
            put_answer(
                path, no_answer(result, self.timeout) if isinstance(result, Failure) else result
            )
            yield from self.task_of(scene)
        elif isinstance(result, Failure):
            self.failed[scene] = result
        elif result.damaged:
            self.unkept[scene] = result.csv
        else:
            away_with_what_is_no_file(path)
            keep_share(path, result.csv)


def away_with_what_is_no_file(path: Path) -> None:
    """Delete a pipe or a link that has the name of an answer or a share: it would be written
    into."""
    if path.is_symlink() or (path.exists() and not path.is_file()):
        path.unlink()


def in_order(records: Iterable[dict[str, Any]], engines: Sequence[str]) -> list[dict[str, Any]]:
    """The lines of a scene's cells in the order of engines that was asked for, coarse dt first."""
    return sorted(records, key=lambda record: (engines.index(name_of(record)), record["substeps"]))


def name_of(record: dict[str, Any]) -> str:
    """`engine:profile`."""
    return f"{record['engine']}:{record['profile']}"


class Share(NamedTuple):
    """A scene's part of deviations.csv; `damaged`: a file of a trajectory is gone or torn, so that
    it is not kept."""

    csv: bytes
    damaged: bool


def answer_here(folder: Path, records: Records) -> Answer:
    """In the worker: the exact answer to a scene."""
    return answer_of(scenario_of(folder, records))


def share_of(folder: Path, records: Records, answered: Path) -> Share:
    """In the worker: the share of a scene whose answer is kept in the file `answered`."""
    allow(COMPARING)
    answer = read_answer(answered)
    assert answer is not None
    comparison = compared(folder, records, answer)
    table = comparison.table
    if answer.lost and not (lost := not_judged(comparison.runs, answer.lost, "truth")).empty:
        table = pd.concat([table, lost])
    damaged = any(run.status != record["status"] for run, record in zip(comparison.runs, records))
    return Share(csv_of(table), damaged)


def csv_of(table: pd.DataFrame, header: bool = True) -> bytes:
    """What `read_share` reads."""
    return table.to_csv(index=False, header=header).encode(errors=PATHS)


def compared(folder: Path, records: Records, answer: Answer) -> Comparison:
    """The runs behind the lines of a scene's cells, set against its answer and each other."""
    scenario = answer.given_to(scenario_of(folder, records))
    return compare(scenario, [run_of(folder, record) for record in records])


def not_judged(runs: Iterable[Run], why: str, versus: str) -> pd.DataFrame:
    """A row for each run that was played to its end and is, all the same, not set against
    `versus`."""
    says = f"{NOT_JUDGED}: {why}"
    return table_of([status_row(run, says, versus) for run in runs if run.status == "ok"])


def scenario_of(folder: Path, records: Records) -> Scenario:
    """What was played, with the steps that were played; raises `Unusable` if a line does not fit
    the scene as it is."""
    [scenario] = [
        played_scenario(folder, record)
        for record in {one["scene_hash"]: one for one in records}.values()
    ]
    for record in records:
        must_fit(folder, scenario, record)
    return replace(scenario, substeps=tuple(sorted({record["substeps"] for record in records})))


def keep_share(path: Path, csv: bytes) -> None:
    """Write it whole or not at all, its digest in a line before it."""
    put_bytes(path, f"{digest(csv)}\n".encode() + csv)


def kept_share(path: Path) -> bytes:
    """What `keep_share` wrote; raises `OSError`, or `ValueError` if it is that no more."""
    first, _, csv = all_of(path).partition(b"\n")
    if first != digest(csv).encode():
        raise ValueError(f"{path}: is not what was written; delete it, and it is made again")
    return csv


def is_kept(path: Path) -> bool:
    """Whether a share is there as it was written."""
    try:
        return bool(kept_share(path))
    except (OSError, ValueError):
        return False


def read_share(csv: bytes) -> pd.DataFrame:
    """The table, bit for bit as it was written."""
    empty = {column: [""] for column in NUMBERS}
    return pd.read_csv(
        io.BytesIO(csv), keep_default_na=False, na_values=empty, encoding_errors=PATHS
    )


def answer_file(folder: Path, records: Records) -> Path:
    """Where the answer to a scene is kept: named by the scene and the judge's source."""
    return named_by(folder, records, (records[0]["scene_hash"], judge()), ANSWER)


def share_file(folder: Path, records: Records, answer: Answer) -> Path:
    """Where the share of a scene is kept: named by all that decides it, its answer, the judge and
    the files too."""
    found = [as_found(folder, record) for record in records]
    files = [
        tuple(record[name] for name in ("cell", "status", "reason", "file", "damage"))
        for record in found
    ]
    return named_by(folder, records, (files, judge(), answer.lost), ".csv")


def named_by(folder: Path, records: Records, what: tuple[Any, ...], suffix: str) -> Path:
    """A file of a scene that is another one when anything of `what` is."""
    digest = hashlib.sha256(repr(what).encode()).hexdigest()[:16]
    return folder / "compared" / f"{records[0]['scenario']}-{digest}{suffix}"


@cache
def judge(root: Path = ROOT) -> str:
    """A hash over the source and versions by which runs are compared, so that a changed metric is
    measured again."""
    files = sorted(path for pattern in JUDGES for path in root.glob(pattern))
    source = b"".join(path.read_bytes() for path in files)
    return hashlib.sha256(source + repr((versions(), pd.__version__)).encode()).hexdigest()
