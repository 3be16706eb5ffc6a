"""The exact answer to a scene: computed in a worker within a time limit, and stored in a file
beside the scene tables."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import ZipFile

import numpy as np

from crosscheck2d.reports.run.cells import digest
from crosscheck2d.reports.run.scenes import Records, open_scene, scenario_of
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.reports.terminal.foreign_text import put_bytes
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.no_truth import NoTruth, answered
from crosscheck2d.scenarios.regular import opened
from crosscheck2d.scenarios.truth.cache import UNREADABLE, packed, unpacked
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM, OracleTruth
from crosscheck2d.scenarios.truth.oracle.work import TimeLimit
from crosscheck2d.scenarios.truth.record import TruthRecord

OK, NONE = "ok", "none"
# share of the time limit; computing the horizon takes up to as long as the events
FOR_EVENTS = 0.4
SAID = "answer.json"  # the member of an .npz file that holds the rest of the `ExactAnswer`


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
        return (
            scenario
            if self.record is None
            else replace(scenario, truth=OracleTruth(scenario, self.record))
        )


def answer_of(scenario: Scenario) -> ExactAnswer:
    """Compute the answer to a scenario; called in a worker."""
    scenario, truth = answered(scenario)
    if truth is None:
        return ExactAnswer(None, NONE, scenario.without_truth)
    return ExactAnswer(
        scenario.truth.record() if isinstance(scenario.truth, OracleTruth) else None, OK, ""
    )


def answer_here(folder: Path, records: Records) -> ExactAnswer:
    """Compute the exact answer to a scene; called in a worker."""
    return answer_of(scenario_of(folder, records))


def no_answer(failure: Failure, timeout: float) -> ExactAnswer:
    """The answer of a worker that failed, or took longer than `timeout` s."""
    if failure.status == "timeout":
        return ExactAnswer(
            None,
            failure.status,
            f"the exact answer took longer than {timeout:g} s (--timeout)",
            timeout,
        )
    reason = f"the exact answer could not be computed: {failure.status}: {failure.reason}"
    return ExactAnswer(None, failure.status, reason, timeout)


def put_answer(path: Path, answer: ExactAnswer) -> None:
    """Write an answer atomically."""
    whole = io.BytesIO(b"" if answer.record is None else packed(vars(answer.record)))
    with ZipFile(whole, "a") as file:
        said = list(answer[1:])
        file.writestr(SAID, json.dumps([*said, digest_of(file, path.name, said)]))
    put_bytes(path, whole.getvalue())


def digest_of(file: ZipFile, name: str, said: list[Any]) -> str:
    """16 hex digits of a hash over the members of an answer's file and its name, which identifies
    the scene."""
    inside = sorted(set(file.namelist()) - {SAID})
    return digest(b"\0".join([json.dumps([name, said, inside]).encode(), *map(file.read, inside)]))


def read_answer(path: Path) -> ExactAnswer | None:
    """What `put_answer` wrote; None if the file is missing or its digest differs."""
    try:
        with opened(path) as there, ZipFile(there) as file:
            *said, written = json.loads(file.read(SAID))
            if written != digest_of(file, path.name, said):
                return None
            whole = len(file.namelist()) > 1
        fields = unpacked(path) if whole else None
        return (
            None
            if whole and fields is None
            else ExactAnswer(TruthRecord(**fields) if fields else None, *said)
        )
    except UNREADABLE:
        return None


def record_here(scene: str, seed: int, timeout: float) -> TruthRecord | str:
    """The record of a scene, given by catalogue name or file, or why there is none; called in a
    worker.

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
