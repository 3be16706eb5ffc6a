"""A number that too few samples carry is not judged: shown so, and left out of medians, best marks
and verdicts."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.commands.diff import CELL, changed_numbers
from crosscheck2d.reports.commands.run import medians
from crosscheck2d.reports.compare.collisions import WINDOW
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.view import LEAST_SHARE, NOT_JUDGED, View, cut
from crosscheck2d.reports.page.findings import findings, nearest
from crosscheck2d.reports.page.scenes import scenes_of, values
from crosscheck2d.reports.page.summary import summarize
from crosscheck2d.reports.run.comparing import read_scene_table
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Collisions, Scenario, Trajectory
from tests.reports.compare.answers import beside_truth, run_engine, truth_of

CARRIED = (
    *("velocity_max", "velocity_rms", "angular_velocity_max", "momentum_deviation"),
    *("energy_deviation", "energy_error", "energy_loss_error"),
)
NAMES = ("reference:exercise", "pymunk:matched")


def known_until(name: str, samples: int) -> Scenario:
    """A scenario whose truth is known at so many samples, the start among them."""
    one = scenario(name)
    truth, until = one.truth, (samples - 0.5) * one.sample_interval

    def cut_off(t: np.ndarray) -> Trajectory:
        whole = truth(t)
        return cut(whole, int((whole.t <= until).sum()))

    return replace(one, truth=cut_off, substeps=(1, 2, 4))


def compared(one: Scenario, *, substeps: tuple[int, ...] = (1, 2, 4)) -> Comparison:
    runs = [run_engine(one, name, k) for name in NAMES for k in substeps]
    return compare(one, runs)


@cache
def table_of(name: str, samples: int = 0) -> pd.DataFrame:
    """The table that all of a scenario's metrics are read off; of a truth that is known at so many
    samples, if any."""
    one = known_until(name, samples) if samples else scenario(name)
    return compared(replace(one, substeps=(1, 2, 4))).table


def against_truth(table: pd.DataFrame, metric: str, dt: float) -> pd.DataFrame:
    return table[(table.metric == metric) & (table.versus == "truth") & (table.dt_s == dt)]


@pytest.mark.parametrize(
    "name", ["falling_box", pytest.param("gas_of_100", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("metric", CARRIED)
def test_a_crowded_scene_is_judged_at_every_step_size(name: str, metric: str):
    rows = table_of(name).query("metric == @metric and versus == 'truth'")

    for row in rows.to_dict("records"):
        judged, samples = (int(word) for word in row["note"].split(" samples")[0].split(" of "))
        assert judged >= samples - int(WINDOW) - 1
        assert np.isfinite(row["value"])
    if metric.startswith("velocity"):
        assert (rows.value > 1e-3).all()


def test_nothing_is_judged_by_the_start_alone():
    rows = compared(known_until("wall_to_wall", 1)).table.query("versus == 'truth'")

    assert set(CARRIED) | {"position_max_radii", "collisions_missed"} <= set(rows.metric)
    assert rows.value.isna().all()
    assert (rows.note == f"{NOT_JUDGED}: the start alone").all()


@pytest.mark.parametrize("metric", [name for name in CARRIED if name != "energy_loss_error"])
def test_what_is_carried_by_less_than_the_share_is_not_judged(metric: str):
    # Within three steps of its end a truth does not say which velocity may come early: of 3 samples
    # 2 are left at dt / 4, none at dt.
    one, table = scenario("wall_to_wall"), table_of("wall_to_wall", 4)
    fine, coarse = (against_truth(table, metric, one.dt(k)) for k in (4, 1))

    assert np.isfinite(fine.value).all()
    assert (fine.note == "2 of 3 samples").all()
    assert coarse.value.isna().all()
    assert (coarse.note == f"{NOT_JUDGED}: only 0 of 3 samples").all()


def test_beside_an_engine_the_disks_away_from_collisions_are_judged():
    one = scenario("head_on_equal_e05")
    runs = [run_engine(one, name).trajectory for name in NAMES]
    view = View(one, one.dt(1), runs[0], runs[1])
    collisions = np.append(runs[0].collisions.t, runs[1].collisions.t)
    near = np.abs(view.played.t[:, None] - collisions).min(axis=1) < WINDOW * one.dt(1)

    assert len(collisions) == 2
    assert (view.judged == (~near & (view.played.t > 0))[:, None]).all()
    assert (
        view.carried(view.judged) == f"{view.judged.sum()} of {2 * one.intervals} samples of a disk"
    )


def test_two_engines_that_are_always_in_contact_are_not_judged_by_their_collisions():
    one = scenario("slide_on_incline")
    found = run_engine(one, "reference:exercise").trajectory
    times = np.arange(0.0, one.duration, 2 * one.dt(1))
    collisions = Collisions.of([(t, 0, -1, 1.0) for t in times])
    view = View(one, one.dt(1), replace(found, collisions=collisions), found)
    value = METRICS["velocity_max"].of(view)

    assert view.share(view.judged) < LEAST_SHARE
    assert np.isnan(value.value)
    assert value.note.startswith(f"{NOT_JUDGED}: only ")


def lost(comparison: Comparison, name: str, metric: str) -> Comparison:
    table = comparison.table.copy()
    engine, profile = name.split(":")
    rows = (table.metric == metric) & (table.engine == engine) & (table.profile == profile)
    assert rows.any()
    table.loc[rows, ["value", "note"]] = np.nan, f"{NOT_JUDGED}: only 3 of 90 samples"
    return replace(comparison, table=table)


def test_what_is_not_judged_is_shown_and_counts_in_no_median():
    good = [compared(scenario(name)) for name in ("wall_to_wall", "head_on_equal_e05")]
    half = [good[0], lost(good[1], NAMES[0], "energy_error")]
    none = [lost(one, NAMES[0], "energy_error") for one in good]

    def energy(comparisons: list[Comparison]) -> str:
        headings, rows, _ = medians(scenes_of(comparisons), NAMES, set())
        return rows[0][headings.index("Energy\nof energy")]

    assert energy(half) == energy(good[:1])
    assert energy(none) == "–"
    number = values(half[1])[NAMES[0], "energy_error"]
    assert number.text == NOT_JUDGED
    assert "3 of 90" in number.remark


def test_a_scene_known_at_its_start_only_beats_nobody():
    nothing = compared(known_until("wall_to_wall", 1))
    known = compared(scenario("head_on_equal_e05"))

    assert "No scene here has an exact answer" in findings(summarize([nothing]))[0]
    assert "answer of head_on_equal_e05:" in nearest(summarize([nothing, known]))
    [scene] = scenes_of([nothing])
    assert all(np.isnan(scene.error(name)) for name in NAMES)


def test_a_number_that_is_judged_in_one_run_only_is_neither_worse_nor_better(tmp_path: Path):
    whole = compared(scenario("wall_to_wall"))
    tables = []
    for each in (whole, lost(whole, NAMES[0], "velocity_rms")):
        each.table.to_csv(tmp_path / "share.csv", index=False)
        read_scene_table((tmp_path / "share.csv").read_bytes())
        tables.append(pd.read_csv(tmp_path / "share.csv", dtype=str, keep_default_na=False))
    none = pd.DataFrame(columns=CELL)
    changes, _ = changed_numbers(*tables, none)
    back, _ = changed_numbers(*tables[::-1], none)
    tables[1].loc[tables[1].note.str.startswith(NOT_JUDGED), ["value", "note"]] = "1e9", ""
    control, _ = changed_numbers(*tables, none)

    assert {*changes.verdict, *back.verdict} == {"other"}
    assert {*changes.after} == {NOT_JUDGED}
    assert "worse" in {*control.verdict}


def test_a_velocity_that_overflows_is_judged_and_bad():
    one, truth = truth_of("wall_to_wall")
    huge = replace(truth, velocity=truth.velocity * 1e200)
    with np.errstate(over="ignore", invalid="ignore"):
        found = METRICS["energy_deviation"].of(beside_truth(one, one.dt(1), huge, truth))

    assert not np.isfinite(found.value)
    assert NOT_JUDGED not in found.note


def test_a_number_of_the_table_is_nan_only_where_it_is_not_judged():
    one, truth = truth_of("wall_to_wall")
    huge = replace(truth, velocity=truth.velocity * 1e200)
    run = Run("pymunk", "matched", one.name, one.dt(1), trajectory=huge)
    with np.errstate(over="ignore", invalid="ignore"):
        table = compare(one, [run]).table
    unjudged = table.note.str.startswith(NOT_JUDGED)

    assert np.isinf(table.value).any()
    assert (table.value.isna() == unjudged).all()


def test_where_nobody_was_played_it_is_not_said_that_there_is_no_answer():
    comparisons = [compared(known_until("slow_collision", 50))]
    alone, without = nearest(summarize(comparisons, NAMES)), nearest(summarize([]))

    assert alone.startswith("No engine is ranked: none keeps the laws and plays a scene")
    assert without.startswith("No scene here has an exact answer")
