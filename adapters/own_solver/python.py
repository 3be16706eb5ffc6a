"""Runs a solver.py: the exercise's functions on sphere objects, or `advance` on arrays as in
reference_impl."""

from __future__ import annotations

import random
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from crosscheck2d.adapters.own_solver.beside import Neighbours
from crosscheck2d.adapters.own_solver.file import PATIENCE, SolverFailed, SolverText
from crosscheck2d.adapters.own_solver.spheres import NAMES, Fields, Traced, sphere_of
from crosscheck2d.adapters.system import TimeIsUp, stopped_after

LOAD_LIMIT = 3.0  # s; importing numba takes one
DECIMAL_COMMA = re.compile(r"=\s*\d+,\d+\s*$", re.MULTILINE)
LOGGED = 400  # contacts kept for the check
TRACED = 400  # accesses kept of a traced call


def row_of(s: Any) -> list[float]:
    """The 12 numbers of a sphere; NaN for a field that is not a number."""
    try:
        vectors = (s.position.x, s.position.y, s.velocity.x, s.velocity.y, s.force.x, s.force.y)
    except AttributeError:
        raise AttributeError(
            "a sphere is left with a position, velocity or force that has no x and y"
        ) from None
    return [
        number(x) for x in (*vectors, s.alpha, s.angularVelocity, s.torque, s.mass, s.MoI, s.size)
    ]


def number(x: Any) -> float:
    """`x` as a float; NaN if it is not a number."""
    try:
        return float(x)
    except (TypeError, ValueError):
        return float("nan")


def seed() -> None:
    """Seed the random numbers, the same for every question."""
    random.seed(1)
    if "numpy" in sys.modules:
        sys.modules["numpy"].random.seed(1)


