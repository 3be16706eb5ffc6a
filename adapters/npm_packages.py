"""The npm packages of the JavaScript engines, and the gl-matrix of solvers' files: package.json of
host/ pins the version of each, and the SHA-512 of its one file that is played. No other is read."""

from __future__ import annotations

import hashlib
import json
import shutil
from base64 import b64encode
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from crosscheck2d.adapters.library_at_version import (
    ABSENT,
    HOW,
    LibraryAtVersion,
    NotInstalled,
    script_of,
)

PINNED = Path(__file__).parent / "host" / "package.json"


@cache
def pinned() -> dict[str, Any]:
    read: dict[str, Any] = json.loads(PINNED.read_text(encoding="utf-8"))
    return read


def version_of(package: str) -> str:
    return str(pinned()["dependencies"][package])


def pinned_library(package: str) -> LibraryAtVersion:
    return LibraryAtVersion(package, version_of(package), npm=True)


def pinned_file(package: str) -> str:
    """The file that is played, in the folder of the package."""
    return str(pinned()["played"][package]["file"])


def text_of(package: str) -> str:
    """The text of that file; raises `NotInstalled` if it is not there, or its hash differs."""
    file = pinned_library(package).folder / pinned_file(package)
    try:
        text = script_of(file)
    except OSError:
        raise NotInstalled(ABSENT) from None
    if integrity(text) != pinned()["played"][package]["integrity"]:
        raise NotInstalled(f"{file} differs from what is pinned (SHA-512); fetch it again: {HOW}")
    return text


def integrity(text: str) -> str:
    """A hash in the format of npm."""
    return "sha512-" + b64encode(hashlib.sha512(text.encode()).digest()).decode()


def missing(package: str) -> str:
    """Why a package cannot be played, in a sentence; "" if it can."""
    try:
        text_of(package)
    except NotInstalled as reason:
        return str(reason)
    return ""


@cache  # so that without a network the wait happens once
def file_of(package: str) -> Path | None:
    """The file of a package, fetched if it is missing and the extra is installed; None if it is not
    available."""
    with suppress(NotInstalled):
        if missing(package):
            fetch()
        text_of(package)
        return pinned_library(package).folder / pinned_file(package)
    return None


def fetch() -> None:
    """Fetch the packages that are missing, once; raises `NotInstalled` with a sentence."""
    for package in filter(missing, pinned()["played"]):
        library = pinned_library(package)
        try:
            library.fetch()
        except NotInstalled as fault:
            once = "it has to be fetched from the npm registry once, and that failed"
            raise NotInstalled(
                f"not installed: {once} ({fault.reason})" if fault.reason else str(fault)
            ) from None
        if missing(package):
            name = pinned_file(package)
            file = library.folder / name
            actual = f"has {integrity(script_of(file))}" if file.is_file() else "is not there"
            shutil.rmtree(library.folder)
            wrong = f"what npm fetched of {package} is not what is pinned: {name} {actual}"
            raise NotInstalled(f"not installed: {wrong}")
