"""A class of solvers in a terminal: a row a file, whatever the students are called and whatever
they handed in."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from crosscheck2d.reports.check import command
from crosscheck2d.reports.check.rows import TASKS
from crosscheck2d.reports.check.terminal import code_only, same_code
from crosscheck2d.reports.check.verdict import Tally, check_file, named
from tests.reports.terminal.command_line import crosscheck, on_terminal
from tests.solvers.mutants import CORRECT, MUTANTS

pytestmark = pytest.mark.slow  # each checks a class of files

RIGHT = next(path for path in CORRECT if path.name == "plain.js")
WRONG = next(mutant for mutant in MUTANTS if mutant.name == "mass_sum.js")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A class of four: one right, one wrong, one that does not load, one that is no text."""
    for name in ("anna", "ben", "cem", "dora"):
        (tmp_path / name).mkdir()
    shutil.copy(RIGHT, tmp_path / "anna" / "Exercise.js")
    WRONG.write(tmp_path / "ben").rename(tmp_path / "ben" / "Exercise.js")
    (tmp_path / "cem" / "Exercise.js").write_text("function integrate( {\n")
    (tmp_path / "dora" / "solver.py").write_bytes(b"\x00\x01")
    return tmp_path


def test_the_table_of_a_class_has_a_line_a_file(folder: Path):
    """A line a file, and how many are right of those that were checked; a link to nothing is
    reported, too."""
    (folder / "eve.js").symlink_to("gone.js")
    done = crosscheck("check", folder, cwd=folder)
    refused = check_file(folder / "eve.js").refused
    (folder / "eve.js").unlink()
    reported = done.stdout.replace("\n", " ")

    total = "5 submissions: 1 without a fault, 1 with a fault, 3 that could not be judged."
    assert total in reported
    assert "In 3 submissions points are not judged: a person decides." in reported
    assert "<-     wrong because of a FAULT to the left of it" in reported
    assert "crosscheck check FILE shows the lines and the numbers of one." in reported
    (eve,) = (line for line in done.stdout.splitlines() if line.startswith("eve.js"))
    assert not {"ok", "FAULT"} & set(eve.split())
    assert refused == f"{folder}/eve.js: is a link to gone.js, which is not there"
    assert "eve.js: is a link to gone.js, which is not there" in reported
    assert "ben/Exercise.js: Task 2c impulse: it divides by (mA + mB)" in re.sub(
        " +", " ", reported
    )
    below = done.stdout.partition("\n\n")[2]  # in a pipe the table is as wide as its names need
    assert max(map(len, below.splitlines())) <= 80
    assert "Traceback" not in done.stderr


def test_a_student_with_a_long_name_and_one_with_an_empty_folder_have_a_row(tmp_path: Path):
    """On a terminal the middle of a name gives way, in a pipe nothing does; the table keeps its
    columns; what was not handed in is reported."""
    for name in ("a" * 70, "b", "with nothing", ".git"):
        (tmp_path / name).mkdir()
    shutil.copy(RIGHT, tmp_path / ("a" * 70) / "Exercise.js")
    (tmp_path / "b" / "solver.py").write_text("")
    done = crosscheck("check", tmp_path, cwd=tmp_path)
    narrow = on_terminal(80, "check", tmp_path, cwd=tmp_path).stdout
    header, long, *_ = lines = done.stdout.splitlines()

    assert header.split() == ["solver", *TASKS, "total", *Tally._fields, "not", "judged"]
    assert long.split() == [f"{'a' * 70}/Exercise.js", *["ok"] * 8, "20", "42"]
    assert not [line for line in lines if line != line.rstrip()]
    assert re.search(r"aaaa…a+/Exercise\.js ", narrow)
    assert [line.split()[:3] for line in lines if line.startswith("with")] == [
        ["with", "nothing", "-"]
    ]
    assert "  with nothing: holds no .js and no .py file" in done.stdout
    total = "3 submissions: 1 without a fault, 0 with a fault, 2 that could not be judged."
    assert total in done.stdout
    assert (done.returncode, ".git" in done.stdout) == (1, False)


def test_copies_in_a_class_are_named_and_others_are_not(folder: Path):
    """A copy with other spaces and lines of comments is the same code; the wrong file is not, and
    neither is a right one that differs only behind a division of whole numbers."""
    (folder / "eve.js").write_text("// mine\n\n" + RIGHT.read_text().replace("  ", "    "))
    checks = [check_file(folder / name) for name in ("anna/Exercise.js", "eve.js")]
    wrong = check_file(folder / "ben" / "Exercise.js")

    assert same_code(folder, [*checks, wrong]) == [["anna/Exercise.js", "eve.js"]]
    assert code_only("x = a // b\n", "#") != code_only("x = a // c\n", "#")


