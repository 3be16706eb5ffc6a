"""A JavaScript guest in V8: no file, no network, no clock; bounded in time and memory. Runs in the
guest's process and imports nothing of this project."""

from __future__ import annotations

import json
import os
import re
from base64 import b64encode
from collections.abc import Sequence
from contextlib import suppress
from time import monotonic, perf_counter, process_time, sleep
from typing import Any

from driver import EXERCISE, PATIENCE, Failed, stopped  # type: ignore[import-not-found]
from py_mini_racer import (
    JSEvalException,
    JSOOMException,
    JSParseException,
    JSTimeoutException,
    MiniRacer,
)

NAME = "solver-file"  # the name of the guest's text in stack traces
with open(os.path.join(os.path.dirname(__file__), "driver.js"), encoding="utf-8") as _file:
    DRIVER = _file.read()
ENGINE = ("create", "step", "read", "collisions", "models", "settings", "place", "free", "ready")
PLACE = re.compile(rf"{NAME}:(\d+):(\d+)")
# Evaluated after the file, where its `let` and `const` are visible, too; a missing name fails
# when it is used.
VERBS = ", ".join(
    f'{verb}: typeof {name} === "undefined" ? null : {name}'
    for verb, name in [*EXERCISE.items(), *zip(ENGINE, ENGINE)]
)
WATCH = " ".join(
    f'try {{ if (typeof {name} === "function") {name} = by.{verb}; }} catch (_) {{}}'
    for verb, name in EXERCISE.items()
    if verb in ("integrate", "collide", "wrap")
)
BIND = f"""__host("bind", {{
  {VERBS}, ufo: () => ufo, asteroids: () => asteroids, watch: (by) => {{ {WATCH} }},
}})"""
# A class has the functions of an engine, of itself or of its instances.
BIND_CLASS = """__host("bind", ((engine) => {{
  const verbs = {{ models: engine.models ?? (typeof models === "undefined" ? null : models) }};
  for (const name of ["create", "step", "read", "collisions"]) {{
    verbs[name] = typeof engine[name] === "function" ? engine[name].bind(engine) : null;
  }}
  return verbs;
}})("create" in {0} ? {0} : new {0}()))"""
# Up to version 2 of gl-matrix vec2, mat4 ... are globals; from version 3 on they are inside an
# object, and are taken out of it.
TAKE_OUT = """{
  const library = typeof glMatrix === "object" ? glMatrix : module.exports;
  for (const name of Object.keys(library)) {
    if (!(name in globalThis)) globalThis[name] = library[name];
  }
  module.exports = exports = {};
}"""


