"""The version of an installed library, read from the disk once because every run needs it; and how
more is installed."""

from __future__ import annotations

import sys
from functools import cache
from importlib import metadata
from pathlib import Path

CLONE = Path(__file__).parents[1].joinpath("pyproject.toml").exists()


@cache
def version(library: str) -> str:
    """The version of a distribution; raises `PackageNotFoundError` if it is not installed."""
    return metadata.version(library)


def _box2d() -> str:
    # The distribution that Box2D 2.3 comes from: both have the same code and give the same bits;
    # see pyproject.toml.
    try:
        version("box2d-py")  # built from source
    except metadata.PackageNotFoundError:
        return "box2d"  # a wheel
    return "box2d-py"


BOX2D = _box2d()


def how_to_add(extra: str) -> str:
    if not CLONE:
        return f'pip install "crosscheck2d[{extra}]"'
    environment = Path(sys.prefix, "pyvenv.cfg")
    if environment.exists() and "\nuv = " in environment.read_text(encoding="utf-8"):
        return f"uv run --extra {extra} crosscheck ..."
    return f'pip install -e ".[{extra}]"'
