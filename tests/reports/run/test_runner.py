"""Cells in worker processes: what aborts, hangs, raises or eats takes nothing along, and says where
it was."""

import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.run import playing, worker
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import CellResult, play_cell, play_here
from crosscheck2d.reports.run.runner import NoScheduler, cluster, run_all
from crosscheck2d.reports.run.trajectories import from_trail, load_trajectory, packed
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.scenarios.catalogue import scenario
from tests.forks import FRESH, Forked
from tests.reports.run.control_engines import (
    CONTROLS,
    FATAL,
    SLOW,
    Controlled,
    HangsInLoad,
    LoadsSlowly,
    LoadsSlowlyAndHangs,
    Once,
    Remembers,
    row,
)

# 240 samples of 1/60 s; at one step a sample the 100th step is due after 99 of them
SCENE = "slow_collision"
GOOD = {f"good{i}:control": row(Controlled) for i in range(24)}


def cells(rows: dict[str, EngineRow]) -> dict[str, partial]:
    """A task a row: `SCENE` at its coarsest step."""
    question = replace(scenario(SCENE), truth=None)
    return {
        name: partial(play_here, Cell(SCENE, 0, name, 1), row, question)
        for name, row in rows.items()
    }


@pytest.fixture(scope="module", params=["forked", pytest.param("fresh", marks=pytest.mark.slow)])
def ended(request: pytest.FixtureRequest) -> dict[str, CellResult | Failure]:
    """How 24 good cells ended and nine bad ones among them, on two workers: forked here, and each
    an interpreter of its own, as users have it."""
    mixed = {**dict(list(GOOD.items())[:12]), **CONTROLS, **dict(list(GOOD.items())[12:])}
    tasks = cells(mixed)
    # by itself, for the others may need long on a busy machine
    hang = {"hangs:control": tasks.pop("hangs:control")}
    with mock.patch.object(worker, "start", FRESH if request.param == "fresh" else Forked):
        results = [
            *run_all(tasks, workers=2, memory=500_000_000),
            *run_all(hang, workers=1, timeout=3.0),
        ]

    assert sorted(key for key, _ in results) == sorted(mixed)  # each once
    return dict(results)


def test_every_good_cell_is_kept(ended):
    """24 of 24, all of the same bits."""
    files = {ended[name].file for name in GOOD}

    assert {ended[name].run.status for name in GOOD} == {"ok"}
    assert len(files) == 1


@pytest.mark.parametrize(
    ("engine", "status", "said"),
    [
        ("raises", "error", "RuntimeError: no such luck"),
        ("aborts", "crashed", "SIGABRT in misbehave, line "),
        (
            "aborts",
            "crashed",
            'of run/control_engines.py; it had printed "assertion failed: mass > 0"',
        ),
        ("segfaults", "crashed", "SIGSEGV in string_at, line "),
        ("hangs", "timeout", "stopped after 3 s in misbehave, line "),
        ("devours", "error", "MemoryError: took more than 500 MB (--memory)"),
        ("turnstonan", "diverged", f"of disk 0 is not finite at {FATAL / 60:g} s"),
        ("prints", "ok", ""),
        ("leaves", "crashed", "was killed 3 times"),
        ("iskilled", "crashed", "was killed 3 times"),
    ],
)
def test_a_bad_cell_says_how_it_ended_and_where(ended, engine: str, status: str, said: str):
    """Status and reason; a crash has the signal and the line of Python, a divergence its time."""
    outcome = ended[f"{engine}:control"]
    run = outcome if isinstance(outcome, Failure) else outcome.run

    assert run.status == status
    assert said in run.reason


@pytest.mark.parametrize("engine", ["aborts", "segfaults", "hangs"])
def test_what_died_leaves_every_good_state_before(ended, engine: str):
    """The trail holds the same bits as a run that lives, up to the sample before the fatal step."""
    trajectory = from_trail(ended[f"{engine}:control"].trail, scenario(SCENE))
    whole = play_cell(
        Cell(SCENE, 0, "good:control", 1), row(Controlled), scenario(SCENE)
    ).trajectory

    assert len(trajectory) == FATAL
    for name in ("t", "position", "velocity", "angle", "angular_velocity"):
        assert getattr(trajectory, name).tobytes() == getattr(whole, name)[:FATAL].tobytes()


