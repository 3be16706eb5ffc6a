"""The workers of a dask cluster as a place for tasks: each thread of a dask worker has a worker
process of the pool, so that a task ends there as it does here."""

from __future__ import annotations

import logging
import multiprocessing
import re
import threading
from collections.abc import Collection, Hashable
from concurrent.futures import CancelledError, Future
from math import inf
from queue import Empty, SimpleQueue
from typing import Any

from crosscheck2d.adapters.library_versions import how_to_add
from crosscheck2d.reports.run import pool
from crosscheck2d.reports.run.pool import ATTEMPTS, LOST, Failure, Pool

_here = threading.local()


class NoScheduler(Exception):
    """The given cluster does not answer, or no longer."""


class Cluster:
    """As `Pool`, with the workers of a dask scheduler; only the results come back here."""

    has_room = True

    def __init__(
        self, scheduler: str, timeout: float, memory: int, alone: Collection[Hashable]
    ) -> None:
        self.client = connect(scheduler)
        self.executor = self.client.get_executor(pure=False)
        self.limits, self.alone = (timeout, memory), alone
        self.under_way: dict[Future[Any], tuple[Any, bytes]] = {}
        self.done: SimpleQueue[Future[Any]] = SimpleQueue()

    def close(self) -> None:
        self.executor.shutdown(wait=False)  # with dask this cancels the remaining tasks
        self.client.close(timeout=1)

    @property
    def busy(self) -> bool:
        return bool(self.under_way)

    def begin(self, key: Any, packed: bytes) -> None:
        future = self.executor.submit(in_thread, packed, *self.limits, key in self.alone)
        self.under_way[future] = key, packed
        future.add_done_callback(self.done.put)

    def ended(self) -> list[tuple[Any, bytes, Any]]:
        """Key, pickled task and outcome of the tasks that have ended; raises `NoScheduler`."""
        outcomes: list[tuple[Any, bytes, Any]] = []
        while True:
            try:
                future = self.done.get_nowait()
            except Empty:
                return outcomes
            key, packed = self.under_way.pop(future)
            try:
                outcomes.append((key, packed, future.result()))
            except CancelledError as gone:
                raise NoScheduler("the scheduler has gone") from gone
            except Exception:  # the machine has gone, or cannot read the task
                outcomes.append((key, packed, LOST))


def in_thread(packed: bytes, timeout: float, memory: int, alone: bool) -> bytes | Failure:
    """On a machine of the cluster: the pickled result of a task, or how it failed."""
    multiprocessing.current_process().daemon = False  # dask's own may have no processes otherwise
    pool.CONTEXT = multiprocessing.get_context("spawn")  # dask has threads, which a fork would lose
    here: Pool | None = getattr(_here, "pool", None)
    if here is None:
        here = _here.pool = Pool(1, timeout, memory)
    here.timeout, here.memory, here.alone = timeout, memory, {0} if alone else ()
    for _ in range(ATTEMPTS):
        here.begin(0, packed)
        while not (ended := here.ended(inf)):
            pass
        [(_, _, outcome)] = ended
        if outcome is not LOST:
            return outcome if isinstance(outcome, bytes) else Failure(*outcome)
    failure: Failure = pool.result_of(LOST)
    return failure


def connect(scheduler: str) -> Any:
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
    for name in [*logging.root.manager.loggerDict]:
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
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
