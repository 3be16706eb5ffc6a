"""The check as people, graders and projects see it: command, JSON, JUnit, page, pytest, and the
file as an engine."""

from __future__ import annotations

import csv
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.own_solver.file import read_solver
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.reports.check import command
from crosscheck2d.reports.check.formats import FORMATS, SCHEMA
from crosscheck2d.reports.check.rows import CheckRow
from crosscheck2d.reports.check.smallest import smallest_scene, smallest_scenes
from crosscheck2d.reports.check.smallest_scene import Smallest
from crosscheck2d.reports.check.verdict import check_file
from tests.reports.check.marked import marks_of
from tests.reports.page.browsing import opened, overhang
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck, on_terminal, process
from tests.solvers.mutants import CORRECT, MUTANTS

pytestmark = pytest.mark.slow  # each checks whole files

RIGHT = next(path for path in CORRECT if path.name == "plain.js")
WRONG = next(mutant for mutant in MUTANTS if mutant.name == "mass_sum.js")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A class of four: one right, one wrong, one that does not load, one that is no text."""
    where = tmp_path_factory.mktemp("class")
    for name in ("anna", "ben", "cem", "dora", ".hidden"):
        (where / name).mkdir()
    shutil.copy(RIGHT, where / "anna" / "Exercise.js")
    WRONG.write(where / "ben").rename(where / "ben" / "Exercise.js")
    (where / "cem" / "Exercise.js").write_text("function integrate( {\n")
    (where / "dora" / "solver.py").write_bytes(b"\x00\x01")
    (where / "anna" / "gl-matrix.js").write_text("handed out, no solver")
    (where / ".hidden" / "x.js").write_text("none of ours")
    return where


@pytest.fixture(scope="module")
def checked(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any, Path]:
    """How the command ends, as a process, for the right file and for the wrong one, and where it
    was given."""
    where = tmp_path_factory.mktemp("here")
    right, wrong = (
        process("check", folder / who / "Exercise.js", cwd=where) for who in ("anna", "ben")
    )
    return right, wrong, where


def test_a_right_solver_exits_0_and_a_wrong_one_1_with_the_cause_first(
    checked: tuple[Any, Any, Path],
):
    """The first line is the sentence to begin with; the page, and it alone, is where the command
    was given."""
    right, wrong, where = checked

    assert (right.returncode, wrong.returncode) == (0, 1)
    assert right.stdout.startswith("No fault found")
    assert wrong.stdout.replace("\n", " ").startswith("1. Task 2c impulse: it divides by (mA + mB)")
    assert [path.name for path in where.iterdir()] == ["check.html"]


def test_the_terminal_tells_faults_from_free_choices_by_a_word_and_shows_the_line(
    checked: tuple[Any, Any, Path],
):
    """Without any colour: faults before free choices, each row with its verdict; the line and the
    formula below the sentence. Where there is no fault, nothing is said to be expected."""
    right, wrong = (done.stdout for done in checked[:2])
    said = " ".join(wrong.split())

    assert "line 63 var J = -(1 + restitution) * vn / (sphereA.mass + sphereB.mass);" in said
    assert "exercise J = -(1 + e) (vA - vB).n / (n.n (1/mA + 1/mB)), e = 0.9" in said
    assert wrong.index("1. Task 2c") < wrong.index("Free choices. The exercise leaves them open")
    assert said.count("it divides by (mA + mB)") == 1, "a fault is named once"
    assert "seen in What impulse does A get from B, for masses of 1.3 and 5.1 kg? Got:" in said
    assert "These follow from the faults above: whole scenes (head_on" in said
    assert "  free choice  2a  just touching: the comparison is <" in right
    assert "expected" not in right
    assert max(map(len, wrong.splitlines())) <= 80


@pytest.mark.slow
@pytest.mark.parametrize("columns", [pytest.param(80, marks=pytest.mark.long), 60])
def test_a_check_of_one_file_says_what_it_does_meanwhile(folder: Path, columns: int):
    """It takes seconds: the file, then the search for a scene; gone at the end, and in a pipe."""
    words = ("check", "ben/Exercise.js", "--page", "p.html")
    done = on_terminal(columns, *words, cwd=folder)
    piped = crosscheck(*words, cwd=folder)

    assert "checking Exercise.js" in done.stdout
    assert "looking for the smallest scene" in done.stdout
    assert not re.search("checking|looking for", piped.stdout + piped.stderr)


def test_a_class_is_a_row_a_file_and_one_bad_file_stops_nothing(folder: Path):
    """JSON of a folder: four files in order, as the schema says; what is no text is refused with
    its reason."""
    done = crosscheck("check", folder, "--json", "--junit", folder / "class.xml", cwd=folder)
    reported = json.loads(done.stdout)

    jsonschema.validate(reported, json.loads(SCHEMA.read_text()))
    assert done.returncode == 1
    assert [(Path(one["file"]).parent.name, one["passed"]) for one in reported["files"]] == [
        ("anna", True),
        ("ben", False),
        ("cem", False),
        ("dora", False),
    ]
    assert "SyntaxError" in reported["files"][2]["sentences"][0]
    assert "is not text" in reported["files"][3]["refused"]
    suites = ElementTree.parse(folder / "class.xml").getroot()
    assert [int(s.get("failures", "")) > 0 for s in suites] == [False, True, True, False]
    assert [s.get("errors") for s in suites] == ["0", "0", "0", "1"]
    assert [len(s.findall("testcase")) for s in suites] == [int(s.get("tests", "")) for s in suites]
    assert {one.get("classname") for one in suites[0].findall("testcase")} == {"anna"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["nobody.js"],
            "nobody.js: is not there; name an Exercise.js, a solver.py or a folder of them",
        ),
        ([""], '"": is not there; name a file or a folder'),
        (["anna/Exercise.js", "--page", ""], '"": is not there; name a file or a folder'),
        (["class.txt"], "a solver is a .js or a .py file"),
        (["empty"], "holds no .js and no .py file"),
        (["zipped"], "zipped: holds no .js and no .py file, only exercise.zip"),
        (
            ["anna/Exercise.js", "--junit", "no/such/x.xml"],
            "--junit no/such/x.xml: No such file or directory",
        ),
        (
            ["anna/Exercise.js", "--page", "class.txt"],
            "class.txt: exists and is no page of a check; name another file",
        ),
        (
            ["anna/Exercise.js", "--page", "no/x.html"],
            "--page no/x.html: No such file or directory; name another file",
        ),
        (
            ["anna/Exercise.js", "--page", "empty"],
            "--page empty: Is a directory; name another file",
        ),
        (
            [".", "--junit", "class.txt"],
            "--junit class.txt: exists and is no JUnit file of a check; name another file",
        ),
        (
            ["anna/Exercise.js", "--junit", "anna/Exercise.js"],
            "Exercise.js: exists and is no JUnit file of a check",
        ),
        (
            ["anna/Exercise.js", "--junit", "./check.html"],
            "--junit check.html: is where the page goes",
        ),
        (
            [".", "--format", "xlsx"],
            "--format xlsx: is none of table, json, junit, gradescope, csv",
        ),
        (
            [".", "--format", "csv", "--format", "junit", "--out", "a"],
            "--format is given 2 times, --out 1 time; give each --format an --out",
        ),
        ([".", "--out", "a.csv"], "--format is given 0 times, --out 1 time"),
        ([".", "--json", "--format", "csv"], "one of them can be printed"),
        (
            [".", "--format", "csv", "--out", "a", "--format", "json", "--out", "./a"],
            "--out a: is named twice; name another file",
        ),
        (
            [".", "--format", "csv", "--out", "class.txt"],
            "--out class.txt: exists and is no csv file of a check; name another file",
        ),
        (
            ["anna", "--format", "gradescope", "--out", "anna/Exercise.js"],
            "Exercise.js: exists and is no gradescope file of a check",
        ),
        ([".", "--format", "csv", "--out", "no/a.csv"], "--out no/a.csv: No such file"),
        ([".", "--format", "csv", "--out", "empty"], "--out empty: Is a directory"),
        ([".", "--points", "no.toml"], "--points no.toml: No such file or directory"),
        ([".", "--points", "class.txt"], "--points class.txt: is not TOML"),
        ([".", "--points", "empty"], "--points empty: Is a directory"),
        ([".", "--id-pattern", "("], "--id-pattern (: is no regular expression: missing )"),
        ([".", "--hints", "some"], "--hints some: is none of full, low"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_2(folder: Path, words: list[str], message: str):
    """No traceback, whatever is asked for."""
    (folder / "class.txt").write_text("mine")
    (folder / "empty").mkdir(exist_ok=True)
    (folder / "zipped").mkdir(exist_ok=True)
    (folder / "zipped" / "exercise.zip").write_bytes(b"PK")
    with mock.patch.object(command, "checked", side_effect=command.checked) as asked:
        done = crosscheck("check", *words, cwd=folder)

    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert (folder / "class.txt").read_text() == "mine"
    assert (folder / "anna" / "Exercise.js").read_text() == RIGHT.read_text()
    assert not any("anna" in str(call) for call in asked.call_args_list), (
        "nothing is checked before it is refused"
    )


def test_a_junit_file_of_an_earlier_check_is_written_over_and_a_page_is_not(folder: Path):
    """Each kind knows its own; neither takes the other's place."""
    (folder / "none.py").write_text("x = 1\n")
    first, again = (
        crosscheck("check", "none.py", "--json", "--junit", "r.xml", cwd=folder) for _ in range(2)
    )
    other = crosscheck("check", "none.py", "--json", "--page", "r.xml", cwd=folder)
    (folder / "none.py").unlink()

    assert (first.returncode, again.returncode, other.returncode) == (1, 1, 2)
    assert ElementTree.parse(folder / "r.xml").getroot().get("name") == "crosscheck check"


