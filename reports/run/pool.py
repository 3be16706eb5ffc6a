"""Runs tasks in worker processes, so that a task that aborts, hangs or takes too much memory harms
no other.

Each worker has a pipe of its own, so that one that dies takes nothing of another with it. Its time
is measured by a clock that nobody sets, and a task may ask for more while it runs. The pools of
concurrent.futures, loky, joblib and pebble lose finished results when a worker is killed, or break;
pebble also stops tasks when the system's clock jumps.
"""

from __future__ import annotations

import faulthandler
import math
import multiprocessing
import os
import pickle
import re
import shutil
import signal
import sys
import tempfile
from collections import Counter, deque
from collections.abc import Callable, Collection, Generator, Hashable, Mapping, Sequence
from contextlib import ExitStack, suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

import psutil

from crosscheck2d.adapters import system
from crosscheck2d.adapters.safe_path import OwnPackages, keep_path_safe
from crosscheck2d.reports.terminal.exits import refuse, say, signal_status

TIMEOUT = 60.0  # s a task may take
STARTING = 120.0  # s for a process to start and to import the modules of a task, on a busy machine
IDLE = 60.0  # s without a task after which a process ends: those of other machines outlive a run
ATTEMPTS = 2  # of a task whose worker is killed from outside
OUTSIDE = {system.KILLED, system.TERMINATED, 0}  # signals that a fault of an engine does not cause
LOOK = 0.5  # s between two looks at the output and at the time; 0.05 beside a cluster
MOST_PRINTED = 1 << 20  # bytes of output that a task may leave; earlier output is dropped
PRINTED = 65536  # bytes of it that are read: faulthandler writes up to 100 lines a thread
LEAST_MEMORY = 400  # MB: Python, numba and the engines take 120, compiling a kernel as much again
LINES, OTHERS = 4, 60  # open files: of each worker; and for everything else
CLOCK = b"clock "  # begins a number of s; no pickle begins with it
# A fork has all modules at once; macOS and Windows start a new interpreter.
CONTEXT: Any = multiprocessing.get_context("fork" if system.KERNEL else "spawn")
# the calls that wait for what a solver's file answers
ASKING = ("host/process.py", "adapters/system.py")
# of the thread that got the signal, which is the one that plays; other threads only watch
INNERMOST = re.compile(
    r'Current thread [^\n]*most recent call first\):\s*File "([^"]+)", line (\d+) in (\S+)'
)
Task = Callable[[], Any]
RUNNING, LOST = object(), object()  # a task that has not ended; one whose worker was killed


class Failure(NamedTuple):
    """A task without a result.

    Attributes:
        status: "crashed", "timeout" or "error", as in `STATUSES` of run.py.
        reason: why.
        trail: the bytes that the task left.
        outside: whether the reason is outside the engine: the machine, the memory, this program.
            Another try may succeed.
    """

    status: str
    reason: str
    trail: bytes = b""
    outside: bool = False


# In a worker.

_trail: int | None = None
_parent: Connection | None = None


def leave(parts: Sequence[Any]) -> None:
    """Append bytes to the trail of this task, which survives the process."""
    if _trail is not None:
        with suppress(OSError):  # if the trail cannot be written, the engine is not at fault
            os.write(_trail, b"".join(parts))


def allow(seconds: float = 0.0) -> None:
    """From now on this task may take `seconds`, or its time-out if that is longer. Does nothing
    outside a worker."""
    if _parent is not None:
        _parent.send_bytes(CLOCK + str(seconds).encode())


