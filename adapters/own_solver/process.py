"""Runs a file in a separate process, so that nothing in it can end this program: a solver, an
engine of own_engine, or one of adapters/javascript."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, NamedTuple

from crosscheck2d.adapters import system
from crosscheck2d.adapters.engine import NotStarted
from crosscheck2d.adapters.own_solver.file import PATIENCE, Loadable, SolverFailed, SolverText
from crosscheck2d.adapters.own_solver.worker import HERE, MEMORY
from crosscheck2d.adapters.safe_path import path_of_this, python
from crosscheck2d.scenarios.truth.cache import folder

STARTING = 14.0  # s for Python, V8 or numba to start on a busy machine, and the file to load
WORK = "from crosscheck2d.adapters.own_solver.worker import work; work()"
INTRUDED = "wrote into the channel that its answers come by"
TOO_LARGE = "needs more memory than it may use, and its process was ended"
LONGEST_ANSWER = 2**28  # bytes of a line: the states of a million disks take less than 2**27
GRACE = 4.0  # s beyond what the calls of a request may take
Request = tuple[str, Any, float]
"""A command of the worker, its argument, and how long it may take, s."""


class Idle(NamedTuple):
    """A process that has finished with its solver, the solver's text, and the output of the
    process."""

    solver: str
    process: subprocess.Popen[bytes]
    pieces: system.Pieces


# Language -> the process that waits for reuse; None if processes are not reused.
waiting: dict[str, Idle] | None = None
REUSED = ("javascript", "python")


def keep_processes() -> None:
    """From now on processes are reused instead of ended.

    Starting Python and its libraries takes a third of a second. V8 can load another file without
    any state of the last one; a Python process can only load the same file again, because the file
    may have changed modules. A waiting process ends with this one.
    """
    global waiting
    waiting = {} if waiting is None else waiting


@contextmanager
def processes_reused() -> Iterator[None]:
    """Context in which processes are reused, as by `keep_processes`."""
    global waiting
    before = waiting
    keep_processes()
    try:
        yield
    finally:
        if before is None:
            for idle in (waiting or {}).values():
                end(idle.process)
            waiting = None


def end(process: subprocess.Popen[bytes]) -> None:
    """End a process and all it has started."""
    if process.returncode is None:  # nobody else has its number before its status is read
        system.end_all(process.pid)
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            stream.close()


class SolverProcess:
    """A solver's text, or an engine's package, in a separate process; use it in a `with`, or close
    it.

    Attributes:
        functions: those of integrate, collide, step, wrap and begin that it has, and the built-ins
            that it replaced.
        kind: "javascript" or "python"; or "packaged", an engine of adapters/javascript.
        surface: "exercise" (functions on spheres), "advance" (arrays, as in reference_impl),
            "engine" (a file of adapters/own_engine) or "packaged".
        versions: library -> version.

    Raises:
        SolverFailed: the file cannot be loaded.
        NotStarted: the process cannot be started.
    """

    process: subprocess.Popen[bytes] | None
    pieces: system.Pieces

    def __init__(self, solver: SolverText | Loadable, compiled: bool = False) -> None:
        self.kind = solver.kind
        self.sound = True  # nothing in it was stopped
        kept = folder()
        copies = None
        if compiled and kept and isinstance(solver, SolverText) and self.kind == "python":
            copies = kept_copies(solver, kept)
        # Plain Python gives the same bits as numba, and starts 20 s earlier.
        settings = {"PYTHONDONTWRITEBYTECODE": "1"} | ({} if copies else {"NUMBA_DISABLE_JIT": "1"})
        settings["PYTHONPATH"] = path_of_this()
        if kept is not None:
            settings["NUMBA_CACHE_DIR"] = str(kept / "numba")
        self.solver = pickle.dumps((solver, copies)).hex()
        hello = self.start(settings)
        if not isinstance(hello, dict) or not {"failed", "functions"} & hello.keys():
            self.end()
            raise SolverFailed("crashed", INTRUDED)
        if "failed" in hello:
            self.end()
            raise SolverFailed(**hello["failed"])
        self.functions: dict[str, Any] = hello["functions"]
        self.surface: str = hello["surface"]
        self.versions: dict[str, str] = hello["versions"]

    def start(self, settings: dict[str, str]) -> Any:
        """Start a process, or reuse the waiting one, and send it the solver; returns its first
        answer.

        The process itself stops a file that does not load in time. If it does not answer at all, it
        is started once more before the file is blamed: a start of V8 has been seen to hang, though
        in none of 1259 starts that were counted.
        """
        for last in (False, True):
            try:
                if not self.take():
                    self.begin(settings)
                return self.exchange(self.solver, STARTING)
            except BaseException as error:
                self.end()
                if last or not (isinstance(error, SolverFailed) and error.kind == "timeout"):
                    raise
        raise AssertionError("the second start returns or raises")

    def take(self) -> bool:
        """Reuse the waiting process if it can load this solver, else end it; returns whether it is
        reused."""
        idle = waiting.pop(self.kind, None) if waiting else None
        if idle is None:
            return False
        if idle.process.poll() is None and (
            self.kind == "javascript" or idle.solver == self.solver
        ):
            _, self.process, self.pieces = idle
            return True
        end(idle.process)
        return False

    def begin(self, settings: dict[str, str]) -> None:
        """Start the process, without the solver, and wait for its first line; raises
        `NotStarted`."""
        self.process = None
        try:
            self.process = subprocess.Popen(
                python(WORK),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | settings,
                bufsize=0,
                **system.own_group(),
            )
            assert self.process.stdout is not None
            self.pieces = system.Pieces(self.process.stdout)
            if self.receive(STARTING) == HERE:
                return
            why = "its first line was not the expected one"
        except (OSError, SolverFailed) as fault:
            why = str(fault)
        raise NotStarted(f"the process for a solver's file could not be started: {why}")

    def __enter__(self) -> SolverProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: object, trace: TracebackType | None
    ) -> None:
        self.close()

    def request(
        self, requests: Sequence[Request], total: float = float("inf")
    ) -> list[Any | SolverFailed]:
        """The answer to each request, or its failure, within `total` s; raises `SolverFailed` if
        the process is lost."""
        # After a call that does not return the worker makes no other like it.
        stopped_once = max(1, len({call for each in requests for call in calls_of(each)}))
        longest = max((limit for _, _, limit in requests), default=0.0)
        most = stopped_once * PATIENCE * longest
        answers = self.exchange(requests, min(most + GRACE, total))
        if not isinstance(answers, list) or len(answers) != len(requests):
            self.end()
            raise SolverFailed("crashed", INTRUDED)
        stopped = [a["failed"]["kind"] for a in answers if "failed" in a]
        self.sound &= not {"timeout", "memory", "crashed"} & {*stopped}
        return [SolverFailed(**a["failed"]) if "failed" in a else a["done"] for a in answers]

    def do(self, command: str, argument: Any = None, limit: float = 5.0) -> Any:
        """One request; raises `SolverFailed` if it failed."""
        (answer,) = self.request([(command, argument, limit)])
        if isinstance(answer, SolverFailed):
            raise answer
        return answer

    def exchange(self, what: Any, limit: float) -> Any:
        """Send one line, and return the line that answers it."""
        if self.process is None:
            raise SolverFailed("crashed", "its process has been stopped before")
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(what).encode() + b"\n")
        except BrokenPipeError:
            raise self.lost() from None
        return self.receive(limit)

    def receive(self, limit: float) -> Any:
        """Read one line from the process, within `limit` s."""
        assert self.process is not None
        received, deadline = bytearray(), monotonic() + limit
        while not received.endswith(b"\n"):
            left = deadline - monotonic()
            chunk = self.pieces.next(min(left, system.LOOK))
            if chunk is None and self.process.poll() is not None:
                chunk = self.pieces.next(0.0) or b""  # its child may keep the pipe open
            if chunk is None and left > system.LOOK:
                self.end_if_too_large()
                continue
            if chunk is None or left < 0:  # a process that writes endlessly always has a next piece
                self.end()
                raise SolverFailed(
                    "timeout", f"does not come back within {limit:g} s and had to be stopped"
                )
            if not chunk:
                raise self.lost()
            received += chunk
            if len(received) > LONGEST_ANSWER:
                self.end()
                raise SolverFailed("crashed", INTRUDED)
        try:
            return json.loads(received)
        except ValueError:
            raise SolverFailed("crashed", INTRUDED) from None

    def end_if_too_large(self) -> None:
        """End a process that takes more memory than it is given; raises `SolverFailed`."""
        assert self.process is not None
        if system.holds_more(self.process.pid, MEMORY):
            self.end()
            raise SolverFailed("memory", TOO_LARGE)

    def lost(self) -> SolverFailed:
        """The failure of a process that has ended."""
        assert self.process is not None
        code = self.process.wait(timeout=GRACE)
        system.end_all(self.process.pid)  # what it has left in its group
        # what V8 sends when its heap is full
        ends_v8 = self.kind != "python" and code in (system.TRAPPED, system.ABORTED)
        if ends_v8 or code == system.OUT_OF_MEMORY:
            return SolverFailed("memory", TOO_LARGE)
        if code == system.KILLED:
            return SolverFailed(
                "crashed",
                "its process was ended by SIGKILL, as a system does that runs out of memory",
            )
        if code == system.ABORTED:
            return SolverFailed("crashed", "its process was ended by SIGABRT")
        name = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return SolverFailed("crashed", f"ended its own process ({name})")

    def close(self) -> None:
        """End the process, or let it wait for its next use."""
        free = waiting is not None and self.kind in REUSED and self.kind not in waiting
        if free and self.process is not None and self.sound and self.process.poll() is None:
            assert waiting is not None
            waiting[self.kind] = Idle(self.solver, self.process, self.pieces)
            self.process = None
        self.end()

    def end(self) -> None:
        """End the process and all it has started."""
        if self.process is not None:
            end(self.process)
            self.process = None


def calls_of(request: Request) -> list[str]:
    """The names of the functions that a request calls."""
    command, argument, _ = request
    return [call[0] for call in argument["calls"]] if command == "ask" else [command]


def kept_copies(solver: SolverText, kept: Path) -> Path | None:
    """A folder below `kept` with the texts of a Python solver, named by their hash; None if it
    cannot be written.

    numba caches compiled code by path and content of the file at that moment. The file may have
    been saved again since it was read, and the modules that it imports are compiled into it; in
    either case numba would use outdated code.
    """
    copies = kept / "solvers" / solver.source
    try:
        for file, text in {
            **dict(solver.imported),
            solver.path.resolve().name: solver.text,
        }.items():
            copy = copies / file
            if copy.is_file() and copy.read_bytes() == text.encode():
                continue
            copy.parent.mkdir(parents=True, exist_ok=True)
            handle, temporary = tempfile.mkstemp(dir=copy.parent)
            with os.fdopen(handle, "wb") as written:
                written.write(text.encode())
            os.replace(temporary, copy)
    except OSError:
        return None
    return copies
