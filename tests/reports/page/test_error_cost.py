"""The first picture: error against cost, what is drawn where there are no times, and three
sentences that follow from the numbers and change with them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Browser, Page

from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.page.cost_picture import with_two_ticks
from crosscheck2d.reports.page.cost_points import RunTimes
from crosscheck2d.reports.page.cost_sentences import surely_less
from crosscheck2d.reports.page.error_cost import ErrorCost, error_cost
from crosscheck2d.reports.page.pooled import SCORES, scores
from crosscheck2d.reports.run.timing import noise_of
from crosscheck2d.reports.run.timing_pass import COLUMNS
from tests.reports.page.browsing import opened, overhang
from tests.reports.page.small import write_small

pytestmark = pytest.mark.slow  # pages of their own in Chromium

QUIET, LOUD = noise_of([0.97, 1.0, 1.02]), noise_of([0.7, 1.0, 1.3])
STEPS = (0.02, 0.01, 0.005)
FAST, NEAR, STUCK = "reference:exercise", "pymunk:matched", "box2d:shipped"
ERRORS = {FAST: (0.4, 0.2, 0.1), NEAR: (0.04, 0.02, 0.01), STUCK: (0.5, 0.5, 0.5)}
COSTS = {FAST: (10.0, 20.0, 40.0), NEAR: (100.0, 200.0, 400.0), STUCK: (110.0, 220.0, 440.0)}
BINDING = dict.fromkeys(ERRORS, 1.0)  # µs per simulated second


def shown(
    errors: dict[str, tuple[float, ...]] = ERRORS,
    costs: dict[str, tuple[float, ...]] = COSTS,
    binding: dict[str, float] = BINDING,
    noise: object = QUIET,
    asked: float = 12.0,
    scenes: int = 2,
) -> ErrorCost:
    """What the page shows of three engines in some equal scenes."""
    rows, times = [], []
    for scene in (f"scene_{k}" for k in range(scenes)):
        for name in errors:
            engine, profile = name.split(":")
            for k, dt in enumerate(STEPS):
                rows.append((scene, name, errors[name][k], np.nan, dt, k, k == 1))
                cost = costs[name][k]
                time = [scene, engine, profile, dt, 1.0, 5, cost, cost, cost, binding[name], 2.0]
                times.append((*time, 0.0, np.nan))
    clock = RunTimes(pd.DataFrame(times, columns=COLUMNS), noise, asked)
    found = error_cost(pd.DataFrame(rows, columns=SCORES), clock, set())
    assert found is not None
    return found


def test_the_sentences_are_of_speed_and_of_error():
    """Who is unbeaten in both, who is cheapest for 0.1 radii, what half a step brings and to
    whom not."""
    unbeaten, cheapest, halving = shown().sentences

    assert f"than {FAST} (0.4 radii for 10 µs), {NEAR} (0.04 radii for 100 µs)." in unbeaten
    assert STUCK not in unbeaten
    assert cheapest.startswith("Of 2 scenes, the cheapest engine with an error of at most 0.1")
    assert f"radii is {FAST} in 2 (40 µs). It is the same" in cheapest
    assert "multiplies the time by 2.0 and divides the error by 2.0" in halving
    assert f"brings {STUCK} no nearer" in halving


def test_where_one_halving_makes_the_error_larger_the_ratio_is_called_an_average():
    """0.4, then 0.5, then 0.1 radii: a factor of 2 for each of two halvings, on average."""
    uneven = shown(errors={FAST: (0.4, 0.5, 0.1), NEAR: (0.4, 0.2, 0.1)}).sentences[-1]

    assert uneven.startswith("On average, halving the step multiplies the time by 2.0")
    assert "divides the error by 2.0" in uneven


def test_with_the_numbers_of_two_engines_swapped_the_sentences_name_the_other():
    """Errors and costs of one given to the other: nothing is written by hand."""
    swapped = {FAST: NEAR, NEAR: FAST, STUCK: STUCK}
    plain = shown().sentences
    other = shown(
        {swapped[name]: e for name, e in ERRORS.items()},
        {swapped[name]: c for name, c in COSTS.items()},
    ).sentences

    assert f"is {NEAR} in 2 (40 µs)" in other[1]
    assert f"than {NEAR} (0.4 radii for 10 µs), {FAST} (0.04 radii" in other[0]
    assert plain[:2] != other[:2]
    flat = shown(ERRORS | {FAST: (0.4, 0.4, 0.4), STUCK: (0.5, 0.3, 0.1)}).sentences[2]
    assert f"brings {FAST} no nearer" in flat


def test_no_sentence_claims_what_the_way_from_python_makes():
    """90 of 100 µs are the binding's: then it is not said that the other costs least, as without
    it the order is the other way; with 1 µs it is said."""
    errors = {FAST: (0.05, 0.04, 0.03), NEAR: (0.05, 0.04, 0.03), STUCK: (0.5, 0.5, 0.5)}
    costs = COSTS | {FAST: (40.0, 80.0, 160.0)}
    bound = shown(errors, costs, {FAST: 1.0, NEAR: 90.0, STUCK: 1.0}).sentences
    free = shown(errors, costs, BINDING).sentences

    assert bound[1].startswith("In none of 2 scenes one engine is clearly the cheapest")
    assert f"If calls from Python cost nothing, it is also true of {NEAR}." in bound[0]
    assert f"is {FAST} in 2 (" in free[1]
    assert "If calls from Python" not in free[0]


def test_a_cost_is_less_only_by_more_than_the_noise_with_the_binding_and_without():
    """By 5 %: not; by 30 %: yes; where the rest is the other way: not."""
    assert not surely_less((100.0, 100.0), (105.0, 105.0))
    assert surely_less((100.0, 100.0), (150.0, 150.0))
    assert not surely_less((100.0, 100.0), (150.0, 50.0))


@pytest.mark.parametrize(
    ("noise", "asked", "says"),
    [
        (LOUD, 12.0, "busy: an engine timed twice differs from itself by 15 %"),
        (noise_of([]), 12.0, "could not be timed within 12 s"),
        (QUIET, 0.0, "took no times (--timings 0)"),
    ],
)
def test_without_times_to_trust_the_picture_says_so_and_claims_none(
    noise: object, asked: float, says: str
):
    """The axis counts steps, and no sentence has a time in it; with a quiet clock both do."""
    found = shown(noise=noise, asked=asked)
    axis = found.drawings["pooled"].figure["layout"]["xaxis"]["title"]

    assert says in found.fault
    assert axis == "steps per simulated second"
    assert len(found.sentences) == 2
    assert not any(word in "".join(found.sentences) for word in ("µs", "cost", "cheap", "time"))
    assert found.costs == []
    assert shown().fault == ""
    figure = shown().drawings["pooled"].figure
    assert "µs per simulated second" in figure["layout"]["xaxis"]["title"]


def test_what_no_step_reaches_and_what_failed_are_drawn_as_such():
    """A dotted line to the edge for the one that comes no nearer, and only for that; a mark at the
    edge "failed" for no result."""
    errors = ERRORS | {NEAR: (np.inf, 0.02, 0.01)}
    figure = shown(errors, scenes=1).drawings["scene_0"].figure
    lines = [trace for trace in figure["data"] if "line" in trace]
    dotted = [trace["name"] for trace in lines if trace["line"]["dash"] == "1px,4px"]
    said = [trace for trace in figure["data"] if trace.get("text")]
    lost = [trace["name"] for trace in said if "failed" in trace["text"][0]]

    assert dotted == [STUCK]
    assert lost == [NEAR]
    assert figure["layout"]["yaxis"]["ticktext"][-1] == "failed"


def test_an_axis_has_two_numbers_however_short_it_is():
    """Between 11 and 90 there is no power of ten but 10 below it; a long axis is left as it is."""
    powers = {"tickvals": [10.0, 100.0], "ticktext": ["10", "100"]}
    short = with_two_ticks(powers | {"range": [1.05, 1.95]})
    long = powers | {"range": [0.9, 2.1]}

    assert (short["tickvals"], short["ticktext"]) == ([20.0, 50.0], ["20", "50"])
    assert with_two_ticks(long) == long


def test_the_light_mark_is_the_cost_without_the_binding():
    """Of 10 µs with 4 of the binding at 6; of 100 with 99.9 at the tenth that noise leaves
    unknown."""
    found = shown(binding=BINDING | {FAST: 4.0, NEAR: 99.9}, scenes=1)
    traces = found.drawings["scene_0"].figure["data"]
    light = {trace["name"]: trace["x"] for trace in traces if trace.get("opacity") == 0.35}

    assert light[FAST][0] == pytest.approx(6.0)
    assert light[NEAR][0] == pytest.approx(10.0)


@pytest.fixture(scope="module")
def timed(comparisons: list[Comparison], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the three small scenes, with times of all runs."""
    path = tmp_path_factory.mktemp("timed") / "report.html"
    rows = []
    for row in scores(comparisons).to_dict("records"):
        engine, profile = row["name"].split(":")
        cost = 1.0 / row["dt_s"]
        times = [row["scenario"], engine, profile, row["dt_s"], 1.0, 5, cost, cost, cost]
        rows.append((*times, 0.3 * cost, 2.0, 0.0, np.nan))
    clock = RunTimes(pd.DataFrame(rows, columns=COLUMNS), QUIET, 12.0)
    write_small(path, comparisons, clock=clock)
    return path