def test_a_folder_beside_the_files_of_a_class_is_nobody(tmp_path: Path):
    """Where solvers lie side by side, a folder of pictures is no student; an empty one, a zip and a
    PDF stand for one."""
    shutil.copy(RIGHT, tmp_path / "anna.js")
    for name in ("pictures", "empty", "zipped"):
        (tmp_path / name).mkdir()
    for name in ("pictures/ufo.png", "zipped/all.zip", "cem.pdf", "dora.ZIP", "marks.csv"):
        (tmp_path / name).write_bytes(b"PK")

    found = command.files_of(tmp_path)

    assert [one.name for one in found] == ["anna.js", "cem.pdf", "dora.ZIP", "empty", "zipped"]
    assert command.others_in(tmp_path, found) == ["marks.csv", "pictures/"]
    refused = check_file(tmp_path / "dora.ZIP").refused
    assert refused.endswith("a solver is a .js or a .py file; unpack it")


def test_every_output_names_what_was_not_read(tmp_path: Path):
    """A text, and a folder without a solver: in the table, printed or written, on the page, in
    JSON; beside the formats that have no place for it, on standard error. A class without such
    files is told nothing."""
    group = tmp_path / "class"
    group.mkdir()
    (group / "pictures").mkdir()
    (group / "pictures" / "ufo.png").write_bytes(b"")
    (group / "anna.js").write_text("x = 1\n")
    (group / "m.txt").write_text("")
    words = ["check", group, "--page", "p.html", "--format", "table", "--out", "t.txt"]
    printed = crosscheck(*words, cwd=tmp_path)
    outputs = {
        name: crosscheck("check", group, "--format", name, cwd=tmp_path)
        for name in ("json", "csv", "junit")
    }
    said = "Not read, as no .js and no .py file: m.txt, pictures/."

    (group / "m.txt").unlink()
    shutil.rmtree(group / "pictures")
    clean = crosscheck("check", group, "--format", "json", cwd=tmp_path)

    assert said in printed.stdout
    assert said in (tmp_path / "t.txt").read_text()
    assert said in (tmp_path / "p.html").read_text()
    assert all(said in done.stderr for done in outputs.values())
    assert json.loads(outputs["json"].stdout)["not_read"] == ["m.txt", "pictures/"]
    assert (json.loads(clean.stdout)["not_read"], "Not read" in clean.stderr) == ([], False)


def test_one_loose_file_hides_no_folder_without_a_solver(tmp_path: Path):
    """Most students have a folder: one that holds none stands among them, whatever else lies
    beside them."""
    for name in ("anna", "ben", "cem"):
        (tmp_path / name).mkdir()
    for path in ("anna/Exercise.js", "ben/Exercise.js", "dora.js"):
        shutil.copy(RIGHT, tmp_path / path)

    assert [path.name for path in command.files_of(tmp_path)] == [
        "Exercise.js",
        "Exercise.js",
        "cem",
        "dora.js",
    ]


def test_what_is_no_solver_is_named(tmp_path: Path):
    """A text beside the files, and what a student's folder holds instead; at most three."""
    shutil.copy(RIGHT, tmp_path / "anna.js")
    for name in ("a.txt", "b.txt", "c.txt", "d.txt", ".hidden"):
        (tmp_path / name).write_text("")

    assert command.others_in(tmp_path, []) == ["a.txt", "b.txt", "c.txt", "d.txt"]
    assert named(command.others_in(tmp_path, [])) == "a.txt, b.txt, c.txt and 1 more"
    (tmp_path / "eva").mkdir()
    (tmp_path / "eva" / "report.pdf").write_text("")
    assert check_file(tmp_path / "eva").refused.endswith(
        "holds no .js and no .py file, only report.pdf"
    )


def test_a_file_that_is_no_solver_is_said_to_be_none_beside_its_marks(tmp_path: Path):
    """The terminal says it, too, and shows no table of no tasks."""
    (tmp_path / "anna.pdf").write_text("")
    done = crosscheck(
        "check", "anna.pdf", "--format", "gradescope", "--out", "results.json", cwd=tmp_path
    )

    assert done.returncode == 1
    assert done.stdout == "anna.pdf: ends in .pdf; a solver is a .js or a .py file\n"