class V8Guest:
    """A guest's file in a fresh V8; raises `Failed` if it cannot be loaded.

    order: text; imported: name -> text of libraries; engine: it has create, step and read;
    package: the text of an npm package that it drives, which may do all that V8 can.
    """

    def __init__(self, order: dict[str, Any]) -> None:
        self.order, self.packaged = order, order["package"] is not None
        self.heap, self.load_limit = (2**29, 10.0) if self.packaged else (2**26, 2.0)
        self.load()
        self.versions = {"V8": self.v8.v8_version}

    def renew(self) -> None:
        self.v8.close()
        self.load()

    def load(self) -> None:
        self.v8 = MiniRacer()
        self.began = process_time()
        self.v8.set_hard_memory_limit(self.heap)
        self.v8.eval(DRIVER)
        try:
            if self.packaged:
                self.eval(f"{self.order['package']}\n;0")
            else:
                self.v8.eval('__host("confine")')
                for name, text in self.order["imported"]:
                    self.load_library(name, text)
            self.eval(f"{self.order['text']}\n//# sourceURL={NAME}")
            bind = BIND_CLASS.format(self.order["holder"]) if self.order["holder"] else BIND
            self.functions = json.loads(str(self.eval(bind)))
            self.models, self.replaced = map(self.functions.pop, ("models", "replaced"))
            if self.order["engine"]:
                turns = "rotation" in (self.models or "").split()
                self.v8.eval(f'__host("turns", {json.dumps(turns)})')
            until = monotonic() + self.load_limit
            while not self.v8.eval('__host("ready")'):  # V8 compiles WebAssembly in its own time
                if monotonic() > until:
                    raise Failed("timeout", f"is not ready within {self.load_limit:g} s")
                sleep(0.002)
        except JSEvalException as error:
            raise self.failure(error, self.load_limit, "while it is loaded") from None

    def eval(self, code: str) -> object:
        return self.v8.eval(code, timeout_sec=self.load_limit)

    def load_library(self, name: str, text: str) -> None:
        try:
            self.eval(f"{text}\n//# sourceURL={name}")
            self.v8.eval(TAKE_OUT)
        except JSEvalException as error:
            message = str(error).partition("\n")[0]
            raise Failed("error", f"calls {name}, which cannot be loaded ({message})") from None

    def run(self, command: str, argument: Any, limit: float) -> Any:
        code = f'__host("{command}", {json.dumps(json.dumps(argument))})'
        began, self.began = perf_counter(), process_time()
        try:
            answer = json.loads(str(self.evaluate(code, limit, may_repeat=command == "ask")))
        except JSEvalException as error:
            failure, inside = self.failure(error, limit, "in one call"), ""
            if isinstance(error, JSTimeoutException) and self.order["engine"]:
                with suppress(JSEvalException):
                    inside = str(self.v8.eval('__host("inside")', timeout_sec=1.0))
            failure.what = f"{inside} {failure.what}".strip()
            raise failure from None
        seconds = perf_counter() - began
        result = self.read(command, answer)
        if command == "step":
            return seconds
        if isinstance(result, dict) and "readings" in result:
            numbers = self.v8.eval('__host("numbers")')
            assert isinstance(numbers, memoryview)
            result |= {"numbers": b64encode(numbers).decode("ascii"), "seconds": seconds}
        return result

    def read(self, command: str, answer: dict[str, Any]) -> Any:
        if "failed" in answer:
            raise self.thrown(answer["failed"])
        done = answer["done"]
        if command == "accesses":
            return [[*each, [int(k) for k, _ in PLACE.findall(stack)]] for *each, stack in done]
        for part in ("error", "thrown"):
            if isinstance(done, dict) and done.get(part):
                done[part] = vars(self.thrown(done[part]))
        return done

    def thrown(self, error: dict[str, str]) -> Failed:
        what, inside = plainly(error["what"]), error["inside"]
        if inside and self.order["engine"]:
            what = f"{inside} {'' if what.startswith(('calls ', 'needs ')) else 'threw '}{what}"
        place = PLACE.search(error["stack"])
        line, column = (int(place[1]), int(place[2])) if place else (0, 0)
        return Failed(error["kind"], what, line, column)

    def together(self, questions: Sequence[Any], limit: float) -> list[dict[str, Any]]:
        """The answers to the first questions, or to all, in a single call of V8, because a call
        takes longer than a question. Fewer if they take `limit` s or too much memory."""
        answers: list[Any] = []
        with suppress(JSEvalException):
            try:
                put = json.dumps(json.dumps(questions))
                answers = self.done(f'__host("several", {put})', limit)
            except JSEvalException:
                answers = self.done('__host("answers")', limit)
        replies: list[dict[str, Any]] = []
        for answer in answers:
            try:
                replies.append({"done": self.read("ask", answer)})
            except Failed as failure:
                replies.append({"failed": vars(failure)})
        return replies

    def done(self, code: str, limit: float) -> Any:
        return json.loads(str(self.v8.eval(code, timeout_sec=limit)))["done"]

    def evaluate(self, code: str, limit: float, may_repeat: bool) -> object:
        """The result of `code` in V8. If it was stopped before it had the processor for half of
        `limit` s, it is repeated if `may_repeat`: V8 is stopped by wall time, on a busy machine
        before it has had its processor time."""
        began = process_time()
        try:
            return self.v8.eval(code, timeout_sec=limit)
        except JSTimeoutException:
            if not may_repeat or process_time() - began > limit / 2:
                raise
            return self.v8.eval(code, timeout_sec=(PATIENCE - 1) * limit)

    def failure(self, error: JSEvalException, limit: float, when: str) -> Failed:
        if isinstance(error, JSTimeoutException):
            return stopped(limit, process_time() - self.began, when)
        if isinstance(error, JSOOMException):
            return Failed("memory", f"wants more than {self.heap // 2**20} MB of memory {when}")
        first, _, rest = str(error).partition("\n")
        place = re.match(r"[^\n]*?:(\d+): (.*)", first)
        if not place:
            return Failed("error", plainly(first))
        caret = next((line for line in rest.splitlines() if set(line.strip()) == {"^"}), "")
        stack = PLACE.search(str(error))
        line, column = int(place[1]), caret.find("^") + 1
        if stack and not isinstance(error, JSParseException):
            line, column = int(stack[1]), int(stack[2])
        lines = self.order["text"].splitlines()
        if line > len(lines):  # the end of the text, which is followed by its name for stack traces
            line, column = len(lines), len(lines[-1]) if lines else 0
        return Failed("error", plainly(place[2]), line, column)


OUTSIDE = ("setTimeout", "setInterval", "fetch", "localStorage", "WebAssembly", "Intl")
SCRIPT = "the exercise's page loads the file as a plain script, which has no modules; leave it out"


def plainly(what: str) -> str:
    what = what.removeprefix("Uncaught ")
    if "Maximum call stack" in what:
        return "calls itself without end (maximum call stack size exceeded)"
    if "Array buffer allocation failed" in what or "Invalid array length" in what:
        return f"needs more memory than it may use ({what})"
    missing = re.match(r"ReferenceError: (\w+) is not defined", what)
    if missing and missing[1] in OUTSIDE:
        return f"{what}: a solver runs without page, network and clock"
    modules = r"SyntaxError: (?:Unexpected token 'export'|Cannot use import statement)"
    if (missing and missing[1] == "require") or re.match(modules, what):
        return f"{what}: {SCRIPT}"
    return what