def serve(connection: Connection, folder: str, memory: int, fresh: bool) -> None:
    """The main function of a worker: carry out tasks until there are no more.

    `folder` has the files of its output and its trail; `fresh`: it is a new interpreter, no fork.
    """
    global _trail, _parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if fresh:
        keep_path_safe()
        sys.meta_path.insert(0, OwnPackages())
    append = os.O_WRONLY | os.O_CREAT | os.O_APPEND | system.BINARY
    output = os.open(Path(folder, "output"), append)
    for number, file in enumerate((os.open(os.devnull, os.O_RDONLY), output, output)):
        os.dup2(file, number)
    _trail, _parent = os.open(Path(folder, "trail"), append), connection
    faulthandler.enable(2)
    system.write_no_core()
    if memory:
        system.limit_memory(memory)
    system.end_with_parent()
    with suppress(EOFError, ConnectionError):
        while connection.poll(IDLE):
            answer, usable = carried_out(connection.recv_bytes(), memory)
            connection.send_bytes(answer)
            if not usable:  # whatever memory is not released ends with the process
                return


def carried_out(packed: bytes, memory: int) -> tuple[bytes, bool]:
    """The pickled result of a task, or `Failure`; and whether the process is still usable."""
    doing = "the worker cannot read its task: "
    try:
        task = pickle.loads(packed)
        doing = ""
        allow()
        result = task()
        doing = "its result cannot be sent back: "
        return pickle.dumps(result), True
    except MemoryError as error:
        error.__traceback__ = None  # releases the frames, and so the objects they hold
        return pickle.dumps(out_of_memory(memory)), False
    except Exception as error:  # an engine may raise anything
        outside = bool(doing) or bool(getattr(error, "outside", False))  # of `NotStarted`
        reason = f"{doing}{type(error).__name__}: {error}"
        return pickle.dumps(Failure("error", reason, outside=outside)), True


def out_of_memory(memory: int) -> Failure:
    limit = f"more than {memory / 1e6:.0f} MB (--memory)" if memory else "more than there is"
    return Failure("error", f"MemoryError: took {limit}", outside=True)


# In the parent.


def start_process(connection: Connection, folder: str, memory: int) -> Any:
    fresh = CONTEXT.get_start_method() == "spawn"
    if fresh:  # finds nothing in the folder in which the command was started
        os.environ["PYTHONSAFEPATH"] = "1"
    process = CONTEXT.Process(target=serve, args=(connection, folder, memory, fresh), daemon=True)
    process.start()
    return process


