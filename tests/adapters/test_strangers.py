"""Engines as others write them: a class, a step that returns a new world, a page's names at the top
of a file; and what a scene tells them."""

from __future__ import annotations

import shlex
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest

from crosscheck2d.adapters.host.engine import TEMPLATES, box_of, row_of_file
from crosscheck2d.adapters.host.file import NotASolver, SolverFailed, read_solver
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.check.solver import check_solver
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.terminal.command_line import crosscheck

FLY_JS = """
  create(scene, dt) { return scene.position.map((p, i) => ({ p, v: scene.velocity[i] })); }
  step(world, dt) {
    return world.map(({ p, v }) => ({ p: [p[0] + v[0] * dt, p[1] + v[1] * dt], v }));
  }
  read(world) { return { position: world.map((b) => b.p), velocity: world.map((b) => b.v) }; }
"""
STATIC_JS = FLY_JS
for _name in ("create", "step", "read"):
    STATIC_JS = STATIC_JS.replace(f"  {_name}(", f"  static {_name}(")
FUNCTIONS_JS = FLY_JS
for _name in ("create", "step", "read"):
    FUNCTIONS_JS = FUNCTIONS_JS.replace(f"  {_name}(", f"function {_name}(")
FLY_PY = """
    def create({0}scene, dt):
        return [(*p, *v) for p, v in zip(scene.position, scene.velocity)]

    def step({0}world, dt, forces):
        return [(x + u * dt, y + v * dt, u, v) for x, y, u, v in world]

    def read({0}world):
        return {{"position": [d[:2] for d in world], "velocity": [d[2:] for d in world]}}
"""
LINES = 'models = "disks"\n'


def stepping(begin: str, end: str, name: str = "fly.py") -> str:
    if name.endswith(".js"):
        text = f'const models = "disks";\n{FUNCTIONS_JS}'
        text = text.replace("return world.map", f"{begin}world.map")
        return text.replace("v }));", "v }))" + end)
    text = f"{LINES}{dedent(FLY_PY.format(''))}".replace("return [(x", f"{begin}[(x")
    return text.replace("in world]\n\ndef read", f"in world]{end}\n\ndef read")


ENGINES = {
    "instance.js": f'class Mine {{\n  models = "disks";{FLY_JS}}}\n',
    "static.js": f'class Mine {{\n  static models = "disks";{STATIC_JS}}}\n',
    "functions.js": f'const models = "disks";\n{FUNCTIONS_JS}',
    "instance.py": f"class Mine:\n    {LINES}{FLY_PY.format('self, ')}",
    "static.py": f"class Mine:\n    {LINES}{FLY_PY.format('')}",
    "second.js": f"class Ball {{ move() {{}} }}\nclass Mine {{\n  models = 'disks';{FLY_JS}}}\n",
    "own_step.js": f'const step = () => 7;\nclass Mine {{\n  models = "disks";{FLY_JS}}}\n',
    # a new world of another type; one whose step returns what is no world
    "tuple.py": stepping("return (*", ",)"),
    "object.js": stepping("const a = ", "; return { map: (f) => a.map(f) };", ".js"),
    "hits.py": stepping("world[:] = ", "\n    return []"),
    "hits.js": stepping("world.splice(0, 9, ...", "); return [];", ".js"),
    "few.py": stepping("return ", "").replace(", dt, forces", ", dt").replace("scene, dt", "scene"),
    "page.js": (
        "const canvas = document.getElementById('c').getContext('2d'), t = Date.now();\n"
        "window.addEventListener('load', () => {}); requestAnimationFrame(() => 0);\n"
        "performance.now();\n"
        f'const models = "disks";\n{FUNCTIONS_JS}\nmodule.exports = {{ create, step, read }};\n'
    ),
}


@pytest.mark.parametrize("name", ENGINES)
def test_it_plays_free_flight(name: str, tmp_path: Path):
    (tmp_path / name).write_text(ENGINES[name])
    scene = replace(scenario("head_on_equal_e09"), truth=None)
    run = play_once(row_of_file(tmp_path / name).make, "x:own", scene, scene.dt(1))
    assert run.status == "ok", run.reason
    assert run.trajectory is not None
    path = scene.scene.position + scene.scene.velocity * run.trajectory.t[-1]
    np.testing.assert_allclose(run.trajectory.position[-1], path, atol=1e-9)  # rounding of steps


