"""Somebody's own engine in a file: it is told from a solver, played by what it says it models, and
every fault of it is a status and one sentence."""

from __future__ import annotations

import re
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from crosscheck2d.adapters.conformance.conform import ask, conform
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.host.engine import TEMPLATES, row_of_file
from crosscheck2d.adapters.host.file import NotASolver
from crosscheck2d.adapters.host.process import SolverProcess, waiting
from crosscheck2d.adapters.host.surface import FEATURES
from crosscheck2d.adapters.play import play, play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT

ROOT = Path(__file__).parents[2]
ENDS = {"javascript": "ball.js", "python": "ball.py"}
[EXAMPLE] = re.findall(r"^```js\n(.*?)^```", (ROOT / "CONTRIBUTING.md").read_text(), re.M | re.S)


def template(folder: Path, kind: str, *changes: tuple[str, str]) -> Path:
    text = TEMPLATES[kind].read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = folder / ENDS[kind]
    path.write_text(text)
    return path


def played(path: Path, scene: str = "head_on_equal_e09", patience: float = 5.0) -> Run:
    question = scenario(scene)
    return play_once(row_of_file(path, patience).make, "x:own", question, question.dt(4))


def missed(row: EngineRow, *probes: str) -> dict[str, str]:
    asked = [ask("x", "own", each, row) for each in probes] or conform("x:own", row)
    return {one.probe: one.verdict for one in asked if one.verdict != "keeps"}


COUNTS = {
    "javascript": [
        ("const models", "let worlds = 0;\nconst models"),
        (
            "  const disks = scene.position",
            "  if (++worlds > 12) throw new Error(worlds);\n  const disks = scene.position",
        ),
    ],
    "python": [
        ("models = ", "worlds = []\nmodels = "),
        (
            "    disks = [",
            "    worlds.append(scene)\n"
            "    if len(worlds) > 12:\n"
            "        raise ValueError(len(worlds))\n"
            "    disks = [",
        ),
    ],
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ENDS)
def test_a_probe_begins_with_the_file_as_it_was_written(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    # Though one process plays them all: a file that throws in its 13th world never has one. Where
    # the process does not load it anew, it throws. None of the processes is left.
    row = row_of_file(template(tmp_path, kind, *COUNTS[kind]))
    started: list[psutil.Process] = []
    begin, connect = SolverProcess.begin, SolverProcess.connect

    def noted(process: SolverProcess) -> None:
        begin(process)
        assert process.process is not None
        started.append(psutil.Process(process.process.pid))

    monkeypatch.setattr(SolverProcess, "begin", noted)
    assert missed(row) == {}
    assert len(started) <= 2  # a probe may play two worlds beside each other
    assert not any(one.is_running() for one in started)

    first = []

    def not_anew(process: SolverProcess) -> Any:
        if first and (idle := waiting.pop(process.key, None)):
            process.process, process.pieces, process.level, _ = idle
        else:
            first.append(connect(process))
        return first[0]

    monkeypatch.setattr(SolverProcess, "connect", not_anew)
    assert missed(row)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ENDS)
def test_the_template_keeps_every_probe(kind: str, tmp_path: Path):
    wrong = (
        ("d.u += sign * nx * impulse", "d.u -= sign * nx * impulse"),
        ("d.v += sign * ny * impulse", "d.v -= sign * ny * impulse"),
    )

    assert missed(row_of_file(template(tmp_path, kind))) == {}
    faults = missed(row_of_file(template(tmp_path, kind, *wrong)))
    assert faults.keys() >= {"restitution_2", "restitution_wall", "impulse_is_reported"}
    assert set(faults.values()) == {"departs"}


@pytest.mark.slow
def test_a_template_in_a_scene_is_the_reference(tmp_path: Path):
    runs = [played(template(tmp_path, kind)) for kind in ENDS]
    runs.append(played(CORRECT[0].parent / "plain.js"))
    first, *others = runs

    assert [one.status for one in runs] == ["ok"] * 3
    assert first.trajectory is not None
    assert len(first.trajectory.collisions)
    for one in others:
        assert one.trajectory is not None
        assert np.abs(one.trajectory.position - first.trajectory.position).max() < 1e-12
        assert (one.trajectory.collisions.t == first.trajectory.collisions.t).all()


@pytest.mark.slow
def test_the_example_of_contributing_plays(tmp_path: Path):
    ball = tmp_path / "pixels.js"
    ball.write_text(EXAMPLE)
    run = played(ball, "bouncing_ball_e09")
    other = played(template(tmp_path, "javascript"), "bouncing_ball_e09")

    assert run.status == other.status == "ok"
    assert run.trajectory is not None
    assert other.trajectory is not None
    first = slice(0, 30)  # up to the first bounce: then the overlap is corrected otherwise
    off = np.abs(run.trajectory.position[first] - other.trajectory.position[first])
    assert off.max() < 1e-12
    assert run.trajectory.collisions.t[0] == other.trajectory.collisions.t[0]
    assert missed(row_of_file(ball), "free_flight", "load_forgets", "same_instant") == {}
    assert played(ball, "wall_to_wall").reason == (
        "pixels.js refuses the scene: it has only a floor at y = 0, and gravity down"
    )


