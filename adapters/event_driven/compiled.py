"""How the event engine's kernels are compiled: by numba, cached on disk; plain Python with
NUMBA_DISABLE_JIT=1."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

from crosscheck2d.reference_impl.compiled import forget_stale

forget_stale(Path(__file__).parent)

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

# Kernels allocate no arrays, so that references need no counting. Numba would count every use of an
# array argument, which takes three quarters of the time (0.65 against 2.5 million collisions a
# second); the only option against it, `_nrt`, is one it calls private. Wrappers for callers in C,
# and in Python for functions that only kernels call, would take a seventh of the time of compiling.
OPTIONS: dict[str, Any] = {
    "cache": True,
    "error_model": "numpy",
    "_nrt": False,
    "no_cfunc_wrapper": True,
}


def kernel(function: Kernel) -> Kernel:
    return njit(**OPTIONS)(function)


def inlined(function: Kernel) -> Kernel:
    """The compiled function, inlined by LLVM: passing its arguments takes as long as its work."""
    return njit(**OPTIONS | {"forceinline": True, "no_cpython_wrapper": True})(function)


def inlined_early(function: Kernel) -> Kernel:
    """The function, inlined by numba itself where it is called once, so that it is not also
    compiled on its own."""
    return njit(**OPTIONS, inline="always")(function)
