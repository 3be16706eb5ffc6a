"""A guest obtains nothing that is not its own, forges no answer, and leaves nothing behind."""

from __future__ import annotations

import json
import os
import re
import socket
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from crosscheck2d.adapters.host.file import SolverFailed, SolverText
from crosscheck2d.adapters.host.process import SolverProcess
from crosscheck2d.adapters.host.sandbox import RUN, Level, bubblewrap, levels
from crosscheck2d.adapters.system import KERNEL
from tests.adapters.attacks import CALLED, FORBIDDEN, FORGED, LEFT_BEHIND

ROOT = Path(__file__).parents[2]
BUBBLEWRAP = pytest.mark.skipif(
    not KERNEL or bubblewrap() is None, reason="bubblewrap is for Linux"
)
# Each attack is a function; `models` is a text that a loaded file hands to its parent.
HEAD = """
import ctypes, os, signal, sys, time
LIBC = ctypes.CDLL(None)
SECRET, CLASS, PARENT, PROJECT, HOST, PORT, NAME = {values!r}
def WRITE(data):
    for n in range(3, 64):
        try: os.write(n, data)
        except OSError: pass
"""
# What another user of the machine may still do, at the level without a sandbox.
WEAKER = {
    "path extended", "text opened and run", "found by numpy's place", "listing of the class",
    "command lines", "stat of others", "write /var/tmp", "write /dev/shm", "tcp to the machine",
    "udp to the net", "abstract socket of the parent", "by a symbolic link", "by a hard link",
    "signal by F_SETOWN", "linker: C source beside", "exec of a shell", "own command line",
    "fills the disk", "name of a host", "unshare a user namespace", "a device made", "own place",
    "by the folder of the parent", "home folder", "keyctl of the session",
    "folders of the parent in /tmp", "watch on the class", "userfaultfd",
    "kill everything",  # says yes where each single process refuses
}  # fmt: skip


@pytest.fixture(scope="module")
def values(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[object, ...]]:
    """What the attacks are told, which they could not know: a class with a secret, a server."""
    folder = tmp_path_factory.mktemp("class-of-2026")
    (folder / "secret").write_text("20 of 20")
    (folder / "secret").chmod(0o600)
    name = f"crosscheck-{os.getpid()}"
    with socket.create_server(("127.0.0.1", 0)) as tcp, socket.socket(socket.AF_UNIX) as unix:
        unix.bind(f"\0{name}")
        unix.listen()
        port = tcp.getsockname()[1]
        secret = str(folder / "secret")
        yield secret, str(folder), os.getpid(), str(ROOT), "127.0.0.1", port, name


