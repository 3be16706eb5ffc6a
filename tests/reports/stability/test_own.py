"""Limits of a scene that nobody here wrote, and their causes: what is changed until the failing run
works. One surface is one contact, however many walls it has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.adapters.engines import FETCHED, row_of
from crosscheck2d.adapters.npm_packages import missing
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.cli import VARIED
from crosscheck2d.reports.compare.causes import Cause, CauseKind
from crosscheck2d.reports.compare.collisions import first_on_line, on_faces, thrown_off
from crosscheck2d.reports.run.pool import Failure
from crosscheck2d.reports.stability import explain
from crosscheck2d.reports.stability.cases import (
    CASES,
    VARIES,
    case_named,
    heaviest,
    unusable,
)
from crosscheck2d.reports.stability.explain import (
    INTERVENTIONS,
    cause_by_intervention,
    cause_by_settings,
    explained,
    reason_of,
    with_replays,
)
from crosscheck2d.reports.stability.limits import (
    FULL,
    QUICK,
    Limit,
    LimitSearch,
    Trial,
    taking_part,
)
from crosscheck2d.reports.stability.predicates import judge
from crosscheck2d.reports.stability.results import Task
from crosscheck2d.scenarios.files.scene_file import read_scene_file
from crosscheck2d.scenarios.truth.exact import with_oracle

SCENES = Path(__file__).parents[3] / "tests" / "data" / "scenes"
PIECES = "../cases/pieces.toml"
HEAVIEST = {"../cases/heavy_on_light.toml": 1, "../cases/swapped.toml": 0}
JOIN = "the walls of one floor act as several; join them into one wall"


def search_in(scene: str, what: str, engine: str) -> LimitSearch:
    return LimitSearch(case_named(f"{SCENES / scene}:{what}"), engine, QUICK)


def final_cause(search: LimitSearch) -> Cause:
    [limit] = explained([with_replays(search, search.limit())])
    assert limit.cause is not None
    return limit.cause


@pytest.mark.parametrize(
    ("what", "engine", "expected"),
    [
        ("offset", "box2d:matched", "positions are float32"),
        ("offset", "box2d_v3:matched", "positions are float32"),
        ("scale", "box2d:shipped", "`b2_maxTranslation`"),
        ("scale", "box2d_v3:shipped", "`maximum_linear_speed` 400; set 1e+09"),
        (
            "speed",
            "reference:exercise",
            "a collision takes effect at the end of the step in which it is found",
        ),
    ],
)
def test_a_reason_is_what_the_failing_run_works_without(what: str, engine: str, expected: str):
    search = search_in("two.toml", what, engine)
    limit = search.limit()
    cause = cause_by_settings(search, limit)
    if cause.kind is not CauseKind.SETTING:
        cause = cause_by_intervention(search, limit, INTERVENTIONS)

    assert cause is not None
    assert expected in cause.text
    assert cause.shown.startswith("works ")
    assert cause.sentence == cause.text


def test_where_no_intervention_helps_an_ablation_shows_why():
    # where the step is what is varied, a finer one is no proof
    assert final_cause(search_in("two.toml", "dt", "pymunk:matched")) == Cause(
        CauseKind.MECHANISM,
        "a collision takes effect at the end of the step in which it is found",
        "contacts are detected once per step",
        "the reference with end-of-step detection and nothing else has this limit",
    )


def test_what_nothing_helps_is_called_not_known(monkeypatch: pytest.MonkeyPatch):
    search = search_in("two.toml", "speed", "pymunk:matched")
    monkeypatch.setattr(explain, "sufficient_mechanisms", lambda *_: ())
    monkeypatch.setattr(explain, "cause_by_intervention", lambda *_: None)
    cause = final_cause(search)
    assert (cause.kind, cause.shown) == (CauseKind.UNKNOWN, "")
    assert "in steps of an eighth" in cause.sentence
    assert cause.sentence == cause.text


def test_the_answer_of_a_similar_scene_is_the_one_of_the_scene():
    # Against the oracle's own, where it can follow both: they differ by the last places of the
    # scene's numbers.
    for what, x in (("scale", 2.0), ("offset", 3.0)):
        scenario = case_named(f"{SCENES / 'two.toml'}:{what}").scene(x, 0)
        own = with_oracle(scenario).truth
        assert scenario.truth is not None
        assert own is not None
        mine, its = scenario.truth(scenario.times), own(scenario.times)
        assert np.abs(mine.position - its.position).max() < 1e-12
        assert np.abs(mine.velocity - its.velocity).max() < 1e-12
        assert np.abs(mine.collisions.impulse - its.collisions.impulse).max() < 1e-12
        assert np.abs(mine.collisions.t - its.collisions.t).max() < 1e-12


def test_a_scene_in_which_nothing_can_go_wrong_has_limits_all_the_same():
    limit = search_in("wrapped.toml", "speed", "pymunk:matched").limit()
    assert limit.verdict == "does not fail"


def test_every_change_is_tried_on_somebody():
    engines = (
        "reference:exercise",
        "pymunk:shipped",
        "box2d:shipped",
        "box2d:matched",
        "box2d_v3:shipped",
        "box2d_v3:matched",
        *FETCHED,
    )
    for intervention in INTERVENTIONS:
        assert any(
            intervention.fits(engine, what)
            for engine in engines
            for what in ("dt", "speed", "offset")
        ), intervention


def test_a_collision_that_nobody_makes_fails_however_near_to_the_start_it_is():
    # `match` leaves out a collision within two steps of the start
    search = search_in("two.toml", "speed", "reference:exercise")
    fast = search.trial(1000.0)

    assert (fast.works, fast.broken) == (False, "collisions")
    assert search.trial(1.0).works
    assert search_in("two.toml", "speed", "event_driven:float64").trial(1000.0).works


def test_a_disk_that_float32_keeps_where_it_is_fails():
    # A million metres out the last place is 6 cm, and a step of 2 cm is none, whatever the velocity
    # says.
    engines = ("box2d:matched", "reference:exercise", "event_driven:float64")
    float32, *others = (search_in("two.toml", "offset", name).trial(1e6) for name in engines)

    assert (float32.works, float32.broken) == (False, "wrong distance")
    assert all(trial.works for trial in others)


def test_a_disk_whose_speed_an_engine_caps_fails():
    # Box2D moves a disk by 2 m in a step at most: 240 m/s in steps of 1/120 s. At 1200 m/s the ball
    # does not get as far as the exact answer says, whatever its velocity is read to be.
    search = search_in("bullet.toml", "speed", "box2d:shipped")
    fast = search.trial(10.0)

    assert (fast.works, fast.broken) == (False, "wrong distance")
    assert fast.event == "disk 0 moves by 0.2 of its distance"
    assert search.trial(1.0).works


@pytest.mark.parametrize("x", [0.00294, 0.00632])
def test_a_disk_that_is_struck_twice_between_two_samples_is_not_called_stuck(x: float):
    # In the cradle it leaves as it came, at rest or not, and has gone less than that. But for its
    # collisions it would be called so at both steps.
    trial = LimitSearch(CASES["dt_cradle_with_gaps"], "box2d_v3:matched", FULL).trial(x)
    assert trial.works, trial.event


@pytest.mark.parametrize("name", ["tunnelling_mine.toml", "dt_mine.toml", "overlap_mine.toml"])
def test_the_name_of_a_scene_file_does_not_pick_its_reason(name: str):
    failing = Trial(2.0, 1, 1, 2.0, 0, broken="refused")
    limit = Limit(f"{name}:speed", "box2d:matched", "quick", "limit", 1.0, 2.0, (failing,))

    assert reason_of(limit) is None
    assert reason_of(replace(limit, engine="event_driven:float64")) is not None


def test_the_help_names_what_can_be_varied():
    assert VARIED.split(", ") == list(VARIES)


def test_what_ended_without_a_result_has_no_reason_of_physics():
    task = Task("tunnelling_head_on", "pymunk:matched", "quick")
    [known] = explained([task.lost(Failure("timeout", "3600 s"))])

    assert known.cause is None


LACKING = [reason for row in FETCHED.values() if (reason := missing(row.package))]
fetched = pytest.mark.skipif(bool(LACKING), reason="; ".join(dict.fromkeys(LACKING)))
RIGHT = ["reference:exercise", "reference:ordered", "pymunk:matched", "box2d:matched"]
# at 240 Hz these hit the ends of the walls on which a disk slides: 1.8 radii off after 2 s
GHOSTS = ["box2d_v3:matched", pytest.param("rapier2d:matched", marks=fetched)]


@pytest.mark.parametrize("engine", RIGHT)
def test_a_floor_of_pieces_is_one_contact_for_right_engines(engine: str):
    scenario = read_scene_file(SCENES / PIECES)
    for substeps in scenario.substeps:
        run = play_once(row_of(engine).make, engine, scenario, scenario.dt(substeps))
        assert run.trajectory is not None
        assert len(run.trajectory.collisions) > 5
        assert len(on_faces(run.trajectory, scenario.scene)) == 1
        assert not judge(unusable, scenario, run).failed


@pytest.mark.parametrize("engine", GHOSTS)
def test_a_ghost_collision_is_named_and_gone_on_one_wall(engine: str):
    scenario = read_scene_file(SCENES / PIECES)
    run = play_once(row_of(engine).make, engine, scenario, scenario.dt(4))
    assert scenario.truth is not None
    assert run.trajectory is not None
    share, at, disk, wall = thrown_off(
        run.trajectory, scenario.truth(scenario.times), scenario.scene
    )
    assert share > 1
    assert (disk, wall) == (0, 0)
    assert np.isfinite(at)
    reading = judge(unusable, scenario, run)
    assert reading.id == "ghost collision"
    assert "where two of its walls meet" in reading.text


@pytest.mark.slow
@pytest.mark.parametrize("engine", GHOSTS)
def test_the_reason_of_a_ghost_collision_is_the_walls_that_meet(engine: str):
    with taking_part({engine: FETCHED[engine]} if engine in FETCHED else {}):
        cause = final_cause(search_in(PIECES, "dt", engine))
    assert cause.text.endswith(JOIN)
    assert cause.shown == "works on a floor of one wall"


def test_walls_that_are_in_line_to_seven_digits_are_one_surface():
    # The digits of a file, and of an engine in float32; the next digit counts.
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
    cause = final_cause(LimitSearch(CASES[case], engine, QUICK))
    assert cause.text.startswith(setting)
    assert (cause.kind, cause.shown) == (CauseKind.SETTING, "works with it")


@pytest.mark.slow
def test_a_wrong_distance_is_no_ghost_collision():
    assert final_cause(search_in(PIECES, "dt", "reference:ordered")).text == JOIN


@pytest.mark.parametrize(
    "engine",
    ["pymunk:matched", "box2d_v3:shipped", pytest.param("box2d:matched", marks=pytest.mark.slow)],
)
def test_the_order_of_the_disks_does_not_decide_the_limit(engine: str):
    limits = [search_in(path, "mass_ratio", engine).limit() for path in HEAVIEST]
    brackets = [(limit.works_at, limit.fails_at) for limit in limits]
    assert limits[0].verdict == limits[1].verdict
    assert np.array_equal(*brackets, equal_nan=True)


def test_the_ratio_is_varied_both_ways_and_the_disk_and_the_step_are_named():
    for path, disk in HEAVIEST.items():
        assert heaviest(read_scene_file(SCENES / path).scene) == disk
        case = case_named(f"{SCENES / path}:mass_ratio")
        assert case.parameter == f"mass of disk {disk}, times and divided by, at dt = 0.00833 s"
        masses = [case.scene(10.0, run).scene.mass[disk] for run in range(case.runs)]
        assert masses == pytest.approx([1000.0, 10.0])
