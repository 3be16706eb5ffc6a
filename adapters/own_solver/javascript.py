"""Runs an Exercise.js in V8: no file, no network, no clock; bounded in time and memory."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from time import process_time
from typing import Any

from py_mini_racer import (
    JSEvalException,
    JSOOMException,
    JSParseException,
    JSTimeoutException,
    MiniRacer,
)

from crosscheck2d.adapters.own_solver.file import PATIENCE, SolverFailed, SolverText
from crosscheck2d.adapters.own_solver.gl_matrix import NAMES, TAKE_OUT, where_to

HEAP = 64 * 2**20  # bytes; a solver needs a hundredth of it
LOAD_LIMIT = 2.0  # s
NAME = "solver-file"  # the name of the solver's text in stack traces
DRIVER = (Path(__file__).parent / "driver.js").read_text(encoding="utf-8")
# Evaluated after the file, where its `let` and `const` are visible, too; a missing name fails
# when it is used.
BIND = """__crosscheck("bind", {
  integrate: typeof integrate === "undefined" ? null : integrate,
  collide: typeof sphereSphereCollisionHandling === "undefined"
    ? null : sphereSphereCollisionHandling,
  step: typeof performSimStep === "undefined" ? null : performSimStep,
  wrap: typeof projectObjects === "undefined" ? null : projectObjects,
  begin: typeof initScene === "undefined" ? null : initScene,
  ufo: () => ufo, asteroids: () => asteroids,
  watch: (i, c, w) => {
    try { if (typeof integrate === "function") integrate = i; } catch (_) {}
    try {
      if (typeof sphereSphereCollisionHandling === "function") sphereSphereCollisionHandling = c;
    } catch (_) {}
    try { if (typeof projectObjects === "function") projectObjects = w; } catch (_) {}
  },
})"""


class JavaScriptSolver:
    """The file in a fresh V8. Raises `SolverFailed` if it cannot be loaded."""

    surface = "exercise"
    drivers: tuple[str, ...] = (DRIVER,)  # which stand in V8 before the file
    bind = BIND  # which finds its functions

    def __init__(self, solver: SolverText) -> None:
        self.solver, self.v8 = solver, MiniRacer()
        self.load()

    def renew(self) -> None:
        """Load the file into a new V8, without any state of earlier calls."""
        self.close()
        self.v8 = MiniRacer()
        self.load()

    def close(self) -> None:
        """Release the memory of V8."""
        self.v8.close()

    def load(self) -> None:
        """Load the file into an empty V8."""
        solver = self.solver
        self.v8.set_hard_memory_limit(HEAP)
        for driver in self.drivers:
            self.v8.eval(driver)
        for name, text in solver.imported:
            self.load_library(name, text)
        try:
            self.v8.eval(f"{solver.text}\n//# sourceURL={NAME}", timeout_sec=LOAD_LIMIT)
            self.functions = json.loads(str(self.v8.eval(self.bind, timeout_sec=LOAD_LIMIT)))
        except JSEvalException as error:
            raise self.failure(error, LOAD_LIMIT, "while it is loaded") from None

    def load_library(self, name: str, text: str) -> None:
        """Load gl-matrix, as the exercise's page does before the file. Raises `SolverFailed` if it
        fails."""
        try:
            self.v8.eval(f"{text}\n//# sourceURL={name}", timeout_sec=LOAD_LIMIT)
            self.v8.eval(TAKE_OUT)
        except JSEvalException as error:
            said = str(error).partition("\n")[0]
            raise SolverFailed(
                "error", f"calls {name}, which cannot be loaded ({said}); {where_to()}"
            ) from None

    def run(self, command: str, argument: Any, limit: float) -> Any:
        """The driver's answer to a command; raises `SolverFailed` after `limit` s, or if the file
        threw."""
        code = f'__crosscheck("{command}", {json.dumps(json.dumps(argument))})'
        try:
            answer = json.loads(str(self.evaluated(code, limit, may_repeat=command == "ask")))
        except JSEvalException as error:
            raise self.failure(error, limit, "in one call") from None
        return read(command, answer)

    def together(self, questions: Sequence[Any], limit: float) -> list[dict[str, Any]]:
        """The answers to the first questions, or to all, in a single call of V8, because a call
        takes longer than a question. Fewer if they take `limit` s or too much memory."""
        answers: list[Any] = []
        with suppress(JSEvalException):
            try:
                put = json.dumps(json.dumps(questions))
                answers = self.done(f'__crosscheck("several", {put})', limit)
            except JSEvalException:
                answers = self.done('__crosscheck("answers")', limit)
        replies: list[dict[str, Any]] = []
        for answer in answers:
            try:
                replies.append({"done": read("ask", answer)})
            except SolverFailed as failure:
                replies.append({"failed": vars(failure)})
        return replies

    def done(self, code: str, limit: float) -> Any:
        """The result of driver code in which the file cannot have thrown."""
        return json.loads(str(self.v8.eval(code, timeout_sec=limit)))["done"]

    def evaluated(self, code: str, limit: float, may_repeat: bool) -> object:
        """The result of `code` in V8. If it was stopped before it had run for `limit` s, it is
        repeated if `may_repeat`.

        V8 is stopped by wall time, on a busy machine before it has had its processor time.
        """
        began = process_time()
        try:
            return self.v8.eval(code, timeout_sec=limit)
        except JSTimeoutException:
            if not may_repeat or process_time() - began > limit / 2:
                raise
            return self.v8.eval(code, timeout_sec=(PATIENCE - 1) * limit)

    def versions(self) -> dict[str, str]:
        """The versions that affect the numbers."""
        return {"mini-racer": version("mini-racer"), "V8": self.v8.v8_version}

    def failure(self, error: JSEvalException, limit: float, when: str) -> SolverFailed:
        """The message of V8 as a `SolverFailed`, with line and column if known."""
        if isinstance(error, JSTimeoutException):
            return SolverFailed("timeout", f"does not come back within {limit:g} s {when}")
        if isinstance(error, JSOOMException):
            return SolverFailed("memory", f"wants more than {HEAP // 2**20} MB of memory {when}")
        first, _, rest = str(error).partition("\n")
        place = re.match(r"[^\n]*?:(\d+): (.*)", first)
        if not place:
            return SolverFailed("error", plainly(first))
        caret = next(
            (line for line in rest.splitlines() if line.strip() and set(line.strip()) == {"^"}), ""
        )
        stack = re.search(rf"{NAME}:(\d+):(\d+)", str(error))
        line, column = int(place[1]), caret.find("^") + 1
        if stack and not isinstance(error, JSParseException):
            line, column = int(stack[1]), int(stack[2])
        lines = self.solver.text.splitlines()
        if line > len(lines):  # the end of the text, which is followed by its name for stack traces
            line, column = len(lines), len(lines[-1]) if lines else 0
        return SolverFailed("error", plainly(place[2]), line, column)


def read(command: str, answer: dict[str, Any]) -> Any:
    """The value of an answer of the driver; raises `SolverFailed` if the file threw."""
    if "error" in answer:
        raise thrown(answer["error"])
    if command == "accesses":
        return [[*access[:3], lines_of(access[3])] for access in answer["done"]]
    if isinstance(answer["done"], dict) and answer["done"].get("error"):
        answer["done"]["error"] = vars(thrown(answer["done"]["error"]))
    return answer["done"]


def lines_of(stack: str) -> list[int]:
    """The lines of the solver's file in a stack, the innermost call first."""
    return [int(line) for line in re.findall(rf"{NAME}:(\d+):\d+", stack)]


