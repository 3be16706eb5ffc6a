"""The code of a worker process: it takes tasks from the parent one at a time and sends back their
results."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import pickle
import signal
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from crosscheck2d.adapters import system

CLOCK = b"clock "  # marks a number of s; no pickle begins with it
LONGEST = 1e6  # s, of a task that only ends with the run
# s without a task after which a process exits: workers on other machines outlive the run
IDLE = 60.0

_trail: int | None = None
_parent: Connection | None = None


class Failure(NamedTuple):
    """A task without a result.

    Attributes:
        status: "crashed", "timeout" or "error", as in `STATUSES` of run.py.
        reason: why.
        trail: the bytes that the task left.
        outside: whether the reason is outside the engine: the machine, the memory, this program.
            Another try may succeed.
    """

    status: str
    reason: str
    trail: bytes = b""
    outside: bool = False


def leave(parts: Sequence[Any]) -> None:
    """Append bytes to the trail of this task, which survives the process. Does nothing outside a
    worker."""
    if _trail is not None:
        # if the trail cannot be written, the engine is not at fault
        with contextlib.suppress(OSError):
            os.write(_trail, b"".join(parts))


def allow(seconds: float = 0.0) -> None:
    """From now on this task may take `seconds`, or its time-out if that is longer. Does nothing
    outside a worker."""
    if _parent is not None:
        _parent.send_bytes(CLOCK + str(seconds).encode())


def serve(connection: Connection, memory: int) -> None:
    """Carry out tasks until there are no more; an exception of a task becomes a `Failure`."""
    while connection.poll(IDLE):
        try:
            packed = connection.recv_bytes()
        except EOFError:
            return
        try:
            task = pickle.loads(packed)
        except Exception as error:
            why = f"the worker cannot read its task: {type(error).__name__}: {error}"
            connection.send_bytes(pickle.dumps(Failure("error", why, outside=True)))
            continue
        try:
            allow()
            answer = pickle.dumps(task())
        except MemoryError as error:
            error.__traceback__ = None  # releases the frames, and so the objects they hold
            connection.send_bytes(pickle.dumps(out_of_memory(memory)))
            return  # whatever is not released ends with the process
        except Exception as error:  # an engine may raise anything
            # of `NotStarted`; an import of it here would take long
            outside = bool(getattr(error, "outside", False))
            answer = pickle.dumps(
                Failure("error", f"{type(error).__name__}: {error}", outside=outside)
            )
        connection.send_bytes(answer)


def out_of_memory(memory: int) -> Failure:
    """The failure of a task that took more than `memory` bytes, or with 0 more than the machine
    has."""
    limit = f"more than {memory / 1e6:.0f} MB (--memory)" if memory else "more than there is"
    return Failure("error", f"MemoryError: took {limit}", outside=True)


def prepare(memory: int) -> None:
    """Prepare a process before it runs an engine.

    A crash prints the place in Python and writes no core. Ctrl-C is handled by the parent only.
    More than `memory` bytes of data cannot be allocated. The process dies with its parent.
    """
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    system.write_no_core()
    if memory:
        system.limit_memory(memory)
    system.end_with_parent()


def main(arguments: Sequence[Any]) -> None:
    """The main function of the process; its arguments are CONNECTION TRAIL MEMORY: two file
    descriptors and a number of bytes."""
    connection, trail, memory = (int(argument) for argument in arguments)
    work(Connection(connection), trail, memory)


def work(connection: Connection, trail: int, memory: int) -> None:
    """Carry out the tasks that arrive by a connection; `trail`: the descriptor of the trail's
    file."""
    global _trail, _parent
    _trail, _parent = trail, connection
    prepare(memory)
    serve(connection, memory)
