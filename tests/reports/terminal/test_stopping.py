"""SIGTERM and Ctrl-C end every command within 3 s wherever it is, also in C code that never
returns."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from itertools import product
from pathlib import Path

import pandas as pd
import psutil
import pytest

from crosscheck2d.reports.run.results import COMMAND
from crosscheck2d.reports.run.store import writing
from tests.reports.run.test_disturbed import alive
from tests.reports.terminal.command_line import crosscheck, wait_for
from tests.reports.terminal.stopping import AT_MOST, Command, assert_ended, busyness

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="looks for what is left in /proc"),
    pytest.mark.slow,  # each waits for a program to end
]

SOLVERS = Path(__file__).parents[3] / "tests" / "solvers" / "correct"
TRUTH, ANSWER = (
    "crosscheck2d.scenarios.truth.exact:OracleTruth.record",
    "crosscheck2d.scenarios.truth.exact:computed",
)
BOTH = [signal.SIGTERM, signal.SIGINT]
# In the gate each signal is sent in another test, in the long run both are sent in both.
CTRL_C = [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)]
FILE = """
name = "two"
duration = 1.0
sample_interval = 0.05
substeps = [1, 2]
restitution = 1.0
[[disk]]
position = [-1.0, 0.0]
velocity = [1.0, 0.0]
radius = 0.5
mass = 1.0
[[disk]]
position = [1.0, 0.0]
velocity = [-1.0, 0.0]
radius = 0.5
mass = 1.0
"""
TWO = ["run", "two.toml", "slow_collision", "--engine", "pymunk:shipped", "--out", "out"]
TWO += ["--timings", "0"]  # which take longer than all else
SOCKET = (  # RFC 6455, 1.2: a page opens its socket
    "GET /fly HTTP/1.1\r\nHost: localhost:PORT\r\nOrigin: http://localhost:PORT\r\nUpgrade:"
    " websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key:"
    " dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
# The stages of every command, each with what never returns there.
STALLED = {
    "the answer in run": (TWO, TRUTH),
    "the comparison in run": (TWO, "crosscheck2d.reports.compare.comparison:_measure"),
    "the answer in report": (["report", "done"], TRUTH),
    "the comparison in report": (
        ["report", "done"],
        "crosscheck2d.reports.compare.comparison:_measure",
    ),
    "the answer in truth": (["truth", "two.toml"], TRUTH),
    "the answer in speed": (
        ["speed", "two.toml", "--engine", "pymunk:shipped", "--out", "out"],
        TRUTH,
    ),
    "a limit in stability": (
        ["stability", "two.toml", "--vary", "dt", "--engine", "pymunk:shipped", "--out", "out"],
        TRUTH,
    ),
    "a scene in check": (["check", SOLVERS / "plain.py"], ANSWER),
    "a scene in check of a folder": (["check", SOLVERS], ANSWER),
    "a lesson in lesson --export": (
        ["lesson", "order", "--export", "order.html"],
        "crosscheck2d.reports.lessons.lesson:play_once",
    ),
}
# what the gate plays of these
FEW = ("the answer in run", "a limit in stability", "a scene in check")


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("done")
    (folder / "two.toml").write_text(FILE)
    assert crosscheck(*TWO, cwd=folder).returncode == 0
    return folder / "out"


@pytest.fixture
def place(done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path / "cache"))
    (tmp_path / "two.toml").write_text(FILE)
    shutil.copytree(done, tmp_path / "done")
    with writing(tmp_path / "done", COMMAND) as store:
        for kind in ("truth", "comparison"):
            for key in store.rows.keys(kind):
                store.rows.delete(kind, key)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("how", CTRL_C)
@pytest.mark.parametrize(
    "stage",
    [pytest.param(stage, marks=[] if stage in FEW else [pytest.mark.long]) for stage in STALLED],
)
def test_a_command_ends_at_any_stage_though_compiled_code_never_returns(
    place: Path, stage: str, how: int
):
    words, stalled = STALLED[stage]
    command = Command(*words, cwd=place, stalled=stalled).stalled()
    ended = command.stop(how, whole_group=how == signal.SIGINT)

    assert_ended(ended, how)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "how"),
    [
        (["run"], signal.SIGTERM),
        (["check", SOLVERS], signal.SIGINT),
        *(
            pytest.param(words, how, marks=pytest.mark.long)
            for words, how in [
                (["run"], signal.SIGINT),
                (["check", SOLVERS], signal.SIGTERM),
                *product((["list"], ["diff", "done", "done"], ["report", "done"]), BOTH),
            ]
        ),
    ],
)
@pytest.mark.parametrize(
    "after", [1.0, *(pytest.param(after, marks=pytest.mark.long) for after in (0.3, 2.0))]
)
def test_a_command_ends_whenever_it_is_signalled(place: Path, words: list, how: int, after: float):
    command = Command(*words, cwd=place)
    with suppress(subprocess.TimeoutExpired):
        command.process.wait(after)
        return
    ended = command.stop(how, whole_group=True)

    assert ended.seconds < AT_MOST * busyness(), ended
    assert ended.status in (128 + how, 0), ended  # 0: it was done
    assert not ended.left


LESSON = (
    ["lesson"],
    "crosscheck2d.reports.lessons.lesson:play_once:waits",
    "GET /lesson/order HTTP/1.1\r\nHost: localhost\r\n\r\n",
)
GAME = (["play", "--engine", "reference"], "crosscheck2d.reports.game.session:Flight:waits", SOCKET)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "stalled", "asked", "how", "status"),
    [
        (*LESSON, signal.SIGTERM, 143),
        (*GAME, signal.SIGINT, 0),
        pytest.param(*LESSON, signal.SIGINT, 0, marks=pytest.mark.long),
        pytest.param(*GAME, signal.SIGTERM, 143, marks=pytest.mark.long),
    ],
)
def test_a_server_ends_though_a_page_never_gets_its_answer(
    place: Path, words: list, stalled: str, asked: str, how: int, status: int
):
    command = Command(*words, cwd=place, stalled=stalled).when(
        lambda: "localhost:" in printed(place)
    )
    port = int(printed(place).split("localhost:")[1].split("/")[0])
    with socket.create_connection(("127.0.0.1", port)) as page:
        page.sendall(asked.replace("PORT", str(port)).encode())
        ended = command.stalled().stop(how)

    assert (ended.status, ended.left) == (status, [])
    assert ended.seconds < AT_MOST * busyness()
    assert "Stopped." in printed(place)


def printed(place: Path) -> str:
    return (place / ".stdout").read_text()


@pytest.mark.slow
def test_what_takes_too_long_is_said_and_the_other_scene_is_judged(place: Path):
    said = "two is not judged: the exact answer took longer than 2 s (--timeout)"
    run = Command(*TWO, "--timeout", "2", cwd=place, stalled=TRUTH)
    assert run.process.wait(300) == 1, run.errors.read_text()
    complained = run.errors.read_text()
    table = pd.read_csv(place / "out" / "deviations.csv")
    rows = table[table.note.str.startswith("not judged", na=False)]
    report = crosscheck("report", "out", cwd=place)
    truth = Command("truth", "two.toml", "--timeout", "2", cwd=place, stalled=TRUTH)
    later = crosscheck(*TWO, "--timeout", "60", cwd=place)

    assert said in complained
    assert set(rows.scenario) == {"two"}
    assert set(rows.note) == {"not judged: the exact answer took longer than 2 s (--timeout)"}
    assert len(rows) == 2
    assert "truth" in set(table[table.scenario == "slow_collision"].versus)
    assert (report.returncode, said in report.stderr) == (1, True)
    assert truth.process.wait(120) == 1
    assert "two: the exact answer took longer than 2 s (--timeout)\n" in truth.errors.read_text()
    assert later.returncode == 0
    assert "not judged" not in (place / "out" / "deviations.csv").read_text()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("endless.js", "function integrate(sphere, dt) { while (true) {} }"),
        ("endless.py", "def integrate(sphere, dt):\n    while True:\n        pass\n"),
    ],
)
def test_a_solver_that_loops_ends_with_whoever_asked_it(tmp_path: Path, name: str, text: str):
    (tmp_path / name).write_text(text)
    question = {"spheres": [[0.0] * 12], "calls": [["integrate", 0, 1e-3]], "world": False}
    asks = (
        "from pathlib import Path; from crosscheck2d.adapters.host.file import read_solver; "
        "from crosscheck2d.adapters.host.process import SolverProcess; "
        f"SolverProcess(read_solver(Path({str(tmp_path / name)!r}))).do('ask', {question}, 60.0)"
    )
    asking = subprocess.Popen([sys.executable, "-c", asks], stderr=subprocess.DEVNULL)
    wait_for(lambda: any(busy(pid) for pid in asked_by(asking.pid)))
    processes = asked_by(asking.pid)  # of the file, and of the sandbox around it
    asking.kill()
    asking.wait()
    killed = time.monotonic()
    wait_for(lambda: not any(alive(pid) for pid in processes))

    assert time.monotonic() - killed < 2.0 * busyness()


def asked_by(parent: int) -> list[int]:
    return [child.pid for child in psutil.Process(parent).children(recursive=True)]


def busy(pid: int) -> bool:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") > 1.0
