"""A folder full of modules that are called as Python's, or as this program's: none of them is ever
imported."""

from __future__ import annotations

import ast
import multiprocessing
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest

from crosscheck2d.adapters import safe_path
from crosscheck2d.adapters.host.file import SolverFailed, read_solver
from crosscheck2d.adapters.host.process import SolverProcess
from crosscheck2d.reports.run import pool
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import play_here
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.run.control_engines import Controlled, row
from tests.reports.terminal.command_line import CROSSCHECK
from tests.solvers.mutants import CORRECT

# what they import as they start is asked here
pytestmark = [
    pytest.mark.usefixtures("fresh_workers"),
    pytest.mark.slow,  # each starts programs of its own
]
ROOT = Path(__file__).parents[3]
SOURCE = ("adapters", "reference_impl", "reports", "scenarios")
OURS = (*SOURCE, "crosscheck2d", "tests")
LIBRARIES = [
    "Box2D",
    "flint",
    "gmpy2",
    "numba",
    "numpy",
    "pandas",
    "pyb2d3",
    "pydantic",
    "pymunk",
    "rich",
    "typer",
]
RUN = f"run head_on_equal_e09 --dt {1 / 60} --engine my_arrays.py --out ../out --engine "
BY_THEMSELVES = ("sitecustomize", "usercustomize", "conftest", "__main__")
TRAP = (
    "open({mark!r}, 'a').write({name!r} + ' ')\nraise SystemExit('{name}.py of the current folder"
    " was run')\n"
)
SOLVERS = {
    path.name: path for path in CORRECT if path.name in ("plain.js", "plain.py", "arrays.py")
}


def trapped(folder: Path, names: Iterable[str]) -> Callable[[], str]:
    mark = folder.parent / f"{folder.name}.ran"
    folder.mkdir()
    for name in names:
        (folder / f"{name}.py").write_text(TRAP.format(mark=str(mark), name=name))
    return lambda: mark.read_text() if mark.exists() else ""


@pytest.fixture
def ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], str]:
    reported = trapped(
        tmp_path / "here", (*sys.stdlib_module_names, *OURS, *LIBRARIES, *BY_THEMSELVES)
    )
    for name, path in SOLVERS.items():
        (tmp_path / "here" / f"my_{name}").write_text(path.read_text())
    monkeypatch.chdir(tmp_path / "here")
    return reported


def in_a_worker() -> Any:
    task = partial(
        play_here,
        Cell("slow_collision", 0, "good:control", 1),
        row(Controlled),
        replace(scenario("slow_collision"), truth=None),
    )
    [(_, ended)] = run_all({"one": task}, workers=1)
    return ended


def start_unsafely(connection: Any, folder: str, memory: int) -> Any:
    process = multiprocessing.get_context("spawn").Process(
        target=pool.serve, args=(connection, folder, memory, False)
    )
    process.start()
    return process


@pytest.fixture(autouse=True)
def spawned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool, "CONTEXT", multiprocessing.get_context("spawn"))


@pytest.mark.parametrize("entry", [[], [""]])
def test_a_worker_imports_nothing_of_the_folder_it_is_started_in(
    ran, monkeypatch: pytest.MonkeyPatch, entry: list[str]
):
    monkeypatch.setattr(sys, "path", [*sys.path, *entry])
    assert in_a_worker().run.status == "ok"
    assert ran() == ""


def test_without_the_safe_path_a_worker_is_caught_and_its_cell_is_no_result(
    ran, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(pool, "start_process", start_unsafely)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)  # of workers started before
    ended = in_a_worker()

    assert ran() != ""
    assert isinstance(ended, Failure)
    assert ended.outside
    assert ended.reason.startswith("its worker could not start: exit status 1")


@pytest.mark.parametrize(
    "name",
    ["reference_impl.exercise", "crosscheck2d.reference_impl.exercise", "adapters", "tests"],
)
def test_a_solver_imports_no_part_of_the_package(tmp_path: Path, name: str):
    (tmp_path / "mine.py").write_text(f"import {name}\ndef integrate(sphere, dt): pass\n")
    with pytest.raises(SolverFailed, match=r"imports \S+, which is not available here") as failed:
        SolverProcess(read_solver(tmp_path / "mine.py"))
    assert failed.value.kind == "unavailable"


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_imports_libraries_and_not_what_lies_beside_it(ran, name: str):
    with SolverProcess(read_solver(Path(f"my_{name}"))) as process:
        assert process.functions["collide"]
    assert ran() == ""


