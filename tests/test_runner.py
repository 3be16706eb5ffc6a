"""Cells in worker processes: what aborts, hangs or raises takes nothing along."""

import ctypes
import os
from dataclasses import dataclass
from pathlib import Path

from adapters.play import Run
from reports.archive import load_trajectory
from reports.cells import Cell
from reports.runner import play_all


@dataclass(frozen=True)
class Misbehaving(Cell):
    """A cell whose engine does what engines do."""

    how: str = ""

    def play(self) -> Run:
        """Abort, hang in C, exit, or raise where nobody expects it."""
        if self.how == "abort":
            os.abort()
        if self.how == "hang":
            ctypes.CDLL(None).sleep(1000)
        if self.how == "raise":
            raise RuntimeError("no such luck")
        return super().play()


def failed(cell: Cell, status: str, reason: str) -> Run:
    """The run of a cell that did not come back."""
    return Run(*cell.engine.split(":"), cell.scene, 0.0, status, reason)  # type: ignore[arg-type]


def test_what_aborts_hangs_or_raises_is_named_and_every_good_cell_is_kept(tmp_path: Path):
    """Six cells on two workers, three of them bad: three good trajectories, three statuses with their reasons."""
    names = ("", "abort", "", "hang", "raise", "")
    cells = [(Misbehaving("slow_hit", 0, "reference:exercise", 1, how), f"{k}") for k, how in enumerate(names)]
    runs = {key: run for _, key, run in play_all(cells, tmp_path, 2, failed, timeout=8.0)}

    assert [runs[f"{k}"].status for k in range(6)] == ["ok", "crashed", "ok", "timeout", "error", "ok"]
    assert "SIGABRT" in runs["1"].reason
    assert "8 s" in runs["3"].reason
    assert "no such luck" in runs["4"].reason
    assert {path.stem for path in tmp_path.iterdir()} == {"0", "2", "5"}


def test_a_trajectory_comes_back_from_its_file_bit_for_bit(tmp_path: Path):
    """The .npz holds every array of the trajectory and its hits."""
    cell = Cell("line_gas", 0, "pymunk:matched", 1)
    [(_, _, run)] = play_all([(cell, "one")], tmp_path, 1, failed)
    here = cell.play().trajectory
    there = load_trajectory(tmp_path / "one.npz")

    assert here is not None
    assert run.trajectory is None
    for name in ("t", "position", "velocity", "angle", "angular_velocity"):
        assert getattr(here, name).tobytes() == getattr(there, name).tobytes()
    for name in ("t", "i", "j", "impulse"):
        assert getattr(here.collisions, name).tobytes() == getattr(there.collisions, name).tobytes()
