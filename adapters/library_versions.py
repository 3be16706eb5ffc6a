"""The version of an installed library, read from the disk once because every run needs it."""

from __future__ import annotations

import sys
from functools import cache
from importlib import metadata

# The distribution of Box2D 2.3: the same C++ and the same bits, from source or as a wheel; see
# pyproject.toml.
BOX2D = "box2d-py" if sys.platform == "linux" else "box2d"


@cache
def version(library: str) -> str:
    """The version of a distribution; raises `PackageNotFoundError` if it is not installed."""
    return metadata.version(library)
