"""`crosscheck speed` refuses what it cannot measure by name, and measures what is named by
itself."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from crosscheck2d.reports.cli import app
from crosscheck2d.reports.compare.pooling import POOLED

pytestmark = pytest.mark.slow  # starts worker processes six times


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["no_such_scene"], "scenario 'no_such_scene' is not known"),
        (["free_fall", "--engine", "pymonk"], "did you mean pymunk"),
        (["free_fall", "--out", "README.md"], "is a file"),
        (["free_fall", "--out", "tests"], "which crosscheck did not make"),
    ],
)
def test_bad_input_is_one_clear_sentence(
    arguments: list[str], says: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(Path(__file__).parents[3])
    done = CliRunner().invoke(app, ["speed", *arguments])

    assert done.exit_code == 2
    assert says in done.stderr
    assert "Traceback" not in done.output


def test_a_scene_without_an_exact_answer_is_refused_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("crosscheck2d.reports.speed.ladder.reach_of", no_reach)
    done = CliRunner().invoke(app, ["speed", "cradle_touching", "--out", str(tmp_path / "out")])

    assert done.exit_code == 1
    assert "cradle_touching" in done.stderr
    assert "no exact answer: two outcomes" in done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        ".crosscheck.lock",
        "results.sqlite",
    }


def no_reach(*_: object) -> tuple[int, str]:
    return 0, "two outcomes"


def test_one_scene_and_one_engine_are_measured_by_themselves(tmp_path: Path):
    arguments = ["speed", "free_fall", "--engine", "reference", "--out", str(tmp_path / "out")]
    for _ in range(2):
        done = CliRunner().invoke(app, arguments)
        assert done.exit_code == 0, done.output
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {
        "speed.html",
        "speed.csv",
        "speed_samples.csv",
        "speed_errors.csv",
        "machine.json",
    } <= names
    assert "speed_figures.csv" not in names
    assert "Noise floor" in done.output
    assert POOLED not in set(pd.read_csv(tmp_path / "out" / "speed.csv").scenario)
