"""Cells in worker processes: what aborts, hangs, raises or eats takes nothing along, and says where
it was."""

import multiprocessing
import os
import sys
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest import mock

import pytest

from crosscheck2d.adapters.engine import NotStarted
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.run import playing, pool
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import (
    CellResult,
    from_trail,
    load_trajectory,
    pack,
    play_cell,
    play_here,
)
from crosscheck2d.reports.run.pool import Failure, affordable, run_all
from crosscheck2d.scenarios.catalogue import scenario
from tests.conftest import START_PROCESS
from tests.forks import start_worker
from tests.reports.run.control_engines import (
    CONTROLS,
    FATAL,
    SLOW,
    Controlled,
    Remembers,
    hangs,
    is_killed_once,
    loads_slowly,
    row,
)

# 240 samples of 1/60 s; at one step a sample the 100th step is due after 99 of them
SCENE = "slow_collision"
GOOD = {f"good{i}:control": row(Controlled) for i in range(24)}


def cells(rows: dict[str, EngineRow]) -> dict[str, partial]:
    question = replace(scenario(SCENE), truth=None)
    return {
        name: partial(play_here, Cell(SCENE, 0, name, 1), row, question)
        for name, row in rows.items()
    }


@pytest.fixture(
    scope="module",
    params=[
        "forkserver",
        *(pytest.param(how, marks=pytest.mark.slow) for how in ("fork", "spawn")),
    ],
)
def ended(request: pytest.FixtureRequest) -> dict[str, CellResult | Failure]:
    mixed = {**dict(list(GOOD.items())[:12]), **CONTROLS, **dict(list(GOOD.items())[12:])}
    tasks = cells(mixed)
    # by itself, for the others may need long on a busy machine
    hang = {"hangs:control": tasks.pop("hangs:control")}
    context = multiprocessing.get_context(request.param)
    start = start_worker if request.param == "forkserver" else START_PROCESS
    with mock.patch.multiple(pool, start_process=start, CONTEXT=context):
        results = [
            *run_all(tasks, workers=2, memory=500_000_000),
            *run_all(hang, workers=1, timeout=3.0),
        ]

    assert sorted(key for key, _ in results) == sorted(mixed)  # each once
    return dict(results)


def test_every_good_cell_is_kept(ended):
    files = {ended[name].file for name in GOOD}

    assert {ended[name].run.status for name in GOOD} == {"ok"}
    assert len(files) == 1


@pytest.mark.parametrize(
    ("engine", "status", "said"),
    [
        ("raises", "error", "RuntimeError: no such luck"),
        ("aborts", "crashed", "SIGABRT in aborts, line "),
        (
            "aborts",
            "crashed",
            'of run/control_engines.py; it had printed "assertion failed: mass > 0"',
        ),
        ("segfaults", "crashed", "SIGSEGV in string_at, line "),
        ("hangs", "timeout", "stopped after 3 s in hangs, line "),
        ("devours", "error", "MemoryError: took more than 500 MB (--memory)"),
        ("turns_to_nan", "diverged", f"of disk 0 is not finite at {FATAL / 60:g} s"),
        ("prints", "ok", ""),
        ("leaves", "crashed", "was killed 2 times"),
        ("is_killed", "crashed", "was killed 2 times"),
    ],
)
def test_a_bad_cell_says_how_it_ended_and_where(ended, engine: str, status: str, said: str):
    outcome = ended[f"{engine}:control"]
    run = outcome if isinstance(outcome, Failure) else outcome.run

    assert run.status == status
    assert said in run.reason


@pytest.mark.parametrize("engine", ["aborts", "segfaults", "hangs"])
def test_what_died_leaves_every_good_state_before(ended, engine: str):
    trajectory = from_trail(ended[f"{engine}:control"].trail, scenario(SCENE))
    whole = play_cell(
        Cell(SCENE, 0, "good:control", 1), row(Controlled), scenario(SCENE)
    ).trajectory

    assert len(trajectory) == FATAL
    for name in ("t", "position", "velocity", "angle", "angular_velocity"):
        assert getattr(trajectory, name).tobytes() == getattr(whole, name)[:FATAL].tobytes()


@pytest.mark.slow
def test_the_clock_of_a_cell_starts_when_its_engine_is_loaded():
    slow = {
        "slow:control": row(partial(Controlled, in_load=loads_slowly)),
        "hangs:control": row(partial(Controlled, hangs, loads_slowly)),
    }
    ended = dict(run_all(cells(slow), workers=2, timeout=SLOW / 2))
    question = replace(scenario(SCENE), truth=None)
    stuck = {
        "stuck": partial(
            impatient,
            Cell(SCENE, 0, "stuck:control", 1),
            row(partial(Controlled, in_load=hangs)),
            question,
        )
    }
    [(_, never)] = run_all(stuck, workers=1, timeout=1.0)

    assert ended["slow:control"].run.status == "ok"
    assert ended["hangs:control"].status == "timeout"
    assert f"stopped after {SLOW / 2:g} s in hangs" in ended["hangs:control"].reason
    assert never.status == "timeout"
    assert "stopped after 3 s in hangs" in never.reason


def impatient(*words: Any) -> CellResult:
    playing.LOADING = 3.0
    return play_here(*words)


