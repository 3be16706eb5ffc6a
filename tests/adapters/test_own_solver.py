"""Somebody's solver as an engine of `crosscheck run`: beside the others, with its own e, its limits
and its faults."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from adapters.own_solver.engine import engine_file
from adapters.play import play
from scenarios.catalogue import scenario
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT

RIGHT = next(path for path in CORRECT if path.name == "plain.js")


@pytest.mark.parametrize("name", ["plain.js", "plain.py", "arrays.py"])
def test_a_file_plays_as_an_engine(name: str):
    """A right file makes of the ship's flight what the reference makes of it, to rounding, in every
    language."""
    flight = scenario("ship_thrust")
    runs = {}
    for row in (engine_file(RIGHT.parent / name), engine_file(RIGHT)):
        engine = row.make()
        runs[row.summary] = play(engine, "x:own", flight, flight.dt(4))
        engine.close()
    first, *others = runs.values()

    assert all(one.status == "ok" for one in runs.values())
    assert all(
        abs(one.trajectory.position - first.trajectory.position).max() < 1e-12 for one in others
    )  # type: ignore[union-attr]


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


HALF = {"restitution = 0.9": "restitution = 0.5"}
LEAPS = {"sphere.alpha +=": "sphere.velocity.x *= 1.5;\n  sphere.alpha +="}
HANGS = {
    "sphere.alpha +=": (
        "if (sphere.position.x > -0.5 && sphere.position.x < 0) for (;;);\n  sphere.alpha +="
    )
}
THROWS = {"sphere.alpha +=": "nothing.x = 1;\n  sphere.alpha +="}
IDLE = {
    "function sphereSphereCollisionHandling(sphereA, sphereB) {": (
        "function sphereSphereCollisionHandling() { return;"
    )
}
UNCLOSED = {"projectObjects();\n}": "projectObjects();"}


@pytest.mark.parametrize(
    ("changes", "scene", "status", "reason"),
    [
        (HALF, "head_on_equal_e05", "ok", ""),
        (HALF, "head_on_equal_e09", "unsupported", "the file has e = 0.5, the scene needs 0.9"),
        (LEAPS, "head_on_equal_e09", "diverged", "a disk is "),
        (HANGS, "head_on_equal_e09", "timeout", "does not come back within 1 s in one call"),
        (
            THROWS,
            "head_on_equal_e09",
            "error",
            "ReferenceError: nothing is not defined (line 43, column 3)",
        ),
        (IDLE, "head_on_equal_e09", "unsupported", "lets spheres that meet go on as they were"),
        (UNCLOSED, "head_on_equal_e09", "unsupported", "SyntaxError: Unexpected end of input"),
    ],
)
def test_what_a_file_does_is_the_status_of_its_cell(
    tmp_path: Path, changes: dict[str, str], scene: str, status: str, reason: str
):
    """Played by its own e, refused, diverged, stopped, thrown: a row says which and why, and
    nothing else is lost."""
    text = RIGHT.read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "Exercise.js").write_text(text)
    engine = engine_file(tmp_path / "Exercise.js", patience=1.0).make()
    question = scenario(scene)
    played = play(engine, "x:own", question, question.dt(question.substeps[-1]))
    engine.close()

    assert (played.status, reason in played.reason) == (status, True), played.reason


def test_a_file_that_ends_its_process_is_a_crash(tmp_path: Path):
    """In Python, too: what is left of it is a status."""
    text = (RIGHT.parent / "plain.py").read_text()
    (tmp_path / "solver.py").write_text(
        text.replace("    sphere.alpha +=", "    import os; os._exit(3)\n    sphere.alpha +=")
    )
    engine = engine_file(tmp_path / "solver.py").make()
    question = scenario("head_on_equal_e09")
    played = play(engine, "x:own", question, question.dt(question.substeps[-1]))
    engine.close()

    assert played.status == "crashed"
    assert "ended its own process (exit status 3)" in played.reason


@pytest.mark.slow
def test_a_file_that_fails_does_not_spoil_the_run_of_the_others(tmp_path: Path):
    """Exit 1, as one engine could not be compared at all; a row each, and the right one is
    played."""
    (tmp_path / "throws.js").write_text(RIGHT.read_text().replace(*next(iter(THROWS.items()))))
    (tmp_path / "right.js").write_text(RIGHT.read_text())
    words = [
        "run",
        "head_on_equal_e09",
        "--dt",
        str(1 / 60),
        "--engine",
        "throws.js",
        "--engine",
        "right.js",
    ]
    done = crosscheck(*words, "--out", "run", cwd=tmp_path)
    rows = list(csv.DictReader((tmp_path / "run" / "runs.csv").read_text().splitlines()))

    assert done.returncode == 1
    assert "no cell of throws.js:own was played to its end" in done.stderr
    assert {row["engine"]: row["status"] for row in rows} == {
        "throws.js": "error",
        "right.js": "ok",
    }


@pytest.mark.slow
def test_run_takes_a_file_as_an_engine(tmp_path: Path):
    """It stands in the tables beside the others, under its own path; what is no text is refused."""
    (tmp_path / "anna").mkdir()
    (tmp_path / "anna" / "Exercise.js").write_text(RIGHT.read_text())
    (tmp_path / "junk.py").write_bytes(b"\x00\x01")
    words = ["run", "head_on_equal_e09", "--dt", str(1 / 60), "--engine", "pymunk:matched"]
    done = crosscheck(*words, "--engine", "anna/Exercise.js", "--out", "run", cwd=tmp_path)
    bad = crosscheck(*words, "--engine", "junk.py", "--out", "bad", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "run" / "runs.csv").read_text().splitlines()))
    assert [(row["engine"], row["profile"], row["status"]) for row in rows] == [
        ("pymunk", "matched", "ok"),
        ("anna/Exercise.js", "own", "ok"),
    ]
    assert bad.returncode == 2
    assert "is not text" in bad.stderr
