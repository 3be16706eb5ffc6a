"""On the path of a process: `STALL=MODULE:NAME` makes that function one that never returns,
wherever it is called.

A test cannot reach into the workers of a command otherwise. The function blocks as compiled code
does that runs for ever: in C, holding Python's lock, so that no handler of a signal runs, though
without work for the processor; `STALL=MODULE:NAME:waits` lets go of the lock. Python imports this
file by its name.
"""

import ctypes
import os
import sys
import time
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder
from pathlib import Path

MODULE, NAME, WAITS, *_ = [*os.environ.get("STALL", "").split(":"), "", ""]


def stall(*_, **__):
    """Leave a mark that it was reached, and never return."""
    Path(os.environ["STALL_MARK"]).touch()
    while WAITS:
        time.sleep(1000)
    taken = ctypes.create_string_buffer(64)  # noughts: a lock of the C library that nobody has
    take = ctypes.PyDLL(None).pthread_mutex_lock  # which no signal interrupts
    while True:
        take(taken)


class Finder(MetaPathFinder):
    """Finds `MODULE`, and puts `stall` in the place of `NAME` when it has been loaded."""

    def find_spec(self, name, path, target=None):  # noqa: ARG002
        if name != MODULE:
            return None
        sys.meta_path.remove(self)
        spec = PathFinder.find_spec(name, path)
        load = spec.loader.exec_module

        def load_and_stall(module):
            load(module)
            *owners, last = NAME.split(".")
            for owner in owners:
                module = getattr(module, owner)
            setattr(module, last, stall)

        spec.loader.exec_module = load_and_stall
        return spec


if MODULE:
    sys.meta_path.insert(0, Finder())
