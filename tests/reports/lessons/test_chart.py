"""The charts of the lessons in Chromium: ticks of their axes, texts of their guides."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise
from math import log10

import pytest
from playwright.sync_api import Browser, Page

from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.pages import FILES, answer_json, lesson_page
from tests.reports.page.browsing import opened


@pytest.fixture(scope="module")
def page(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Part 3 of lesson 1 at its largest step, whose chart of the error has two guides."""
    lesson, places = LESSONS["particle"], (2, 3)
    path = tmp_path_factory.mktemp("chart") / "particle.html"
    path.write_text(lesson_page(lesson, answer_json(lesson.name, places), FILES))
    page, heard = opened(browser, path.as_uri(), viewport={"width": 1280, "height": 1800})
    page.wait_for_function("() => window.lesson && document.querySelector('.guide')")
    yield page
    page.context.close()
    assert heard == []


@pytest.mark.parametrize(
    ("low", "high"), [(1.1, 9.0), (15.0, 70.0), (3.0, 290.0), (1.5, 95.0), (1e-9, 1.0)]
)
def test_a_logarithmic_axis_has_ticks_in_each_of_its_decades(page: Page, low: float, high: float):
    """At least two, none further than a decade from the next or an end, unless there are more
    than six decades; all within the axis."""
    ticks = page.evaluate(f"new Axis([{low}, {high}], true, 0, 400).ticks().map(([v]) => v)")
    places = [log10(low), *map(log10, ticks), log10(high)]
    gaps = [after - before for before, after in pairwise(places)]

    assert len(ticks) >= 2
    assert max(gaps) <= max(1 + 1e-9, (log10(high) - log10(low)) / 4)
    assert min(gaps) >= -0.05 * (log10(high) - log10(low)) - 1e-9  # the room at both ends


def test_texts_of_guides_are_apart_and_over_every_line(page: Page):
    """That of a guide must be readable where the line of its neighbour crosses it: no text lies on
    another, and the page's colour surrounds each."""
    boxes = page.locator(".over").evaluate_all(
        "all => all.map((each) => { const box = each.getBoundingClientRect();"
        " return [box.left, box.right, box.top, box.bottom]; })"
    )
    painted = page.locator(".over").evaluate_all(
        "all => all.map((each) => [getComputedStyle(each).paintOrder.split(' ')[0],"
        " getComputedStyle(each).stroke !== 'none',"
        " [...each.parentNode.querySelectorAll('.guide')].every((line) =>"
        " line.compareDocumentPosition(each) & Node.DOCUMENT_POSITION_FOLLOWING)])"
    )

    assert len(boxes) == 2
    for one, other in combinations(boxes, 2):
        assert one[1] <= other[0] or other[1] <= one[0] or one[3] <= other[2] or other[3] <= one[2]
    assert painted == [["stroke", True, True]] * 2


@pytest.mark.parametrize(
    ("values", "whole"), [([0, 1, 2], True), ([1, 2, 3, 4], True), ([0.0, 0.5, 2.0], False)]
)
def test_an_axis_of_counts_has_ticks_at_whole_numbers(page: Page, values: list[float], whole: bool):
    """One of lengths may have halves."""
    ticks = page.evaluate(f"new Axis({values}, false, 0, 400).ticks().map(([v]) => v)")

    assert all(tick == int(tick) for tick in ticks) is whole


@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("largest", [1.0, 0.00123, 0.0000251, 12345.0])
def test_the_title_of_an_axis_touches_none_of_its_numbers(page: Page, largest: float, width: int):
    """However long these are, also in the larger letters of a narrow page; and it stays in the
    picture."""
    page.set_viewport_size({"width": width, "height": 1800})
    page.evaluate(
        "high => document.querySelector('.curves').append(drawChart({title: 'long numbers',"
        " x: 'time in s', y: 'm', log: '', guides: [],"
        " curves: [{name: 'truth', x: [0, 1], y: [0, high]}]}))",
        largest,
    )
    picture, title, number = page.evaluate(
        """() => {
          const picture = [...document.querySelectorAll('figure svg')].at(-1);
          const left = (one) => one.getBoundingClientRect().left;
          const title = [...picture.querySelectorAll('text[transform]')].at(-1);
          const numbers = [...picture.querySelectorAll('text[text-anchor=end]')];
          return [left(picture), title.getBoundingClientRect(), Math.min(...numbers.map(left))];
        }"""
    )

    assert picture <= title["left"]
    assert title["right"] < number


@pytest.mark.parametrize(
    ("height", "lowest"),
    [pytest.param(0.0, False, id="curve at the foot"), pytest.param(1.0, True, id="at the top")],
)
def test_the_text_of_a_guide_lies_on_no_curve(page: Page, height: float, lowest: bool):
    """It stands in the lowest row, or above where a curve runs through that."""
    page.set_viewport_size({"width": 1280, "height": 1800})
    page.evaluate(
        "height => document.querySelector('.curves').append(drawChart({title: 'guide', x: 's',"
        " y: 'm', log: '', guides: [['x', 0.4, 'here']], curves: [{name: 'truth', x: [0, 1],"
        " y: [height, height]}, {name: 'truth', x: [0, 0], y: [0, 1]}]}))",
        height,
    )
    text, curve, foot = page.evaluate(
        """() => {
          const picture = [...document.querySelectorAll('figure svg')].at(-1);
          const box = (one) => one.getBoundingClientRect();
          return [box(picture.querySelector('.over')), box(picture.querySelector('.curve')),
            box(picture.querySelector('.guide')).bottom];
        }"""
    )

    assert text["bottom"] < curve["top"] or text["top"] > curve["bottom"]
    assert (foot - text["bottom"] < text["height"] / 2) is lowest


@pytest.mark.parametrize("width", [1280, 400])
def test_a_name_in_the_table_of_facts_is_clear_of_its_value(page: Page, width: int):
    """Also the longest name, beside a value that takes several lines, and in a slider's label."""
    page.set_viewport_size({"width": width, "height": 1800})
    gaps = page.evaluate(
        """() => {
          const drawn = (one) => {
            const range = document.createRange();
            range.selectNodeContents(one);
            return range.getBoundingClientRect();
          };
          const value = "works at 2, and fails at 2.089 or more in every scene of the search";
          const line = row("tr", ["th", "event_driven:float64"], ["td", value]);
          document.querySelector(".facts-table tbody").append(line);
          const gap = drawn(line.lastChild).left - drawn(line.firstChild).right;
          line.remove();
          const sliders = [...document.querySelectorAll(".sliders label:has(output)")];
          return [gap, ...sliders.map((label) =>
            drawn(label.querySelector("output")).left - drawn(label.firstChild).right)];
        }"""
    )

    assert len(gaps) > 1
    assert min(gaps) > 8, gaps


@pytest.mark.parametrize("small", [1.2e-16, 1e-12])
def test_what_is_0_has_a_place_of_its_own_at_the_foot_of_a_logarithmic_axis(
    page: Page, small: float
):
    """Below every other value and every other tick, within the axis, and called 0."""
    zero, least, ticks = page.evaluate(
        f"(() => {{ const axis = new Axis([0, {small}, 1e-3], true, 0, 400);"
        f" return [axis.place(0), axis.place({small}),"
        " axis.ticks().map(([v, text]) => [axis.place(v), text])]; })()"
    )

    assert 0 < zero < least
    assert ticks[0] == [zero, "0"]
    assert all(place >= least - 20 > zero for place, _ in ticks[1:])
