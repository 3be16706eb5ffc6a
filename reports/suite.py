"""The main job: play scenarios through engines into a folder, then make the tables and the page from it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from adapters.conformance import conform, to_table
from adapters.engines import ENGINES
from adapters.play import Run
from reports.archive import FILES, Archive
from reports.cells import Cell, open_scene, with_steps
from reports.known_answers import KNOWN_SCENE, known_answers
from reports.machine import about
from reports.runner import play_all
from reports.terminal import Progress
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


def carry_out(plan: Plan, folder: Path) -> None:
    """Play every cell of the plan into `folder`, which must not exist or be empty; report progress as it goes."""
    scenarios = {scene: plan.scenario(scene) for scene in plan.scenes}
    archive = Archive(folder)
    archive.begin(about(plan.command, plan.seed) | {"scenes": list(plan.scenes)})
    for scene in plan.scenes:
        if scene.endswith(".toml"):
            shutil.copy(scene, folder / "scenes" / f"{scenarios[scene].name}.toml")
    with Progress() as progress:
        progress.say("conformance of every engine")
        findings = [finding for name in plan.engines for finding in conform(name, ENGINES[name])]
        archive.append({"conformance": to_table(findings).to_dict("records")})
        if KNOWN_SCENE in plan.scenes:
            progress.say("known answers from outside")
            archive.append({"known_answers": known_answers().to_dict("records")})
        cells = [
            (cell, cell.key(scenario))
            for scene, scenario in scenarios.items()
            for cell in cells_of(scene, scenario, plan)
        ]
        progress.start(len(cells))

        def failed(cell: Cell, status: str, reason: str) -> Run:
            engine, profile = cell.engine.split(":")
            scenario = scenarios[cell.scene]
            return Run(engine, profile, scenario.name, scenario.dt(cell.substeps), status, reason)

        for cell, key, run in play_all(cells, folder / "trajectories", plan.workers, failed):
            archive.add(cell, key, run)
            progress.done(f"{run.scenario}  {run.name}  dt {run.dt:.4g} s", run.status)
    archive.append({"footer": {"cells": len(cells), "seconds": progress.seconds}})


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
    if target.is_file():
        raise FolderTaken(f"--out {target}: is a file; name a folder that does not exist yet")
    strange = sorted(path.name for path in target.iterdir() if path.name not in FILES) if target.exists() else []
    if strange:
        raise FolderTaken(f"--out {target}: holds {strange[0]}, which no run of crosscheck made; name another folder")
