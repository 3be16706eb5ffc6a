"""A solver's file that is saved, or gone, while it is played: what was read is played, and kept as
what it was."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.adapters.host import process as solver_process
from crosscheck2d.adapters.host.engine import row_of_file
from crosscheck2d.adapters.host.file import LARGEST, NotASolver, read_solver
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.check.command import make_page, scenes_of
from crosscheck2d.reports.check.verdict import check_file
from crosscheck2d.reports.run import suite
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import play_here
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import reading
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.check.marked import marks_of
from tests.reports.run.small_runs import read
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT

TEXTS = {
    path.name: path.read_text()
    for path in CORRECT
    if path.name in ("plain.js", "plain.py", "arrays.py")
}
# A flight twice as fast: of a number that is in the file, in a module beside it, or compiled by
# numba.
FASTER = {
    "plain.js": ("sphere.position.x += ", "sphere.position.x += 2 * "),
    "plain.py": ("sphere.position.x += ", "sphere.position.x += 2 * "),
    "arrays.py": ("disks.position[moves] += ", "disks.position[moves] += 2 * "),
}
BESIDE = TEXTS["plain.py"].replace(
    "sphere.position.x += ", "sphere.position.x += helper.factor() * "
)
COMPILED = (
    "\nimport helper\nfrom numba import njit\n\n@njit(cache=True)\ndef factor():\n    return {}\n"
)
WORDS = ["run", "head_on_equal_e09", "--dt", str(1 / 60)]


def place(folder: Path, file: str, factor: int) -> Path:
    if file in TEXTS:
        old, new = FASTER[file]
        assert old in TEXTS[file]
        (folder / file).write_text(TEXTS[file].replace(old, new) if factor == 2 else TEXTS[file])
        return folder / file
    (folder / "helper.py").write_text(f"def factor():\n    return {factor}\n")
    if file == "compiled":
        (folder / "solver.py").write_text(BESIDE.replace("helper.", "") + COMPILED.format(factor))
    elif file == "compiled beside":
        compiled = COMPILED.format("helper.factor()")
        (folder / "solver.py").write_text(BESIDE.replace("helper.", "") + compiled)
        (folder / "helper.py").write_text(
            f"from numba import njit\n\n@njit\ndef factor():\n    return {factor}\n"
        )
    else:
        (folder / "solver.py").write_text("import helper\n" + BESIDE)
    return folder / "solver.py"


MARKS = {"plain.py": (), "plain.js": pytest.mark.slow, "compiled beside": pytest.mark.slow}
SAVED = [
    pytest.param(file, marks=MARKS.get(file, pytest.mark.long))
    for file in (*TEXTS, "beside", "compiled", "compiled beside")
]


def played(row) -> Run:
    engine, question = row.make(), scenario("head_on_equal_e09")
    run = play(engine, "x:own", question, question.dt(1))
    engine.close()
    assert run.status == "ok", run.reason
    return run


@pytest.mark.parametrize("file", SAVED)
def test_the_text_that_was_read_is_played_whatever_is_saved_since(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str
):
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path / "cache"))
    before = row_of_file(place(tmp_path, file, 1))
    after = row_of_file(place(tmp_path, file, 2))
    first, second, again = played(before), played(after), played(before)

    at_start = [
        run.trajectory.position[1] - run.trajectory.position[0] for run in (first, second, again)
    ]
    # by the rounding of a difference of positions
    assert np.allclose(at_start[1], 2 * at_start[0], rtol=1e-9)
    assert np.array_equal(at_start[0], at_start[2])
    assert before.source != after.source


@pytest.mark.slow
@pytest.mark.parametrize("file", ["compiled", "compiled beside"])
def test_what_numba_keeps_would_be_taken_for_another_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str
):
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(solver_process, "kept_copies", lambda solver, _: solver.path.parent)
    before = row_of_file(place(tmp_path, file, 1))
    after = row_of_file(place(tmp_path, file, 2))
    first, second = played(before), played(after)

    assert np.array_equal(first.trajectory.position, second.trajectory.position)


COUNTS = {
    "counts.js": """
var calls = 0;
function integrate(sphere, dt) { sphere.position.x += 1e-3 * ++calls; }
function sphereSphereCollisionHandling(a, b) {}
""",
    "counts.py": """
calls = 0
def integrate(sphere, dt):
    global calls
    calls += 1
    sphere.position.x += 1e-3 * calls
