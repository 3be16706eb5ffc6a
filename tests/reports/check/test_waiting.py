"""What a check waits for, what it stops, and that it leaves nothing running behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from time import process_time, sleep
from unittest import mock

import pytest
from py_mini_racer import JSTimeoutException

from crosscheck2d.adapters.host.file import PATIENCE, NotASolver, SolverFailed, read_solver
from crosscheck2d.adapters.host.process import GRACE, SolverProcess
from crosscheck2d.adapters.host.sandbox import GUEST, Level, start
from crosscheck2d.reports.check import command
from crosscheck2d.reports.check.lines import Source
from crosscheck2d.reports.check.rows import judged
from crosscheck2d.reports.check.solver import with_lines
from crosscheck2d.reports.check.verdict import FileCheck, check_file

SECONDS = 16.0  # for a process that starts and is stopped late, on a busy machine
sys.path.append(str(GUEST))
v8 = import_module("v8")
JS = (Path(__file__).parents[3] / "tests" / "solvers/correct/plain.js").read_text()
PY = (Path(__file__).parents[3] / "tests" / "solvers/correct/plain.py").read_text()


def busy(spent: float) -> Iterator[str | Exception]:
    """An engine that is stopped after `spent` s of processor time, then answers."""
    until = process_time() + spent
    while process_time() < until:
        pass
    yield JSTimeoutException()
    yield "7"


def test_a_call_that_a_busy_machine_has_kept_waiting_is_asked_again_and_an_endless_one_is_not(
    tmp_path: Path,
):
    """What V8 was stopped in counts only if it has run for its time; a step cannot be asked
    twice."""
    (tmp_path / "Exercise.js").write_text(JS)
    # V8 takes no time limit in a thread with an event loop, as this one has once a browser is open.
    with ThreadPoolExecutor(1) as pool:
        solver = pool.submit(v8.V8Guest, read_solver(tmp_path / "Exercise.js").order).result()

    for spent, may_repeat, answer in ((0.0, True, "7"), (0.2, True, None), (0.0, False, None)):
        solver.v8 = mock.Mock()
        solver.v8.eval.side_effect = busy(spent)
        if answer is None:
            with pytest.raises(JSTimeoutException):
                solver.evaluate("code", 0.2, may_repeat)
        else:
            assert solver.evaluate("code", 0.2, may_repeat) == answer


@pytest.mark.parametrize("fails", ["", "while (true) {}"], ids=["none", "one is endless"])
def test_questions_put_together_are_answered_as_one_by_one(tmp_path: Path, fails: str):
    """Those before the call that fails and those after it, with a throw among them."""
    (tmp_path / "Exercise.js").write_text(
        JS.replace(
            "function integrate(sphere, dt) {",
            f"function integrate(sphere, dt) {{ if (dt === 3) {{ {fails} }}"
            ' if (dt === 2) throw new Error("two");',
        )
    )
    ball = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0, 0.7, 0.8, 0.9, 1.0, 0.5]
    request = [
        ("ask", {"spheres": [ball], "calls": [["integrate", 0, dt]], "world": False}, 1.0)
        for dt in (1, 2, 1, 3, 1, 2)
    ]
    with SolverProcess(read_solver(tmp_path / "Exercise.js")) as process:
        together = process.request(request)
    with SolverProcess(read_solver(tmp_path / "Exercise.js")) as process:
        one_by_one = [process.request([each])[0] for each in request[:4]]

    assert list(map(str, together[:4])) == list(map(str, one_by_one))
    assert together[2] == together[0]
    assert isinstance(together[3], SolverFailed) == bool(fails)
    # no call is made again that did not come back
    assert str(together[4]) == str(together[3] if fails else together[0])


FAILED = {"failed": {"kind": "error", "what": "", "line": 0, "column": 0}}


def test_both_functions_may_be_endless_on_a_busy_machine(tmp_path: Path):
    """Each may take its limit by the clock, which is `PATIENCE` times that of the processor."""
    (tmp_path / "Exercise.js").write_text(JS)
    ball = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0, 0.7, 0.8, 0.9, 1.0, 0.5]
    ask = [
        ("ask", {"spheres": [ball, ball], "calls": [call], "world": False}, 1.0)
        for call in (["integrate", 0, 0.1], ["integrate", 1, 0.1], ["collide", 0, 1])
    ]
    with SolverProcess(read_solver(tmp_path / "Exercise.js")) as process:
        given = mock.Mock(side_effect=lambda asked, _: {"done": [FAILED] * len(asked["do"])})
        process.exchange = given  # type: ignore[method-assign]
        process.request(ask)
        process.request(ask[:2])
        process.request([("left", None, 1.0)])
    both, one, left = (call.args[1] for call in given.call_args_list)

    assert both == 2 * PATIENCE + GRACE
    assert one == left == PATIENCE + GRACE


def test_a_process_that_was_stopped_fails_again_when_it_is_asked(tmp_path: Path):
    """As a failure of the solver, which the rows say; a fault's lines are then left out."""
    (tmp_path / "Exercise.js").write_text(JS)
    with SolverProcess(read_solver(tmp_path / "Exercise.js")) as process:
        process.end()
        with pytest.raises(SolverFailed, match="stopped before"):
            process.do("left")
        row = judged("scenes", "scenes", "Does it play?", "it fails", "yes", False, "too slow")
        assert with_lines([row], Source(process, JS)) == [row]


