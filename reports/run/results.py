"""How the result of each kind of task becomes a line of the journal."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Literal

from crosscheck2d.adapters.conformance.conform import Finding, not_probed
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run.archive import trajectory_file
from crosscheck2d.reports.run.cells import Cell, content_key, digest, scene_hash
from crosscheck2d.reports.run.journal import Journal
from crosscheck2d.reports.run.known_answers import KnownAnswer
from crosscheck2d.reports.run.playing import CellResult, source_and_versions
from crosscheck2d.reports.run.tasks import Check, Means, RunPlan, engine_key
from crosscheck2d.reports.run.trajectories import from_trail, packed
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.reports.terminal.foreign_text import put_bytes
from crosscheck2d.scenarios.model import Scenario

Status = tuple[str, str, str]  # a task in words, its status, the reason of a failure


class OtherVersions(Exception):
    """The source or library versions of a worker differ from those of this machine."""


def keep_probes(
    journal: Journal, plan: RunPlan, engine: str, result: list[Finding] | Failure
) -> Status:
    """Write what the probes of an engine found to the journal."""
    status, reason = status_of(result)
    # a solver of the exercise that hangs breaks no protocol
    verdict: Literal["departs", "breaks"] = "departs" if plan.engines[engine].exercise else "breaks"
    findings = (
        [not_probed(engine, status, reason, verdict)] if isinstance(result, Failure) else result
    )
    line = {"conformance": [asdict(finding) for finding in findings]}
    journal.append(line | {"of": engine, "key": unless_outside(result, engine_key(plan, engine))})
    return f"conformance of {engine}", status, reason


def keep_known_answer(journal: Journal, known: KnownAnswer, result: float | Failure) -> Status:
    """Write a reproduced known answer to the journal."""
    ours = float("nan") if isinstance(result, Failure) else result
    line = {"known_answer": asdict(known) | {"ours_J2": ours}}
    key = unless_outside(result, content_key(repr(known)))
    journal.append(line | {"of": repr(known), "key": key})
    return f"known answer: {known.column} at dt {known.dt_s:g} s", *status_of(result)


def status_of(result: Any) -> tuple[str, str]:
    """The status of a task, and the reason of a failure."""
    return (result.status, result.reason) if isinstance(result, Failure) else ("ok", "")


def unless_outside(result: Any, key: str) -> str:
    """The key for the line of a result; "" after a failure outside the engine: it matches no task,
    so that the task is tried again when the run is resumed."""
    return "" if isinstance(result, Failure) and result.outside else key


def keep_check(journal: Journal, plan: RunPlan, engine: str, result: Check | Failure) -> Status:
    """Write the verdict of `crosscheck check` on an engine's file to the journal."""
    shown: list[list[str]]
    passed, says, shown, key = False, ["It was saved while the run began: check it again."], [], ""
    if isinstance(result, Failure):
        says = [f"It could not be checked: {result.reason}"]
    elif result.source == plan.engines[engine].source:
        passed, says, shown, _ = result
        key = engine_key(plan, engine)
    # No key matches "": the file is checked again when the run is resumed.
    verdict = {"passed": passed, "says": says, "shown": shown}
    journal.append({"checked": verdict, "of": engine, "key": key})
    return f"check of {engine}", *status_of(result)


def keep_cell(
    journal: Journal,
    scenario: Scenario,
    means: Means,
    cell: Cell,
    key: str,
    result: CellResult | Failure,
) -> dict[str, Any]:
    """Write the trajectory of the cell with this `key`, then its line, which is returned."""
    played = failed(cell, scenario, result) if isinstance(result, Failure) else result
    run, samples = played.run, played.samples
    if played.played_by != source_and_versions():
        raise OtherVersions(
            "a worker has other versions or other source of the engines than this machine"
        )
    path = trajectory_file(journal.path.parent, key)
    if played.file:
        put_bytes(path, played.file)
    record = {
        "cell": key,
        "scene_hash": scene_hash(scenario),
        "scene": cell.scene,
        "seed": cell.seed,
        "substeps": cell.substeps,
        "scenario": run.scenario,
        "engine": run.engine,
        "profile": run.profile,
        "dt_s": run.dt,
        "status": run.status,
        "reason": run.reason,
        "step": (samples - 1) * cell.substeps if samples else -1,
        "until_s": float(scenario.times[samples - 1]) if samples else float("nan"),
        "seconds": run.seconds,
        "timeout_s": means.timeout,
        "outside": isinstance(result, Failure) and result.outside,
        "file": digest(played.file) if played.file else "",
        "settings": run.settings,
        "versions": run.versions,
    }
    journal.append(record)
    return record


def failed(cell: Cell, scenario: Scenario, failure: Failure) -> CellResult:
    """The result of a cell whose worker died or was stopped, with the states up to that time."""
    trajectory = from_trail(failure.trail, scenario)
    samples = len(trajectory) if trajectory else 0
    last = (
        f"; last good state: step {(samples - 1) * cell.substeps},"
        f" {scenario.times[samples - 1]:g} s"
        if samples
        else ""
    )
    run = Run(
        *cell.names,
        scenario.name,
        scenario.dt(cell.substeps),
        failure.status,
        failure.reason + last,
    )
    return CellResult(
        run, samples, packed(trajectory) if trajectory else b"", source_and_versions()
    )
