"""An ablation is the reference with some of an engine's mechanisms: it has the engine's limit if it
has the cause, else not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.table import (
    FLIGHT,
    FRICTION,
    MECHANISMS,
    NAMES,
    POSITION_CORRECTION,
    RECYCLING,
    RESTITUTION,
    mechanisms_of,
)
from crosscheck2d.reports.compare.causes import (
    ACTS_AT_END,
    LATE,
    by_mechanisms,
    mechanism_words,
)
from crosscheck2d.reports.compare.verdicts import Verdict
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.explain import LAWS, ablations, explained, sufficient_mechanisms
from crosscheck2d.reports.stability.limits import (
    DRIVEN_ENGINES,
    QUICK,
    DrivenEngine,
    Limit,
    LimitSearch,
    Trial,
    play_as,
)
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario, Trajectory
from tests.reports.stability.kept_limits import quick_search


@pytest.mark.parametrize(
    ("case", "engine", "mechanisms"),
    [
        # one collision, nothing accelerates
        ("dt_head_on_equal_e09", "pymunk:matched", LATE),
        ("dt_head_on_equal_e09", "box2d_v3:matched", LATE),
        ("dt_wall_to_wall", "reference:lesson", LATE),
        # each time it is set onto the wall
        ("dt_wall_to_wall", "reference:exercise", POSITION_CORRECTION),
        ("dt_wall_to_wall", "pymunk:shipped", RESTITUTION),
        ("slow_collision", "box2d:shipped", RESTITUTION),  # its threshold of 1 m/s
        ("slow_collision", "box2d_v3:shipped", RESTITUTION),
        ("restitution", "pymunk:shipped", RESTITUTION),  # e2 for e
        ("far_from_origin", "box2d:matched", "float32"),
        ("bounce_drift", "reference:exercise", FLIGHT),  # symplectic Euler
        pytest.param(
            "bounce_drift", "reference:lesson", FLIGHT, marks=pytest.mark.slow
        ),  # explicit Euler
    ],
)
def test_what_is_known_to_be_the_cause_comes_out_alone(case: str, engine: str, mechanisms: str):
    assert sufficient_mechanisms(*quick_search(case, engine)) == (mechanisms,)


def test_an_ablation_without_the_cause_does_not_have_the_limit():
    mechanisms, has_limit = ablations(*quick_search("slow_collision", "box2d:shipped"))
    others = [mechanism for mechanism in mechanisms if mechanism.name != RESTITUTION]

    assert len(others) == len(mechanisms) - 1
    assert [has_limit(some) for some in (mechanisms, [], others)] == [True, False, False]


def test_the_mechanism_of_a_law_is_one_of_an_engine():
    assert {law.mechanism for law in LAWS.values()} <= {"", LATE, *NAMES}


def test_a_cause_that_no_mechanism_names_gives_no_ablation(monkeypatch: pytest.MonkeyPatch):
    # pymunk with a bug of its own, half of every elasticity, under the name of one that has none.

    def halved() -> Any:
        engine = ENGINES["pymunk:matched"].make()
        load = engine.load
        engine.load = lambda scene, dt: load(replace(scene, restitution=scene.restitution / 2), dt)
        return engine

    monkeypatch.setitem(DRIVEN_ENGINES, "pymunk:matched", DrivenEngine("pymunk:matched", halved))
    search = LimitSearch(CASES["slow_collision"], "pymunk:matched", QUICK)
    limit = search.limit()

    assert limit.verdict == "never works"
    assert sufficient_mechanisms(search, limit) == ()


def test_where_an_engine_works_nowhere_an_ablation_must_read_as_much_as_it_does():
    search, limit = quick_search("dt_wall_to_wall", "pymunk:shipped")
    read, factor = search.case.predicate.read, 1.0

    def scaled(judged: Scenario, run: Trajectory) -> Verdict:
        verdict = read(judged, run)
        return replace(verdict, value=verdict.value * (factor if run is failing else 1.0))

    failing = search.seen[limit.fails_at][1].trajectory
    case = replace(search.case, predicate=search.case.predicate._replace(read=scaled))
    mechanisms, has_limit = ablations(replace(search, case=case), limit)
    assert limit.verdict == "never works"
    assert has_limit(mechanisms)
    factor = 3.0
    mechanisms, has_limit = ablations(replace(search, case=case), limit)
    assert not has_limit(mechanisms)


@pytest.mark.parametrize("engine", ["reference:ordered", "event_driven:float64"])
def test_of_an_engine_whose_mechanisms_nobody_knows_there_is_no_ablation(engine: str):
    search = LimitSearch(CASES["overlap_recovery"], engine, QUICK)
    assert sufficient_mechanisms(search, search.limit()) == ()


def test_a_written_reason_that_speaks_of_something_else_gives_way_to_the_ablation():
    failing = Trial(10.0, 1, 1, 2.0, 0)
    limit = Limit("column", "pymunk:matched", "quick", "limit", 5.0, 10.0, (failing,))
    mechanisms = (FLIGHT, POSITION_CORRECTION), (FRICTION,), ()
    limits = explained([replace(limit, mechanisms=names) for names in mechanisms])
    [kept, other, untested] = [limit.cause for limit in limits]

    assert "corrected by a share per step" in kept.text
    assert (
        kept.shown
        == "the reference with end-of-step detection and the engine's flight and position"
        " correction has this limit"
    )
    assert other.text == "friction reduces the speed along the contact"
    assert other.source == "the engine's default"
    assert untested.sentence.startswith("likely: overlaps are corrected")


@pytest.mark.parametrize("engine", [name for name in MECHANISMS if name in ENGINES])
def test_every_mechanism_has_words(engine: str):
    one = scenario("head_on_equal_e09")
    settings = play_as(engine, replace(one, substeps=(4,))).settings
    names = [
        mechanism.name
        for mechanism in mechanisms_of(engine, settings, one.scene, one.dt(4))
        if mechanism.parameters
    ]

    assert by_mechanisms([LATE], engine).text == ACTS_AT_END
    assert len(names) >= 2
    for name in names:
        assert by_mechanisms([name], engine).text not in ("", ACTS_AT_END)
    assert by_mechanisms(names, engine).text.count("; ") >= len(names) - 1


@pytest.mark.parametrize("engine", [*MECHANISMS, "new:plain"])
def test_every_name_of_a_mechanism_has_words(engine: str):
    for name in NAMES:
        assert mechanism_words(name, engine)[2:] != ("", "")
    both = by_mechanisms([RESTITUTION, RECYCLING], engine).text
    assert both.endswith("; a pair that has hardly moved is not looked at again")
    with pytest.raises(KeyError):
        mechanism_words("magic", engine)
