"""Cells in worker processes: what aborts, hangs or raises takes nothing along."""

import ctypes
import os
from functools import partial
from pathlib import Path

from reports.archive import load_trajectory
from reports.cells import Cell
from reports.runner import Failure, run_all
from reports.suite import play_and_save


def abort() -> None:
    """As an engine does on an assertion in C."""
    os.abort()


def hang() -> None:
    """In C, where no Python signal handler runs."""
    ctypes.CDLL(None).sleep(1000)


def fail() -> None:
    """As an engine does whose binding is older than its library."""
    raise RuntimeError("no such luck")


def test_what_aborts_hangs_or_raises_is_named_and_every_good_task_is_kept():
    """Six tasks on two workers, three of them bad: three results, three failures with their reasons."""
    tasks = {0: partial(pow, 2, 3), 1: abort, 2: partial(pow, 2, 4), 3: hang, 4: fail, 5: partial(pow, 2, 5)}
    ended = dict(run_all(tasks, workers=2, timeout=8.0))

    assert {key: result for key, result in ended.items() if not isinstance(result, Failure)} == {0: 8, 2: 16, 5: 32}
    assert [ended[key].status for key in (1, 3, 4)] == ["crashed", "timeout", "error"]
    assert "SIGABRT" in ended[1].reason
    assert "8 s" in ended[3].reason
    assert "no such luck" in ended[4].reason


def test_a_trajectory_comes_back_from_its_file_bit_for_bit(tmp_path: Path):
    """The .npz holds every array of the trajectory and its hits."""
    cell = Cell("line_gas", 0, "pymunk:matched", 1)
    [(_, run)] = run_all({cell: partial(play_and_save, cell, tmp_path / "one.npz")}, workers=1)
    here = cell.play().trajectory
    there = load_trajectory(tmp_path / "one.npz")

    assert here is not None
    assert run.trajectory is None
    for name in ("t", "position", "velocity", "angle", "angular_velocity"):
        assert getattr(here, name).tobytes() == getattr(there, name).tobytes()
    for name in ("t", "i", "j", "impulse"):
        assert getattr(here.collisions, name).tobytes() == getattr(there.collisions, name).tobytes()
