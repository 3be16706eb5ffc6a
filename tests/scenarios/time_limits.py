"""Work that may never end: each piece within a limit of processor time, in a process of its own."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterable
from multiprocessing.connection import Connection
from typing import TypeVar

Item = TypeVar("Item")
Made = TypeVar("Made")


def each_within(
    limit: float, work: Callable[[Item], Made], items: Iterable[Item]
) -> list[Made | None]:
    """work(item) of all items; None where it took more than `limit` s of processor time, or its
    process died.

    The kernel's timer ends a compiled loop, too, which no Python handler would. What is compiled
    already need not be so again: a child is a copy of this process.
    """
    left, made = list(items), list[Made | None]()
    fork = multiprocessing.get_context("fork")
    while left:
        ours, theirs = fork.Pipe(duplex=False)
        child = fork.Process(target=send_each, args=(theirs, limit, work, left))
        child.start()
        theirs.close()
        before = len(made)
        while (one := received(ours)) is not None:
            made.append(one[0])
        child.join()
        done = len(made) - before
        made += [None] * (done < len(left))
        left = left[done + 1 :]
    return made


def send_each(
    to: Connection, limit: float, work: Callable[[Item], Made], items: list[Item]
) -> None:
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    for item in items:
        signal.setitimer(signal.ITIMER_PROF, limit)
        to.send((work(item),))


def received(source: Connection) -> tuple | None:
    try:
        return source.recv()
    except EOFError:
        return None
