"""The search for a limit: brackets it, counts what failed, sees what works again, and says so when
nothing fails."""

from __future__ import annotations

import base64
import json
import os
import zlib
from collections.abc import Callable
from dataclasses import asdict, replace
from math import isnan, nan, sqrt
from typing import Any

import numpy as np
import pytest

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.causes import Cause, CauseKind
from crosscheck2d.reports.compare.view import cut
from crosscheck2d.reports.page.replay import pack_layers
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.cases_few import DT, EDGE, RADIUS, flyby, phase
from crosscheck2d.reports.stability.cases_many import gas
from crosscheck2d.reports.stability.command import csv_row
from crosscheck2d.reports.stability.explain import explained
from crosscheck2d.reports.stability.limits import (
    FULL,
    QUICK,
    Case,
    DrivenEngine,
    Limit,
    LimitSearch,
    Trial,
    play_as,
)
from crosscheck2d.reports.stability.predicates import Predicate, judge, read
from crosscheck2d.reports.stability.results import (
    AFTER,
    BEFORE,
    RESULTS,
    Task,
    near,
    part_of,
    with_replay,
)
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario, Trajectory
from tests.reports.stability.kept_limits import quick_limit

SCENE = lay_out(
    position=[[0, 0]],
    radius=1.0,
)
TOO_FAST = Predicate(
    "too fast",
    "the speed is above 1",
    "m/s",
    1.0,
    lambda _, played: read(played.velocity[0, 0, 0], 0.5, "it broke"),
)


def resting(scenario: Scenario) -> Run:
    """A run in which nothing changes."""
    state = scenario.scene.state
    names = ("position", "velocity", "angle", "angular_velocity")
    arrays = [np.array([getattr(state, name)] * 2) for name in names]
    return Run("made", "up", "made-up", 1.0, trajectory=Trajectory(scenario.times, *arrays))


def case(reading: Callable[[float, int], float], values: tuple[float, ...], **more: Any) -> Case:
    """A case whose runs read what a function of the value and the number of the run gives."""

    def scene(x: float, run: int) -> Scenario:
        moving = replace(SCENE, velocity=[[reading(x, run), 0]])
        return Scenario("made-up", "?", "", moving, 1.0, 1.0, (1,))

    def play(_: DrivenEngine, scenario: Scenario) -> tuple[Scenario, Run]:
        return scenario, resting(scenario)

    return Case("made-up", "?", scene, "x", values, TOO_FAST, play=play, **more)


def limit_of(tried: Case, form: Any = FULL) -> Limit:
    return LimitSearch(tried, "reference:exercise", form).limit()


UP, DOWN = (1.0, 3.0, 10.0, 30.0, 100.0), (100.0, 30.0, 10.0, 3.0, 1.0)


@pytest.mark.parametrize("form", [QUICK, FULL])
@pytest.mark.parametrize(
    ("values", "reading"), [(UP, lambda x, _: x / 17), (DOWN, lambda x, _: 17 / x)]
)
def test_the_bracket_holds_the_limit_and_is_as_close_as_the_form_says(form, values, reading):
    found = limit_of(case(reading, values), form)

    assert found.verdict == "limit"
    assert min(found.works_at, found.fails_at) <= 17 <= max(found.works_at, found.fails_at)
    assert max(found.works_at / found.fails_at, found.fails_at / found.works_at) <= form.ratio
    assert found.monotone


def test_what_is_counted_is_bracketed_by_neighbours():
    found = limit_of(case(lambda x, _: x / 17.5, UP, whole=True), replace(FULL, ratio=1.0))

    assert (found.works_at, found.fails_at) == (17, 18)


@pytest.mark.parametrize(
    ("reading", "verdict", "works", "fails"),
    [
        (lambda _: 0.5, "does not fail", (100, 100), None),
        (lambda _: 2.0, "never works", None, (1, 1)),
        (lambda x: 17 / x, "works only beyond", (17, 30), (10, 17)),
    ],
)
def test_where_no_stretch_of_values_works_before_a_failure_the_verdict_says_so(
    reading, verdict, works, fails
):
    limit = limit_of(case(lambda x, _: reading(x), UP))

    assert limit.verdict == verdict
    for value, span in ((limit.works_at, works), (limit.fails_at, fails)):
        assert isnan(value) if span is None else span[0] <= value <= span[1]


