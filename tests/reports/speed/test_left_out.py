"""A scene or engine without a value is shown as such in the tables of the page, and not left out of
them in silence."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.reports.compare.accuracy import (
    FAILED,
    NOT_TIMED,
    ORDER,
    UNREACHABLE,
    cost_to_reach,
)
from crosscheck2d.reports.page.kit import Table
from crosscheck2d.reports.speed import page, tables
from crosscheck2d.reports.speed.measure import SIZE, Measured
from crosscheck2d.reports.speed.plan import PLAIN, SCENE

DT = np.array([0.4, 0.2, 0.1])
PYMUNK: dict = {"engine": "pymunk", "profile": "matched", "change": PLAIN}


def point(
    scenario: str = "one", step_size: int = 0, cost: float = 1.0, error: float = 0.1, **more: object
) -> dict:
    failed = bool(np.isinf(error))
    row = PYMUNK | {"scenario": scenario, "step_size": step_size, "dt_s": 0.4 / 2**step_size}
    row |= dict.fromkeys(("cost", "low", "high", "best"), cost) | {"wrapping": 0.0, "idle": 0.5}
    row |= dict.fromkeys(("error", "error_low", "error_high"), error) | {"seeds": 1}
    row |= {"failed": int(failed), "status": "error" if failed else "ok"}
    return row | {"reason": "no" if failed else ""} | more


def test_an_accuracy_that_was_not_timed_is_not_called_unreached():
    error = np.array([0.5, 0.05, 0.05])

    assert cost_to_reach(0.1, DT, np.array([1.0, np.nan, np.nan]), error, ORDER).why == NOT_TIMED
    assert cost_to_reach(0.1, DT, np.array([1.0, 2.0, np.nan]), error, ORDER).cost == 2.0


def test_the_pooled_cost_of_an_accuracy_counts_every_scene():
    why = ["", UNREACHABLE, FAILED, NOT_TIMED, "not down to dt 0.1 s"]
    columns = PYMUNK | {"scenario": list("abcde"), "accuracy": "1 %", "dt_s": np.nan, "why": why}
    columns |= {"cost": [5.0] + [np.nan] * 4, "lost": [w in (UNREACHABLE, FAILED) for w in why]}
    reached = pd.DataFrame(columns)
    row = tables.pooled_reached(reached, reached).iloc[0]

    assert np.isnan(row.cost)
    assert row.why == "1 of 5, never in 1, failed in 1, untimed in 1"
    assert not row.lost  # two of five
    assert tables.pooled_reached(reached[1:4], reached[1:4]).iloc[0].lost  # two of three


def rows_of(table: Table) -> list[dict[str, str]]:
    heads = [head.text for head in table.heads]
    return [
        {"": label.text} | dict(zip(heads, (cell.text for cell in cells)))
        for _, label, cells in table.rows
    ]


def test_a_point_that_was_not_timed_has_its_error_and_a_failed_one_how_it_failed():
    rows = [point(), point(step_size=1, cost=np.nan, error=0.05)]
    table = pd.DataFrame([*rows, point(step_size=2, cost=np.nan, error=np.inf)])
    timed, untimed, failed = rows_of(page.seeds_table("points", table))
    (drawn,) = [line for line in page.drawn_lines(table) if not line.faint]

    assert (timed["error, radii"], timed["cost, µs/s"], timed["failed"]) == ("0.1", "1", "")
    assert (untimed["error, radii"], untimed["failed"]) == ("0.05", "")
    assert untimed["cost, µs/s"] == page.number(np.nan)
    assert failed["failed"] == "1 of 1: error: no"
    assert [*drawn.y] == [0.1]


def sweep(value: str, step_size: int, **more: object) -> dict:
    """A row of a sweep at `value`, at the dt of the row `point(step_size=2)`."""
    return point(step_size=step_size, profile="matched+iterations", change=value, dt_s=0.1) | more


def test_a_sweep_that_fails_most_scenes_stays_in_the_pool_and_in_the_table():
    failed = sweep("9", 1, cost=np.nan, error=np.inf, failed=1, status="error", reason="no")
    rows = (point(step_size=2), sweep("1", 0), failed)
    table = pd.DataFrame([row | {"scenario": name} for name in ("one", "two") for row in rows])
    pool, _ = tables.pooled_sweeps(table)
    lost = [row for row in rows_of(page.seeds_table("sweeps", table)) if row["failed"]]

    assert pool.set_index("change").failed.to_dict() == {"": 0, "1": 0, "9": 2}
    assert [(row[""], row["value"], row["failed"]) for row in lost] == [
        ("one", "9", "1 of 1: error: no"),
        ("two", "9", "1 of 1: error: no"),
    ]


def test_a_scene_without_a_ratio_is_named():
    rows = [point("one", 2), point("exact", 2, error=0.0)]
    rows += [point("gone", 2, cost=np.nan, error=np.inf)]
    rows += [sweep("1", 0, scenario=name) for name in ("one", "exact", "gone")]
    table = pd.DataFrame(rows)

    pool, without_ratio = tables.pooled_sweeps(table)
    assert without_ratio == [("pymunk", "exact"), ("pymunk", "gone")]
    assert set(pool["of"]) == {1}


def test_a_change_that_fails_has_its_row_with_how_it_failed():
    rows = [
        ("one", "ok", "", 1.5, 1.0, 0.1),
        ("two", "error", "no", np.inf, np.nan, np.inf),
    ]
    columns = ["scenario", "status", "reason", "error_ratio", "cost_ratio", "error_radii"]
    table = pd.DataFrame(rows, columns=columns)
    table = table.assign(**PYMUNK | {"change": "no rotation"}, error_radii_plain=0.1)
    ok, failed = rows_of(page.table("options", table))

    assert (ok["scene"], ok["error, × unchanged"], ok["failed"]) == ("one", "1.5", "")
    assert (failed["scene"], failed["failed"]) == ("two", "error: no")


def test_an_engine_that_refuses_the_fewest_disks_has_its_row_and_its_reason():
    sample = PYMUNK | {"kind": SIZE, "n": 3, "round": 0, "cost": 1e-6, "wrapping": 0.0}
    refused = {("box2d:matched", 3): "refused: no"}
    growth = tables.growth(tables.sizes(Measured(samples=pd.DataFrame([sample]))), refused)
    rows = rows_of(page.table("growth", growth))

    assert growth.set_index("engine").stopped.to_dict() == {"pymunk": "", "box2d": "3: refused: no"}
    assert [(row[""], row["then"]) for row in rows] == [
        ("pymunk:matched", ""),
        ("box2d:matched", "3: refused: no"),
    ]


def test_an_order_tells_how_many_steps_failed():
    # They have no part in its slope, which says nothing of them.
    known = PYMUNK | {"kind": SCENE, "scenario": "one", "seed": 0, "change_radii": 1.0}
    errors = pd.DataFrame(
        [
            known | {"substeps": k, "dt_s": 0.4 / k, "error_radii": error}
            for k, error in ((1, 0.8), (2, 0.4), (4, 0.2), (8, np.inf))
        ]
    )
    row = tables.orders(Measured(errors=errors), 0).iloc[0]

    assert (row.verdict, row.failed, row.steps) == (ORDER, 1, 4)
    assert (row.coarsest_error, row.finest_error) == (0.8, np.inf)


def own(scenario: str, cost: float, **more: object) -> dict:
    return point(scenario, cost=cost, engine="reference", profile="exercise", **more)


def test_an_engine_that_is_cheaper_than_our_own_solver_is_named_with_the_scene():
    # At cost 2 against 4 it is cheaper; without idle steps of 0.5 and 3.9, not; one scene was not
    # timed.
    rows = [own("one", 1.0), own("two", 4.0, idle=3.9), own("three", 1.0)]
    rows += [point("one", cost=3.0), point("two", cost=2.0), point("three", cost=np.nan)]
    row = tables.against_own(pd.DataFrame(rows), pd.DataFrame()).iloc[0]

    assert (row.cheaper, row.cheaper_in, row.scenes, row.not_timed_in) == (1, "two", 2, "three")
    assert (row.bare_cheaper, row.bare_cheaper_in) == (0, "")
    assert row.ratio == pytest.approx(np.sqrt(1.5))
    assert (row.low, row.high) == pytest.approx((0.5, 3.0))


def test_a_changed_setting_that_is_cheaper_than_our_own_solver_is_named():
    # against our solver unchanged, in the same scene
    rows = [("reference", "exercise", "float32", 9.0, 2.0)]
    rows += [("pymunk", "matched", "sleeping", 1.0, 5.0)]
    columns = ["engine", "profile", "change", "cost", "cost_plain"]
    options = pd.DataFrame(rows, columns=columns).assign(scenario="one")
    points = pd.DataFrame([own("one", 2.0), point("one", cost=5.0)])
    row = tables.against_own(points, options).set_index("change").loc["sleeping"]

    assert (row.ratio, row.cheaper, row.cheaper_in) == (0.5, 1, "one")
    # our own solver was not asked for
    assert tables.against_own(pd.DataFrame([point("one")]), options).empty


def test_where_no_timing_ended_there_is_a_table_without_times():
    # An engine that fails while it is timed takes those of its scene along; the errors stay.
    error = PYMUNK | {"kind": SCENE, "scenario": "one", "dt_s": 0.4, "substeps": 1}
    error |= {"until_s": 1.0, "duration_s": 1.0, "status": "ok", "reason": "", "error_radii": 0.1}
    (row,) = tables.points(Measured(errors=pd.DataFrame([error])), 0).to_dict("records")

    assert row["error"] == 0.1
    assert np.isnan(row["cost"])
