"""A cell that fails: the journal has how far it came, and the run names the command that plays it
again."""

import shlex
from pathlib import Path

import pytest

from crosscheck2d.reports.run.archive import Archive
from crosscheck2d.reports.run.journal import Journal
from crosscheck2d.reports.run.suite import carry_out
from crosscheck2d.reports.run.tasks import Means, RunPlan
from crosscheck2d.reports.terminal.progress import Progress
from tests.reports.run.control_engines import CONTROLS, FATAL, Controlled, row
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT

ENGINES = {name: CONTROLS[name] for name in ("aborts:control", "turnstonan:control")} | {
    "good:control": row(Controlled)
}


def test_the_journal_says_how_far_a_cell_came(tmp_path: Path):
    """Step and time of the last good state: of the abort, of the divergence, of the whole."""
    plan = RunPlan(
        ["slow_collision"], ENGINES, seed=0, dts=[1 / 60], full=False, timings=0, command="test"
    )
    with Journal(tmp_path) as journal, Progress() as progress:
        carry_out(plan, Means(workers=2), journal, progress)
    far = {
        record["engine"]: (record["status"], record["step"], record["until_s"])
        for record in Archive.read(tmp_path).records
    }

    assert far["good"] == ("ok", 240, 4.0)
    for engine, status in (("aborts", "crashed"), ("turnstonan", "diverged")):
        assert far[engine] == (status, FATAL - 1, pytest.approx((FATAL - 1) / 60))


@pytest.mark.slow
def test_a_run_names_the_command_that_plays_its_failed_cell_again(tmp_path: Path):
    """The same cell, by its key and how it ended, beside the run, which stays."""
    [solver] = [path.read_text() for path in CORRECT if path.name == "plain.py"]
    broken = solver.replace("sphere.position.x += ", "sphere.position.x += 1 / 0 + ")
    (tmp_path / "my own.py").write_text(broken)
    words = ("run", "slow_collision", "free_fall", "--dt", str(1 / 60), "--seed", "3")
    first = crosscheck(*words, "--engine", "my own.py", "--out", "out", cwd=tmp_path)
    [hint] = [line for line in first.stdout.splitlines() if line.startswith("To play the failure")]
    again = crosscheck(*shlex.split(hint.partition("crosscheck ")[2]), cwd=tmp_path)
    runs = [Archive.read(tmp_path / name).records for name in ("out", "out-again")]

    assert broken != solver
    assert again.returncode == first.returncode == 1
    assert len(runs[0]) == 2
    [cell] = runs[1]
    assert cell["status"] not in ("ok", "unsupported")
    assert (cell["cell"], cell["status"], cell["reason"]) in {
        (one["cell"], one["status"], one["reason"]) for one in runs[0]
    }