def test_a_few_values_that_work_beyond_more_that_fail_are_no_limit():
    # A step of a third of the run that meets its one collision by luck. A longer stretch is a
    # limit, and so is any that begins at the gentlest value; the harshest values may all work.

    def verdict(*works: float) -> tuple[str, bool]:
        found = limit_of(case(lambda x, _: 0.5 if x in works else 2.0, UP, refines=False), QUICK)
        return found.verdict, found.monotone

    assert verdict(3.0) == verdict(10.0, 30.0) == ("never works", False)
    assert verdict(3.0, 10.0) == ("limit", False)
    assert verdict(3.0, 30.0, 100.0) == ("works only beyond", False)
    assert verdict(1.0) == ("limit", True)


def test_one_run_in_sixteen_is_enough_to_fail_and_is_the_one_that_is_kept():
    rare = case(lambda x, run: 2.0 if run == 11 and x > 17 else 0.5, UP, runs=16)
    search = LimitSearch(rare, "reference:exercise", FULL)
    found = search.limit()
    failing = found.failing

    assert failing is not None
    assert (failing.failed, failing.runs, failing.first) == (1, 16, 11)
    assert found.works_at <= 17 <= found.fails_at
    assert search.seen[found.fails_at][0].scene.velocity[0, 0] == 2.0
    assert limit_of(replace(rare, runs=1)).verdict == "does not fail"


def test_a_number_that_is_none_fails_and_a_run_that_broke_off_fails_with_its_reason():
    refused = Run("made", "up", "made-up", 1.0, "unsupported", "no such thing")
    scenario = Scenario("made-up", "?", "", SCENE, 1.0, 1.0, (1,))

    reading = judge(TOO_FAST, scenario, refused)
    assert (reading.failed, reading.id, reading.text) == (True, "refused", "no such thing")
    nothing = TOO_FAST._replace(read=lambda _scenario, _played: read(float("nan"), 0.0, ""))
    assert judge(nothing, scenario, resting(scenario)).failed


def test_a_statistic_may_fail_by_chance_in_one_run_of_sixteen_and_not_in_two():
    one = case(lambda x, run: 2.0 if run < x else 0.5, (1.0, 2.0, 4.0), runs=16, by_chance=1 / 16)
    found = limit_of(one)

    assert (found.verdict, found.works_at) == ("limit", 1.0)
    assert (found.trials[0].failed, found.trials[0].runs) == (1, 16)
    assert limit_of(one, QUICK).works_at == 1.0
    assert limit_of(replace(one, by_chance=0.0)).verdict == "never works"


def test_the_limit_is_the_first_failure_and_what_works_beyond_is_seen_in_both_forms():
    one = case(lambda x, _: 2.0 if 5 < x < 20 or x > 50 else 0.5, UP)
    quick, full = (limit_of(one, form) for form in (QUICK, FULL))

    for found in (quick, full):
        assert found.verdict == "limit"
        assert found.works_at <= 5 <= found.fails_at < 10
        assert not found.monotone
        works = [trial.works for trial in found.trials if trial.value in UP]
        assert works == [True, True, False, True, False]
    assert quick.spacing == pytest.approx(3.0)
    assert full.spacing == pytest.approx(sqrt(3.0))


def test_the_values_of_the_quick_form_are_some_of_those_of_the_full_one():
    for name, one in CASES.items():
        assert set(one.scan(QUICK)) <= set(one.scan(FULL)), name


def test_what_few_runs_do_not_show_is_found_next_to_the_limit_by_all_of_them():
    # Run 11 fails from 4 on, where the four runs of the way see nothing; they alone would say 17.
    one = case(lambda x, run: 2.0 if x > 17 or (run == 11 and x > 4) else 0.5, UP, runs=16)
    found = limit_of(one, QUICK)

    assert found.works_at <= 4 <= found.fails_at
    assert limit_of(replace(one, runs=4), QUICK).works_at > 16


def test_a_value_is_left_at_its_first_failure_but_at_the_limit_all_is_played():
    found = limit_of(case(lambda x, run: 2.0 if x > 17 and run >= 1 else 0.5, UP, runs=16), QUICK)
    failing = found.failing

    assert failing is not None
    assert (failing.runs, failing.failed, failing.first, failing.left) == (16, 15, 1, False)
    played = {trial.value: (trial.runs, trial.left) for trial in found.trials}
    assert (played[1.0], played[100.0]) == ((4, False), (2, True))


def test_one_phase_alone_would_overlook_the_limit():
    one = CASES["tunnelling_head_on"]
    blind = replace(one, scene=lambda x, _run: flyby(x * RADIUS / DT, 1), runs=1)

    assert LimitSearch(blind, "reference:exercise", QUICK).limit().works_at > 3.5
    assert LimitSearch(one, "reference:exercise", QUICK).limit().fails_at < 2.1


