"""`crosscheck speed` measures, keeps every sample, says what failed, and makes a page that opens
offline."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.options import OPTIONS
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.accuracy import ACCURACIES, FAILED, UNREACHABLE, said_of_pool
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.reports.run.arguments import opening
from crosscheck2d.reports.run.cells import about
from crosscheck2d.reports.speed import figures
from crosscheck2d.reports.speed.budget import budget_of, cut_scenes
from crosscheck2d.reports.speed.command import SPEED, write_all
from crosscheck2d.reports.speed.measure import Measured, Measuring
from crosscheck2d.reports.speed.page import LOWEST, NEVER, drawn_lines, reached_table, write_page
from crosscheck2d.reports.speed.plan import QUICK, SpeedPlan
from crosscheck2d.reports.speed.tables import Results, pooled_sweeps
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM, EVENT_DRIVEN
from tests.measured import MEASURED
from tests.reports.page.browsing import opened, overhang

pytestmark = pytest.mark.slow  # measures, and draws what it measured, for half a minute

SCENES = ("head_on_equal_e09", "asteroids")
PLAYED = ("reference:exercise", "pymunk:shipped", "pymunk:matched", "event_driven:float64")
LITTLE = replace(
    QUICK,
    scenes=SCENES,
    seeds=3,
    most_steps=1000,
    rounds=2,
    budget=0.0,
    sizes=(3, 10, 100, 1000),
    patience=1.0,
    option_scenes=("bouncing_ball_e1",),
    sweep_scenes=("slide_on_incline", "falling_box"),
    budget_scenes=("head_on_equal_e09",),
)
CUTS = "Scenes that are not evaluated up to the end of their exact answer"
HEADER = about("crosscheck speed", 0) | {"load": 0.0, "seconds": 1.0}
PLAN = SpeedPlan(LITTLE, PLAYED, 0, 2)


@pytest.fixture(scope="module")
def measured() -> Measured:
    with Progress() as progress:
        return Measuring(PLAN, progress).run()


@pytest.fixture(scope="module")
def results(measured: Measured) -> Results:
    """The same with one engine that failed one step size of one scene, and one that refused all of
    it."""
    errors = measured.errors.copy()
    here = (errors.scenario == SCENES[0]) & (errors.engine == "pymunk") & (errors.kind == "scene")
    refused = here & (errors.profile == "shipped")
    crashed = here & (errors.profile == "matched") & (errors.substeps == 1)
    errors.loc[refused, ["status", "reason"]] = ["unsupported", "no <b>such</b> thing"]
    errors.loc[crashed, ["status", "reason"]] = ["crashed", "worker died: SIGSEGV"]
    errors.loc[refused | crashed, "error_radii"] = np.inf
    where = {"scenario": SCENES[0], "engine": "pymunk", "profile": "shipped", "kind": "scene"}
    samples = measured.samples.drop(rows_of(measured.samples, **where).index)
    return Results(PLAN, replace(measured, errors=errors, samples=samples))


def rows_of(table: pd.DataFrame, **values: str) -> pd.DataFrame:
    return table[(table[list(values)] == pd.Series(values)).all(axis=1)]


@pytest.fixture
def page(results: Results, tmp_path: Path) -> Path:
    return written(results, tmp_path)


def written(results: Results, folder: Path) -> Path:
    path = folder / "speed.html"
    write_page(path, results, HEADER)
    return path


def test_every_sample_and_every_error_is_kept(results: Results, tmp_path: Path):
    with opening(tmp_path, SPEED) as store:
        write_all(store, results, HEADER)
    samples, errors = (pd.read_csv(tmp_path / f"speed_{n}.csv") for n in ("samples", "errors"))
    one = rows_of(samples, kind="scene", engine="event_driven", scenario=SCENES[0])

    assert sorted(one[one.copy_of == 1]["round"]) == [-1, 0, 1]
    assert (one.groupby(["dt_s", "copy_of"]).size() == 3).all()
    assert set(errors[errors.scenario == "asteroids"].seed) == {0, 1, 2}


def test_errors_are_those_of_the_comparison(results: Results):
    row = rows_of(results.points, scenario=SCENES[0], engine="reference").iloc[1]
    scene = scenario(SCENES[0])
    run = play(ENGINES["reference:exercise"].make(), "reference:exercise", scene, row.dt_s)
    table = compare(scene, [run]).table
    values = rows_of(table, metric="position_max_radii", versus="truth").value
    assert row.error == values.iloc[0]


def test_what_failed_is_named_beside_the_chart(results: Results):
    points = results.points[results.points.scenario == SCENES[0]]
    drawn = {line.name: line for line in drawn_lines(points) if not line.faint}
    ladder = points[(points.engine == "reference")]

    assert "pymunk:shipped" not in drawn
    assert len(drawn["pymunk:matched"].x) == len(ladder) - 1
    assert len(drawn["reference:exercise"].x) == len(ladder)
    table = {row.text: cells for _, row, cells in reached_table(results).rows}
    assert [cell.text for cell in table["pymunk:shipped"]] == [NEVER] * len(ACCURACIES)


def test_the_front_of_a_chart_is_the_event_driven_engine(results: Results):
    # In a head-on collision it is both cheapest and exact, so that nobody else is on the front.
    points = results.points[results.points.scenario == SCENES[0]]
    front, *lines = drawn_lines(points)
    mine = points[points.engine == "event_driven"]

    assert mine.error.max() < LOWEST
    assert list(front.y) == [LOWEST]
    assert list(front.x) == [mine.cost.min()]
    assert min(min(line.y) for line in lines if "event_driven" not in line.name) > LOWEST


def test_the_page_of_speed_opens_with_which_engine_for_what(browser: Browser, page: Path):
    tab, heard = opened(browser, page.as_uri(), viewport={"width": 1280, "height": 900})
    top = tab.locator("#which table").bounding_box()
    rows = tab.locator("#which tbody th").all_inner_texts()
    costs = tab.locator("#which td .side").all_inner_texts()
    lead = tab.locator(".lead").all_inner_texts()
    tab.context.close()

    assert top is not None
    assert top["y"] < 450
    assert [row.splitlines()[0] for row in rows] == ["Single collisions", "Crowds", "Spin"]
    assert len(costs) == 3 * len(PLAYED)
    assert any("crosscheck advise my_scene.toml --error 1%" in text for text in lead)
    assert heard == []


def test_times_that_mean_nothing_are_called_so(results: Results):
    loud, quiet, alone = copy(results), copy(results), copy(results)
    loud.noise, quiet.noise = (
        pd.DataFrame({"scenario": "free_fall", "ratio": ratios}) for ratios in ([0.8, 1.3], [1.01])
    )
    alone.noise = loud.noise.head(0)

    assert "below this floor mean nothing" in loud.noise_sentence
    assert "is 1.010" in quiet.noise_sentence
    assert "mean nothing" not in quiet.noise_sentence
    assert "not known" in alone.noise_sentence


def test_what_cannot_be_reached_is_above_what_costs(results: Results):
    reached = rows_of(results.reached, scenario=SCENES[0])
    reached = reached.set_index(["engine", "profile", "accuracy"])

    assert reached.loc[("pymunk", "shipped", "10 %")].why == FAILED
    assert np.isfinite(reached.loc[("reference", "exercise", "1 %")].cost)
    assert reached.loc[("reference", "exercise", "1e-6")].why.startswith("not down to dt")
    assert UNREACHABLE not in set(results.reached[results.reached.engine == "event_driven"].why)


def test_a_random_scene_has_an_interval_over_its_seeds(results: Results):
    row = rows_of(results.points, scenario="asteroids", engine="reference").iloc[0]

    assert row.seeds == 3
    assert row.error_low < row.error < row.error_high


def test_a_pooled_failure_counts_as_infinitely_wrong(results: Results):
    row = rows_of(results.pooled, engine="pymunk", profile="shipped").iloc[0]

    assert (row.failed, np.isinf(row.error_high)) == (1, True)


def test_every_option_of_an_engine_is_set_against_it_in_every_scene(results: Results):
    expected = {option.change for option in OPTIONS if option.engine in PLAYED}
    table = results.options

    assert set(table.change) == expected
    assert (table.groupby("scenario").size() == len(expected)).all()
    assert table[table.status == "ok"].cost_ratio.gt(0).all()
    assert "" not in set(table.change)


def test_float32_breaks_what_it_must(results: Results):
    # Negative control of the option table: in a bouncing ball 2**-24 a step shows, and is not 1.
    row = rows_of(results.options, scenario="bouncing_ball_e1", engine="reference").iloc[0]

    assert abs(row.error_ratio - 1) > 1e-3


def test_a_sweep_meets_its_engine_where_it_is_matched(results: Results):
    # 10 iterations are what pymunk has as matched: the same error, to the bit, and 1 of 1 where all
    # are pooled.
    table = results.sweeps
    here = rows_of(table, engine="pymunk", scenario="slide_on_incline")
    turned = here[here.change == "10"].iloc[0]
    same = here[(here.change == "") & (here.dt_s == turned.dt_s)].iloc[0]
    pooled, _ = pooled_sweeps(table)

    assert turned.error == same.error
    assert pooled[pooled.change == "10"].error.iloc[0] == 1.0
    assert {sweep.name for sweep in results.plan.sweeps} == {"pymunk:matched+iterations"}
    assert table[table.scenario == "falling_box"].seeds.eq(3).all()


def test_the_cheapest_model_is_named_for_every_scene(results: Results):
    models = results.models.set_index("scenario")

    assert models.loc[SCENES[0]].truth == CLOSED_FORM
    assert models.loc["asteroids"].truth == EVENT_DRIVEN
    assert models.loc["asteroids"].engine == "event_driven:float64"
    assert set(models.model) <= {"closed form", "collision to collision, float64"}


def test_figures_come_back_as_they_were_kept(results: Results, tmp_path: Path):
    path = tmp_path / "figures.csv"
    figures.write(path, results, HEADER)
    kept = figures.ratios(figures.read(path))

    assert "# processor: " in path.read_text()
    assert "# pymunk: 7" in path.read_text()
    assert ("pymunk:matched", 100) in kept
    assert results.sizes.worst.notna().all()
    assert figures.drifted(kept, kept) == []


def test_a_ratio_that_drifts_beyond_the_gate_is_named():
    kept = {("a:b", 10): 1.0, ("a:b", 100): 1.0, ("c:d", 10): 1.0, ("e:f", 10): 1.0}
    said = figures.drifted(kept, {("a:b", 10): 4.0, ("a:b", 100): 0.25, ("c:d", 10): 2.0})

    assert [line.split(":")[0] for line in said] == ["e", "a", "a"]
    assert "allowed is a factor of 3" in said[1]


def test_the_kept_figures_have_every_ratio_that_is_gated():
    assert set(figures.ratios(figures.read())) == {
        (name, n)
        for name, row in ENGINES.items()
        if (row.bits_of or name) in MEASURED
        and name != "reference:exercise"
        and not row.adds_friction
        for n in figures.GATED
    }


def test_the_page_says_what_is_left_out(results: Results, tmp_path: Path):
    names = [name for name in PLAYED if name in MECHANISMS]
    rows = [row for name in names for row in budget_of("gas_of_100", 0, name, 4)]
    budget = results.measured.budget
    both = pd.concat([budget, pd.DataFrame(rows, columns=budget.columns)])
    cut = Results(results.plan, replace(results.measured, budget=both))
    whole, shorter = (unescape(written(each, tmp_path).read_text()) for each in (results, cut))
    (gas,) = cut_scenes(cut.explained).itertuples()

    for text in (whole, shorter):
        assert said_of_pool(results.pooled) in text
        assert "pymunk:shipped 1" in said_of_pool(results.pooled)
        assert 'id="versus"' in text
    assert f"gas_of_100 at {gas.until_s:.2g} of {gas.horizon_s:.2g} s" in shorter
    assert CUTS in shorter
    assert "1 scene is cut" in shorter
    assert "up to the end of every exact answer" in whole
    assert CUTS not in whole


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (400, "dark")])
def test_the_page_opens_every_scene_and_asks_nothing_of_anywhere(
    browser: Browser, page: Path, width: int, scheme: str
):
    size = {"width": width, "height": 900}
    tab, heard = opened(browser, page.as_uri(), viewport=size, color_scheme=scheme)
    assert tab.locator("main svg").count() == 3  # pooled, sweeps, sizes
    for scene in SCENES:
        tab.locator(f"#{scene} button.open").click()
        tab.locator(f"#{scene} + tr.opened svg").wait_for()  # a row is unpacked after the click
    assert tab.locator("main svg").count() == 3 + len(SCENES)
    # the asteroids' answer ends before they do
    assert tab.get_by_text("where the exact answer ends").count() == 1
    assert overhang(tab) <= 0
    tab.locator("#budget summary").click()
    # with mechanisms: three engines; two disabled; the row of a scene
    assert tab.locator("#budget tbody tr").count() == 3 + 2 + 1
    assert tab.get_by_text("no <b>such</b> thing").count() > 0
    assert tab.locator("b:text('such')").count() == 0
    assert heard == []
