"""A worker as the parent sees it: a process that may abort, hang or eat the memory, and says how it
ended."""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path
from time import monotonic
from typing import Any

from adapters.safe_path import path_of_this, python
from reports.run.worker_process import CLOCK, Failure
from reports.terminal.foreign_text import legible

# s for Python to start and to import what a task is made of, on a machine that is busy
STARTING = 120.0
ATTEMPTS = 3  # at a task whose worker was killed from outside
OUTSIDE = {-signal.SIGKILL, -signal.SIGTERM, 0}  # exits that no engine makes by a fault of its own
# bytes of what a task prints that are kept: faulthandler writes up to 100 lines a thread
PRINTED = 65536
WORK = "from reports.run.worker_process import main; main(sys.argv[1:])"
ASKING = "own_solver/process.py"  # waits for what a solver's file answers
INNERMOST = re.compile(r'most recent call first\):\s*File "([^"]+)", line (\d+) in (\S+)')


class Worker:
    """One process and the three lines to it: tasks and results, what it prints, and the trail of
    its task.

    The trail is a file without a name that both hold open: what a task leaves there outlives the
    process.
    """

    def __init__(self, memory: int, show: bool = False) -> None:
        """Start it; `memory` in bytes, 0: no limit; `show` what it prints on standard error."""
        self.memory, self.show, self.stopped = memory, show, False
        self.printed = b""
        self.connection, theirs = Pipe()
        self.output, printing = os.pipe()
        self.trail = nameless_file()
        self.process = start(theirs, self.trail, printing, memory)
        theirs.close()
        os.close(printing)

    def do(self, task: Callable[[], Any], timeout: float) -> bytes | Failure | None:
        """What the task gave, pickled, or how it failed; None if it is to be tried again with
        another worker.

        The clock of `timeout` starts when the worker has the task, and anew when the task says so
        (`allow`).
        """
        self.printed = b""
        os.ftruncate(self.trail, 0)
        os.lseek(self.trail, 0, os.SEEK_SET)
        limit, begun = STARTING, False
        try:
            self.connection.send_bytes(pickle.dumps(task))
            while (answer := self.answer(limit)).startswith(CLOCK):
                limit, begun = max(float(answer.removeprefix(CLOCK)), timeout), True
            return answer
        except (EOFError, ConnectionError):
            return self.death(begun)
        except TimeoutError:
            where = self.abort()
            said = (
                f"stopped after {limit:g} s{where}"
                if begun
                else f"its worker did not start in {limit:g} s{where}"
            )
            return Failure("timeout", said, self.left(), outside=not begun)

    def answer(self, timeout: float) -> bytes:
        """The next message; what is printed meanwhile is kept. Raises `TimeoutError`, or `EOFError`
        if it died."""
        end = monotonic() + timeout
        lines: list[Any] = [self.connection, self.output]
        while True:
            ready = wait(lines, max(0.0, end - monotonic()))
            if self.output in ready and not self.listen():
                lines.remove(self.output)
            if self.connection in ready:
                return self.connection.recv_bytes()
            if not ready:
                raise TimeoutError

    def listen(self) -> int:
        """Take in what was printed, keep the last of it; returns how many bytes came, 0 at the
        end."""
        new = os.read(self.output, PRINTED)
        self.printed = (self.printed + new)[-PRINTED:]
        if self.show:
            sys.stderr.write(legible(new.decode(errors="replace")))
        return len(new)

    def death(self, begun: bool) -> Failure | None:
        """How a process that hung up has ended, its task `begun` or not; None if it was ended from
        outside."""
        while self.listen():
            pass
        code = self.process.wait()
        if code in OUTSIDE:
            return None
        what = "worker died" if begun else "its worker could not start"
        return Failure(
            "crashed", f"{what}: {name_of_exit(code)}{self.place()}", self.left(), outside=not begun
        )

    def abort(self) -> str:
        """Kill a process that hangs; returns where in Python it was."""
        self.process.send_signal(signal.SIGABRT)  # faulthandler answers even from within C
        end = monotonic() + 1.0
        while wait([self.output], max(0.0, end - monotonic())) and self.listen():
            pass
        self.process.kill()
        self.process.wait()
        return self.place()

    def place(self) -> str:
        """Where Python was when faulthandler was called, and the last line printed before, as the
        end of a sentence."""
        printed = self.printed.decode(errors="replace")
        before, fatal, dump = printed.rpartition("Fatal Python error: ")
        found = INNERMOST.search(dump)
        file = "/".join(Path(found[1]).parts[-2:]) if found else ""
        place = f" in {found[3]}, line {found[2]} of {file}" if found else ""
        # somebody's solver runs in a process of its own, and where, nobody here can tell
        if file == ASKING:
            place = ", while the solver's file had not come back from a call"
        said = [line for line in (before if fatal else printed).splitlines() if line.strip()]
        return place + (f'; it had printed "{said[-1].strip()[:200]}"' if said else "")

    def left(self) -> bytes:
        """The trail of the task."""
        return os.pread(self.trail, os.fstat(self.trail).st_size, 0)

    def close(self) -> None:
        """End it, whatever it is doing."""
        self.stopped = True
        self.process.kill()
        self.process.wait()

    def __del__(self) -> None:
        for line in (self.output, self.trail):
            os.close(line)


