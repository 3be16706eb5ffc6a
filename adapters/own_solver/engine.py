"""Somebody's own solver file as an engine: an Exercise.js or a solver.py, driven step by step in
its own process."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import ContactImpulse, Unsupported
from adapters.engine_row import FLOAT64, EngineRow
from adapters.own_solver.file import SolverFailed, SolverText, read_solver
from adapters.own_solver.process import SolverProcess
from scenarios.model import Array, Scene, State

NEEDED = {"integrate": "integrate", "collide": "sphereSphereCollisionHandling"}
STEP_LIMIT = 30.0  # s that one call for some steps may take
# largest difference between the file's restitution and the scene's: that of a constant written 0.9
REST = 1e-3


class Student:
    """Plays the text of a file in a process of its own, whatever becomes of the file.

    One with `advance` is played by it and plays what the reference solver plays. Of any other the
    functions `integrate` and `sphereSphereCollisionHandling` are called: all spheres, every pair i
    < j, then the wrap. Its restitution is written into it, so a scene that needs another is
    refused, as are walls and disks that cannot move, which the exercise does not have.

    patience: s that a call for some steps may take after the first, in which a file may still be
        compiled.
    """

    listening, wrapping = True, 0.0

    def __init__(self, solver: SolverText, patience: float = STEP_LIMIT) -> None:
        self.solver, self.path, self.patience, self.limit = (
            solver,
            solver.path,
            patience,
            STEP_LIMIT,
        )
        self.started: SolverProcess | None = None

    @property
    def process(self) -> SolverProcess:
        """The process, started when it is first needed; raises `Unsupported` if the file cannot be
        loaded."""
        if self.started is None:
            try:
                self.started = SolverProcess(self.solver, compiled=True)
            except SolverFailed as failure:
                raise Unsupported(f"{self.path.name} {failure}") from None
        return self.started

    def load(self, scene: Scene, dt: float) -> None:
        """Make the scene's spheres; raises `Unsupported` for what the exercise has not."""
        self.whole = self.process.surface == "advance"
        self.forces = np.zeros((scene.n, 3))
        if self.whole:
            fields = {
                name: None if value is None else np.asarray(value).tolist()
                for name, value in vars(scene).items()
            }
            self.process.do("whole_load", {"scene": fields, "dt": dt}, STEP_LIMIT)
            return
        self.restitution = read_restitution(self.process)
        self.refuse(scene)
        wrap = None if scene.wrap is None else scene.wrap.ravel().tolist()
        spheres = spheres_of(scene)
        self.process.do(
            "load", {"spheres": spheres, "dt": dt, "gravity": scene.gravity.tolist(), "wrap": wrap}
        )

    def refuse(self, scene: Scene) -> None:
        """Raise `Unsupported` for a missing function, walls, disks that cannot move, another
        restitution."""
        missing = [name for key, name in NEEDED.items() if not self.process.functions[key]]
        if missing:
            raise Unsupported(f"{self.path.name} has no function {' and no '.join(missing)}")
        if len(scene.walls):
            raise Unsupported("the exercise has no walls")
        if scene.static.any():
            raise Unsupported("the exercise has no disks that cannot move")
        if scene.n > 1 and self.restitution == -1:
            raise Unsupported(
                f"{self.path.name} lets spheres that meet go on as they were: its collisions do"
                " nothing"
            )
        if scene.n > 1 and not abs(self.restitution - scene.restitution) <= REST:
            raise Unsupported(
                f"the file has e = {self.restitution:.3g}, the scene needs {scene.restitution:g}"
            )

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Add to what acts during the next step."""
        self.forces[disk] += [*force, torque]

    def step(self, count: int = 1) -> None:
        """One request for all the steps."""
        forces = self.forces.tolist() if self.forces.any() else None
        self.process.do(
            "whole_step" if self.whole else "step", {"count": count, "forces": forces}, self.limit
        )
        self.limit = self.patience
        self.forces[:] = 0.0

    def read(self) -> State:
        """From the arrays, or from the spheres' fields."""
        rows = np.array(self.process.do("whole_read" if self.whole else "read"), float)
        angle, spin = (4, 5) if self.whole else (6, 7)
        return State(
            *(
                np.ascontiguousarray(rows[:, part])
                for part in (slice(0, 2), slice(2, 4), angle, spin)
            )
        )

    def collisions(self) -> list[ContactImpulse]:
        """What `advance` reported, or every call of the collision function that changed a
        velocity."""
        rows = self.process.do("whole_collisions" if self.whole else "collisions")
        return [ContactImpulse(int(step), int(i), int(j), impulse) for step, i, j, impulse in rows]

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """What the file decides."""
        own = "the scene's" if self.whole else f"{self.restitution:.6g}, written into the file"
        order = "the file's own advance" if self.whole else "integrate all, every pair i < j, wrap"
        beside = ", ".join(file for file, _ in self.solver.beside)
        return {
            "restitution": (None, own),
            "order of a step": (None, order),
            "file": (str(self.path), f"sha256 {self.solver.digest}"),
        } | (
            {"from beside it": (None, f"{beside}; sha256 of all {self.solver.source}")}
            if beside
            else {}
        )

    def versions(self) -> dict[str, str]:
        """Of the language's engine."""
        return self.process.versions

    def close(self) -> None:
        """End the process."""
        if self.started is not None:
            self.started.close()
            self.started = None


def spheres_of(scene: Scene) -> list[list[float]]:
    """The 12 numbers of every disk: position, velocity, force, alpha, angularVelocity, torque,
    mass, MoI, size."""
    none = np.zeros((scene.n, 1))
    columns = (
        scene.position,
        scene.velocity,
        none,
        none,
        scene.angle[:, None],
        scene.angular_velocity[:, None],
        none,
        scene.mass[:, None],
        scene.inertia[:, None],
        scene.radius[:, None],
    )
    rows: list[list[float]] = np.hstack(columns).tolist()
    return rows


def read_restitution(process: SolverProcess) -> float:
    """The e of a file, from two equal spheres that meet head-on at 2 m/s; NaN where no collision
    comes out of it."""
    pair = [
        [-0.45, 0.0, 1.0, *[0.0] * 6, 1.0, 1.0, 0.5],
        [0.45, 0.0, -1.0, *[0.0] * 6, 1.0, 1.0, 0.5],
    ]
    try:
        answer = process.do(
            "ask", {"spheres": pair, "calls": [["collide", 0, 1]], "world": False}, 1.0
        )
    except SolverFailed:
        return float("nan")
    if answer["error"] or not answer["states"]:
        return float("nan")
    a, b = answer["states"][-1]
    return float(b[2] - a[2]) / 2.0


def engine_file(path: Path, patience: float = STEP_LIMIT) -> EngineRow:
    """The row of `ENGINES` that a solver's file, as it is now, stands for; raises `NotASolver` if
    the path is none."""
    solver = read_solver(path)
    return EngineRow(
        partial(Student, solver, patience),
        f"your own solver, {path}",
        1.0,
        FLOAT64,
        source=solver.source,
    )
