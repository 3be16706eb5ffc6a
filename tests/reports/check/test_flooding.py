"""What a solver's process writes is bounded: in time though bytes keep coming, and in length."""

from __future__ import annotations

import subprocess
import sys
from time import monotonic
from xml.etree import ElementTree

import pytest

from crosscheck2d.adapters.own_solver import process as solver_process
from crosscheck2d.adapters.own_solver.file import LONGEST, NotASolver, SolverFailed, read_solver
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.adapters.system import Pieces
from crosscheck2d.reports.check.formats import as_junit
from crosscheck2d.reports.check.verdict import FileCheck
from tests.reports.check.marked import marks_of
from tests.reports.terminal.command_line import crosscheck

FLOOD = "import os, sys\nwhile True:\n    os.write(1, b'x' * {size})\n"


def flooded(size: int) -> SolverProcess:
    """What talks to a process that only writes, and never ends a line."""
    talk = SolverProcess.__new__(SolverProcess)
    talk.kind = "python"
    talk.process = subprocess.Popen(
        [sys.executable, "-c", FLOOD.format(size=size)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
        bufsize=0,
    )
    assert talk.process.stdout is not None
    talk.pieces = Pieces(talk.process.stdout)
    return talk


def test_a_process_that_never_stops_writing_is_stopped_in_time():
    """A byte at a time, so that it is its time that ends, not its length."""
    talk, began = flooded(1), monotonic()
    with pytest.raises(SolverFailed, match="does not come back within 1 s") as failed:
        talk.receive(1.0)

    assert failed.value.kind == "timeout"
    assert monotonic() - began < 20.0  # on a machine that does other things, too
    assert talk.process is None


def test_a_line_without_an_end_is_cut_at_its_longest(monkeypatch: pytest.MonkeyPatch):
    """It is no answer, and no memory is filled with it."""
    monkeypatch.setattr(solver_process, "LONGEST_ANSWER", 10**6)
    talk = flooded(10**5)
    with pytest.raises(SolverFailed, match=solver_process.INTRUDED):
        talk.receive(60.0)
    assert talk.process is None


def test_a_message_of_ten_megabytes_is_cut_before_it_is_escaped():
    """Of letters that each are written in six, or in one: what is shown is the same as of a short
    one."""
    began = monotonic()
    for letter in ("\a", "x"):
        assert (
            SolverFailed("error", letter * 10**7).what == SolverFailed("error", letter * 10**4).what
        )
    assert len(SolverFailed("error", "x" * 10**4).what) == LONGEST + len(" ...")
    assert SolverFailed("error", "x" * LONGEST).what == "x" * LONGEST
    assert monotonic() - began < 5.0


@pytest.mark.parametrize(
    "words",
    [("check",), ("run", "free_fall", "--out", "out", "--engine")],
    ids=["check", "run --engine"],
)
@pytest.mark.parametrize("ending", [".py", ".js"])
def test_a_name_that_no_file_can_have_is_a_sentence(tmp_path, words: tuple[str, ...], ending: str):
    """300 letters; exit 2."""
    done = crosscheck(*words, "a" * 300 + ending, cwd=tmp_path)

    assert done.returncode == 2
    assert "File name too long" in done.stderr


def test_a_module_that_no_file_can_have_is_not_beside_a_solver(tmp_path):
    """It is then missing as any other is, when the solver runs."""
    (tmp_path / "mine.py").write_text(f"import {'a' * 300}\n")
    assert read_solver(tmp_path / "mine.py").imported == ()


def test_a_folder_that_is_called_as_a_solver_is_none(tmp_path):
    """The other way round: what exists and is no file is still said to be so."""
    (tmp_path / "mine.py").mkdir()
    with pytest.raises(NotASolver, match="is no file"):
        read_solver(tmp_path / "mine.py")


def test_junit_is_well_formed_for_a_file_with_control_characters_in_its_name(tmp_path):
    """As an attribute it is what XML can hold."""
    path = tmp_path / "my\x01\x1bsolver.py"
    suites = ElementTree.fromstring(as_junit(marks_of(FileCheck(path, [], "is no solver"))))

    assert suites[0].get("name", "").endswith("my\ufffd\ufffdsolver.py")
    assert suites[0][0].get("classname") == "my\ufffd\ufffdsolver"
