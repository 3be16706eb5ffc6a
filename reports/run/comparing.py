"""The exact answer to a scene, and its part of deviations.csv: two tasks of a worker, which start
when the last cell of the scene has ended. Both results are rows.

If there is no answer, or none in time, the table says why, and the other scenes go on.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.against import TRUTH
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.reports.compare.table import status_row, table_of
from crosscheck2d.reports.compare.view import NOT_JUDGED
from crosscheck2d.reports.run.cells import digest, judge_hash
from crosscheck2d.reports.run.pool import Failure, allow
from crosscheck2d.reports.run.scenes import SceneSource, open_scene
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.run.trajectories import load_trajectory
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.no_truth import NoTruth, answered
from crosscheck2d.scenarios.truth.cache import packed, unpacked
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM, OracleTruth
from crosscheck2d.scenarios.truth.oracle.path import TimeLimit
from crosscheck2d.scenarios.truth.record import TruthRecord

OK, NONE = "ok", "none"
# share of the time limit; computing the horizon takes up to as long as the events
FOR_EVENTS = 0.4
# columns of deviations.csv in which an empty field is NaN
NUMBERS = ("dt_s", "value", "at_s", "bound")
PATHS = "surrogateescape"  # keeps the path of a solver whose name is not UTF-8
# s that the comparison of a scene may take: all 38 of the default run take 30, on two cores
COMPARING = 300.0
ANSWER, COMPARED = "truth", "comparison"  # kinds of rows
Key = tuple[str, str]  # the kind and the key of a task and of its row
Task = tuple[Key, Callable[[], Any]]
Record = dict[str, Any]  # the row of a cell, with its key, its scene and the digest of the row


class ExactAnswer(NamedTuple):
    """What is known about the exact answer to a scene.

    Attributes:
        record: the oracle's record; None if there is a closed form, or no answer.
        status: "ok"; "none" if the scene has no exact answer; "timeout", "crashed" or "error" as in
            `Failure`.
        reason: why there is none, or "".
        timeout_s: the time limit of the computation.
    """

    record: TruthRecord | None
    status: str
    reason: str
    timeout_s: float = 0.0

    @property
    def lost(self) -> str:
        """Why the answer to a scene could not be computed, although it may exist; or ""."""
        return "" if self.status in (OK, NONE) else self.reason

    def worth_another_try(self, timeout: float) -> bool:
        """Whether it failed for a reason other than time, or under a limit shorter than `timeout`
        s."""
        return bool(self.lost) and (self.status != "timeout" or self.timeout_s < timeout)

    def put_into(self, scenario: Scenario) -> Scenario:
        """The scenario with this as its truth, so that it is not computed again."""
        if self.status != OK:
            return replace(scenario, truth=None, without_truth=self.reason)
        if self.record is None:
            return scenario
        return replace(scenario, truth=OracleTruth(scenario, self.record))


def compute_answer(source: SceneSource) -> ExactAnswer:
    """In a worker: the exact answer to a scene."""
    scenario, truth = answered(source.scenario())
    if truth is None:
        return ExactAnswer(None, NONE, scenario.without_truth)
    return ExactAnswer(
        scenario.truth.record() if isinstance(scenario.truth, OracleTruth) else None, OK, ""
    )


def no_answer(failure: Failure, timeout: float) -> ExactAnswer:
    """The answer of a worker that failed, or took longer than `timeout` s."""
    reason = f"the exact answer could not be computed: {failure.status}: {failure.reason}"
    if failure.status == "timeout":
        reason = f"the exact answer took longer than {timeout:g} s (--timeout)"
    return ExactAnswer(None, failure.status, reason, timeout)


class SceneTable(NamedTuple):
    """A scene's part of deviations.csv, with the key of its row."""

    key: str
    csv: bytes


@dataclass(frozen=True)
class CompareTask:
    """The task to compare the cells of a scene. Their trajectories are read when it is sent to a
    worker, because those of all scenes may be more than the memory holds."""

    store: Store
    source: SceneSource
    records: Sequence[Record]
    answer: ExactAnswer

    def __call__(self) -> bytes:
        """The scene table."""
        function, arguments = self.__reduce__()
        return bytes(function(*arguments)())

    def __reduce__(self) -> tuple[Any, ...]:
        files = [file_of(self.store, record) for record in self.records]
        return partial, (compare_scene, self.source, self.records, files, self.answer)


def compare_scene(
    source: SceneSource, records: Sequence[Record], files: Sequence[bytes], answer: ExactAnswer
) -> bytes:
    """In a worker: compare the cells of a scene with its answer and with each other."""
    allow(COMPARING)
    runs = [run_of(record, file) for record, file in zip(records, files)]
    comparison = compare(answer.put_into(source.scenario()), runs)
    table = comparison.table
    if answer.lost and not (lost := rows_not_judged(comparison.runs, answer.lost, TRUTH)).empty:
        table = pd.concat([table, lost])
    return csv_of(table)


