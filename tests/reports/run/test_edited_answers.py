"""An exact answer that somebody has edited, or replaced by something else, is computed again, and
that is said."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

from crosscheck2d.reports.run.answers import ExactAnswer, put_answer, read_answer, record_of
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.truth.cache import has_valid_types
from tests.reports.run.small_runs import make
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck

pytestmark = pytest.mark.slow  # each plays a run twice


def with_arrays(path: Path, edit: Callable[[dict[str, Any]], None]) -> None:
    """The file with other arrays, all else as it is: its own sums fit."""
    with np.load(path) as saved:
        arrays = {name: saved[name] for name in saved.files if not name.endswith(".json")}
    with ZipFile(path) as file:
        said = file.read("answer.json")
    edit(arrays)
    whole = io.BytesIO()
    np.savez_compressed(whole, **arrays)
    with ZipFile(whole, "a") as file:
        file.writestr("answer.json", said)
    path.write_bytes(whole.getvalue())


def halved(arrays: dict[str, Any]) -> None:
    """Every flight begins at half its place, with half its velocity; every collision is half as
    late."""
    arrays["legs"][:, 2:6] /= 2
    arrays["events"][:, 0] /= 2


def numbers(**other: Any) -> Callable[[dict[str, Any]], None]:
    """The numbers beside the arrays, with others among them."""

    def edit(arrays: dict[str, Any]) -> None:
        arrays["numbers"] = np.array(json.dumps(json.loads(str(arrays["numbers"])) | other))

    return edit


def saying(*said: Any) -> Callable[[Path], None]:
    """It says something else of how the answer was had."""

    def edit(path: Path) -> None:
        with ZipFile(path, "w") as file:
            file.writestr("answer.json", json.dumps(said))

    return edit


def pipe(path: Path) -> None:
    """A pipe that nobody writes into."""
    path.unlink()
    os.mkfifo(path)


def endless(path: Path) -> None:
    """A link to a device that never ends."""
    path.unlink()
    path.symlink_to("/dev/zero")


EDITS: dict[str, Callable[[Path], None]] = {
    "half as far": lambda path: with_arrays(path, halved),
    "a horizon in words": lambda path: with_arrays(path, numbers(horizon="soon")),
    "nothing remains": lambda path: with_arrays(path, numbers(remains=5)),
    "said otherwise": saying("timeout", "x", "soon"),
    "said in a list": saying("timeout", "x", 5.0),
    "brackets": lambda path: (
        saying()(path) or ZipFile(path, "w").writestr("answer.json", "[" * 200_000)
    ),
    "a pipe": pipe,
    "a device": endless,
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run, with its tables."""
    place = tmp_path_factory.mktemp("edited")
    scene = Path(
        shutil.copy(
            Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml", place / "two.toml"
        )
    )
    made = make(place / "whole", scene)
    assert crosscheck("report", made, cwd=place).returncode == 0
    return made


@pytest.mark.parametrize("edit", EDITS)
def test_an_edited_answer_is_as_good_as_none(tmp_path: Path, edit: str):
    """Whatever was done to its file: nothing of it is read, and nothing is waited for."""
    put_answer(
        tmp_path / "one.npz", ExactAnswer(record_of(scenario("slow_collision")), "ok", "", 60.0)
    )
    EDITS[edit](tmp_path / "one.npz")

    assert read_answer(tmp_path / "one.npz") is None


@pytest.mark.parametrize(
    "edit",
    [pytest.param(name, marks=pytest.mark.long) if k else name for k, name in enumerate(EDITS)],
)
def test_an_edited_answer_is_computed_again_and_said(whole: Path, tmp_path: Path, edit: str):
    """All numbers are as they were, though every scene table was deleted with it."""
    out = Path(shutil.copytree(whole, tmp_path / "out"))
    [path] = (out / "compared").glob("two-disks-*.npz")
    before = (out / "deviations.csv").read_bytes()
    for scene_table in (out / "compared").glob("*.csv"):
        scene_table.unlink()
    EDITS[edit](path)
    done = crosscheck("report", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert (
        f"{path.name} is not what was written: that exact answer is computed again" in done.stderr
    )
    assert (out / "deviations.csv").read_bytes() == before
    assert path.is_file()
    assert read_answer(path) is not None


def test_an_answer_that_nobody_edited_is_believed_without_a_word(whole: Path, tmp_path: Path):
    """The other way round: nothing is computed, nothing said."""
    out = Path(shutil.copytree(whole, tmp_path / "out"))
    done = crosscheck("report", "out", cwd=tmp_path)

    assert done.returncode == 0
    assert "computed again" not in done.stderr
    assert out.is_dir()


def test_the_answer_to_another_scene_is_not_the_answer_to_this_one(tmp_path: Path):
    """A file that is whole, under another name."""
    put_answer(
        tmp_path / "one.npz", ExactAnswer(record_of(scenario("slow_collision")), "ok", "", 60.0)
    )
    shutil.copy(tmp_path / "one.npz", tmp_path / "other.npz")

    assert read_answer(tmp_path / "one.npz") is not None
    assert read_answer(tmp_path / "other.npz") is None


def test_numbers_of_a_record_are_numbers_and_its_texts_texts():
    """What is read from the user's own cache is asked the same."""
    good = {
        "horizon": 1.0,
        "error_bound": 1e-9,
        "float64_horizon": 2,
        "bits": 53,
        "method": "",
        "reason": "",
        "remains": ["a"],
    }
    bad = [
        {"horizon": "soon"},
        {"remains": 5},
        {"remains": [5]},
        {"bits": 1.5},
        {"bits": True},
        {"reason": None},
    ]

    assert has_valid_types(good)
    assert not any(has_valid_types(good | one) for one in bad)
    assert not has_valid_types([good])


@pytest.mark.slow
@pytest.mark.parametrize(
    "place", ["trajectories", pytest.param("compared", marks=pytest.mark.long)]
)
@pytest.mark.parametrize(
    "words", [("report", "out"), ("diff", "whole", "out")], ids=["report", "diff"]
)
def test_a_pipe_in_a_result_folder_is_waited_for_by_nobody(
    whole: Path, tmp_path: Path, place: str, words: Any
):
    """In the place of every file of a folder of a run: a process of its own, as what hangs is to be
    ended."""
    out = Path(shutil.copytree(whole, tmp_path / "out"))
    (tmp_path / "whole").symlink_to(whole)
    for path in (out / place).iterdir():
        pipe(path)
    done = subprocess.run(
        [CROSSCHECK, *words], cwd=tmp_path, capture_output=True, text=True, timeout=200
    )

    assert done.returncode in (0, 1, 2)
    assert "Traceback" not in done.stderr
    if place == "trajectories" and words[0] == "report":
        assert "cannot be read: is a pipe or a device" in (out / "runs.csv").read_text()
