"""How the solvers are compiled: by numba, and kept on disk; with NUMBA_DISABLE_JIT=1 the same
source runs as Python."""

from contextlib import suppress
from pathlib import Path

from numba import njit


def forget_stale(folder: Path, *imported: Path) -> None:
    """Delete the kernels kept in a folder if a source file there, or in a folder that its kernels
    import, is newer: numba compares a kernel with its own file only."""
    sources = [source for each in (folder, *imported) for source in each.glob("*.py")]
    newest = max((source.stat().st_mtime_ns for source in sources), default=0)
    for kept in (folder / "__pycache__").glob("*.nb[ic]"):
        with suppress(OSError):  # another process deletes it, too, or the folder is read-only
            if kept.stat().st_mtime_ns < newest:
                kept.unlink()


forget_stale(Path(__file__).parent)

compiled = njit(cache=True, error_model="numpy")

# What makes arrays or lists is compiled; where it is handed many arrays, LLVM pastes it into its
# caller. Even then each call counts all of them, 0.13 us if it may append to a list: what a step
# calls for nothing most of the time is asked for by a kernel first, or stands in the caller.
inlined = njit(cache=True, error_model="numpy", forceinline=True)

# A kernel makes no array and no list, so nothing needs counting: numba would count every use of an
# array it is handed, which took half of the time of a step of 100 disks, and the only switch is one
# it calls private. It is inlined, because handing over all the arrays takes longer than most
# kernels do.
kernel = njit(cache=True, error_model="numpy", _nrt=False, forceinline=True)  # type: ignore[call-overload]

# What only compiled code calls, and makes no array and no list: without its entries for C and for
# Python a solver of many such functions is compiled in two thirds of the time.
internal = njit(  # type: ignore[call-overload]
    cache=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True, no_cpython_wrapper=True
)

# What calls nearly all of a solver is pasted by numba, and compiled with its caller alone: as a
# function of its own, everything below it would be compiled once more for each such function.
pasted = njit(cache=True, error_model="numpy", inline="always")