@pytest.fixture
def at(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("CROSSCHECK_SANDBOX", request.param)
    return str(request.param)


def guest(text: str, kind: str = "python") -> SolverProcess:
    file = Path("mine.py" if kind == "python" else "mine.js")
    return SolverProcess(SolverText(file, kind, text, ""))


def obtained(attacks: dict[str, str], values: tuple[object, ...]) -> dict[str, str]:
    text = HEAD.format(values=values) + "results = {}\n"
    for name, code in attacks.items():
        body = "".join(f"    {line}\n" for line in code.split("\n"))
        text += (
            f"def attack():\n{body}\ntry: found = attack()\n"
            "except BaseException as error: found = None\n"
            f"results[{name!r}] = repr(found)[:80] if found else ''\n"
        )
    text += "import json\nmodels = json.dumps(results)\n"
    with guest(text) as process:
        results: dict[str, str] = json.loads(process.functions["models"])
    return {name: what for name, what in results.items() if what}


@BUBBLEWRAP
@pytest.mark.parametrize("at", ["bubblewrap"], indirect=True)
def test_an_attack_obtains_nothing_in_the_sandbox(at: str, values: tuple[object, ...]):
    assert at in {level.value for level in levels()}
    assert obtained(FORBIDDEN, values) == {}
    assert Path(str(values[0])).read_text() == "20 of 20"


@pytest.mark.parametrize("at", ["none"], indirect=True)
def test_without_a_sandbox_the_same_attacks_obtain_something(at: str, values: tuple[object, ...]):
    harmless = ("neighbour's file", "text opened and run", "command lines", "stat of others")
    found = obtained({name: FORBIDDEN[name] for name in harmless}, values)
    assert at == "none"
    assert set(found) == set(harmless)


@pytest.mark.skipif(not KERNEL or os.geteuid() != 0, reason="only root becomes another user")
@pytest.mark.parametrize("at", ["another user"], indirect=True)
def test_another_user_reads_and_signals_nothing_of_root(at: str, values: tuple[object, ...]):
    if Level.USER not in levels():
        pytest.skip("another user cannot read this Python")
    attacks = {name: code for name, code in FORBIDDEN.items() if name not in WEAKER}
    assert at == "another user"
    assert obtained(attacks, values) == {}


@BUBBLEWRAP
@pytest.mark.parametrize("name", LEFT_BEHIND)
def test_nothing_is_left_running(name: str, values: tuple[object, ...]):
    before, here = running(), state()
    with (
        suppress(SolverFailed),  # some end themselves
        guest(HEAD.format(values=values) + LEFT_BEHIND[name]) as process,
    ):
        assert process.level == Level.BUBBLEWRAP
    assert state() == here
    until = time.monotonic() + 10.0  # the kernel ends a world of a hundred processes
    while running() - before and time.monotonic() < until:
        time.sleep(0.05)
    assert running() - before == set()


def state() -> tuple[object, ...]:
    segments = Path("/proc/sysvipc/shm").read_text()
    listening = [x for x in Path("/proc/net/unix").read_text().split() if "attack" in x]
    return os.getpriority(os.PRIO_PROCESS, 0), os.sched_getaffinity(0), segments, listening


def running() -> set[int]:
    found = set()
    for process in psutil.process_iter(["cmdline", "ppid"]):
        if RUN in (process.info["cmdline"] or ()):
            with suppress(psutil.NoSuchProcess):  # it ends meanwhile
                above = {parent.pid for parent in process.parents()}
                if os.getpid() in above or process.info["ppid"] == 1:
                    found.add(process.pid)
    return found


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_answer_ends_the_guest(name: str, values: tuple[object, ...]):
    code, said = FORGED[name]
    with pytest.raises(SolverFailed) as failed, guest(HEAD.format(values=values) + code):
        pass
    assert said in str(failed.value)
    assert str(failed.value).isprintable()


PLAIN = (ROOT / "tests/solvers/correct/plain.py").read_text()
BALL = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.0, 0.7, 0.8, 0.9, 1.0, 0.5]
QUESTION = {"spheres": [BALL], "calls": [["integrate", 0, 0.1]], "world": False}


@pytest.fixture(scope="module")
def right() -> object:
    with guest(PLAIN) as process:
        return process.do("ask", QUESTION, 1.0)["states"]


@pytest.mark.parametrize("name", CALLED)
def test_a_call_gives_its_right_result_or_is_said_to_have_failed(
    name: str, values: tuple[object, ...], right: object
):
    beside, within, said = CALLED[name]
    head = "def integrate(sphere, dt):\n"
    text = HEAD.format(values=values) + f"driver = sys.modules['driver']\n{beside}\n" + PLAIN
    text = text.replace(head, f"{head}    {within}\n" if within else head)
    began, result = time.monotonic(), ""
    try:
        with guest(text) as process:
            for _ in range(3):
                answer = process.do("ask", QUESTION, 0.3)
        result = "right" if answer["states"] == right else str(answer["error"])
    except SolverFailed as failure:
        result = failure.what
    assert result == "right" if not said else re.search(said, result), result
    assert result.isprintable()
    # a second call that is stopped by its parent, on a busy machine
    assert time.monotonic() - began < 30.0


def test_a_sleeping_call_is_ended_by_the_clock():
    sleeps = PLAIN.replace(
        "def integrate(sphere, dt):\n",
        "def integrate(sphere, dt):\n    import time; time.sleep(99)\n",
    )
    began = time.monotonic()
    with guest(sleeps) as process, pytest.raises(SolverFailed, match="does not come back"):
        process.do("ask", QUESTION, 0.1)
    assert time.monotonic() - began >= 3 * 0.1