@pytest.mark.slow
def test_the_clock_of_a_cell_starts_when_its_engine_is_loaded():
    """Loading that takes longer than the time-out is no fault; a hang after it is, and so is one
    that never loads."""
    slow = {"slow:control": row(LoadsSlowly), "hangs:control": row(LoadsSlowlyAndHangs)}
    ended = dict(run_all(cells(slow), workers=2, timeout=SLOW / 2))
    question = replace(scenario(SCENE), truth=None)
    stuck = {
        "stuck": partial(impatient, Cell(SCENE, 0, "stuck:control", 1), row(HangsInLoad), question)
    }
    [(_, never)] = run_all(stuck, workers=1, timeout=1.0)

    assert ended["slow:control"].run.status == "ok"
    assert ended["hangs:control"].status == "timeout"
    assert f"stopped after {SLOW / 2:g} s in misbehave" in ended["hangs:control"].reason
    assert never.status == "timeout"
    assert "stopped after 3 s in load" in never.reason


def impatient(*words: Any) -> CellResult:
    """In the worker: play, with little time to load."""
    playing.LOADING = 3.0
    return play_here(*words)


def test_a_worker_imports_no_tables_and_no_compiler_to_play_a_cell():
    """A worker starts in half of the time without them."""
    code = (
        "import sys, crosscheck2d.reports.run.playing\n"
        "print([name for name in ('pandas', 'pydantic', 'numba') if name in sys.modules])"
    )

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


def test_a_worker_that_is_killed_from_outside_is_no_fault_of_its_cell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """`kill -9` once: the cell is played again and is as good as any."""
    monkeypatch.setenv("CONTROL_MARK", str(tmp_path / "mark"))
    results = dict(
        run_all(cells({"once:control": row(Once), "good:control": row(Controlled)}), workers=1)
    )

    assert (tmp_path / "mark").exists()
    assert results["once:control"].file == results["good:control"].file


def test_an_engine_that_leaves_state_gets_a_process_a_cell():
    """Declared in its row, the same cell gives the same bits again and again; not declared, it does
    not."""
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


@pytest.mark.parametrize("name", ENGINES)
def test_no_engine_remembers_what_it_played(name: str):
    """After other scenes in the same process a cell has the bits it has as the first, so no row has
    `leaves_state`."""
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


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("foo", "--scheduler foo: is no address; one is like tcp://192.168.0.7:8786"),
        (
            "tcp://foo:1",
            ("--scheduler tcp://foo:1: it needs the package distributed, which is not installed"),
        ),
    ],
)
def test_a_cluster_without_its_extra_is_one_clear_sentence(
    monkeypatch: pytest.MonkeyPatch, address: str, said: str
):
    """What is wrong with the address is said first; else what is missing, and how to get it."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(NoScheduler) as refusal:
        cluster(address)

    assert str(refusal.value).startswith(said)


def test_a_trajectory_comes_back_from_its_file_bit_for_bit(tmp_path: Path):
    """The .npz holds every array of the trajectory and its collisions."""
    here = play_cell(
        Cell("line_gas", 0, "pymunk:matched", 1), ENGINES["pymunk:matched"], scenario("line_gas")
    ).trajectory
    (tmp_path / "one.npz").write_bytes(packed(here))
    there = load_trajectory(tmp_path / "one.npz")

    assert len(here.collisions)
    for name in ("t", "position", "velocity", "angle", "angular_velocity"):
        assert getattr(here, name).tobytes() == getattr(there, name).tobytes()
    for name in ("t", "i", "j", "impulse"):
        assert getattr(here.collisions, name).tobytes() == getattr(there.collisions, name).tobytes()
