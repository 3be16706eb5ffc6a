"""The files of a run: journal, trajectories, scenes and tables in one folder.

journal.jsonl   a header, a line a cell as it ends, a footer; everything else is made from it
trajectories/   one .npz a cell, keys as the fields of `Trajectory`
scenes/         copies of the scene files
machine.json    machine, versions, command, seed
deviations.csv, runs.csv, report.html
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from adapters.play import Run
from reports.cells import Cell, scene_hash
from scenarios.model import Collisions, Scenario, Trajectory, frozen

FILES = ("journal.jsonl", "trajectories", "scenes", "machine.json", "deviations.csv", "runs.csv", "report.html",
         "limits.csv", "maps.csv", "laws.csv", "stability.html")  # fmt: skip
ARRAYS = ("t", "position", "velocity", "angle", "angular_velocity")
HITS = {"t": "collision_t", "i": "collision_i", "j": "collision_j", "impulse": "collision_impulse"}


@dataclass(frozen=True)
class Archive:
    """The folder of one run."""

    folder: Path

    @property
    def journal(self) -> Path:
        """Where the lines go."""
        return self.folder / "journal.jsonl"

    def begin(self, header: dict[str, Any]) -> None:
        """Make the folder and write the header, to the journal and to machine.json."""
        for name in ("trajectories", "scenes"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        self.append({"header": header})
        (self.folder / "machine.json").write_text(json.dumps(plain(header), indent=2) + "\n")

    def append(self, line: dict[str, Any]) -> None:
        """Add a line to the journal and flush it."""
        with self.journal.open("a") as journal:
            journal.write(json.dumps(plain(line), allow_nan=False) + "\n")

    def add(self, cell: Cell, scenario: Scenario, run: Run) -> None:
        """Add the line of a cell that has ended; its trajectory is already saved."""
        record = {
            "cell": cell.key(scenario),
            "scene_hash": scene_hash(scenario),
            "scene": cell.scene,
            "seed": cell.seed,
            "substeps": cell.substeps,
            "scenario": run.scenario,
            "engine": run.engine,
            "profile": run.profile,
            "dt_s": run.dt,
            "status": run.status,
            "reason": run.reason,
            "seconds": run.seconds,
            "settings": run.settings,
            "versions": run.versions,
        }
        self.append(record)

    def lines(self) -> Iterator[dict[str, Any]]:
        """The journal's lines; a last line that was torn by an interrupt is left out."""
        text = self.journal.read_text()
        for number, line in enumerate(text.splitlines()):
            try:
                yield json.loads(line)
            except json.JSONDecodeError as error:
                if number < text.count("\n"):
                    raise ValueError(f"{self.journal}: line {number + 1} is not JSON: {error}") from error

    def header(self) -> dict[str, Any]:
        """What `begin` wrote; raises `ValueError` if there is none."""
        header = next(self.lines(), {}).get("header")
        if header is None:
            raise ValueError(f"{self.journal}: has no header, so nothing was played")
        return header

    def parts(self, kind: str) -> list[Any]:
        """What the lines of one kind hold, in the order in which they were written."""
        return [line[kind] for line in self.lines() if kind in line]

    def records(self) -> list[dict[str, Any]]:
        """The lines of the cells that ended."""
        return [line for line in self.lines() if "cell" in line]

    def run(self, record: dict[str, Any]) -> Run:
        """The run behind a line, its trajectory read back if it has one."""
        path = self.folder / "trajectories" / f"{record['cell']}.npz"
        status, reason, trajectory = record["status"], record["reason"], None
        try:
            trajectory = load_trajectory(path) if path.exists() else None
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as fault:
            status, reason = "error", f"{path.name} cannot be read: {fault}"
        if status == "ok" and trajectory is None:
            status, reason = "error", f"{path.name} is missing"
        return Run(
            engine=record["engine"],
            profile=record["profile"],
            scenario=record["scenario"],
            dt=record["dt_s"],
            status=status,
            reason=reason,
            trajectory=trajectory,
            seconds=record["seconds"],
            settings={name: tuple(pair) for name, pair in record["settings"].items()},
            versions=record["versions"],
        )


def save_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write an .npz with the arrays of `Trajectory`; its hits as collision_t, _i, _j, _impulse."""
    arrays = {name: getattr(trajectory, name) for name in ARRAYS}
    hits = {key: getattr(trajectory.collisions, name) for name, key in HITS.items()}
    with path.open("wb") as file:
        np.savez(file, **arrays, **hits)


def load_trajectory(path: Path) -> Trajectory:
    """The inverse of `save_trajectory`."""
    with np.load(path) as saved:
        hits = Collisions(**{name: frozen(saved[key], saved[key].dtype) for name, key in HITS.items()})
        t, position, velocity, angle, angular_velocity = (frozen(saved[name]) for name in ARRAYS)
        return Trajectory(t, position, velocity, angle, angular_velocity, hits)


def plain(value: Any) -> Any:
    """The value as strict JSON can hold it: numpy scalars as Python's, numbers that are not finite as text."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
