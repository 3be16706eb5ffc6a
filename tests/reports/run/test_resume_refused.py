"""`run --resume OUT` decides before it moves anything, and plays by the paths of where the run was
begun."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.reports.run.journals import contents, put
from tests.reports.terminal.command_line import crosscheck
from tests.reports.terminal.test_strangers import all_of

pytestmark = pytest.mark.slow  # each goes on with a run of its own

SCENE = (Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml").read_text()
SOLVER = Path(__file__).parents[3] / "tests" / "solvers" / "correct" / "plain.py"
PLAYED = (
    "run",
    "in/my.toml",
    "head_on_equal_e09",
    "--engine",
    "reference:exercise",
    "--timings",
    "0",
    "--out",
    "out",
)
RESUME = ("run", "--resume", "out")


@pytest.fixture(scope="module")
def begun_at(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a run was begun, by paths that are not absolute, of a scene file and a solver's."""
    home = tmp_path_factory.mktemp("begun") / "home"
    (home / "in").mkdir(parents=True)
    (home / "in" / "my.toml").write_text(SCENE)
    shutil.copy(SOLVER, home / "mine.py")
    done = crosscheck(*PLAYED, "--engine", "mine.py", cwd=home)
    assert done.returncode == 0, done.stderr
    return home


@pytest.fixture
def home(begun_at: Path, tmp_path: Path) -> Path:
    """A copy, of which the journal says that it was begun there."""
    shutil.copytree(begun_at, tmp_path / "home")
    lines = contents(tmp_path / "home" / "out")
    lines[0]["header"]["folder"] = str(tmp_path / "home")
    put(tmp_path / "home" / "out", lines)
    return tmp_path / "home"


def last_of(out: Path) -> dict:
    """The last line of a journal."""
    return json.loads((out / "journal.jsonl").read_text().splitlines()[-1])


def broken(home: Path) -> None:
    """The scene file is none any more."""
    (home / "in" / "my.toml").write_text("name = 3\n")


def gone_with_its_copy(home: Path) -> None:
    """Neither the scene file nor its copy is there."""
    (home / "in" / "my.toml").unlink()
    (home / "out" / "scenes" / "two-disks.toml").unlink()


def no_solver(home: Path) -> None:
    """The solver's file is gone."""
    (home / "mine.py").unlink()


def a_solver_that_is_none(home: Path) -> None:
    """A folder is where the solver's file was."""
    (home / "mine.py").unlink()
    (home / "mine.py").mkdir()


def somebodys_part(home: Path) -> None:
    """Where a run is while it lasts, somebody's folder is."""
    (home / "out.part").mkdir()
    (home / "out.part" / "notes.txt").write_text("mine")


def a_journal_in_somebodys_part(home: Path) -> None:
    """With a journal of his own, a line without an end."""
    (home / "out.part").mkdir()
    (home / "out.part" / "journal.jsonl").write_text('{"dear": "diary"}')


def a_file_as_part(home: Path) -> None:
    """Or a file."""
    (home / "out.part").write_text("mine")


def an_engine_nobody_knows(home: Path) -> None:
    """The journal is of another version."""
    lines = contents(home / "out")
    lines[0]["header"]["engines"].insert(1, "bullet:shipped")
    put(home / "out", lines)


REFUSED = {
    broken: "in/my.toml: name = 3",
    gone_with_its_copy: "in/my.toml: no such file or directory",
    no_solver: "mine.py",
    a_solver_that_is_none: "mine.py",
    somebodys_part: "out.part: holds notes.txt",
    a_journal_in_somebodys_part: "out.part: holds journal.jsonl",
    a_file_as_part: "out.part: is a file",
    an_engine_nobody_knows: "engine 'bullet:shipped' is not known",
}


@pytest.mark.parametrize("spoil", REFUSED)
def test_a_run_that_cannot_be_gone_on_with_is_not_moved(home: Path, spoil):
    """Exit 2 with the reason; every byte is where it was, and may still be looked at."""
    spoil(home)
    before = all_of(home)
    done = crosscheck(*RESUME, cwd=home)

    assert done.returncode == 2
    assert REFUSED[spoil] in done.stderr
    assert "Traceback" not in done.stderr
    assert all_of(home) == before


def test_from_another_folder_the_same_files_are_played(home: Path, tmp_path: Path):
    """There a scene and a solver of the same names lie, which are others: nothing is played by
    them, nor again."""
    there = tmp_path / "there"
    (there / "in").mkdir(parents=True)
    (there / "in" / "my.toml").write_text(SCENE.replace("mass = 2.0", "mass = 3.0"))
    (there / "mine.py").write_text("raise SystemExit\n")
    done = crosscheck("run", "--resume", "../home/out", cwd=there)

    assert done.returncode == 0, done.stderr
    assert last_of(home / "out")["footer"]["played"] == 0
    assert sorted(path.name for path in home.iterdir()) == ["in", "mine.py", "out"]


def cell_of(out: Path, engine: str) -> str:
    """The key of a cell of an engine that was played."""
    lines = map(json.loads, (out / "journal.jsonl").read_text().splitlines())
    return next(
        line["cell"]
        for line in lines
        if line.get("engine") == engine and line.get("status") == "ok"
    )


def test_of_a_scene_file_that_is_gone_the_copy_is_played(home: Path):
    """What is missing is played from it; what is there is not played again, and the copy stays as
    it was."""
    (home / "in" / "my.toml").unlink()
    copy = home / "out" / "scenes" / "two-disks.toml"
    before = copy.read_bytes()
    lines = map(json.loads, (home / "out" / "journal.jsonl").read_text().splitlines())
    cell, *_ = [
        line["cell"]
        for line in lines
        if line.get("scenario") == "two-disks" and line.get("status") == "ok"
    ]
    (home / "out" / "trajectories" / f"{cell}.npz").unlink()
    done = crosscheck(*RESUME, cwd=home)

    assert done.returncode == 0, done.stderr
    assert last_of(home / "out")["footer"]["played"] == 1
    assert copy.read_bytes() == before


def test_of_a_folder_that_was_moved_the_copy_is_played_and_a_solver_is_missed(home: Path):
    """A relative path of where the run was begun is not looked for elsewhere: a file of that name
    may be another."""
    away = home.rename(home.parent / "away")
    before = all_of(away)
    done = crosscheck(*RESUME, cwd=away)

    assert done.returncode == 2
    assert f"mine.py: was in {home}, which is gone" in done.stderr
    assert all_of(away) == before
