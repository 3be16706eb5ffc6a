"""A guest's process as its parent sees it: code of others, which nothing it does can take out of
its limits. A request, a limit of time, an answer of which every field is checked."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import signal
import subprocess
import tempfile
from base64 import b64decode
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    StrictBool,
    StrictFloat,
    StrictInt,
    StrictStr,
    TypeAdapter,
    ValidationError,
)
from typing_extensions import TypedDict

from crosscheck2d.adapters import system
from crosscheck2d.adapters.engine import NotStarted
from crosscheck2d.adapters.host.file import PATIENCE, SolverFailed, SolverText
from crosscheck2d.adapters.host.gl_matrix import with_hint
from crosscheck2d.adapters.host.sandbox import ALLOWED, MEMORY, Level, levels, start
from crosscheck2d.adapters.library_versions import version
from crosscheck2d.scenarios.truth.cache import folder

STARTING = 14.0  # s for Python, V8 or numba to start on a busy machine, and the file to load
INTRUDED = "wrote into the channel that its answers come by"
TOO_LARGE = "needs more memory than it may use, and its process was ended"
LONGEST_ANSWER = 2**28  # bytes of a line: the states of a million disks take less than 2**27
GRACE = 4.0  # s beyond what the calls of a request may take
Request = tuple[str, Any, float]
"""A command of the driver, its argument, and how long it may take, s."""


class Idle(NamedTuple):
    process: subprocess.Popen[bytes]
    pieces: system.Pieces
    level: Level
    packaged: bool


# (this process, hash of the order of a guest) -> its process, which waits for reuse: starting one
# takes longer than most scenes. By this process: a fork cannot talk to it. It ends with this one.
waiting: dict[tuple[int, str], Idle] = {}
_reusing = 0
MOST_WAITING = 4


def keep_processes() -> None:
    """From now on processes are reused by guests with the same texts, which they load again."""
    global _reusing
    _reusing += 1


@contextmanager
def processes_reused() -> Iterator[None]:
    global _reusing
    keep_processes()
    try:
        yield
    finally:
        _reusing -= 1
        if not _reusing:
            for key in [key for key, idle in waiting.items() if not idle.packaged]:
                end(waiting.pop(key).process)


def end(process: subprocess.Popen[bytes]) -> None:
    if process.returncode is None:  # nobody else has its number before its status is read
        system.end_all(process.pid)
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with suppress(BrokenPipeError):  # what it has not read
                stream.close()


class SolverProcess:
    """A guest in a separate process; use it in a `with`, or close it. Raises `SolverFailed` if the
    file cannot be loaded, `NotStarted` if the process cannot be started.

    compiled: numba compiles, and keeps what it has compiled.

    Attributes:
        functions: name of a verb of the driver -> whether the file has it; models; the built-ins
            that it replaced.
        surface: "exercise" (functions on spheres), "advance" (arrays, as in reference_impl) or
            "engine" (create, step, read).
    """

    process: subprocess.Popen[bytes] | None
    pieces: system.Pieces

    def __init__(self, solver: SolverText, compiled: bool = False) -> None:
        self.solver, self.kind = solver, solver.kind
        self.sound, self.process = True, None  # nothing in it was stopped
        kept = folder()
        compiles = compiled and kept is not None and self.kind == "python"
        self.copies = kept_copies(solver, kept) if compiles and kept else None
        self.order = solver.order | {"folder": str(self.copies) if self.copies else None}
        digest = hashlib.sha256(json.dumps([levels(), self.order]).encode()).hexdigest()
        self.key = os.getpid(), digest
        try:
            hello = self.connect()
        except BaseException:
            self.end()
            raise
        others = {"models": hello["models"], "replaced": hello["replaced"]}
        self.functions: dict[str, Any] = hello["functions"] | others
        advance = self.functions.get("advance")
        self.surface = "engine" if solver.engine else "advance" if advance else "exercise"
        self.versions = {**solver.versions, **hello["versions"]}
        if self.kind == "javascript":
            self.versions["mini-racer"] = version("mini-racer")

    def connect(self) -> Hello:
        idle = waiting.pop(self.key, None)
        if idle is not None and idle.process.poll() is None:
            self.process, self.pieces, self.level, _ = idle
        else:
            self.begin()
        hello = self.exchange({"open": self.order}, STARTING)
        try:
            if "failed" not in hello:
                return HELLO.validate_python(hello)
            failure = failure_in(FAILURE.validate_python(hello["failed"]))
        except ValidationError:
            raise self.intruded() from None
        assert failure is not None
        raise failure

    def begin(self) -> None:
        reason = ""
        trusted = self.solver.package is not None  # its hash is that of what was read
        possible = (Level.NONE,) if trusted else levels()
        for level in (_working[possible],) if possible in _working else possible:
            try:
                self.launch(level)
                hello = self.receive(STARTING)
                able = set(hello.get("can", ())) if isinstance(hello, dict) else {"speak"}
                if able <= ALLOWED[level]:
                    _working[possible] = level
                    return
                reason = f"at level {level} a guest could {', '.join(sorted(able))}"
            except (OSError, SolverFailed, TypeError) as fault:
                reason = str(fault)
            self.end()
        raise NotStarted(f"the process for a solver's file could not be started: {reason}")

    def launch(self, level: Level) -> None:
        packages = self.solver.packages + (("numba",) if self.solver.reference else ())
        how = start(level, self.kind, packages, self.copies)
        self.process = subprocess.Popen(
            how.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=how.environment,
            cwd="/" if os.name == "posix" else None,
            bufsize=0,
            start_new_session=True,  # the guest ends its group with itself, and no other process
        )
        assert self.process.stdout is not None
        self.level, self.pieces = level, system.Pieces(self.process.stdout)

    def __enter__(self) -> SolverProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def request(
        self, requests: Sequence[Request], total: float = float("inf")
    ) -> list[Any | SolverFailed]:
        """The answer to each request, or its failure, within `total` s; raises `SolverFailed` if
        the process is lost."""
        # After a call that does not return the driver makes no other like it.
        calls = {command for command, _, _ in requests if command != "ask"}
        for command, argument, _ in requests:
            calls |= {call[0] for call in argument["calls"]} if command == "ask" else set()
        longest = max((limit for _, _, limit in requests), default=0.0)
        most = max(1, len(calls)) * PATIENCE * longest
        answers = self.exchange({"do": requests}, min(most + GRACE, total)).get("done")
        if not isinstance(answers, list) or len(answers) != len(requests):
            raise self.intruded()
        try:
            results = [value_of(request[0], answer) for request, answer in zip(requests, answers)]
        except (TypeError, ValueError, KeyError):
            raise self.intruded() from None
        kinds = {result.kind for result in results if isinstance(result, SolverFailed)}
        self.sound &= not {"timeout", "memory", "crashed"} & kinds
        return results

    def do(self, command: str, argument: Any = None, limit: float = 5.0) -> Any:
        (answer,) = self.request([(command, argument, limit)])
        if isinstance(answer, SolverFailed):
            raise answer
        return answer

    def exchange(self, what: dict[str, Any], limit: float) -> dict[str, Any]:
        """Send one line, and return the line that answers it: it has the random number of its
        question, so that no answer can be written before it."""
        if self.process is None:
            raise SolverFailed("crashed", "its process has been stopped before")
        assert self.process.stdin is not None
        number = secrets.token_hex(8)
        try:
            self.process.stdin.write(json.dumps({"id": number} | what).encode() + b"\n")
        except BrokenPipeError:
            raise self.lost() from None
        answer = self.receive(limit)
        if not isinstance(answer, dict) or answer.pop("id", None) != number:
            raise self.intruded()
        return answer

    def receive(self, limit: float) -> Any:
        assert self.process is not None
        received, deadline = bytearray(), monotonic() + limit
        while b"\n" not in received[-system.PIECE :]:
            left = deadline - monotonic()
            chunk = self.pieces.next(min(left, system.LOOK))
            if chunk is None and self.process.poll() is not None:
                chunk = self.pieces.next(0.0) or b""  # its child may keep the pipe open
            if chunk is None and left > system.LOOK:
                if system.holds_more(self.process.pid, MEMORY):
                    self.end()
                    raise SolverFailed("memory", TOO_LARGE)
                continue
            if chunk is None or left < 0:  # a process that writes endlessly always has a next piece
                self.end()
                raise ended_by_clock(f"does not come back within {limit:g} s and had to be stopped")
            if not chunk:
                raise self.lost()
            received += chunk
            if len(received) > LONGEST_ANSWER:
                raise self.intruded()
        try:
            return json.loads(received)  # two lines are no JSON: one was not asked for
        except (ValueError, RecursionError):
            raise self.intruded() from None

    def intruded(self) -> SolverFailed:
        self.end()
        return SolverFailed("crashed", INTRUDED)

    def lost(self) -> SolverFailed:
        assert self.process is not None
        code = self.process.wait(timeout=GRACE)
        if self.level == Level.BUBBLEWRAP and code > 128:  # as a shell says it
            code = 128 - code
        system.end_all(self.process.pid)  # what it has left in its group
        # what V8 sends when its heap is full
        ends_v8 = self.kind != "python" and code in (system.TRAPPED, system.ABORTED)
        if ends_v8 or code == system.OUT_OF_MEMORY:
            return SolverFailed("memory", TOO_LARGE)
        if code in (system.KILLED, system.ABORTED):
            name = signal.Signals(-code).name
            cause = ", as a system does that runs out of memory" * (code == system.KILLED)
            return SolverFailed("crashed", f"its process was ended by {name}{cause}")
        name = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return SolverFailed("crashed", f"ended its own process ({name})")

    def close(self) -> None:
        packaged = self.solver.package is not None
        free = (_reusing or packaged) and self.sound and self.key not in waiting
        if free and self.process is not None and self.process.poll() is None:
            mine = [key for key in waiting if key[0] == os.getpid()]
            for oldest in mine[: max(0, len(mine) - MOST_WAITING + 1)]:
                end(waiting.pop(oldest).process)
            waiting[self.key] = Idle(self.process, self.pieces, self.level, packaged)
            self.process = None
        self.end()

    def end(self) -> None:
        if self.process is not None:
            end(self.process)
            self.process = None


_late = 0
_working: dict[tuple[Level, ...], Level] = {}  # levels that may work -> the best that does


def clock_endings() -> int:
    """How many calls in this process the clock has ended: on an idle machine they may return."""
    return _late


def ended_by_clock(what: str, line: int = 0, column: int = 0) -> SolverFailed:
    global _late
    _late += 1
    return SolverFailed("timeout", what, line, column)


def protection() -> Level:
    """What protects this machine from guests, tried with a guest that tries."""
    with SolverProcess(SolverText(Path("probe.py"), "python", "", "")) as process:
        return process.level


# ---- the forms of what a guest answers ----------------------------------------------------------

# no bool, no text, no int that is longer than a float
Number = Annotated[float, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=0, lt=2**31)]
Place = Annotated[int, Field(strict=True, ge=-1, lt=2**31)]  # of a sphere; -1 for another
Sphere = Annotated[list[Number], Field(min_length=12, max_length=12)]
Contact = Annotated[list[Number], Field(min_length=19, max_length=19)]


SPHERES = {"integrate": 1, "collide": 2}  # that a call is given


def must_be_a_call(call: list[Any]) -> list[Any]:
    name, *numbers = call
    if type(name) is not str or str in map(type, numbers):
        raise ValueError("a call is the name of its function, then numbers")
    if len(numbers) < SPHERES.get(name, 0):
        raise ValueError("a call lacks a sphere")
    return call


Verb = Literal["integrate", "collide", "wrap", "step"]
Call = Annotated[list[Verb | Place | Number], AfterValidator(must_be_a_call)]
Setting = StrictStr | StrictBool | StrictInt | StrictFloat | None


class FailureForm(TypedDict):
    # unavailable: it imports what is not there, or what a guest may not; waited: ended by the
    # clock, before it had its processor time
    kind: Literal[
        "error", "timeout", "memory", "crashed", "refused", "diverged", "unavailable", "waited"
    ]
    what: StrictStr
    line: Count
    column: Count


class Hello(TypedDict):
    functions: dict[str, StrictBool]
    models: StrictStr | None
    replaced: list[StrictStr]
    versions: dict[str, StrictStr]


class Answer(TypedDict):
    states: list[list[Sphere]]
    returned: StrictBool
    strayed: StrictBool
    strange: list[StrictStr]
    kept: list[StrictStr]
    calls: list[Call]
    error: FailureForm | None


class Readings(TypedDict):
    readings: Count
    seconds: Number
    numbers: StrictStr
    thrown: FailureForm | None


PLAYS = ("play", "ahead", "samples")
FAILURE, HELLO = TypeAdapter(FailureForm), TypeAdapter(Hello)
FORMS: dict[str, TypeAdapter[Any]] = {
    "ask": TypeAdapter(Answer),
    "accesses": TypeAdapter(list[tuple[Literal["r", "w"], Place, StrictStr, list[Count]]]),
    "left": TypeAdapter(list[Sphere]),
    "globals": TypeAdapter(list[Sphere] | None),
    "contacts": TypeAdapter(list[Contact]),
    "load": TypeAdapter(list[tuple[StrictStr, Setting, Setting]]),
    "step": TypeAdapter(Number | None),  # s in V8
    **dict.fromkeys(PLAYS, TypeAdapter(Readings)),
}


def value_of(command: str, answer: Any) -> Any:
    """Of an answer, with numbers as floats and failures as exceptions; raises `ValueError`,
    `TypeError` or `KeyError` for another form."""
    if "failed" in answer:
        return failure_in(FAILURE.validate_python(answer["failed"]))
    done = answer["done"]
    if command not in FORMS:
        return None
    done = FORMS[command].validate_python(done)
    if command == "ask":
        return done | {"error": failure_in(done["error"])}
    if command in PLAYS:
        numbers = np.frombuffer(b64decode(done["numbers"], validate=True))
        return done | {"numbers": numbers, "thrown": failure_in(done["thrown"])}
    return done


def failure_in(failed: FailureForm | None) -> SolverFailed | None:
    if failed is None:
        return None
    what = with_hint(failed["what"])
    if failed["kind"] == "waited":
        return ended_by_clock(what, failed["line"], failed["column"])
    return SolverFailed(failed["kind"], what, failed["line"], failed["column"])


def kept_copies(solver: SolverText, kept: Path) -> Path | None:
    """A folder below `kept` with the texts of a Python guest, named by their hash; None if it
    cannot be written.

    numba caches compiled code by path and content of the file at that moment. The file may have
    been saved again since it was read, and the modules that it imports are compiled into it; in
    either case numba would use outdated code.
    """
    copies = kept / "solvers" / solver.source
    try:
        for file, text in {
            **dict(solver.imported),
            **solver.reference,
            solver.path.name: solver.text,
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