def test_a_worker_that_is_killed_from_outside_is_no_fault_of_its_cell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("CONTROL_MARK", str(tmp_path / "mark"))
    results = dict(
        run_all(
            cells(
                {
                    "once:control": row(partial(Controlled, is_killed_once)),
                    "good:control": row(Controlled),
                }
            ),
            workers=1,
        )
    )

    assert (tmp_path / "mark").exists()
    assert results["once:control"].file == results["good:control"].file


def test_an_engine_that_leaves_state_gets_a_process_a_cell():
    tasks = cells(
        {f"{kind}{i}:control": row(Remembers) for kind in ("alone", "together") for i in range(3)}
    )
    files: dict[str, set[bytes]] = {"alone": set(), "together": set()}
    for name, played in run_all(
        tasks, workers=1, alone={name for name in tasks if name.startswith("alone")}
    ):
        files[name[:-9]].add(played.file)

    assert {kind: len(different) for kind, different in files.items()} == {
        "alone": 1,
        "together": 3,
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
def test_no_engine_remembers_what_it_played(name: str):
    first, *others = ("slow_collision", "line_gas", "falling_box")
    tasks = {
        key: partial(
            play_here, Cell(scene, 0, name, 1), ENGINES[name], replace(scenario(scene), truth=None)
        )
        for key, scene in (
            ("before", first),
            *((other, other) for other in others),
            ("after", first),
        )
    }
    played = dict(run_all(tasks, workers=1))

    assert played["before"].file == played["after"].file
    assert not ENGINES[name].leaves_state


def fails() -> None:
    raise RuntimeError("no such luck")


def devours() -> bytes:
    return bytes(10**10)


def has_no_process() -> None:
    raise NotStarted("no process")


def gives_a_function() -> Callable[[], None]:
    return lambda: None


def not_importable() -> Any:
    module = sys.modules["only_here"] = ModuleType("only_here")
    exec("def task(): pass", module.__dict__)
    return module.task


@pytest.mark.parametrize(
    ("task", "outside", "reason"),
    [
        (fails, False, "RuntimeError: no such luck"),
        (devours, True, "MemoryError: took more than 900 MB (--memory)"),
        (has_no_process, True, "NotStarted: no process"),
        (gives_a_function, True, "its result cannot be sent back: "),
        (lambda: None, True, "it cannot be sent to a worker: "),
        (not_importable(), True, "the worker cannot read its task: ModuleNotFoundError: "),
    ],
)
def test_a_failure_has_its_reason_and_whether_that_is_outside_the_task(
    task: Any, outside: bool, reason: str
):
    [(_, ended)] = run_all({"one": task}, workers=1, memory=900_000_000)

    assert (ended.status, ended.outside) == ("error", outside)
    assert ended.reason.startswith(reason)


@pytest.mark.usefixtures("fresh_workers")
def test_a_worker_that_does_not_start_is_not_the_fault_of_its_task(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(pool, "serve", ends_at_once)
    [(_, ended)] = run_all({"one": fails}, workers=1)

    assert ended == Failure("crashed", "its worker could not start: exit status 3", outside=True)


def ends_at_once(*_: object) -> None:
    os._exit(3)


def test_workers_are_limited_by_memory_and_open_files(monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setattr(pool.psutil, "virtual_memory", lambda: SimpleNamespace(total=10**9))
    monkeypatch.setattr(pool.system, "most_files", lambda: 1024)
    assert (affordable(1000), affordable(2)) == (2, 2)
    assert capsys.readouterr().err == (
        "1000 workers are more than can start here (memory of 1000 MB, each needs 400):"
        " 2 are started\n"
    )

    monkeypatch.setattr(pool.system, "most_files", lambda: 8)
    with pytest.raises(SystemExit) as end:
        affordable(1)
    assert end.value.code == 2
    assert capsys.readouterr().err == (
        "at most 8 files may be open, and a run needs 64: ulimit -n 1024\n"
    )


def waits() -> str:
    time.sleep(1.0)
    return "ended"


def test_a_clock_that_jumps_stops_no_task(monkeypatch: pytest.MonkeyPatch):
    now = time.time()
    monkeypatch.setattr(
        time, "time", lambda: now + 3e7 * (1 if time.monotonic() % 0.2 < 0.1 else -1)
    )

    assert dict(run_all({"one": waits}, workers=1, timeout=30.0)) == {"one": "ended"}


def test_urgent_tasks_start_before_the_others():
    urgent: deque[Any] = deque()
    order = []
    for key, _ in run_all({k: os.getpid for k in range(4)}, workers=1, urgent=urgent):
        if not order:
            urgent.append(("urgent", os.getpid))
        order.append(key)

    assert order.index("urgent") <= 2


def test_a_trajectory_comes_back_from_its_file_bit_for_bit():
    here = play_cell(
        Cell("line_gas", 0, "pymunk:matched", 1), ENGINES["pymunk:matched"], scenario("line_gas")
    ).trajectory
    there = load_trajectory(pack(here))

    assert len(here.collisions)
    for name in ("t", "position", "velocity", "angle", "angular_velocity"):
        assert getattr(here, name).tobytes() == getattr(there, name).tobytes()
    for name in ("t", "i", "j", "impulse"):
        assert getattr(here.collisions, name).tobytes() == getattr(there.collisions, name).tobytes()


def test_a_signal_whose_exception_was_lost_ends_the_tasks(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("crosscheck2d.reports.run.pool.signal_status", lambda: 130)
    with pytest.raises(KeyboardInterrupt):
        list(run_all(cells(GOOD), 2))
    assert not multiprocessing.active_children()