KEEPS = {
    "keeps.py": (
        "    disks = [",
        "    disks = kept\n    disks += [",
        "models =",
        "kept = []\nmodels =",
    ),
    "keeps.js": (
        "const disks = scene.position",
        "kept.push(...scene.position",
        "  return { disks, walls",
        "  const disks = kept;\n  return { disks, walls",
        "radius[i], light: 1 / scene.mass[i], easy: 1 / scene.inertia[i],"
        "  // 0 for a disk that cannot move\n  }));",
        "radius[i], light: 1 / scene.mass[i], easy: 1 / scene.inertia[i],\n  })));",
        "const models",
        "const kept = [];\nconst models",
    ),
}


@pytest.mark.parametrize("name", KEEPS)
def test_disks_of_the_scene_before_are_named(name: str, tmp_path: Path):
    text = TEMPLATES["python" if name.endswith(".py") else "javascript"].read_text()
    text = text.replace("scene.radius[i], light", "scene.radius[i], light")
    for old, new in zip(KEEPS[name][::2], KEEPS[name][1::2]):
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (tmp_path / name).write_text(text)
    scene = scenario("head_on_equal_e09").scene
    with closing(row_of_file(tmp_path / name).make()) as engine:
        engine.load(scene, 1 / 256)
        engine.read()
        engine.load(scene, 1 / 256)
        with pytest.raises(SolverFailed, match="create keeps disks of the scene before"):
            engine.read()


