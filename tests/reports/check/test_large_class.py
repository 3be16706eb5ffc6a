"""A class as it is handed in: names of all kinds, junk, copies, and submissions without a file."""

from __future__ import annotations

import csv
from functools import partial
from pathlib import Path

import pytest

from crosscheck2d.reports.check import command
from crosscheck2d.reports.check.command import checked, named_for
from crosscheck2d.reports.check.verdict import check_file
from tests.bench.class_of_students import LARGEST, STUDENTS
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.class_folder import MISSING, write_class


def test_files_with_the_same_text_are_judged_once_and_named_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Also with Windows' line ends; another text, and a file that is refused, are judged."""
    texts = {"anna": "a = 1\n", "ben": "a = 1\r\n", "cem": "a = 1\n", "dora": "a = 2\n", "eve": ""}
    files = [tmp_path / name / "Exercise.js" for name in texts]
    for file in files:
        file.parent.mkdir()
        file.write_bytes(texts[file.parent.name].encode())
    judged: list[Path] = []

    def here(tasks, *_):
        for key, task in tasks.items():
            assert isinstance(task, partial)
            judged.append(task.args[0])
            yield key, command.FileCheck(task.args[0], [], f"{task.args[0]}: no")

    monkeypatch.setattr(command, "run_all", here)
    checks = checked(files)

    assert [one.parent.name for one in judged] == ["anna", "dora", "eve"]
    assert [one.path for one in checks] == files
    assert [one.refused for one in checks] == [f"{file}: no" for file in files]


@pytest.mark.slow
def test_a_copy_is_told_what_a_check_of_its_own_would_say(tmp_path: Path):
    """All but the seconds that it took."""
    for name in ("anna", "ben"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "Exercise.js").write_text("function integrate(s, dt) { s.x.x += y; }\n")
    first, second = (check_file(tmp_path / name / "Exercise.js") for name in ("anna", "ben"))

    assert named_for(second.path, first).rows == second.rows
    assert named_for(second.path, first).solver == second.solver
    assert first.faults


@pytest.mark.slow
@pytest.mark.parametrize(
    ("students", "missing"),
    # twelve have every name, a copy, and one of all that is handed in instead of a solver
    [(12, 3), pytest.param(4 * MISSING, MISSING, marks=pytest.mark.long)],
)
def test_every_student_has_a_row_whatever_the_folder_holds(
    tmp_path: Path, students: int, missing: int
):
    """Umlauts, spaces, a backslash, junk, copies, an archive, a PDF, an empty file, and nothing;
    the page stays as small as 200 students allow."""
    write_class(tmp_path / "class", students, missing)
    done = crosscheck(
        *("check", "class", "--format", "csv", "--out", "marks.csv", "--page", "class.html"),
        cwd=tmp_path,
    )
    with (tmp_path / "marks.csv").open(newline="", encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    page = tmp_path / "class.html"

    assert done.returncode == 1, done.stderr
    assert len(rows) == students
    assert {row["id"] for row in rows} == {one.name for one in (tmp_path / "class").iterdir()}
    assert sum(row["asked"] == "0" for row in rows) >= students // missing
    assert page.stat().st_size < LARGEST * 1e6 * students / STUDENTS