@pytest.mark.parametrize(
    ("scene", "words", "reason"),
    [
        ("wall_to_wall", "disks", "ball.js does not model walls"),
        ("free_fall", "disks walls", "ball.js does not model gravity"),
        ("spinning_disks_meet", "disks rotation", "ball.js does not model friction"),
        ("ship_thrust", "disks rotation wrap", "ball.js does not model forces on disks"),
        ("asteroids", "walls", "ball.js does not model more than one disk, rotation, the wrap at"),
    ],
)
def test_a_scene_with_more_is_refused_by_name(scene: str, words: str, reason: str, tmp_path: Path):
    line = (f'models = "{" ".join(FEATURES)}"', f'models = "{words}"')
    path = template(
        tmp_path,
        "javascript",
        ("static forces rotation wrap", "static forces rotation friction wrap"),
    )
    path.write_text(path.read_text().replace(*line))
    run = played(path, scene)

    assert (run.status, run.reason.startswith(reason)) == ("unsupported", True), run.reason
    assert run.frictionless == (reason == "ball.js does not model friction")


JS, PY = "javascript", "python"
EACH = "expected is [x, y] for each of 2 disks"
FINITE = "expected are finite numbers"
ENDLESS = "step does not come back within 1 s in one call"
NO_READ = "has no function read; crosscheck new-engine NAME"
FAULTS = {  # language, what is replaced -> by what, the status, what the sentence says
    (JS, "d.x += d.u * dt"): [
        ("d.x = 0 / 0", "diverged", f'read returned ["NaN","NaN"] as position of disk 0; {FINITE}')
    ],
    (PY, "d.x += d.u * dt"): [
        ("d.x = float('nan')", "diverged", f"returned [nan, nan] as position of disk 0; {FINITE}")
    ],
    (JS, "disks.map((d) => [d.u, d.v])"): [
        ("[[0, 0]]", "error", f"read returned [[0,0]] as velocity; {EACH}"),
        ("disks.map((d) => [d.u])", "error", f"as velocity of disk 0; {EACH}"),
        ("disks.map(() => ['1', '2'])", "error", 'returned ["1","2"] as velocity of disk 0'),
    ],
    (PY, "[[d.u, d.v] for d in world.disks]"): [
        ("[[0, 0]]", "error", f"read returned [[0, 0]] as velocity; {EACH}"),
        ("[[1.0], [1.0, 2.0]]", "error", "read returned [[1.0], [1.0, 2.0]] as velocity; expected"),
        ("[['1', '2']] * 2", "error", "read returned [['1', '2'], ['1', '2']] as velocity"),
    ],
    (JS, "velocity: disks.map((d) => [d.u, d.v]),"): [("", "error", f"it has no velocity; {EACH}")],
    (PY, '"velocity": [[d.u, d.v] for d in world.disks],'): [
        ("", "error", f"it has no velocity; {EACH}")
    ],
    (JS, "function step("): [
        ("async function step(", "error", "step returned a Promise; expected is a plain function")
    ],
    (JS, "world.heard = [];\n"): [
        ("world.heard = []; for (;;);\n", "timeout", ENDLESS),
        ("nothing.x = 1;\n", "error", "threw ReferenceError: nothing is not defined (line 18,"),
    ],
    (PY, "    world.heard = []\n"): [
        ("    yield\n", "unsupported", "step is an async def, or has a yield: it runs nothing"),
        ("    while True: pass\n", "timeout", ENDLESS),
        ("    1 / 0\n", "error", "step raised ZeroDivisionError: division by zero (line "),
        ("    import os; os.abort()\n", "crashed", "called: its process was ended by SIGABRT"),
        ("    raise SystemExit(3)\n", "error", "step ends the process (SystemExit: 3)"),
    ],
    (JS, "world.heard.push([a.i, j, impulse])"): [
        ("world.heard.push([a.i, 7, impulse])", "error", "collisions returned [0,7,")
    ],
    (PY, "world.heard.append([a.i, j, impulse])"): [
        ("world.heard.append(impulse)", "error", "; expected are rows [i, j] or [i, j, impulse]")
    ],
    (JS, "return world.heard"): [("return 3", "error", "collisions returned 3; expected are rows")],
    (PY, "return world.heard"): [
        ("return None", "error", "collisions returned None; expected are rows")
    ],
    (JS, '"disks walls gravity'): [
        (
            '"balls walls gravity',
            "unsupported",
            "models has the word 'balls'; models must be a text",
        )
    ],
    (PY, 'models = "'): [
        ('modelled = "', "unsupported", "has no line models; models must be a text")
    ],
    (JS, "function read("): [("function reads(", "unsupported", NO_READ)],
    (PY, "def read("): [("def reads(", "unsupported", NO_READ)],
    (JS, "const disks = scene"): [
        ("scene.x.y; const disks = scene", "error", "create threw TypeError: ")
    ],
}
QUICK = 3  # of the faults that the fast suite plays
ROWS = [(*fault, *row) for fault, rows in FAULTS.items() for row in rows]


