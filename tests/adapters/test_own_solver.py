"""Somebody's solver as an engine of `crosscheck run`: beside the others, with its own e, its limits
and its faults."""

from __future__ import annotations

import csv
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from crosscheck2d.adapters.conformance.conform import ask, conform
from crosscheck2d.adapters.host.engine import STEP_LIMIT, row_of_file
from crosscheck2d.adapters.host.process import SolverProcess
from crosscheck2d.adapters.host.restitution import own_restitution
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.exercise import asteroid_field
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT, MUTANTS, Mutant

RIGHT = next(path for path in CORRECT if path.name == "plain.js")


def played(path: Path, scene: str, step: int = 0, patience: float = STEP_LIMIT) -> Run:
    """`step`: of the scene's step sizes, from coarse to fine."""
    question = scenario(scene)
    dt = question.dt(question.substeps[step])
    return play_once(row_of_file(path, patience).make, "x:own", question, dt)


def changed(folder: Path, changes: dict[str, str]) -> Path:
    """The right file with these texts in the place of others."""
    text = RIGHT.read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    (folder / "Exercise.js").write_text(text)
    return folder / "Exercise.js"


@pytest.mark.parametrize(
    "name", ["plain.js", "plain.py", pytest.param("arrays.py", marks=pytest.mark.slow)]
)
def test_a_file_plays_as_an_engine(name: str):
    runs = [played(RIGHT.parent / file, "ship_thrust") for file in (name, "plain.js")]
    assert [run.status for run in runs] == ["ok", "ok"]
    one, right = (run.trajectory for run in runs)
    assert one is not None
    assert right is not None
    assert abs(one.position - right.position).max() < 1e-12


@pytest.mark.parametrize("name", ["plain.js", "plain.py"])
def test_equal_forces_are_sent_once(name: str, monkeypatch: pytest.MonkeyPatch):
    heard: list[tuple[int, bool]] = []

    def noted(self: SolverProcess, verb: str, what: Any, *limit: float) -> Any:
        if verb == "play":
            heard.extend((each["count"], bool(each["forces"])) for each in what)
        return do(self, verb, what, *limit)

    do = SolverProcess.do
    monkeypatch.setattr(SolverProcess, "do", noted)
    states = []
    for collected in (True, False):
        with closing(row_of_file(RIGHT.parent / name, collected=collected).make()) as engine:
            engine.load(asteroid_field(0, 3, 0.9), 1 / 1024)
            for force in [0.5] * 16 + [0.25] * 4 + [0.0] * 3:
                if force:
                    engine.apply_force(0, np.array([force, 0.1]), 0.01)
                engine.step()
            states.append(engine.read())
    together, one_by_one = states

    assert heard == [(16, True), (4, True), (1, False), (1, False), (1, False)]
    for array, other in zip(vars(together).values(), vars(one_by_one).values()):
        assert array.tobytes() == other.tobytes()
    assert together.velocity[0, 0] > asteroid_field(0, 3, 0.9).velocity[0, 0]  # they do act


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        ("head_on_equal_e1", "the file has e = 0.9, the scene needs 1"),
        ("wall_to_wall", "the exercise has no walls"),
        ("spinning_disks_meet", "does not model friction, the scene has 0.2"),
    ],
)
def test_a_scene_that_the_file_cannot_play_is_refused(scene: str, reason: str):
    run = played(RIGHT, scene)
    assert run.status == "unsupported"
    assert reason in run.reason


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


@pytest.mark.slow
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
        (IDLE, "head_on_equal_e09", "ok", ""),
        (UNCLOSED, "head_on_equal_e09", "unsupported", "SyntaxError: Unexpected end of input"),
    ],
)
def test_what_a_file_does_is_the_status_of_its_cell(
    tmp_path: Path, changes: dict[str, str], scene: str, status: str, reason: str
):
    run = played(changed(tmp_path, changes), scene, step=-1, patience=1.0)
    assert (run.status, reason in run.reason) == (status, True), run.reason


WATCHED = (  # a mutant, and what its collisions would be taken for if they told the file's e
    "collide_empty.js",  # -1
    "normal_long.js",  # 0.539
    "no_restitution.js",  # 0
    "touches_ufo.js",  # a global that only initScene makes
)
# what cannot be played, and why; all else is
REFUSED = {
    "integrate_missing": "has no function integrate",
    "decimal_comma": "the file has e = 0, the scene needs 0.9",
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "mutant",
    [
        pytest.param(one, id=one.name, marks=[] if one.name in WATCHED else pytest.mark.long)
        for one in MUTANTS
    ],
)
def test_a_faulty_file_is_played(tmp_path: Path, mutant: Mutant):
    # Every mutant of the catalogue: refused only for a function that it lacks or for its e, and
    # then that is the reason; where it ends in no numbers or throws, what came before can be
    # watched.
    run = played(mutant.write(tmp_path), "head_on_equal_e09", patience=2.0)
    if (reason := REFUSED.get(Path(mutant.name).stem)) is not None:
        assert (run.status, reason in run.reason) == ("unsupported", True), run.reason
    else:
        assert run.status in ("ok", "diverged", "error", "timeout"), run.reason
        assert run.trajectory is not None
        assert len(run.trajectory) > 0


