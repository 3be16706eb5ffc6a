"""The main job: play scenarios through engines into a folder, then make the tables and the page from it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from adapters.conformance import conform, no_answer
from adapters.engines import ENGINES
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
        engines: keys of `ENGINES`, in reading order.
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
    """Ask, then play, every engine and cell of the plan; all goes into `folder`, which must not exist or be empty."""
    scenarios = {scene: plan.scenario(scene) for scene in plan.scenes}
    archive = Archive(folder)
    archive.begin(about(plan.command, plan.seed) | {"scenes": list(plan.scenes)})
    for scene in plan.scenes:
        if scene.endswith(".toml"):
            write_scene_file(scenarios[scene], folder / "scenes" / f"{scenarios[scene].name}.toml")

    tasks: dict[Any, Callable[[], Any]] = {engine: partial(conform, engine, ENGINES[engine]) for engine in plan.engines}
    if KNOWN_SCENE in plan.scenes:
        tasks |= {answer: partial(answer.reproduce) for answer in KNOWN_ANSWERS}
    for scene, scenario in scenarios.items():
        for cell in cells_of(scene, scenario, plan):
            tasks[cell] = partial(play_and_save, cell, folder / "trajectories" / f"{cell.key(scenario)}.npz")
    progress.start(len(tasks))
    for task, result in run_all(tasks, plan.workers):
        if isinstance(task, Cell):
            scenario = scenarios[task.scene]
            run = failed_run(task, scenario, result) if isinstance(result, Failure) else result
            archive.add(task, scenario, run)
            progress.done(f"{run.scenario}  {run.name}  dt {run.dt:.4g} s", run.status)
        elif isinstance(task, KnownAnswer):
            ours = float("nan") if isinstance(result, Failure) else result
            archive.append({"known_answer": asdict(task) | {"ours_J2": ours}})
            progress.done(f"known answer: {task.column} at dt {task.dt_s:g} s")
        else:
            findings = [no_answer(task, *result)] if isinstance(result, Failure) else result
            archive.append({"conformance": [asdict(finding) for finding in findings]})
            progress.done(f"conformance of {task}")
    archive.append({"footer": {"tasks": len(tasks), "seconds": progress.seconds}})


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


def cells_of(scene: str, scenario: Scenario, plan: Plan) -> list[Cell]:
    """The cells of one scenario, in the order of engines, coarse dt first."""
    return [Cell(scene, plan.seed, engine, k) for engine in plan.engines for k in scenario.substeps]


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
