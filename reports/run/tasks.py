"""What a run is asked to do: the plan and its means, the tasks of the plan, and those that are
finished."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import told_apart
from crosscheck2d.reports.run.archive import Archive
from crosscheck2d.reports.run.cells import Cell, content_key, scene_hash
from crosscheck2d.reports.run.known_answers import KNOWN_ANSWERS, KNOWN_SCENE
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.run.playing import conform_here, play_here
from crosscheck2d.reports.run.runner import TIMEOUT
from crosscheck2d.reports.run.scenes import open_scene, with_steps
from crosscheck2d.scenarios.model import Scenario


class Check(NamedTuple):
    """The verdict of `crosscheck check` on a solver's file.

    Attributes:
        passed: whether it found no fault.
        says: its sentences, the most important first.
        shown: for each sentence the lines of the file and the exercise's formula, a text each.
        source: `EngineRow.source` of the text that was checked; "" if there is none.
    """

    passed: bool
    says: list[str]
    shown: list[list[str]]
    source: str


class Checking(NamedTuple):
    """The task to check the file of an engine."""

    engine: str


@dataclass(frozen=True)
class RunPlan:
    """The scenes, engines and settings of a run: all that decides its numbers.

    Attributes:
        scenes: names of the catalogue or paths of scene files, in reading order.
        engines: `engine:profile`, or a solver's file as `PATH:own`, -> its row, in reading order.
        seed: seed of random scenes.
        dts: step sizes in s instead of each scenario's own; empty: its own.
        full: two finer steps for every scenario.
        timings: s that the timing pass at the end may take; 0: no timing pass.
        command: the command line that runs this plan again.
        folder: the working directory of the command, to which relative paths belong.
        files: path of a scene -> the file that is read instead, such as the kept copy of a deleted
            file.
        checks: a solver's file of `engines` -> a picklable task that gives its `Check`.
    """

    scenes: Sequence[str]
    engines: Mapping[str, EngineRow]
    seed: int
    dts: Sequence[float]
    full: bool
    timings: float
    command: str
    folder: str = field(default_factory=os.getcwd)
    files: Mapping[str, Path] = field(default_factory=dict)
    checks: Mapping[str, Callable[[], Check]] = field(default_factory=dict)

    def scenario(self, scene: str) -> Scenario:
        """The scenario behind one of `scenes`, with the steps asked for."""
        return with_steps(
            open_scene(str(self.files.get(scene, scene)), self.seed), self.dts, self.full
        )

    def header(self) -> dict[str, Any]:
        """The first line of the journal; when a run is resumed, its `RunPlan` is made from it."""
        lists = {name: list(getattr(self, name)) for name in ("scenes", "engines", "dts")}
        values = {name: getattr(self, name) for name in ("full", "timings", "folder")}
        return about(self.command, self.seed) | lists | values


@dataclass(frozen=True)
class Means:
    """The processes, time and memory for carrying out a plan; they change no number.

    Attributes:
        workers: processes that play at once.
        timeout: s a cell may take, and the exact answer to a scene.
        memory: bytes a worker may take; 0: no limit.
        scheduler: address of the dask scheduler whose workers play; "": this machine.
    """

    workers: int
    timeout: float = TIMEOUT
    memory: int = 0
    scheduler: str = ""


def tasks_of(plan: RunPlan, scenarios: Mapping[str, Scenario]) -> dict[Any, Callable[[], Any]]:
    """Task -> the picklable function that carries it out. A task is an engine's name (its probes),
    a `Checking`, a `KnownAnswer` or a `Cell`."""
    tasks: dict[Any, Callable[[], Any]] = {
        name: partial(conform_here, name, row) for name, row in plan.engines.items()
    }
    tasks |= {Checking(name): check for name, check in plan.checks.items()}
    if KNOWN_SCENE in plan.scenes:
        tasks |= {answer: answer.reproduce for answer in KNOWN_ANSWERS}
    for scene, scenario in scenarios.items():
        question = replace(scenario, truth=None)  # an engine does not get the exact answer
        for name in told_apart(plan.engines, scenario.scene):
            for cell in (Cell(scene, plan.seed, name, k) for k in scenario.substeps):
                tasks[cell] = partial(play_here, cell, plan.engines[name], question)
    return tasks


def finished_tasks(
    archive: Archive, plan: RunPlan, means: Means, scenarios: Mapping[str, Scenario]
) -> set[Any]:
    """The tasks that have a result in the journal, with the same scene, settings and versions.

    A cell is played again if it was stopped at a shorter time limit than the present one, if its
    trajectory is missing or damaged, or if it failed for a reason outside the engine.
    """
    keys = {
        line["of"]: line["key"] for line in (*archive.conformance.values(), *archive.known_answers)
    }
    done: set[Any] = {name for name in plan.engines if keys.get(name) == engine_key(plan, name)}
    done |= {known for known in KNOWN_ANSWERS if keys.get(repr(known)) == content_key(repr(known))}
    done |= {
        Checking(name)
        for name, line in archive.checked.items()
        if name in plan.engines and line["key"] == engine_key(plan, name)
    }
    hashes = {scene: scene_hash(scenario) for scene, scenario in scenarios.items()}
    for record in archive.records:
        cell = Cell(
            record["scene"],
            record["seed"],
            f"{record['engine']}:{record['profile']}",
            record["substeps"],
        )
        if cell.scene not in hashes or cell.engine not in plan.engines:
            continue
        stopped = record["status"] == "timeout" and record["timeout_s"] < means.timeout
        lost = record["damage"]  # its trajectory is missing or damaged
        same = record["cell"] == cell.key(hashes[cell.scene], plan.engines[cell.engine].source)
        if same and not (stopped or lost or record["outside"]):
            done.add(cell)
    return done


def engine_key(plan: RunPlan, name: str) -> str:
    """The `content_key` of the probes of an engine, and of the check of its file."""
    return content_key(name, plan.engines[name].source)
