"""What a check says of the sandbox, and what a hand-in may import."""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path

import pytest

from tests.reports.terminal.command_line import crosscheck

PY = (Path(__file__).parents[2] / "solvers/correct/plain.py").read_text()


@pytest.fixture
def group(tmp_path: Path) -> Path:
    """A class of one student, who imports a package that others need other packages for."""
    (tmp_path / "class").mkdir()
    (tmp_path / "class" / "anna.py").write_text(f"import pydantic\n{PY}")
    return tmp_path


def marks(group: Path, *words: str) -> dict[str, str]:
    """The row of the student."""
    done = crosscheck("check", "class", "--format", "csv", *words, cwd=group)
    assert done.returncode in (0, 1), done.stderr
    (row,) = csv.DictReader(StringIO(done.stdout))
    return row


def test_a_package_that_is_not_allowed_is_named_and_is_no_fault(group: Path):
    """Nothing is judged; a person decides."""
    row = marks(group)
    assert "imports pydantic, which is not available here" in row["begin with"]
    assert (row["wrong"], row["not judged"]) == ("0", "20")


@pytest.mark.slow
def test_a_package_comes_with_all_that_it_needs(group: Path):
    """pydantic needs its compiled core, and two more."""
    assert marks(group, "--package", "pydantic")["total"] == "20"


@pytest.mark.parametrize("name", ["nowhere", "crosscheck2d", "tests"])
def test_a_package_has_to_be_installed_and_none_of_this_program(name: str, group: Path):
    """One sentence, before anything is checked."""
    done = crosscheck("check", "class", "--package", name, cwd=group)
    assert done.returncode == 2
    assert f"--package {name}: is not installed, or is a part of this program" in done.stderr


def test_without_a_sandbox_a_folder_of_python_needs_consent(
    group: Path, monkeypatch: pytest.MonkeyPatch
):
    """A folder of JavaScript needs none: V8 has no files and no network."""
    monkeypatch.setenv("CROSSCHECK_SANDBOX", "none")
    done = crosscheck("check", "class", cwd=group)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "--unprotected" in done.stderr
    assert (
        "with all your permissions"
        in crosscheck("check", "class", "--unprotected", cwd=group).stderr
    )
    (group / "class" / "anna.py").rename(group / "anna.py")
    (group / "class" / "ben.js").write_text("function integrate(sphere, dt) {}\n")
    assert crosscheck("check", "class", cwd=group).returncode == 1


@pytest.mark.slow
def test_a_class_is_asked_with_one_random_seed_that_is_recorded(group: Path):
    """So that a recording of the answers is worth nothing; a seed that is given is taken."""
    assert marks(group, "--seed", "12")["seed"] == "12"
    assert len({marks(group)["seed"] for _ in range(2)}) == 2
