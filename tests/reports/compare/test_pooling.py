"""The pooled curve is carried by half of the scenes: no one of them is the curve, and none that
fails is dropped."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.compare.order import FINEST
from crosscheck2d.reports.compare.pooling import middle_half, moved, pooled, said_of_pool
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import ladder
from crosscheck2d.reports.speed.plan import QUICK
from crosscheck2d.scenarios.model import Array

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
STEP_SIZES = 3  # those that every scene has


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
        step_sizes = QUICK.ladder(open_scene(scene, 0))[:STEP_SIZES]
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