@pytest.fixture(scope="module")
def picture(browser: Browser, timed: Path) -> Iterator[Page]:
    """That page as wide as a phone, its first picture drawn."""
    page, heard = opened(browser, timed.as_uri(), viewport={"width": 400, "height": 900})
    page.wait_for_selector("#picture .main-svg")
    yield page

    assert heard == []


def test_the_report_opens_with_the_picture(picture: Page):
    """Before all other sections' tables: axes with units, the best corner, three sentences."""
    said = picture.inner_text("#picture .plot")
    first = picture.evaluate("document.querySelector('main .plot').closest('.scenario').id")

    assert first == "picture"
    assert "engine time (µs per simulated second)" in said
    assert "largest error (radii)" in said
    assert "best" in said
    assert picture.locator("#picture .findings li").count() == 3
    assert overhang(picture) == 0


def test_the_picker_shows_a_scene_and_paper_has_what_is_picked(picture: Page):
    """Another scene has other points; back again they are the first ones."""
    points = """[...document.querySelectorAll('#picture .plot .point')]
      .map(p => p.getAttribute('transform'))"""
    names = picture.locator("#picture .pick option").all_inner_texts()
    before = picture.evaluate(points)
    picture.select_option("#picture .pick select", names[-1])
    picture.wait_for_function(f"JSON.stringify({points}) !== {str(before)!r}")
    other = picture.evaluate(points)
    held = picture.evaluate("printed.get(document.querySelector('#picture .plot'))")
    picture.select_option("#picture .pick select", "pooled")

    assert names[0] == "all 2 scenes"
    assert other != before
    assert held