def test_marks_of_a_class_are_written_in_several_formats_at_once(folder: Path, tmp_path: Path):
    """A row a student; a second time over its own files. What is in files is not printed: only
    how many have a fault."""
    words = ["check", folder, "--format", "csv", "--out", "m.csv", "--format", "json"]
    words += ["--out", "m.json", "--format", "table", "--out", "m.txt", "--id-pattern", "^a"]
    for _ in range(2):
        done = crosscheck(*words, cwd=tmp_path)
    rows = list(csv.DictReader((tmp_path / "m.csv").open()))
    handed_in = [row for row in rows if row["file"].endswith((".js", ".py"))]

    assert done.returncode == 1
    assert [row["id"] for row in handed_in] == ["a", "ben", "cem", "dora"]
    assert [row["total"] for row in handed_in] == ["20", "17", "0", "0"]
    assert "is not text" in handed_in[3]["begin with"]
    assert [one["id"] for one in json.loads((tmp_path / "m.json").read_text())["files"]] == [
        row["id"] for row in rows
    ]
    table = (tmp_path / "m.txt").read_text()
    assert table.startswith("crosscheck check\n\nsolver")
    assert done.stdout.splitlines() == table.splitlines()[-len(done.stdout.splitlines()) :]
    assert len(done.stdout.splitlines()) <= 4
    assert "without a fault" in done.stdout
    assert "ben" in table
    assert "--id-pattern does not match" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.csv", "m.json", "m.txt"]