class Worker:
    """A process, its pipe, and a folder with its output and the trail of its task; `memory` in
    bytes, 0: no limit. Raises `OSError` if it cannot be started."""

    def __init__(self, memory: int) -> None:
        self.memory = memory
        self.task: tuple[Any, bytes] | None = None  # its key, and its pickle
        self.folder = Path(tempfile.mkdtemp(prefix="crosscheck-"))
        self.output, self.trail = self.folder / "output", self.folder / "trail"
        for path in (self.output, self.trail):
            path.touch()
        self.connection, theirs = multiprocessing.Pipe()
        try:
            self.process = start_process(theirs, str(self.folder), memory)
        except BaseException:
            self.connection.close()
            shutil.rmtree(self.folder, ignore_errors=True)
            raise
        finally:
            theirs.close()

    def begin(self, key: Any, packed: bytes, timeout: float) -> None:
        """Give it a pickled task, whose `timeout` counts from its arrival, and again from each call
        of `allow`."""
        self.task, self.timeout, self.limit, self.begun = (key, packed), timeout, STARTING, False
        self.end = monotonic() + STARTING
        for path in (self.output, self.trail):
            os.truncate(path, 0)
        with suppress(ConnectionError):  # it has died, which `poll` finds
            self.connection.send_bytes(packed)

    def poll(self) -> Any:
        """The pickled result of its task, its `Failure`, `LOST`, or `RUNNING`."""
        try:
            while self.connection.poll():
                answer = self.connection.recv_bytes()
                if not answer.startswith(CLOCK):
                    return answer
                self.limit = max(float(answer.removeprefix(CLOCK)), self.timeout)
                self.begun, self.end = True, monotonic() + self.limit
        except (EOFError, OSError):
            return self.death()
        if self.process.exitcode is not None:
            return self.death()
        if monotonic() > self.end:
            if os.name == "posix":
                os.kill(self.process.pid, signal.SIGABRT)  # faulthandler works even inside C code
                self.process.join(1.0)
            self.kill()
            what = "stopped after" if self.begun else "its worker did not start in"
            return self.failure("timeout", f"{what} {self.limit:g} s")
        if self.output.stat().st_size > MOST_PRINTED:
            os.truncate(self.output, 0)
        return RUNNING

    def death(self) -> Any:
        self.process.join()
        code = self.process.exitcode
        if code in OUTSIDE:
            return LOST
        if code == system.OUT_OF_MEMORY:
            return out_of_memory(self.memory)
        what = "worker died" if self.begun else "its worker could not start"
        how = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return self.failure("crashed", f"{what}: {how}")

    def failure(self, status: str, reason: str) -> Failure:
        """With the place in Python that faulthandler printed, and the last line printed before."""
        printed = self.output.read_bytes()[-PRINTED:].decode(errors="replace")
        before, fatal, dump = printed.rpartition("Fatal Python error: ")
        if innermost := INNERMOST.search(dump):
            file = "/".join(Path(innermost[1]).parts[-2:])
            # a solver's file runs in another process, so the place in the file is not known here
            if file in ASKING:
                reason += ", while the solver's file had not come back from a call"
            else:
                reason += f" in {innermost[3]}, line {innermost[2]} of {file}"
        lines = [line for line in (before if fatal else printed).splitlines() if line.strip()]
        reason += f'; it had printed "{lines[-1].strip()[:200]}"' if lines else ""
        return Failure(status, reason, self.trail.read_bytes(), outside=not self.begun)

    def kill(self) -> None:
        """End the process, and what it has started."""
        if not system.KERNEL and self.process.pid is not None:
            system.end_all(self.process.pid)
        self.process.kill()
        self.process.join()

    def close(self) -> None:
        self.kill()
        self.connection.close()
        shutil.rmtree(self.folder, ignore_errors=True)


class Pool:
    """At most `workers` workers, which are started when they are needed. A task whose key is in
    `alone` gets a process of its own."""

    def __init__(
        self, workers: int, timeout: float, memory: int, alone: Collection[Hashable] = ()
    ) -> None:
        self.most, self.timeout, self.memory, self.alone = workers, timeout, memory, alone
        self.workers: list[Worker] = []

    @property
    def busy(self) -> list[Worker]:
        return [worker for worker in self.workers if worker.task is not None]

    @property
    def has_room(self) -> bool:
        return len(self.busy) < self.most

    def begin(self, key: Any, packed: bytes) -> None:
        """Give a pickled task to a worker."""
        for worker in [worker for worker in self.workers if worker.task is None]:
            ended = worker.process.exitcode is not None
            if ended or key in self.alone or worker.memory != self.memory:
                self.close(worker)
        if all(worker.task is not None for worker in self.workers):
            try:
                self.workers.append(Worker(self.memory))
            except OSError as fault:
                refuse(f"no more processes can be started: {fault.strerror or fault}")
        idle = next(worker for worker in self.workers if worker.task is None)
        idle.begin(key, packed, self.timeout)

    def close(self, worker: Worker) -> None:
        worker.close()
        self.workers.remove(worker)

    def ended(self, seconds: float) -> list[tuple[Any, bytes, Any]]:
        """Key, pickled task and outcome of the tasks that end within `seconds`, or before that as
        soon as one does."""
        if signal_status():  # Python drops the exception of a handler that ran in a destructor
            raise KeyboardInterrupt
        lines = [line for one in self.busy for line in (one.connection, one.process.sentinel)]
        ends = [worker.end - monotonic() for worker in self.busy]
        wait(lines, max(0.0, min([seconds, LOOK, *ends])))
        outcomes = []
        for worker in self.busy:
            outcome = worker.poll()
            if outcome is not RUNNING and worker.task is not None:
                key, packed = worker.task
                outcomes.append((key, packed, outcome))
                worker.task = None
                if not isinstance(outcome, bytes) or key in self.alone:
                    self.close(worker)
        return outcomes

    def close_all(self) -> None:
        for worker in self.workers:
            worker.process.kill()  # all at once, before each is waited for
        for worker in [*self.workers]:
            self.close(worker)


