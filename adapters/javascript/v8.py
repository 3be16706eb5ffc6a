"""The process in which a JavaScript engine runs: one V8, bounded in memory and time."""

from __future__ import annotations

import json
from base64 import b64encode
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from time import monotonic, perf_counter, sleep
from typing import Any

from py_mini_racer import JSEvalException, JSOOMException, JSTimeoutException, MiniRacer

from crosscheck2d.adapters.npm_packages import NotInstalled, text_of, version_of
from crosscheck2d.adapters.own_solver.file import SolverFailed

HERE = Path(__file__).parent
HEAP = 512 * 2**20  # bytes; Rapier's text and its WebAssembly take a tenth of it
LOAD_LIMIT = 10.0  # s


@dataclass(frozen=True)
class Packaged:
    """What a process of own_solver/process.py is asked to play: the engine that `NAME.js` of this
    folder makes of an npm package."""

    name: str
    package: str
    kind = "packaged"

    def load(self) -> PackagedEngine:
        """The engine in V8, in the process that calls this; raises `SolverFailed`."""
        return PackagedEngine(self)


class PackagedEngine:
    """An engine in a V8 of its own, which does what driver.js and its own file say."""

    functions: dict[str, Any] = {}  # noqa: RUF012 - what a solver's file has; this is none
    surface = "packaged"

    def __init__(self, packaged: Packaged) -> None:
        self.packaged, self.v8 = packaged, MiniRacer()
        self.v8.set_hard_memory_limit(HEAP)
        try:
            texts = [(HERE / "driver.js").read_text(encoding="utf-8"), text_of(packaged.package)]
            for text in (*texts, (HERE / f"{packaged.name}.js").read_text(encoding="utf-8")):
                self.v8.eval(f"{text}\n;0", timeout_sec=LOAD_LIMIT)
            self.wait()
        except NotInstalled as reason:
            raise SolverFailed("error", str(reason)) from None
        except JSEvalException as error:
            raise self.failure(error, LOAD_LIMIT) from None

    def wait(self) -> None:
        """Until the engine is there: WebAssembly is compiled by V8 in its own time."""
        until = monotonic() + LOAD_LIMIT
        while not self.v8.eval("crosscheck.ready()"):
            if monotonic() > until:
                raise SolverFailed("timeout", f"is not ready within {LOAD_LIMIT:g} s")
            sleep(0.002)

    def run(self, command: str, argument: Any, limit: float) -> Any:
        """What the driver answers to a command, with the `seconds` in V8, and the `numbers` that it
        hands back, float64 in base64; raises `SolverFailed`."""
        code = f'crosscheck.do("{command}", {json.dumps(argument)})'
        began = perf_counter()
        try:
            text = str(self.v8.eval(code, timeout_sec=limit))
        except JSEvalException as error:
            raise self.failure(error, limit) from None
        seconds = perf_counter() - began
        answer = json.loads(text)
        if "refused" in answer:
            raise SolverFailed("refused", answer["refused"])
        if "failed" in answer:
            raise SolverFailed("error", answer["failed"])
        done = answer["done"]
        if done and "readings" in done:
            numbers = self.v8.eval("crosscheck.numbers()")
            assert isinstance(numbers, memoryview)
            done["numbers"] = b64encode(numbers).decode("ascii")
        return {"done": done, "seconds": seconds}

    def versions(self) -> dict[str, str]:
        """What decides the numbers."""
        return {
            self.packaged.package: version_of(self.packaged.package),
            "mini-racer": version("mini-racer"),
            "V8": self.v8.v8_version,
        }

    def failure(self, error: JSEvalException, limit: float) -> SolverFailed:
        """What V8 says, in a sentence."""
        if isinstance(error, JSTimeoutException):
            return SolverFailed("timeout", f"does not come back within {limit:g} s")
        if isinstance(error, JSOOMException):
            return SolverFailed("memory", f"wants more than {HEAP // 2**20} MB of memory")
        return SolverFailed("error", str(error).partition("\n")[0])
