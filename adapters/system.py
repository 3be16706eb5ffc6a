"""What operating systems do differently: limits of a process, its end, a lock, timers.

On Linux the kernel does it; on macOS and Windows a thread of the limited process does. `KERNEL`
says which of the two it is. With CROSSCHECK_SYSTEM=portable the second way is taken on Linux, too,
so that the tests can play it.
"""

from __future__ import annotations

import _thread
import ctypes
import os
import queue
import select
import signal
import sys
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from time import process_time, sleep
from typing import IO, Any

KERNEL = sys.platform == "linux" and os.environ.get("CROSSCHECK_SYSTEM") != "portable"
ALARMS = hasattr(signal, "setitimer")  # not on Windows
LIMITED_BY = "the kernel" if KERNEL else "a thread that watches the process"
KILLED, ABORTED, TRAPPED, TERMINATED = (
    -getattr(signal, name, 0) or None for name in ("SIGKILL", "SIGABRT", "SIGTRAP", "SIGTERM")
)
"""The exit statuses of processes that these signals ended; None where there is no such signal."""
OUT_OF_MEMORY = 77  # the exit status of a process that its thread ended
PIECE = 1 << 20  # bytes
BINARY: int = getattr(os, "O_BINARY", 0)  # without it Windows writes \r\n for \n
LOOK = 0.1  # s between two looks of a thread that watches
PR_SET_PDEATHSIG = 1  # linux/prctl.h
# comes again until a command has ended; on Windows, which has no alarm, as Ctrl-C does
REPEATED = signal.SIGALRM if ALARMS else signal.SIGINT
# where in a file Windows locks a byte: behind all that is written, so that others may read
LOCKED = 2**40

_repeating = threading.Event()

if KERNEL:
    import resource


def limit_memory(most: int) -> None:
    """From now on this process has at most `most` bytes of data.

    The kernel refuses more (RLIMIT_DATA; Linux counts private mappings), so that Python raises
    `MemoryError`. Else the process ends with `OUT_OF_MEMORY` once more than that is resident.
    """
    if KERNEL:
        _, allowed = resource.getrlimit(resource.RLIMIT_DATA)  # which nobody but root may raise
        most = most if allowed == resource.RLIM_INFINITY else min(most, allowed)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    else:
        import psutil

        before = psutil.Process().memory_info().rss

        def too_much() -> bool:
            return bool(psutil.Process().memory_info().rss > before + most)

        watch(too_much, OUT_OF_MEMORY)


def write_no_core() -> None:
    """A crash of this process leaves no image of its memory."""
    if KERNEL:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def end_with_parent() -> None:
    """This process ends when the one that started it has ended."""
    if KERNEL:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    else:
        import psutil

        parent = psutil.Process().parent()
        watch(lambda: parent is None or not parent.is_running(), 1)


def watch(is_time: Callable[[], bool], status: int) -> None:
    """A thread that ends this process, with an exit status, when `is_time`."""

    def look() -> None:
        while not is_time():
            sleep(LOOK)
        os._exit(status)

    threading.Thread(target=look, daemon=True).start()


def own_group() -> dict[str, Any]:
    """What `subprocess.Popen` must be told of a process that `end_all` will end."""
    return {"start_new_session": True} if KERNEL else {}


def end_all(pid: int) -> None:
    """End a process and all that it has started; nothing if it has ended."""
    if KERNEL:
        with suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
        return
    import psutil

    with suppress(psutil.NoSuchProcess):
        process = psutil.Process(pid)
        for each in (*process.children(recursive=True), process):
            with suppress(psutil.NoSuchProcess):
                each.kill()


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
    """What comes out of a pipe, piece by piece."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self.pipe = pipe
        self.read: queue.Queue[bytes] = queue.Queue(maxsize=1)  # so that the writer waits, too
        if not KERNEL:
            threading.Thread(target=self.fetch, daemon=True).start()

    def next(self, seconds: float) -> bytes | None:
        """The next piece, b"" at the end; None if there is none within so many s."""
        if KERNEL:
            ready, _, _ = select.select([self.pipe], [], [], max(0.0, seconds))
            return os.read(self.pipe.fileno(), PIECE) if ready else None
        try:
            return self.read.get(timeout=max(0.0, seconds))
        except queue.Empty:
            return None

    def fetch(self) -> None:
        """In a thread, for Windows has no `select` of pipes: read all there is."""
        with suppress(OSError, ValueError):  # closed
            while piece := os.read(self.pipe.fileno(), PIECE):
                self.read.put(piece)
        self.read.put(b"")


def most_files() -> int:
    """How many files a process may have open, as far as is known."""
    return resource.getrlimit(resource.RLIMIT_NOFILE)[0] if KERNEL else sys.maxsize


@contextmanager
def stopped_after(
    seconds: float, waiting: float, stop: Callable[[], BaseException]
) -> Iterator[None]:
    """Within it the main thread gets the exception that `stop` makes, after `seconds` of processor
    time, or `waiting` s by the clock.

    By signals; else from a thread, which a call into C is not stopped by.
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
            kind = ctypes.py_object(_TimeIsUp)
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(main), kind)

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    try:
        yield
    except _TimeIsUp:
        raise stop() from None
    finally:
        over.set()


def every(seconds: float) -> None:
    """From now on the main thread gets the signal `REPEATED` every so many s; 0: no more."""
    if ALARMS:
        signal.setitimer(signal.ITIMER_REAL, seconds, seconds)
        return
    global _repeating
    _repeating.set()
    if seconds:
        _repeating = threading.Event()
        threading.Thread(target=_repeat, args=(seconds, _repeating), daemon=True).start()


def _repeat(seconds: float, over: threading.Event) -> None:
    """The thread of `every`."""
    while not over.wait(seconds):
        _thread.interrupt_main(REPEATED)


@contextmanager
def signals_wait(numbers: Collection[signal.Signals]) -> Iterator[None]:
    """Within it none of these signals is handled in the main thread; one that came is, after it."""
    if ALARMS:
        before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield  # which no signal is handled in
        return
    handlers = {n: signal.signal(n, lambda came_in, _: came.append(came_in)) for n in numbers}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if came:
            signal.raise_signal(came[0])


class _TimeIsUp(BaseException):
    """What the thread raises in the main one."""


@contextmanager
def _timers(seconds: float, waiting: float, stop: Callable[[], BaseException]) -> Iterator[None]:
    """`stopped_after` by signals."""

    def ring(*_: object) -> None:
        raise stop()

    timers = {
        signal.ITIMER_PROF: (signal.SIGPROF, seconds),
        signal.ITIMER_REAL: (signal.SIGALRM, waiting),  # the clock stops what only waits
    }
    for timer, (number, after) in timers.items():
        signal.signal(number, ring)
        signal.setitimer(timer, after)
    try:
        yield
    finally:
        for timer in timers:
            signal.setitimer(timer, 0)
