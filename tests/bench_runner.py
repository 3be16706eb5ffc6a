"""What the harness adds to the engines' own time: `python -m tests.bench_runner` prints it, and the ceilings."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np

from adapters.engines import ENGINES
from reports.archive import Archive
from reports.cells import Cell
from reports.journal import Journal
from reports.playing import play_here
from reports.runner import run_all
from reports.suite import Means, Plan, begin, keep_cell
from reports.tables import make_tables
from scenarios.catalogue import scenario
from scenarios.files import write_scene_file
from scenarios.model import Scenario
from scenarios.placing import box
from tests.gases import gas

ROUNDS = 3


def played(scenarios: Mapping[str, Scenario], cells: list[Cell], workers: int, folder: Path) -> tuple[float, float]:
    """s, wall time from the first line of the journal to the last, and s inside the engines' `step`."""
    questions = {scene: replace(one, truth=None) for scene, one in scenarios.items()}
    tasks = {cell: partial(play_here, cell, ENGINES[cell.engine], questions[cell.scene]) for cell in cells}
    plan = Plan(list(scenarios), {cell.engine: ENGINES[cell.engine] for cell in cells}, 0, [], False, 0, "bench")
    inside, started = 0.0, perf_counter()
    with Journal(folder) as journal:
        begin(plan, journal, scenarios, len(tasks))
        for cell, result in run_all(tasks, workers, timeout=3600.0):
            run = keep_cell(journal, scenarios[cell.scene], Means(workers), cell, result)
            assert run.status == "ok", run.reason
            inside += run.seconds
    return perf_counter() - started, inside


def crowd() -> Scenario:
    """1000 disks in a box, 20 s sampled 120 times."""
    scene, (low, high) = gas(1000, 0.3)
    scene = replace(scene, walls=box(low - 0.5, high + 0.5))
    return Scenario("crowd", "How long do 1000 disks take?", "a gas", scene, 20.0, 1 / 6, (20, 40, 80))


def overhead_of_large() -> None:
    """Wall over engine time with 1000 disks: a run of nine cells on one worker, its start included."""
    names = ("pymunk:matched", "box2d:matched", "box2d_v3:matched")
    best = np.inf
    for _ in range(ROUNDS):
        with tempfile.TemporaryDirectory() as folder:
            cells = [Cell("crowd", 0, name, k) for name in names for k in crowd().substeps]
            wall, inside = played({"crowd": crowd()}, cells, 1, Path(folder))
        print(f"1000 disks, 9 cells: wall {wall:.1f} s, inside the engines {inside:.1f} s: {wall / inside:.2f}")
        best = min(best, wall / inside)
    print(f"1000 disks: wall over engine {best:.2f}   (ceiling 1.2)")


def overhead_of_small() -> None:
    """ms a cell beside the engine, of 500 cells of two disks and 241 samples, one worker, its start taken off."""
    slow_hit = {"slow_hit": scenario("slow_hit")}
    for name in ("pymunk:matched", "box2d:matched", "box2d_v3:matched"):
        best = np.inf
        for _ in range(ROUNDS):
            walls = []
            for count in (1, 501):
                cells = [Cell("slow_hit", seed, name, 1) for seed in range(count)]
                with tempfile.TemporaryDirectory() as folder:
                    wall, inside = played(slow_hit, cells, 1, Path(folder))
                walls.append(wall - inside)
            best = min(best, (walls[1] - walls[0]) / 500)
        print(f"small cells, {name:<18} {best * 1e3:5.2f} ms a cell beside the engine   (ceiling 5)")


def tables_of_many(folder: Path) -> None:
    """5004 cells: 139 scenes of two disks, 9 engines, 4 steps; then journal and tables, in processes of their own."""
    scenes = {}
    for number in range(139):
        one = scenario("slow_hit")
        scene = replace(one.scene, velocity=one.scene.velocity * (1 + number / 100))
        path = folder / f"hit-{number}.toml"
        write_scene_file(replace(one, name=f"hit-{number}", scene=scene, duration=1.0, truth=None), path)
        scenes[str(path)] = replace(one, name=f"hit-{number}", scene=scene, duration=1.0, truth=None)
    cells = [Cell(path, 0, name, k) for path, one in scenes.items() for name in ENGINES for k in one.substeps]
    out = folder / "out"
    out.mkdir()
    wall, inside = played(scenes, cells, 2, out)
    print(f"{len(cells)} cells on 2 workers: {wall:.1f} s, of which {inside:.1f} s inside the engines")
    for what in ("compared for the first time", "compared before"):
        words = [sys.executable, "-m", "tests.bench_runner", str(out)]
        print(f"  {what:<28}", subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip())


def tables(folder: Path) -> None:
    """Print how long journal and tables take and how much memory, here."""
    started = perf_counter()
    archive = Archive.read(folder)
    read = perf_counter()
    make_tables(archive, lambda _: None)
    made, most = perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"journal {read - started:.2f} s, tables {made - read:.2f} s, {most:.0f} MB   (ceiling 3 s, 300 MB)")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        tables(Path(sys.argv[1]))
    else:
        overhead_of_large()
        overhead_of_small()
        with tempfile.TemporaryDirectory() as where:
            tables_of_many(Path(where))
