"""`crosscheck advise`: what it advises keeps the error, what it leaves out does not, and every
purpose sees a wrong engine."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import inf, nan
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.view import View
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import advice
from crosscheck2d.reports.speed.advice import (
    NEARER,
    NO_GAIN,
    NOT_COMPARED,
    ONLY_HERE,
    SAVES_TIME,
    TOO_FAR_OFF,
    Advice,
    Attempt,
    ChangedOption,
    Inquiry,
    those_that_keep,
)
from crosscheck2d.reports.speed.advise import print_advice, sentence_on_times
from crosscheck2d.reports.speed.plan import PLAIN
from crosscheck2d.reports.speed.purposes import PURPOSES
from crosscheck2d.reports.speed.scored_part import scored
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS
from tests.adapters.broken_engines import DoublesSpeed, Freezes, GainsEnergy
from tests.reports.terminal.command_line import crosscheck

attempt = partial(Attempt, "pymunk:matched", PLAIN)


@given(st.lists(st.floats(0, 2) | st.sampled_from([inf, nan]), min_size=1, max_size=9))
def test_the_advised_step_and_every_finer_one_keep_the_error(errors: list[float]):
    """And the next coarser one does not: luck at one step size does not count."""
    ladder = [attempt(2**k, 0.1 / 2**k, error) for k, error in enumerate(errors)]

    kept = those_that_keep(ladder, 1.0)

    first = ladder.index(kept[0]) if kept else len(ladder)
    assert kept == ladder[first:]
    assert all(one.error <= 1.0 for one in ladder[first:])
    assert first == 0 or not ladder[first - 1].error <= 1.0


@pytest.mark.parametrize(
    ("error", "cost", "verdict"),
    [
        (2.0, 0.5, TOO_FAR_OFF),
        (nan, 0.5, TOO_FAR_OFF),
        (0.5, 0.5, SAVES_TIME),
        (0.1, 2.0, NEARER),
        (0.5, 2.0, NO_GAIN),
        (0.5, 0.97, NO_GAIN),  # within the floor
    ],
)
def test_a_change_is_judged_by_its_error_first_and_then_by_its_cost(
    error: float, cost: float, verdict: str
):
    """Set against an error of 0.5 within 1 and a cost of 1 s; a saving within the noise is none."""
    plain = attempt(1, 0.1, 0.5, cost=1.0)

    changed = ChangedOption(plain, attempt(1, 0.1, error, cost=cost))
    assert changed.verdict(1.0, 0.05) == verdict
    # on a busy machine nothing is said of the cost
    unknown = NOT_COMPARED if verdict in (SAVES_TIME, NO_GAIN) else verdict
    assert changed.verdict(1.0, inf) == unknown


@pytest.mark.parametrize(
    ("nearby", "verdict"),
    [([(1.0, 0.4), (0.2, 0.1)], NEARER), ([(1.0, 0.4), (0.2, 0.2)], ONLY_HERE), ([], NEARER)],
)
def test_an_option_is_more_accurate_only_if_it_is_at_the_neighbouring_step_sizes(
    nearby: list[tuple[float, float]], verdict: str
):
    """At a single one a collision may fall on the edge of a step by chance."""
    plain, changed = attempt(1, 0.1, 0.5, cost=1.0), attempt(1, 0.1, 0.1, cost=1.0)

    assert ChangedOption(plain, changed, nearby).verdict(1.0, 0.1) == verdict


def test_an_engine_that_stops_before_the_end_of_the_scene_is_no_advice():
    """In a column the collisions accumulate: `event_driven` refuses to go on."""
    dt = open_scene("column_of_ten", 0).dt(1)
    found = [Attempt(name, PLAIN, 1, dt, 0.0) for name in ("event_driven:float64", "box2d:matched")]
    with Progress() as progress:
        able, partly = Inquiry("column_of_ten", 0, "trajectory", 1, progress).to_the_end(found)

    assert [one.name for one in able] == ["box2d:matched"]
    assert [one.name for one in partly] == ["event_driven:float64"]
    assert "accumulate" in partly[0].reason


def test_it_says_why_times_cannot_be_compared():
    """A small difference of two timings is not given as the reason."""
    advice = Advice("a", 1, 1, 0, [1], [attempt(1, 0.1, 0.5)], [], [], [], noise=0.01, busy=1.9)

    assert sentence_on_times(advice).startswith("Other programs keep 1.9 of ")
    assert "differ" not in sentence_on_times(advice)
    loud = sentence_on_times(replace(advice, noise=0.2))
    assert loud.startswith("Two timings of the same engine differ by 20%, and other programs keep")
    assert sentence_on_times(replace(advice, busy=0.0)).startswith("Two timings of the same engine")


@pytest.mark.parametrize(
    ("until", "collisions", "says"),
    [
        (3.0, 0, ["up to 3 of 3 s\n", "Cheapest first, in the whole scene\n"]),
        (
            1.2,
            4,
            ["up to 1.2 of 3 s\n", "first: error up to 1.2 of 3 s; cost of the whole scene\n"],
        ),
        (
            1.2,
            0,
            ["up to 1.2 of 3 s, before any collision\n", "collision; cost of the whole scene\n"],
        ),
    ],
)
def test_it_says_what_part_of_the_scene_is_judged(
    until: float, collisions: int, says: list[str], capsys: pytest.CaptureFixture[str]
):
    """And that a cost is of the whole scene, beyond the exact answer, too."""
    plain = attempt(1, 0.1, 0.5, cost=1.0)
    changes = [ChangedOption(plain, replace(plain, change="sleeping"))]
    advice = Advice("a", until, 3.0, collisions, [0.1, 0.05], [plain], [], [], changes, 0.0, 0.0)
    with mock.patch.dict(os.environ, {"COLUMNS": "200"}):
        print_advice(advice, "trajectory", 1.0)
    printed = capsys.readouterr().out

    assert all(each in re.sub(" *\n", "\n", printed) for each in says)
    needed = "the scene" if until == 3.0 else "this part of the scene"
    assert f"What {needed} does not need" in printed


def test_the_part_of_a_scene_that_is_judged_is_that_of_its_exact_answer():
    """With the collisions of that part alone: of those of the whole scene some are out of reach."""
    scenario, truth = scored("falling_box", 0)

    assert scenario.duration < open_scene("falling_box", 0).duration
    assert len(truth.collisions) > 0
    assert truth.collisions.t.max() <= scenario.duration


@pytest.mark.parametrize("purpose", PURPOSES)
@pytest.mark.parametrize("control", [DoublesSpeed, Freezes, GainsEnergy])
def test_every_purpose_sees_an_engine_that_is_wrong(purpose: str, control: type):
    """Negative controls in a scene of flight and bounces; the engine that they are made from is
    right."""
    scenario, truth = scored("box_billiard", 0)
    dt = scenario.dt(scenario.substeps[-1])

    def error(engine) -> float:
        run = play(engine, "reference:ordered", scenario, dt)
        view = View(scenario, dt, run.trajectory, truth, jumps_of(truth, scenario))
        return PURPOSES[purpose].error(view)

    assert error(ENGINES["reference:ordered"].make()) < 1e-3
    assert error(control()) > 0.01


def test_a_ladder_begins_at_the_steps_of_the_scene_and_halves_them():
    """Two step sizes at least, so that one finer can speak for a coarser."""
    for name in SCENARIOS:
        scenario = open_scene(name, 0)
        steps = Inquiry(name, 0, "trajectory", 1, Progress()).ladder
        assert steps[0] == scenario.substeps[0]
        assert len(steps) >= 2
        assert all(fine == 2 * coarse for coarse, fine in pairwise(steps))


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["no_such_scene"], "scenario 'no_such_scene' is not known"),
        (["free_fall", "--error", "0"], "--error '0' is no positive number; write 1% or 0.01"),
        (["free_fall", "--error", "nan%"], "--error 'nan%' is no positive number"),
        (["free_fall", "--for", "trajctory"], "did you mean trajectory?"),
        (["free_fall", "--engine", "pymonk"], "did you mean pymunk"),
    ],
)
def test_bad_input_is_one_clear_sentence(words: list[str], says: str, tmp_path: Path):
    """Exit 2, and nothing is measured."""
    done = crosscheck("advise", *words, cwd=tmp_path)

    assert (done.returncode, done.stdout) == (2, "")
    assert says in done.stderr


@pytest.mark.slow
def test_advice_names_those_that_keep_the_error_and_those_that_do_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Whatever the times are; an engine stands in one of the two lists, with the error it has."""
    monkeypatch.setattr(advice, "MOST_WORK", advice.MOST_WORK // 8)  # the finest steps take longest
    words = ["bouncing_ball_e09", "--engine", "reference", "--engine", "pymunk:shipped", "--json"]

    done = crosscheck("advise", *words, "--error", "0.1%", cwd=tmp_path)

    given = json.loads(done.stdout)
    assert done.returncode == 0
    assert [one["engine"] for one in given["cheapest_first"]] == ["reference:ordered"]
    assert all(one["error"] <= 0.001 for one in given["cheapest_first"])
    short = {one["engine"]: one for one in given["not_within"]}
    hand_written = {f"reference:{name}" for name in ("exercise", "neighbours", "lesson", "coulomb")}
    assert set(short) == {*hand_written, "pymunk:shipped"}
    assert all(one["error"] > 0.001 and one["why"] for one in short.values())


TORUS = """
name = "torus"
asks = "Where is a free disk on a torus?"
duration = 5.0
sample_interval = 0.02
gravity = [0.0, 0.0]
restitution = 1.0
[[disk]]
position = [0.3, -0.4]
velocity = [3.1, -1.7]
radius = 0.25
mass = 1.0
[wrap]
low = [-2.0, -2.0]
high = [2.0, 2.0]
"""


@pytest.mark.slow
def test_on_a_torus_free_flight_needs_no_small_step(tmp_path: Path):
    """20 ms, the coarsest; the exercise loses a part of a step at every edge."""
    (tmp_path / "torus.toml").write_text(TORUS)
    engines = ["--engine", "reference:exercise", "--engine", "pymunk:matched"]

    done = crosscheck("advise", "torus.toml", *engines, "--error", "1%", "--json", cwd=tmp_path)

    steps = {one["engine"]: one["dt_s"] for one in json.loads(done.stdout)["cheapest_first"]}
    assert steps["pymunk:matched"] == 0.02
    assert steps.get("reference:exercise", 0.0) < 0.001


@pytest.mark.long
def test_where_no_engine_keeps_the_error_the_answer_is_none_and_why(tmp_path: Path):
    """Exit 1, as a comparison that was asked for could not be made."""
    words = ["bouncing_ball_e09", "--engine", "box2d:shipped", "--error", "1e-6"]

    done = crosscheck("advise", *words, cwd=tmp_path)

    assert done.returncode == 1
    assert "No engine keeps this error" in done.stdout
    assert "no setting removes it (tried: `friction`" in " ".join(done.stdout.split())


@pytest.mark.parametrize("name", ["heavy_on_light", "swapped"])
def test_an_engine_whose_disk_is_through_the_floor_is_not_advised(name: str):
    """Up to 0.319 s, where it lands, all keep the error."""
    scene = str(Path(__file__).parents[3] / "tests" / "data" / "scenes" / f"{name}.toml")
    names = ("reference:exercise", "reference:coulomb", "box2d_v3:matched")
    dt = open_scene(scene, 0).dt
    with Progress() as progress:
        asked = Inquiry(scene, 0, "trajectory", 2, progress)
        ladders = [[Attempt(who, PLAIN, k, dt(k), 0.01) for k in (1, 2)] for who in names]
        able, unable = asked.first_to_the_end(ladders)

    assert [(one.name, one.substeps) for one in able] == [("box2d_v3:matched", 2)]
    assert {one.name for one in unable} == {"reference:exercise", "reference:coulomb"}
    assert all(one.reason.startswith("tunnels at 0.467 s (dt 16.7 ms); tunnels") for one in unable)