ENDS = {
    "sleeps.py": "import time; time.sleep(99)",
    "endless.py": "while True: pass",
    "right.py": "0",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ENDS)
def test_only_what_the_clock_has_ended_is_asked_again(name: str, tmp_path: Path):
    """What keeps the processor busy has had its time."""
    head = "def integrate(sphere, dt):\n"
    (tmp_path / name).write_text(PY.replace(head, f"{head}    {ENDS[name]}\n"))
    assert check_file(tmp_path / name).waited == (name == "sleeps.py")


def noted_check(file: Path, *_: object) -> FileCheck:
    """In a worker: a check that writes when it begins and ends, and of which b.py alone was ended
    by no clock."""
    diary = file.with_name("diary")
    first = f"begin {file.name}" not in (diary.read_text() if diary.exists() else "")
    for what in ("begin", "end"):
        with diary.open("a") as note:
            note.write(f"{what} {file.name}\n")
        sleep(0.3)
    return FileCheck(file, [], "first" if first else "second", waited=file.name != "b.py")


def test_a_file_that_the_clock_has_ended_is_asked_once_more_alone_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """When nothing else runs, and once; the second check counts."""
    monkeypatch.setattr(command, "check_here", noted_check)
    files = [tmp_path / name for name in ("a.py", "b.py", "c.py")]
    for file in files:
        file.write_text(file.name)

    assert [one.refused for one in command.checked(files)] == ["second", "first", "second"]
    lines = (tmp_path / "diary").read_text().splitlines()
    assert lines[6:] == ["begin a.py", "end a.py", "begin c.py", "end c.py"]


@pytest.mark.slow
def test_a_worker_whose_parent_is_gone_ends_in_an_endless_loop_too(tmp_path: Path):
    """V8 stops the loop after its limit; nobody is there to hear it, and no process is left
    behind."""
    (tmp_path / "Exercise.js").write_text("while (true) {}")
    how = start(Level.NONE, "javascript", (), None)
    worker = subprocess.Popen(
        how.command,
        env=how.environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    assert worker.stdin is not None
    assert worker.stdout is not None
    assert json.loads(worker.stdout.readline())["here"]
    worker.stdout.close()
    request = {"id": "1", "open": read_solver(tmp_path / "Exercise.js").order}
    worker.stdin.write(json.dumps(request).encode() + b"\n")
    worker.stdin.close()
    try:
        worker.wait(SECONDS)
    finally:
        worker.kill()


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path):
    """Nobody writes into it, so that reading it would never end."""
    os.mkfifo(tmp_path / "Exercise.js")

    with pytest.raises(
        NotASolver, match=r"Exercise\.js: is no file; name an Exercise\.js or a solver\.py"
    ):
        read_solver(tmp_path / "Exercise.js")
