"""Files that a command writes outside a folder of results: whole or not at all, and never over a
file of another origin."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

import pytest

from crosscheck2d.reports.run.made import may_overwrite
from crosscheck2d.reports.terminal.foreign_text import put_text, whole
from tests.reports.terminal.command_line import crosscheck

pytestmark = pytest.mark.slow  # each is a command with a folder of its own


def all_of(folder: Path) -> dict[str, object]:
    """Every path below a folder, with its bytes, where it leads, or of what kind it is."""
    found: dict[str, object] = {}
    for path in sorted(folder.rglob("*")):
        mode = path.lstat().st_mode
        plain = path.read_bytes() if stat.S_ISREG(mode) else stat.S_IFMT(mode)
        found[str(path.relative_to(folder))] = os.readlink(path) if path.is_symlink() else plain
    return found


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path):
    """The old one stays, no rest is left, a link stays a link, and what is no file is written
    to."""
    path, link = tmp_path / "page.html", tmp_path / "link.html"
    put_text(path, "old")
    link.symlink_to("page.html")
    with suppress(ZeroDivisionError), whole(path) as file:
        file.write(b"new")
        file.write(bytes(1 // 0))
    assert path.read_text() == "old"
    put_text(link, "new")
    put_text(Path(os.devnull), "nothing")

    assert path.read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.html", "page.html"]
    assert link.is_symlink()
    assert path.stat().st_mode == (tmp_path / "page.html").stat().st_mode & ~0o111


@pytest.mark.parametrize("option", ["--page", "--junit"])
def test_a_file_that_a_check_did_not_write_is_not_written_over(tmp_path: Path, option: str):
    """Neither somebody's page nor one behind a link; a link to nothing is no place."""
    (tmp_path / "solver.py").write_text("def integrate(sphere, dt):\n    pass\n")
    (tmp_path / "mine.html").write_text("years of work")
    (tmp_path / "link.html").symlink_to("mine.html")
    (tmp_path / "gone.html").symlink_to("nowhere/gone.html")
    before = all_of(tmp_path)
    for name in ("mine.html", "link.html", "gone.html", "nowhere/new.html", "."):
        done = crosscheck("check", "solver.py", option, name, cwd=tmp_path)
        assert done.returncode == 2
        assert f"{option} {name}: " in done.stderr
    may_overwrite(Path(os.devnull), b"mark", "page", option)

    assert all_of(tmp_path) == before
