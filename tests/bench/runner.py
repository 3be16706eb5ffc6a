"""What the harness adds to the engines' own time: `python -m tests.bench.runner` prints it, and the
ceilings."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from argparse import SUPPRESS, ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.run.cells import Cell, scene_hash
from crosscheck2d.reports.run.playing import play_here
from crosscheck2d.reports.run.pool import run_all
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import writing
from crosscheck2d.reports.run.suite import (
    Means,
    RunPlan,
    RunTask,
    carry_out,
    cell_row,
    store_result,
)
from crosscheck2d.reports.run.tables import make_tables
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import box
from crosscheck2d.scenarios.files.scene_file import scene_text
from crosscheck2d.scenarios.model import Scenario
from tests.adapters.event_driven.gases import gas

ROUNDS = 3


class Cost(NamedTuple):
    """Of a run in s: wall time from the first row to the last, wall time inside the
    engines' `step`, and processor time of this process and its workers."""

    wall: float
    inside: float
    processor: float


def played(
    scenarios: Mapping[str, Scenario], cells: list[Cell], workers: int, folder: Path
) -> Cost:
    questions = {scene: replace(one, truth=None) for scene, one in scenarios.items()}
    tasks = {
        cell: partial(play_here, cell, ENGINES[cell.engine], questions[cell.scene])
        for cell in cells
    }
    inside, started, before = 0.0, perf_counter(), sum(processor())
    with writing(folder / "out", COMMAND) as store, Progress() as progress:
        progress.start(len(tasks), len(tasks))
        for cell, result in run_all(tasks, workers, timeout=3600.0):
            scene = scenarios[cell.scene]
            key, to_row = cell.key(scene_hash(scene), ""), partial(cell_row, cell, scene)
            task = RunTask("cell", key, cell.scene, tasks[cell], to_row, scene.name)
            record = store_result(store, task, result, 3600.0, progress)
            assert record["status"] == "ok", record["reason"]
            inside += record["seconds"]
    return Cost(perf_counter() - started, inside, sum(processor()) - before)


def processor() -> list[float]:
    usages = [
        resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    ]
    return [usage.ru_utime + usage.ru_stime for usage in usages]


def crowd() -> Scenario:
    scene, (low, high) = gas(1000, 0.3)
    scene = replace(scene, walls=box(low - 0.5, high + 0.5))
    return Scenario(
        "crowd", "How long do 1000 disks take?", "a gas", scene, 20.0, 1 / 6, (20, 40, 80)
    )


def overhead_of_large() -> None:
    names = ("pymunk:matched", "box2d:matched", "box2d_v3:matched")
    cells = [Cell("crowd", 0, name, k) for name in names for k in crowd().substeps]
    best: dict[str, float] = {}
    for _ in range(ROUNDS):
        with tempfile.TemporaryDirectory() as folder:
            cost = played({"crowd": crowd()}, cells, 1, Path(folder))
        ratios = {"wall": cost.wall / cost.inside, "processor": cost.processor}
        best = {what: min(value, best.get(what, np.inf)) for what, value in ratios.items()}
    alone = [least(name, crowd(), k) for name in names for k in crowd().substeps]
    stepping, reading = (sum(column) for column in zip(*alone))
    print(f"1000 disks, 9 cells: wall over engine {best['wall']:.2f}   (ceiling 1.2)")
    print(
        f"  processor {best['processor']:.2f} s: {stepping:.2f} the engines, {reading:.2f} the"
        " reading of the samples that the scene asks for,"
        f" {best['processor'] - stepping - reading:.2f} the harness, starting included"
    )


