"""`crosscheck speed` and `advise` refuse what they cannot measure by name; what a measurement has
got is kept as it ends, and a log says now and then how far it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import read_row
from crosscheck2d.reports.compare.accuracy import POOLED
from crosscheck2d.reports.run.cells import about
from crosscheck2d.reports.run.store import writing
from crosscheck2d.reports.speed import ladder, measure
from crosscheck2d.reports.speed.command import SPEED, kept_of
from crosscheck2d.reports.speed.measure import Kept, do_all
from crosscheck2d.reports.speed.plan import QUICK, SpeedPlan
from crosscheck2d.reports.terminal import progress as terminal
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.terminal.command_line import crosscheck

TASK = ("error", "scene", "slow_collision", 0, "reference:exercise", "", 1)
FAILED = {"scenario": "slow_collision", "seed": 0, "status": "error", "reason": "no"}
FAILED |= {"error_radii": np.inf, "change_radii": np.nan}
HEADER: dict[str, Any] = {"scenes": ["slow_collision"], "seed": 0, "versions": {}, "machine": {}}


def test_what_has_ended_is_not_measured_again(tmp_path: Path):
    with writing(tmp_path / "out", SPEED) as store, Progress() as progress:
        Kept(store, HEADER).add(TASK, [FAILED])
        again = Kept(store, HEADER)
        (row,) = do_all({TASK: fails}, 1, progress, "error", kept=again)[TASK]
        changed = Kept(store, HEADER | {"seed": 1})

        assert row["error_radii"] == np.inf
        assert np.isnan(row["change_radii"])
        assert changed.get(TASK) is None
        changed.add(TASK, [])
        assert (again.get(TASK)[0]["status"], changed.get(TASK)) == ("error", [])


def test_a_new_measurement_is_not_older_than_its_command(tmp_path: Path):
    # Both times are texts of one form: "12:00:00+" is less than "12:00:00.5+".
    started = about("crosscheck speed", 0)["started"]
    with writing(tmp_path / "out", SPEED) as store:
        new = Kept(store, HEADER)

        assert new.first >= started
        assert len(new.first) == len(started)


def test_what_was_measured_of_a_solver_that_was_saved_since_is_measured_again(tmp_path: Path):
    solver = tmp_path / "solver.js"
    solver.write_text("function integrate(sphere, dt) {}")
    plan = SpeedPlan(QUICK.of_scenes(["slow_collision"]), [f"{solver}:own"], 0, 1)
    header: dict[str, Any] = {key: HEADER[key] for key in ("seed", "versions", "machine")}
    read_row(f"{solver}:own")
    with writing(tmp_path / "out", SPEED) as store:
        kept_of(plan, header, store).add(TASK, [FAILED])
        assert kept_of(plan, header, store).get(TASK)
        solver.write_text("function integrate(sphere, dt) { }")
        read_row(f"{solver}:own")
        assert kept_of(plan, header, store).get(TASK) is None


def fails() -> None:
    raise AssertionError("done again")


@pytest.mark.parametrize(("quiet", "lines"), [(0.0, 2), (1e9, 0)])
def test_a_log_gets_a_line_now_and_then(
    quiet: float, lines: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(terminal, "QUIET", quiet)
    with Progress() as progress:
        progress.start(2, 2, "error")
        progress.done("error: free_fall")
        progress.done("error: slow_collision")

    assert capsys.readouterr().err.count(" of 2, ") == lines


@pytest.mark.slow
def test_an_interrupted_measurement_is_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    words = ("speed", "free_fall", "--engine", "reference:exercise", "--out", "out")
    with monkeypatch.context() as patch:
        patch.setattr(measure.Measuring, "measure_times", interrupted)
        first = crosscheck(*words, cwd=tmp_path)
    monkeypatch.setattr(ladder, "errors_of", fails)
    second = crosscheck(*words, cwd=tmp_path)

    assert first.returncode == 130
    assert "give the same command again" in first.stderr
    assert second.returncode == 0, second.stderr
    assert len(pd.read_csv(tmp_path / "out" / "speed_errors.csv")) == len(
        QUICK.ladder(scenario("free_fall"))
    )
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def interrupted(*_: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("speed no_such_scene", "scenario 'no_such_scene' is not known"),
        ("speed free_fall --engine pymonk", "did you mean pymunk"),
        ("speed free_fall --out README.md", "is a file"),
        ("speed free_fall --out tests", "which crosscheck did not make"),
        ("advise no_such_scene", "scenario 'no_such_scene' is not known"),
        ("advise free_fall --error 0", "--error '0' is no positive number; write 1% or 0.01"),
        ("advise free_fall --error nan%", "--error 'nan%' is no positive number"),
        ("advise free_fall --for trajctory", "did you mean trajectory?"),
        ("advise free_fall --engine pymonk", "did you mean pymunk"),
    ],
)
def test_bad_input_is_one_clear_sentence(words: str, says: str):
    done = crosscheck(*words.split(), cwd=Path(__file__).parents[3])

    assert (done.returncode, done.stdout) == (2, "")
    assert says in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_scene_without_an_exact_answer_is_refused_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    # what is sent to a worker has to be found there by its name
    monkeypatch.setattr("crosscheck2d.reports.speed.ladder.reason_of", "{} has two outcomes".format)
    done = crosscheck("speed", "cradle_touching", "--out", "out", cwd=tmp_path)

    assert done.returncode == 1
    assert "cradle_touching" in done.stderr
    assert "no exact answer: cradle_touching has two outcomes" in done.stderr
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert files == {".crosscheck.lock", "results.sqlite"}


@pytest.mark.slow
def test_one_scene_and_one_engine_are_measured_by_themselves(tmp_path: Path):
    for _ in range(2):
        words = ("speed", "free_fall", "--engine", "reference", "--out", "out")
        done = crosscheck(*words, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    names = {path.name for path in (tmp_path / "out").iterdir()}
    tables = {"speed.csv", "speed_samples.csv", "speed_errors.csv"}
    assert tables | {"speed.html", "machine.json"} <= names
    assert "speed_figures.csv" not in names
    assert "Noise floor" in done.stdout
    assert POOLED not in set(pd.read_csv(tmp_path / "out" / "speed.csv").scenario)
