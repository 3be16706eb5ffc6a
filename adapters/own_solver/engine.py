"""A user's own solver file as an engine: an Exercise.js or a solver.py, driven step by step in a
separate process."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse, NotLoaded, Unsupported
from crosscheck2d.adapters.engine_row import FLOAT64, EngineRow
from crosscheck2d.adapters.friction import must_be_frictionless
from crosscheck2d.adapters.own_solver.file import SolverFailed, SolverText
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.adapters.own_solver.restitution import EXERCISE, restitution_of
from crosscheck2d.scenarios.model import Array, Scene, State

NEEDED = {"integrate": "integrate", "collide": "sphereSphereCollisionHandling"}
STEP_LIMIT = 30.0  # s that one call for several steps may take
BEGIN_LIMIT = 2.0  # s that initScene may take


class OwnSolver:
    """Plays the text of a file in a separate process; later changes of the file do not matter.

    A file with `advance` is played with it, in all scenes of the reference solver. For any other
    file `integrate` is called for all spheres, `sphereSphereCollisionHandling` for every pair i <
    j, then the wrap; whatever they do is played. Its restitution is a constant in the file, so a
    scene with another one is refused. So are walls and static disks, which the exercise does not
    have, and scenes that need a function that the file lacks.

    patience: s that a call for some steps may take after the first, in which a file may still be
        compiled.
    collected: steps are requested together with the next `read`: a frame under thrust is one
        exchange with the process instead of one per step.
    """

    listening, wrapping = True, 0.0

    def __init__(
        self, solver: SolverText, patience: float = STEP_LIMIT, collected: bool = False
    ) -> None:
        self.solver, self.path, self.patience, self.limit = (
            solver,
            solver.path,
            patience,
            STEP_LIMIT,
        )
        self.collected = collected
        self.started: SolverProcess | None = None

    @property
    def process(self) -> SolverProcess:
        """The process, started when first needed; raises `NotLoaded` if the file cannot be
        loaded."""
        if self.started is None:
            try:
                self.started = SolverProcess(self.solver, compiled=True)
            except SolverFailed as failure:
                raise NotLoaded(f"{self.path.name} {failure}") from None
            self.whole = self.started.surface != "exercise"
            if not self.whole:
                make_globals(self.started)
                self.restitution = restitution_of(self.solver, self.started)
        return self.started

    @property
    def own_restitution(self) -> float:
        """The restitution of the file; that of the exercise if its text has none, or if it takes
        any. Raises `Unsupported` if the file cannot be loaded."""
        if self.process.surface == "advance" or self.restitution.own is None:
            return EXERCISE
        return self.restitution.own

    def load(self, scene: Scene, dt: float) -> None:
        """Make the scene's spheres; raises `Unsupported` for features that the exercise does not
        have."""
        must_be_frictionless(scene, self.path.name)
        process = self.process
        self.forget(scene)
        if self.whole:
            fields = {
                name: None if value is None else np.asarray(value).tolist()
                for name, value in vars(scene).items()
            }
            process.do("whole_load", {"scene": fields, "dt": dt}, STEP_LIMIT)
            return
        self.refuse(scene)
        wrap = None if scene.wrap is None else scene.wrap.ravel().tolist()
        spheres = spheres_of(scene)
        process.do(
            "load", {"spheres": spheres, "dt": dt, "gravity": scene.gravity.tolist(), "wrap": wrap}
        )

    def forget(self, scene: Scene) -> None:
        """Forget the previous scene: forces, requested steps, collisions and states."""
        self.forces = np.zeros((scene.n, 3))
        self.asked: list[dict[str, Any]] = []
        self.log: list[ContactImpulse] = []
        self.rows: Array | None = None

    def do(self, command: str, argument: Any, limit: float) -> Any:
        """One request to the process; raises `SolverFailed`."""
        return self.process.do(command, argument, limit)

    def refuse(self, scene: Scene) -> None:
        """Raise `Unsupported` for a missing function, walls, disks that cannot move, another
        restitution."""
        needed = NEEDED if scene.n > 1 else {"integrate": NEEDED["integrate"]}
        missing = [name for key, name in needed.items() if not self.process.functions[key]]
        if missing:
            raise Unsupported(f"{self.path.name} has no function {' and no '.join(missing)}")
        if len(scene.walls):
            raise Unsupported("the exercise has no walls")
        if scene.static.any():
            raise Unsupported("the exercise has no disks that cannot move")
        if scene.n > 1 and not self.restitution.fits(scene.restitution):
            raise Unsupported(
                f"the file has e = {self.restitution.own:.3g}, the scene needs"
                f" {scene.restitution:g}"
            )

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Add to the force and torque of the next step."""
        self.forces[disk] += [*force, torque]

    def step(self, count: int = 1) -> None:
        """One request for all the steps, at once or, if `collected`, with the next `read`."""
        forces = self.forces.tolist() if self.forces.any() else None
        single = forces is not None and count == 1 and not self.whole
        last = self.asked[-1] if self.asked else {}
        if single and last.get("held") and last["forces"] == forces:
            last["count"] += 1  # a frame under thrust: one list of forces, not one for each step
        else:
            self.asked.append({"count": count, "forces": forces, "held": single})
        self.forces[:] = 0.0
        self.rows = None
        if not self.collected:
            for steps in self.take():
                self.do("whole_step" if self.whole else "step", steps, self.limit)
            self.limit = self.patience

    def take(self) -> list[dict[str, Any]]:
        """Return the steps not yet requested, and mark them as requested."""
        asked, self.asked = self.asked, []
        return asked

    def look(self) -> Array:
        """(n, 12) or (n, 6) numbers of the spheres or the arrays; also records collisions."""
        if self.rows is None:
            what = {"steps": self.take(), "heard": len(self.log)}
            answer = self.do("whole_play" if self.whole else "play", what, self.limit)
            self.limit = self.patience
            self.rows = np.array(answer["rows"], float)
            self.log += [
                ContactImpulse(int(step), int(i), int(j), impulse)
                for step, i, j, impulse in answer["collisions"]
            ]
        return self.rows

    def read(self) -> State:
        """From the arrays, or from the spheres' fields."""
        rows = self.look()
        angle, spin = (4, 5) if self.whole else (6, 7)
        return State(*(rows[:, part].copy() for part in (slice(0, 2), slice(2, 4), angle, spin)))

    def collisions(self) -> list[ContactImpulse]:
        """The collisions that `advance` reported, or every call of the collision function that
        changed a velocity."""
        self.look()
        return self.log

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """The settings that the file decides."""
        own = "the scene's" if self.whole else str(self.restitution)
        order = "the file's own advance" if self.whole else "integrate all, every pair i < j, wrap"
        return {"restitution": (None, own), "order of a step": (None, order), **self.of_file()}

    def of_file(self) -> dict[str, tuple[Any, Any]]:
        """The file, and the modules that it imports from its folder."""
        files = ", ".join(file for file, _ in self.solver.imported)
        which = {"file": (str(self.path), f"sha256 {self.solver.digest}")}
        if not files:
            return which
        return which | {"from beside it": (None, f"{files}; sha256 of all {self.solver.source}")}

    def versions(self) -> dict[str, str]:
        """The versions of the language's engine."""
        return self.process.versions

    def close(self) -> None:
        """End the process."""
        if self.started is not None:
            self.started.close()
            self.started = None


def make_globals(process: SolverProcess) -> None:
    """Let the file make its own scene, as the exercise's page does before the first step, because
    its functions may use `ufo` or `asteroids`."""
    if process.functions["begin"]:
        with suppress(SolverFailed):  # a function that needs them fails with its own message
            process.do("begin", None, BEGIN_LIMIT)


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


def row_of_solver(solver: SolverText, patience: float, collected: bool) -> EngineRow:
    """The engine row of a solver's text."""
    return EngineRow(
        partial(OwnSolver, solver, patience, collected),
        f"your own solver, {solver.path}",
        1.0,
        FLOAT64,
        source=solver.source,
        exercise=True,
    )
