"""How the event engine's kernels are compiled: by numba, cached on disk; plain Python with NUMBA_DISABLE_JIT=1.

The cache of a file does not see that a file it imports has changed: after editing a kernel, remove `__pycache__`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

# Kernels make no arrays, so nothing needs counting; counting every use of the arrays they are handed takes three
# quarters of the time (0.27 against 0.97 million hits a second).
OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}


def kernel(function: Kernel) -> Kernel:
    """The compiled function."""
    return njit(**OPTIONS)(function)


def inlined(function: Kernel) -> Kernel:
    """The compiled function, pasted where it is called: handing it fifty arguments takes as long as its work."""
    return njit(**OPTIONS, inline="always")(function)
