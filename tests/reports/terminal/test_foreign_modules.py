"""A folder full of modules that are called as Python's, or as this program's: none of them is ever imported."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from adapters.own_solver.file import read_solver
from adapters.own_solver.process import SolverProcess
from reports.run import worker
from reports.run.cells import Cell
from reports.run.playing import play_here
from reports.run.runner import run_all
from reports.run.worker_process import Failure
from reports.terminal import safe_path
from scenarios.catalogue import scenario
from tests.reports.run.control_engines import Controlled, row
from tests.reports.terminal.command_line import CROSSCHECK
from tests.solvers.mutants import CORRECT

ROOT = Path(__file__).parents[3]
OURS = ("adapters", "reference_impl", "reports", "scenarios", "tests")
LIBRARIES = ("Box2D", "flint", "gmpy2", "numba", "numpy", "pandas", "pyb2d3", "pydantic", "pymunk", "rich", "typer")
BY_THEMSELVES = ("sitecustomize", "usercustomize", "conftest", "__main__")
TRAP = "open({mark!r}, 'a').write({name!r} + ' ')\nraise SystemExit('{name}.py of the current folder was run')\n"
SOLVERS = {path.name: path for path in CORRECT if path.name in ("plain.js", "plain.py", "arrays.py")}


def trapped(folder: Path, names: Iterable[str]) -> Callable[[], str]:
    """Put a module of each name into `folder`; returns what shows which of them were run."""
    mark = folder.parent / f"{folder.name}.ran"
    folder.mkdir()
    for name in names:
        (folder / f"{name}.py").write_text(TRAP.format(mark=str(mark), name=name))
    return lambda: mark.read_text() if mark.exists() else ""


@pytest.fixture
def ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], str]:
    """What shows which modules were run of the current folder, which has all names of Python's and of what we use."""
    reported = trapped(tmp_path / "here", (*sys.stdlib_module_names, *OURS, *LIBRARIES, *BY_THEMSELVES))
    for name, path in SOLVERS.items():
        (tmp_path / "here" / f"my_{name}").write_text(path.read_text())
    monkeypatch.chdir(tmp_path / "here")
    return reported


def in_a_worker() -> Any:
    """How a cell ended that was played in a worker started here."""
    task = partial(
        play_here,
        Cell("slow_collision", 0, "good:control", 1),
        row(Controlled),
        replace(scenario("slow_collision"), truth=None),
    )
    [(_, ended)] = run_all({"one": task}, workers=1)
    return ended


@pytest.mark.parametrize("entry", [[], [""]])
def test_a_worker_imports_nothing_of_the_folder_it_is_started_in(
    ran, monkeypatch: pytest.MonkeyPatch, entry: list[str]
):
    """The cell is played as anywhere else; so where the path ends with an empty entry, as Python's own for -c."""
    monkeypatch.setattr(sys, "path", [*sys.path, *entry])
    assert in_a_worker().run.status == "ok"
    assert ran() == ""


def test_without_the_safe_path_a_worker_is_caught_and_its_cell_is_no_result(ran, monkeypatch: pytest.MonkeyPatch):
    """The negative control: the traps work; and what came of it is said to lie outside the engine."""
    start = subprocess.Popen
    unsafe = lambda words, **how: start([word for word in words if word != "-P"], **how)  # noqa: E731
    monkeypatch.setattr(worker.subprocess, "Popen", unsafe)
    ended = in_a_worker()

    assert ran() != ""
    assert isinstance(ended, Failure)
    assert ended.outside
    assert ended.reason.startswith("its worker could not start: exit status 1")


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_imports_libraries_and_not_what_lies_beside_it(ran, name: str):
    """Python's own random is Python's own, numpy is numpy, reference_impl is ours."""
    with SolverProcess(read_solver(Path(f"my_{name}"))) as process:
        assert process.functions["collide"]
    assert ran() == ""


def test_what_a_solver_imports_of_its_own_is_found(ran):
    """A module beside it, a package, one that those import; a name of Python's is Python's there, too."""
    Path("package").mkdir()
    Path("package", "__init__.py").write_text("from package.inner import TWO\nfrom .inner import THREE\n")
    Path("package", "inner.py").write_text("import third_one\nTWO, THREE = third_one.random.choice([2]), 3\n")
    Path("third_one.py").write_text("import random\n")
    Path("folder").mkdir()
    Path("folder", "deep.py").write_text("FOUR = 4\n")
    Path("mine.py").write_text(
        "import package, folder.deep\nassert (package.TWO, package.THREE, folder.deep.FOUR) == (2, 3, 4)\n"
        "assert package.__file__.endswith('here/package/__init__.py')\n"
        "def integrate(sphere, dt): pass\n"
    )
    solver = read_solver(Path("mine.py"))
    for path in (Path("third_one.py"), Path("package", "inner.py")):
        path.unlink()
    with SolverProcess(solver) as process:
        assert process.functions["integrate"]
    assert [file for file, _ in solver.beside] == [
        "folder/deep.py", "package/__init__.py", "package/inner.py", "third_one.py"
    ]  # fmt: skip
    assert ran() == ""


def imported_here() -> set[str]:
    """The modules of Python's that this program imports, but for those that Python itself has imported before it."""
    found = set()
    for path in (path for folder in OURS[:4] for path in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found |= {name.partition(".")[0] for name in names}
    code = "import sys; print(*sys.modules)"
    before = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    return {name for name in found if name in sys.stdlib_module_names} - {name.partition(".")[0] for name in before}


@pytest.mark.parametrize("path", [":", ":/nowhere", "."])
def test_a_pythonpath_with_the_current_folder_runs_nothing_of_it(tmp_path: Path, path: str):
    """An empty entry of PYTHONPATH is the current folder; all that this program imports is called so there."""
    ran = trapped(tmp_path / "here", {*imported_here(), "secrets", "numbers", "random", "adapters", "scenarios"})
    done = subprocess.run(
        [CROSSCHECK, "list", "metrics"], cwd=tmp_path / "here", env={"PYTHONPATH": path}, capture_output=True, text=True
    )

    assert (done.returncode, ran()) == (0, ""), done.stderr


def test_only_the_current_folder_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """What else somebody has put on the path stays; so does the folder that this program is in."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", str(tmp_path), "/else", *sys.path])
    safe_path.leave_out_current_folder()
    assert sys.path[0] == "/else"
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "path", [str(ROOT), "/else"])
    safe_path.leave_out_current_folder()
    assert sys.path == [str(ROOT), "/else"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["run", "head_on_equal_e09", "--dt", str(1 / 60), "--engine", "pymunk:matched", "--engine", "my_arrays.py",
         "--out", "../out"],
        ["check", "my_plain.py"],
        ["truth", "head_on_equal_e09"],
    ],
)  # fmt: skip
def test_a_command_runs_nothing_of_the_folder_it_is_started_in(ran, words: list[str]):
    """As a person starts it: exit 0."""
    done = subprocess.run([CROSSCHECK, *words], capture_output=True, text=True, timeout=300)

    assert (done.returncode, ran()) == (0, ""), done.stderr
