"""Runs tasks in worker processes, here or on other machines, so that a task that aborts or hangs
harms no other."""

from __future__ import annotations

import logging
import math
import pickle
import re
import threading
from collections import Counter, deque
from collections.abc import Callable, Collection, Generator, Hashable, Iterator, Mapping
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Any

import psutil

from crosscheck2d.adapters import system
from crosscheck2d.adapters.library_versions import how_to_add
from crosscheck2d.adapters.system import most_files
from crosscheck2d.reports.run.portable_worker import PortableWorker
from crosscheck2d.reports.run.worker import Worker
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.reports.terminal.exits import say

ATTEMPTS = 3  # of a task whose worker is killed from outside


def new_worker(memory: int) -> Worker:
    """A worker of the kind that this operating system supports; see `Worker`."""
    if system.KERNEL:
        return Worker(memory)
    return PortableWorker(memory)


class Crew:
    """The workers of this process, one for each thread."""

    def __init__(self) -> None:
        self.mine = threading.local()
        self.all: set[Worker] = set()
        self.lock = threading.Lock()
        self.dismissed = False

    def worker(self, memory: int) -> Worker:
        """The living worker of this thread."""
        worker: Worker | None = getattr(self.mine, "worker", None)
        if worker is None or worker.memory != memory or worker.process.poll() is not None:
            self.kill_current()
            with self.lock:
                if self.dismissed:
                    raise InterruptedError("the run is over")
                self.mine.worker = worker = new_worker(memory)
                self.all.add(worker)
        return worker

    def kill_current(self) -> None:
        """Kill the worker of this thread, if there is one."""
        worker = self.mine.__dict__.pop("worker", None)
        if worker is not None:
            worker.close()
            with self.lock:
                self.all.discard(worker)

    def dismiss(self) -> None:
        """Kill all workers, and start no more."""
        with self.lock:
            self.dismissed = True
            for worker in self.all:
                worker.close()
            self.all.clear()


CREW = Crew()


def in_worker(task: Callable[[], Any], timeout: float, memory: int, alone: bool) -> bytes | Failure:
    """Carry out a task in the worker of this thread; returns the pickled result, or how it failed.

    `alone`: use a new process for this task only. If a worker is killed from
    outside (out of memory, `kill -9`), the task is tried again, because the task did not fail.
    """
    for _ in range(ATTEMPTS):
        if alone:
            CREW.kill_current()
        worker = CREW.worker(memory)
        try:
            outcome = worker.do(task, timeout)
        except BaseException:  # an unread answer would be mistaken for that of the next task
            CREW.kill_current()
            raise
        if alone or isinstance(outcome, Failure):
            CREW.kill_current()
        if outcome is not None:
            return outcome
        if worker.stopped:
            break
    why = f"its worker was killed {ATTEMPTS} times: by the system for want of memory?"
    return Failure("crashed", why, outside=True)


TIMEOUT = 60.0  # s a task may take
# tasks queued for a worker of this machine at most: few, so that urgent tasks start soon, but
# enough that none waits
AHEAD = 2

LEAST_MEMORY = 400  # MB: Python, numba and the engines take 120, compiling a kernel as much again
# open files: for each worker its channels, twice while it starts; and for everything else
LINES, OTHERS = 5, 100

Task = Callable[[], Any]


class NoScheduler(Exception):
    """The given cluster does not answer, or no longer."""


def run_all(
    tasks: Mapping[Hashable, Task],
    workers: int,
    timeout: float = TIMEOUT,
    memory: int = 0,
    scheduler: str = "",
    alone: Collection[Hashable] = frozenset(),
    urgent: deque[Any] | None = None,
) -> Generator[tuple[Any, Any | Failure], None, None]:
    """Run picklable tasks, `workers` at once; yield (key, result or `Failure`) as each ends.

    A task may take `timeout` s and `memory` bytes (0: no limit). A task in `alone` gets a process
    of its own. With the address of a dask `scheduler` the tasks run on its workers, one per thread.
    Tasks that the caller puts into `urgent` meanwhile start before the others, on this machine,
    whose files they may read. For timings `workers` is 1, so that nothing runs beside them.

    Raises:
        NoScheduler: nothing answers at `scheduler`, or no longer.
    """
    waiting, lost = deque(tasks.items()), Counter[Hashable]()
    urgent = deque() if urgent is None else urgent
    room = math.inf if scheduler else AHEAD * workers
    under_way = UnderWay(timeout, memory, alone)
    with threads(workers) as here, cluster_or(here, scheduler) as anywhere:
        while urgent or waiting or under_way:
            while urgent:
                under_way.begin(here, *urgent.popleft())
            while waiting and len(under_way) < room:
                under_way.begin(anywhere, *waiting.popleft())
            key, task, future = under_way.next_ended()
            outcome, error = outcome_of(future)
            if error is not None:
                lost[key] += 1
                if lost[key] < ATTEMPTS:
                    waiting.append((key, task))
                    continue
                why = f"no machine could carry it out: {error}"
                outcome = Failure("crashed", why, outside=True)
            yield key, outcome


