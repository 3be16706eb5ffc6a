"""A guest behind the protocol of an engine: an npm package, an engine of somebody's own, a solver
of the exercise; each is driven in a process of its own, by the same messages."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from crosscheck2d.adapters.advance import Foreseen
from crosscheck2d.adapters.engine import SILENT, ContactImpulse, NotLoaded, Unsupported
from crosscheck2d.adapters.engine_row import FLOAT64, EngineRow
from crosscheck2d.adapters.float32 import must_fit, rounding
from crosscheck2d.adapters.friction import must_be_frictionless, of_shapes
from crosscheck2d.adapters.host.file import (
    LONGEST,
    SolverFailed,
    SolverText,
    imported_by,
    printable,
    read_solver,
)
from crosscheck2d.adapters.host.process import SolverProcess
from crosscheck2d.adapters.host.restitution import EXERCISE, restitution_of
from crosscheck2d.adapters.host.surface import (
    ENGINE,
    HOW,
    features_of,
    holder_of,
    is_engine,
    must_be_either,
    must_model,
    refusal,
)
from crosscheck2d.adapters.library_at_version import LibraryAtVersion, NotInstalled
from crosscheck2d.adapters.npm_packages import pinned_file, text_of, version_of
from crosscheck2d.scenarios.model import Array, Scene, State

HERE = Path(__file__).parent
TEMPLATES = {"javascript": HERE / "template.js", "python": HERE / "template.py"}
AROUND = {"javascript": HERE / "ball.js.j2", "python": HERE / "ball.py.j2"}  # a ball code
EXERCISES = {"javascript": HERE / "exercise.js", "python": HERE / "exercise.py"}
STEP_LIMIT = 30.0  # s that one call for several steps may take; twice that for a package
CREATE_LIMIT = 10.0  # s that `create` may take
BEGIN_LIMIT = 2.0  # s that initScene may take
# The relative rounding that the probes allow: that of an engine that stores a velocity as the
# difference of two positions some 1e-4 m apart.
ROUNDING = 2.0**-36
ARRAYS = ("position", "velocity", "radius", "angle", "angular_velocity", "walls", "gravity")
NEEDED = {"integrate": "integrate", "collide": "sphereSphereCollisionHandling"}
CALLED = {"load": "create", "step": "step", "play": "step or read"}


def scene_message(scene: Scene, dt: float, **more: Any) -> dict[str, Any]:
    """A scene as every guest gets it: plain lists in SI units, with None for infinite numbers (mass
    and inertia of a static disk)."""

    def plain(values: Array) -> list[float | None]:
        return [float(x) if np.isfinite(x) else None for x in values]

    return {
        "n": scene.n,
        "dt": dt,
        **{name: getattr(scene, name).tolist() for name in ARRAYS},
        "mass": plain(scene.mass),
        "inertia": plain(scene.inertia),
        "box": box_of(scene.walls),
        "restitution": scene.restitution,
        "friction": scene.friction,
        "wrap": None if scene.wrap is None else scene.wrap.tolist(),
        "listening": True,
        **more,
    }


def box_of(walls: Array) -> list[list[float]] | None:
    if len(walls) != 4:
        return None
    low, high = walls.min(axis=(0, 1)).tolist(), walls.max(axis=(0, 1)).tolist()
    corners = [low, [high[0], low[1]], high, [low[0], high[1]]]
    sides = {frozenset(map(tuple, side)) for side in zip(corners, corners[1:] + corners[:1])}
    made = {frozenset(map(tuple, wall)) for wall in walls.tolist()}
    return [low, high] if made == sides else None


class GuestEngine:
    """Plays the text of a guest in a separate process; later changes of the file do not matter.

    patience: s that a call for some steps may take after the first, in which a file may still be
        compiled.
    collected: steps are requested together with the next `read`: a frame under thrust is one
        exchange with the process instead of one per step.

    Attributes:
        inside: s that V8 took for the steps so far, of the time of `step`: the rest is the exchange
            with the process.
    """

    listening, wrapping = True, 0.0
    load_limit = CREATE_LIMIT
    own_restitution = EXERCISE  # of the exercise's game: any file but a solver's takes any

    def __init__(
        self, solver: SolverText, patience: float = STEP_LIMIT, collected: bool = False
    ) -> None:
        self.solver, self.path = solver, solver.path
        self.patience, self.limit, self.collected = patience, STEP_LIMIT, collected
        self.inside = 0.0
        self.started: SolverProcess | None = None

    @property
    def process(self) -> SolverProcess:
        if self.started is None:
            try:
                self.started = SolverProcess(self.solver, compiled=True)
                self.learn(self.started)
            except SolverFailed as failure:
                raise NotLoaded(f"{self.path.name} {failure}") from None
        return self.started

    def learn(self, process: SolverProcess) -> None:
        pass

    def load(self, scene: Scene, dt: float) -> None:
        assert self.process  # it is started, and known
        self.refuse(scene)
        self.scene, self.forces = scene, np.zeros((scene.n, 3))
        self.requested: list[dict[str, Any]] = []
        self.log: list[ContactImpulse] = []
        self.rows: Array | None = None
        self.steps = 0
        self.resolved = self.do("load", self.message(scene, dt), self.load_limit)

    def refuse(self, scene: Scene) -> None:
        """Raise `Unsupported` for a scene that the guest cannot play."""

    def message(self, scene: Scene, dt: float) -> dict[str, Any]:
        return scene_message(scene, dt, listening=self.listening)

    def do(self, command: str, argument: Any, limit: float) -> Any:
        return self.process.do(command, argument, limit)

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        if not self.scene.static[disk]:
            self.forces[disk] += [*force, torque]

    def step(self, count: int = 1) -> None:
        forces = self.forces.tolist() if self.forces.any() else None
        single = forces is not None and count == 1
        request = {"count": count, "forces": forces, "held": single}
        last = self.requested[-1] if self.requested else {}
        self.forces[:] = 0.0
        self.steps += count
        self.rows = None
        if not self.collected:
            self.inside += self.do("step", request, self.limit) or 0.0
            self.limit = self.patience
        elif single and last.get("held") and last["forces"] == forces:
            last["count"] += 1  # a frame under thrust: one list of forces, not one for each step
        else:
            self.requested.append(request)

    def look(self) -> Array:
        """(n, 6) x, y, u, v, angle, spin; also records collisions."""
        if self.rows is None:
            requested, self.requested = self.requested, []
            self.rows = self.readings(self.do("play", requested, self.limit))[0]
            self.limit = self.patience
        return self.rows

    def readings(self, answer: dict[str, Any]) -> Array:
        numbers, shape = answer["numbers"], (answer["readings"], self.scene.n, 6)
        rows, heard = np.split(numbers, [np.prod(shape)])
        self.log += [
            ContactImpulse(int(step), int(i), int(j), float(impulse))
            for step, i, j, impulse in heard.reshape(-1, 4)
        ]
        return rows.reshape(shape)

    def read(self) -> State:
        rows = self.look()
        return State(*(rows[:, part].copy() for part in (slice(0, 2), slice(2, 4), 4, 5)))

    def collisions(self) -> list[ContactImpulse]:
        """What the guest reported, and for a solver of the exercise every call of the collision
        function that changed a velocity."""
        self.look()
        return [collision for collision in self.log if collision.step < self.steps]

    def settings(self) -> dict[str, tuple[Any, Any]]:
        return {name: (wanted, value) for name, wanted, value in self.resolved}

    def of_file(self) -> dict[str, tuple[Any, Any]]:
        files = ", ".join(file for file, _ in self.solver.imported)
        which = {"file": (str(self.path), f"sha256 {self.solver.digest}")}
        if not files:
            return which
        return which | {"from beside it": (None, f"{files}; sha256 of all {self.solver.source}")}

    def versions(self) -> dict[str, str]:
        return self.process.versions

    def close(self) -> None:
        if self.started is not None:
            self.started.close()
            self.started = None


class PackageEngine(GuestEngine):
    """planck, matter, Rapier or Box2D: `NAME.js` of this folder, which drives an npm package.

    Its file says what the profiles choose; `changed` are keys of that choice, or friction;
    `library` is another version than the pinned one. The driver does the wrap, and its time is in
    that of `step`.
    """

    load_limit = 2 * STEP_LIMIT

    def __init__(
        self,
        name: str,
        package: str,
        profile: str,
        *,
        float32: bool = False,
        library: LibraryAtVersion | None = None,
        **changed: Any,
    ) -> None:
        self.package, self.profile, self.changed = package, profile, changed
        self.library, self.float32 = library, float32
        file = HERE / f"{name}.js"
        text = file.read_text(encoding="utf-8")
        super().__init__(SolverText(file, "javascript", text, "", engine=True))
        self.limit = self.patience = 2 * STEP_LIMIT

    @property
    def process(self) -> SolverProcess:
        if self.started is None:
            name, library = self.package, self.library
            try:
                text = library.text(pinned_file(name)) if library else text_of(name)
                versions = library.versions if library else {name: version_of(name)}
                self.solver = replace(self.solver, package=text, versions=versions)
            except NotInstalled as reason:
                raise NotLoaded(f"{name}: {reason}") from None
        return super().process

    def refuse(self, scene: Scene) -> None:
        if self.float32:
            must_fit(scene)
        self.expected, self.thrown = (0, 0), None
        self.ahead = deque[Array]()

    def message(self, scene: Scene, dt: float) -> dict[str, Any]:
        friction = of_shapes(scene, self.profile == "matched", self.changed.get("friction"))
        chosen = {"profile": self.profile, "changed": self.changed, "own_friction": friction}
        return super().message(scene, dt) | chosen

    def do(self, command: str, argument: Any, limit: float) -> Any:
        try:
            return super().do(command, argument, limit)
        except SolverFailed as failure:
            raise refused(failure) from None

    def expect(self, count: int, times: int, thrusts: Sequence[Foreseen] = ()) -> None:
        """The next `times` calls are `step(count)`, each followed by `read`, and only `thrusts`
        act: all of them are played in as few exchanges as can be, of some tenths of a second
        each."""
        acting = [thrust for thrust in thrusts if not self.scene.static[thrust.disk]]
        self.expected, self.thrusts = (count, times), sorted(acting, key=lambda row: row.step)

    def step(self, count: int = 1) -> None:
        expected, times = self.expected
        if not times or expected != count or self.forces.any():
            if self.ahead:
                raise ValueError("steps were expected that have been played, and do not come")
            self.expected = (0, 0)
            super().step(count)
            return
        self.steps += count
        if not self.ahead and self.thrown is None:
            argument = {"count": count, "times": times, "thrusts": self.thrusts}
            answer = self.do("ahead", argument, self.limit)
            self.inside += answer["seconds"]
            self.ahead.extend(self.readings(answer))
            self.thrown = answer["thrown"]
        if not self.ahead:
            assert self.thrown is not None
            raise refused(self.thrown)
        self.expected = (count, times - 1)
        self.rows = self.ahead.popleft()

    def readings(self, answer: dict[str, Any]) -> Array:
        rows, scene = super().readings(answer).copy(), self.scene
        turning = (scene.angle, scene.angular_velocity)
        start = np.column_stack([scene.position, np.zeros((scene.n, 2)), *turning])
        rows[:, scene.static] = start[scene.static]
        return rows

    def settings(self) -> dict[str, tuple[Any, Any]]:
        rows = super().settings()
        if self.float32:
            rows["float32 rounding of the start in m"] = (None, rounding(self.scene))
        return rows


def refused(failure: SolverFailed) -> Exception:
    return Unsupported(failure.what) if failure.kind == "refused" else failure


class OwnEngine(GuestEngine):
    """Plays an engine's file; a scene that needs more than its line `models` is refused, naming
    what is missing.

    A fault of the file is a `SolverFailed` that names file, function, what was returned and what is
    expected. A number that is not finite ends a run as "diverged".
    """

    def learn(self, process: SolverProcess) -> None:
        if missing := [name for name in ENGINE if not process.functions[name]]:
            raise SolverFailed("error", f"has no function {' and no '.join(missing)}; {HOW}")
        self.models = features_of(process.functions["models"])

    def refuse(self, scene: Scene) -> None:
        must_model(scene, self.models, self.path.name)

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        needed = ["forces", "rotation"] if torque else ["forces"]
        if missing := [word for word in needed if word not in self.models]:
            raise Unsupported(refusal(self.path.name, missing))
        super().apply_force(disk, force, torque)

    def do(self, command: str, argument: Any, limit: float) -> Any:
        try:
            return super().do(command, argument, limit)
        except SolverFailed as failure:
            if failure.kind == "refused":
                what = printable(failure.what[:LONGEST])
                raise Unsupported(f"{self.path.name} refuses the scene: {what}") from None
            if failure.kind == "crashed":
                failure.what = f"{CALLED[command]} was called: {failure.what}"
            elif not failure.what.startswith(("create ", "step ", "read ", "collisions ")):
                failure.what = f"{CALLED[command]} {failure.what}"  # where it was is not known
            failure.what = f"{self.path.name}: {failure.what}"
            raise

    def settings(self) -> dict[str, tuple[Any, Any]]:
        return {
            "models": (None, ", ".join(self.models)),
            "restitution": (None, "the scene's"),
            "order of a step": (None, "the file's own step"),
            **({} if self.process.functions["collisions"] else {"collisions": (None, SILENT)}),
            **super().settings(),
            **self.of_file(),
        }


class OwnSolver(GuestEngine):
    """Plays a solver of the exercise.

    A file with `advance` is played with it, in all scenes of the reference solver. For any other
    file `integrate` is called for all spheres, `sphereSphereCollisionHandling` for every pair i <
    j, then the wrap; whatever they do is played. Its restitution is a constant in the file, so a
    scene with another one is refused. So are walls and static disks, which the exercise does not
    have, and scenes that need a function that the file lacks.
    """

    load_limit = STEP_LIMIT

    def learn(self, process: SolverProcess) -> None:
        self.whole = process.surface == "advance"
        if not self.whole:
            if process.functions["begin"]:  # as the exercise's page does before the first step
                with suppress(SolverFailed):  # a function that needs it fails with its own message
                    process.do("begin", None, BEGIN_LIMIT)
            self.restitution = restitution_of(self.solver, process)
            if self.restitution.own is not None:
                self.own_restitution = self.restitution.own

    def refuse(self, scene: Scene) -> None:
        must_be_frictionless(scene, self.path.name)
        if self.whole:
            return
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

    def settings(self) -> dict[str, tuple[Any, Any]]:
        own = "the scene's" if self.whole else str(self.restitution)
        order = "the file's own advance" if self.whole else "integrate all, every pair i < j, wrap"
        return {"restitution": (None, own), "order of a step": (None, order), **self.of_file()}


def row_of_file(path: Path, patience: float = STEP_LIMIT, collected: bool = False) -> EngineRow:
    """The row of a file in its present state, an engine or a solver of the exercise; raises
    `NotASolver`. Its own user plays it: it may import what is installed."""
    solver = read_solver(path)
    holder = holder_of(solver)
    engine = holder is not None or is_engine(solver)
    if not engine:
        must_be_either(solver)
    texts = [solver.text, *(text for _, text in solver.imported)] * (solver.kind == "python")
    packages = tuple(sorted(set[str]().union(*map(imported_by, texts))))
    solver = replace(solver, engine=engine, holder=holder, packages=packages)
    make = OwnEngine if engine else OwnSolver
    return EngineRow(
        partial(make, solver, patience, collected),
        f"your own {'engine' if engine else 'solver'}, {path}",
        nan if engine else 1.0,
        ROUNDING if engine else FLOAT64,
        source=solver.source,
        exercise=not engine,
    )
