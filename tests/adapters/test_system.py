"""What operating systems do differently. The branch of macOS and Windows is played on Linux."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import ModuleType, SimpleNamespace

import psutil
import pytest

from crosscheck2d.adapters import system
from crosscheck2d.adapters.host.file import SolverFailed, read_solver
from crosscheck2d.adapters.host.process import SolverProcess
from crosscheck2d.adapters.host.sandbox import RUN
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import reading
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck

PORTABLE = os.environ | {"CROSSCHECK_SYSTEM": "portable"}
ROOT = Path(__file__).parents[2]

# What Windows has not, taken away after the libraries have loaded theirs.
ELSEWHERE = """
import importlib, os, pathlib, signal, sys
import asyncio, multiprocessing.connection, multiprocessing.popen_spawn_posix, multiprocessing.spawn
import subprocess, tempfile, socket, shutil
import hypothesis, jinja2, py_mini_racer, numba, numpy, pandas, platformdirs, psutil
import matplotlib.backends.backend_svg, matplotlib.figure, pydantic
import pymunk, Box2D, pyb2d3, rich.console
import rich.progress, starlette, starlette.applications, typer, uvicorn, websockets
for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
for module, names in {
    os: "fork killpg memfd_create pread writev sysconf getuid setsid O_NONBLOCK".split(),
    signal: "SIGALRM SIGKILL SIGPROF SIGTRAP ITIMER_REAL ITIMER_PROF setitimer pthread_sigmask"
    .split(),
}.items():
    for name in names:
        delattr(module, name)
sys.platform = "PLATFORM"
for package in ("adapters", "reference_impl", "reports", "scenarios"):
    for path in sorted(pathlib.Path(package).rglob("*.py")):
        # a guest's files are imported by its driver, in a process of their own
        if not {"out", "guest"} & {*path.parts} and path.name not in ("__main__.py",):
            name = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
            importlib.import_module(f"crosscheck2d.{name}")
from crosscheck2d.adapters import system
assert not system.KERNEL
try:
    import fcntl
except ImportError as error:
    print(error)
