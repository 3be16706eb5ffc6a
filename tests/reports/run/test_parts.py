"""OUT.part: what an interrupted command has got is gone on with, or left as it is; no other command
takes its place."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from crosscheck2d.reports.commands.run import what_is_kept
from crosscheck2d.reports.run.folders import RUN, begun, part_of
from crosscheck2d.reports.run.journal import JOURNAL
from tests.reports.run.journals import contents, put
from tests.reports.terminal.command_line import crosscheck

SCENE = (Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml").read_text()
ONE = ("--engine", "reference:exercise")
COMMANDS = {
    "run": ("run", "free_fall", *ONE),
    "speed": ("speed", "my.toml", *ONE),
    "stability": ("stability", "my.toml", "--vary", "restitution", *ONE),
}


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Folders that each command has made, as they are while it lasts."""
    base = tmp_path_factory.mktemp("parts")
    (base / "my.toml").write_text(SCENE)
    for name, words in COMMANDS.items():
        done = crosscheck(*words, "--out", name, cwd=base)
        assert done.returncode == 0, done.stderr
    return {name: base / name for name in COMMANDS}


def journal_of(made: Path, to: Path) -> Path:
    """A copy of an interrupted command's folder, in `to`, and the scene beside it; its journal."""
    shutil.copytree(made, to / "out.part")
    begun(to / "out.part", RUN, to / "out")
    (to / "my.toml").write_text(SCENE)
    return to / "out.part" / JOURNAL


@pytest.mark.slow
@pytest.mark.parametrize(
    ("had", "asked", "resume"),
    [
        (had, asked, resume)
        for had in COMMANDS
        for asked in ("speed", "stability")
        for resume in ((), ("--resume",))
        if had != asked or not resume  # that is gone on with
    ],
)
def test_what_another_command_has_begun_is_left_as_it_is(
    parts: dict[str, Path], tmp_path: Path, had: str, asked: str, resume: tuple[str, ...]
):
    """Exit 2, one sentence, not a byte less; with --resume too, unless it is this command's own."""
    journal = journal_of(parts[had], tmp_path)
    before = journal.read_bytes()
    done = crosscheck(*COMMANDS[asked], *resume, "--out", "out", cwd=tmp_path)

    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "out.part" in done.stderr
    assert journal.read_bytes() == before


@pytest.mark.parametrize("had", COMMANDS)
@pytest.mark.parametrize("torn", [False, True])
def test_a_run_takes_the_place_of_nothing_that_has_begun(
    parts: dict[str, Path], tmp_path: Path, had: str, torn: bool
):
    """Of its own kind, of another, or with a line in it that nobody can read."""
    journal = journal_of(parts[had], tmp_path)
    # not there while it lasts
    for name in ("limits.csv", "maps.csv", "laws.csv", "stability.html"):
        (journal.parent / name).unlink(missing_ok=True)
    for path in journal.parent.glob("speed*"):
        path.unlink()
    lines = journal.read_bytes().splitlines(keepends=True)
    if torn:
        journal.write_bytes(b"".join([*lines[:2], b"garbage\n", *lines[2:]]))
    before = journal.read_bytes()
    done = crosscheck(*COMMANDS["run"], "--out", "out", cwd=tmp_path)

    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert journal.read_bytes() == before


@pytest.mark.parametrize("name", ["speed", "stability"])
def test_a_scene_file_that_has_changed_is_not_gone_on_with(
    parts: dict[str, Path], tmp_path: Path, name: str
):
    """Its old numbers would be reported as those of the new scene."""
    journal = journal_of(parts[name], tmp_path)
    before = journal.read_bytes()
    (tmp_path / "my.toml").write_text(SCENE.replace("radius = 0.25", "radius = 0.2"))
    done = crosscheck(*COMMANDS[name], "--resume", "--out", "out", cwd=tmp_path)

    assert done.returncode == 2
    assert "a scene file that has changed" in done.stderr
    assert journal.read_bytes() == before


@pytest.mark.parametrize(
    "line", ["5", "[1, 2]", '{"foo": 1}', '{"task": {"kind": "limit"}}', '{"header": 7}']
)
@pytest.mark.parametrize("name", ["speed", "stability"])
def test_a_line_that_is_none_of_its_own_is_reported(
    parts: dict[str, Path], tmp_path: Path, name: str, line: str
):
    """Before anything is played, by its number, with and without --resume."""
    journal = journal_of(parts[name], tmp_path)
    first, *others = journal.read_text().splitlines()
    journal.write_text("\n".join([first, line, *others]) + "\n")
    for resume in ((), ("--resume",)):
        done = crosscheck(*COMMANDS[name], *resume, "--out", "out", cwd=tmp_path)
        assert done.returncode == 2
        assert f"{JOURNAL}: line 2: " in done.stderr


def test_what_was_torn_beside_the_journal_does_not_keep_the_stability_run_from_its_end(
    parts: dict[str, Path], tmp_path: Path
):
    """A failing run that cannot be read is not shown; its limit is."""
    journal = journal_of(parts["stability"], tmp_path)
    for path in (journal.parent / "trajectories").iterdir():
        path.write_bytes(path.read_bytes()[:100])
    done = crosscheck(*COMMANDS["stability"], "--resume", "--out", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "limits.csv").exists()


def test_a_header_without_what_it_should_have_is_reported(parts: dict[str, Path], tmp_path: Path):
    """By the commands that read a run's folder."""
    part = journal_of(parts["run"], tmp_path).parent
    header, *others = contents(part)
    del header["header"]["versions"]
    put(part, [header, *others])
    done = crosscheck("report", "out.part", cwd=tmp_path)

    assert done.returncode == 2
    assert "line 1: was written by another version of crosscheck; run it again" in done.stderr


def test_a_run_that_ends_before_its_header_is_written_has_played_nothing(tmp_path: Path):
    """Its journal is there, and empty; with a line that is none it is not taken for empty."""
    part = part_of(tmp_path / "out")
    part.mkdir()
    (part / JOURNAL).touch()

    assert what_is_kept(tmp_path / "out") == "Nothing was played yet."

    (part / JOURNAL).write_text("none\n")
    with pytest.raises(ValueError, match="line 1"):
        what_is_kept(tmp_path / "out")
