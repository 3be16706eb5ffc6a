"""The charts of the lessons in Chromium: ticks of their axes, texts of their guides."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise
from math import log10

import pytest
from playwright.sync_api import Browser, Page

from reports.lessons.catalogue import LESSONS
from reports.lessons.pages import FILES, answer_json, lesson_page
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
