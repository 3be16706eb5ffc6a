"""The cause of an error is what the error goes without: a setting of the engine, or a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from crosscheck2d.adapters.engines import FETCHED, row_of
from crosscheck2d.adapters.mechanisms.settings import (
    SETTINGS,
    Setting,
    find_remedy,
    settings_of,
    without_finer,
)
from crosscheck2d.adapters.npm_packages import missing
from crosscheck2d.reports.speed.causes import LATE, cause_of
from crosscheck2d.scenarios.files.scene_file import read_scene_file

CASES = Path(__file__).parents[3] / "tests" / "data" / "cases"
LACKING = [reason for row in FETCHED.values() if (reason := missing(row.package))]
fetched = pytest.mark.skipif(bool(LACKING), reason="; ".join(dict.fromkeys(LACKING)))
FLOOR = "[[wall]]\nstart = [-20.0, 0.0]\nend = [20.0, 0.0]\n"
SCENES = {
    "slides": ("-9.8", 0.0, ["[-5.0, 0.25]\nvelocity = [3.0, 0.0]"], FLOOR),
    "slow": ("0.0", 0.9, [f"[{x}, 0.0]\nvelocity = [{-0.8 * x}, 0.0]" for x in (-0.5, 0.5)], ""),
    "fast": ("0.0", 0.0, ["[0.0, 0.0]\nvelocity = [600.0, 0.0]"], ""),
    "creeps": ("0.0", 0.0, ["[0.0, 0.0]\nvelocity = [0.005, 0.0]"], ""),
    "half": ("0.0", 0.5, [f"[{x}, 0.0]\nvelocity = [{-2 * x}, 0.0]" for x in (-1.0, 1.0)], ""),
}
"""Gravity along y, e, positions and velocities of disks of 0.25 m and 1 kg, walls: small scenes, in
each of which a default bites."""


def cause(scene: str | Path, engine: str, tmp_path: Path, substeps: int = 2) -> str:
    path = scene if isinstance(scene, Path) else written(scene, tmp_path)
    return cause_of(str(path), 0, engine, substeps, "trajectory", 0.01)


def written(name: str, folder: Path) -> Path:
    gravity, e, disks, walls = SCENES[name]
    body = "".join(f"[[disk]]\nposition = {disk}\nradius = 0.25\nmass = 1.0\n" for disk in disks)
    path = folder / f"{name}.toml"
    path.write_text(
        f'name = "{name}"\nasks = "Which default bites?"\nduration = 3.0\nsample_interval = 0.02\n'
        f"substeps = [1, 2, 4]\ngravity = [0.0, {gravity}]\nrestitution = {e}\n{body}{walls}"
    )
    return path


THRESHOLD = "give times in units of 1000 s"
PYTHON = [
    ("slides", "box2d:shipped", "box2d: `friction` 0.2; set 0"),
    ("slides", "box2d_v3:shipped", "box2d_v3: `friction` 0.6; set 0"),
    ("slow", "box2d:shipped", f"a unit of time, compiled in; {THRESHOLD}"),
    ("slow", "box2d_v3:shipped", "box2d_v3: `restitution_threshold` 1; set 0"),
    ("fast", "box2d:shipped", "`b2_maxTranslation` 2 units of length a step, compiled in"),
    ("fast", "box2d_v3:shipped", "box2d_v3: `maximum_linear_speed` 400; set 1e+09"),
    ("creeps", "box2d:shipped", "box2d: `SetAllowSleeping` True; set False"),
    ("creeps", "box2d_v3:shipped", "box2d_v3: `enable_sleep` True; set False"),
    ("half", "pymunk:shipped", "pymunk: `elasticity` 0.5; set 0.707"),
]
JAVASCRIPT = [
    ("slides", "planck:shipped", "planck: `friction` 0.2; set 0"),
    ("slides", "rapier2d:shipped", "rapier2d: `friction` 0.5; set 0"),
    ("slides", "matter:shipped", "matter: `frictionAir` 0.01; set 0; `friction` 0.1; set 0"),
    ("slow", "planck:shipped", "planck: `Settings.velocityThreshold` 1; set 0"),
    ("slow", "matter:shipped", "`pixels a metre` 100; set 4e+05"),
    ("fast", "planck:shipped", "planck: `Settings.maxTranslation` 2; set 1e+09"),
    ("fast", "rapier2d:shipped", "rapier2d: `lengthUnit` 1; set 3"),
    ("fast", "matter:shipped", "matter: `frictionAir` 0.01; set 0"),
    ("creeps", "planck:shipped", "planck: `allowSleep` True; set False"),
    ("creeps", "rapier2d:shipped", "rapier2d: `canSleep` True; set False"),
]


@pytest.mark.parametrize(
    ("scene", "engine", "expected"),
    [
        *PYTHON,
        *(
            pytest.param(*case, marks=[fetched, pytest.mark.long if k % 3 else pytest.mark.slow])
            for k, case in enumerate(JAVASCRIPT)
        ),
    ],
)
def test_the_default_that_bites_is_named_with_what_to_set(
    scene: str, engine: str, expected: str, tmp_path: Path
):
    assert expected in cause(scene, engine, tmp_path)


@fetched
@pytest.mark.slow
def test_the_air_of_matter_slows_a_disk_on_a_slope(tmp_path: Path):
    # 1 % of the speed in 1/60 s, its default.
    said = cause(CASES / "ramp_with_air.toml", "matter:shipped", tmp_path, 4)
    assert "cause: matter: `frictionAir` 0.01; set 0: the error falls" in said


@pytest.mark.slow
@pytest.mark.parametrize("substeps", [4, 64])
@pytest.mark.parametrize("engine", ["box2d_v3:shipped", "box2d_v3:matched"])
def test_a_disk_that_lies_on_the_floor_is_not_late(engine: str, substeps: int, tmp_path: Path):
    # Two contributions that cancel are no cause. As matched the engine refuses the spin at coarser
    # steps.
    said = cause(CASES / "rolling_marble.toml", engine, tmp_path, substeps)
    named = said.partition(": without")[0]
    assert LATE not in named
    if engine == "box2d_v3:shipped":
        assert "sinks" in said
        assert "of its spin" in said
        assert "`set_contact_tuning: hertz` 30" in said


@pytest.mark.slow
def test_a_cap_on_spin_is_named_where_it_bites(tmp_path: Path):
    # 125 rad/s are 2.1 rad in a step of 1/60 s; no setting lifts the cap.
    said = cause(CASES / "rolling_marble.toml", "box2d_v3:shipped", tmp_path, 1)
    assert "`B2_MAX_ROTATION` 0.785 rad a step, compiled in; take steps of 5.56 ms" in said


def test_a_cause_is_judged_over_the_whole_scene(tmp_path: Path):
    # Not up to where the errors are small: by then no disk has struck the wall.
    path = tmp_path / "wall.toml"
    path.write_text(
        'name = "wall"\nasks = "Where is it?"\nduration = 0.3\nsample_interval = 0.0166666666666\n'
        "substeps = [1, 2, 4]\nrestitution = 1.0\n[[disk]]\nposition = [0.0, 0.0]\n"
        "velocity = [40.0, 0.0]\nradius = 0.1\nmass = 1.0\n"
        "[[wall]]\nstart = [5.07, -2.0]\nend = [5.07, 2.0]\n"
    )
    assert cause(path, "pymunk:shipped", tmp_path, 4).startswith(f"{LATE}: without it 0 of")


def test_where_no_setting_helps_what_was_tried_is_named(tmp_path: Path):
    said = cause("half", "box2d_v3:shipped", tmp_path)
    assert ": without it " in said
    assert "no setting removes it (tried: `friction`, `enable_sleep`" in said


def test_collision_code_without_a_budget_is_compared_with_what_it_may_do(tmp_path: Path):
    said = cause("half", "reference:coulomb", tmp_path)
    assert said.startswith(f"{LATE}")
    assert "of the error is left" in said


def test_what_leaves_more_than_half_of_the_error_is_ruled_out_not_named(tmp_path: Path):
    # reference:ordered collides at the time of impact: its error is rounding.
    said = cause("half", "reference:ordered", tmp_path)
    assert said.startswith("not known: without any of these more than half of it is left: ")


def knob(name: str) -> Setting:
    return Setting(name, 1, 0, {name: 0})


def test_the_fewest_settings_are_found():
    knobs = [knob(name) for name in "abc"]

    def found(error: Any) -> tuple[list[str], float]:
        remedy = find_remedy(knobs, error, 0.1)
        return [each.name for each in remedy.settings], remedy.after

    def in_turn(parameters: Mapping[str, Any]) -> float:
        return 1.0 - 0.6 * ("b" in parameters) - 0.4 * ("c" in parameters)

    def both(parameters: Mapping[str, Any]) -> float:
        return 0.0 if {"a", "c"} <= set(parameters) else 1.0

    assert found(lambda parameters: 0.0 if "b" in parameters else 1.0) == (["b"], 0.0)
    assert found(in_turn) == (["b", "c"], pytest.approx(0.0))
    assert found(both) == (["a", "c"], 0.0)
    assert found(lambda parameters: 1.0 - 0.4 * ("b" in parameters)) == ([], 1.0)
    assert found(lambda parameters: float("nan") if parameters else 1.0) == ([], 1.0)


@pytest.mark.parametrize("library", [name for name in SETTINGS if f"{name}:shipped" not in FETCHED])
def test_every_setting_can_be_made(library: str):
    scene = replace(read_scene_file(CASES / "rolling_marble.toml").scene, friction=0.0)
    for each in settings_of(f"{library}:shipped", scene, 1 / 60):
        chosen, _ = without_finer(each.parameters)
        engine = row_of(f"{library}:shipped").make(**chosen)
        engine.load(scene, 1 / 60)
        engine.close()
