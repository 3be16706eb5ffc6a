"""Runs tasks in worker processes, here or on other machines, so that what aborts or hangs takes nothing along."""

from __future__ import annotations

import logging
import pickle
import re
from collections.abc import Callable, Collection, Generator, Hashable, Iterator, Mapping
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

from reports.worker import ATTEMPTS, CREW, in_worker
from reports.worker_process import Failure

TIMEOUT = 60.0  # s a task may take


class NoScheduler(Exception):
    """There is no cluster where one was said to be, or it has gone."""


def run_all(
    tasks: Mapping[Hashable, Callable[[], Any]],
    workers: int,
    timeout: float = TIMEOUT,
    memory: int = 0,
    scheduler: str = "",
    alone: Collection[Hashable] = frozenset(),
) -> Generator[tuple[Any, Any | Failure], None, None]:
    """Run picklable tasks, `workers` at once; yield (key, result or `Failure`) as each ends, every key once.

    A task may take `timeout` s and `memory` bytes (0: no limit); one that is in `alone` gets a process of its own.
    With the address of a dask `scheduler` they run on its workers, as many at once as those have threads. Timings
    are never taken beside anything else: for them `workers` is 1.

    Raises:
        NoScheduler: nothing answers at `scheduler`, or not any more.
    """
    left = dict(tasks)
    with executor_of(workers, scheduler) as executor:
        for attempt in range(ATTEMPTS):
            for key, result in run_once(executor, left, timeout, memory, alone, last=attempt == ATTEMPTS - 1):
                del left[key]
                yield key, result


def run_once(
    executor: Executor,
    tasks: Mapping[Any, Callable[[], Any]],
    timeout: float,
    memory: int,
    alone: Collection[Hashable],
    last: bool,
) -> Generator[tuple[Any, Any | Failure], None, None]:
    """As `run_all`; what was lost with the machine it ran on is left out, unless this is the last attempt."""
    futures: dict[Future, Any] = {
        executor.submit(in_worker, task, timeout, memory, key in alone): key for key, task in tasks.items()
    }
    for future in as_completed(futures):
        try:
            outcome = future.result()
        except CancelledError as gone:
            raise NoScheduler("the scheduler has gone") from gone
        except Exception as error:  # not the task, whose faults are outcomes, but what carried it
            if last:
                yield futures[future], Failure("crashed", f"no machine could carry it out: {error}")
            continue
        yield futures[future], pickle.loads(outcome) if isinstance(outcome, bytes) else outcome


@contextmanager
def executor_of(workers: int, scheduler: str) -> Iterator[Executor]:
    """Threads of this machine, each with a worker process of its own, or those of a cluster; left, all are stopped."""
    if scheduler:
        with cluster(scheduler) as client, client.get_executor(pure=False) as executor:
            try:
                yield executor
            finally:
                executor.shutdown(wait=False)  # which with dask cancels what is left
        return
    CREW.dismissed = False
    executor = ThreadPoolExecutor(workers)
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        CREW.dismiss()


def cluster(scheduler: str) -> Any:
    """A client of a dask scheduler that has workers; raises `NoScheduler` naming what is missing."""
    try:
        from distributed import Client
    except ImportError as missing:
        raise NoScheduler(f"--scheduler needs {missing.name}: uv sync --extra cluster") from missing
    if not re.fullmatch(r"(tcp|tls)://.+:\d+", scheduler):
        raise NoScheduler(f"--scheduler {scheduler}: is no address; one is like tcp://192.168.0.7:8786")
    for name in logging.root.manager.loggerDict:  # what matters is raised; each of distributed's has its own level
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout="5s", set_as_default=False)
    except (OSError, ValueError) as fault:
        raise NoScheduler(f"--scheduler {scheduler}: no scheduler answers there: {fault}") from fault
    if not client.scheduler_info()["workers"]:
        client.close()
        raise NoScheduler(f"--scheduler {scheduler}: has no workers; start some: dask worker {scheduler}")
    return client
