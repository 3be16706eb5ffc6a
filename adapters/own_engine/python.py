"""Plays an engine.py in this process: create, step, read and collisions of its module."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf, isinf, nan
from operator import index
from types import ModuleType
from typing import Any

import numpy as np

from crosscheck2d.adapters.own_engine.features import features_of
from crosscheck2d.adapters.own_engine.surface import ENGINE, HOW
from crosscheck2d.adapters.own_solver.file import SolverFailed
from crosscheck2d.adapters.own_solver.python import PythonSolver, seed
from crosscheck2d.adapters.own_solver.spheres import Fields

SHOWN = 60  # characters of a returned value in a message
COLLISION = "asked are rows [i, j] or [i, j, impulse]: disk i; disk j, or wall w as -1 - w; N s"


class PythonFile(PythonSolver):
    """The file as a module of this process. Raises `SolverFailed` if it is no engine."""

    def take(self, module: ModuleType) -> None:
        """Take the functions and the line `models` of the module."""
        self.surface, self.whole, self.inside = "engine", self, ""
        self.file: dict[str, Callable[..., Any]] = {
            name: value
            for name in (*ENGINE, "collisions")
            if callable(value := vars(module).get(name))
        }
        if lacking := [name for name in ENGINE if name not in self.file]:
            raise SolverFailed("error", f"has no function {' and no '.join(lacking)}; {HOW}")
        for name, function in self.file.items():
            if inspect.isgeneratorfunction(function) or inspect.iscoroutinefunction(function):
                raise SolverFailed(
                    "error", f"{name} is an async def, or has a yield: it runs nothing"
                )
        self.functions = {
            "models": features_of(getattr(module, "models", None)),
            "collisions": "collisions" in self.file,
        }

    @contextmanager
    def guarded(self, limit: float, when: str) -> Iterator[None]:
        """As for a solver; a failure inside a function names that function."""
        self.inside = ""
        try:
            with super().guarded(limit, when):
                yield
        except SolverFailed as failure:
            if self.inside and not failure.what.startswith(f"{self.inside} "):
                verb = "raised " if failure.what[:1].isupper() else ""
                failure.what = f"{self.inside} {verb}{failure.what}"
            raise

    def call(self, name: str, *arguments: Any) -> Any:
        """Call a function of the file and return its result."""
        self.inside = name
        return self.file[name](*arguments)

    def whole_load(self, argument: dict[str, Any]) -> str:
        """Create a world; if the file returns a text instead, that is its reason to refuse the
        scene."""
        seed()
        scene = argument["scene"]
        for name in ("mass", "inertia"):
            scene[name] = [inf if x is None else x for x in scene[name]]
        self.n, self.walls, self.dt = scene["n"], len(scene["walls"]), argument["dt"]
        self.angle, self.steps = np.array(scene["angle"]), 0
        self.hears = argument["listening"] and "collisions" in self.file
        self.log: list[list[float]] = []
        self.world = self.call("create", Fields(**scene), self.dt)
        return self.world if isinstance(self.world, str) else ""

    def whole_play(self, argument: dict[str, Any]) -> dict[str, Any]:
        """Call `whole_step` several times, then return the state and the collisions from number
        `heard` on."""
        for step in argument["steps"]:
            self.whole_step(step)
        return {"rows": self.rows(), "collisions": self.log[argument["heard"] :]}

    def whole_step(self, argument: dict[str, Any]) -> None:
        """`count` steps; forces act in the first."""
        forces = argument["forces"] or self.none()
        for _ in range(argument["count"]):
            self.call("step", self.world, self.dt, forces)
            if self.hears:
                self.hear()
            self.steps += 1
            forces = self.none()

    def none(self) -> list[list[float]]:
        """No force on any disk."""
        return [[0.0, 0.0, 0.0] for _ in range(self.n)]

    def hear(self) -> None:
        """Record the collisions of this step."""
        found = self.call("collisions", self.world)
        if not isinstance(found, (list, tuple, np.ndarray)):
            raise wrong("collisions", found, COLLISION)
        for one in found:
            try:
                i, j, *impulse = one
                row = [self.steps, index(i), index(j), float(impulse[0]) if impulse else nan]
            except (TypeError, ValueError):
                raise wrong("collisions", one, COLLISION) from None
            there = 0 <= row[1] < self.n and -self.walls <= row[2] < self.n and row[1] != row[2]
            if not there or isinf(row[3]):
                raise wrong("collisions", one, COLLISION)
            self.log.append(row)

    def rows(self) -> list[list[float]]:
        """Position, velocity, angle and angular velocity of every disk."""
        state = self.call("read", self.world)
        turns = "rotation" in self.functions["models"]
        shapes: dict[str, tuple[int, ...]] = {"position": (self.n, 2), "velocity": (self.n, 2)}
        shapes |= {"angle": (self.n,), "angular_velocity": (self.n,)} if turns else {}
        arrays = {name: array_of(state, name, shape) for name, shape in shapes.items()}
        if not turns:
            arrays |= {"angle": self.angle, "angular_velocity": np.zeros(self.n)}
        rows: list[list[float]] = np.column_stack(list(arrays.values())).tolist()
        return rows


def array_of(state: Any, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """An array from the result of `read`; raises `SolverFailed` if it has another shape or is not
    finite."""
    asked = f"asked is {'[x, y]' if len(shape) == 2 else 'a number'} for each of {shape[0]} disks"
    value = state.get(name) if isinstance(state, dict) else getattr(state, name, None)
    if value is None:
        raise wrong("read", state, f"it has no {name}; {asked}")
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        raise wrong("read", value, asked, f" as {name}") from None
    if array.shape != shape or array.dtype.kind not in "fiu":
        raise wrong("read", value, asked, f" as {name}")
    array = array.astype(float)
    if not np.isfinite(array).all():
        disk = int(np.argwhere(~np.isfinite(array))[0][0])
        asked = "asked are finite numbers"
        raise wrong("read", value[disk], asked, f" as {name} of disk {disk}", "diverged")
    return array


def wrong(
    function: str, value: Any, asked: str, what: str = "", kind: str = "error"
) -> SolverFailed:
    """The failure for an invalid return value of a function."""
    text = repr(value)
    text = text if len(text) <= SHOWN else text[:SHOWN] + " ..."
    return SolverFailed(kind, f"{function} returned {text}{what}; {asked}")
