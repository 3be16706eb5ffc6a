"""A page or a JUnit file of a check that somebody has written into is not written over."""

from __future__ import annotations

from pathlib import Path

import pytest

from crosscheck2d.reports.check.command import PAGE
from crosscheck2d.reports.check.formats import JUNIT
from crosscheck2d.reports.run.made import is_sealed, may_overwrite, sealed
from crosscheck2d.reports.terminal.exits import FolderTaken

# longer than where its mark is looked for
TEXT = f"<html>{PAGE.decode()}{'<p>a row</p>' * 1000}\udcff</html>\n"


def test_what_we_wrote_and_nobody_changed_is_written_over(tmp_path: Path):
    """Any text, one that is not UTF-8 too."""
    for mark, text in ((PAGE, TEXT), (JUNIT, f"{JUNIT.decode()}/>\n")):
        (tmp_path / "file").write_bytes(sealed(text).encode(errors="backslashreplace"))
        may_overwrite(tmp_path / "file", mark, "page of a check", "--page")


@pytest.mark.parametrize(
    "edit",
    [
        lambda data: data.replace(b"a row", b"my row", 1),
        lambda data: data + b"my notes",
        lambda data: data.replace(b"<!-- as", b"my notes <!-- as"),
        lambda data: data.rpartition(b"<!--")[0],
        lambda data: data.replace(b"\n", b"\r\n"),
    ],
    ids=["changed", "appended", "put in", "its seal gone", "other line ends"],
)
def test_a_page_that_somebody_annotated_is_not_written_over(tmp_path: Path, edit):
    """Wherever in it the notes are, far behind its mark too."""
    path = tmp_path / "check.html"
    path.write_bytes(edit(sealed(TEXT).encode(errors="backslashreplace")))

    assert not is_sealed(path.read_bytes())
    with pytest.raises(FolderTaken, match="is a page of a check that was changed since"):
        may_overwrite(path, PAGE, "page of a check", "--page")
