"""A twin is the reference with some of an engine's habits: it has the engine's limit if it has the cause, else not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import nan
from typing import Any

import pytest

from adapters.mechanisms.features import changed_pymunk
from adapters.mechanisms.habits import FLIGHT, FRICTION, HABITS, POSITION_CORRECTION, RESTITUTION, habits_of
from reports.stability.cases import CASES
from reports.stability.explain import explained
from reports.stability.limits import QUICK, Limit, Trial
from reports.stability.search import Search
from reports.stability.twins import COLLISIONS_WAIT, LATE, Twins, told, twin_of
from reports.stability.variants import VARIANTS, Variant, play_as
from scenarios.catalogue import scenario


@cache
def found(case: str, engine: str) -> tuple[Search, Limit]:
    """The limit of an engine, and the search that remembers its failing run."""
    search = Search(CASES[case], engine, QUICK)
    return search, search.limit()


@pytest.mark.parametrize(
    ("case", "engine", "habits"),
    [
        ("dt_head_on_equal_e09", "pymunk:matched", LATE),  # one collision, nothing accelerates
        ("dt_head_on_equal_e09", "box2d_v3:matched", LATE),
        ("dt_wall_to_wall", "reference:lesson", LATE),
        ("dt_wall_to_wall", "reference:exercise", POSITION_CORRECTION),  # each time it is set onto the wall
        ("dt_wall_to_wall", "pymunk:shipped", RESTITUTION),
        ("slow_collision", "box2d:shipped", RESTITUTION),  # its threshold of 1 m/s
        ("slow_collision", "box2d_v3:shipped", RESTITUTION),
        ("restitution", "pymunk:shipped", RESTITUTION),  # e2 for e
        ("far_from_origin", "box2d:matched", "float32"),
        ("bounce_drift", "reference:exercise", FLIGHT),  # symplectic Euler
        ("bounce_drift", "reference:lesson", FLIGHT),  # explicit Euler
    ],
)
def test_what_is_known_to_be_the_cause_comes_out_alone(case: str, engine: str, habits: str):
    """Mechanisms with a closed form or a setting of their own."""
    assert twin_of(*found(case, engine)) == habits


def test_a_twin_without_the_cause_does_not_have_the_limit():
    """Negative control: neither late collisions alone, nor all of the engine's habits but the threshold."""
    search, limit = found("slow_collision", "box2d:shipped")
    twins = Twins.of(search, limit)
    assert twins is not None
    others = [habit for habit in twins.habits if habit.name != RESTITUTION]

    assert twins.alike(twins.habits)
    assert not twins.alike([])
    assert not twins.alike(others)
    assert [habit.name for habit in twins.needed()] == [RESTITUTION]


def test_a_cause_that_no_habit_names_gives_no_twin(monkeypatch: pytest.MonkeyPatch):
    """pymunk with a bug of its own, half of every elasticity, under the name of one that has none."""

    def halved() -> Any:
        engine = changed_pymunk()
        load = engine.load
        engine.load = lambda scene, dt: load(replace(scene, restitution=scene.restitution / 2), dt)
        return engine

    monkeypatch.setitem(VARIANTS, "pymunk:matched", Variant("pymunk:matched", halved))
    search = Search(CASES["slow_collision"], "pymunk:matched", QUICK)
    limit = search.limit()

    assert limit.verdict == "never works"
    assert twin_of(search, limit) == ""


def test_where_an_engine_works_nowhere_a_twin_must_read_as_much_as_it_does():
    """Failing anywhere proves nothing of one that fails everywhere: its number has to come out."""
    search, limit = found("dt_wall_to_wall", "pymunk:shipped")
    twins = Twins.of(search, limit)
    assert twins is not None
    far = replace(twins, reading=twins.reading._replace(value=3 * twins.reading.value))

    assert limit.verdict == "never works"
    assert twins.alike(twins.habits)
    assert not far.alike(twins.habits)


@pytest.mark.parametrize("engine", ["reference:ordered", "event_driven:float64"])
def test_of_an_engine_whose_habits_nobody_knows_there_is_no_twin(engine: str):
    """Late collisions would be no news of one whose collisions are not late."""
    search = Search(CASES["overlap_recovery"], engine, QUICK)
    assert twin_of(search, search.limit()) == ""


def test_a_written_reason_that_speaks_of_something_else_gives_way_to_the_twin():
    """And where it speaks of what the twin has, it stays, and says how it was tested."""
    failing = Trial(10.0, 1, 1, 2.0, 0)
    limit = Limit("column", "pymunk:matched", "quick", "limit", 5.0, 10.0, (failing,))
    [kept, other, untested] = explained(
        [replace(limit, twin=f"{FLIGHT}, {POSITION_CORRECTION}"), replace(limit, twin=FRICTION), limit]
    )

    assert "corrected by a share per step" in kept.reason
    assert (
        kept.tested
        == "the reference with late collisions and the engine's flight and position correction has this limit"
    )
    assert other.reason == "friction takes speed along the contact"
    assert other.source == "the engine's default"
    assert untested.why.startswith("likely: overlaps are corrected")


@pytest.mark.parametrize("engine", HABITS)
def test_every_habit_has_words(engine: str):
    """All of an engine's for which the reference has a switch."""
    one = scenario("head_on_equal_e09")
    settings = play_as(engine, replace(one, substeps=(4,))).settings
    names = [habit.name for habit in habits_of(engine, settings, one.scene, one.dt(4)) if habit.switches]
    limit = Limit("slow_collision", engine, "quick", "never works", nan, 1.0, ())

    assert told(replace(limit, twin=LATE))[0] == COLLISIONS_WAIT
    assert len(names) >= 2
    for name in names:
        assert told(replace(limit, twin=name))[0] not in ("", COLLISIONS_WAIT)
    assert told(replace(limit, twin=", ".join(names)))[0].count("; ") >= len(names) - 1
