"""What a worker does with a cell. This module imports little, so that a worker can be replaced
quickly.

The clock of a cell (--timeout) starts with its first step. Before that the engine is imported,
compiled and loaded, which takes longer than most cells on a busy machine that plays it for the
first time.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

from crosscheck2d.adapters.conformance.conform import Finding, conform
from crosscheck2d.adapters.conformance.probe import loaded, plain
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.host.process import keep_processes
from crosscheck2d.adapters.play import play_once, unwatched
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run.cells import Cell, source_hash, versions
from crosscheck2d.reports.run.pool import allow, leave
from crosscheck2d.reports.run.trajectories import packed, parts_of
from crosscheck2d.scenarios.model import Scenario, State

# s to import, compile and load an engine: up to 30 on an idle machine, for all engines the first
# time
LOADING = 300.0


class CellResult(NamedTuple):
    """What a worker returns for a cell: the run, its trajectory packed into a file, and the
    `source_and_versions` that played it."""

    run: Run
    samples: int
    file: bytes
    played_by: str


def play_cell(
    cell: Cell, row: EngineRow, scenario: Scenario, watch: Callable[[State], None] = unwatched
) -> Run:
    """Play a cell here and now."""
    return play_once(row.make, cell.engine, scenario, scenario.dt(cell.substeps), watch)


def clocked(then: Callable[[State], None] = unwatched) -> Callable[[State], None]:
    """A function to call with every sample of a cell, which calls `then`. The first sample, when
    the engine is loaded, starts the clock of the cell."""
    begun = False

    def watch(state: State) -> None:
        nonlocal begun
        if not begun:
            begun = True
            allow()
        then(state)

    return watch


def play_here(cell: Cell, row: EngineRow, scenario: Scenario) -> CellResult:
    """In the worker: play, append every good state to the trail, and return the run with its
    trajectory packed."""
    allow(LOADING)
    keep_processes()  # a file plays many cells, and a process takes longer to start than most
    run = play_cell(cell, row, scenario, clocked(lambda state: leave(parts_of(state))))
    file, samples = (packed(run.trajectory), len(run.trajectory)) if run.trajectory else (b"", 0)
    return CellResult(replace(run, trajectory=None), samples, file, source_and_versions())


def conform_here(name: str, row: EngineRow) -> list[Finding]:
    """In the worker: the findings of the probes. The engine is loaded once before their clock
    starts, so that it is compiled."""
    allow(LOADING)
    with suppress(Exception), loaded(row, plain()):  # the probes report this exception again
        pass
    allow()
    return conform(name, row)


def source_and_versions() -> str:
    """The source hash and the versions with which this process plays."""
    return repr((versions(), source_hash()))