class PythonSolver:
    """The file as a module of this process. Raises `SolverFailed` if it cannot be loaded."""

    def __init__(self, solver: SolverText, copies: Path | None = None) -> None:
        """`copies`: the folder with the texts as read, for numba, which caches compiled code by
        file and content."""
        here = solver.path.resolve()
        self.solver, self.name = solver, str(solver.path if copies is None else copies / here.name)
        self.neighbours = Neighbours(here.parent, dict(solver.imported), copies or here.parent)
        sys.meta_path.insert(0, self.neighbours)
        self.renew()

    def renew(self) -> None:
        """Load the file and the modules beside it again, without any state of earlier calls."""
        solver, here = self.solver, self.solver.path.resolve()
        for name, loaded in list(sys.modules.items()):
            if getattr(getattr(loaded, "__spec__", None), "loader", None) is self.neighbours:
                del sys.modules[name]
        seed()
        self.module = module = ModuleType("solver")
        module.__file__ = str(here)
        sys.modules["solver"] = module  # numba and dataclasses look up a function's module
        with self.guarded(LOAD_LIMIT, "while it is loaded"):
            exec(compile(solver.text, self.name, "exec"), module.__dict__)
        self.take(module)

    def take(self, module: ModuleType) -> None:
        """Find the functions of the module."""
        self.surface = "advance" if callable(getattr(module, "advance", None)) else "exercise"
        named = {
            "integrate": "integrate",
            "collide": "sphereSphereCollisionHandling",
            "step": "performSimStep",
            "wrap": "projectObjects",
            "begin": "initScene",
        }
        self.file: dict[str, Callable[..., Any]] = {
            k: vars(module)[f] for k, f in named.items() if callable(vars(module).get(f))
        }
        self.whole: Any = None  # plays whole scenes with `advance` if the file has it
        if self.surface == "advance":
            from crosscheck2d.adapters.own_solver.arrays import Whole, as_functions

            self.file, self.whole = as_functions(module), Whole(module)
        self.functions: dict[str, Any] = {k: k in self.file for k in named} | {"replaced": []}

    def run(self, command: str, argument: Any, limit: float) -> Any:
        """The answer to a command; raises `SolverFailed` after `limit` s, or if the file threw."""
        with self.guarded(limit, "in one call"):
            return getattr(self.whole if command.startswith("whole") else self, command)(argument)

    def versions(self) -> dict[str, str]:
        """The versions that affect the numbers."""
        return {"python": ".".join(map(str, sys.version_info[:3]))}

    @contextmanager
    def guarded(self, limit: float, when: str) -> Iterator[None]:
        """Context that turns every exception of the file into `SolverFailed`, and stops it after
        `limit` s of processor time."""

        def too_late() -> SolverFailed:
            return SolverFailed("timeout", f"does not come back within {limit:g} s {when}")

        try:
            with stopped_after(limit, PATIENCE * limit, too_late):
                yield
        except SolverFailed:
            raise
        except BaseException as error:  # SystemExit too: a solver may not end the process
            raise self.failure(error, when) from None

    def failure(self, error: BaseException, when: str) -> SolverFailed:
        """An exception as a `SolverFailed`, with its place in the solver's file."""
        if isinstance(error, RecursionError):
            what = "calls itself without end (maximum recursion depth exceeded)"
        elif isinstance(error, MemoryError):
            return SolverFailed("memory", f"needs more memory than it may use {when}")
        elif isinstance(error, SystemExit):
            what = f"ends the process (SystemExit: {error})"
        else:
            what = (
                f"{type(error).__name__}: {error.msg if isinstance(error, SyntaxError) else error}"
            )
        if "for ^" in what:
            what += "; a power is written **"
        elif "'tuple'" in what and DECIMAL_COMMA.search(self.solver.text):
            what += "; a decimal number has a point, not a comma"
        elif isinstance(error, EOFError):
            what += "; input() is not available"
        if isinstance(error, SyntaxError) and error.filename == self.name:
            return SolverFailed("error", what, error.lineno or 0, error.offset or 0)
        mine = [
            f
            for f in traceback.TracebackException.from_exception(error).stack
            if f.filename == self.name
        ]
        line, column = (mine[-1].lineno or 0, (mine[-1].colno or 0) + 1) if mine else (0, 0)
        return SolverFailed("error", what, line, column)

    def begin(self, _argument: Any = None) -> None:
        """Let the file make its scene."""
        if "begin" in self.file:
            self.file["begin"]()

    def everybody(self) -> list[Any]:
        """The file's ufo and asteroids."""
        return [self.module.ufo, *self.module.asteroids]

    def globals(self, _argument: Any = None) -> list[list[float]] | None:
        """The numbers of the file's own spheres; None if it has none."""
        try:
            return [row_of(s) for s in self.everybody()]
        except (AttributeError, TypeError):
            return None

    def ask(self, question: dict[str, Any]) -> dict[str, Any]:
        """The answer to a question: the spheres after each call, and what was returned, changed
        elsewhere, or failed."""
        states: list[list[list[float]]] = []
        returned, error = False, None
        seed()
        before = self.numbers()
        self.asked = spheres = self.placed(question)
        calls = self.watched(spheres) if question.get("watch") else []
        known = None if question["world"] else self.globals()
        try:
            for name, *arguments in question["calls"]:
                result = self.call(name, arguments, spheres)
                if hasattr(result, "send"):
                    raise TypeError(
                        f"a call of {name} runs nothing: it is an async def, or has a yield"
                    )
                returned = (
                    returned
                    or isinstance(result, (Fields, dict, list, tuple))
                    or hasattr(result, "position")
                )
                spheres = self.everybody() if question["world"] else spheres
                states.append([row_of(s) for s in spheres])
        except (SolverFailed, TimeIsUp):
            raise
        except BaseException as raised:
            error = vars(self.failure(raised, "in one call"))
        strange = sorted(
            {name for s in spheres if isinstance(s, Fields) for name in vars(s)} - NAMES
        )
        strayed = not question["world"] and not same(self.globals(), known)
        return {
            "states": states,
            "returned": returned,
            "strayed": strayed,
            "strange": strange,
            "kept": [name for name, value in self.numbers().items() if before.get(name) != value],
            "calls": list(calls),  # a later question adds to it
            "error": error,
        }

    def left(self, _argument: Any = None) -> list[list[float]]:
        """The spheres of the last question, which a failed call may have changed."""
        return [row_of(s) for s in self.asked]

    def call(self, name: str, arguments: list[Any], spheres: list[Any]) -> Any:
        """Call a function of the file on some of the spheres, and return its result."""
        on = {"integrate": 1, "collide": 2}.get(name, 0)
        return self.file[name](*(spheres[i] for i in arguments[:on]), *arguments[on:])

    def numbers(self) -> dict[str, str]:
        """The file's global numbers as text; those that a call changes are its state."""
        return {
            name: repr(value)
            for name, value in vars(self.module).items()
            if isinstance(value, (int, float, complex))
        }

    def watched(self, spheres: list[Any]) -> list[list[Any]]:
        """A list that gets a row for every call of the file to its own functions."""
        calls: list[list[Any]] = []
        place = {id(s): k for k, s in enumerate(spheres)}

        def noted(name: str, called: Callable[..., Any], on: int) -> Callable[..., Any]:
            def note(*given: Any, **named: Any) -> Any:
                rest = [number(x) for x in given[on:]]
                calls.append([name, *(place.get(id(s), -1) for s in given[:on]), *rest])
                return called(*given, **named)

            return note

        names = {"integrate": 1, "sphereSphereCollisionHandling": 2, "projectObjects": 0}
        for (function, on), name in zip(names.items(), ("integrate", "collide", "wrap")):
            if name in self.file and function in vars(self.module):
                vars(self.module)[function] = noted(name, self.file[name], on)
        return calls

    def trace(self, question: dict[str, Any]) -> None:
        """Make the calls of a question on spheres that record every read and write of their
        numbers; `accesses` then returns these, even if a call never returned."""
        self.trail: list[tuple[str, int, str, list[int]]] = []
        seed()
        spheres = [self.traced(r, k) for k, r in enumerate(question["spheres"])]
        for name, *arguments in question["calls"]:
            self.call(name, arguments, spheres)

    def accesses(self, _argument: Any = None) -> list[tuple[str, int, str, list[int]]]:
        """("r" or "w", sphere, field, lines of the file, the innermost call first) of the last
        `trace`."""
        return self.trail

    def traced(self, numbers: list[float], k: int) -> Any:
        """Sphere `k` that records its accesses."""

        def access(kind: str, field: str) -> None:
            last = len(self.trail) > TRACED  # only the latest accesses of an endless loop are kept
            self.trail[TRACED if last else len(self.trail) :] = [
                (kind, k, field, self.lines_of(sys._getframe(2)))
            ]

        made = sphere_of(numbers)
        for name, value in vars(made).items():
            if isinstance(value, Fields):
                vars(made)[name] = Traced(access, vars(value), name)
        return Traced(access, vars(made))

    def lines_of(self, frame: FrameType | None) -> list[int]:
        """The lines of the file in the calls that led to `frame`, the innermost first."""
        lines = []
        while frame is not None:
            if frame.f_code.co_filename == self.name:
                lines.append(frame.f_lineno)
            frame = frame.f_back
        return lines

    def placed(self, question: dict[str, Any]) -> list[Any]:
        """The spheres of a question, new ones or the file's own."""
        made = [sphere_of(r) for r in question["spheres"]]
        if not question["world"]:
            return made
        spheres = self.everybody()
        for mine, wanted in zip(spheres, made):
            for name, value in vars(wanted).items():
                if isinstance(value, Fields):
                    vector = getattr(mine, name)
                    vector.x, vector.y = value.x, value.y
                else:
                    setattr(mine, name, value)
        return spheres

    def load(self, scene: dict[str, Any]) -> None:
        """Begin a scene."""
        self.scene, self.steps = scene, 0
        self.log: list[list[float]] = []
        self.collision_rows: list[list[float]] = []
        self.spheres: list[Any] = [sphere_of(r) for r in scene["spheres"]]

    def step(self, argument: dict[str, Any]) -> None:
        """Integrate all, collide every pair i < j, wrap; `count` times. Forces act in the first
        step, or in all if held."""
        gx, gy = self.scene["gravity"]
        forces, held = argument["forces"], argument.get("held", False)
        for k in range(argument["count"]):
            for i, s in enumerate(self.spheres):
                px, py, turn = forces[i] if forces and (held or k == 0) else (0.0, 0.0, 0.0)
                s.force.x, s.force.y, s.torque = s.mass * gx + px, s.mass * gy + py, turn
                self.file["integrate"](s, self.scene["dt"])
            self.motions = [motion(s) for s in self.spheres]
            for i in range(len(self.spheres)):
                for j in range(i + 1, len(self.spheres)):
                    self.pair(i, j)
            if self.scene["wrap"]:
                for s in self.spheres:
                    wrap(s.position, self.scene["wrap"])
            self.steps += 1

    def pair(self, i: int, j: int) -> None:
        """Collide a pair, and record it if it overlapped or anything changed."""
        a, b = self.spheres[i], self.spheres[j]
        was_a, was_b = self.motions[i], self.motions[j]
        self.file["collide"](a, b)
        is_a, is_b = self.motions[i], self.motions[j] = motion(a), motion(b)
        x, y, reach = was_a[0] - was_b[0], was_a[1] - was_b[1], a.size + b.size
        changed = was_a != is_a or was_b != is_b
        if changed and (was_a[2:] != is_a[2:] or was_b[2:] != is_b[2:]):
            du, dv = is_a[2] - was_a[2], is_a[3] - was_a[3]
            sign = -1.0 if du * x + dv * y < 0 else 1.0
            self.collision_rows.append(
                [self.steps, i, j, number(sign * a.mass * (du * du + dv * dv) ** 0.5)]
            )
        if (changed or x * x + y * y < reach * reach) and len(self.log) < LOGGED:
            numbers = map(number, (*was_a, *was_b, *is_a, *is_b))
            self.log.append([self.steps, i, j, *numbers])

    def play(self, argument: dict[str, Any]) -> dict[str, Any]:
        """Call `step` several times, then return the state and the collisions from number `heard`
        on, all in one request."""
        for step in argument["steps"]:
            self.step(step)
        return {"rows": self.read(), "collisions": self.collision_rows[argument["heard"] :]}

    def samples(self, argument: dict[str, Any]) -> list[list[list[float]]]:
        """The states at the start and after each of `count` calls of `step`."""
        all_rows = [self.read()]
        for _ in range(argument["count"]):
            self.step(argument["step"])
            all_rows.append(self.read())
        return all_rows

    def read(self, _argument: Any = None) -> list[list[float]]:
        """The present numbers of the scene's spheres."""
        return [row_of(s) for s in self.spheres]

    def contacts(self, _argument: Any = None) -> list[list[float]]:
        """The contacts that `pair` recorded."""
        return self.log


def motion(s: Any) -> tuple[float, float, float, float]:
    """Position and velocity of a sphere."""
    return s.position.x, s.position.y, s.velocity.x, s.velocity.y


def wrap(p: Any, box: list[float]) -> None:
    """Set a position beyond an edge of the box onto the opposite edge, as projectObjects does."""
    left, bottom, right, top = box
    p.x = right if p.x < left else left if p.x > right else p.x
    p.y = top if p.y < bottom else bottom if p.y > top else p.y


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal; NaN equals NaN."""
    return repr(one) == repr(other)
