"""Orders, flags, fronts and costs at an accuracy come out as known beforehand; the pooled curve is
carried by half of the scenes: no one of them is the curve, and none that fails is dropped."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.compare.accuracy import (
    ACCURACIES,
    ELSEWHERE,
    EXACT,
    FAILED,
    FINEST,
    NOT_REACHED,
    ORDER,
    UNCLEAR,
    UNKNOWN,
    UNREACHABLE,
    UNSTEADY,
    YARDSTICK,
    bootstrap,
    cost_to_reach,
    front,
    median_interval,
    middle_half,
    moved,
    order_of,
    paired_cost,
    pooled,
    said_of_cheaper,
    said_of_pool,
    verdict_of,
    yardstick_of,
)
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import ladder
from crosscheck2d.reports.speed.plan import QUICK
from crosscheck2d.scenarios.model import Array
from tests.reports.speed.clockwork import Late

STEP_SIZES = [1, 2, 4, 8, 16]
DT = 0.01 / np.array(STEP_SIZES)


def measured(order: int, **how: float):
    """dt, errors and changes of a method of known error, played through a scene without collisions
    in between."""
    rows = ladder.errors_of("near_miss", 0, "late:own", partial(Late, order, **how), STEP_SIZES)
    columns = (
        np.array([row[name] for row in rows]) for name in ("dt_s", "error_radii", "change_radii")
    )
    dt, errors, changes = columns
    return dt, errors[None], changes[None]


@pytest.mark.parametrize("order", [1, 2])
def test_a_method_of_known_order_gives_its_order(order: int):
    found = order_of(*measured(order, size=100.0))

    assert found.slope == pytest.approx(order, abs=1e-6)
    assert found.high - found.low < 1e-6
    assert found.verdict == ORDER


def test_a_method_that_closes_in_on_something_else_is_flagged():
    assert order_of(*measured(1, size=1.0, aside=0.1)).verdict == ELSEWHERE


def test_a_method_on_its_way_is_not_flagged():
    assert order_of(*measured(1, size=1.0)).verdict == ORDER


def test_an_exact_method_has_no_order():
    found = order_of(*measured(1, size=1e-12))

    assert found.verdict == EXACT
    assert np.isnan(found.slope)


def test_an_error_that_rises_with_a_finer_step_is_not_monotone():
    changes = np.full(4, 1.0)

    assert verdict_of(np.array([1e-1, 1e-2, 3e-2, 1e-3]), changes) == UNSTEADY
    assert verdict_of(np.array([1e-1, 1e-2, 1.05e-2, 1e-3]), changes) == ORDER
    assert verdict_of(np.array([1e-1, 1e-7, 5e-7, 1e-8]), changes) == ORDER


def test_a_scatter_as_wide_as_its_fall_is_no_order():
    errors = np.array([[1.0, 0.999, 0.998, 0.001]])

    assert order_of(DT[:4], errors, np.ones((1, 4))).verdict == UNCLEAR


def test_too_few_points_are_no_order():
    assert order_of(DT[:2], np.array([[1.0, 0.5]]), np.array([[np.nan, 0.5]])).verdict == UNKNOWN


def test_the_slope_of_many_samples_has_an_interval_that_holds_the_order():
    rng = np.random.default_rng(0)
    errors = rng.uniform(0.2, 1.8, (64, len(DT))) * DT
    found = order_of(DT, errors, np.full(errors.shape, 1.0))

    assert found.low < 1.0 < found.high
    assert found.high - found.low < 0.5


def test_the_bootstrap_interval_covers_the_median_as_often_as_it_says():
    # Medians of 16 normal numbers: 95 % intervals hold 0 in 90 % to 99 % of 400 trials (binomial:
    # +- 3 %).
    rng = np.random.default_rng(1)
    held = 0
    for trial in range(400):
        low, high = median_interval(rng.normal(size=16), trial)
        held += low <= 0.0 <= high

    assert 0.90 <= held / 400 <= 0.99


def test_the_bootstrap_of_a_mean_is_as_wide_as_theory_says():
    # The mean of m numbers of unit spread: 2 x 1.96 / sqrt(m), to 15 % (1000 resamples).
    values = np.random.default_rng(2).normal(size=400)
    low, high = bootstrap(values, lambda sample: float(sample.mean()))

    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.15)


def test_a_failed_draw_widens_the_interval_up_to_infinity():
    low, high = median_interval(np.array([1.0, 2.0, np.inf, np.inf]))

    assert low == 1.0
    assert high == np.inf


def test_the_front_is_who_nobody_beats():
    cost = np.array([1.0, 2.0, 2.0, 4.0, 8.0, np.nan, 16.0])
    error = np.array([9.0, 5.0, 4.0, 6.0, 4.0, 0.0, 1.0])

    assert front(cost, error) == [0, 2, 6]


def test_the_cost_of_an_accuracy_is_that_of_the_cheapest_dt_that_keeps_it():
    # Errors 0.5, 0.02, 0.2, 0.05, 0.01: a lucky second step size does not count, as a finer one is
    # worse again.
    cost, error = 1.0 / DT, np.array([0.5, 0.02, 0.2, 0.05, 0.01])

    assert cost_to_reach(0.1, DT, cost, error, ORDER)[:2] == (cost[3], DT[3])
    assert cost_to_reach(0.3, DT, cost, error, ORDER)[:2] == (cost[1], DT[1])


def test_in_a_scene_a_smaller_error_never_costs_less():
    rng = np.random.default_rng(0)
    for _ in range(300):
        cost, error = rng.lognormal(size=5), 10.0 ** rng.uniform(-8, 0, 5)
        costs = [cost_to_reach(a, DT, cost, error, ORDER).cost for a in ACCURACIES.values()]
        reached = [each for each in costs if np.isfinite(each)]
        assert reached == sorted(reached)


def test_a_smaller_error_that_seems_cheaper_is_explained_by_the_scenes():
    columns = ["engine", "profile", "accuracy", "cost", "got", "of"]
    own = [
        ("reference", "exercise", "1 %", 70.0, 24, 38),
        ("reference", "exercise", "0.1 %", 90.0, 18, 38),
    ]
    falls = [("x", "y", "1 %", 4.0, 37, 38), ("x", "y", "0.1 %", 3.0, 36, 38)]
    rises = [("x", "y", "1 %", 4.0, 37, 38), ("x", "y", "0.1 %", 5.0, 36, 38)]
    said = said_of_cheaper(pd.DataFrame(own + falls, columns=columns))

    assert "x:y seems to reach 0.1 % for less than 1 %" in said
    assert "reference:exercise, with which all are compared, reaches 1 % in 24, 0.1 % in 18" in said
    assert said_of_cheaper(pd.DataFrame(own + rises, columns=columns)) == ""


def test_what_is_not_reached_says_why():
    cost, error = 1.0 / DT, np.array([0.5, 0.4, 0.3, 0.25, 0.21])

    assert cost_to_reach(0.1, DT, cost, error, ORDER).why == NOT_REACHED
    assert cost_to_reach(0.1, DT, cost, error, ELSEWHERE).why == UNREACHABLE
    assert cost_to_reach(0.1, DT, cost, np.full(5, np.inf), UNKNOWN).why == FAILED
    assert cost_to_reach(0.3, DT, cost, error, ELSEWHERE).why == ""


def test_a_failed_finest_step_does_not_pass_for_an_accuracy():
    error = np.array([0.5, 0.05, 0.05, 0.05, np.inf])

    assert cost_to_reach(0.1, DT, 1.0 / DT, error, ORDER).why == NOT_REACHED


def costs_of(name: str, costs: list[float]) -> pd.DataFrame:
    """What an accuracy costs an engine, scene by scene; nan where it does not get there."""
    engine, profile = name.split(":")
    return pd.DataFrame(
        {
            "scenario": [f"scene_{k}" for k in range(len(costs))],
            "engine": engine,
            "profile": profile,
            "accuracy": "10 %",
            "cost": costs,
        }
    )


def test_engines_are_compared_in_the_scenes_that_both_reach():
    # The yardstick is cheaper wherever both get there, and also gets to two dear scenes: it costs
    # less; its median over all scenes is the larger, as once in the table of the quick form.
    own = costs_of(YARDSTICK, [10.0, 10.0, 10.0, 900.0, 900.0, np.nan, np.nan])
    other = costs_of("pymunk:matched", [30.0, 30.0, 30.0, np.nan, np.nan, 30.0, 30.0])
    medians = [float(np.median(each.cost.fillna(np.inf))) for each in (own, other)]

    assert medians[0] > medians[1]
    assert paired_cost(other, own) == pytest.approx(3 * paired_cost(own, own))
    assert paired_cost(own, own) == pytest.approx(middle_half(own.cost.dropna().to_numpy()))
    assert np.isnan(paired_cost(other[5:], own))
    assert yardstick_of(pd.concat([other, own])).engine.unique().tolist() == ["reference"]
    assert yardstick_of(other).engine.unique().tolist() == ["pymunk"]


# All scenes in one number.

MOST = 2.0  # the factor by which leaving out one scene of the quick form may move a pooled error
BEFORE = (
    "free_fall",
    "head_on_equal_e09",
    "oblique_e1",
    "bouncing_ball_e1",
    "line_gas",
    "cradle_with_gaps",
    "ship_thrust",
    "asteroids",
)
COMMON = 3  # step sizes that every scene has


def test_the_middle_half_of_known_values():
    # Of four the two in the middle; of three the middle one counts 2/3 and each other 1/6; of one
    # itself.
    assert middle_half(np.array([1e9, 1.0, 100.0, 10.0])) == pytest.approx(np.sqrt(1000))
    assert middle_half(np.array([1.0, 8.0, 64.0])) == pytest.approx(8.0)
    assert middle_half(np.array([1.0, 1.0, 64.0])) == pytest.approx(64 ** (1 / 6))
    assert middle_half(np.array([3.0])) == pytest.approx(3.0)
    assert np.isnan(middle_half(np.array([])))


def test_a_quarter_may_fail_or_be_exact_but_no_more():
    values = np.array([0.0, 0.0, 2.0, 2.0, 2.0, 2.0, np.inf, np.inf])

    assert middle_half(values) == pytest.approx(2.0)
    assert middle_half(np.append(values, np.inf)) == np.inf


def test_what_one_value_moves_is_found():
    assert moved(np.full(8, 3.0)) == pytest.approx(np.ones(8))
    assert moved(np.array([1e-12, 1e-9, 1e-8]), floor=1e-6) == pytest.approx(np.ones(3))
    assert moved(np.array([1.0, 2.0, 4.0]), floor=0.0).max() > 1.2
    assert moved(np.array([1.0, 1.0, 1.0, np.inf])) == pytest.approx([np.inf] * 3 + [1.0])
    assert moved(np.array([1.0, np.inf, np.inf, np.inf])) == pytest.approx(np.ones(4))


def errors_of(scenes: tuple[str, ...], names: tuple[str, ...]) -> dict[tuple[str, int], Array]:
    """(engine, step_size) -> errors in radii, a scene each, of the steps that all scenes have."""
    found: dict[tuple[str, int], list[float]] = {}
    for scene in scenes:
        step_sizes = QUICK.ladder(open_scene(scene, 0))[:COMMON]
        for name in names:
            for step_size, row in enumerate(
                ladder.errors_of(scene, 0, name, ENGINES[name].make, step_sizes)
            ):
                found.setdefault((name, step_size), []).append(row["error_radii"])
    return {key: np.array(errors) for key, errors in found.items()}


def most_moved(errors: dict[tuple[str, int], Array]) -> float:
    return max(moved(each, FINEST).max() for each in errors.values())


STEPPING = ("reference:exercise", "pymunk:shipped", "box2d_v3:shipped")


@pytest.mark.slow
def test_no_one_scene_is_the_pooled_curve():
    errors = errors_of(QUICK.scenes, STEPPING)

    assert most_moved(errors) < MOST
    for each in errors.values():
        assert not np.isclose(middle_half(each), each, rtol=1e-6).any()


@pytest.mark.slow
def test_with_the_scenes_of_before_one_scene_was_the_pooled_curve():
    assert most_moved(errors_of(BEFORE, STEPPING)) > MOST


@pytest.mark.long  # ten engines through fourteen scenes
def test_no_one_scene_is_the_pooled_curve_of_any_engine():
    # a point that more than a quarter of failed scenes put at infinity is not drawn
    errors = errors_of(QUICK.scenes, tuple(ENGINES))
    drawn = {key: each for key, each in errors.items() if np.isfinite(middle_half(each))}
    assert len(drawn) > 0.9 * len(errors)
    assert most_moved(drawn) < MOST


def points(costs: list[float], errors: list[float]) -> pd.DataFrame:
    """A row a scene of one engine at one step: failed where the error is infinite."""
    names = [f"scene_{k}" for k in range(len(costs))]
    return pd.DataFrame(
        {
            "scenario": names,
            "engine": "some",
            "profile": "own",
            "step_size": 0,
            "cost": costs,
            "error": errors,
            "idle": 1.0,
            "failed": np.isinf(errors).astype(int),
        }
    )


def test_a_failed_scene_is_infinitely_dear_and_an_untimed_one_is_counted():
    failed = pooled(points([1.0, 2.0, 4.0, np.nan], [0.1, 0.2, 0.4, np.inf])).iloc[0]
    untimed = pooled(points([1.0, 2.0, 4.0, np.nan], [0.1, 0.2, 0.4, 0.5])).iloc[0]

    assert failed.cost == pytest.approx(np.sqrt(8))  # of 1, 2, 4, inf
    assert untimed.cost == pytest.approx(2.0)  # of 1, 2, 4
    assert [failed[name] for name in ("of", "failed", "timed")] == [4, 1, 4]
    assert [untimed[name] for name in ("of", "failed", "timed")] == [4, 0, 3]
    assert "Scenes failed: some:own 1." in said_of_pool(
        pooled(points([1.0, np.nan], [0.1, np.inf]))
    )
    assert "No engine failed a scene." in said_of_pool(pooled(points([1.0, 2.0], [0.1, 0.2])))


def test_a_pool_says_which_scene_moves_it_most():
    reported = pooled(points([1.0] * 5, [1e-3, 1e-3, 0.1, 10.0, 10.0]))

    assert reported.moved.iloc[0] == pytest.approx(
        moved(reported_errors := np.array([1e-3, 1e-3, 0.1, 10, 10])).max()
    )
    assert reported.moved_by.iloc[0] == f"scene_{moved(reported_errors).argmax()}"
    assert f"without {reported.moved_by.iloc[0]}" in said_of_pool(reported)
    assert said_of_pool(pooled(points([1.0], [0.1]))).startswith("One scene")
