"""The autograder for Gradescope, in a folder that stands for its machine."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from crosscheck2d.reports.check.points import DEFAULT
from tests.reports.check.test_outputs import RIGHT, WRONG
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck


def test_a_scaffold_is_written_to_an_empty_folder_only(tmp_path: Path):
    """Its scripts can be executed; somebody's folder is kept; one sentence and exit 2."""
    first, again = (
        crosscheck("check", "--scaffold", "gradescope", "new", "--hints", "low", cwd=tmp_path)
        for _ in range(2)
    )
    other = crosscheck("check", "--scaffold", "moodle", "x", cwd=tmp_path)
    (tmp_path / "bad.toml").write_text("1 = -1")
    bad = crosscheck("check", "--scaffold", "gradescope", "x", "--points", "bad.toml", cwd=tmp_path)
    files = {path.name: os.access(path, os.X_OK) for path in (tmp_path / "new").iterdir()}

    assert [one.returncode for one in (first, again, other, bad)] == [0, 2, 2, 2]
    assert again.stderr == "new: is there and not empty; name another folder\n"
    assert other.stderr == "--scaffold moodle: must be gradescope\n"
    assert "task 1: -1 is no number of points" in bad.stderr
    assert {name for name, runs in files.items() if runs} == {"setup.sh", "run_autograder"}
    assert (tmp_path / "new" / "tasks.toml").read_text() == DEFAULT.read_text()
    assert "--hints low" in (tmp_path / "new" / "run_autograder").read_text()
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_the_autograder_answers_every_submission(tmp_path: Path):
    """A right file, a wrong one, none at all: results each time, and no failure of the grader; a
    bad grader fails."""
    crosscheck("check", "--scaffold", "gradescope", "source", cwd=tmp_path)
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    (tmp_path / "venv" / "bin" / "crosscheck").symlink_to(CROSSCHECK)
    submission = tmp_path / "submission"
    submission.mkdir()
    scores = []
    for text in (RIGHT.read_text(), WRONG.write(submission).read_text(), None):
        shutil.rmtree(submission)
        submission.mkdir()
        if text is not None:
            (submission / "Exercise.js").write_text(text)
        status = run(tmp_path)
        results = json.loads((tmp_path / "results" / "results.json").read_text())
        scores.append((status, results["score"]))
    (tmp_path / "source" / "tasks.toml").write_text("1 = -1")

    assert scores == [(0, 20.0), (0, 17.0), (0, 0.0)]
    assert run(tmp_path) != 0
    assert not (tmp_path / "results" / "results.json").exists(), "no results of another submission"


def run(home: Path) -> int:
    """The exit status of run_autograder in a folder that stands for /autograder."""
    return subprocess.run(
        [home / "source" / "run_autograder"],
        env=os.environ | {"AUTOGRADER": str(home)},
        capture_output=True,
        timeout=120,
    ).returncode


def test_the_scaffold_fetches_gl_matrix_while_it_is_built(tmp_path: Path):
    """By npm, which the extra js brings, into the cache that the check reads later: where students
    are graded there is no network."""
    crosscheck("check", "--scaffold", "gradescope", "new", cwd=tmp_path)
    built, run_later = (
        (tmp_path / "new" / name).read_text(encoding="utf-8")
        for name in ("setup.sh", "run_autograder")
    )

    assert re.search(r'"\$\(echo \S*crosscheck2d-\*\.whl\)\[js\]"', built)
    assert '-c "from crosscheck2d.adapters.npm_packages import fetch; fetch()"' in built
    assert all(re.search(r'CROSSCHECK_CACHE="?\$home/cache', one) for one in (built, run_later))
