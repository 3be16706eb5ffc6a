"""What a worker does with a cell. It imports little: a worker that has to be replaced is soon there again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from adapters.engines import Row
from adapters.play import Run, play, unwatched
from reports.archive import packed, parts_of
from reports.cells import Cell, source_hash, versions
from reports.worker_process import leave
from scenarios.model import Scenario, State


class Played(NamedTuple):
    """What a worker sends back of a cell: the run, its trajectory packed into a file, and by what it was played."""

    run: Run
    samples: int
    file: bytes
    played_by: str


def play_cell(cell: Cell, row: Row, scenario: Scenario, watch: Callable[[State], None] = unwatched) -> Run:
    """Play a cell here and now; the engine is closed again, whatever happens."""
    try:
        engine = row.make()
    except ImportError as missing:
        reason = f"{missing.name or missing} cannot be imported: {missing}"
        return Run(*cell.names, scenario.name, scenario.dt(cell.substeps), "unsupported", reason)
    try:
        return play(engine, cell.engine, scenario, scenario.dt(cell.substeps), watch)
    finally:
        engine.close()


def play_here(cell: Cell, row: Row, scenario: Scenario) -> Played:
    """In the worker: play, leave every good state behind, and send back the run with its trajectory packed."""
    run = play_cell(cell, row, scenario, watch=lambda state: leave(parts_of(state)))
    file, samples = (packed(run.trajectory), len(run.trajectory)) if run.trajectory else (b"", 0)
    return Played(replace(run, trajectory=None), samples, file, player())


def time_here(cell: Cell, row: Row, scenario: Scenario) -> float:
    """In the worker: s inside the engine's `step`."""
    return play_cell(cell, row, scenario).seconds


def player() -> str:
    """By which source and versions this process plays."""
    return repr((versions(), source_hash()))
