"""A user's own engine behind the protocol: its file is played step by step in a separate
process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import SILENT, Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.own_engine.features import must_model, refusal
from crosscheck2d.adapters.own_engine.surface import is_engine, must_be_either
from crosscheck2d.adapters.own_solver.engine import STEP_LIMIT, OwnSolver, row_of_solver
from crosscheck2d.adapters.own_solver.file import (
    LONGEST,
    SolverFailed,
    SolverText,
    printable,
    read_solver,
)
from crosscheck2d.adapters.own_solver.restitution import EXERCISE
from crosscheck2d.scenarios.model import Array, Scene

TEMPLATES = {
    "javascript": Path(__file__).parent / "template.js",
    "python": Path(__file__).parent / "template.py",
}
CREATE_LIMIT = 10.0  # s that `create` may take
# The relative rounding that the probes allow: that of an engine that stores a velocity as the
# difference of two positions some 1e-4 m apart.
ROUNDING = 2.0**-36
NAMED = ("create ", "step ", "read ", "collisions ")
CALLED = {"whole_load": "create", "whole_step": "step", "whole_play": "step or read"}


@dataclass(frozen=True)
class EngineText(SolverText):
    """The text of an engine's file; its process plays it with create, step and read."""

    engine = True

    def load(self, copies: Path | None) -> Any:
        """The object that answers the commands, in the calling process; raises `SolverFailed`."""
        if self.kind == "javascript":
            from crosscheck2d.adapters.own_engine.javascript import JavaScriptFile

            return JavaScriptFile(self)
        from crosscheck2d.adapters.own_engine.python import PythonFile

        return PythonFile(self, copies)


class OwnEngine(OwnSolver):
    """Plays an engine's file; a scene that needs more than its line `models` is refused, naming
    what is missing.

    A fault of the file is a `SolverFailed` that names file, function, what was returned and what is
    asked. A number that is not finite ends a run as "diverged".
    """

    @property
    def own_restitution(self) -> float:
        """The restitution of the exercise's game; the file takes any."""
        return EXERCISE

    def load(self, scene: Scene, dt: float) -> None:
        """Let the file create a world; raises `Unsupported` if it does not model the scene, or
        refuses it."""
        self.models: Sequence[str] = self.process.functions["models"]
        must_model(scene, self.models, self.path.name)
        self.forget(scene)
        what = {"scene": to_json(scene), "dt": dt, "listening": self.listening}
        if refused := self.do("whole_load", what, CREATE_LIMIT):
            raise Unsupported(f"{self.path.name} refuses the scene: {printable(refused[:LONGEST])}")

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Add to the forces of the next step; raises `Unsupported` if the file does not model
        forces."""
        more = [word for word in self.missing(torque) if word not in self.models]
        if more:
            raise Unsupported(refusal(self.path.name, more))
        super().apply_force(disk, force, torque)

    def missing(self, torque: float) -> list[str]:
        """The features that a thrust needs and the file does not model."""
        return ["forces", "rotation"] if torque else ["forces"]

    def do(self, command: str, argument: Any, limit: float) -> Any:
        """The answer of the process; a failure names the file."""
        try:
            return super().do(command, argument, limit)
        except SolverFailed as failure:
            if failure.kind == "crashed":
                failure.what = f"{CALLED[command]} was called: {failure.what}"
            elif not failure.what.startswith(NAMED):  # the place where it was stopped is not known
                failure.what = f"{CALLED[command]} {failure.what}"
            failure.what = f"{self.path.name}: {failure.what}"
            raise

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """The settings that the file decides."""
        return {
            "models": (None, ", ".join(self.models)),
            "restitution": (None, "the scene's"),
            "order of a step": (None, "the file's own step"),
            **({} if self.process.functions["collisions"] else {"collisions": (None, SILENT)}),
            **self.of_file(),
        }


def to_json(scene: Scene) -> dict[str, Any]:
    """A scene in the form that an engine's file gets: plain lists, with None for infinite numbers
    (mass and inertia of a static disk)."""

    def plain(values: Array) -> list[float | None]:
        return [float(x) if np.isfinite(x) else None for x in values]

    return {
        "n": scene.n,
        "position": scene.position.tolist(),
        "velocity": scene.velocity.tolist(),
        "radius": scene.radius.tolist(),
        "mass": plain(scene.mass),
        "inertia": plain(scene.inertia),
        "angle": scene.angle.tolist(),
        "angular_velocity": scene.angular_velocity.tolist(),
        "walls": scene.walls.tolist(),
        "gravity": scene.gravity.tolist(),
        "restitution": scene.restitution,
        "friction": scene.friction,
        "wrap": None if scene.wrap is None else scene.wrap.tolist(),
    }


def row_of_file(path: Path, patience: float = STEP_LIMIT, collected: bool = False) -> EngineRow:
    """The row of a file in its present state, an engine or a solver of the exercise; raises
    `NotASolver`."""
    solver = read_solver(path)
    if not is_engine(solver):
        must_be_either(solver)
        return row_of_solver(solver, patience, collected)
    engine = EngineText(**vars(solver))
    return EngineRow(
        partial(OwnEngine, engine, patience, collected),
        f"your own engine, {path}",
        nan,
        ROUNDING,
        source=engine.source,
    )