def sphereSphereCollisionHandling(a, b): pass
""",
}


@pytest.mark.parametrize("file", COUNTS)
def test_what_a_file_has_kept_is_gone_in_the_next_cell_of_a_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str
):
    started = Counter()
    begin = solver_process.SolverProcess.begin
    monkeypatch.setattr(
        solver_process.SolverProcess, "begin", lambda self: (started.update([file]), begin(self))
    )
    (tmp_path / file).write_text(COUNTS[file])
    row = row_of_file(tmp_path / file)
    cell = Cell("head_on_equal_e09", 0, "x:own", 1)
    question = replace(scenario(cell.scene), truth=None)
    with solver_process.processes_reused():
        first, second = (play_here(cell, row, question) for _ in range(2))

    assert first.run.status == "ok", first.run.reason
    assert first.file == second.file
    assert started[file] == 1


@pytest.mark.long
@pytest.mark.parametrize("file", ["plain.js", "plain.py", "beside"])
def test_a_file_that_is_saved_during_a_run_is_kept_as_what_was_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str
):
    path = place(tmp_path, file, 1)
    meanwhile(monkeypatch, lambda: place(tmp_path, file, 2))
    assert crosscheck(*WORDS, "--engine", path.name, "--out", "out", cwd=tmp_path).returncode == 0
    old = flight(tmp_path / "out")
    monkeypatch.undo()
    assert crosscheck(*WORDS, "--engine", path.name, "--out", "out", cwd=tmp_path).returncode == 0
    assert crosscheck(*WORDS, "--engine", path.name, "--out", "fresh", cwd=tmp_path).returncode == 0

    assert len(old[0]) == 1
    assert flight(tmp_path / "out") == flight(tmp_path / "fresh")
    assert flight(tmp_path / "out") != old


@pytest.mark.slow
@pytest.mark.parametrize("file", ["plain.js", pytest.param("beside", marks=pytest.mark.long)])
def test_a_file_that_vanishes_during_a_run_is_played_to_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str
):
    path = place(tmp_path, file, 1)
    meanwhile(monkeypatch, path.unlink)
    words = *WORDS, "--engine", path.name, "--engine", "pymunk:matched", "--out", "out"
    done = crosscheck(*words, cwd=tmp_path)
    monkeypatch.undo()
    statuses = {record["status"] for record in read(tmp_path / "out").records}
    again = crosscheck(*words, cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert statuses == {"ok"}
    assert again.returncode == 2
    assert f"{path.name}: No such file or directory; name a file that can be read" in again.stderr


def meanwhile(monkeypatch: pytest.MonkeyPatch, act: Callable[[], object]) -> None:
    run_tasks = suite.run_tasks

    def act_and_run(*given) -> int:
        act()
        return run_tasks(*given)

    monkeypatch.setattr(suite, "run_tasks", act_and_run)


def flight(out: Path) -> tuple[list[str], list[bytes]]:
    with reading(out, COMMAND) as store:
        results = RunResults.read(store)
        positions = [results.trajectory(record).position for record in results.records]
    return [record["cell"] for record in results.records], [one.tobytes() for one in positions]


@pytest.mark.slow
def test_the_page_of_a_check_shows_the_text_that_was_checked(tmp_path: Path):
    path = place(tmp_path, "plain.js", 2)
    digest = read_solver(path).digest
    check = check_file(path)
    path.unlink()
    (marked,) = marks_of(check)
    make_page(tmp_path / "check.html", [replace(marked, scenes=scenes_of(check))], several=False)
    page = (tmp_path / "check.html").read_text()

    assert check.faults
    assert digest in page
    assert "The smallest scene" in page


def test_a_run_says_which_modules_beside_the_file_were_played(tmp_path: Path):
    run = played(row_of_file(place(tmp_path, "beside", 1)))

    assert run.settings["from beside it"][1].startswith("helper.py; sha256 of all ")
    assert json.dumps(run.settings)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda path: os.mkfifo(path), "helper.py: is no file"),
        (lambda path: path.write_bytes(b"\0"), "helper.py: is not text"),
        (lambda path: path.write_bytes(b"#" * (LARGEST + 1)), "helper.py: has 1.0 MB"),
        (lambda path: path.symlink_to("nothing"), ""),
    ],
)
def test_a_module_beside_the_file_that_cannot_be_read_is_named(
    tmp_path: Path, make: Callable[[Path], object], said: str
):
    make(tmp_path / "helper.py")
    (tmp_path / "solver.py").write_text("import helper\n" + TEXTS["plain.py"])
    if not said:
        assert read_solver(tmp_path / "solver.py").imported == ()
        return
    with pytest.raises(NotASolver, match=said):
        read_solver(tmp_path / "solver.py")


def test_modules_beside_the_file_are_read_up_to_a_limit(tmp_path: Path):
    (tmp_path / "package").mkdir()
    for k in range(4):
        (tmp_path / "package" / f"part{k}.py").write_text("#" * (LARGEST // 2))
    (tmp_path / "solver.py").write_text("def f():\n    import package.part0\n")

    with pytest.raises(NotASolver, match=r"solver\.py: imports more than 1 MB from its folder"):
        read_solver(tmp_path / "solver.py")
