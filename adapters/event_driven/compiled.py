"""How the event engine's kernels are compiled: by numba, cached on disk; plain Python with
NUMBA_DISABLE_JIT=1."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

from reference_impl.compiled import forget_stale

forget_stale(Path(__file__).parent)

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

# Kernels make no arrays, so nothing needs counting; numba would count every use of those they are
# handed, which takes three quarters of the time (0.65 against 2.5 million collisions a second), and
# the only option is one it calls private. Entries for callers in C, and for Python where only
# kernels call, are a seventh of the time it takes to compile all.
OPTIONS: dict[str, Any] = {
    "cache": True,
    "error_model": "numpy",
    "_nrt": False,
    "no_cfunc_wrapper": True,
}


def kernel(function: Kernel) -> Kernel:
    """The compiled function."""
    return njit(**OPTIONS)(function)


def inlined(function: Kernel) -> Kernel:
    """The compiled function, pasted by LLVM where it is called: handing over arguments takes as
    long as its work."""
    return njit(**OPTIONS | {"forceinline": True, "no_cpython_wrapper": True})(function)


def pasted(function: Kernel) -> Kernel:
    """The function, pasted by numba where it is called once, so that it is not also compiled for
    itself."""
    return njit(**OPTIONS, inline="always")(function)