NO_WALLS = "the exercise has no walls"
FALLS_UP = {"sphere.velocity.y += sphere.force.y": "sphere.velocity.y -= sphere.force.y"}
GIVES_NAN = {"sphere.force.y / sphere.mass * dt": "sphere.force.z / sphere.mass * dt"}
THROWS = {"sphere.force.y / sphere.mass * dt": "(() => { throw Error('not today'); })()"}
FORGETS_NOTHING = {  # its acceleration grows with the number of calls
    "function integrate(": "let steps = 0;\nfunction integrate(",
    "sphere.force.y / sphere.mass * dt": "sphere.force.y / sphere.mass * dt * (1 + steps++)",
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "probe", "verdict", "note"),
    [
        (FALLS_UP, "same_instant", "departs", ""),
        (FALLS_UP, "load_forgets", "keeps", ""),
        (FORGETS_NOTHING, "load_forgets", "breaks", ""),
        ({}, "load_forgets", "keeps", ""),
        (GIVES_NAN, "stays_finite", "departs", ""),
        (GIVES_NAN, "read_copies", "keeps", ""),
        (THROWS, "read_copies", "departs", "SolverFailed: Error: not today"),
        ({}, "walls_are_reported", "not asked", NO_WALLS),
    ],
)
def test_a_probe_tells_wrong_physics_from_a_broken_protocol_in_a_file(
    tmp_path: Path, changes: dict[str, str], probe: str, verdict: str, note: str
):
    found = ask("x", "own", probe, row_of_file(changed(tmp_path, changes)))

    assert (found.verdict, found.note.partition(" (line")[0]) == (verdict, note)


# wrong in every way that a basic probe can see
WRONG_PHYSICS = ("integrate_empty.py", "dt_missing.py", "dt_squared.js", "force_cleared.py")
WRONG_PHYSICS += ("force_not_by_mass.py", "torque_by_mass.py", "damped.js", "b_forgotten.py")
WRONG_PHYSICS += ("typo_in_c.py",)  # it throws where two collide
BREAKING = {"state_in_a_list.py": "load_forgets", "state_in_integrate.js": "load_forgets"}
IN_THE_GATE = ("dt_squared.js", "state_in_a_list.py")  # one of each kind


@pytest.mark.slow
@pytest.mark.parametrize(
    "mutant",
    [
        pytest.param(m, marks=[] if m.name in IN_THE_GATE else [pytest.mark.long], id=m.name)
        for m in MUTANTS
        if m.name in (*WRONG_PHYSICS, *BREAKING)
    ],
)
def test_only_a_file_that_breaks_the_protocol_is_not_scored(tmp_path: Path, mutant: Mutant):
    found = conform("x:own", row_of_file(mutant.write(tmp_path), patience=2.0))
    broken = {finding.probe for finding in found if finding.verdict == "breaks"}

    if mutant.name in BREAKING:
        assert BREAKING[mutant.name] in broken
    else:
        assert not broken


def test_a_file_without_collisions_plays_a_lone_disk(tmp_path: Path):
    file = changed(tmp_path, {"function sphereSphere": "function laterSphereSphere"})
    runs = [played(file, name) for name in ("ship_thrust", "head_on_equal_e09")]
    missing = "Exercise.js has no function sphereSphereCollisionHandling"
    assert [(run.status, run.reason) for run in runs] == [("ok", ""), ("unsupported", missing)]


@pytest.mark.parametrize(
    ("text", "came", "wanted", "fits"),
    [
        ("var e = 0.5;", 0.5, 0.9, False),  # written for another, and it has it
        ("var e = 0.5;", 0.5, 0.5, True),
        ("var e = 0.9;", 0.0, 0.9, True),  # a fault that makes 0 of it
        ("var e = 0.9;", 0.0, 1.0, False),
        ("J = -1.9 * v / m;", -0.05, 0.9, True),  # 1 + e as a number
        ("J = -1.5 * v / m;", 0.5, 0.9, False),
        ("J = -2 * v / m;", 1.0, 0.9, False),
        ("J = -k * v / m;", 0.5, 0.9, True),  # the text tells nothing: it is played
        ("var e = 1.5;", 1.5, 0.9, True),  # no restitution: a fault
        ("// e = 0.5\nvar e = 0.9;", 0.9, 0.9, True),
        ("J = -v / m;", float("nan"), 0.9, True),
    ],
)
def test_a_file_is_refused_only_for_a_restitution_that_is_written_into_it(
    text: str, came: float, wanted: float, fits: bool
):
    assert own_restitution(text, came).fits(wanted) is fits


@pytest.mark.parametrize(
    "name",
    [
        "plain.js",
        pytest.param("plain.py", marks=pytest.mark.slow),
        pytest.param("arrays.py", marks=pytest.mark.slow),
    ],
)
def test_collected_steps_give_the_same_bits(name: str):
    flight = asteroid_field(1, 6, 0.9)
    states, collisions = [], []
    for collected in (False, True):
        engine = row_of_file(RIGHT.parent / name, collected=collected).make()
        engine.load(flight, 1 / 128)
        for k in range(300):
            engine.apply_force(0, np.array([1.0, 0.5 * k]), 0.1)
            engine.step()
            if k % 16 == 0:
                engine.read()
        engine.step(64)
        states.append(np.column_stack(list(vars(engine.read()).values())))
        collisions.append(engine.collisions())
        engine.close()

    assert states[0].tobytes() == states[1].tobytes()
    assert collisions[0] == collisions[1]
    assert len(collisions[0]) > 3


def test_a_file_that_ends_its_process_is_a_crash(tmp_path: Path):
    text = (RIGHT.parent / "plain.py").read_text()
    (tmp_path / "solver.py").write_text(
        text.replace("    sphere.alpha +=", "    import os; os._exit(3)\n    sphere.alpha +=")
    )
    run = played(tmp_path / "solver.py", "head_on_equal_e09", step=-1)
    assert run.status == "crashed"
    assert "ended its own process (exit status 3)" in run.reason


@pytest.mark.long
def test_a_file_that_fails_does_not_spoil_the_run_of_the_others(tmp_path: Path):
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
