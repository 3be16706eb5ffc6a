"""What runs in a worker process: it takes tasks from the parent one at a time and sends back what
they give."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import pickle
import signal
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from adapters import system

CLOCK = b"clock "  # before a number of s; no pickle begins so
LONGEST = 1e6  # s, for what is stopped only with the run
# s without a task after which a process leaves: workers on other machines outlive the run
IDLE = 60.0

_trail: int | None = None
_parent: Connection | None = None


class Failure(NamedTuple):
    """A task without a result.

    Attributes:
        status: "crashed", "timeout" or "error", as in `STATUSES` of run.py.
        reason: why.
        trail: what it left.
        outside: whether it failed for a reason outside what it plays: the machine, the memory, this
            program. Another time it may not.
    """

    status: str
    reason: str
    trail: bytes = b""
    outside: bool = False


def leave(parts: Sequence[Any]) -> None:
    """Append bytes to the trail of this task, which survives the process; nothing outside a
    worker."""
    if _trail is not None:
        # a trail that cannot be kept is no fault of the engine that is played
        with contextlib.suppress(OSError):
            os.write(_trail, b"".join(parts))


def allow(seconds: float = 0.0) -> None:
    """From now on this task may take `seconds`, or its time-out if that is longer; nothing outside
    a worker."""
    if _parent is not None:
        _parent.send_bytes(CLOCK + str(seconds).encode())


def serve(connection: Connection, memory: int) -> None:
    """Carry out tasks until there are none left; whatever a task raises is a `Failure`."""
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
            error.__traceback__ = None  # lets go of the frames, and so of what they hold
            connection.send_bytes(pickle.dumps(out_of_memory(memory)))
            return  # what is not let go of ends with the process
        except Exception as error:  # an engine may raise anything
            # of `NotStarted`; an import of it here would take long
            outside = bool(getattr(error, "outside", False))
            answer = pickle.dumps(
                Failure("error", f"{type(error).__name__}: {error}", outside=outside)
            )
        connection.send_bytes(answer)


def out_of_memory(memory: int) -> Failure:
    """What comes of a task that took more than `memory` bytes, 0: than there is."""
    limit = f"more than {memory / 1e6:.0f} MB (--memory)" if memory else "more than there is"
    return Failure("error", f"MemoryError: took {limit}", outside=True)


def prepare(memory: int) -> None:
    """What a process must be before an engine is let in.

    A crash prints where Python was and writes no core; Ctrl-C is left to the parent, who alone
    decides what it means; data beyond `memory` bytes cannot be had; it dies with its parent.
    """
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    system.write_no_core()
    if memory:
        system.limit_memory(memory)
    system.end_with_parent()


def main(arguments: Sequence[Any]) -> None:
    """What the process does; its words are CONNECTION TRAIL MEMORY: two file descriptors and a
    number of bytes."""
    connection, trail, memory = (int(argument) for argument in arguments)
    work(Connection(connection), trail, memory)


def work(connection: Connection, trail: int, memory: int) -> None:
    """Carry out the tasks that come by a connection; `trail`: the descriptor of its file."""
    global _trail, _parent
    _trail, _parent = trail, connection
    prepare(memory)
    serve(connection, memory)