def start(theirs: Connection, trail: int, printing: int, memory: int) -> subprocess.Popen[bytes]:
    """A fresh interpreter that serves the other end of a worker's lines."""
    # As here, so that it finds what a task is made of, but nothing that only lies where this
    # command was started.
    return subprocess.Popen(
        [*python(WORK), *map(str, (theirs.fileno(), trail, memory))],
        stdin=subprocess.DEVNULL,
        stdout=printing,
        stderr=printing,
        pass_fds=(theirs.fileno(), trail),
        env=os.environ | {"PYTHONPATH": path_of_this()},
    )


def nameless_file() -> int:
    """A file descriptor that nothing but its holders knows: in memory where the system can
    (Linux)."""
    if sys.platform == "linux":
        return os.memfd_create("trail")
    file, path = tempfile.mkstemp()
    os.unlink(path)
    return file


class Crew:
    """The workers of this process: one a thread, started when a task comes, replaced when it
    died."""

    def __init__(self) -> None:
        self.mine = threading.local()
        self.all: set[Worker] = set()
        self.lock = threading.Lock()
        self.dismissed = False

    def worker(self, memory: int) -> Worker:
        """The living worker of this thread."""
        worker: Worker | None = getattr(self.mine, "worker", None)
        if worker is None or worker.memory != memory or worker.process.poll() is not None:
            self.let_go()
            with self.lock:
                if self.dismissed:
                    raise InterruptedError("the run is over")
                self.mine.worker = worker = Worker(memory)
                self.all.add(worker)
        return worker

    def let_go(self) -> None:
        """End the worker of this thread, if it has one."""
        worker = self.mine.__dict__.pop("worker", None)
        if worker is not None:
            worker.close()
            with self.lock:
                self.all.discard(worker)

    def dismiss(self) -> None:
        """End all workers, and start no more."""
        with self.lock:
            self.dismissed = True
            for worker in self.all:
                worker.close()
            self.all.clear()


CREW = Crew()


def in_worker(task: Callable[[], Any], timeout: float, memory: int, alone: bool) -> bytes | Failure:
    """Carry out a task in the worker of this thread: its result, pickled, or how it failed.

    `alone`: in a process that has seen no other task and will see none. A worker that is killed
    from outside (out of memory, `kill -9`) is no fault of the task, which is tried again.
    """
    for _ in range(ATTEMPTS):
        if alone:
            CREW.let_go()
        worker = CREW.worker(memory)
        try:
            outcome = worker.do(task, timeout)
        except BaseException:  # an answer that nobody read would be taken for that of the next task
            CREW.let_go()
            raise
        if alone or isinstance(outcome, Failure):
            CREW.let_go()
        if outcome is not None:
            return outcome
        if worker.stopped:
            break
    why = f"its worker was killed {ATTEMPTS} times: by the system for want of memory?"
    return Failure("crashed", why, outside=True)


def name_of_exit(code: int) -> str:
    """The signal behind a negative exit code, or the code."""
    return signal.Signals(-code).name if code < 0 else f"exit status {code}"