def test_a_submission_is_a_file_or_its_folder_and_is_always_answered(folder: Path):
    """The file that is named as the exercise says, with the names of the others; none, or several,
    is said to the student."""
    (folder / "ben" / "old.js").write_text("x = 1\n")
    shutil.copytree(folder / "ben", folder / "fay")
    (folder / "fay" / "solver.py").write_text("x = 1\n")
    (folder / "none").mkdir()
    words = ("--format", "gradescope")
    done = [crosscheck("check", name, *words, cwd=folder) for name in ("ben", "none", "fay")]
    of_class = crosscheck("check", folder, "--json", cwd=folder)
    (folder / "ben" / "old.js").unlink()
    (folder / "none").rmdir()
    shutil.rmtree(folder / "fay")
    ben, none, several = (json.loads(one.stdout) for one in done)
    rows = {one["id"]: one for one in json.loads(of_class.stdout)["files"]}

    assert [one.returncode for one in done] == [1, 1, 1]
    assert (ben["score"], ben["extra_data"]["id"]) == (17.0, "ben")
    assert ben["output"].endswith("Exercise.js is judged; not judged: old.js.")
    assert (none["score"], none["output"]) == (0.0, "holds no .js and no .py file")
    assert several["output"].startswith("holds 3 solvers: Exercise.js, old.js, solver.py; hand in")
    # a class has the same rule, and one row a student
    assert {"anna", "ben", "cem", "dora", "fay", "none"} <= set(rows)
    assert len(rows) == len(json.loads(of_class.stdout)["files"])
    assert rows["ben"]["points"] == 17.0
    assert "ben/old.js" in json.loads(of_class.stdout)["not_read"]
    assert "holds 3 solvers" in rows["fay"]["refused"]


