"""The exact answer to a scene, and its part of deviations.csv: two tasks of a worker, the second of
which starts when the answer and all cells of the scene are there. Both results are rows.

If there is no answer, or none in time, the table says why, and the other scenes go on.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.against import TRUTH
from crosscheck2d.reports.compare.comparison import compare, status_row, table_of
from crosscheck2d.reports.compare.view import NOT_JUDGED
from crosscheck2d.reports.run.cells import digest, judge_hash
from crosscheck2d.reports.run.playing import load_trajectory
from crosscheck2d.reports.run.pool import Failure, allow
from crosscheck2d.reports.run.scenes import SceneSource, open_scene
from crosscheck2d.reports.run.store import Store
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
Record = dict[str, Any]  # the value of a row; of a cell with its key and the digest of its row


class ExactAnswer(NamedTuple):
    """What is known about the exact answer to a scene.

    Attributes:
        record: the oracle's record; None if there is a closed form, or no answer.
        status: "ok"; "none" if the scene has no exact answer; "timeout", "crashed" or "error" as in
            `Failure`.
        reason: why there is none, or "".
    """

    record: TruthRecord | None
    status: str
    reason: str

    @property
    def lost(self) -> str:
        """Why the answer to a scene could not be computed, although it may exist; or ""."""
        return "" if self.status in (OK, NONE) else self.reason

    def put_into(self, scenario: Scenario) -> Scenario:
        """The scenario with this as its truth, so that it is not computed again."""
        if self.status != OK:
            return replace(scenario, truth=None, without_truth=self.reason)
        if self.record is None:
            return scenario
        return replace(scenario, truth=OracleTruth(scenario, self.record))


def compute_answer(source: SceneSource) -> ExactAnswer:
    """In a worker."""
    scenario, truth = answered(source.scenario())
    if truth is None:
        return ExactAnswer(None, NONE, scenario.without_truth)
    record = scenario.truth.record() if isinstance(scenario.truth, OracleTruth) else None
    return ExactAnswer(record, OK, "")


def no_answer(failure: Failure, timeout: float) -> ExactAnswer:
    """The answer of a worker that failed, or took longer than `timeout` s."""
    reason = f"the exact answer could not be computed: {failure.status}: {failure.reason}"
    if failure.status == "timeout":
        reason = f"the exact answer took longer than {timeout:g} s (--timeout)"
    return ExactAnswer(None, failure.status, reason)


def answer_key(source: SceneSource) -> str:
    return digest(repr((source.digest, judge_hash())).encode())


def store_answer(store: Store, key: str, result: ExactAnswer | Failure, timeout: float) -> Record:
    """Write the row of an answer; one that failed for another reason than time is tried again."""
    answer = no_answer(result, timeout) if isinstance(result, Failure) else result
    value = {
        "status": answer.status,
        "reason": answer.reason,
        "timeout_s": timeout if answer.lost else 0.0,
        "outside": bool(answer.lost) and answer.status != "timeout",
    }
    blob = b"" if answer.record is None else packed(vars(answer.record))
    store.put(ANSWER, key, value, blob)
    return value


@dataclass(frozen=True)
class CompareTask:
    """The task to compare the cells of a scene. Their trajectories are read when it is sent to a
    worker, because those of all scenes may be more than the memory holds."""

    store: Store
    source: SceneSource
    records: Sequence[Record]
    answer: ExactAnswer

    def __call__(self) -> bytes:
        function, arguments = self.__reduce__()
        return bytes(function(*arguments)())

    def __reduce__(self) -> tuple[Any, ...]:
        files = [file_of(self.store, record) for record in self.records]
        return partial, (compare_scene, self.source, self.records, files, self.answer)


def compare_task(
    store: Store, source: SceneSource, records: Sequence[Record]
) -> tuple[str, CompareTask]:
    """The key of the table of a scene whose answer has a row, and the task that makes it."""
    row = store.get(ANSWER, answer_key(source))
    assert row is not None
    record = TruthRecord(**unpacked(row.blob)) if row.blob else None
    answer = ExactAnswer(record, row.value["status"], row.value["reason"])
    cells = [(record["cell"], record["digest"]) for record in records]
    key = digest(repr((cells, row.digest, judge_hash())).encode())
    return key, CompareTask(store, source, records, answer)


def compare_scene(
    source: SceneSource, records: Sequence[Record], files: Sequence[bytes], answer: ExactAnswer
) -> bytes:
    """In a worker: compare the cells of a scene with its answer and with each other; the scene's
    part of deviations.csv."""
    allow(COMPARING)
    runs = [run_of(record, file) for record, file in zip(records, files)]
    comparison = compare(answer.put_into(source.scenario()), runs)
    table = comparison.table
    if answer.lost and not (lost := rows_not_judged(comparison.runs, answer.lost, TRUTH)).empty:
        table = pd.concat([table, lost])
    return csv_of(table)


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
        frictionless=record["frictionless"],
    )


def csv_of(table: pd.DataFrame) -> bytes:
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