@dataclass
class SceneTasks:
    """The two tasks of each scene, which start when all its cells have ended, and their results.

    Attributes:
        cells: scene -> the keys of its cells, in reading order.
        sources: scene -> what makes its scenario.
        records: key -> the row of each cell that has ended.
        timeout: s that an exact answer may take; one that was stopped at a shorter limit is
            computed again.
        answers, tables: scene -> its exact answer; its table.
        failed: scene -> why it could not be compared.
    """

    store: Store
    cells: Mapping[str, Sequence[str]]
    sources: Mapping[str, SceneSource]
    records: dict[str, Record]
    timeout: float
    answers: dict[str, ExactAnswer] = field(default_factory=dict)
    tables: dict[str, SceneTable] = field(default_factory=dict)
    failed: dict[str, Failure] = field(default_factory=dict)
    scenes: dict[Key, str] = field(default_factory=dict)  # of the tasks that were started
    under_way: set[Key] = field(default_factory=set)

    def tasks(self, partly: bool = False) -> Iterator[Task]:
        """The next task of every scene whose cells have all ended; `partly`: of which any has."""
        for scene in self.cells:
            yield from self.next_task(scene, partly)

    def next_task(self, scene: str, partly: bool = False) -> Iterator[Task]:
        """When all cells of a scene have ended: first its answer, then its table, each once."""
        records = [self.records[key] for key in self.cells[scene] if key in self.records]
        if not records or (len(records) < len(self.cells[scene]) and not partly):
            return
        source = self.sources[scene]
        task = ANSWER, digest(repr((source.digest, judge_hash())).encode())
        answer, row = None, self.store.get(*task)
        if row is not None:
            record = TruthRecord(**unpacked(row.blob)) if row.blob else None
            answer = ExactAnswer(record, *row.value)
        if task not in self.scenes and (answer is None or answer.worth_another_try(self.timeout)):
            yield self.started(task, scene), partial(compute_answer, source)
            return
        if answer is None or row is None:
            return
        self.answers[scene] = answer
        cells = [(record["cell"], record["digest"]) for record in records]
        task = COMPARED, digest(repr((cells, row.digest, judge_hash())).encode())
        if row := self.store.get(*task):
            self.tables[scene] = SceneTable(task[1], row.blob)
        elif task not in self.scenes:
            yield self.started(task, scene), CompareTask(self.store, source, records, answer)

    def started(self, task: Key, scene: str) -> Key:
        """Remember what a task is of."""
        self.scenes[task] = scene
        self.under_way.add(task)
        return task

    @property
    def awaited(self) -> list[str]:
        """The scenes whose exact answer is being computed, or is about to be."""
        return [
            self.scenes[task]
            for task in self.scenes
            if task in self.under_way and task[0] == ANSWER
        ]

    def task_ended(self, task: Key, result: Any, partly: bool = False) -> Iterator[Task]:
        """Write the result of a task, and return the next task of its scene."""
        scene = self.scenes[task]
        self.under_way.discard(task)
        if task[0] == ANSWER:
            answer = no_answer(result, self.timeout) if isinstance(result, Failure) else result
            record = b"" if answer.record is None else packed(vars(answer.record))
            self.store.put(*task, answer[1:], record)
            yield from self.next_task(scene, partly)
        elif isinstance(result, Failure):
            self.failed[scene] = result
        else:
            self.store.put(*task, None, result)
            self.tables[scene] = SceneTable(task[1], result)


def file_of(store: Store, record: Record) -> bytes:
    """The trajectory of a cell as the bytes of an .npz; b"" if it has none."""
    row = store.get("cell", record["cell"])
    return row.blob if row is not None else b""


def run_of(record: Record, file: bytes) -> Run:
    """The run of a cell, with the trajectory in `file`, or without one if it is b""."""
    return Run(
        engine=record["engine"],
        profile=record["profile"],
        scenario=record["scenario"],
        dt=record["dt_s"],
        status=record["status"],
        reason=record["reason"],
        trajectory=load_trajectory(file) if file else None,
        seconds=record["seconds"],
        settings={name: tuple(pair) for name, pair in record["settings"].items()},
        versions=record["versions"],
        frictionless=record.get("frictionless", False),  # a run of before has none
    )


def csv_of(table: pd.DataFrame) -> bytes:
    """A table as the text that `read_scene_table` reads."""
    return table.to_csv(index=False).encode(errors=PATHS)


def read_scene_table(csv: bytes) -> pd.DataFrame:
    """A scene table, bit for bit as written."""
    empty = {column: [""] for column in NUMBERS}
    return pd.read_csv(
        io.BytesIO(csv), keep_default_na=False, na_values=empty, encoding_errors=PATHS
    )


def rows_not_judged(runs: Iterable[Run], why: str, versus: str) -> pd.DataFrame:
    """A row with the reason `why` for each run that is "ok" but not compared with `versus`."""
    says = f"{NOT_JUDGED}: {why}"
    return table_of([status_row(run, says, versus) for run in runs if run.status == "ok"])


def compute_record(scene: str, seed: int, timeout: float) -> TruthRecord | str:
    """In a worker: the record of a scene, given by catalogue name or file, or why there is none.

    The worker is stopped after `timeout` s; the record ends before that, at the last event found.
    """
    reason = f"the limit of {timeout:g} s was reached (a longer --timeout gives more)"
    try:
        return record_of(open_scene(scene, seed), TimeLimit(FOR_EVENTS * timeout, reason))
    except NoTruth as refusal:
        return str(refusal)


def record_of(scenario: Scenario, clock: TimeLimit | None = None) -> TruthRecord:
    """The oracle's record until the `clock` stops it, or the collisions of a closed form as a
    record. Raises `NoTruth`."""
    if isinstance(scenario.truth, OracleTruth):
        record = scenario.truth.record(clock)
        if record.horizon < scenario.sample_interval:
            raise NoTruth(record.reason)
        return record
    if scenario.truth is None:
        raise NoTruth(scenario.without_truth)
    truth = scenario.truth(scenario.times)
    collisions = truth.collisions
    angles = np.full(len(collisions), np.nan)  # a closed form does not need them
    return TruthRecord(
        legs=np.zeros((0, 15)),
        events=np.stack(
            [collisions.t, collisions.i, collisions.j, collisions.impulse, angles], axis=-1
        ),
        horizon=truth.horizon,
        error_bound=truth.error_bound,
        bits=53,
        method=CLOSED_FORM,
        reason=truth.reason,
    )
