"""A folder called OUT.part may be somebody's finished result: it is no interrupted run of OUT, and
stays as it is."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from crosscheck2d.reports.run.folders import RUN, found, part_of, replace_folder
from crosscheck2d.reports.run.made import put_made, read_made
from crosscheck2d.reports.terminal.exits import FolderTaken
from tests.reports.run.small_runs import make
from tests.reports.terminal.command_line import crosscheck
from tests.reports.terminal.test_strangers import COMMANDS, SCENE, all_of

NAMED = (
    ("run", "--resume", "out"),
    ("run", "my.toml", "--engine", "reference:exercise", "--dt", "0.02", "--out", "out"),
)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished run."""
    base = tmp_path_factory.mktemp("kept")
    (base / "my.toml").write_text(SCENE)
    return make(base / "out", base / "my.toml")


@pytest.fixture
def here(kept: Path, tmp_path: Path) -> Path:
    """Where a finished run is called out.part, and a scene beside it."""
    shutil.copytree(kept, tmp_path / "out.part")
    (tmp_path / "my.toml").write_text(SCENE)
    return tmp_path


@pytest.mark.parametrize("both", [False, True], ids=["out.part alone", "out beside it"])
@pytest.mark.parametrize("words", NAMED, ids=["resume", "again"])
def test_a_finished_result_called_out_part_is_nobodys_interrupted_run(
    here: Path, words: tuple[str, ...], both: bool
):
    """Refused with a true sentence; not a byte of it, nor of OUT, changes."""
    if both:
        shutil.copytree(here / "out.part", here / "out")
    before = all_of(here)
    done = crosscheck(*words, cwd=here)

    assert done.returncode == 2
    assert (
        "out.part is for unfinished results, but holds a finished one; move it elsewhere"
        in done.stderr
    )
    assert "interrupted" not in done.stderr
    assert all_of(here) == before


@pytest.mark.parametrize("name", ["speed", "stability"])
def test_the_finished_result_of_another_command_is_left_as_it_is_too(here: Path, name: str):
    """`speed` and `stability` open the folder by the same function."""
    made = read_made(here / "out.part")
    assert made is not None
    for other in (here / "out.part").iterdir():
        shutil.rmtree(other) if other.is_dir() else other.unlink()
    put_made(here / "out.part", made._replace(command=f"crosscheck {name}", files={}))
    before = all_of(here)
    done = crosscheck(*COMMANDS[name], cwd=here)

    assert done.returncode == 2
    assert "holds a finished one" in done.stderr
    assert all_of(here) == before


def test_what_is_looked_at_is_not_a_result_of_another_name(here: Path):
    """`report out` and its like name the folder that is meant, or say that there is none."""
    with pytest.raises(FolderTaken, match="is not the folder of a run"):
        found(here / "out")
    assert found(here / "out.part") == here / "out.part"


def test_what_was_killed_before_it_took_its_place_is_its_own_run(
    here: Path, monkeypatch: pytest.MonkeyPatch
):
    """The other way round: finished and called out.part, as it was to be `out` when its process
    died."""
    part = part_of(here / "out")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", lambda *_: (_ for _ in ()).throw(OSError(5, "killed")))
        with pytest.raises(OSError, match="killed"):
            replace_folder(part, here / "out", RUN)
    made = read_made(part)
    assert made is not None
    assert (made.finished, made.out) == (True, "out")
    assert found(here / "out") == part

    replace_folder(part, here / "out", RUN)
    made = read_made(here / "out")
    assert made is not None
    # so that by another name it is a finished result
    assert (made.finished, made.out) == (True, "")
