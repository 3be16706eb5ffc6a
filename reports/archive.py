"""The files of a run, read back; everything is made from the journal and the trajectories.

journal.jsonl   a header, a line a cell as it ends, a footer; after a run was resumed, another header and footer
trajectories/   one .npz a cell, keys as the fields of `Trajectory`; of a cell that failed, up to its last good state
scenes/         copies of the scene files
machine.json    machine, versions, command, seed
made.json       what of all this was written by whom, so that nothing else is ever replaced
compared/       the scenarios' exact answers and shares of deviations.csv, so that a report does not measure again
deviations.csv, runs.csv, report.html
"""

from __future__ import annotations

import io
from collections.abc import Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile

import numpy as np

from adapters.play import Run
from reports.journal import JOURNAL, lines_of
from scenarios.model import Collisions, Scenario, State, Trajectory, frozen

FIELDS: dict[str, type | tuple[type, ...]] = {  # of the line of a cell
    "cell": str, "scene_hash": str, "scene": str, "seed": int, "substeps": int, "scenario": str, "engine": str,
    "profile": str, "dt_s": (int, float), "status": str, "reason": str, "step": int,
    "timeout_s": (int, float), "settings": dict, "versions": dict,
}  # fmt: skip
HEADER = ("versions", "seed", "scenes", "engines")
STATE = ("position", "velocity", "angle", "angular_velocity")
HITS = {"t": "collision_t", "i": "collision_i", "j": "collision_j", "impulse": "collision_impulse"}


@dataclass(frozen=True)
class Archive:
    """The folder of one run, as its journal has it; of two lines on one thing the later holds.

    Attributes:
        folder: where it is.
        header: command, seed, machine, versions, and what was asked for.
        records: the lines of the cells that ended.
        conformance: `engine:profile` -> its line.
        known_answers: the lines of the known answers that were made again.
        timings: key of a cell -> s, its timings, each taken alone.
        seconds: that the run took, up to now; NaN if it is not complete.
        complete: whether everything that was asked for has ended.
    """

    folder: Path
    header: dict[str, Any]
    records: list[dict[str, Any]]
    conformance: dict[str, dict[str, Any]]
    known_answers: list[dict[str, Any]]
    timings: dict[str, list[float]]
    seconds: float
    complete: bool

    @staticmethod
    def read(folder: Path) -> Archive:
        """Read the journal of a folder, once; raises `ValueError` if it cannot be used."""
        header: dict[str, Any] = {}
        last: dict[str, dict[Hashable, dict[str, Any]]] = {"cell": {}, "conformance": {}, "known_answer": {}}
        timings: dict[str, list[float]] = {}
        seconds, complete = 0.0, False
        for number, line in enumerate(lines_of(folder), 1):
            if fault := fault_of(line):
                raise ValueError(f"{folder / JOURNAL}: line {number} {fault}; delete it, or play again")
            complete = "footer" in line
            if complete:
                seconds += line["footer"]["seconds"]
            elif "header" in line:
                header = line["header"]
            elif "timing" in line:
                timings.setdefault(line["timing"], []).append(line["seconds"])
            elif "cell" in line:
                last["cell"][line["scene"], line["seed"], line["engine"], line["profile"], line["substeps"]] = line
            else:
                kind = "conformance" if "conformance" in line else "known_answer"
                last[kind][line["of"]] = line
        if not header:
            raise ValueError(f"{folder / JOURNAL}: has no header, so nothing was played")
        records, conformance, known = ([*last[kind].values()] for kind in last)
        records = [as_found(folder, record) for record in records]
        by_engine = {line["of"]: line for line in conformance}
        return Archive(
            folder, header, records, by_engine, known, timings, seconds if complete else float("nan"), complete
        )


def fault_of(line: Any) -> str:
    """What is wrong with a line of the journal, as the end of a sentence; "" if it can be used."""
    if not isinstance(line, dict):
        return "is no table"
    if "cell" in line:
        wrong = [name for name, kind in FIELDS.items() if not isinstance(line.get(name), kind)]
        return f"has no {wrong[0]} that can be used, of a cell" if wrong else ""
    if "header" in line:
        wrong = [name for name in HEADER if name not in line["header"]]
        return f"has no {wrong[0]} in its header" if wrong else ""
    known = "footer" in line or "timing" in line or "of" in line
    return "" if known else "is none of a header, a footer, a cell, a timing, an answer"


def as_found(folder: Path, record: dict[str, Any]) -> dict[str, Any]:
    """The line of a cell; an error where it was played and its trajectory is gone."""
    path = trajectory_file(folder, record["cell"])
    lost = record["status"] == "ok" and not path.exists()
    return record | {"status": "error", "reason": f"{path.name} is missing"} if lost else record


def run_of(folder: Path, record: dict[str, Any], with_trajectory: bool = True) -> Run:
    """The run behind a line, its trajectory read back if it has one and it is wanted."""
    path = trajectory_file(folder, record["cell"])
    status, reason, trajectory = record["status"], record["reason"], None
    try:
        trajectory = load_trajectory(path) if with_trajectory and path.exists() else None
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as fault:
        status, reason = "error", f"{path.name} cannot be read: {fault}"
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


def trajectory_file(folder: Path, key: str) -> Path:
    """Where the trajectory of the cell of that key is."""
    return folder / "trajectories" / f"{key}.npz"


def stored_scene(folder: Path, name: str) -> Path:
    """Where the copy of the scene file of that name is."""
    return folder / "scenes" / f"{name}.toml"


def packed(trajectory: Trajectory, small: bool = False) -> bytes:
    """An .npz with the arrays of `Trajectory`; its hits as collision_t, _i, _j, _impulse. A small one takes longer."""
    arrays = {name: getattr(trajectory, name) for name in ("t", *STATE)}
    hits = {key: getattr(trajectory.collisions, name) for name, key in HITS.items()}
    file = io.BytesIO()
    (np.savez_compressed if small else np.savez)(file, **arrays, **hits)
    return file.getvalue()


def load_trajectory(file: Path | BinaryIO) -> Trajectory:
    """What `packed` put into a file."""
    with np.load(file) as saved:
        hits = Collisions(**{name: frozen(saved[key], saved[key].dtype) for name, key in HITS.items()})
        t, position, velocity, angle, angular_velocity = (frozen(saved[name]) for name in ("t", *STATE))
        return Trajectory(t, position, velocity, angle, angular_velocity, hits)


def parts_of(state: State) -> list[np.ndarray]:
    """The arrays of a state, as a trail holds them."""
    return [np.ascontiguousarray(getattr(state, name), np.float64) for name in STATE]


def from_trail(trail: bytes, scenario: Scenario) -> Trajectory | None:
    """The samples whose `parts_of` a trail holds, without hits; None if it holds not even the start."""
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
