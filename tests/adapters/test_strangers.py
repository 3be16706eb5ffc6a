"""Engines as others write them: a class, a step that returns a new world, a page's names at the top
of a file; and what a scene tells them."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

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
ENGINES = {
    "instance.js": f'class Mine {{\n  models = "disks";{FLY_JS}}}\n',
    "static.js": f'class Mine {{\n  static models = "disks";{STATIC_JS}}}\n',
    "functions.js": f'const models = "disks";\n{FUNCTIONS_JS}',
    "instance.py": f"class Mine:\n    {LINES}{FLY_PY.format('self, ')}",
    "static.py": f"class Mine:\n    {LINES}{FLY_PY.format('')}",
    "page.js": (
        "const canvas = document.getElementById('c').getContext('2d'), t = Date.now();\n"
        "window.addEventListener('load', () => {}); requestAnimationFrame(() => 0);\n"
        "performance.now();\n"
        f'const models = "disks";\n{FUNCTIONS_JS}\nmodule.exports = {{ create, step, read }};\n'
    ),
}


@pytest.mark.parametrize("name", ENGINES)
def test_it_plays_free_flight(name: str, tmp_path: Path):
    """Each moves as it should, so that no step was lost."""
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
    """A list of the module that `create` fills again."""
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
    """It loads, every task can be asked, and none is right."""
    done = crosscheck("new-solver", name, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert crosscheck("new-solver", name, cwd=tmp_path).returncode == 2
    rows = check_solver(tmp_path / name)
    assert {row.verdict for row in rows if row.name == "loads"} == {"right"}
    assert {row.task for row in rows if row.verdict == "fault"} >= {"1", "2a"}


def test_a_box_is_told_where_four_walls_make_one():
    """In any order and direction; three walls, or four that leave a gap, are none."""
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
    """In one sentence."""
    (tmp_path / name).write_text("x")
    with pytest.raises(NotASolver, match=hint):
        read_solver(tmp_path / name)
