"""The workers of this process: started when a task comes, replaced when they have died."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from adapters import system
from reports.run.portable_worker import PortableWorker
from reports.run.worker import Worker
from reports.run.worker_process import Failure

ATTEMPTS = 3  # at a task whose worker was killed from outside


def new_worker(memory: int, show: bool = False) -> Worker:
    """A worker as this system can have it; see `Worker`."""
    if system.KERNEL:
        return Worker(memory, show)
    return PortableWorker(memory, show)


class Crew:
    """The workers of this process, one for each thread: started when a task comes, replaced when it
    has died."""

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
                self.mine.worker = worker = new_worker(memory)
                self.all.add(worker)
        return worker

    def let_go(self) -> None:
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
    """Carry out a task in the worker of this thread: its result, pickled, or how it failed.

    `alone`: in a process of its own, which carries out no other task. If a worker is killed from
    outside (out of memory, `kill -9`), which is no fault of the task, the task is tried again.
    """
    for _ in range(ATTEMPTS):
        if alone:
            CREW.let_go()
        worker = CREW.worker(memory)
        try:
            outcome = worker.do(task, timeout)
        except BaseException:  # an unread answer would be taken for that of the next task
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