def thrown(error: dict[str, str]) -> SolverFailed:
    """The exception of a function, and its place in the solver's file."""
    place = re.search(rf"{NAME}:(\d+):(\d+)", error["stack"])
    line, column = (int(place[1]), int(place[2])) if place else (0, 0)
    return SolverFailed("error", plainly(error["what"]), line, column)


OUTSIDE = (
    "Date",
    "performance",
    "setTimeout",
    "setInterval",
    "requestAnimationFrame",
    "document",
    "window",
    "fetch",
    "localStorage",
)
SCRIPT = "the exercise's page loads the file as a plain script, which has no modules; leave it out"


def plainly(what: str) -> str:
    """V8's message, with a hint if it alone does not help."""
    what = what.removeprefix("Uncaught ")
    if "Maximum call stack" in what:
        return "calls itself without end (maximum call stack size exceeded)"
    if "Array buffer allocation failed" in what or "Invalid array length" in what:
        return f"needs more memory than it may use ({what})"
    missing = re.match(r"ReferenceError: (\w+) is not defined", what)
    if missing and missing[1] in NAMES:
        return f"{what}: {where_to()}"
    if missing and missing[1] in OUTSIDE:
        return f"{what}: a solver runs without page, network and clock"
    if missing and missing[1] in ("module", "exports", "require"):
        return f"{what}: {SCRIPT}"
    if re.match(r"SyntaxError: (?:Unexpected token 'export'|Cannot use import statement)", what):
        return f"{what}: {SCRIPT}"
    return what
