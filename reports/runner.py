"""Plays cells in worker processes that may abort or hang without taking the others along."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, TimeoutError, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from pebble import ProcessExpired, ProcessPool

from adapters.play import Run
from reports.archive import save_trajectory
from reports.cells import Cell

TIMEOUT = 60.0  # s a cell may take


def play_all(
    cells: Sequence[tuple[Cell, str]],
    trajectories: Path,
    workers: int,
    failed: Callable[[Cell, str, str], Run],
    timeout: float = TIMEOUT,
) -> Iterator[tuple[Cell, str, Run]]:
    """Play (cell, key) pairs; yield (cell, key, run) as each ends, its trajectory saved and dropped.

    `failed(cell, status, reason)` gives the run of a cell whose worker died or was stopped after `timeout` s.
    """
    # Spawned, not forked: an engine's threads and global settings must not come along from the parent.
    pool = ProcessPool(max_workers=workers, initializer=leave_interrupts_to_parent, context=get_context("spawn"))
    try:
        futures: dict[Future, tuple[Cell, str]] = {}
        for cell, key in cells:
            futures[pool.schedule(play_and_save, args=(cell, trajectories / f"{key}.npz"), timeout=timeout)] = cell, key
        for future in as_completed(futures):
            cell, key = futures[future]
            try:
                run = future.result()
            except TimeoutError:
                run = failed(cell, "timeout", f"stopped after {timeout:g} s")
            except ProcessExpired as death:
                run = failed(cell, "crashed", f"worker died: {name_of_exit(death.exitcode)}")
            except Exception as error:  # play() makes runs of an engine's errors: this one is ours, and is shown
                run = failed(cell, "error", f"{type(error).__name__}: {error}")
            yield cell, key, run
        pool.close()
    finally:
        pool.stop()
        pool.join()


def play_and_save(cell: Cell, path: Path) -> Run:
    """In the worker: play, save the trajectory, and send back the rest."""
    run = cell.play()
    if run.trajectory is not None:
        save_trajectory(path, run.trajectory)
    return replace(run, trajectory=None)


def leave_interrupts_to_parent() -> None:
    """Ctrl-C goes to the whole group of processes; the parent alone decides what it means."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def name_of_exit(code: int) -> str:
    """The signal behind a negative exit code, or the code."""
    return signal.Signals(-code).name if code < 0 else f"exit status {code}"
