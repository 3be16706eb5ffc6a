"""What one process of the tests compiles, the others wait for and load: without it they compile the
same kernels side by side, a sixth of the work of the fast suite."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from filelock import FileLock
from numba.core.dispatcher import Dispatcher

LOCKS = "CROSSCHECK_COMPILE_LOCKS"  # variable that says where the locks are to who is forked, too


def compiling_alone(locks: Path) -> Callable[[Dispatcher, Any], Any]:
    """What takes the place of `Dispatcher.compile`, so that no other process with the same folder
    of locks compiles a function meanwhile."""
    compile_here = Dispatcher.compile

    def compile_alone(self: Dispatcher, signature: Any) -> Any:
        name = f"{self.py_func.__module__}.{self.py_func.__qualname__}"
        with FileLock(locks / f"{name}.lock", is_singleton=True):
            return compile_here(self, signature)

    return compile_alone
