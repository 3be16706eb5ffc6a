"""Plays an engine.js in V8, in this process: create, step, read and collisions of the file."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

from py_mini_racer import JSEvalException, JSTimeoutException

from crosscheck2d.adapters.own_engine.features import features_of
from crosscheck2d.adapters.own_engine.surface import ENGINE, HOW
from crosscheck2d.adapters.own_solver.file import SolverFailed
from crosscheck2d.adapters.own_solver.javascript import DRIVER, JavaScriptSolver, thrown

ENGINE_DRIVER = (Path(__file__).parent / "driver.js").read_text(encoding="utf-8")
# Evaluated after the file, where its `let` and `const` can be seen too.
BIND = """__engine("bind", {
  create: typeof create === "undefined" ? null : create,
  step: typeof step === "undefined" ? null : step,
  read: typeof read === "undefined" ? null : read,
  collisions: typeof collisions === "undefined" ? null : collisions,
  models: typeof models === "undefined" ? null : models,
})"""


class JavaScriptFile(JavaScriptSolver):
    """The file in a fresh V8. Raises `SolverFailed` if it is no engine."""

    surface = "engine"
    drivers, bind = (DRIVER, ENGINE_DRIVER), BIND

    def load(self) -> None:
        """Load the file, and check that it has the functions of an engine."""
        super().load()
        if lacking := [name for name in ENGINE if not self.functions[name]]:
            raise SolverFailed("error", f"has no function {' and no '.join(lacking)}; {HOW}")
        models = features_of(self.functions["models"])
        self.functions |= {"models": models}
        self.v8.eval(f'__engine("turns", {json.dumps("rotation" in models)})')

    def run(self, command: str, argument: Any, limit: float) -> Any:
        """The driver's answer to a command; raises `SolverFailed` after `limit` s, or if a function
        threw or returned an invalid value."""
        code = f'__engine("{command}", {json.dumps(json.dumps(argument))})'
        try:
            answer = json.loads(str(self.evaluated(code, limit, may_repeat=False)))
        except JSEvalException as error:
            failed, inside = self.failure(error, limit, "in one call"), ""
            if isinstance(error, JSTimeoutException):
                with suppress(JSEvalException):
                    inside = str(self.v8.eval('__engine("inside")', timeout_sec=1.0))
            raise SolverFailed(failed.kind, f"{inside} {failed.what}".strip()) from None
        if "wrong" in answer:
            raise SolverFailed(answer["kind"], answer["wrong"])
        if "error" in answer:
            failed = thrown(answer["error"])
            verb = "" if failed.what.startswith(("calls ", "wants ")) else "threw "
            what = f"{answer['inside']} {verb}{failed.what}"
            raise SolverFailed(failed.kind, what, failed.line, failed.column)
        return answer["done"]
