"""The search for matched settings: what it counts, what it refuses, and that adapters and table
agree."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from crosscheck2d.adapters.engines import changed
from crosscheck2d.adapters.matched import chosen, searched
from crosscheck2d.adapters.pymunk import MATCHED as PYMUNK
from crosscheck2d.reports.tune.score import (
    FLOOR,
    TrialScores,
    against,
    at_cost,
    faults_of,
    measured,
    posed,
)
from crosscheck2d.reports.tune.search import (
    BETTER,
    CHOSEN,
    COLUMNS,
    NO_SEARCH,
    TUNED,
    SettingsSearch,
    searched_of,
    shown,
)
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.families.tuning import FAMILIES, LADDER, LEAST_GAP, one_of, tuning
from crosscheck2d.scenarios.model import Array, Scenario


def start(one: Scenario) -> Array:
    """(n, 5) position, velocity and radius of every disk."""
    return np.column_stack([one.scene.position, one.scene.velocity, one.scene.radius])


@pytest.mark.parametrize("engine", TUNED)
def test_what_an_adapter_matches_is_what_the_table_chose(engine: str):
    """Setting by setting; what is in the adapter alone is not searched, and says why."""
    table, adapter = chosen(engine), searched_of(engine).chosen

    assert table == {name: shown(adapter[name]) for name in table}
    assert set(table) == set(searched_of(engine).settings)
    assert {name for name in adapter if name not in table} <= {"skin", "restitution_threshold"}


def test_every_value_of_the_grid_is_in_the_table_and_every_reason_is_given():
    """Nothing is left out in silence: neither a value, nor a setting that is not searched."""
    rows = searched()
    kept = {(row["engine"], row["setting"], row["value"]) for row in rows}

    assert list(rows[0]) == COLUMNS
    for engine in TUNED:
        what = searched_of(engine)
        for name, (values, _) in what.settings.items():
            assert {(engine, name, shown(value)) for value in values} <= kept
        assert {(engine, name, "") for name in what.left_alone} <= kept
        assert all(set(names) <= set(what.settings) for names, *_ in what.pairs)
    assert all(row["why"] for row in rows if row["verdict"] in (CHOSEN, NO_SEARCH))
    assert not [row for row in rows if row["verdict"] == BETTER]  # the last sweep took nothing


def test_the_tuning_scenes_are_not_those_of_the_suite():
    """No name and no start in common, and sizes and speeds of their own."""
    suite = [scenario(name) for name in SCENARIOS]
    mine = tuning(range(2))

    assert not {one.name for one in mine} & {one.name for one in suite}
    for one in mine:
        assert not [
            other.name
            for other in suite
            if other.scene.n == one.scene.n and np.allclose(start(other), start(one))
        ]
    assert len({float(one.scene.radius[0]) for one in mine}) > len(mine) / 2


def test_a_tuning_scene_is_the_same_for_the_same_seed_only():
    """Sampled, and so repeatable."""
    for family in FAMILIES:
        a, again, b = one_of(family, 1), one_of(family, 1), one_of(family, 2)
        assert np.array_equal(start(a), start(again))
        assert start(a).shape != start(b).shape or not np.allclose(start(a), start(b))


def test_near_misses_miss_and_grazing_pairs_collide():
    """By the exact answer: no collision of those that miss, one of every pair that grazes."""
    for miss, truth in posed(("near_miss",), (0, 1, 2)):
        assert truth is not None
        assert len(truth.collisions) == 0
        pairs = truth.position.reshape(len(truth), -1, 2, 2)
        least = np.linalg.norm(pairs[:, :, 1] - pairs[:, :, 0], axis=-1).min()
        assert least >= (1 + LEAST_GAP) * 2 * miss.scene.radius[0] * (1 - 1e-9)
    for graze, truth in posed(("grazing",), (0, 1, 2)):
        assert truth is not None
        assert len(truth.collisions) == graze.scene.n / 2


def played(
    error: float, order: float = 1.0, gained: float = 0.0, missed: int = 0, spurious: int = 0
) -> TrialScores:
    """Three scenes of one family, with an error of an order in dt."""
    step_sizes = np.tile(error / np.array(LADDER, float) ** order, (3, 1))
    full = np.ones_like(step_sizes)
    return TrialScores(step_sizes, gained * full, missed * full, spurious * full)


THREE = posed(("flight_alone",), (0, 1, 2))


@pytest.mark.parametrize("cost", [0.5, 0.8, 1.0, 1.3, 3.0, 10.0])
def test_equal_cost_is_a_step_as_much_longer_as_it_costs(cost: float):
    """An error of first order grows by the cost; beyond the step_sizes, too."""
    first = played(0.1)

    assert at_cost(first.error, cost) == pytest.approx(cost * first.error)
    assert against(first, first, cost, THREE).equal_cost == pytest.approx(cost)
    assert against(first, first, cost, THREE).same_dt == 1.0


def test_an_error_of_no_order_gains_nothing_from_cheaper_steps_within_the_ladder():
    """Negative control of the line above: the ladder is read, not the cost alone."""
    flat = played(0.1, order=0.0)

    assert at_cost(flat.error, 2.0)[:, 1:] == pytest.approx(flat.error[:, 1:])
    assert against(played(0.05), played(0.1), 1.0, THREE)[:5] == pytest.approx((0.5, 0.5, 9, 0, 9))


@pytest.mark.parametrize(
    ("worse", "said"),
    [
        ({"spurious": 1}, "9 spurious collisions, not 0"),
        ({"missed": 1}, "9 missed collisions, not 0"),
        ({"gained": 0.02}, "energy wrong by 0.02, not 0"),
    ],
)
def test_what_breaks_a_scene_is_said_whatever_the_error(worse: dict[str, float], said: str):
    """Even if it is ten times as near."""
    (fault,) = faults_of(played(0.01, **worse), played(0.1), THREE)  # type: ignore[arg-type]

    assert fault == f"flight_alone: {said}"
    assert faults_of(played(0.01), played(0.1, **worse), THREE) == []  # type: ignore[arg-type]


def test_a_run_that_fails_breaks_and_one_that_failed_before_does_not():
    """inf stands for it."""
    failed = played(np.inf)

    assert faults_of(failed, played(0.1), THREE) == ["flight_alone: 9 runs failed"]
    assert faults_of(failed, failed, THREE) == []


def test_a_length_unit_of_two_radii_makes_spurious_collisions_in_near_misses_and_a_small_one_none():
    """Why Box2D 3.1 may not have the length unit of the smallest error: its margin is 2 % of it."""
    scenes = posed(("near_miss",), (0, 1))
    small, large = (
        measured(partial(changed, "box2d_v3:matched", length_unit=unit), scenes)
        for unit in (0.5, 2.0)
    )

    assert small.spurious.sum() == 0
    assert large.spurious.sum() > 0
    assert any("near_miss" in fault for fault in faults_of(large, small, scenes))


def test_a_smaller_slop_brings_a_column_in_pymunk_nearer():
    """At 1e-6 radii for 1e-2, with the position correction as it comes: less than half of the
    error."""
    scenes = posed(("column",), (0, 1))
    before, now = (
        measured(partial(changed, "pymunk:matched", slop=slop, bias=0.9**60), scenes)
        for slop in (1e-2, 1e-6)
    )

    assert against(now, before, 1.0, scenes).same_dt < 0.5
    assert (before.error > FLOOR).all()


@pytest.mark.slow
def test_a_search_finds_its_way_back_from_a_bad_setting(monkeypatch: pytest.MonkeyPatch):
    """On two families: from a slop of 1 % it takes a smaller one, and from what is matched
    nothing."""
    whole = searched_of("pymunk")
    slop = replace(whole, settings={"slop": whole.settings["slop"]}, pairs=())
    monkeypatch.setattr("crosscheck2d.reports.tune.search.searched_of", lambda _: slop)
    search = SettingsSearch("pymunk", ("column", "landing"), ((0, 1), (2, 3)), say=lambda _: None)
    table = search.run()

    assert search.chosen == PYMUNK
    assert table[table.verdict == CHOSEN].value.tolist() == [shown(PYMUNK["slop"])]
    search.chosen["slop"] = 0.01
    trials, taken = search.sweep()
    assert taken
    assert search.chosen["slop"] < 0.001
    assert any(trial.verdict == BETTER for trial in trials)