def run_all(
    tasks: Mapping[Hashable, Task],
    workers: int,
    timeout: float = TIMEOUT,
    memory: int = 0,
    far: Any = None,
    alone: Collection[Hashable] = frozenset(),
    urgent: deque[Any] | None = None,
) -> Generator[tuple[Any, Any | Failure], None, None]:
    """Run picklable tasks, `workers` at once; yield (key, result or `Failure`) as each ends.

    A task may take `timeout` s and `memory` bytes (0: no limit). With `far`, an open `Cluster`, the
    tasks run there. Tasks that the caller puts into `urgent` meanwhile start before the others, on
    this machine. For timings `workers` is 1, so that nothing runs beside them.

    Raises:
        NoScheduler: the scheduler of the cluster has gone.
    """
    waiting: deque[tuple[Any, Any]] = deque(tasks.items())
    lost = Counter[Hashable]()
    urgent = deque() if urgent is None else urgent
    pool = Pool(affordable(workers), timeout, memory, alone)
    done: list[tuple[Any, Any]] = []

    def begin() -> None:
        while True:
            place: Any
            if urgent and pool.has_room:
                place, (key, task) = pool, urgent.popleft()
            elif waiting and (far or pool).has_room:
                place, (key, task) = far or pool, waiting.popleft()
            else:
                return
            try:
                packed = task if isinstance(task, bytes) else pickle.dumps(task)
            except Exception as error:
                reason = f"it cannot be sent to a worker: {type(error).__name__}: {error}"
                done.append((key, Failure("error", reason, outside=True)))
            else:
                place.begin(key, packed)

    with ExitStack() as stack:
        stack.callback(pool.close_all)
        begin()
        while done or pool.busy or (far is not None and far.busy):
            outcomes = pool.ended(0.0 if done else 0.05 if far else math.inf)
            outcomes += far.ended() if far is not None else []
            for key, packed, outcome in outcomes:
                lost[key] += outcome is LOST
                if outcome is LOST and lost[key] < ATTEMPTS:
                    waiting.append((key, packed))
                else:
                    done.append((key, result_of(outcome)))
            ended, done[:] = [*done], []
            begin()  # before the caller takes its time
            yield from ended
            begin()  # what the caller has made urgent


def result_of(outcome: Any) -> Any | Failure:
    """The result of a task that has ended, or its `Failure`."""
    if outcome is LOST:
        why = f"its worker was killed {ATTEMPTS} times: by the system for want of memory?"
        return Failure("crashed", why, outside=True)
    return pickle.loads(outcome) if isinstance(outcome, bytes) else outcome


def affordable(workers: int) -> int:
    """The number of workers, at most `workers`, that can start on this machine; prints a line if it
    is fewer, and exits 2 if it is none."""
    memory: int = psutil.virtual_memory().total // 1_000_000
    files = system.most_files()
    if files < OTHERS + LINES:
        refuse(
            f"at most {files} files may be open, and a run needs {OTHERS + LINES}: ulimit -n 1024"
        )
    most = {
        f"memory of {memory} MB, each needs {LEAST_MEMORY}": max(1, memory // LEAST_MEMORY),
        f"limit of {files} open files, each needs {LINES}": (files - OTHERS) // LINES,
    }
    why = min(most, key=lambda what: most[what])
    if workers <= most[why]:
        return workers
    say(f"{workers} workers are more than can start here ({why}): {most[why]} are started")
    return most[why]
