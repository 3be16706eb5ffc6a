"""A scene's share of deviations.csv: made in a worker as soon as the last cell of the scene has ended, and kept."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import pandas as pd

from reports.archive import Archive, run_of, trajectory_file
from reports.cells import Cell, versions
from reports.comparison import Comparison, compare
from reports.scenes import played_scenario
from reports.worker_process import LONGEST, Failure, allow
from scenarios.model import Scenario

# By which runs are compared.
JUDGES = ("comparison", "metrics", "view", "delays", "laws", "collisions", "violations", "scales")
NUMBERS = ("dt_s", "value", "at_s")  # columns of deviations.csv in which nothing means NaN
Records = Sequence[dict[str, Any]]  # the lines of a scene's cells, in the order of the tables


class Gathering:
    """The cells of a run as they come in; of each scene that is whole, the task that compares it."""

    def __init__(self, archive: Archive, missing: Iterable[Cell]) -> None:
        self.folder, self.players = archive.folder, archive.header["engines"]
        self.missing = Counter(cell.scene for cell in missing)
        self.records: dict[str, dict[tuple[str, int], dict[str, Any]]] = {}
        for record in archive.records:
            self.put(record)

    def put(self, record: dict[str, Any]) -> None:
        """Note the line of a cell, in the place of an earlier one."""
        self.records.setdefault(record["scene"], {})[name_of(record), record["substeps"]] = record

    def whole(self) -> Iterator[tuple[Path, Callable[[], Any]]]:
        """Of every scene of which nothing is missing: where its share goes, and how it is made."""
        for scene in self.records:
            yield from self.task_of(scene)

    def ended(self, record: dict[str, Any]) -> Iterator[tuple[Path, Callable[[], Any]]]:
        """The same, of the scene of a cell that has ended now."""
        self.put(record)
        self.missing[record["scene"]] -= 1
        yield from self.task_of(record["scene"])

    def task_of(self, scene: str) -> Iterator[tuple[Path, Callable[[], Any]]]:
        """The task of a scene, if it is whole and its share is not there."""
        if not self.missing[scene]:
            records = in_order(self.records[scene].values(), self.players)
            if not (path := path_of(self.folder, records)).exists():
                yield path, partial(share_of, self.folder, records)


def in_order(records: Iterable[dict[str, Any]], players: Sequence[str]) -> list[dict[str, Any]]:
    """The lines of a scene's cells in the order of engines that was asked for, coarse dt first."""
    return sorted(records, key=lambda record: (players.index(name_of(record)), record["substeps"]))


def name_of(record: dict[str, Any]) -> str:
    """`engine:profile`."""
    return f"{record['engine']}:{record['profile']}"


def share_of(folder: Path, records: Records) -> bytes:
    """In the worker: the share of a scene; nothing if a file of a trajectory is gone or torn."""
    allow(LONGEST)
    comparison = compared(folder, records)
    damaged = any(run.status != record["status"] for run, record in zip(comparison.runs, records))
    return b"" if damaged else comparison.table.to_csv(index=False).encode()


def compared(folder: Path, records: Records) -> Comparison:
    """The runs behind the lines of a scene's cells, set against its truth and each other."""
    return compare(scenario_of(folder, records), [run_of(folder, record) for record in records])


def scenario_of(folder: Path, records: Records) -> Scenario:
    """What was played, with the steps that were played; raises `ValueError` if the scene is another one now."""
    [scenario] = [played_scenario(folder, record) for record in {one["scene_hash"]: one for one in records}.values()]
    return replace(scenario, substeps=tuple(sorted({record["substeps"] for record in records})))


def keep_share(path: Path, share: bytes | Failure) -> None:
    """Write it whole or not at all, as a part would be taken for the whole; nothing if there is none to keep.

    What could not be made while cells were played is tried again with the tables.
    """
    if isinstance(share, Failure) or not share:
        return
    new = path.with_name(f"{path.name}.new")
    new.write_bytes(share)
    os.replace(new, path)


def read_share(path: Path) -> pd.DataFrame:
    """The table, bit for bit as it was written."""
    empty = {column: [""] for column in NUMBERS}
    return pd.read_csv(path, keep_default_na=False, na_values=empty)


def path_of(folder: Path, records: Records) -> Path:
    """Where the share of a scene is kept: named by all that decides it, the judge's source and the files too."""
    sizes = []
    for record in records:
        path = trajectory_file(folder, record["cell"])
        sizes.append((record["cell"], record["status"], record["reason"], path.stat().st_size if path.exists() else -1))
    digest = hashlib.sha256(repr((sizes, judge())).encode()).hexdigest()[:16]
    return folder / "compared" / f"{records[0]['scenario']}-{digest}.csv"


@cache
def judge() -> str:
    """A hash over the source and versions by which runs are compared, so that a changed metric is measured again."""
    root = Path(__file__).parent.parent
    files = [root / "reports" / f"{name}.py" for name in JUDGES] + sorted((root / "scenarios").glob("*.py"))
    source = b"".join(path.read_bytes() for path in files)
    return hashlib.sha256(source + repr((versions(), pd.__version__)).encode()).hexdigest()
