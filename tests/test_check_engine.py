"""Somebody's solver as an engine of `crosscheck run`: beside the others, with its own e, its limits and its faults."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from adapters.play import play
from adapters.student import engine_file
from scenarios.catalogue import scenario
from tests.command_line import crosscheck
from tests.solvers.mutants import CORRECT

RIGHT = next(path for path in CORRECT if path.name == "plain.js")


@pytest.mark.parametrize("name", ["plain.js", "plain.py", "arrays.py"])
def test_a_file_plays_as_an_engine(name: str):
    """A right file makes of the ship's flight what the reference makes of it, to rounding, in every language."""
    flight = scenario("ship_thrust")
    runs = {}
    for row in (engine_file(RIGHT.parent / name), engine_file(RIGHT)):
        engine = row.make()
        runs[row.summary] = play(engine, "x:own", flight, flight.dt(4))
        engine.close()
    first, *others = runs.values()

    assert all(one.status == "ok" for one in runs.values())
    assert all(abs(one.trajectory.position - first.trajectory.position).max() < 1e-12 for one in others)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        ("head_on_equal_e1", "the file has e = 0.9, the scene needs 1"),
        ("wall_to_wall", "the exercise has no walls"),
    ],
)
def test_a_scene_that_the_file_cannot_play_is_refused(scene: str, reason: str):
    """Its restitution is written into it, and it has no walls."""
    engine = engine_file(RIGHT).make()
    question = scenario(scene)
    played = play(engine, "x:own", question, question.dt(question.substeps[0]))
    engine.close()

    assert played.status == "unsupported"
    assert reason in played.reason


@pytest.mark.slow
def test_run_takes_a_file_as_an_engine(folder: Path):
    """It stands in the tables beside the others, under its own path."""
    words = ["run", "head_on_equal_e09", "--dt", str(1 / 60), "--engine", "reference:exercise"]
    done = crosscheck(*words, "--engine", "anna/Exercise.js", "--out", "run", cwd=folder)
    bad = crosscheck(*words, "--engine", "dora/solver.py", "--out", "bad", cwd=folder)

    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((folder / "run" / "runs.csv").read_text().splitlines()))
    assert [(row["engine"], row["profile"], row["status"]) for row in rows] == [
        ("reference", "exercise", "ok"), ("anna/Exercise.js", "own", "ok")
    ]  # fmt: skip
    assert bad.returncode == 2
    assert "is not text" in bad.stderr