def test_a_worker_that_dies_is_a_row_of_the_table():
    task = Task("slow_collision", "pymunk:matched", "quick")
    [(_, failure)] = run_all({task: os.abort}, workers=1)
    assert isinstance(failure, Failure)
    limit = task.lost(failure)
    assert isinstance(limit, Limit)
    row = csv_row(limit)

    assert row["predicate"] == "crashed"
    assert "SIGABRT" in row["event"]


def test_a_limit_comes_back_from_its_row_as_it_was():
    fails = limit_of(case(lambda _x, _run: 2.0, UP))
    cause = Cause(CauseKind.SETTING, "friction 0", shown="works with it")
    for found in (limit_of(case(lambda x, _: x / 17, UP)), replace(fails, cause=cause)):
        again = RESULTS["limit"].validate_python(json.loads(json.dumps(asdict(found))))
        assert repr(again) == repr(found)


def test_a_reason_is_tested_by_the_run_itself_or_called_likely():
    slow = quick_limit("tunnelling_head_on", "box2d_v3:matched")
    free = quick_limit("tunnelling_head_on", "box2d_v3:matched+bullets")
    elsewhere = replace(slow, works_at=3.9, fails_at=4.0)
    limits = [explained(pair)[0] for pair in ([slow, free], [slow], [elsewhere, slow])]

    assert [limit.cause and limit.cause.shown for limit in limits] == [
        "predicts 2; box2d_v3:matched+bullets gets farther",
        "predicts 2",
        "",
    ]
    assert {limit.cause and limit.cause.kind for limit in limits} == {CauseKind.LAW}
    assert csv_row(limits[2])["reason"].startswith("likely: ")


def test_of_a_failing_run_only_what_is_shown_is_kept():
    scenario = gas(0.3, 0, rows=3, columns=3, steps=4000, every=1)
    run = play_as("reference:exercise", scenario)
    whole = run.trajectory
    assert whole is not None
    failing = Trial(0.3, 1, 1, 2.0, first=0, at=float(scenario.times[3000]))
    found = Limit("gas", "reference:exercise", "quick", "never works", nan, 0.3, (failing,))
    search = LimitSearch(
        CASES["fast_gas"], "reference:exercise", QUICK, seen={0.3: (scenario, run)}
    )
    shown = near(failing, scenario)
    part = part_of(whole, shown, scenario)
    head = head_of(with_replay(search, found).replay)

    assert len(part) == len(shown) == BEFORE + AFTER + 1
    assert 0 < len(part.collisions) < len(whole.collisions) / 10
    assert np.array_equal(part.position, whole.position[shown])
    assert [layer["frames"] for layer in head["layers"]] == [len(shown)]
    assert head["opens"] < head["event"]["t"] == failing.at
    assert with_replay(search, replace(found, trials=())).replay == ""


def head_of(pack: str) -> Any:
    whole = zlib.decompress(base64.b64decode(pack))
    return json.loads(whole[4 : 4 + int.from_bytes(whole[:4], "little")])


def test_a_run_that_broke_off_is_kept_up_to_there():
    scenario = gas(0.3, 0, rows=3, columns=3, steps=100, every=1)
    whole = play_as("reference:exercise", scenario).trajectory
    assert whole is not None
    shown = np.arange(40, 61)
    part = part_of(cut(whole, 50), shown, scenario)
    pack = pack_layers(scenario, [(Run("made", "up", "gas", 1.0), part)], shown)
    [layer] = head_of(pack)["layers"]

    assert len(part) == 10
    assert (layer["frames"], layer["ends"]) == (10, f"{part.t[-1]:.4g}")


def test_phases_are_spread_evenly_and_drawn_and_fewer_are_the_first_of_more():
    # The step's very beginning first; no gap between 32 phases is wider than a sixteenth of a step.
    phases = [phase(run) for run in range(32)]

    assert phases[0] == EDGE
    assert phases[1:8:2] == pytest.approx([0.5, 0.25, 0.75, 0.125], abs=2 * EDGE)
    assert all(EDGE <= x <= 1 - EDGE for x in phases)
    assert np.diff(sorted(phases)).max() < 1 / 16 + 2 * EDGE
    random = phases[2::2]
    # what is random is no round share of a step
    assert min(abs(x * 32 - round(x * 32)) for x in random) > 1e-3