class UnderWay:
    """The tasks given to executors, each with `timeout` s, `memory` bytes, and a process of its own
    if its key is in `alone`."""

    def __init__(self, timeout: float, memory: int, alone: Collection[Hashable]) -> None:
        self.timeout, self.memory, self.alone = timeout, memory, alone
        self.tasks: dict[Future[Any], tuple[Hashable, Task]] = {}
        self.ended: SimpleQueue[Future[Any]] = SimpleQueue()

    def __len__(self) -> int:
        return len(self.tasks)

    def begin(self, executor: Executor, key: Hashable, task: Task) -> None:
        """Give a task to an executor."""
        future = executor.submit(in_worker, task, self.timeout, self.memory, key in self.alone)
        self.tasks[future] = key, task
        future.add_done_callback(self.ended.put)

    def next_ended(self) -> tuple[Hashable, Task, Future[Any]]:
        """The next task that has ended, as soon as one has."""
        future = self.ended.get()
        return *self.tasks.pop(future), future


def outcome_of(future: Future[Any]) -> tuple[Any | Failure, Exception | None]:
    """The result or `Failure` of a task and None, or None and the exception of its executor.

    Raises `NoScheduler` if the cluster has gone.
    """
    try:
        outcome = future.result()
    except CancelledError as gone:
        raise NoScheduler("the scheduler has gone") from gone
    except Exception as error:
        return None, error
    return pickle.loads(outcome) if isinstance(outcome, bytes) else outcome, None


def affordable(workers: int) -> int:
    """The number of workers, at most `workers`, that can start on this machine; prints a line if it
    is fewer."""
    memory: int = psutil.virtual_memory().total // 1_000_000
    files = most_files()
    most = {
        f"memory of {memory} MB, each needs {LEAST_MEMORY}": max(1, memory // LEAST_MEMORY),
        f"limit of {files} open files, each needs {LINES}": max(1, (files - OTHERS) // LINES),
    }
    why = min(most, key=lambda what: most[what])
    if workers <= most[why]:
        return workers
    say(f"{workers} workers are more than can start here ({why}): {most[why]} are started")
    return most[why]


@contextmanager
def threads(workers: int) -> Iterator[Executor]:
    """Context with threads of this machine, each with a worker process; all are stopped at the
    end."""
    CREW.dismissed = False
    executor = ThreadPoolExecutor(workers)
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        CREW.dismiss()


@contextmanager
def cluster_or(here: Executor, scheduler: str) -> Iterator[Executor]:
    """The executor of a cluster's workers, or `here` if there is no `scheduler`."""
    if not scheduler:
        yield here
        return
    with cluster(scheduler) as client, client.get_executor(pure=False) as executor:
        try:
            yield executor
        finally:
            executor.shutdown(wait=False)  # with dask this cancels the remaining tasks


def cluster(scheduler: str) -> Any:
    """A client of a dask scheduler that has workers; raises `NoScheduler` naming what is
    missing."""
    if not re.fullmatch(r"(tcp|tls)://.+:\d+", scheduler):
        raise NoScheduler(
            f"--scheduler {scheduler}: is no address; one is like tcp://192.168.0.7:8786"
        )
    try:
        from distributed import Client
    except ImportError as missing:
        raise NoScheduler(
            f"--scheduler {scheduler}: it needs the package {missing.name}, which is not"
            f" installed: {how_to_add('cluster')}"
        ) from missing
    # important faults are raised; each logger of distributed has its own level
    for name in logging.root.manager.loggerDict:
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout="5s", set_as_default=False)
    except (OSError, ValueError) as fault:
        raise NoScheduler(
            f"--scheduler {scheduler}: no scheduler answers there: {fault}"
        ) from fault
    if not client.scheduler_info()["workers"]:
        client.close()
        raise NoScheduler(
            f"--scheduler {scheduler}: has no workers; start some: dask worker {scheduler}"
        )
    return client
