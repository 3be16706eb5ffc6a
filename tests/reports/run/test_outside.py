"""What failed for a reason outside the engine is no result: it is said to be so, and is played
again."""

from __future__ import annotations

import ctypes
import json
import os
import pickle
import resource
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from crosscheck2d.adapters import safe_path
from crosscheck2d.adapters.engine import NotStarted
from crosscheck2d.adapters.own_engine.engine import row_of_file
from crosscheck2d.adapters.own_solver.file import read_solver
from crosscheck2d.adapters.own_solver.process import WORK
from crosscheck2d.adapters.own_solver.worker import HERE, MEMORY
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.safe_path import python
from crosscheck2d.reports.run import runner, worker
from crosscheck2d.reports.run.archive import Archive
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import play_here
from crosscheck2d.reports.run.runner import LEAST_MEMORY, affordable, run_all
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.run.journals import contents, put
from tests.reports.run.sweeps import SMALL, lines, undisturbed
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT

pytestmark = pytest.mark.slow  # each plays a run with processes of its own

RIGHT = next(path for path in CORRECT if path.name == "plain.py")
SCENE = "head_on_equal_e09"


def one(task: Any, **means: Any) -> Any:
    """How a task ended."""
    [(_, ended)] = run_all({"one": task}, workers=1, **means)
    return ended


def own(path: Path) -> partial:
    """The cell of a solver's file."""
    return partial(
        play_here,
        Cell(SCENE, 0, f"{path}:own", 1),
        row_of_file(path),
        replace(scenario(SCENE), truth=None),
    )


def fails() -> None:
    """As a faulty engine may."""
    raise RuntimeError("no such luck")


def devours() -> bytes:
    """More than it is given."""
    return bytes(10**10)


def has_no_process() -> None:
    """As on a machine without memory left."""
    raise NotStarted("no process")


def not_importable() -> Any:
    """A task of a module that no other process can import."""
    module = sys.modules["only_here"] = ModuleType("only_here")
    exec("def task(): pass", module.__dict__)
    return module.task


@pytest.mark.parametrize(
    ("task", "outside", "said"),
    [
        (fails, False, "RuntimeError: no such luck"),
        (devours, True, "MemoryError: took more than 900 MB (--memory)"),
        (has_no_process, True, "NotStarted: no process"),
        (
            not_importable(),
            True,
            "the worker cannot read its task: ModuleNotFoundError: No module named 'only_here'",
        ),
    ],
)
def test_a_failure_says_whether_it_lies_outside_what_was_done(task: Any, outside: bool, said: str):
    """What the task itself raises does not."""
    ended = one(task, memory=900_000_000)

    assert (ended.outside, ended.reason) == (outside, said)


@pytest.mark.usefixtures("fresh_workers")
def test_a_worker_that_cannot_start_is_not_the_fault_of_its_task(monkeypatch: pytest.MonkeyPatch):
    """A Python that ends at once."""
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    ended = one(fails)

    assert ended == Failure("crashed", "its worker could not start: exit status 1", outside=True)


@pytest.mark.usefixtures("fresh_workers")
def test_a_worker_that_does_not_come_up_is_not_the_fault_of_its_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """A Python that says nothing."""
    (tmp_path / "python").write_text("#!/bin/sh\nexec sleep 1000\n")
    (tmp_path / "python").chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setattr(worker, "STARTING", 1.0)
    ended = one(fails)

    assert (ended.status, ended.reason, ended.outside) == (
        "timeout",
        "its worker did not start in 1 s",
        True,
    )


def test_a_process_of_a_solver_that_cannot_start_is_not_the_fault_of_its_file(
    monkeypatch: pytest.MonkeyPatch,
):
    """It is neither a row of the check nor the status of a run."""
    monkeypatch.setattr(safe_path.sys, "executable", shutil.which("false"))
    question, engine = scenario(SCENE), row_of_file(RIGHT).make()

    with pytest.raises(
        NotStarted, match=r"the process for a solver's file could not be started: .*exit status 1"
    ):
        play(engine, "x:own", question, question.dt(1))


