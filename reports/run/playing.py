"""What a worker does with a cell, and a trajectory as bytes: a file, or the trail of a cell that
did not end. This module imports little, so that a worker can be replaced quickly.

The clock of a cell (--timeout) starts with its first step. Before that the engine is imported,
compiled and loaded, which takes longer than most cells on a busy machine that plays it for the
first time.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.conformance.conform import Finding, conform
from crosscheck2d.adapters.conformance.probe import loaded, plain
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.host.process import keep_processes
from crosscheck2d.adapters.play import play_once, unwatched
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run.cells import Cell, source_hash, versions
from crosscheck2d.reports.run.pool import allow, leave
from crosscheck2d.scenarios.model import Collisions, Scenario, State, Trajectory, frozen

# s to import, compile and load an engine: up to 30 on an idle machine, for all engines the first
# time
LOADING = 300.0
STATE = ("position", "velocity", "angle", "angular_velocity")
COLLISIONS = {
    "t": "collision_t",
    "i": "collision_i",
    "j": "collision_j",
    "impulse": "collision_impulse",
}


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
    """In the worker: play a cell; every good state is appended to the trail."""
    allow(LOADING)
    keep_processes()  # a file plays many cells, and a process takes longer to start than most
    run = play_cell(cell, row, scenario, clocked(lambda state: leave(parts_of(state))))
    file, samples = (pack(run.trajectory), len(run.trajectory)) if run.trajectory else (b"", 0)
    return CellResult(replace(run, trajectory=None), samples, file, source_and_versions())


def conform_here(name: str, row: EngineRow) -> list[Finding]:
    """In the worker: the findings of the probes, whose clock starts when the engine is compiled."""
    allow(LOADING)
    with suppress(Exception), loaded(row, plain()):  # the probes report this exception again
        pass
    allow()
    return conform(name, row)


def source_and_versions() -> str:
    return repr((versions(), source_hash()))


def pack(trajectory: Trajectory) -> bytes:
    """An .npz with the arrays of `Trajectory`; its collisions as collision_t, _i, _j, _impulse."""
    arrays = {name: getattr(trajectory, name) for name in ("t", *STATE)}
    collisions = {key: getattr(trajectory.collisions, name) for name, key in COLLISIONS.items()}
    file = io.BytesIO()
    np.savez(file, **arrays, **collisions)
    return file.getvalue()


def load_trajectory(file: bytes) -> Trajectory:
    with np.load(io.BytesIO(file)) as saved:
        columns = {name: saved[key] for name, key in COLLISIONS.items()}
        collisions = Collisions(
            **{name: frozen(column, column.dtype) for name, column in columns.items()}
        )
        t, position, velocity, angle, angular_velocity = (
            frozen(saved[name]) for name in ("t", *STATE)
        )
        return Trajectory(t, position, velocity, angle, angular_velocity, collisions)


def parts_of(state: State) -> list[np.ndarray]:
    return [np.ascontiguousarray(getattr(state, name), np.float64) for name in STATE]


def from_trail(trail: bytes, scenario: Scenario) -> Trajectory | None:
    """The samples in a trail, without collisions; None if it lacks even the start."""
    n = scenario.scene.n
    k = len(trail) // (6 * n * 8)
    if not k:
        return None
    table = np.frombuffer(trail[: k * 6 * n * 8]).reshape(k, 6 * n)
    position, velocity, angle, angular_velocity = np.split(table, [2 * n, 4 * n, 5 * n], axis=1)
    return Trajectory(
        t=scenario.times[:k],
        position=frozen(position.reshape(k, n, 2)),
        velocity=frozen(velocity.reshape(k, n, 2)),
        angle=frozen(angle),
        angular_velocity=frozen(angular_velocity),
    )