@pytest.mark.parametrize("name", ["Exercise.js", "solver.py"])
def test_new_solver_writes_two_functions_that_do_nothing(name: str, tmp_path: Path):
    done = crosscheck("new-solver", name, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert crosscheck("new-solver", name, cwd=tmp_path).returncode == 2
    rows = check_solver(tmp_path / name)
    assert {row.verdict for row in rows if row.name == "loads"} == {"right"}
    assert {row.task for row in rows if row.verdict == "fault"} >= {"1", "2a"}


def test_a_box_is_told_where_four_walls_make_one():
    corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]
    walls = np.array([list(side) for side in zip(corners, corners[1:] + corners[:1])])
    assert box_of(walls) == box_of(walls[::-1, ::-1]) == [[0.0, 0.0], [4.0, 3.0]]
    assert box_of(walls[:3]) is None
    assert box_of(walls + np.arange(4)[:, None, None] / 8) is None
    assert box_of(np.zeros((0, 2, 2))) is None


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("mine.ts", "compile it to JavaScript"),
        ("mine.html", "save the text of its script"),
        ("mine.mjs", "leave out import and export"),
        ("mine.ipynb", "save its cells"),
        ("mine.zip", "unpack it"),
    ],
)
def test_a_file_of_another_kind_says_what_to_do(name: str, hint: str, tmp_path: Path):
    (tmp_path / name).write_text("x")
    with pytest.raises(NotASolver, match=hint):
        read_solver(tmp_path / name)
    done = crosscheck("run", "free_fall", "--engine", name, cwd=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert hint in done.stderr


def test_check_says_of_a_ported_engine_that_it_is_one(tmp_path: Path):
    assert crosscheck("new-engine", "a.py", "--y-down", cwd=tmp_path).returncode == 0
    done = crosscheck("check", "a.py", cwd=tmp_path)
    assert (done.returncode, "is an engine (create, step, read)" in done.stderr) == (2, True)


@pytest.mark.parametrize(
    ("name", "begin", "end"),
    [("lost.js", "return { moved: ", " };"), ("lost.py", "return {1: ", "}")],
)
def test_a_new_world_that_read_cannot_read_is_named(
    name: str, begin: str, end: str, tmp_path: Path
):
    (tmp_path / name).write_text(stepping(begin, end, name))
    scene = scenario("head_on_equal_e09")
    run = play_once(row_of_file(tmp_path / name).make, "x:own", scene, scene.dt(1))
    assert run.status == "error"
    assert "moved no disk; expected is that it changes its world, or returns" in run.reason


STRANGERS = Path(__file__).with_name("strangers")
# What has to be said of each code; none of its lines is written by hand, or changed.
HINTS = {
    "canvas_per_frame.js": (
        '--fields "x y dx dy radius mass" --move moveBall --collide resolveCollision'
        " --per-frame 60 --pixels 100 --y-down"
    ),
    "class_methods.js": (
        '--fields "pos.x pos.y vel.x vel.y r m" --ball "new Ball(x, y, r)" --move .update'
        " --collide .collide --gravity gravity --restitution restitution --pixels 100 --y-down"
    ),
    "whole_step.js": (
        '--fields "posX posY speedX speedY size weight" --step step --balls particles'
        ' --box "xmax ymax" --gravity g'
    ),
    "class_per_frame.py": (
        '--fields "x y vx vy radius mass" --ball "Ball(x, y, r)" --move .move --collide collide'
        " --per-frame 60 --pixels 100 --y-down"
    ),
    "module_list.py": (
        """--fields '["p"][0] ["p"][1] ["v"][0] ["v"][1] ["radius"] ["mass"]'"""
        """ --ball '{"p": [x, y], "v": [vx, vy]}' --step update --balls balls --gravity GRAVITY"""
        " --restitution E"
    ),
    "functions.py": (
        '--fields "center[0] center[1] velocity[0] velocity[1] r m" --collide elastic'
        ' --ball "Disk((x, y), (vx, vy), r, m)" --box "width height"'
        ' --move "advance_disk(ball, dt, width, height)"'
    ),
}


@pytest.mark.parametrize(
    ("name", "hints"),
    [
        pytest.param(*each, marks=[] if k % 4 == 0 else [pytest.mark.slow], id=each[0])
        for k, each in enumerate(HINTS.items())
    ],
)
def test_a_ball_code_is_ported_by_hints_alone(name: str, hints: str, tmp_path: Path):
    source = ("--from", str(STRANGERS / name))
    done = crosscheck("new-engine", name, *source, *shlex.split(hints), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    pair, crowd = (scenario(each) for each in ("head_on_equal_e1", "gas_of_100"))
    crowd = replace(crowd, duration=crowd.duration / 4)  # most codes are plain Python
    make = row_of_file(tmp_path / name).make
    runs = [play_once(make, "x:own", each, each.dt(4)) for each in (pair, crowd)]
    assert [(run.status, run.reason) for run in runs] == [("ok", "")] * 2
    met, gas = (run.trajectory for run in runs)
    assert met is not None
    assert gas is not None
    scene, end = pair.scene, met.t[-1]
    # equal masses exchange their velocities, a diameter apart; the collision is found at the end
    # of a step, which is the most that a disk is late
    np.testing.assert_allclose(met.velocity[-1], scene.velocity[::-1], atol=1e-9)
    apart = np.sign(scene.position[:, :1] - scene.position[::-1, :1]) * 2 * scene.radius[0]
    exchanged = (scene.position + scene.velocity * end)[::-1] + apart * [1.0, 0.0]
    late = 2 * np.abs(scene.velocity).max() * pair.dt(4)
    np.testing.assert_allclose(met.position[-1], exchanged, atol=late)
    energy = np.sum(gas.velocity**2, axis=(1, 2))  # equal masses
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)  # rounding of 100 disks
    assert np.abs(gas.velocity - gas.velocity[0]).max() > 1.0, "they collide"
    low, high = crowd.scene.walls.min(axis=(0, 1)), crowd.scene.walls.max(axis=(0, 1))
    assert np.all((gas.position > low) & (gas.position < high))


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("five.py", "move = lambda b, dt: (setattr(b, 'x', b.x + b.u * dt))\ncollide = print\n"),
        ("five.js", "const move = (b, dt) => { b.x += b.u * dt; }, collide = () => 0;\n"),
    ],
)
def test_hints_without_a_code_leave_a_place_for_it(name: str, code: str, tmp_path: Path):
    done = crosscheck("new-engine", name, "--fields", "x y u v r", cwd=tmp_path)
    assert (done.returncode, "once it has your code" in done.stdout) == (0, True), done.stderr
    path, pair = tmp_path / name, scenario("head_on_equal_e1")
    begin, place, end = path.read_text().partition(
        "Put your code here, above the class at the end."
    )
    assert place
    path.write_text(f"{begin}\n{code}{end}")
    run = play_once(row_of_file(path).make, "x:own", pair, pair.dt(1))
    assert run.status == "ok", run.reason
    assert run.trajectory is not None
    path_x = pair.scene.position[:, 0] + pair.scene.velocity[:, 0] * run.trajectory.t[-1]
    np.testing.assert_allclose(run.trajectory.position[-1, :, 0], path_x, atol=1e-9)


@pytest.mark.parametrize(
    ("hints", "says"),
    [
        ('--fields "x y"', "must be the names of x, y, vx, vy, radius and mass"),
        ('--fields "p.x p.y v.x v.y r"', "--ball has to say how such a ball is made"),
        ('--box "w"', "must be the names of its width and its height"),
        ("--pixels 0", "--pixels 0: must be above 0"),
        ("--from nothing.py", "--from nothing.py"),
        (f"--from {STRANGERS / 'functions.py'} --move fly", "has no fly; name a function"),
        (f"--from {STRANGERS / 'whole_step.js'}", "is in another language"),
    ],
)
def test_hints_that_do_not_fit_are_refused(hints: str, says: str, tmp_path: Path):
    done = crosscheck("new-engine", "a.py", *shlex.split(hints), cwd=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert says in done.stderr
    assert not (tmp_path / "a.py").exists()
