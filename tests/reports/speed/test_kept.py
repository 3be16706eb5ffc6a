"""What a measurement has got is kept as it ends, and a log says now and then how far it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import read_row
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.run.store import writing
from crosscheck2d.reports.speed import ladder, measure
from crosscheck2d.reports.speed.command import SPEED, kept_of
from crosscheck2d.reports.speed.measure import Kept, done
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
        ((_, (row,)),) = done({TASK: fails}, 1, progress, "error", kept=again)
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
    plan = SpeedPlan(("slow_collision",), [f"{solver}:own"], QUICK, 0, 1, whole=False)
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