def test_a_submission_with_folders_in_it_is_always_answered(tmp_path: Path):
    """In every format of an autograder: of older versions the file above them is judged; where no
    file is above the others, the results name all, and the one to hand in."""
    for where in ("v1", "v2"):
        (tmp_path / "dora" / where).mkdir(parents=True)
        WRONG.write(tmp_path / "dora" / where).rename(tmp_path / "dora" / where / "Exercise.js")
    kinds = [name for name, kind in FORMATS.items() if kind.single]

    def results() -> tuple[int, str, dict[str, Any]]:
        words = [word for kind in kinds for word in ("--format", kind, "--out", f"{kind}.json")]
        done = crosscheck("check", "dora", *words, cwd=tmp_path)
        texts = {kind: (tmp_path / f"{kind}.json").read_text() for kind in kinds}
        return done.returncode, done.stderr, {kind: json.loads(texts[kind]) for kind in kinds}

    status, said, several = results()
    shutil.copy(RIGHT, tmp_path / "dora" / "Exercise.js")
    judged_status, _, judged = results()
    why = "holds 2 solvers: v1/Exercise.js, v2/Exercise.js; hand in one, named Exercise.js or"

    assert status == 1
    assert "dora: holds several solvers; for a class: --format csv" in said
    assert several["gradescope"]["output"].startswith(why)
    assert several["gradescope"]["score"] == 0
    assert judged_status == 0
    assert judged["gradescope"]["score"] == 20
    assert judged["gradescope"]["output"].endswith(
        "Exercise.js is judged; not judged: v1/Exercise.js, v2/Exercise.js."
    )


@pytest.mark.slow
def test_pytest_runs_the_rows_as_tests(folder: Path):
    """In a folder without any project: a right file passes, a wrong one fails with the numbers,
    junk is refused."""
    (folder / "own").mkdir(exist_ok=True)
    right, wrong, junk = (
        subprocess.run(
            [
                CROSSCHECK.parent / "pytest",
                "-q",
                "-p",
                "no:cacheprovider",
                "--solver",
                folder / path,
            ],
            cwd=folder / "own",
            capture_output=True,
            text=True,
            timeout=120,
        )
        for path in ("anna/Exercise.js", "ben/Exercise.js", "dora/solver.py")
    )

    assert (right.returncode, wrong.returncode, junk.returncode) == (0, 1, 4)
    assert "passed" in right.stdout
    assert "likely: it divides by (mA + mB) instead of (1/mA + 1/mB)" in wrong.stdout
    assert "is not text" in junk.stderr + junk.stdout


@pytest.fixture(scope="module")
def smallest(folder: Path) -> Smallest:
    """The smallest scene that shows the wrong file's fault."""
    with SolverProcess(read_solver(folder / "ben" / "Exercise.js")) as process:
        found = smallest_scene(process, 0.9)
    assert found is not None
    return found


def test_the_smallest_scene_has_two_spheres_and_shows_the_fault(smallest: Smallest):
    """A fault of the impulse needs two; yours and the exact answer part."""
    assert smallest.scenario.scene.n == 2
    assert "m/s after it, not" in smallest.fault
    assert smallest.right is not None
    assert smallest.right_is == "the exact answer"
    assert abs(smallest.yours.position[-1] - smallest.right.position[-1]).max() > 0.005


def test_the_old_velocity_is_shown_beside_the_formulas_and_not_beside_the_exact_answer(
    tmp_path: Path,
):
    """From the exact place v0 t + a t2 / 2 both orders are a t dt / 2 away; from the formulas'
    place only the wrong one is away, by a t dt."""
    (mutant,) = (one for one in MUTANTS if one.name == "explicit_euler.js")
    with SolverProcess(read_solver(mutant.write(tmp_path))) as process:
        one = smallest_scene(process, 0.9, part="place")
    assert one is not None
    assert one.right is not None
    (thrust,), scene, t = one.scenario.thrusts, one.scenario.scene, one.scenario.duration
    a = thrust.force / scene.mass[0]
    exact = scene.position[0] + scene.velocity[0] * t + a * t * t / 2
    right, yours = one.right.position[-1, 0], one.yours.position[-1, 0]

    assert one.right_is == "the exercise's formulas in steps of 0.01 s"
    assert np.allclose(right - yours, a * t * 0.01, rtol=1e-9)  # sums of 100 steps
    assert np.allclose(right - exact, exact - yours, rtol=1e-9)
    assert f"not at ({right[0]:.4g}, {right[1]:.4g}) m" in one.fault


