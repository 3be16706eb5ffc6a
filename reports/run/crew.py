"""The workers of this process: each is started for its first task and replaced if it dies."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from adapters import system
from reports.run.portable_worker import PortableWorker
from reports.run.worker import Worker
from reports.run.worker_process import Failure

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
