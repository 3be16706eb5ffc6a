"""How the solvers are compiled: by numba, and kept on disk; with NUMBA_DISABLE_JIT=1 the same
source runs as Python.

The cache of a file does not see that a file it imports has changed: after editing a kernel, remove
`__pycache__`.
"""

from numba import njit

compiled = njit(cache=True, error_model="numpy")

# What makes arrays or lists is compiled; pasted where it is called, if it is handed many arrays.
pasted = njit(cache=True, error_model="numpy", forceinline=True)

# A kernel makes no array and no list, so nothing needs counting: numba would count every use of an
# array it is handed, which took half of the time of a step of 100 disks, and the only option is one
# it calls private. It is pasted where it is called, because handing over all the arrays takes
# longer than most kernels do.
kernel = njit(cache=True, error_model="numpy", _nrt=False, forceinline=True)  # type: ignore[call-overload]

# What calls nearly all of a solver is typed and optimised with its caller alone: as a function of
# its own, everything below it would be compiled once more for each of them.
merged = njit(cache=True, error_model="numpy", inline="always")
