"""Processes that are forked from one in which everything is imported: a start takes 0.05 s of work,
not some three; and what one process of the tests compiles, the others wait for and load: without it
they compile the same kernels side by side, a sixth of the work of the fast suite.

For tests in which it makes no difference how a process has started.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any
from unittest import mock

from filelock import FileLock
from numba.core.dispatcher import Dispatcher

from crosscheck2d.reports.run import pool

ROOT = Path(__file__).parent.parent
LOADED = [
    "tests.loaded",
    "crosscheck2d.reports.cli",
    "crosscheck2d.reports.run.arguments",
    "crosscheck2d.reports.commands.truth",
    "crosscheck2d.reports.commands.diff",
    "crosscheck2d.reports.check.command",
    "crosscheck2d.reports.speed.command",
    "crosscheck2d.reports.stability.command",
    "crosscheck2d.reports.lessons.command",
    "crosscheck2d.reports.tune.command",
]
LOCKS = "CROSSCHECK_COMPILE_LOCKS"  # variable that says where the locks are to who is forked, too
# multiprocessing polls all of its processes whenever it starts one; what one thread has read,
# another waits for.
LOCK = threading.Lock()


def context() -> multiprocessing.context.ForkServerContext:
    """Where processes are forked from: one that has imported everything, and has no thread."""
    forks = multiprocessing.get_context("forkserver")
    forks.set_forkserver_preload(LOADED)
    return forks


def start(target: Callable[..., object], *args: object) -> BaseProcess:
    """A process in which `target` is called, which `pickle` must be able to name."""
    process = context().Process(target=target, args=args)
    with LOCK:
        start_server()
        process.start()
    return process


@cache
def start_server() -> None:
    """It starts with its first process, wherever that is; it imports from here, and is waited
    for."""
    with mock.patch.dict(os.environ, {"PYTHONPATH": str(ROOT)}):
        first = context().Process(target=os.getpid)
        first.start()
    first.join()


def crosscheck_in(
    words: Sequence[str], cwd: Path, folder: Path, environment: Mapping[str, str]
) -> None:
    """In a fork: the command in `cwd`, which leads a group of its own and prints into files in
    `folder`."""
    from crosscheck2d.reports.__main__ import main

    os.setsid()
    for number, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT, 0o644), number)
    os.chdir(cwd)
    os.environ |= environment
    sys.argv = ["crosscheck", *words]
    sys.exit(main())


def start_worker(connection: Connection, folder: str, memory: int) -> BaseProcess:
    line = Connection(os.dup(connection.fileno()))
    return start(serve, line, folder, memory, dict(os.environ))


def serve(connection: Connection, folder: str, memory: int, environment: Mapping[str, str]) -> None:
    os.environ.clear()
    os.environ |= environment
    pool.serve(connection, folder, memory, False)


def compiling_alone(locks: Path) -> Callable[[Dispatcher, Any], Any]:
    """What takes the place of `Dispatcher.compile`, so that no other process with the same folder
    of locks compiles a function meanwhile."""
    compile_here = Dispatcher.compile

    def compile_alone(self: Dispatcher, signature: Any) -> Any:
        name = f"{self.py_func.__module__}.{self.py_func.__qualname__}"
        with FileLock(locks / f"{name}.lock", is_singleton=True):
            return compile_here(self, signature)

    return compile_alone
