"""Runs tasks in worker processes that may abort or hang without taking the others along."""

from __future__ import annotations

import signal
from collections.abc import Callable, Hashable, Iterator, Mapping
from concurrent.futures import Future, TimeoutError, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any, NamedTuple

from pebble import ProcessExpired, ProcessPool

TIMEOUT = 60.0  # s a task may take
RESTARTS = 5  # of the whole pool, which breaks if a worker is killed while it takes or returns a task


class Failure(NamedTuple):
    """A task without a result: "crashed", "timeout" or "error" as in `STATUSES` of play.py, and why."""

    status: str
    reason: str


def run_all(
    tasks: Mapping[Hashable, Callable[[], Any]], workers: int, timeout: float = TIMEOUT
) -> Iterator[tuple[Any, Any | Failure]]:
    """Run picklable tasks, `workers` at once; yield (key, result or `Failure`) as each ends.

    One that takes longer than `timeout` s is stopped, in C code too; a worker that dies is replaced.
    """
    left = dict(tasks)
    for _ in range(RESTARTS):
        for key, result in run_in_pool(left, workers, timeout):
            del left[key]
            yield key, result
        if not left:
            return
    yield from ((key, Failure("crashed", f"the workers died {RESTARTS} times")) for key in left)


def run_in_pool(
    tasks: Mapping[Any, Callable[[], Any]], workers: int, timeout: float
) -> Iterator[tuple[Any, Any | Failure]]:
    """As `run_all`, until all is done or the pool itself breaks: then the rest is left out."""
    # Spawned, not forked: an engine's threads and global settings must not come along from the parent.
    pool = ProcessPool(max_workers=workers, initializer=leave_interrupts_to_parent, context=get_context("spawn"))
    try:
        futures: dict[Future, Any] = {pool.schedule(task, timeout=timeout): key for key, task in tasks.items()}
        for future in as_completed(futures):
            if isinstance(future.exception(), BrokenProcessPool):
                return
            yield futures[future], result_of(future, timeout)
        pool.close()
    finally:
        pool.stop()
        pool.join()


def result_of(future: Future, timeout: float) -> Any | Failure:
    """What a task that has ended gave; raises `OSError` if it could not write, which is not the engine's fault."""
    try:
        return future.result()
    except TimeoutError:
        return Failure("timeout", f"stopped after {timeout:g} s")
    except ProcessExpired as death:
        return Failure("crashed", f"worker died: {name_of_exit(death.exitcode)}")
    except OSError:
        raise
    except Exception as error:
        return Failure("error", f"{type(error).__name__}: {error}")


def leave_interrupts_to_parent() -> None:
    """Ctrl-C goes to the whole group of processes; the parent alone decides what it means."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def name_of_exit(code: int) -> str:
    """The signal behind a negative exit code, or the code."""
    return signal.Signals(-code).name if code < 0 else f"exit status {code}"
