"""A folder is renamed while no file in it is open: Windows would refuse."""

from __future__ import annotations

from pathlib import Path

import psutil
import pytest

from crosscheck2d.reports.run.folders import part_of, reopened
from crosscheck2d.reports.run.journal import Journal
from tests.reports.terminal.command_line import crosscheck

QUICK = ("head_on_equal_e09", "--engine", "reference:exercise")


@pytest.fixture
def renamed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the folders that were renamed; as on Windows one with an open file is not."""
    names, rename = [], Path.rename

    def as_on_windows(path: Path, target: Path) -> Path:
        place = path.resolve()
        held = [file.path for file in psutil.Process().open_files()]
        if inside := [file for file in held if Path(file).is_relative_to(place)]:
            raise PermissionError(13, "The process cannot access the file", inside[0])
        names.append(path.name)
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", as_on_windows)
    return names


def test_a_run_that_goes_on_is_renamed_with_its_journal_closed(tmp_path: Path, renamed: list[str]):
    """And locked again after it; the control renames a folder with an open journal."""
    (out := tmp_path / "out").mkdir()
    journal = Journal(out)
    with pytest.raises(PermissionError):
        out.rename(part_of(out))
    reopened(journal, out)
    journal.append({"still": "written"})
    journal.close()

    assert renamed == ["out"]
    assert "still" in journal.path.read_text()
    assert journal.path.parent == part_of(out)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["run", "speed"])
def test_a_finished_folder_is_renamed_with_no_file_open(
    command: str, tmp_path: Path, renamed: list[str]
):
    """A run, the same again over it, and one that goes on."""
    timings = ("--timings", "0") if command == "run" else ()
    words = (command, *QUICK, *timings, "--out", "out")
    first, again = (crosscheck(*words, cwd=tmp_path) for _ in range(2))

    assert (first.returncode, again.returncode) == (0, 0), first.stderr + again.stderr
    assert renamed == ["out.part", "out", "out.part"]
    if command == "run":
        on = crosscheck("run", "--resume", "out", cwd=tmp_path)
        assert on.returncode == 0, on.stderr
        assert renamed[3:] == ["out", "out.part"]
