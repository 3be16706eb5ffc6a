"""`crosscheck speed` measures, keeps every sample, says what failed, and makes a page that opens
offline."""

from __future__ import annotations

from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pandas as pd
import plotly.graph_objects as go
import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.mechanisms.options import OPTIONS
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.pareto import FAILED, UNREACHABLE
from crosscheck2d.reports.compare.pooling import said_of_pool
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.speed import charts, figures
from crosscheck2d.reports.speed.budget import budget_of
from crosscheck2d.reports.speed.effort import QUICK
from crosscheck2d.reports.speed.explained import extent
from crosscheck2d.reports.speed.measure import Measured, Measuring
from crosscheck2d.reports.speed.page import write_page
from crosscheck2d.reports.speed.plan import SpeedPlan
from crosscheck2d.reports.speed.results import Results
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM, EVENT_DRIVEN
from tests.measured import MEASURED
from tests.reports.page.browsing import opened, overhang
from tests.reports.page.figures import check_figures

pytestmark = pytest.mark.slow  # measures, and draws what it measured, for half a minute

SCENES = ("head_on_equal_e09", "asteroids")
PLAYED = ("reference:exercise", "pymunk:shipped", "pymunk:matched", "event_driven:float64")
LITTLE = replace(
    QUICK,
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
SAID = {"load": 0.0, "seconds": 1.0}


@pytest.fixture(scope="module")
def measured() -> Measured:
    """A little of everything, played and timed for real, in worker processes."""
    with Progress() as progress:
        return Measuring(SpeedPlan(SCENES, PLAYED, LITTLE, 0, 2), progress).run()


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
    samples = measured.samples
    timed = (
        (samples.scenario == SCENES[0])
        & (samples.engine == "pymunk")
        & (samples.profile == "shipped")
    )
    changed = replace(
        measured, errors=errors, samples=samples[~(timed & (samples.kind == "scene"))]
    )
    return Results(SpeedPlan(SCENES, PLAYED, LITTLE, 0, 2), changed)


def test_every_sample_and_every_error_is_kept(results: Results, tmp_path: Path):
    """A row a round for every engine, dt and copy; a row a seed for every engine and dt."""
    results.write(tmp_path)
    samples, errors = (
        pd.read_csv(tmp_path / f"speed_{name}.csv") for name in ("samples", "errors")
    )
    one = samples[
        (samples.kind == "scene")
        & (samples.engine == "event_driven")
        & (samples.scenario == SCENES[0])
    ]

    assert sorted(one[one.copy_of == 1]["round"]) == [-1, 0, 1]
    assert (one.groupby(["dt_s", "copy_of"]).size() == 3).all()
    assert set(errors[errors.scenario == "asteroids"].seed) == {0, 1, 2}


def test_errors_are_those_of_the_comparison(results: Results):
    """The same number as `position_max_radii` of the report, from the same play."""
    from crosscheck2d.adapters.engines import ENGINES
    from crosscheck2d.reports.compare.comparison import compare

    row = results.points[
        (results.points.scenario == SCENES[0]) & (results.points.engine == "reference")
    ].iloc[1]
    scene = scenario(SCENES[0])
    run = play(ENGINES["reference:exercise"].make(), "reference:exercise", scene, row.dt_s)
    table = compare(scene, [run]).table
    assert (
        row.error
        == table[(table.metric == "position_max_radii") & (table.versus == "truth")].value.iloc[0]
    )


def test_failed_and_refused_points_stay_on_the_chart_at_its_edge(results: Results):
    """Both stand above every error that was measured; the refused one in the corner, as nobody
    knows its cost."""
    figure = go.Figure(charts.speed(results.points[results.points.scenario == SCENES[0]]))
    top = 10 ** figure.layout.yaxis.range[1]
    alone = [trace for trace in figure.data if trace.mode == "markers"]
    edges = {trace.name: trace for trace in alone if trace.hoverinfo != "skip"}  # no light mark

    assert set(edges) == {"pymunk:shipped", "pymunk:matched"}
    assert all(max(trace.y) > top / 10 for trace in edges.values())
    assert "failed" in figure.layout.yaxis.ticktext
    assert "SIGSEGV" in edges["pymunk:matched"].text[0]
    assert 10 ** (figure.layout.xaxis.range[1] - 0.1) < max(edges["pymunk:shipped"].x)
    assert max(edges["pymunk:shipped"].x) < 10 ** figure.layout.xaxis.range[1]
    assert max(edges["pymunk:matched"].x) < max(edges["pymunk:shipped"].x)


def test_the_front_of_a_chart_is_the_event_driven_engine(results: Results):
    """In a head-on collision it is both cheapest and exact, so that nobody else is on the front."""
    points = results.points[results.points.scenario == SCENES[0]]
    drawn = {trace.name: trace for trace in go.Figure(charts.speed(points)).data}
    front, steps = drawn[charts.FRONT], drawn[charts.FRONT_OF_STEPS]
    mine = points[points.engine == "event_driven"]

    assert mine.error.max() < charts.LOWEST
    assert len(front.x) == 3  # it, and the edge up and to the right of it
    assert front.y[1] == front.y[2] == min(drawn["event_driven:float64"].y)  # below the break
    assert front.x[0] == front.x[1] == pytest.approx(mine.cost.min(), rel=1e-3)
    assert min(steps.x) > min(front.x)
    assert min(steps.y) > 2 * front.y[1]


def test_the_chart_of_speed_is_no_longer_four_fifths_empty(results: Results):
    """Between the largest error of an exact engine and the smallest of the others the axis is
    broken: the others have more than half of it."""
    points = results.points[results.points.scenario == SCENES[0]]
    low, high = go.Figure(charts.speed(points)).layout.yaxis.range
    rough = points[np.isfinite(points.error) & (points.error >= charts.LOWEST)].error

    assert (points.error < charts.LOWEST).any()
    assert (high - np.log10(rough.min())) / (high - low) > 0.5
    assert (high - np.log10(rough.min())) / (high - np.log10(charts.LOWEST)) < 0.5  # unbroken


def test_the_page_of_speed_opens_with_which_engine_for_what(
    browser: Browser, results: Results, tmp_path: Path
):
    """On its first screen: a row for the scenes of each situation, and what they cost here."""
    page = tmp_path / "speed.html"
    write_page(page, results, about("crosscheck speed", 0) | SAID)
    tab, heard = opened(browser, page.as_uri(), viewport={"width": 1280, "height": 900})
    top = tab.locator(".which").bounding_box()
    rows = tab.locator(".which tbody th").all_inner_texts()
    costs = tab.locator(".which .cost").all_inner_texts()
    advised = tab.locator("#which code").first.inner_text()
    tab.context.close()

    assert top is not None
    assert top["y"] < 450
    assert [row.splitlines()[0] for row in rows] == [
        "Single collisions",
        "Crowds",
        "Spin",
        "All scenes",
    ]
    assert all(cost[0].isdigit() for cost in costs)
    assert advised == "crosscheck advise my_scene.toml --error 1%"
    assert heard == []


def test_what_cannot_be_reached_is_above_what_costs(results: Results):
    """Refused: never. The reference comes to 1 % at a cost, but not to 1e-6 of a radius down to its
    finest dt."""
    reached = results.reached[results.reached.scenario == SCENES[0]].set_index(
        ["engine", "profile", "accuracy"]
    )

    assert reached.loc[("pymunk", "shipped", "10 %")].why == FAILED
    assert np.isfinite(reached.loc[("reference", "exercise", "1 %")].cost)
    assert reached.loc[("reference", "exercise", "1e-6")].why.startswith("not down to dt")
    assert UNREACHABLE not in set(results.reached[results.reached.engine == "event_driven"].why)


def test_a_random_scene_has_an_interval_over_its_seeds(results: Results):
    """The median error lies between the ends of its bootstrap interval, which are apart."""
    row = results.points[
        (results.points.scenario == "asteroids") & (results.points.engine == "reference")
    ].iloc[0]

    assert row.seeds == 3
    assert row.error_low < row.error < row.error_high


def test_a_pooled_failure_counts_as_infinitely_wrong(results: Results):
    """One of two scenes failed: the upper quartile is infinite, and it is counted."""
    row = results.pooled[
        (results.pooled.engine == "pymunk") & (results.pooled.profile == "shipped")
    ].iloc[0]

    assert (row.failed, np.isinf(row.error_high)) == (1, True)


def test_every_option_of_an_engine_is_set_against_it_in_every_scene(results: Results):
    """Time and error together; an engine changed in nothing reads 1 in both, so it is not
    listed."""
    expected = {option.change for option in OPTIONS if option.engine in PLAYED}
    table = results.options

    assert set(table.change) == expected
    assert (table.groupby("scenario").size() == len(expected)).all()
    assert table[table.status == "ok"].cost_ratio.gt(0).all()
    assert "" not in set(table.change)


def test_float32_breaks_what_it_must(results: Results):
    """Negative control of the option table: in a bouncing ball 2**-24 a step shows, and is not
    1."""
    row = results.options[
        (results.options.scenario == "bouncing_ball_e1") & (results.options.engine == "reference")
    ]

    assert abs(row.error_ratio.iloc[0] - 1) > 1e-3


def test_a_sweep_meets_its_engine_where_it_is_matched(results: Results):
    """10 iterations are what pymunk has as matched: the same error, to the bit, and 1 of 1 where
    all are pooled."""
    table = results.sweeps
    here = table[(table.engine == "pymunk") & (table.scenario == "slide_on_incline")]
    turned = here[here.change == "10"].iloc[0]
    same = here[(here.change == "") & (here.dt_s == turned.dt_s)].iloc[0]
    pooled = results.pooled_sweeps

    assert turned.error == same.error
    assert pooled[pooled.change == "10"].error.iloc[0] == 1.0
    assert {sweep.name for sweep in results.plan.sweeps} == {"pymunk:matched+iterations"}
    assert table[table.scenario == "falling_box"].seeds.eq(3).all()


def test_the_line_of_a_sweep_goes_over_all_its_values_from_cheap_to_expensive(results: Results):
    """Its ends are named; beside it the ladder of its engine, from four times its dt to an eighth
    of it. At its coarsest step disks tunnel: that point is at the edge."""
    points = results.sweeps[results.sweeps.scenario == "falling_box"]
    traces = go.Figure(charts.sweeps(points)).data
    drawn = {trace.name: trace for trace in traces if trace.mode != "markers"}
    (edge,) = [t for t in traces if t.name == "pymunk:matched" and t.mode == "markers"]
    sweep = drawn["pymunk:matched+iterations"]

    assert len(sweep.x) == len(sweep.y) == 8
    assert (sweep.texttemplate[0], sweep.texttemplate[-1]) == ("1", "200")
    assert len(drawn["pymunk:matched"].x) + len(edge.x) == 6
    assert all("fails, tunnels" in text for text in edge.text)


def test_the_cheapest_model_is_named_for_every_scene(results: Results):
    """A closed form where the truth is one; the asteroids are answered event by event."""
    models = results.models.set_index("scenario")

    assert models.loc[SCENES[0]].truth == CLOSED_FORM
    assert models.loc["asteroids"].truth == EVENT_DRIVEN
    assert models.loc["asteroids"].engine == "event_driven:float64"
    assert set(models.model) <= {"closed form", "collision to collision, float64"}


def test_figures_come_back_as_they_were_kept(results: Results, tmp_path: Path):
    """With machine and versions in comment lines; their ratios are within the gate of
    themselves."""
    path = tmp_path / "figures.csv"
    figures.write(path, results, about("crosscheck speed", 0) | SAID)
    kept = figures.ratios(figures.read(path))

    assert "# processor: " in path.read_text()
    assert "# pymunk: 7" in path.read_text()
    assert ("pymunk:matched", 100) in kept
    assert figures.drifted(kept, kept) == []


def test_a_ratio_that_drifts_beyond_the_gate_is_named():
    """Four times as dear, a fourth, or gone; twice as dear passes."""
    kept = {("a:b", 10): 1.0, ("a:b", 100): 1.0, ("c:d", 10): 1.0, ("e:f", 10): 1.0}
    said = figures.drifted(kept, {("a:b", 10): 4.0, ("a:b", 100): 0.25, ("c:d", 10): 2.0})

    assert [line.split(":")[0] for line in said] == ["e", "a", "a"]
    assert "allowed is a factor of 3" in said[1]


def test_the_kept_figures_have_every_ratio_that_is_gated():
    """All engines but the yardstick and those that are it with friction, at all sizes."""
    from crosscheck2d.adapters.engines import ENGINES

    assert set(figures.ratios(figures.read())) == {
        (name, n)
        for name, row in ENGINES.items()
        if (row.bits_of or name) in MEASURED
        and name != "reference:exercise"
        and not row.adds_friction
        for n in figures.GATED
    }


def test_the_page_says_what_is_left_out(results: Results, tmp_path: Path):
    """How much one scene moves the curve, what failed, who costs less than our own solver; and of a
    budget that is cut, which scene, when, of how long, and over how many seconds the share is.
    Without the cut scene none of the latter.
    """
    rows = [
        row for name in PLAYED if name in MECHANISMS for row in budget_of("gas_of_100", 0, name, 4)
    ]
    both = pd.concat(
        [results.measured.budget, pd.DataFrame(rows, columns=results.measured.budget.columns)]
    )
    cut = Results(results.plan, replace(results.measured, budget=both))
    whole, shorter = (page_of(each, tmp_path) for each in (results, cut))
    (gas,) = extent(cut.explained).cuts

    for page in (whole, shorter):
        assert said_of_pool(results.pooled) in page
        assert "pymunk:shipped 1" in said_of_pool(results.pooled)
        assert 'id="versus"' in page
        assert "Scored to" in page  # the asteroids, whose exact answer ends before they do
    assert f"gas_of_100 at {gas.until:.2g} of {gas.horizon:.2g} s" in shorter
    assert 'id="cuts"' in shorter
    assert "1 scene is cut" in shorter
    assert "up to the end of every exact answer" in whole
    assert 'id="cuts"' not in whole


def page_of(results: Results, folder: Path) -> str:
    """The page as text, its entities undone."""
    path = folder / "speed.html"
    write_page(path, results, about("crosscheck speed", 0) | SAID)
    return unescape(path.read_text())


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (400, "dark")])
def test_the_page_draws_every_chart_and_asks_nothing_of_anywhere(
    browser: Browser, results: Results, tmp_path: Path, width: int, scheme: str
):
    """No request but for itself, no word on the console, nothing wider than the page, a figure in
    every place, each one that plotly knows."""
    page = tmp_path / "speed.html"
    write_page(page, results, about("crosscheck speed", 0) | SAID)
    assert check_figures(page.read_text()) == 2 + 2 + 3 + 1 + 2 * len(SCENES)
    tab, heard = opened(
        browser, page.as_uri(), viewport={"width": width, "height": 900}, color_scheme=scheme
    )
    for plot in tab.locator(".plot").all():
        plot.scroll_into_view_if_needed()
        plot.locator(".main-svg").first.wait_for()
    assert tab.locator(".plot").count() == 2 + 2 + 3 + 1 + 2 * len(SCENES)
    assert overhang(tab) <= 0
    # with mechanisms: three engines; two disabled
    assert tab.locator("#budget tbody tr").count() == 2 * 3 + 2
    assert (
        tab.locator("text=no <b>such</b> thing").count() == 0
        or tab.locator("b:text('such')").count() == 0
    )
    assert heard == []
