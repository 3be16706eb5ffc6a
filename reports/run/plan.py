"""What a run is asked to do: the plan, its means, and its tasks, each with the key of its row."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import told_apart
from crosscheck2d.reports.run.cells import CHECK_SOURCE, Cell, content_key, scene_hash, source_hash
from crosscheck2d.reports.run.known_answers import KNOWN_ANSWERS, KNOWN_SCENE
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.run.playing import conform_here, play_here
from crosscheck2d.reports.run.pool import TIMEOUT
from crosscheck2d.reports.run.scenes import SceneSource, open_scene, with_steps
from crosscheck2d.scenarios.files.scene_file import scene_text
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


class RunTask(NamedTuple):
    """A task of a run: its row has the kind and the key; `what` it is of: a cell, an engine or a
    known answer."""

    kind: str
    key: str
    what: Any


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
        checks: a solver's file of `engines` -> a picklable task that gives its `Check`.
        trajectories: whether the trajectories are exported.
    """

    scenes: Sequence[str]
    engines: Mapping[str, EngineRow]
    seed: int
    dts: Sequence[float]
    full: bool
    timings: float
    command: str
    checks: Mapping[str, Callable[[], Check]] = field(default_factory=dict)
    trajectories: bool = False

    def scenarios(self) -> dict[str, Scenario]:
        """Scene -> its scenario, with the steps asked for."""
        return {
            scene: with_steps(open_scene(scene, self.seed), self.dts, self.full)
            for scene in self.scenes
        }

    def header(self, scenarios: Mapping[str, Scenario], tasks: Sequence[RunTask]) -> dict[str, Any]:
        """The plan as a row, with the keys of its tasks and what makes each scenario again."""
        lists = {name: list(getattr(self, name)) for name in ("scenes", "engines", "dts")}
        values = {name: getattr(self, name) for name in ("full", "timings", "trajectories")}
        of: dict[str, list[tuple[str, str]]] = {}
        for task in tasks:
            what = task.what.scene if isinstance(task.what, Cell) else str(task.what)
            of.setdefault(task.kind, []).append((task.key, what))
        sources = {
            scene: SceneSource(
                one.name,
                self.seed,
                tuple(one.substeps),
                scene_text(one) if scene.endswith(".toml") else "",
                scene_hash(one),
            )._asdict()
            for scene, one in scenarios.items()
        }
        plan = lists | values | {"tasks": of, "sources": sources, "folder": os.getcwd()}
        return about(self.command, self.seed) | plan


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


def tasks_of(
    plan: RunPlan, scenarios: Mapping[str, Scenario]
) -> Iterator[tuple[RunTask, Callable[[], Any]]]:
    """Each task of a plan with the picklable function that carries it out; cells in reading
    order."""
    for name, row in plan.engines.items():
        yield (
            RunTask("probes", content_key(name, row.source), name),
            partial(conform_here, name, row),
        )
    checker = source_hash(CHECK_SOURCE)
    for name, check in plan.checks.items():
        key = content_key(name, plan.engines[name].source, checker)
        yield RunTask("check", key, name), check
    if KNOWN_SCENE in plan.scenes:
        for known in KNOWN_ANSWERS:
            yield RunTask("known_answer", content_key(repr(known)), known), known.reproduce
    for scene, scenario in scenarios.items():
        question = replace(scenario, truth=None)  # an engine does not get the exact answer
        hashed = scene_hash(scenario)
        for name in told_apart(plan.engines, scenario.scene):
            for cell in (Cell(scene, plan.seed, name, k) for k in scenario.substeps):
                task = RunTask("cell", cell.key(hashed, plan.engines[name].source), cell)
                yield task, partial(play_here, cell, plan.engines[name], question)