def test_what_a_solver_imports_of_its_own_is_found(ran):
    Path("package").mkdir()
    Path("package", "__init__.py").write_text(
        "from package.inner import TWO\nfrom .inner import THREE\n"
    )
    Path("package", "inner.py").write_text(
        "import third_one\nTWO, THREE = third_one.random.choice([2]), 3\n"
    )
    Path("third_one.py").write_text("import random\n")
    Path("folder").mkdir()
    Path("folder", "deep.py").write_text("FOUR = 4\n")
    Path("mine.py").write_text(
        "import package, folder.deep\nassert (package.TWO, package.THREE, folder.deep.FOUR) == (2,"
        " 3, 4)\nassert package.__file__.endswith('package/__init__.py')\ndef"
        " integrate(sphere, dt): pass\n"
    )
    solver = read_solver(Path("mine.py"))
    for path in (Path("third_one.py"), Path("package", "inner.py")):
        path.unlink()
    with SolverProcess(solver) as process:
        assert process.functions["integrate"]
    assert [file for file, _ in solver.imported] == [
        "folder/deep.py",
        "package/__init__.py",
        "package/inner.py",
        "third_one.py",
    ]
    assert ran() == ""


@cache
def imported_here() -> frozenset[str]:
    found = set()
    for path in (path for folder in SOURCE for path in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found |= {name.partition(".")[0] for name in names}
    code = "import sys; print(*sys.modules)"
    before = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    ours = {name for name in found if name in sys.stdlib_module_names}
    return frozenset(ours - {name.partition(".")[0] for name in before})


@pytest.mark.parametrize(
    "path", [".", *(pytest.param(path, marks=pytest.mark.slow) for path in (":", ":/nowhere"))]
)
def test_a_pythonpath_with_the_current_folder_runs_nothing_of_it(tmp_path: Path, path: str):
    ran = trapped(tmp_path / "here", {*imported_here(), "secrets", "numbers", "random", *SOURCE})
    done = subprocess.run(
        [CROSSCHECK, "list", "metrics"],
        cwd=tmp_path / "here",
        env={"PYTHONPATH": path},
        capture_output=True,
        text=True,
    )

    assert (done.returncode, ran()) == (0, ""), done.stderr


@pytest.fixture
def path(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.setattr(sys, "meta_path", sys.meta_path[:])
    monkeypatch.setattr(sys, "path", sys.path[:])
    return sys.path


def test_only_the_current_folder_and_that_of_the_program_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: list[str]
):
    monkeypatch.chdir(tmp_path)
    path[:] = ["", str(tmp_path), "/else", str(ROOT), "/more"]
    safe_path.keep_path_safe()
    assert path == ["/else", "/more"]


@pytest.mark.parametrize("of", [ast, pytest], ids=["Python's own", "installed"])
def test_a_folder_that_modules_are_installed_in_stays_where_it_was_last(
    monkeypatch: pytest.MonkeyPatch, path: list[str], of: Any
):
    monkeypatch.chdir(folder := Path(of.__file__).parents[0 if of is ast else 1])
    path[:] = [str(folder), "/else", str(folder), "/more"]
    safe_path.keep_path_safe()
    assert path == ["/else", str(folder), "/more"]


def test_of_the_folder_of_the_program_only_the_package_and_its_tests_are_found():
    find = safe_path.OwnPackages().find_spec
    assert all(find(name) is not None for name in ("crosscheck2d", "tests"))
    assert [find(name) for name in (*SOURCE, "scipy", "conftest")] == [None] * 6


def test_a_new_process_finds_the_package_where_nothing_is_installed():
    words = safe_path.python("import crosscheck2d.adapters; print(crosscheck2d.__file__)")
    done = subprocess.run([words[0], "-S", *words[1:]], capture_output=True, text=True)
    assert done.stdout.strip() == str(ROOT / "__init__.py"), done.stderr[-500:]


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        pytest.param([*RUN.split(), "pymunk:matched"], marks=pytest.mark.long),
        ["check", "my_plain.py"],
        pytest.param(["truth", "head_on_equal_e09"], marks=pytest.mark.long),
    ],
)
def test_a_command_runs_nothing_of_the_folder_it_is_started_in(ran, words: list[str]):
    done = subprocess.run([CROSSCHECK, *words], capture_output=True, text=True, timeout=300)

    assert (done.returncode, ran()) == (0, ""), done.stderr
