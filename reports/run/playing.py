"""What a worker does with a cell. It imports little: a worker that has to be replaced is soon there
again.

The clock of a cell (--timeout) starts when its first step is due. Before, the engine is imported,
compiled and loaded, which on a machine that plays it for the first time, and is busy, takes longer
than most cells.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

from adapters.conformance.conform import Finding, conform
from adapters.conformance.probe import loaded, plain
from adapters.engine_row import EngineRow
from adapters.play import play_once, unwatched
from adapters.run import Run
from reports.run.archive import packed, parts_of
from reports.run.cells import Cell, source_hash, versions
from reports.run.worker_process import allow, leave
from scenarios.model import Scenario, State

# s to import, compile and load an engine: up to 30 idle, all of them the first time
LOADING = 300.0


class CellResult(NamedTuple):
    """What a worker sends back of a cell: the run, its trajectory packed into a file, and by what
    it was played."""

    run: Run
    samples: int
    file: bytes
    played_by: str


def play_cell(
    cell: Cell, row: EngineRow, scenario: Scenario, watch: Callable[[State], None] = unwatched
) -> Run:
    """Play a cell here and now."""
    return play_once(row.make, cell.engine, scenario, scenario.dt(cell.substeps), watch)


class Begun:
    """Is given the samples of a cell as it is played: with the first, when the engine is loaded,
    the clock of the cell begins."""

    def __init__(self, then: Callable[[State], None] = unwatched) -> None:
        self.begun, self.then = False, then

    def __call__(self, state: State) -> None:
        """Start the clock once, then do what is to be done with every state."""
        if not self.begun:
            self.begun = True
            allow()
        self.then(state)


def play_here(cell: Cell, row: EngineRow, scenario: Scenario) -> CellResult:
    """In the worker: play, leave every good state behind, and send back the run with its trajectory
    packed."""
    allow(LOADING)
    run = play_cell(cell, row, scenario, Begun(lambda state: leave(parts_of(state))))
    file, samples = (packed(run.trajectory), len(run.trajectory)) if run.trajectory else (b"", 0)
    return CellResult(replace(run, trajectory=None), samples, file, engine())


def conform_here(name: str, row: EngineRow) -> list[Finding]:
    """In the worker: what the probes find; before their clock starts the engine is loaded once, and
    so compiled."""
    allow(LOADING)
    with suppress(Exception), loaded(row, plain()):  # which the probes will meet again, and say
        pass
    allow()
    return conform(name, row)


def engine() -> str:
    """By which source and versions this process plays."""
    return repr((versions(), source_hash()))
