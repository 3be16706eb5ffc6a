"""The timing pass of a run: when every cell has ended, one process times the steps in interleaved
rounds, while no other task runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import ceil, log2
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.pool import allow
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.stepping import CALL, EMPTY, READ, binding_of, overheads, step_through
from crosscheck2d.reports.run.timing import WARM_UP, Noise, Sample, Timed, interleaved, noise_of
from crosscheck2d.scenarios.model import Scenario

TIMINGS = 12.0  # s that it may take unless it is said otherwise
ROUNDS = 9  # rounds at most, without the warm-up
SCENES = (
    "free_fall",  # flight
    "oblique_e09",  # one collision
    "cradle_with_gaps",  # a row
    "column_of_ten",  # a stack
    "asteroids",  # the exercise's own scene
    "gas_of_100",  # a crowd
    "frictional_box",  # a crowd with friction
)
"""Scenes with different kinds of work, at least one for each situation of the report."""
# Disks times steps, over all step sizes of a scene: if a scene has more, only its first part is
# timed, the same for every engine, because the cost of a second of a stack changes with time.
WORK = 30_000  # all engines together take 1.5 s in a round
# s: a longer part is not timed again, its cost is that of the cell as played
SLOW = 0.1
SHARE = 0.1  # s after which a cell skips the remaining rounds, except the first three
BUSY = 0.10  # with a higher noise floor no times are shown
STARTING = 120.0  # s to import and compile the engines, before the first round

TABLE = "timings.csv"
COLUMNS = [
    "scenario",
    "engine",
    "profile",
    "dt_s",
    "timed_s",
    "rounds",
    "cost_us_per_s",
    "low_us_per_s",
    "high_us_per_s",
    "binding_us_per_s",
    "read_us",
    "wrapping_us_per_s",
    "again_us_per_s",
]
"""The columns of timings.csv: µs of engine time per simulated second (median and quartiles of the
rounds); `binding`, the part that the same number of steps and calls takes in an empty world; µs of
one read-out; `again`, the same cell timed a second time in the same rounds, if it was."""


class CellToTime(NamedTuple):
    """A cell of the run that the timing pass times: its key, its engine, and the scenario without
    its answer."""

    key: str
    name: str
    row: EngineRow
    scenario: Scenario
    substeps: int
    seconds: float  # s that it took as played

    @property
    def part(self) -> Scenario:
        """The scenario, or the first part of it with `WORK` disk steps."""
        scenario = self.scenario
        work = scenario.scene.n * scenario.intervals * sum(scenario.substeps)
        # Halved, so that other step sizes time the same part if they can.
        halvings = max(0, ceil(log2(max(work, 1) / WORK)))
        samples = max(1, scenario.intervals // 2**halvings)
        return replace(scenario, duration=samples * scenario.sample_interval)


def cells_to_time(results: RunResults, engines: Mapping[str, EngineRow]) -> list[CellToTime]:
    """The cells to be timed: those of `timed_scenes` that were played to their end by the present
    source of their engine."""
    played = [record for record in results.records if record["status"] == "ok"]
    there = {record["scene"] for record in played}
    sources = results.sources
    chosen = timed_scenes([scene for scene in results.header["scenes"] if scene in there])
    scenarios = {scene: replace(sources[scene].scenario(), truth=None) for scene in chosen}
    cells = []
    for record in played:
        name, scene = f"{record['engine']}:{record['profile']}", record["scene"]
        if scene in scenarios and name in engines:
            cell = Cell(scene, record["seed"], name, record["substeps"])
            if record["cell"] == cell.key(record["scene_hash"], engines[name].source):
                times = record["substeps"], record["seconds"]
                what = record["cell"], name, engines[name], scenarios[scene]
                cells.append(CellToTime(*what, *times))
    return cells


def timed_scenes(played: Sequence[str]) -> list[str]:
    known = [scene for scene in SCENES if scene in played]
    return [*known, *(scene for scene in played if scene not in SCENES)][: len(SCENES)]


def time_cells(cells: Sequence[CellToTime], seconds: float, seed: int) -> list[dict[str, Any]]:
    """In a worker: time these cells, and the overhead of their engines, within `seconds`. A
    line for each thing timed; none if not even the warm-up fits into the time.

    Cells at the middle step size of a scene are timed twice, which gives the noise floor. A
    slow cell is not timed again: its time as played is an upper bound, because collisions were
    recorded.
    """
    allow(seconds + STARTING)
    started = perf_counter()
    what, slow = [], []
    for cell in cells:
        part = cell.part
        if cell.seconds * part.duration / cell.scenario.duration > SLOW:
            cost, until = [cell.seconds / cell.scenario.duration], cell.scenario.duration
            slow.append(line_of(("timing", cell.key, 0, until), cost, [0.0]))
            continue
        run = partial(step_through, cell.row.make, part, cell.substeps)
        for copy in range(1 + (cell.substeps == cell.scenario.middle_substeps)):
            key = ("timing", cell.key, copy, part.duration)
            what.append(Timed(key, run, part.duration))
    what += overheads_of(cells)
    left = seconds - (perf_counter() - started)  # importing the engines counts, too
    rounds: dict[Any, list[Sample]] = {}
    for sample in interleaved(what, ROUNDS, SHARE, seed, left):
        rounds.setdefault(sample.key, []).append(sample)
    lines = []
    for key, samples in rounds.items():
        # without the warm-up; with it if there are no others
        counted = [sample for sample in samples if sample.round != WARM_UP] or samples
        costs = [sample.cost for sample in counted]
        lines.append(line_of(key, costs, [sample.wrapping for sample in counted]))
    return [*lines, *slow] if lines else []


def line_of(key: tuple[Any, ...], cost: list[float], wrapping: list[float]) -> dict[str, Any]:
    if key[0] == "timing":
        _, cell, copy, until = key
        return {"timing": cell, "copy": copy, "timed_s": until, "cost": cost, "wrapping": wrapping}
    _, what, name, scene = key
    return {"overhead": what, "of": name, "scenario": scene, "cost": cost}


def overheads_of(cells: Sequence[CellToTime]) -> list[Timed]:
    """The empty steps, calls and read-outs of all engines that accept an empty world."""
    timed: dict[Any, Timed] = {}
    for cell in cells:
        for what, run, amount in overheads(cell.row.make, cell.scenario):
            # Only a read-out depends on the scene.
            key = ("overhead", what, cell.name, cell.scenario.name if what == READ else "")
            timed.setdefault(key, Timed(key, run, amount))
    return [one for one in timed.values() if can(one)]


def can(timed: Timed) -> bool:
    with suppress(Exception):
        timed.run()
        return True
    return False


def is_busy(results: RunResults) -> bool:
    return noise_floor(results).floor > BUSY


def timings(results: RunResults) -> pd.DataFrame:
    rows: list[tuple[Any, ...]] = []
    scenarios: dict[str, Scenario] = {}
    for record in results.records:
        lines = results.timings.get(record["cell"], {})
        if 0 not in lines:
            continue
        line, name = lines[0], f"{record['engine']}:{record['profile']}"
        low, cost, high = np.percentile(line["cost"], [25, 50, 75])
        again = lines.get(1, {}).get("cost", [np.nan])
        scene = record["scene"]
        scenario = scenarios[scene] = scenarios.get(scene) or results.sources[scene].scenario()
        rows.append(
            (
                record["scenario"],
                record["engine"],
                record["profile"],
                record["dt_s"],
                line["timed_s"],
                len(line["cost"]),
                *(1e6 * value for value in (cost, low, high)),
                1e6 * binding(results, name, scenario, record["substeps"]),
                1e6 * median_of(results.overheads.get((READ, name, scenario.name))),
                1e6 * float(np.median(line["wrapping"])),
                1e6 * float(np.median(again)),
            )
        )
    return pd.DataFrame(rows, columns=COLUMNS)


def binding(results: RunResults, name: str, scenario: Scenario, substeps: int) -> float:
    """s per simulated second that the steps and calls of an engine take in an empty world; nan if
    that is not known."""
    step, singly = (median_of(results.overheads.get((what, name, ""))) for what in (EMPTY, CALL))
    return binding_of(step, singly, scenario, substeps)


def median_of(costs: Sequence[float] | None) -> float:
    return float(np.median(costs)) if costs else np.nan


def noise_floor(results: RunResults) -> Noise:
    pairs = [lines for lines in results.timings.values() if {0, 1} <= lines.keys()]
    return noise_of([median_of(pair[1]["cost"]) / median_of(pair[0]["cost"]) for pair in pairs])
