"""`crosscheck check CLASS --out DIR`: a class whose check was interrupted goes on where it was."""

from __future__ import annotations

import json
import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.reports.run.small_runs import cells_in
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck, wait_for

CORRECT = Path(__file__).parents[2] / "solvers" / "correct"
STUDENTS = 30
SOLVER = "function integrate(s, dt) { s.x.x += s.v.x * dt; } // "


def checks_in(out: Path) -> dict[str, str]:
    """Key -> digest of its row; the row has the seconds that its check took."""
    with closing(sqlite3.connect(out / "results.sqlite")) as rows:
        return dict(rows.execute("select key, digest from results where kind = 'check'"))


def write_class(folder: Path, count: int) -> Path:
    for k in range(count):
        (folder / f"class/s{k}").mkdir(parents=True)
        (folder / f"class/s{k}/Exercise.js").write_text(f"{SOLVER}{k}\n")
    return folder


@pytest.mark.slow
def test_killed_check_of_a_class_goes_on_where_it_was(tmp_path: Path):
    words, out = ["check", "class", "--out", "out"], write_class(tmp_path, STUDENTS) / "out"
    killed = subprocess.Popen([CROSSCHECK, *words], cwd=tmp_path, stderr=subprocess.DEVNULL)
    wait_for(lambda: cells_in(out, "check") >= 5)
    killed.kill()
    killed.wait()
    before = checks_in(out)
    assert 5 <= len(before) < STUDENTS

    done = crosscheck(*words, cwd=tmp_path)
    after = checks_in(out)
    assert (done.returncode, len(after)) == (1, STUDENTS)
    assert before.items() <= after.items()

    exports = [(out / name).read_text() for name in ("marks.csv", "class.html")]
    assert len(exports[0].splitlines()) == STUDENTS + 1
    again = crosscheck(*words, cwd=tmp_path)
    assert (again.stdout, again.returncode, checks_in(out)) == (done.stdout, 1, after)
    assert [(out / name).read_text() for name in ("marks.csv", "class.html")] == exports


@pytest.mark.slow
def test_kept_checks_are_those_of_a_class_without_a_folder(tmp_path: Path):
    write_class(tmp_path, 2)
    (tmp_path / "class/s0/Exercise.js").write_text((CORRECT / "closures.js").read_text())
    (tmp_path / "class/fails").mkdir()
    (tmp_path / "class/fails/Exercise.js").write_text("function integrate(s) { throw 1; }")
    (tmp_path / "class/none.zip").write_bytes(b"")

    def check(*words: str) -> list[dict[str, Any]]:
        done = crosscheck("check", "class", "--json", *words, cwd=tmp_path)
        files: list[dict[str, Any]] = json.loads(done.stdout)["files"]
        return [file | {"seconds": 0} for file in files]

    first = check("--out", "out")
    kept = checks_in(tmp_path / "out")
    assert len(kept) == 3
    assert check("--out", "out") == first  # with the random seed that was kept
    assert check("--seed", str(first[0]["seed"])) == first
    assert checks_in(tmp_path / "out") == kept

    (tmp_path / "class/s1/Exercise.js").write_text(f"{SOLVER}another\n")
    check("--out", "out")
    changed = checks_in(tmp_path / "out")
    assert kept.items() < changed.items()
    assert len(changed) == 4

    check("--out", "out", "--fresh", "--seed", str(first[0]["seed"]))
    fresh = checks_in(tmp_path / "out")
    assert sum(changed[key] != digest for key, digest in fresh.items()) == 3


@pytest.mark.parametrize("out", ["class", "class/marks"])
def test_folder_of_results_is_not_in_the_class(out: str, tmp_path: Path):
    write_class(tmp_path, 1)
    done = crosscheck("check", "class", "--out", out, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == f"--out {out}: is in the class; name a folder elsewhere\n"
