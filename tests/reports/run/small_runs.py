"""A run of two scenes, one of them a file, on two engines, made in this process and so within a
second or two; and the words of runs that are disturbed."""

from contextlib import closing
from pathlib import Path

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.run import suite
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import reading, writing
from crosscheck2d.reports.run.suite import Means, RunPlan
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.rows import Rows

PLAYED = ("pymunk:shipped", "pymunk:matched")
# 24 cells of ms
SMALL = [
    "run",
    "slow_collision",
    "near_miss",
    "--engine",
    "reference:exercise",
    "--engine",
    "pymunk",
]
# 24 cells, of 0.1 s or more
LONG = "run asteroids --timings 0 --engine reference:exercise --engine reference:lesson"
LONG = [*LONG.split(), "--engine", "pymunk", "--engine", "box2d"]


def plan_of(scene_file: Path, timings: float = 0.0) -> RunPlan:
    rows = {name: ENGINES[name] for name in PLAYED}
    scenes = ["slow_collision", str(scene_file)]
    return RunPlan(scenes, rows, 0, [], False, timings, "made by a test")


def make(folder: Path, scene_file: Path, timings: float = 0.0) -> Path:
    with writing(folder, COMMAND) as store, Progress() as progress:
        suite.carry_out(plan_of(scene_file, timings), Means(2), store, progress)
    return folder


def read(folder: Path) -> RunResults:
    with reading(folder, COMMAND) as store:
        return RunResults.read(store)


def cells_in(folder: Path, kind: str = "cell") -> int:
    try:
        with closing(Rows(folder / "results.sqlite", writing=False)) as rows:
            return len(rows.keys(kind))
    except (OSError, ValueError):
        return 0