def test_resume_plays_again_what_failed_outside_the_engine_and_nothing_else(tmp_path: Path):
    """Of four cells that crashed two did so by themselves: those stay. So with the probes of two
    engines."""
    whole = undisturbed(SMALL, tmp_path)
    changed, cells, probes = [], 0, 0
    for line in contents(whole):
        if "cell" in line and cells < 4:
            line |= {"status": "crashed", "reason": "planted", "outside": cells % 2 == 0}
            cells += 1
        if "conformance" in line and probes < 1:
            line["key"], probes = "", probes + 1  # as `keep_probes` writes it
        changed.append(line)
    put(whole, changed)
    crosscheck("run", "--resume", "whole", cwd=tmp_path)
    records = Archive.read(whole).records

    assert lines(whole)[-1]["footer"]["played"] == 3
    assert [record["reason"] for record in records if record["status"] != "ok"] == [
        "planted",
        "planted",
    ]


def test_no_more_workers_are_started_than_the_machine_can_hold(
    monkeypatch: pytest.MonkeyPatch, capsys
):
    """Each takes memory and open files; the sentence names what there is least of. Fewer are left
    alone."""
    monkeypatch.setattr(runner.psutil, "virtual_memory", lambda: SimpleNamespace(total=10**9))
    monkeypatch.setattr(runner, "most_files", lambda: 1024)

    assert affordable(1000) == 2
    assert (
        capsys.readouterr().err
        == "1000 workers are more than can start here (memory of 1000 MB, each needs 400):"
        " 2 are started\n"
    )
    assert affordable(2) == 2
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(runner.psutil, "virtual_memory", lambda: SimpleNamespace(total=10**12))
    assert affordable(1000) == 184
    assert "limit of 1024 open files, each needs 5): 184 are started" in capsys.readouterr().err


@pytest.mark.long
def test_a_thousand_workers_crash_nothing(tmp_path: Path):
    """As many are started as can be, with memory enough for each."""
    done = crosscheck(*SMALL, "--workers", "1000", "--out", "out", cwd=tmp_path)
    most = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 1_000_000 // LEAST_MEMORY

    assert done.returncode == 0, done.stderr
    assert most >= 1000 or f"{most} are started" in done.stderr
    assert {record["status"] for record in Archive.read(tmp_path / "out").records} == {"ok"}


def test_a_solver_that_is_stopped_is_not_said_to_be_in_a_line_of_this_program(tmp_path: Path):
    """It is in a process of its own; where, the process that waits for it cannot tell."""
    (tmp_path / "solver.py").write_text(
        RIGHT.read_text().replace(
            "    sphere.alpha +=", "    while sphere.position.x > -0.5: pass\n    sphere.alpha +="
        )
    )
    ended = one(own(tmp_path / "solver.py"), timeout=2.0)

    assert (
        ended.reason == "stopped after 2 s, while the solver's file had not come back from a call"
    )
    assert not ended.outside


@pytest.mark.parametrize("name", ["UPPER.PY", pytest.param("Mixed.Py", marks=pytest.mark.long)])
def test_a_solver_may_be_called_in_capitals(tmp_path: Path, name: str):
    """As `check` takes it: no engine of that name is looked for."""
    (tmp_path / name).write_text("nonsense(")
    done = crosscheck(
        "run", SCENE, "--dt", str(1 / 60), "--engine", name, "--out", "out", cwd=tmp_path
    )

    assert done.returncode == 1
    assert f"no cell of {name}:own was played to its end" in done.stderr
    (record,) = Archive.read(tmp_path / "out").records
    assert (record["engine"], record["status"]) == (name, "unsupported")
    assert "SyntaxError: '(' was never closed" in record["reason"]


def little_memory() -> None:
    """In a process to be: half of what a solver's file is given otherwise, and no right to more,
    not even as root."""
    prctl_capbset_drop, cap_sys_resource = 24, 24
    ctypes.CDLL(None).prctl(prctl_capbset_drop, cap_sys_resource, 0, 0, 0)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY // 2, MEMORY // 2))


def test_a_worker_with_little_memory_can_still_start_a_solver():
    """A limit that is lower than the solver's own stays as it is: nobody but root may raise it."""
    with subprocess.Popen(
        python(WORK),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        preexec_fn=little_memory,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        solver = json.dumps(pickle.dumps((read_solver(RIGHT), None)).hex())
        process.stdin.write(solver.encode() + b"\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline()) == HERE
        assert json.loads(process.stdout.readline())["surface"] == "exercise"
