"""`crosscheck check CLASS --out DIR`: a class whose check was interrupted goes on where it was."""

from __future__ import annotations

import json
import re
import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path

import pytest

from tests.reports.terminal.command_line import CROSSCHECK, crosscheck, wait_for

STUDENTS = 30
SOLVER = "function integrate(s, dt) { s.x.x += s.v.x * dt; } // "


def checks_in(out: Path) -> dict[str, str]:
    """Key -> digest of its row; the row has the seconds that its check took."""
    with closing(sqlite3.connect(out / "results.sqlite")) as rows:
        return dict(rows.execute("select key, digest from results where kind = 'check'"))


@pytest.fixture
def students(tmp_path: Path) -> Path:
    for k in range(STUDENTS):
        (tmp_path / f"class/s{k}").mkdir(parents=True)
        (tmp_path / f"class/s{k}/Exercise.js").write_text(f"{SOLVER}{k}\n")
    return tmp_path / "class"


@pytest.mark.slow
def test_killed_check_of_a_class_goes_on_where_it_was(students: Path):
    folder, words = students.parent, ["check", "class", "--out", "out"]
    killed = subprocess.Popen([CROSSCHECK, *words], cwd=folder, stderr=subprocess.DEVNULL)
    out = folder / "out"
    wait_for(lambda: (out / "results.sqlite").exists() and len(checks_in(out)) >= 5)
    killed.kill()
    killed.wait()
    before = checks_in(out)
    assert 5 <= len(before) < STUDENTS

    done = crosscheck(*words, cwd=folder)
    assert done.returncode == 1
    after = checks_in(out)
    assert len(after) == STUDENTS
    assert before.items() <= after.items()

    exports = [(out / name).read_text() for name in ("marks.csv", "class.html")]
    assert len(exports[0].splitlines()) == STUDENTS + 1
    again = crosscheck(*words, cwd=folder)
    assert (again.stdout, again.returncode) == (done.stdout, 1)
    assert checks_in(out) == after
    assert [(out / name).read_text() for name in ("marks.csv", "class.html")] == exports

    # the same marks as without a folder, with the random seed that the killed check has chosen
    [seed] = set(re.findall(r",(\d+),s\d+/Exercise.js", exports[0]))
    plain = crosscheck("check", "class", "--seed", seed, "--format", "json", cwd=folder)
    of_row = [
        (file["points"], file["max_points"], file["rows"])
        for file in json.loads(plain.stdout)["files"]
    ]
    kept = crosscheck(*words, "--json", cwd=folder)
    assert of_row == [
        (file["points"], file["max_points"], file["rows"])
        for file in json.loads(kept.stdout)["files"]
    ]

    (students / "s3/Exercise.js").write_text(f"{SOLVER}another\n")
    crosscheck(*words, cwd=folder)
    changed = checks_in(out)
    assert len(changed) == STUDENTS + 1
    assert after.items() <= changed.items()

    crosscheck(*words, "--seed", seed, "--fresh", cwd=folder)
    assert not checks_in(out).items() <= changed.items()


@pytest.mark.parametrize("words", [["class"], ["class/marks"]])
def test_folder_of_results_is_not_in_the_class(words: list[str], students: Path):
    done = crosscheck("check", "class", "--out", *words, cwd=students.parent)
    assert done.returncode == 2
    assert done.stderr == f"--out {words[0]}: is in the class; name a folder elsewhere\n"
