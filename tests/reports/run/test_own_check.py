"""A solver's file that plays is checked, too: page, terminal and journal say what `check` says."""

from __future__ import annotations

import csv
import html
from functools import partial
from pathlib import Path

import pytest

from crosscheck2d.adapters.host.engine import row_of_file
from crosscheck2d.reports.check.verdict import check_file
from crosscheck2d.reports.commands.own_solvers import checked, checks_of, lines
from crosscheck2d.reports.run.pool import Failure
from crosscheck2d.reports.run.results import COMMAND
from crosscheck2d.reports.run.store import writing
from crosscheck2d.reports.run.suite import Check, RunTask, check_row, store_result
from crosscheck2d.reports.terminal.progress import Progress
from tests.reports.run.small_runs import read
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import MUTANTS

[FAULTY] = [mutant for mutant in MUTANTS if mutant.name == "normal_long.js"]


def test_a_check_is_that_of_the_text_that_plays(tmp_path: Path):
    path = FAULTY.write(tmp_path)
    name = f"{path}:own"
    task = RunTask("check", "key", name, list, partial(check_row, row_of_file(path).source))
    right = checked(path)
    later = Check(True, ["No fault found."], [], "another text")
    rows = []
    with writing(tmp_path / "out", COMMAND) as store, Progress() as progress:
        progress.start(3, 3)
        for result in (right, later, Failure("timeout", "was stopped")):
            store_result(store, task, result, 60.0, progress)
            rows.append(store.get("check", "key").value)

    assert FAULTY.cause in right.says[0]
    about = {"passed": False, "outside": False}
    assert rows[0] == {"says": right.says, "shown": right.shown} | about
    assert any(line.startswith("exercise: ") for line in right.shown[0])
    assert [row["outside"] for row in rows] == [False, True, True]
    assert [row["passed"] for row in rows] == [False] * 3
    assert "was saved" in rows[1]["says"][0]
    assert "was stopped" in rows[2]["says"][0]


def test_only_solvers_files_are_checked():
    assert list(checks_of(["pymunk:matched", "a/Exercise.js:own"])) == ["a/Exercise.js:own"]


def test_sentences_are_numbered_where_there_are_some():
    assert lines("a.js:own", ["First.", "Second."]) == [
        "a.js, by crosscheck check:",
        "  1. First.",
        "  2. Second.",
    ]
    assert lines("b.js:own", ["No fault found."])[1:] == ["  No fault found."]


@pytest.mark.slow  # a file, checked and asked to play
def test_a_run_says_once_why_a_file_does_not_play(tmp_path: Path):
    path = FAULTY.write(tmp_path)
    words = ["head_on_equal_e05", "--engine", path.name, "--timings", "0", "--out", "out"]
    done = crosscheck("run", *words, cwd=tmp_path)
    reason = "the file has e = 0.9, the scene needs 0.5"

    assert done.returncode == 1
    assert f"{path.name} refused 4 cells: {reason}." in " ".join(done.stdout.split())
    assert (done.stdout + done.stderr).count(reason) == 1
    assert "0 of 0" not in done.stdout
    assert "dt 0.01667 s: unsupported" not in done.stderr
    assert reason in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.long
def test_a_run_says_what_check_says(tmp_path: Path):
    path = FAULTY.write(tmp_path)
    words = ["head_on_equal_e09", "--engine", path.name, "--engine", "pymunk", "--out", "beside"]
    first = check_file(path).sentences[0]
    done = crosscheck("run", *words, cwd=tmp_path)
    page = (tmp_path / "beside" / "report.html").read_text()
    rows = list(csv.DictReader((tmp_path / "beside" / "runs.csv").read_text().splitlines()))
    before = read(tmp_path / "beside").header["seconds"]
    again = crosscheck("run", *words, cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert FAULTY.cause in first
    assert first in " ".join(done.stdout.split())
    assert html.escape(first) in page.replace("&#39;", "'")
    assert "<small>line " in page
    assert f"crosscheck check {path.name}" in page
    assert {row["status"] for row in rows if row["engine"] == path.name} == {"ok"}
    assert again.returncode == 0, again.stderr
    assert read(tmp_path / "beside").header["seconds"] == before  # nothing was done
