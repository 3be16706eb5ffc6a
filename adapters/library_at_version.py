"""Other versions of the libraries: NAME@VERSION is fetched once into the user's cache, by uv or pip
from the package index, by npm from its registry, with a hash of all its files."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from crosscheck2d.adapters.npm_packages import (
    FETCHING,
    NotInstalled,
    npm_run,
    pinned,
    placing,
    reason_in,
)

FORM = re.compile(r"\d[\w.+-]*", re.ASCII)  # no option, no path, no tag that moves
RECORD = "sha256"  # the file with the hash of all others


class LibraryAtVersion(NamedTuple):
    """A version of a package of npm, or of one that has wheels."""

    package: str
    version: str
    npm: bool

    @property
    def folder(self) -> Path:
        # it imports numpy, which the process of an Exercise.js does not need
        from crosscheck2d.scenarios.truth.cache import folder

        kept = folder()
        if kept is None:
            raise NotInstalled("not installed: no folder for it; set CROSSCHECK_CACHE to one")
        place = "npm" if self.npm else str(sys.implementation.cache_tag)
        return kept / "versions" / place / f"{self.package.replace('/', '-')}-{self.version}"

    @property
    def recorded(self) -> str:
        try:
            return (self.folder / RECORD).read_text(encoding="utf-8")
        except (OSError, NotInstalled):
            return ""

    @property
    def versions(self) -> dict[str, str]:
        return {self.package: self.version, f"{self.package}, SHA-256 of its files": self.recorded}

    def checked(self) -> Path:
        """Its folder; raises `NotInstalled` if it is not there, or has changed since."""
        folder, recorded = self.folder, self.recorded
        if not recorded:
            raise NotInstalled("not installed: crosscheck run --engine NAME@VERSION fetches it")
        if digest_of(folder) != recorded:
            raise NotInstalled(f"{folder} has changed since it was fetched; delete this folder")
        return folder

    def text(self) -> str:
        """The text of the file of an npm package that is played: the one that is pinned of the
        usual version, else its main file. Raises `NotInstalled`."""
        folder = self.checked()
        file = folder / str(pinned()["played"][self.package]["file"])
        if not file.is_file():
            file = folder / str(
                json.loads((folder / "package.json").read_text(encoding="utf-8"))["main"]
            )
        return file.read_text(encoding="utf-8")

    def fetch(self) -> None:
        """Fetch it, whole or not at all; raises `NotInstalled` with a sentence."""
        with placing(self.folder, self.not_fetched) as files:
            (self.unpack_npm if self.npm else self.install_wheel)(files)
            (files / RECORD).write_text(digest_of(files), encoding="utf-8")

    def install_wheel(self, files: Path) -> None:
        # The wheel alone: what it needs is that of this environment.
        wanted = f"{self.package}=={self.version}"
        only = ["--no-deps", "--only-binary", ":all:", "--target", str(files), wanted]
        if uv := shutil.which("uv"):
            command = [uv, "pip", "install", "--quiet", "--python", sys.executable, *only]
        elif find_spec("pip"):
            command = [sys.executable, "-m", "pip", "install", "--quiet", "--retries", "1", *only]
        else:
            raise self.not_fetched("neither uv nor pip is installed")
        done = subprocess.run(
            command,
            cwd=files.parent,  # where no project's settings apply
            env=os.environ | {"UV_HTTP_RETRIES": "1"},
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=FETCHING,
        )
        if done.returncode:
            raise self.not_fetched(reason_in(done.stderr))

    def unpack_npm(self, files: Path) -> None:
        # The package alone: what an old one names as needed may be at an address that is gone.
        # a cache of its own: without a network npm says of an old one that there is no such version
        command = ["pack", "--cache=cache", f"{self.package}@{self.version}"]
        done = npm_run(command, files.parent)
        if done.returncode:
            raise self.not_fetched(reason_in(done.stderr))
        (archive,) = files.parent.glob("*.tgz")
        shutil.unpack_archive(archive, files.parent / "archive", "gztar", filter="data")
        (package,) = (files.parent / "archive").iterdir()
        files.rmdir()
        os.replace(package, files)

    def not_fetched(self, reason: str) -> NotInstalled:
        return NotInstalled(
            f"{self.package} {self.version} could not be fetched from the"
            f" {'npm registry' if self.npm else 'package index'} ({reason})"
        )


@cache
def digest_of(folder: Path) -> str:
    """16 hex digits of a hash over all files of a package, without what Python has compiled and
    what the tool says of itself; read once in a process."""
    of_all = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        place = path.relative_to(folder)
        own = place.parts[0] in (RECORD, ".lock") or place.parts[0].endswith(".dist-info")
        if not own and "__pycache__" not in place.parts:
            of_one = hashlib.sha256(path.read_bytes()).hexdigest()
            of_all.update(f"{place.as_posix()} {of_one}\n".encode())
    return of_all.hexdigest()[:16]
