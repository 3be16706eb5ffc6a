"""Worker processes, seen from the parent: a worker may abort, hang or use up the memory, and the
parent learns how it ended."""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
from collections.abc import Callable
from math import inf
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path
from time import monotonic
from typing import Any

from crosscheck2d.adapters import system
from crosscheck2d.adapters.safe_path import path_of_this, python
from crosscheck2d.reports.run.worker_process import CLOCK, Failure, out_of_memory

# s for Python to start and to import the modules of a task, on a busy machine
STARTING = 120.0
OUTSIDE = {system.KILLED, system.TERMINATED, 0}  # signals that a fault of an engine does not cause
# bytes kept of the output of a task: faulthandler writes up to 100 lines a thread
PRINTED = 65536
WORK = "from crosscheck2d.reports.run.worker_process import main; main(sys.argv[1:])"
# the calls that wait for what a solver's file answers
ASKING = ("own_solver/process.py", "adapters/system.py")
# of the thread that got the signal, which is the one that plays; other threads only watch
INNERMOST = re.compile(
    r'Current thread [^\n]*most recent call first\):\s*File "([^"]+)", line (\d+) in (\S+)'
)


class Worker:
    """A process with three channels: tasks and results, its output, and the trail of its task.

    The trail is a file without a name that both processes hold open: what a task writes there is
    kept when the worker dies.
    """

    def __init__(self, memory: int) -> None:
        """Start the process; `memory` in bytes, 0: no limit."""
        self.memory, self.stopped = memory, False
        self.printed = b""
        self.start()

    def start(self) -> None:
        """Start the process with its channels."""
        self.connection, theirs = Pipe()
        self.output, printing = os.pipe()
        self.trail = os.memfd_create("trail")
        self.process = start(theirs, self.trail, printing, self.memory)
        theirs.close()
        os.close(printing)

    def do(self, task: Callable[[], Any], timeout: float) -> bytes | Failure | None:
        """Carry out a task; returns the pickled result, or how it failed, or None if another worker
        should try again.

        `timeout` counts from the arrival of the task in the worker, and again from each call of
        `allow`.
        """
        self.printed = b""
        self.forget_trail()
        limit, begun = STARTING, False
        try:
            self.connect()
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

    def connect(self) -> None:
        """Does nothing: the process has its end of the connection from the start."""

    def answer(self, timeout: float) -> bytes:
        """The next message of the worker; its output until then is kept. Raises `TimeoutError`, or
        `EOFError` if the worker died."""
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
        """Read some output of the worker and keep the end of it; returns the number of bytes, 0 at
        the end."""
        new = os.read(self.output, PRINTED)
        self.printed = (self.printed + new)[-PRINTED:]
        return len(new)

    def drain(self, seconds: float) -> None:
        """Read the output to its end, for at most `seconds`."""
        end = monotonic() + seconds
        while wait([self.output], None if seconds == inf else max(0.0, end - monotonic())):
            if not self.listen():
                return

    def death(self, begun: bool) -> Failure | None:
        """How a worker died; None if it was killed from outside. `begun`: whether it had begun its
        task."""
        self.drain(inf)
        code = self.process.wait()
        if code in OUTSIDE:
            return None
        if code == system.OUT_OF_MEMORY:
            return out_of_memory(self.memory)
        what = "worker died" if begun else "its worker could not start"
        how = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return Failure("crashed", f"{what}: {how}{self.place()}", self.left(), outside=not begun)

    def abort(self) -> str:
        """Kill a worker that hangs; returns the place in Python where it hung."""
        if os.name == "posix":
            self.process.send_signal(signal.SIGABRT)  # faulthandler works even inside C code
            self.drain(1.0)
        self.process.kill()
        self.process.wait()
        return self.place()

    def place(self) -> str:
        """The place in Python that faulthandler printed, and the last line of output before it, as
        the end of a sentence."""
        printed = self.printed.decode(errors="replace")
        before, fatal, dump = printed.rpartition("Fatal Python error: ")
        found = INNERMOST.search(dump)
        file = "/".join(Path(found[1]).parts[-2:]) if found else ""
        place = f" in {found[3]}, line {found[2]} of {file}" if found else ""
        # a solver's file runs in another process, so the place in the file is not known here
        if file in ASKING:
            place = ", while the solver's file had not come back from a call"
        said = [line for line in (before if fatal else printed).splitlines() if line.strip()]
        return place + (f'; it had printed "{said[-1].strip()[:200]}"' if said else "")

    def forget_trail(self) -> None:
        """Begin a new trail."""
        os.ftruncate(self.trail, 0)
        os.lseek(self.trail, 0, os.SEEK_SET)

    def left(self) -> bytes:
        """The trail of the task."""
        return os.pread(self.trail, os.fstat(self.trail).st_size, 0)

    def close(self) -> None:
        """Kill the process."""
        self.stopped = True
        self.process.kill()
        self.process.wait()

    def __del__(self) -> None:
        self.close_channels()

    def close_channels(self) -> None:
        """Close the channels besides the connection."""
        for line in (self.output, self.trail):
            os.close(line)


def start(theirs: Connection, trail: int, printing: int, memory: int) -> subprocess.Popen[bytes]:
    """Start a new interpreter at the other end of a worker's channels."""
    # The same sys.path as here, so that it finds the modules of a task, but none that are only in
    # the folder in which this command was started.
    return subprocess.Popen(
        [*python(WORK), *map(str, (theirs.fileno(), trail, memory))],
        stdin=subprocess.DEVNULL,
        stdout=printing,
        stderr=printing,
        pass_fds=(theirs.fileno(), trail),
        env=os.environ | {"PYTHONPATH": path_of_this()},
    )
