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


def time_cells(cells: Sequence[CellToTime], seconds: float, seed: int) -> dict[str, Any]:
    """In a worker: time these cells, and the overhead of their engines, within `seconds`; {} if not
    even the warm-up fits into the time.

    cells: key of a cell -> `timed_s`, its `cost` and `wrapping` in each round in s per simulated
    second; of those at the middle step size of a scene also the cost when timed `again`, which
    gives the noise floor. overheads: `overhead_key` -> s in each round, see stepping.py. A slow
    cell is not timed again: its time as played is an upper bound, because collisions were recorded.
    """
    allow(seconds + STARTING)
    started = perf_counter()
    what, slow = [], {}
    parts = {cell.key: cell.part for cell in cells}
    for cell in cells:
        part, duration = parts[cell.key], cell.scenario.duration
        if cell.seconds * part.duration / duration > SLOW:
            cost = [cell.seconds / duration]
            slow[cell.key] = {"timed_s": duration, "cost": cost, "wrapping": [0.0]}
            continue
        run = partial(step_through, cell.row.make, part, cell.substeps)
        for copy in range(1 + (cell.substeps == cell.scenario.middle_substeps)):
            what.append(Timed((cell.key, copy), run, part.duration))
    what += overheads_of(cells)
    left = seconds - (perf_counter() - started)  # importing the engines counts, too
    rounds: dict[Any, list[Sample]] = {}
    for sample in interleaved(what, ROUNDS, SHARE, seed, left):
        rounds.setdefault(sample.key, []).append(sample)
    timed: dict[str, dict[str, Any]] = {}
    overheads = {}
    for key, samples in rounds.items():
        # without the warm-up; with it if there are no others
        counted = [sample for sample in samples if sample.round != WARM_UP] or samples
        cost = [sample.cost for sample in counted]
        if isinstance(key, str):
            overheads[key] = cost
            continue
        cell, copy = key
        times = timed.setdefault(cell, {"timed_s": parts[cell].duration})
        if copy:
            times["again"] = cost
        else:
            times |= {"cost": cost, "wrapping": [sample.wrapping for sample in counted]}
    return {"cells": timed | slow, "overheads": overheads} if rounds else {}


def overhead_key(what: str, name: str, scenario: str) -> str:
    return f"{what} of {name}" + f" in {scenario}" * (what == READ)  # which depends on the scene


def overheads_of(cells: Sequence[CellToTime]) -> list[Timed]:
    """The empty steps, calls and read-outs of all engines that accept an empty world."""
    timed: dict[Any, Timed] = {}
    for cell in cells:
        for what, run, amount in overheads(cell.row.make, cell.scenario):
            key = overhead_key(what, cell.name, cell.scenario.name)
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
        times, name = results.times.get(record["cell"]), f"{record['engine']}:{record['profile']}"
        if times is None:
            continue
        low, cost, high = np.percentile(times["cost"], [25, 50, 75])
        scene = record["scene"]
        scenario = scenarios[scene] = scenarios.get(scene) or results.sources[scene].scenario()
        rows.append(
            (
                record["scenario"],
                record["engine"],
                record["profile"],
                record["dt_s"],
                times["timed_s"],
                len(times["cost"]),
                *(1e6 * value for value in (cost, low, high)),
                1e6 * binding(results, name, scenario, record["substeps"]),
                1e6 * overhead(results, READ, name, scenario.name),
                1e6 * float(np.median(times["wrapping"])),
                1e6 * float(np.median(times.get("again", np.nan))),
            )
        )
    return pd.DataFrame(rows, columns=COLUMNS)


def binding(results: RunResults, name: str, scenario: Scenario, substeps: int) -> float:
    """s per simulated second that the steps and calls of an engine take in an empty world; nan if
    that is not known."""
    step, singly = (overhead(results, what, name, scenario.name) for what in (EMPTY, CALL))
    return binding_of(step, singly, scenario, substeps)


def overhead(results: RunResults, what: str, name: str, scenario: str) -> float:
    costs = results.timing.get("overheads", {}).get(overhead_key(what, name, scenario))
    return float(np.median(costs)) if costs else np.nan


def noise_floor(results: RunResults) -> Noise:
    pairs = [times for times in results.times.values() if "again" in times]
    return noise_of([np.median(pair["again"]) / np.median(pair["cost"]) for pair in pairs])
