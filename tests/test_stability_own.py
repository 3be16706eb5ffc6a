"""The reasons given for limits of a scene that nobody here wrote: what is changed until the failing run works."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from reports.stability.cures import CURES, faster, larger, slower, smaller, why_played
from reports.stability.explain import explained, tried_out
from reports.stability.limits import NOT_KNOWN, QUICK, Limit, Search
from reports.stability.players import play_as
from reports.stability.vary import case_of_file, varied
from scenarios.files import read_scene_file
from scenarios.oracle import with_oracle

SCENES = Path(__file__).parent / "scenes"


@cache
def found(what: str, player: str, scene: str = "two.toml") -> Limit:
    """The limit on a scene of tests/scenes, with what cured its failure."""
    path = str(SCENES / scene)
    search = Search(case_of_file(path, what), player, QUICK)
    limit = search.limit()
    [known] = explained([tried_out(search, replace(limit, case=f"{path}:{what}"))])
    return known


@pytest.mark.parametrize(
    ("what", "player", "tells"),
    [
        ("offset", "box2d:matched", "positions are float32"),
        ("offset", "box2d_v3:matched", "positions are float32"),
        ("scale", "box2d:shipped", "threshold of restitution"),
        ("scale", "box2d_v3:shipped", "cap on speed"),
        ("speed", "reference:exercise", "a hit waits for the end of its step"),
    ],
)
def test_a_reason_is_what_the_failing_run_works_without(what: str, player: str, tells: str):
    """Two disks head-on at 1 m/s and 1/200 s: the mechanisms known from the atlas come out by themselves."""
    limit = found(what, player)

    assert tells in limit.reason
    assert limit.tested.startswith("works ")
    assert limit.why == limit.reason


def test_a_threshold_shows_where_the_scene_closes_at_it():
    """Disks that meet at 2 m/s meet at less than 1 m/s in a scene half as large; later a hit is missing for it."""
    assert 0 < found("scale", "box2d:shipped").fails_at < 0.5
    assert found("scale", "box2d:matched").verdict == "does not fail"


def test_where_nothing_cures_it_a_twin_may_tell_and_else_it_is_called_not_known():
    """Where the step is what is varied, a finer one is no proof: late hits alone have the limit. Or nothing helps."""
    limit = found("dt", "pymunk:matched")
    assert limit.why == "a hit waits for the end of its step"
    assert limit.tested == "the reference with late hits and nothing else has this limit"

    failing = limit.failing
    assert failing is not None
    nothing = replace(limit, case="x.toml:speed", twin="", trials=(replace(failing, broken="hits"),))
    reason, _, tested = why_played(nothing, "speed")
    assert reason.startswith(NOT_KNOWN)
    assert "in steps of an eighth" in reason
    assert tested == ""
    assert replace(nothing, reason=reason).why == reason


@pytest.mark.parametrize("change", [faster, slower, larger, smaller])
@pytest.mark.parametrize("player", ["reference:exercise", "reference:ordered"])
def test_a_solver_without_units_plays_a_similar_scene_to_the_same_bits(change, player: str):
    """So that none of these changes can help by chance: in it only what has a unit of its own plays otherwise."""
    one = replace(read_scene_file(SCENES / "bumper.toml"), substeps=(1,))
    other = change(one)
    run, same = play_as(player, one).trajectory, play_as(player, other).trajectory
    assert run is not None
    assert same is not None
    size = float(other.scene.radius[0] / one.scene.radius[0])

    assert np.array_equal(run.position * size, same.position)
    assert len(run.collisions) == len(same.collisions) > 0


def test_the_answer_of_a_similar_scene_is_the_one_of_the_scene():
    """Against the oracle's own, where it can follow both: they differ by the last places of the scene's numbers."""
    one = read_scene_file(SCENES / "two.toml")
    for what, x in (("scale", 2.0), ("offset", 3.0)):
        scenario = varied(str(SCENES / "two.toml"), what, x, 0, 1)
        own = with_oracle(scenario).truth
        assert scenario.truth is not None
        assert own is not None
        mine, its = scenario.truth(scenario.times), own(scenario.times)
        assert np.abs(mine.position - its.position).max() < 1e-12
        assert np.abs(mine.velocity - its.velocity).max() < 1e-12
        assert np.abs(mine.collisions.impulse - its.collisions.impulse).max() < 1e-12
        assert np.abs(mine.collisions.t - its.collisions.t).max() < 1e-12
    fast = faster(one)
    own = with_oracle(fast).truth
    assert fast.truth is not None
    assert own is not None
    assert np.abs(fast.truth(fast.times).position - own(fast.times).position).max() < 1e-12


def test_a_scene_in_which_nothing_can_go_wrong_has_limits_all_the_same():
    """A disk alone, without walls, in the exercise's box under gravity: there is nothing to judge, and no crash."""
    assert found("speed", "pymunk:matched", "wrapped.toml").verdict == "does not fail"


def test_every_change_is_tried_on_somebody():
    """None is left over."""
    players = ("reference:exercise", "pymunk:shipped", "box2d:shipped", "box2d:matched", "box2d_v3:shipped",
               "box2d_v3:matched")  # fmt: skip
    for name, cure in CURES.items():
        assert any(cure.fits(player, what) for player in players for what in ("dt", "speed", "offset")), name
