"""The main job: play scenarios through engines into a folder, then make the tables and the page from it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from adapters.conformance import conform, no_answer
from adapters.engines import row_of
from adapters.play import Run
from reports.archive import FILES, Archive, save_trajectory
from reports.cells import Cell, open_scene, with_steps
from reports.known_answers import KNOWN_ANSWERS, KNOWN_SCENE, KnownAnswer
from reports.machine import about
from reports.runner import Failure, run_all
from reports.terminal import Progress
from scenarios.files import write_scene_file
from scenarios.model import Scenario


@dataclass(frozen=True)
class Plan:
    """What is asked for.

    Attributes:
        scenes: names of the catalogue or paths of scene files, in reading order.
        engines: keys of `ENGINES`, or solvers' files as `PATH:own`, in reading order.
        seed: what drawn scenes are drawn from.
        dts: step sizes in s instead of each scenario's own; empty: its own.
        full: two finer steps for every scenario.
        workers: processes that play at once.
        command: how to ask for the same again.
    """

    scenes: Sequence[str]
    engines: Sequence[str]
    seed: int
    dts: Sequence[float]
    full: bool
    workers: int
    command: str

    def scenario(self, scene: str) -> Scenario:
        """The scenario behind one of `scenes`, with the steps asked for."""
        return with_steps(open_scene(scene, self.seed), self.dts, self.full)


def carry_out(plan: Plan, folder: Path, progress: Progress) -> None:
    """Put the probes to every engine and play every cell; all goes into `folder`, which must not exist or be empty."""
    scenarios = {scene: plan.scenario(scene) for scene in plan.scenes}
    archive = Archive(folder)
    archive.begin(about(plan.command, plan.seed) | {"scenes": list(plan.scenes)})
    for scene in plan.scenes:
        if scene.endswith(".toml"):
            write_scene_file(scenarios[scene], folder / "scenes" / f"{scenarios[scene].name}.toml")
    tasks = tasks_of(plan, scenarios, folder)
    progress.start(len(tasks))
    for task, result in run_all(tasks, plan.workers):
        progress.done(*keep(archive, scenarios, task, result))
    archive.append({"footer": {"tasks": len(tasks), "seconds": progress.seconds}})


def tasks_of(plan: Plan, scenarios: Mapping[str, Scenario], folder: Path) -> dict[Any, Callable[[], Any]]:
    """What is to be done, by what it is: an engine's name (its probes), a `KnownAnswer`, or a `Cell`."""
    tasks: dict[Any, Callable[[], Any]] = {engine: partial(conform, engine, row_of(engine)) for engine in plan.engines}
    if KNOWN_SCENE in plan.scenes:
        tasks |= {answer: answer.reproduce for answer in KNOWN_ANSWERS}
    for scene, scenario in scenarios.items():
        for engine in plan.engines:
            for cell in (Cell(scene, plan.seed, engine, k) for k in scenario.substeps):
                tasks[cell] = partial(play_and_save, cell, folder / "trajectories" / f"{cell.key(scenario)}.npz")
    return tasks


def keep(archive: Archive, scenarios: Mapping[str, Scenario], task: Any, result: Any) -> tuple[str, str]:
    """Write what a task gave into the journal; returns what to say of it, and its status."""
    failure = result if isinstance(result, Failure) else None
    if isinstance(task, Cell):
        scenario = scenarios[task.scene]
        run = failed_run(task, scenario, failure) if failure else result
        archive.add(task, scenario, run)
        return f"{run.scenario}  {run.name}  dt {run.dt:.4g} s", run.status
    if isinstance(task, KnownAnswer):
        archive.append({"known_answer": asdict(task) | {"ours_J2": float("nan") if failure else result}})
        return f"known answer: {task.column} at dt {task.dt_s:g} s", failure.status if failure else "ok"
    findings = [no_answer(task, *failure)] if failure else result
    archive.append({"conformance": [asdict(finding) for finding in findings]})
    return f"conformance of {task}", failure.status if failure else "ok"


def play_and_save(cell: Cell, path: Path) -> Run:
    """In the worker: play, save the trajectory, and send back the rest."""
    run = cell.play()
    if run.trajectory is not None:
        save_trajectory(path, run.trajectory)
    return replace(run, trajectory=None)


def failed_run(cell: Cell, scenario: Scenario, failure: Failure) -> Run:
    """The run of a cell whose worker died or was stopped."""
    engine, profile = cell.engine.split(":")
    return Run(engine, profile, scenario.name, scenario.dt(cell.substeps), failure.status, failure.reason)


class FolderTaken(Exception):
    """An output folder that holds something that is not a run of ours."""


def replace_folder(made: Path, target: Path) -> None:
    """Put the finished folder `made` in the place of `target` in two renames; `target` is a run of ours or absent."""
    old = target.with_name(f".{target.name}.old-{os.getpid()}")
    if target.exists():
        target.rename(old)
    made.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def may_write(target: Path) -> None:
    """Raise `FolderTaken` unless `target` is absent, empty, or holds an earlier run and nothing else."""
    if target == Path.cwd() or target in Path.cwd().parents:
        raise FolderTaken(f"--out {target}: is where you are; name another folder, or go elsewhere")
    if target.is_file():
        raise FolderTaken(f"--out {target}: is a file; name a folder that does not exist yet")
    strange = sorted(path.name for path in target.iterdir() if path.name not in FILES) if target.exists() else []
    if strange:
        raise FolderTaken(f"--out {target}: holds {strange[0]}, which no run of crosscheck made; name another folder")
