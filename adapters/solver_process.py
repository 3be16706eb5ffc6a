"""Talks to a solver's file in its own process, and outlives whatever that does."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any

from adapters.solver_file import PATIENCE, SolverFailed, read_solver
from scenarios.truth_cache import folder

STARTING = 14.0  # s for Python, V8 or numba to start on a busy machine, and the file to load
INTRUDED = "wrote into the channel that its answers come by"
GRACE = 4.0  # s beyond what the calls of a request may take
Request = tuple[str, Any, float]
"""A command of the worker, its argument, and how long it may take, s."""


class SolverProcess:
    """A solver's file, loaded in a process of its own; use it in a `with`, or close it.

    Attributes:
        functions: which of integrate, collide, step, wrap and begin it has, and which built-ins it replaced.
        kind: "javascript" or "python".
        surface: "exercise" (functions on spheres) or "advance" (arrays, as in reference_impl).
        versions: library -> version.

    Raises:
        NotASolver: the path is no JavaScript or Python text.
        SolverFailed: it cannot be loaded.
    """

    def __init__(self, path: Path, compiled: bool = False) -> None:
        self.kind = read_solver(path).kind
        # Plain Python gives the same bits as numba, and starts 20 s sooner.
        settings = {"PYTHONDONTWRITEBYTECODE": "1"} | ({} if compiled else {"NUMBA_DISABLE_JIT": "1"})
        if (kept := folder()) is not None:
            settings["NUMBA_CACHE_DIR"] = str(kept / "numba")
        hello = self.start(path, settings)
        if not isinstance(hello, dict) or not {"failed", "functions"} & hello.keys():
            self.close()
            raise SolverFailed("crashed", INTRUDED)
        if "failed" in hello:
            self.close()
            raise SolverFailed(**hello["failed"])
        self.functions: dict[str, Any] = hello["functions"]
        self.surface: str = hello["surface"]
        self.versions: dict[str, str] = hello["versions"]

    def start(self, path: Path, settings: dict[str, str]) -> Any:
        """Start the process and give it the file; what it says then.

        It stops a file that does not load by itself. A process that says nothing at all is started once more before
        the file is blamed: a start of V8 has been seen to hang, so rarely that none of 1259 that were counted did.
        """
        for last in (False, True):
            self.process: subprocess.Popen[bytes] | None = subprocess.Popen(
                [sys.executable, "-P", "-m", "adapters.solver_worker"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=os.environ | settings,
                start_new_session=True, bufsize=0,
            )  # fmt: skip
            try:
                return self.exchange(str(path), STARTING)
            except BaseException as error:
                self.close()
                if last or not (isinstance(error, SolverFailed) and error.kind == "timeout"):
                    raise
        raise AssertionError("the second start returns or raises")

    def __enter__(self) -> SolverProcess:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: object, trace: TracebackType | None) -> None:
        self.close()

    def request(self, requests: Sequence[Request], total: float = float("inf")) -> list[Any | SolverFailed]:
        """The answer to each, or how it failed, within `total` s; raises `SolverFailed` if the process is lost."""
        # After one call that does not come back the worker puts no other like it, so a few limits are enough.
        most = PATIENCE * max((limit for _, _, limit in requests), default=0.0)
        answers = self.exchange(requests, min(most + GRACE, total))
        if not isinstance(answers, list) or len(answers) != len(requests):
            self.close()
            raise SolverFailed("crashed", INTRUDED)
        return [SolverFailed(**a["failed"]) if "failed" in a else a["done"] for a in answers]

    def do(self, command: str, argument: Any = None, limit: float = 5.0) -> Any:
        """One request; raises `SolverFailed` if it failed."""
        (answer,) = self.request([(command, argument, limit)])
        if isinstance(answer, SolverFailed):
            raise answer
        return answer

    def exchange(self, what: Any, limit: float) -> Any:
        """One line there and one back."""
        assert self.process is not None
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        try:
            self.process.stdin.write(json.dumps(what).encode() + b"\n")
        except BrokenPipeError:
            raise self.lost() from None
        received, deadline = b"", monotonic() + limit
        while not received.endswith(b"\n"):
            ready, _, _ = select.select([self.process.stdout], [], [], max(0.0, deadline - monotonic()))
            if not ready:
                self.close()
                raise SolverFailed("timeout", f"does not come back within {limit:g} s and had to be stopped")
            chunk = os.read(self.process.stdout.fileno(), 1 << 20)
            if not chunk:
                raise self.lost()
            received += chunk
        try:
            return json.loads(received)
        except ValueError:
            raise SolverFailed("crashed", INTRUDED) from None

    def lost(self) -> SolverFailed:
        """Why the process is gone."""
        assert self.process is not None
        code = self.process.wait(timeout=GRACE)
        ends_v8 = self.kind == "javascript" and -code in (signal.SIGTRAP, signal.SIGABRT)  # V8's word for a full heap
        if ends_v8 or -code == signal.SIGKILL:
            return SolverFailed("memory", "wants more memory than it is given, and its process was ended")
        if -code == signal.SIGABRT:
            return SolverFailed("crashed", "its process was ended by SIGABRT")
        name = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return SolverFailed("crashed", f"ended its own process ({name})")

    def close(self) -> None:
        """End the process and all it has started."""
        if self.process is not None:
            if self.process.poll() is None:
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            for stream in (self.process.stdin, self.process.stdout):
                if stream is not None:
                    stream.close()
            self.process = None
