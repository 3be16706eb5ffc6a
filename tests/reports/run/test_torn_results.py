"""What is not as it was written is named by `report` and `diff`, and played again by `run
--resume`."""

import io
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.reports.run.archive import Archive, trajectory_file
from crosscheck2d.reports.run.journal import JOURNAL
from tests.reports.run.small_runs import make
from tests.reports.terminal.command_line import crosscheck


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run, with its tables."""
    place = tmp_path_factory.mktemp("torn")
    scene = Path(
        shutil.copy(
            Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml", place / "two.toml"
        )
    )
    made = make(place / "whole", scene)
    assert crosscheck("report", made, cwd=place).returncode == 0
    return made


@pytest.fixture
def torn(whole: Path, tmp_path: Path) -> Path:
    """A copy of it, to be torn."""
    return Path(shutil.copytree(whole, tmp_path / "torn"))


def first_file(folder: Path) -> Path:
    """The trajectory of the first cell."""
    return trajectory_file(folder, Archive.read(folder).records[0]["cell"])


def other_shapes(path: Path) -> None:
    """A whole .npz, but with arrays of another length in it."""
    with np.load(path) as saved:
        arrays = {name: saved[name] for name in saved}
    file = io.BytesIO()
    np.savez(file, **arrays | {"position": arrays["position"][:3, :1]})
    path.write_bytes(file.getvalue())


def flipped(path: Path) -> None:
    """One bit in the middle is another one."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


TEARS: dict[str, Callable[[Path], object]] = {
    "empty": lambda path: path.write_bytes(b""),
    "torn": lambda path: path.write_bytes(path.read_bytes()[:1000]),
    "gone": Path.unlink,
    "of other shapes": other_shapes,
    "one bit": flipped,
    "no archive": lambda path: path.write_bytes(b"not a zip file"),
}
# the first is for the gate, the others are for the long run
ONE_TEAR = [
    pytest.param(tear, marks=[pytest.mark.long] if k else []) for k, tear in enumerate(TEARS)
]


@pytest.mark.slow
@pytest.mark.parametrize("tear", TEARS)
def test_a_torn_trajectory_is_worse_for_diff_and_named(whole: Path, torn: Path, tear: str):
    """Exit 1 with the file's name, whichever of the two folders it is in; the run as it was
    written: exit 0."""
    path = first_file(torn)
    TEARS[tear](path)
    after, before = (
        crosscheck("diff", whole, torn, cwd=torn.parent),
        crosscheck("diff", torn, whole, cwd=torn.parent),
    )

    assert after.returncode == 1
    for done in (after, before):
        assert path.name in done.stdout.replace("\n", "")
        assert "run --resume" in " ".join(done.stdout.split())
    assert crosscheck("diff", whole, whole, cwd=torn.parent).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("tear", ONE_TEAR)
def test_the_report_names_a_torn_trajectory_and_shows_all_else(whole: Path, torn: Path, tear: str):
    """One error, with the file's name; every number of the other cells is as it was."""
    path = first_file(torn)
    TEARS[tear](path)
    crosscheck("report", torn, cwd=torn.parent)
    runs = pd.read_csv(torn / "runs.csv").set_index("cell")
    tables = [
        pd.read_csv(folder / "deviations.csv").query("scenario == 'two-disks'")
        for folder in (whole, torn)
    ]

    assert list(runs.index[runs.status != "ok"]) == [path.stem]
    assert path.name in runs.loc[path.stem, "reason"]
    assert len(tables[0])
    pd.testing.assert_frame_equal(*(table.reset_index(drop=True) for table in tables))


@pytest.mark.slow
@pytest.mark.parametrize("tear", ONE_TEAR)
def test_resume_plays_a_torn_cell_again(whole: Path, torn: Path, tear: str):
    """That cell and no other, to the same bytes of file and table."""
    path = first_file(torn)
    before, lines = path.read_bytes(), (torn / JOURNAL).read_text().splitlines()
    TEARS[tear](path)
    done = crosscheck("run", "--resume", torn, "--workers", "1", cwd=torn.parent)
    new = [json.loads(line) for line in (torn / JOURNAL).read_text().splitlines()[len(lines) :]]

    assert done.returncode == 0, done.stderr
    assert [line["cell"] for line in new if "cell" in line] == [path.stem]
    assert path.read_bytes() == before
    assert (torn / "deviations.csv").read_bytes() == (whole / "deviations.csv").read_bytes()


@pytest.mark.slow
def test_shares_and_answers_that_are_torn_are_made_again(whole: Path, torn: Path):
    """Cut short, or with one bit changed: the tables are the same."""
    for number, path in enumerate(sorted((torn / "compared").iterdir())):
        (flipped if number % 2 else TEARS["torn"])(path)
    done = crosscheck("report", torn, cwd=torn.parent)

    assert done.returncode == 0, done.stderr
    assert (torn / "deviations.csv").read_bytes() == (whole / "deviations.csv").read_bytes()


@pytest.mark.parametrize("tear", ["empty", "torn", "gone", "one bit"])
def test_diff_believes_no_torn_table(whole: Path, torn: Path, tear: str):
    """A table that lost its last rows would be "nothing got worse": exit 2, with the file and what
    to do."""
    path = torn / "deviations.csv"
    TEARS[tear](path)
    done = crosscheck("diff", whole, torn, cwd=torn.parent)

    assert done.returncode == 2
    assert done.stderr.startswith(f"{path}: ")
    assert f"crosscheck report {torn}" in done.stderr


def test_a_file_that_diff_cannot_read_is_named(
    whole: Path, torn: Path, monkeypatch: pytest.MonkeyPatch
):
    """What the system says has the file before it, and no number of an error."""

    def refused(*_: object) -> None:
        raise PermissionError(13, "Permission denied", str(torn / JOURNAL))

    monkeypatch.setattr("crosscheck2d.reports.commands.diff.difference", refused)
    done = crosscheck("diff", whole, torn, cwd=torn.parent)

    assert (done.returncode, done.stderr) == (2, f"{torn / JOURNAL}: Permission denied\n")


@pytest.mark.parametrize("text", ["", "not a scene", None])
def test_a_scene_copy_that_is_torn_is_named(whole: Path, torn: Path, text: str | None):
    """Exit 2 of `report`, with the file."""
    copy = torn / "scenes" / "two-disks.toml"
    if text is None:
        copy.unlink()
    else:
        copy.write_text(text)
    done = crosscheck("report", torn, cwd=torn.parent)

    assert done.returncode == 2
    assert str(copy) in done.stderr.replace("\n", "")
    assert whole.exists()
