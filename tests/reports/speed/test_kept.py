"""What a measurement has got is kept as it ends, and a log says now and then how far it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from reports.run.journal import Journal

from adapters.engines import read_row
from reports.speed import ladder, measure
from reports.speed.command import kept_of
from reports.speed.effort import QUICK
from reports.speed.kept import Kept
from reports.speed.measure import done
from reports.speed.plan import SpeedPlan
from reports.terminal import progress as terminal
from reports.terminal.exits import FolderTaken
from reports.terminal.progress import Progress
from scenarios.catalogue import scenario
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
    """A journal of the same plan gives back every number, infinities too; one of another plan is
    not lost to it."""
    rows = [FAILED]
    with Journal(tmp_path) as journal:
        Kept(journal, HEADER, resume=False).add(TASK, rows)
    with Journal(tmp_path) as journal:
        again = Kept(journal, HEADER, resume=True)
        with Progress() as progress:
            found = dict(done({TASK: fails}, 1, progress, "error", kept=again))

        assert len(again) == 1
        assert found[TASK][0]["error_radii"] == np.inf
        assert np.isnan(found[TASK][0]["change_radii"])
    with Journal(tmp_path) as journal:
        with pytest.raises(
            FolderTaken, match="holds 1 results of an interrupted run of something else"
        ):
            Kept(journal, HEADER | {"seed": 1}, resume=True)
        with pytest.raises(FolderTaken, match="ask again with --resume"):
            Kept(journal, HEADER, resume=False)
    with Journal(tmp_path) as journal:  # nothing was lost by asking
        assert len(Kept(journal, HEADER, resume=True)) == 1


def test_what_was_measured_of_a_solver_that_was_saved_since_is_of_something_else(tmp_path: Path):
    """Its rows would stand beside those of another text under one name."""
    solver = tmp_path / "solver.js"
    solver.write_text("function integrate(sphere, dt) {}")
    plan = SpeedPlan(("slow_collision",), [f"{solver}:own"], QUICK, 0, 1, whole=False)
    header: dict[str, Any] = {key: HEADER[key] for key in ("seed", "versions", "machine")}
    read_row(f"{solver}:own")
    with Journal(tmp_path) as journal:
        kept_of(plan, header, journal, resume=False).add(TASK, [FAILED])
    with Journal(tmp_path) as journal:
        assert len(kept_of(plan, header, journal, resume=True)) == 1
        solver.write_text("function integrate(sphere, dt) { }")
        read_row(f"{solver}:own")
        with pytest.raises(FolderTaken, match="of something else"):
            kept_of(plan, header, journal, resume=True)


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
def test_an_interrupt_keeps_what_has_ended_and_resume_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Ctrl-C where the times begin: exit 130. With --resume no error is looked for a second time;
    else none is lost."""
    words = ("speed", "free_fall", "--engine", "reference:exercise", "--out", "out")
    with monkeypatch.context() as patch:
        patch.setattr(measure.Measuring, "measure_times", interrupted)
        first = crosscheck(*words, cwd=tmp_path)
    unasked = crosscheck(*words, cwd=tmp_path)
    monkeypatch.setattr(ladder, "errors_of", fails)
    second = crosscheck(*words, "--resume", cwd=tmp_path)

    assert first.returncode == 130
    assert "ask again with --resume" in first.stderr
    assert unasked.returncode == 2
    assert "holds 2 results of an interrupted run" in unasked.stderr
    assert second.returncode == 0, second.stderr
    # a ladder, and what its error is made of
    assert "Kept from the interrupted run: 2 tasks." in second.stderr
    assert len(pd.read_csv(tmp_path / "out" / "speed_errors.csv")) == len(
        QUICK.ladder(scenario("free_fall"))
    )
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def interrupted(*_: object) -> None:
    """As Ctrl-C does."""
    raise KeyboardInterrupt
