"""Functions that differ between operating systems: limits and end of a process, locks, timers.

On Linux the kernel implements them; on macOS and Windows a thread of the process does. `KERNEL`
says which. CROSSCHECK_SYSTEM=portable selects the second way on Linux, too, for tests.
"""

from __future__ import annotations

import ctypes
import os
import queue
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from time import process_time, sleep
from typing import IO

KERNEL = sys.platform == "linux" and os.environ.get("CROSSCHECK_SYSTEM") != "portable"
LIMITED_BY = "the kernel" if KERNEL else "a thread that watches the process"
KILLED, ABORTED, TRAPPED, TERMINATED = (
    -getattr(signal, name, 0) or None for name in ("SIGKILL", "SIGABRT", "SIGTRAP", "SIGTERM")
)
"""The exit statuses of processes that these signals ended; None where there is no such signal."""
OUT_OF_MEMORY = 77  # the exit status of a process ended by its own thread
PIECE = 1 << 20  # bytes
BINARY: int = getattr(os, "O_BINARY", 0)  # without it Windows writes \r\n for \n
LOOK = 0.1  # s between two checks of a watching thread
PR_SET_PDEATHSIG = 1  # linux/prctl.h
# the byte that Windows locks: beyond the end of the file, so that others may read
LOCKED = 2**40

if KERNEL:
    import resource


def limit_memory(most: int) -> None:
    """Limit this process to `most` bytes of data.

    The kernel refuses more (RLIMIT_DATA; Linux counts private mappings), so that Python raises
    `MemoryError`. On other systems the process ends with `OUT_OF_MEMORY` when more is resident.
    """
    if KERNEL:
        _, allowed = resource.getrlimit(resource.RLIMIT_DATA)  # only root may raise it
        most = most if allowed == resource.RLIM_INFINITY else min(most, allowed)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    else:
        import psutil

        before = psutil.Process().memory_info().rss

        def too_much() -> bool:
            return bool(psutil.Process().memory_info().rss > before + most)

        watch(too_much, OUT_OF_MEMORY)


def holds_more(pid: int, most: int) -> bool:
    """Whether a process holds more than `most` bytes. Never on Linux: there the kernel refuses it.

    For its parent: a thread of the process itself does not run during a call into C.
    """
    if KERNEL:
        return False
    import psutil

    try:
        return bool(psutil.Process(pid).memory_info().rss > most)
    except psutil.NoSuchProcess:
        return False


def write_no_core() -> None:
    if KERNEL:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def end_with_parent() -> None:
    """Make this process end when its parent has ended."""
    if KERNEL:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    else:
        import psutil

        parent = psutil.Process().parent()
        watch(lambda: parent is None or not parent.is_running(), 1)


def watch(is_time: Callable[[], bool], status: int) -> None:
    """Start a thread that ends this process with an exit status when `is_time()`."""

    def look() -> None:
        while not is_time():
            sleep(LOOK)
        os._exit(status)

    threading.Thread(target=look, daemon=True).start()


def end_all(pid: int) -> None:
    """End the children of a process, and theirs, then the process; does nothing if it has ended.

    On Linux the process ends with its group, and so do children whose parent has ended.
    """
    try:
        import psutil

        with suppress(psutil.NoSuchProcess):
            process = psutil.Process(pid)  # its children may have left the group
            for each in process.children(recursive=True) + [process] * (not KERNEL):
                with suppress(psutil.NoSuchProcess):
                    each.kill()
    finally:  # even without memory for psutil
        if KERNEL:
            with suppress(ProcessLookupError):
                os.killpg(pid, signal.SIGKILL)


def lock(file: int) -> None:
    """Lock an open file until it is closed or this process ends; raises `BlockingIOError`
    if another process has it."""
    if os.name == "posix":
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    else:
        import msvcrt

        here = os.lseek(file, 0, os.SEEK_CUR)
        os.lseek(file, LOCKED, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
        except OSError as error:
            raise BlockingIOError(*error.args) from error
        finally:
            os.lseek(file, here, os.SEEK_SET)


class Pieces:
    """The output of a pipe, piece by piece."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self.pipe = pipe
        self.read: queue.Queue[bytes] = queue.Queue(maxsize=1)  # so that the writer blocks, too
        if not KERNEL:
            threading.Thread(target=self.fetch, daemon=True).start()

    def next(self, seconds: float) -> bytes | None:
        """The next piece, b"" at the end; None if there is none within `seconds`."""
        if KERNEL:
            ready, _, _ = select.select([self.pipe], [], [], max(0.0, seconds))
            return os.read(self.pipe.fileno(), PIECE) if ready else None
        try:
            return self.read.get(timeout=max(0.0, seconds))
        except queue.Empty:
            return None

    def fetch(self) -> None:
        # In a thread, because Windows has no `select` for pipes: read everything.
        with suppress(OSError, ValueError):  # closed
            while piece := os.read(self.pipe.fileno(), PIECE):
                self.read.put(piece)
        self.read.put(b"")


def most_files() -> int:
    return resource.getrlimit(resource.RLIMIT_NOFILE)[0] if KERNEL else sys.maxsize


@contextmanager
def stopped_after(
    seconds: float, waiting: float, stop: Callable[[], BaseException]
) -> Iterator[None]:
    """Context in which the main thread gets the exception from `stop` after `seconds` of processor
    time, or `waiting` s of wall time.

    By signals; on other systems by a thread, which cannot stop a call into C.
    """
    if KERNEL:
        with _timers(seconds, waiting, stop):
            yield
        return
    over, main = threading.Event(), threading.get_ident()
    begun = process_time()

    def wait() -> None:
        for _ in range(int(waiting / LOOK) + 1):
            if over.wait(LOOK) or process_time() - begun > seconds:
                break
        if not over.is_set():
            kind = ctypes.py_object(TimeIsUp)
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(main), kind)

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    try:
        yield
    except TimeIsUp:
        raise stop() from None
    finally:
        over.set()


class TimeIsUp(BaseException):
    """Raised by the thread in the main thread; what catches it must raise it again."""


@contextmanager
def _timers(seconds: float, waiting: float, stop: Callable[[], BaseException]) -> Iterator[None]:
    def ring(*_: object) -> None:
        raise stop()

    timers = {
        signal.ITIMER_PROF: (signal.SIGPROF, seconds),
        signal.ITIMER_REAL: (signal.SIGALRM, waiting),  # wall time stops a call that only waits
    }
    for timer, (number, after) in timers.items():
        signal.signal(number, ring)
        signal.setitimer(timer, after)
    try:
        yield
    finally:
        for timer in timers:
            signal.setitimer(timer, 0)
