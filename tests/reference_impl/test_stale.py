"""Kernels that numba keeps on disk are those of the source that is there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from crosscheck2d.reference_impl.compiled import forget_stale

ROOT = Path(__file__).parents[2]
OUTER = """
{first}
from numba import njit
from inner import number

@njit(cache=True)
def answer():
    return number()

print(answer())
"""
INNER = """
from numba import njit

@njit(cache=True)
def number():
    return {number}
"""
FORGET = """
from pathlib import Path
from crosscheck2d.reference_impl.compiled import forget_stale
forget_stale(Path(__file__).parent)
"""


def test_what_was_kept_before_an_edit_is_deleted_and_nothing_else(tmp_path: Path):
    here, there = tmp_path / "here", tmp_path / "there"
    kept = here / "__pycache__" / "solver.step-1.nbi"
    for folder in (kept.parent, there):
        folder.mkdir(parents=True)
    for k, path in enumerate((here / "solver.py", there / "pairs.py", kept)):
        path.touch()
        os.utime(path, (k, k))

    forget_stale(here, there)
    assert kept.exists()

    os.utime(there / "pairs.py", (3, 3))
    forget_stale(here)
    assert kept.exists()
    forget_stale(here, there)
    assert not kept.exists()


def printed(folder: Path, first: str, number: int) -> int:
    (folder / "outer.py").write_text(OUTER.format(first=first)) if number == 1 else None
    (folder / "inner.py").write_text(INNER.format(number=number))
    done = subprocess.run(
        [sys.executable, "outer.py"],
        cwd=folder,
        # a command that ran in this process before may have set PYTHONSAFEPATH
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (folder, ROOT / ".ci/types")))},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return int(done.stdout)


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second_time"), [(FORGET, 22), ("", 1)], ids=["with", "without"])
def test_a_kernel_that_calls_an_edited_one_is_compiled_anew(
    tmp_path: Path, first: str, second_time: int
):
    # The control: left to itself, numba goes on with the old number. The new one is longer: Python
    # itself knows a file that is edited within a second by its size.
    assert printed(tmp_path, first, 1) == 1
    assert printed(tmp_path, first, 22) == second_time
