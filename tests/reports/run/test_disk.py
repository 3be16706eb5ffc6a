"""A disk that is full, or may not be written to, is one clear message, and the journal stays
whole."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from crosscheck2d.reports.run.archive import Archive
from tests.reports.run.sweeps import SMALL, assert_nothing_lost, lines, undisturbed
from tests.reports.terminal.command_line import crosscheck


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of `SMALL` that nothing disturbed."""
    return undisturbed(SMALL, tmp_path_factory.mktemp("small"))


@pytest.mark.slow
def test_a_full_disk_is_one_clear_message_and_the_run_goes_on_when_there_is_room(
    small: Path, tmp_path: Path
):
    """A tmpfs of 400 kB: exit 1, the journal whole; with more room, resumed to the same numbers."""
    with mounted(tmp_path / "disk", "size=400k") as disk:
        done = crosscheck(*SMALL, "--out", disk / "out", cwd=tmp_path)
        said = done.stderr.splitlines()
        had = len(Archive.read(disk / "out.part").records)
        lines(disk / "out.part")
        subprocess.run(["mount", "-o", "remount,size=40m", disk], check=True)
        again = crosscheck("run", "--resume", disk / "out", cwd=tmp_path)

        assert done.returncode == 1
        assert [line for line in said if "No space left on device" in line]
        assert "Traceback" not in done.stderr
        assert 0 < had < 24
        assert again.returncode == 0, again.stderr
        assert_nothing_lost(disk / "out", small)


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_is_one_clear_message(small: Path, tmp_path: Path):
    """A tmpfs that is mounted read-only: exit 2, also for a report there."""
    with mounted(tmp_path / "disk", "size=40m") as disk:
        shutil.copytree(small, disk / "had")
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        done = [
            crosscheck(*words, cwd=tmp_path)
            for words in ((*SMALL, "--out", disk / "out"), ("report", disk / "had"))
        ]

    assert [one.returncode for one in done] == [2, 2]
    assert all("Read-only file system" in one.stderr for one in done)
    assert not [one for one in done if "Traceback" in one.stderr]


@contextmanager
def mounted(where: Path, options: str) -> Iterator[Path]:
    """A small file system in memory; skips the test where it may not be mounted."""
    where.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "tmpfs", where], capture_output=True
    ).returncode:
        pytest.skip("mounting a tmpfs takes root")
    try:
        yield where
    finally:
        subprocess.run(["umount", where], check=True)
