"""Runs of pymunk and both Box2Ds by their adapters against the engines called directly:
`plain_engines`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.scenarios import catalogue
from crosscheck2d.scenarios.model import Scenario
from tests.independent.plain_engines import PLAIN, Samples, Settings

pytestmark = pytest.mark.independent

Record = Callable[[str, object], None]

SCENES = (
    "free_fall",
    "head_on_equal_e09",
    "oblique_e05",
    "mass_ratios",
    "slow_collision",
    "near_miss",
    "bouncing_ball_e09",
    "box_billiard",
    "disk_between_static_disks",
    "slide_on_incline",
    "column_of_ten",
    "galperin_31",
    "cradle_touching",
    "spin_under_torque",
    "body_frame_thrust",
    "ship_thrust",
    "asteroids",
    "falling_box",
)
PLAYED = [f"{engine}:{profile}" for engine in PLAIN for profile in ("shipped", "matched")]
NAMES = ("position", "velocity", "angle", "angular_velocity")


def by_the_adapter(engine: str, scenario: Scenario) -> tuple[Run, dict[str, Any]]:
    made = ENGINES[engine].make()
    run = play(made, engine, scenario, scenario.dt(scenario.substeps[1]))
    made.close()
    return run, {name: asked for name, (asked, _) in run.settings.items() if asked is not None}


def unequal(run: Run, samples: Samples) -> list[str]:
    assert run.trajectory is not None
    pairs = zip(NAMES, (getattr(run.trajectory, name) for name in NAMES), samples)
    return [
        f"{name} by {np.abs(a - b).max():.2g}" for name, a, b in pairs if not np.array_equal(a, b)
    ]


@pytest.mark.parametrize("engine", PLAYED)
def test_an_adapter_plays_what_its_engine_plays_when_called_directly(
    engine: str, record_property: Record
):
    # with the settings that it says it asked for, and no others
    wrong, played, asked_for, read = [], 0, set[str](), set[str]()
    for name in SCENES:
        scenario = catalogue.scenario(name)
        run, asked = by_the_adapter(engine, scenario)
        assert run.status == "ok" or run.status == "unsupported", run.reason
        if run.status == "ok":
            played += 1
            settings = Settings(asked)
            samples = PLAIN[run.engine](scenario, run.dt, settings)
            asked_for, read = asked_for | set(asked), read | settings.read
            wrong += [f"{name}: {fault}" for fault in unequal(run, samples)]
    record_property(
        "found", f"engines: {engine}, {played} of {len(SCENES)} scenes, {len(wrong)} arrays differ"
    )

    assert not wrong
    assert asked_for <= read, "plain_engines.py does not know a setting"
    assert played > len(SCENES) / 2


@pytest.mark.parametrize(
    ("engine", "scene", "setting", "value"),
    [
        ("pymunk:matched", "falling_box", "iterations", 7),
        ("pymunk:matched", "head_on_equal_e09", "elasticity", 0.9),
        ("box2d:matched", "falling_box", "velocity, position iterations", "7, 3"),
        ("box2d:matched", "slow_collision", "unit of time in s", 1.0),
        ("box2d_v3:matched", "slow_collision", "restitution threshold in m/s", 1.0),
        ("box2d_v3:matched", "near_miss", "length unit in m", 1.0),
    ],
)
def test_a_setting_that_is_not_the_one_recorded_is_noticed(
    engine: str, scene: str, setting: str, value: Any
):
    scenario = catalogue.scenario(scene)
    run, asked = by_the_adapter(engine, scenario)
    plain = PLAIN[run.engine]

    assert not unequal(run, plain(scenario, run.dt, asked))
    assert unequal(run, plain(scenario, run.dt, {**asked, setting: value}))
