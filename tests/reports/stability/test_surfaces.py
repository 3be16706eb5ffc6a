"""One surface is one contact, however many walls it has; and the order of disks and the step of a
file do not decide a limit without a word."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.adapters.engines import FETCHED, row_of
from crosscheck2d.adapters.npm_packages import missing
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare.causes import CauseKind
from crosscheck2d.reports.compare.collisions import first_on_line, on_faces, thrown_off
from crosscheck2d.reports.stability.cases import CASES as LIMITS_OF
from crosscheck2d.reports.stability.explain import explained, with_replays
from crosscheck2d.reports.stability.limits import QUICK, Limit, LimitSearch
from crosscheck2d.reports.stability.predicates import judge
from crosscheck2d.reports.stability.predicates_usable import USABLE
from crosscheck2d.reports.stability.variants import taking_part
from crosscheck2d.reports.stability.vary import case_of_file, heaviest
from crosscheck2d.scenarios.files.scene_file import read_scene_file

CASES = Path(__file__).parents[3] / "tests" / "data" / "cases"
PIECES = CASES / "pieces.toml"
LACKING = [reason for row in FETCHED.values() if (reason := missing(row.package))]
fetched = pytest.mark.skipif(bool(LACKING), reason="; ".join(dict.fromkeys(LACKING)))
RIGHT = ["reference:exercise", "reference:ordered", "pymunk:matched", "box2d:matched"]
GHOSTS = ["box2d_v3:matched", pytest.param("rapier2d:matched", marks=fetched)]
"""At 240 Hz these hit the ends of the walls on which a disk slides: 1.8 radii off after 2 s."""


@pytest.mark.parametrize("engine", RIGHT)
def test_a_floor_of_pieces_is_one_contact_for_right_engines(engine: str):
    """The next piece is no collision, in any step size."""
    scenario = read_scene_file(PIECES)
    for substeps in scenario.substeps:
        run = play_once(row_of(engine).make, engine, scenario, scenario.dt(substeps))
        assert run.trajectory is not None
        assert len(run.trajectory.collisions) > 5
        assert len(on_faces(run.trajectory, scenario.scene)) == 1
        assert not judge(USABLE, scenario, run).failed


@pytest.mark.parametrize("engine", GHOSTS)
def test_a_ghost_collision_is_named_and_gone_on_one_wall(engine: str):
    """By its jump off the floor, where it happens, and what is hit."""
    scenario = read_scene_file(PIECES)
    run = play_once(row_of(engine).make, engine, scenario, scenario.dt(4))
    assert scenario.truth is not None
    assert run.trajectory is not None
    share, at, disk, wall = thrown_off(
        run.trajectory, scenario.truth(scenario.times), scenario.scene
    )
    assert share > 1
    assert (disk, wall) == (0, 0)
    assert np.isfinite(at)
    reading = judge(USABLE, scenario, run)
    assert reading.id == "ghost collision"
    assert "where two of its walls meet" in reading.text


@pytest.mark.slow
@pytest.mark.parametrize("engine", GHOSTS)
def test_the_reason_of_a_ghost_collision_is_the_walls_that_meet(engine: str):
    """The failing run works when the walls are joined."""
    with taking_part({engine: FETCHED[engine]} if engine in FETCHED else {}):
        limit = limit_of(PIECES, "dt", engine)
    assert limit.cause is not None
    assert limit.cause.text.endswith(
        "the walls of one floor act as several; join them into one wall"
    )
    assert limit.cause.shown == "works on a floor of one wall"


def test_walls_that_are_in_line_to_seven_digits_are_one_surface():
    """The digits of a file, and of an engine in float32; the next digit counts."""
    walls = np.array([[[0.0, 0.0], [12.0, 0.0]], [[12.0, 0.0], [24.0, 1e-6]]])
    assert first_on_line(walls, 1) == 0
    assert first_on_line(walls + [[[0.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1e-5]]], 1) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "engine", "setting"),
    [
        ("slow_collision", "box2d_v3:shipped", "box2d_v3: `restitution_threshold` 1; set 0"),
        ("scale_up", "box2d:shipped", "box2d: `b2_maxTranslation` 2 units of length a step"),
        ("strong_friction", "pymunk:shipped", "pymunk: `friction` 0."),
        ("overlap_recovery", "pymunk:shipped", "pymunk: `collision_slop` 0.1; set 2.5e-07"),
    ],
)
def test_a_default_is_named_with_what_to_set(case: str, engine: str, setting: str):
    """The setting that leaves least, not the first with which the failing run just works."""
    search = LimitSearch(LIMITS_OF[case], engine, QUICK)
    [limit] = explained([with_replays(search, search.limit())])
    assert limit.cause is not None
    assert limit.cause.text.startswith(setting)
    assert (limit.cause.kind, limit.cause.shown) == (CauseKind.SETTING, "works with it")


@pytest.mark.slow
def test_a_wrong_distance_is_no_ghost_collision():
    """In steps of 0.15 s: joined walls help, and nothing was thrown off."""
    limit = limit_of(PIECES, "dt", "reference:ordered")
    assert limit.failing is not None
    assert limit.failing.broken != "ghost collision"
    assert limit.cause is not None
    assert limit.cause.text == "the walls of one floor act as several; join them into one wall"


def limit_of(path: Path, what: str, engine: str) -> Limit:
    """The limit of a scene file with its reason."""
    search = LimitSearch(case_of_file(str(path), what), engine, QUICK)
    [limit] = explained([with_replays(search, replace(search.limit(), case=f"{path}:{what}"))])
    return limit


@cache
def ratio(name: str, engine: str) -> tuple[str, float, float]:
    """Verdict, and where it works and fails."""
    case = case_of_file(str(CASES / f"{name}.toml"), "mass_ratio")
    limit = LimitSearch(case, engine, QUICK).limit()
    return limit.verdict, limit.works_at, limit.fails_at


@pytest.mark.parametrize(
    "engine",
    ["pymunk:matched", "box2d_v3:shipped", pytest.param("box2d:matched", marks=pytest.mark.slow)],
)
def test_the_order_of_the_disks_does_not_decide_the_limit(engine: str):
    """heavy_on_light and swapped are one scene."""
    one, other = ratio("heavy_on_light", engine), ratio("swapped", engine)
    assert one[0] == other[0]
    assert np.array_equal(one[1:], other[1:], equal_nan=True)


def test_the_ratio_is_varied_both_ways_and_the_disk_and_the_step_are_named():
    """The heaviest disk, wherever it stands in the file."""
    for name, disk in (("heavy_on_light", 1), ("swapped", 0)):
        path = CASES / f"{name}.toml"
        assert heaviest(read_scene_file(path).scene) == disk
        case = case_of_file(str(path), "mass_ratio")
        assert case.parameter == f"mass of disk {disk}, times and divided by, at dt = 0.00833 s"
        masses = [case.scene(10.0, run).scene.mass[disk] for run in range(case.runs)]
        assert masses == pytest.approx([1000.0, 10.0])
