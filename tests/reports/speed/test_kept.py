"""What a measurement has got is kept as it ends, and a log says now and then how far it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import read_row
from crosscheck2d.reports.run.cells import about
from crosscheck2d.reports.run.store import writing
from crosscheck2d.reports.speed import ladder, measure
from crosscheck2d.reports.speed.command import SPEED, kept_of
from crosscheck2d.reports.speed.effort import QUICK
from crosscheck2d.reports.speed.kept import Kept
from crosscheck2d.reports.speed.measure import done
from crosscheck2d.reports.speed.plan import SpeedPlan
from crosscheck2d.reports.terminal import progress as terminal
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.terminal.command_line import crosscheck

TASK = ("error", "scene", "slow_collision", 0, "reference:exercise", "", 1)
FAILED = {
    "scenario": "slow_collision",
    "seed": 0,
    "engine": "reference",
    "profile": "exercise",
    "dt_s": scenario("slow_collision").dt(1),
    "substeps": 1,
    "status": "error",
    "reason": "no",
    "until_s": 0.5,
    "duration_s": scenario("slow_collision").duration,
    "error_radii": np.inf,
    "change_radii": np.nan,
}
HEADER: dict[str, Any] = {
    "scenes": ["slow_collision"],
    "files": {},
    "engines": ["reference:exercise"],
    "effort": {},
    "whole": False,
    "seed": 0,
    "versions": {},
    "machine": {"system": "", "architecture": "", "processor": "", "cores": 1},
}


def test_what_has_ended_is_not_measured_again(tmp_path: Path):
    """Of the same plan every number is used again, infinities too; of another plan none, and
    nothing of either is lost."""
    with writing(tmp_path / "out", SPEED) as store, Progress() as progress:
        Kept(store, HEADER).add(TASK, [FAILED])
        again = Kept(store, HEADER)
        found = dict(done({TASK: fails}, 1, progress, "error", kept=again))
        other = Kept(store, HEADER | {"seed": 1})

        assert found[TASK][0]["error_radii"] == np.inf
        assert np.isnan(found[TASK][0]["change_radii"])
        assert TASK not in other
        other.add(TASK, [])
        assert (again[TASK][0]["status"], other[TASK]) == ("error", [])


def test_a_new_measurement_is_not_older_than_its_command(tmp_path: Path):
    """Both times are texts of one form: "12:00:00+" is less than "12:00:00.5+"."""
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
        assert TASK in kept_of(plan, header, store)
        solver.write_text("function integrate(sphere, dt) { }")
        read_row(f"{solver}:own")
        assert TASK not in kept_of(plan, header, store)


def fails() -> None:
    """Must not be called."""
    raise AssertionError("done again")


@pytest.mark.parametrize(("quiet", "lines"), [(0.0, 2), (1e9, 0)])
def test_a_log_gets_a_line_now_and_then(
    quiet: float, lines: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    """A bar is not drawn into a file, and a line a task would be too many: so much time lies
    between two."""
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
    """Ctrl-C where the times begin: exit 130; the same command looks for no error a second time."""
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
    """As Ctrl-C does."""
    raise KeyboardInterrupt