@pytest.mark.slow
def test_each_fault_has_a_scene_that_shows_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A wrong angle in a flight of one sphere, a wrong overlap in a pair; faults of one kind share
    theirs."""
    monkeypatch.setattr(
        "crosscheck2d.reports.check.smallest.SECONDS", 0.0
    )  # those that are tried first suffice
    text = RIGHT.read_text().replace("sphere.alpha += ", "sphere.alpha -= ")
    (tmp_path / "two.js").write_text(text.replace("nx * overlap / 2", "nx * overlap"))
    with SolverProcess(read_solver(tmp_path / "two.js")) as process:
        found = smallest_scenes(process, 0.9, faults_in("1", "2b", "2c", "2d", "loop"))

    assert [(one.of, one.scenario.scene.n) for one in found] == [((1,), 1), ((2,), 2)]
    assert "is turned by" in found[0].fault
    assert "their centres are" in found[1].fault


def faults_in(*tasks: str) -> list[CheckRow]:
    """A fault in each of these tasks."""
    return [CheckRow("a row", task, "", "", "", "fault", "a cause") for task in tasks]


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("two_e_and_b_sign.js", [(1, 2)]),
        pytest.param("mass_sum.js", [], marks=pytest.mark.slow),
        pytest.param("b_mass.js", [], marks=pytest.mark.slow),
    ],
)
def test_a_scene_is_credited_to_two_faults_only_if_it_shows_both(
    name: str, shown: list[tuple[int, ...]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Two faults in the velocities after a collision: neither sphere gets the right impulse, and
    both together get one. A file that has only one of them has no such scene."""
    monkeypatch.setattr(
        "crosscheck2d.reports.check.smallest.SECONDS", 0.0
    )  # those that are tried first suffice
    (mutant,) = (mutant for mutant in MUTANTS if mutant.name == name)
    with SolverProcess(read_solver(mutant.write(tmp_path))) as process:
        found = smallest_scenes(process, 0.9, faults_in("2c", "2d"))

    assert [one.of for one in found] == shown
    assert all("together they get" in one.fault for one in found)


def test_a_busy_machine_finds_a_failing_scene_too(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """Without any time to draw scenes, a pair that collides is tried."""
    monkeypatch.setattr("crosscheck2d.reports.check.smallest.SECONDS", 0.0)
    with SolverProcess(read_solver(folder / "ben" / "Exercise.js")) as process:
        found = smallest_scene(process, 0.9)

    assert found is not None
    assert found.scenario.scene.n == 2


def test_a_right_solver_has_no_failing_scene():
    """The negative control of the search: nothing is found in what is right."""
    with SolverProcess(read_solver(RIGHT)) as process:
        assert smallest_scene(process, 0.9) is None


@pytest.mark.slow
def test_the_page_shows_both_motions_and_asks_nothing_of_anywhere(
    browser: Browser, folder: Path, smallest: Smallest
):
    """Opened from the file, at two widths: both layers move, nothing overflows, no error, no
    request."""
    from crosscheck2d.reports.check.page import write_page

    page_path = folder / "page.html"
    (marked,) = marks_of(check_file(folder / "ben" / "Exercise.js"))
    write_page(page_path, replace(marked, scenes=[smallest]))
    page, heard = opened(browser, page_path.as_uri(), viewport={"width": 1280, "height": 800})
    page.wait_for_function("players[1]")
    at_end = "name => { players[1].seek(1); return players[1].positions(name); }"
    shown = {name: page.evaluate(at_end, name) for name in ("Exercise.js:own", "truth")}
    title = page.locator("h1").inner_text()
    groups = page.locator("h2").all_inner_texts()
    evidence = page.locator("#findings li, #findings p").first.inner_text().replace("\n", " ")
    causes = page.locator("section.fault .rows .note").all_inner_texts()
    wide = overhang(page)
    page.set_viewport_size({"width": 400, "height": 800})
    narrow = overhang(page)
    page.emulate_media(media="print")
    shown_on_paper = [
        page.locator(f"section.scene {one}").is_visible() for one in ("canvas", ".clock", ".play")
    ]
    page.context.close()

    assert heard == []
    assert (wide <= 0, narrow <= 0) == (True, True)
    assert shown_on_paper == [True, True, False]
    assert groups[1:] == [
        "Faults",
        "Follows from the faults",
        "Free choices",
        "Right",
        "Not asked",
    ]
    assert causes[0].startswith("→ fault 1")
    assert "var J = -(1 + restitution) * vn / (sphereA.mass + sphereB.mass);" in evidence
    assert "exercise J = -(1 + e) (vA - vB).n / (n.n (1/mA + 1/mB))" in evidence
    assert title == "Exercise.js: what is wrong, and where"
    assert shown["truth"] is not None
    assert max(abs(x - y) for x, y in zip(shown["Exercise.js:own"][0], shown["truth"][0])) > 0.004


def test_text_of_a_file_is_inert_on_its_page(tmp_path: Path):
    """A message that holds markup is shown as it is."""
    from crosscheck2d.reports.check.page import write_page

    path = tmp_path / "evil.js"
    path.write_text("throw new Error('<script>alert(1)</script>')")
    write_page(tmp_path / "check.html", *marks_of(check_file(path)))

    assert "<script>alert" not in (tmp_path / "check.html").read_text()
