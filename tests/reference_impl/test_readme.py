"""What the folder's README and the engines' rows say of each solver is what its files hold."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from crosscheck2d.adapters.engines import ENGINES

FOLDER = Path(__file__).parents[2] / "reference_impl"
README = (FOLDER / "README.md").read_text("utf-8")
ROWS = [line.strip("| ").split(" | ") for line in README.splitlines() if line.startswith("| `")]
COMMON = {"__init__.py", "blocks.py", "compiled.py", "state.py"}  # of all solvers


def files_of(row: list[str]) -> list[str]:
    return re.findall(r"`(\w+\.py)`", row[0])


def lines_in(files: list[str]) -> int:
    return sum(len((FOLDER / name).read_text("utf-8").splitlines()) for name in files)


def test_every_solver_has_a_row_with_what_it_leaves_out():
    assert {name for row in ROWS for name in files_of(row)} == {
        path.name for path in FOLDER.glob("*.py")
    } - COMMON
    assert all(len(row) == 4 and row[3] for row in ROWS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_solver_has_as_many_lines_as_its_row_and_its_engine_say(row: list[str]):
    files = files_of(row)
    summary = ENGINES[f"reference:{files[0].removesuffix('.py')}"].summary

    assert int(row[1]) == lines_in(files)
    assert f"{row[1]} lines" in summary
    assert " no " in summary or "every pair" in summary