@pytest.mark.parametrize(
    ("kind", "old", "new", "status", "says"),
    [*ROWS[:QUICK], *(pytest.param(*each, marks=pytest.mark.slow) for each in ROWS[QUICK:])],
)
def test_a_fault_is_a_status_and_a_sentence(
    kind: str, old: str, new: str, status: str, says: str, tmp_path: Path
):
    path = template(tmp_path, kind, (old, new))
    row = row_of_file(path, patience=1.0)
    question = scenario("head_on_equal_e09")
    with closing(row.make()) as engine:
        engine.limit = 1.0  # type: ignore[attr-defined]
        run = play(engine, "x:own", question, question.dt(4))

    assert (run.status, says in run.reason, path.name in run.reason) == (status, True, True), (
        run.reason
    )


@pytest.mark.slow
def test_who_reports_no_collisions_is_not_said_to_miss_them(tmp_path: Path):
    path = template(tmp_path, "javascript", ("function collisions(", "function contacts("))
    silent, verdicts = played(path), missed(row_of_file(path), "collisions_are_reported")
    other = played(template(tmp_path, "javascript"))
    nothing = template(tmp_path, "javascript", ("return world.heard", "return []"))
    table = compare(scenario("head_on_equal_e09"), [silent, replace(other, profile="other")]).table
    notes = {
        (row.profile, row.versus): row.note
        for row in table[table.metric == "collisions_missed"].itertuples()
    }
    empty = compare(scenario("head_on_equal_e09"), [played(nothing)]).table

    assert silent.silent
    assert not other.silent
    assert verdicts == {"collisions_are_reported": "not asked"}
    assert notes["own", "truth"] == "not judged: an engine reports no collisions"
    assert notes["own", "x:other"] == "not judged: an engine reports no collisions"
    assert "1 of 1 collisions judged" in notes["other", "truth"]
    assert empty[empty.metric == "collisions_missed"].value.max() == 1


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.js", "const create = () => 0; function step() {} let read = () => 0;", "engine"),
        ("a.py", "from math import hypot as step, pi as create\nread = 3", "engine"),
        ("a.py", "if True:\n    def create(s, dt): pass", "engine"),
        ("a.js", "function create() {} function integrate() {}", "solver"),  # a helper of a solver
        ("a.js", "create = step = read = 1; function integrate() {}\nstep = read = 1", "solver"),
        ("a.js", "// function create() {}\nfunction integrate() {}", "solver"),
        (
            "a.py",
            "def create(): pass\ndef step(): pass\ndef read(): pass\ndef advance(): 0",
            "engine",
        ),
        ("a.py", "def advance(disks, world, dt, count): pass", "solver"),
        ("a.js", "function integrate( {", "solver"),  # what is no JavaScript is said where it runs
        ("a.js", "function hello() {}", "has neither the functions of the exercise"),
        ("a.py", "x = 1", "has neither the functions of the exercise"),
        (
            "a.js",
            "let create = 1; let step = 1; let read = 1; function projectObjects() {}",
            "has create, step and read, as an engine has, and projectObjects, as a solver of the",
        ),
    ],
)
def test_the_functions_of_a_file_decide_what_it_is(name: str, text: str, says: str, tmp_path: Path):
    path = tmp_path / name
    path.write_text(text)
    try:
        row = row_of_file(path)
        found = "solver" if row.exercise else "engine"
    except NotASolver as refusal:
        found = str(refusal)

    assert says in found


def test_new_engine_writes_what_works_and_overwrites_nothing(tmp_path: Path):
    made = [crosscheck("new-engine", name, cwd=tmp_path) for name in ENDS.values()]
    again = crosscheck("new-engine", "ball.js", cwd=tmp_path)
    other = crosscheck("new-engine", "ball.c", cwd=tmp_path)
    checked = crosscheck("check", "ball.py", cwd=tmp_path)

    assert [one.returncode for one in made] == [0, 0]
    assert "--engine ball.js" in made[0].stdout
    assert all(not row_of_file(tmp_path / name).exercise for name in ENDS.values())
    assert "--engine ball.py" in (tmp_path / "ball.py").read_text()
    assert (again.returncode, again.stderr) == (2, "ball.js: exists; name another file\n")
    assert (other.returncode, "name a .js or a .py file" in other.stderr) == (2, True)
    assert checked.returncode == 2
    assert "is an engine (create, step, read), and check is for solvers" in checked.stderr
    assert "crosscheck run bouncing_ball_e09 --engine ball.py" in checked.stderr


@pytest.mark.parametrize("kind", ENDS)
def test_a_file_that_cannot_be_loaded_has_one_finding_that_says_why(tmp_path, kind):
    # Probes would each start a process in vain, a minute in all, and say nothing more.
    path = tmp_path / ENDS[kind]
    path.write_text(TEMPLATES[kind].read_text().replace("read(", "look("))
    [one] = conform("x:own", row_of_file(path))
    assert (one.probe, one.verdict) == ("make", "breaks")
    assert f"{path.name} has no function read" in one.note
    run = played(path)
    assert (run.status, "has no function read" in run.reason) == ("unsupported", True)