def overhead_of_small() -> None:
    """ms a cell beside the engine, of 500 cells of two disks and 241 samples, one worker, its start
    taken off."""
    slow_collision = {"slow_collision": scenario("slow_collision")}
    for name in ("pymunk:matched", "box2d:matched", "box2d_v3:matched"):
        rounds = []
        for _ in range(ROUNDS):
            costs = []
            for count in (1, 501):
                cells = [Cell("slow_collision", seed, name, 1) for seed in range(count)]
                with tempfile.TemporaryDirectory() as folder:
                    costs.append(played(slow_collision, cells, 1, Path(folder)))
            rounds.append([(more - one) / 500 * 1e3 for one, more in zip(*costs)])
        wall = min(wall - inside for wall, inside, _ in rounds)
        all_of_it = min(processor for _, _, processor in rounds)
        stepping, reading = (1e3 * s for s in least(name, slow_collision["slow_collision"], 1))
        print(
            f"small cells, {name:<16} {wall:5.2f} ms a cell beside the engine; processor"
            f" {all_of_it:.2f} ms: {stepping:.2f} the engine, {reading:.2f} the reading of the"
            f" samples that the scene asks for, {all_of_it - stepping - reading:.2f} the harness  "
            " (ceiling 5)"
        )


def least(name: str, scene: Scenario, substeps: int) -> tuple[float, float]:
    """s of processor time that an engine takes for all steps of a scenario and for all reads: the
    least of some."""
    tries = []
    for _ in range(ROUNDS):
        engine, clock = ENGINES[name].make(), [0.0, 0.0]
        engine.load(scene.scene, scene.dt(substeps))
        for _ in range(scene.intervals):
            started = process_time()
            engine.step(substeps)
            stepped = process_time()
            engine.read()
            clock[0] += stepped - started
            clock[1] += process_time() - stepped
        engine.close()
        tries.append(clock)
    return min(tries)[0], min(clock[1] for clock in tries)


class Clocked(Progress):
    def done(self, what: str, status: str = "ok", reason: str = "") -> None:
        super().done(what, status, reason)
        assert status == "ok", reason
        self.last = perf_counter()


def many_cells(folder: Path) -> None:
    """5560 cells, 139 scenes of two disks, 10 engines, 4 steps: played, and their tables made once
    more; in processes of their own, whose memory can be measured."""
    for number in range(139):
        one = scenario("slow_collision")
        scene = replace(one.scene, velocity=one.scene.velocity * (1 + number / 100))
        path = folder / f"collision-{number}.toml"
        shown = replace(one, name=f"collision-{number}", scene=scene, duration=1.0, truth=None)
        path.write_text(scene_text(shown), encoding="utf-8")
    for what in (play_many, tables_again):
        words = [sys.executable, "-m", "tests.bench.runner", what.__name__, str(folder)]
        print(subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout.strip())


def play_many(folder: Path) -> None:
    scenes = sorted(str(path) for path in folder.glob("*.toml"))
    out = folder / "out"
    plan = RunPlan(scenes, ENGINES, seed=0, dts=[], full=False, timings=0, command="bench")
    started = perf_counter()
    with writing(out, COMMAND) as store, Clocked() as progress:
        carry_out(plan, Means(workers=2), store, progress)
        results = RunResults.read(store)
        make_tables(results, lambda _: None)
    made, inside = perf_counter(), sum(record["seconds"] for record in results.records)
    print(
        f"{len(results.records)} cells on 2 workers: {made - started:.1f} s, {inside:.1f} s of them"
        " in the engines"
    )
    print(f"  tables {made - progress.last:.2f} s after the last cell (ceiling 3), {used()}")


def tables_again(folder: Path) -> None:
    started = perf_counter()
    with writing(folder / "out", COMMAND) as store:
        make_tables(RunResults.read(store), lambda _: None)
    print(f"  rows and tables again {perf_counter() - started:.2f} s (ceiling 3), {used()}")


def used() -> str:
    seconds = processor()
    mine, theirs = (
        resource.getrusage(who).ru_maxrss / 1e3
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return (
        f"processor {seconds[0]:.1f} s here and {seconds[1]:.1f} s in the workers, "
        f"memory {mine:.0f} MB here (ceiling 300) and {theirs:.0f} MB in the largest worker"
    )


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="?", choices=["play_many", "tables_again"], help=SUPPRESS)
    parser.add_argument("folder", nargs="?", type=Path, help=SUPPRESS)
    asked = parser.parse_args()
    if asked.part:
        {"play_many": play_many, "tables_again": tables_again}[asked.part](asked.folder)
    else:
        overhead_of_large()
        overhead_of_small()
        with tempfile.TemporaryDirectory() as where:
            many_cells(Path(where))
