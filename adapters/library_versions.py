"""The version of an installed library, read from the disk once: every run asks for it."""

from __future__ import annotations

from functools import cache
from importlib import metadata


@cache
def version(library: str) -> str:
    """Of a distribution by its name; raises `PackageNotFoundError` if it is not installed."""
    return metadata.version(library)