print("all imported")
"""


# psutil's own way of ending a process on Linux needs SIGKILL; that of Windows does not
MARKED = """
import psutil
psutil.Process.kill = lambda self: os.kill(self.pid, 9)
multiprocessing.popen_spawn_posix.Popen.kill = lambda self: self._send_signal(9)
from crosscheck2d.reports.__main__ import main
sys.argv = "crosscheck check CLASS --format csv --out CLASS.csv --seed 0 --unprotected".split()
main()
"""


BALL = [0.0] * 9 + [1.0, 1.0, 1.0]
QUESTION = {"spheres": [BALL], "calls": [["integrate", 0, 0.1]], "world": False}


def choose_branch(monkeypatch: pytest.MonkeyPatch, branch: str) -> None:
    monkeypatch.setenv("CROSSCHECK_SYSTEM", branch)
    monkeypatch.setattr(system, "KERNEL", branch == "kernel")


@pytest.mark.slow
@pytest.mark.parametrize("platform", ["win32", pytest.param("darwin", marks=pytest.mark.long)])
def test_a_class_is_marked_without_what_only_linux_has(tmp_path: Path, platform: str):
    group = tmp_path / "class"
    for name in ("plain.js", "plain.py"):
        text = (ROOT / "tests" / "solvers" / "correct" / name).read_bytes()
        for student, given in {"änne b": text, "cem": text.replace(b" / ", b" * ")}.items():
            (group / f"{student} {name}").mkdir(parents=True)
            crlf = given.replace(b"\n", b"\r\n")
            (group / f"{student} {name}" / f"Exercise{name[-3:]}").write_bytes(crlf)
    words = ["check", group, "--format", "csv", "--seed", "0", "--out", tmp_path / "here.csv"]
    here = subprocess.run([CROSSCHECK, *words], capture_output=True, timeout=200)
    code = (ELSEWHERE + MARKED).replace("PLATFORM", platform).replace("CLASS", str(group))
    there = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=200
    )
    marks = [
        [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(file)]
        for path in (tmp_path / "here.csv", tmp_path / "class.csv")
        for file in [path.open(encoding="utf-8", newline="")]
    ]

    assert there.stdout.startswith("import of fcntl halted; None in sys.modules\nall imported\n")
    assert (here.returncode, there.returncode) == (1, 1), there.stderr[-2000:]
    assert len(marks[0]) == 4
    assert marks[0] == marks[1]


@pytest.mark.slow
def test_the_portable_branch_gives_the_same_bits(tmp_path: Path):
    words = ["run", "head_on_equal_e09", "--timings", "0", "--engine", "reference:exercise"]
    here = crosscheck(*words, "--out", "kernel", cwd=tmp_path)
    elsewhere = subprocess.run(
        [CROSSCHECK, *words, "--out", "portable"],
        cwd=tmp_path,
        env=PORTABLE,
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert here.returncode == 0, here.stderr
    assert elsewhere.returncode == 0, elsewhere.stderr

    tables = {name: (tmp_path / name / "deviations.csv").read_text() for name in LIMITS}
    assert tables["kernel"] == tables["portable"]
    for name, said in LIMITS.items():
        with reading(tmp_path / name, COMMAND) as store:
            assert RunResults.read(store).header["machine"]["memory limited by"] == said


LIMITS = {"kernel": "the kernel", "portable": "a thread that watches the process"}


@pytest.mark.long
def test_a_bad_engine_ends_the_same_on_the_portable_branch():
    chosen = "bad_cell and forkserver or limited_by_memory or what_a_file_does or ends_its_process"
    files = ["tests/reports/run/test_pool.py", "tests/adapters/test_own_solver.py"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-n", "0", "-q", "-m", "not long", "-k", chosen, *files],
        cwd=ROOT,
        env=PORTABLE,
        capture_output=True,
        text=True,
        timeout=300,
    )

    assert done.returncode == 0, done.stdout[-3000:]
    assert "19 passed" in done.stdout  # so that a test of another name is not lost


@pytest.mark.slow
def test_a_solver_that_takes_all_memory_in_one_call_into_c_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    file = tmp_path / "solver.py"
    file.write_text("x = bytearray(10**10)\ndef integrate(s, dt): pass\n")
    choose_branch(monkeypatch, "portable")
    with pytest.raises(SolverFailed) as failed:
        SolverProcess(read_solver(file))

    assert failed.value.kind == "memory"


@pytest.mark.slow
@pytest.mark.parametrize("system_is", ["kernel", "portable"])
def test_an_endless_function_is_stopped_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, system_is: str
):
    file = tmp_path / "solver.py"
    file.write_text(
        "def integrate(s, dt):\n    while True:\n        pass\n\n"
        "def sphereSphereCollisionHandling(a, b):\n    pass\n"
    )
    choose_branch(monkeypatch, system_is)
    with SolverProcess(read_solver(file)) as solver:
        first, again = solver.request([("ask", QUESTION, 1.0)] * 2)

    assert first.kind == "timeout"
    assert str(first) == str(again) == "does not come back within 1 s in one call"


@pytest.mark.slow
@pytest.mark.parametrize(
    "environment",
    [
        pytest.param(os.environ, id="kernel", marks=pytest.mark.long),
        pytest.param(PORTABLE, id="portable"),
    ],
)
def test_a_child_in_a_group_of_its_own_ends_with_its_solver(
    tmp_path: Path, environment: dict[str, str]
):
    assert not lives_on(tmp_path, environment, "os.setsid()", "pass")


@pytest.mark.slow
@pytest.mark.parametrize(
    "child_does", ["pass", pytest.param("os.closerange(0, 100)", marks=pytest.mark.long)]
)
def test_a_child_ends_with_its_solver_that_has_ended_itself(tmp_path: Path, child_does: str):
    assert not lives_on(tmp_path, os.environ, child_does, "os._exit(0)")


@pytest.mark.slow
def test_a_solver_that_has_ended_itself_is_said_to_have_though_its_child_keeps_the_pipe(
    tmp_path: Path,
):
    (tmp_path / "solver.py").write_text(
        "import os, time\nif os.fork() == 0:\n    time.sleep(300)\nos._exit(0)\n"
    )
    with pytest.raises(SolverFailed, match=r"ended its own process \(exit status 0\)") as failed:
        SolverProcess(read_solver(tmp_path / "solver.py"))

    assert failed.value.kind == "crashed"


def lives_on(
    folder: Path, environment: Mapping[str, str], child_does: str, parent_does: str
) -> bool:
    """Whether a child that a solver starts lives on after the check.

    It is looked for from outside: in the sandbox it can write no file, and has another number.
    """
    (folder / "solver.py").write_text(
        "import contextlib, os, time\n"
        "there, here = os.pipe()\n"
        f"if os.fork() == 0:\n    {child_does}\n"
        "    with contextlib.suppress(OSError):\n        os.write(here, b'.')\n"
        "    time.sleep(300)\n    os._exit(0)\n"
        f"os.close(here)\nos.read(there, 1)\ntime.sleep(1)\n{parent_does}\n"
    )
    seen: set[psutil.Process] = set()
    seen_child = False
    with subprocess.Popen(
        [CROSSCHECK, "check", "solver.py"],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as check:
        end = time.monotonic() + 200.0
        while check.poll() is None and time.monotonic() < end:
            with suppress(psutil.NoSuchProcess):
                seen |= {*psutil.Process(check.pid).children(recursive=True)}
                seen_child = seen_child or any(is_forked(each) for each in seen)
            time.sleep(0.02)
        check.kill()
    assert seen_child
    end = time.monotonic() + 10.0
    while (alive := any(each.is_running() for each in seen)) and time.monotonic() < end:
        time.sleep(0.05)  # until init has read their status
    return alive


def is_forked(process: psutil.Process) -> bool:
    """Whether it is the child of a guest: a second Python with the same command line."""
    with suppress(psutil.NoSuchProcess):
        parent = process.parent()
        return (
            parent is not None
            and "python" in process.name()
            and RUN in process.cmdline()
            and parent.cmdline() == process.cmdline()
        )
    return False


def test_a_second_process_is_refused_the_lock(tmp_path: Path):
    one, other = (os.open(tmp_path / "file", os.O_RDWR | os.O_CREAT) for _ in range(2))
    system.lock(one)
    with pytest.raises(BlockingIOError):
        system.lock(other)
    os.close(one)
    system.lock(other)
    os.close(other)


def test_windows_locks_a_byte_behind_all_that_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    asked: list[Sequence[int]] = []

    def locking(file: int, mode: int, count: int) -> None:
        asked.append((os.lseek(file, 0, os.SEEK_CUR), mode, count))
        if len(asked) > 1:
            raise PermissionError(13, "Permission denied")

    stand_in = ModuleType("msvcrt")
    vars(stand_in).update(locking=locking, LK_NBLCK=2)
    monkeypatch.setitem(sys.modules, "msvcrt", stand_in)
    monkeypatch.setattr(system, "os", windows())
    file = os.open(tmp_path / "file", os.O_RDWR | os.O_CREAT)
    os.write(file, b"a line\n")
    system.lock(file)

    assert asked == [(system.LOCKED, 2, 1)]
    assert os.lseek(file, 0, os.SEEK_CUR) == 7
    with pytest.raises(BlockingIOError):
        system.lock(file)
    os.close(file)


def windows() -> SimpleNamespace:
    return SimpleNamespace(**{**vars(os), "name": "nt"})


@pytest.mark.slow
def test_a_thread_ends_a_solver_that_takes_all_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    file = tmp_path / "solver.py"
    file.write_text(
        "held = []\n\ndef integrate(s, dt):\n    while True:\n        held.append(bytearray(10**8))"
        "\n\ndef sphereSphereCollisionHandling(a, b):\n    pass\n"
    )
    choose_branch(monkeypatch, "portable")
    with SolverProcess(read_solver(file)) as solver, pytest.raises(SolverFailed) as failed:
        solver.do("ask", QUESTION, 20.0)

    assert failed.value.kind == "memory"
