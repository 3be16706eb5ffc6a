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
from reports.suite import Means, Plan, begin, carry_out, keep_cell
from reports.tables import make_tables
from reports.terminal import Progress
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
            line = keep_cell(journal, scenarios[cell.scene], Means(workers), cell, result)
            assert line["status"] == "ok", line["reason"]
            inside += line["seconds"]
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


class Clocked(Progress):
    """Knows when the last cell had ended."""

    def done(self, what: str, status: str = "ok", reason: str = "") -> None:
        super().done(what, status, reason)
        assert status == "ok", reason
        self.last = perf_counter()


def many_cells(folder: Path) -> None:
    """5560 cells, 139 scenes of two disks, 10 engines, 4 steps: played, and their tables made once more; in processes
    of their own, whose memory can be told."""
    for number in range(139):
        one = scenario("slow_hit")
        scene = replace(one.scene, velocity=one.scene.velocity * (1 + number / 100))
        path = folder / f"hit-{number}.toml"
        write_scene_file(replace(one, name=f"hit-{number}", scene=scene, duration=1.0, truth=None), path)
    for what in (play_many, tables_again):
        words = [sys.executable, "-m", "tests.bench_runner", what.__name__, str(folder)]
        print(subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout.strip())


def play_many(folder: Path) -> None:
    """Print how long a run of all scenes takes, and how long after its last cell the tables are there."""
    scenes = sorted(str(path) for path in folder.glob("*.toml"))
    out = folder / "out"
    out.mkdir()
    plan = Plan(scenes, ENGINES, seed=0, dts=[], full=False, timings=0, command="bench")
    started = perf_counter()
    with Journal(out) as journal, Clocked() as progress:
        carry_out(plan, Means(workers=2), journal, progress)
        archive = Archive.read(out)
        make_tables(archive, lambda _: None)
    made, inside = perf_counter(), sum(record["seconds"] for record in archive.records)
    print(f"{len(archive.records)} cells on 2 workers: {made - started:.1f} s, {inside:.1f} s of them in the engines")
    print(f"  tables {made - progress.last:.2f} s after the last cell (ceiling 3), {used()}")


def tables_again(folder: Path) -> None:
    """Print how long journal and tables take when all has been compared."""
    started = perf_counter()
    make_tables(Archive.read(folder / "out"), lambda _: None)
    print(f"  journal and tables again {perf_counter() - started:.2f} s (ceiling 3), {used()}")


def used() -> str:
    """Processor time and memory of this process and of its workers."""
    mine, theirs = (resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    seconds = [one.ru_utime + one.ru_stime for one in (mine, theirs)]
    return (
        f"processor {seconds[0]:.1f} s here and {seconds[1]:.1f} s in the workers, "
        f"memory {mine.ru_maxrss / 1e3:.0f} MB here (ceiling 300) and {theirs.ru_maxrss / 1e3:.0f} MB in the largest"
    )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        {"play_many": play_many, "tables_again": tables_again}[sys.argv[1]](Path(sys.argv[2]))
    else:
        overhead_of_large()
        overhead_of_small()
        with tempfile.TemporaryDirectory() as where:
            many_cells(Path(where))
