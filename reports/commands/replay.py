"""`crosscheck replay CELL`: plays one cell again, step by step from its last good state, with the
output of its engine."""

from __future__ import annotations

import difflib
import io
import os
import pickle
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from adapters.engine_row import EngineRow
from adapters.engines import ENGINES, OWN, read_row, row_of
from reports.run.archive import Archive, stored_trajectory
from reports.run.arguments import go_where_files_are
from reports.run.cells import Cell
from reports.run.crew import new_worker
from reports.run.folders import found
from reports.run.playing import play_here
from reports.run.scenes import played_scenario
from reports.run.trajectories import STATE, from_trail, load_trajectory
from reports.run.worker_process import Failure
from reports.terminal.exits import DONE, FAILED, FolderTaken, refuse, say
from reports.terminal.foreign_text import legible
from scenarios.model import Scenario, Trajectory

REMEMBERED = ", the last good state (what the engine remembered of earlier steps is lost)"


def replay(
    name: str, out: Path, timeout: float, engines: Mapping[str, EngineRow] = ENGINES
) -> NoReturn:
    """Play the cell of the run in `out` whose key begins with `name`; exits 0, 1 (it failed again)
    or 2."""
    try:
        archive = Archive.read(found(Path(os.path.abspath(out))))
        record = record_of(archive, name)
        scenario = played_scenario(archive.folder, record)
        engine = f"{record['engine']}:{record['profile']}"
        go_where_files_are(archive.header, [engine])
        row = engines.get(engine) or (read_row if engine.endswith(OWN) else row_of)(engine)
        before = recorded(archive, record)
    except FolderTaken as fault:
        refuse([str(fault)])
    except KeyError as gone:
        refuse([f"{gone.args[0]} was played by another version, and this one does not know it"])
    except (OSError, ValueError) as fault:
        refuse([str(fault)])
    cell = Cell(record["scene"], record["seed"], engine, record["substeps"])
    if row.source and record["cell"] != cell.key(record["scene_hash"], row.source):
        say(
            f"{engine.removesuffix(OWN)}, or a version, has changed since the run; the present one"
            " is played"
        )
    k = len(before) - 1 if before is not None and record["status"] != "ok" else 0
    substeps = record["substeps"]
    show(f"{record['scenario']}  {record['engine']}:{record['profile']}  dt {record['dt_s']:.4g} s")
    show(f"was:     {ending(record['status'], record['reason'])}")
    show(
        f"from:    step {k * substeps}, {scenario.times[k]:g} s{REMEMBERED if k else ', the start'}"
    )
    status, reason, after = again(record, row, continued(scenario, substeps, before, k), timeout)
    step = k * substeps + (len(after) - 1 if after is not None else 0)
    since = f" (times from {scenario.times[k]:g} s on)" if k and reason else ""
    show(f"now:     {ending(status, reason)}{since}")
    show(f"reached: step {step} of {scenario.intervals * substeps}, {step * record['dt_s']:g} s")
    if record["status"] == status == "ok":
        show(f"bits:    {'as' if same(before, after, substeps) else 'not as'} recorded")
    sys.exit(DONE if status == "ok" else FAILED)


def show(line: str) -> None:
    """Print one line and flush it, so that the output of the engine comes after it."""
    print(legible(line), flush=True)


def ending(status: str, reason: str) -> str:
    """How a cell ended."""
    return f"{status}: {reason}" if reason else status


def record_of(archive: Archive, name: str) -> dict[str, Any]:
    """The line of the one cell whose key begins with `name`; raises `ValueError` with similar
    keys."""
    keys = {record["cell"]: record for record in archive.records}
    matching = [key for key in keys if key.startswith(name)]
    if len(matching) == 1:
        return keys[matching[0]]
    failed = [key for key, record in keys.items() if record["status"] not in ("ok", "unsupported")]
    near = matching or difflib.get_close_matches(name, keys, n=3, cutoff=0.5) or failed
    named = ", ".join(f"{key} ({keys[key]['scenario']} {keys[key]['engine']})" for key in near[:3])
    why = "is no cell" if not matching else f"begins the names of {len(matching)} cells"
    hint = (
        f"did you mean {named}?"
        if near
        else f"see the column cell of {archive.folder / 'runs.csv'}"
    )
    raise ValueError(f"{name!r} {why} of {archive.folder}; {hint}")


def continued(scenario: Scenario, substeps: int, before: Trajectory | None, k: int) -> Scenario:
    """The rest of a scenario from its sample `k` on, sampled at every step."""
    start, dt = float(scenario.times[k]), scenario.dt(substeps)
    scene = scenario.scene
    if before is not None and k:
        scene = replace(scene, **{name: getattr(before, name)[k] for name in STATE})
    return replace(
        scenario,
        scene=scene,
        sample_interval=dt,
        duration=max(1, scenario.intervals - k) * substeps * dt,
        substeps=(1,),
        thrusts=[
            replace(thrust, start=max(0.0, thrust.start - start), stop=thrust.stop - start)
            for thrust in scenario.thrusts
            if thrust.stop > start
        ],
        truth=None,
    )


def again(
    record: dict[str, Any], row: EngineRow, scenario: Scenario, timeout: float
) -> tuple[str, str, Trajectory | None]:
    """Status, reason and trajectory, from a new process whose output the user sees."""
    cell = Cell(record["scene"], record["seed"], f"{record['engine']}:{record['profile']}", 1)
    worker = new_worker(memory=0, show=True)
    try:
        outcome = worker.do(partial(play_here, cell, row, scenario), timeout)
    finally:
        worker.close()
    if outcome is None:
        left = from_trail(worker.left(), scenario)
        return "crashed", "its process was ended from outside", left
    if isinstance(outcome, bytes):
        outcome = pickle.loads(outcome)
    if isinstance(outcome, Failure):
        return outcome.status, outcome.reason, from_trail(outcome.trail, scenario)
    played = load_trajectory(io.BytesIO(outcome.file)) if outcome.file else None
    return outcome.run.status, outcome.run.reason, played


def recorded(archive: Archive, record: dict[str, Any]) -> Trajectory | None:
    """The samples of a cell in the run; None if there are none."""
    if record["damage"]:
        say(
            f"{archive.folder / 'trajectories'}: {record['damage']}, so the cell is played from the"
            " start"
        )
    return stored_trajectory(archive.folder, record)


def same(before: Trajectory | None, after: Trajectory | None, substeps: int) -> bool:
    """Whether a cell sampled at every step has the bits of its record."""
    if before is None or after is None:
        return before is after
    return all(
        getattr(before, name).tobytes() == getattr(after, name)[::substeps].tobytes()
        for name in STATE
    )
