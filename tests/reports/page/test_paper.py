"""What is printed, and what is saved of a chart: nothing blank, nothing cut, the very numbers."""

from __future__ import annotations

import csv
import io
import re
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.reports.compare.comparison import Comparison
from tests.reports.page.browsing import opened
from tests.reports.page.small import HEAD_ON, ORBIT, PLAYED, write_small
from tests.reports.terminal.command_line import crosscheck

pytestmark = pytest.mark.slow  # pages of their own in Chromium

A4 = {"width": 703, "height": 1032}  # px within margins of 12 mm, at 96 px an inch
UNPRINTED = "removeEventListener('beforeprint', drawPaper)"


@pytest.fixture(scope="module")
def sheet(browser: Browser, path: Path) -> Iterator[Page]:
    """The page as wide as paper, nothing of it scrolled to."""
    page, heard = opened(browser, path.as_uri(), viewport=A4)
    page.wait_for_function("() => window.Plotly && printed.size === 4")
    yield page

    assert heard == []


def pages_of(pdf: bytes) -> int:
    """How many pages a PDF of Chromium has."""
    return len(re.findall(rb"/Type\s*/Page\b", pdf))


def strokes_of(pdf: bytes) -> int:
    """How many straight lines its pages draw: the operator `l` of their contents."""
    found = 0
    for stream in re.findall(rb"stream\r?\n(.*?)endstream", pdf, re.DOTALL):
        try:
            found += len(re.findall(rb" l\r?\n", zlib.decompress(stream)))
        except zlib.error:
            continue  # no text of a page: a font, or what is not deflated
    return found


@pytest.mark.slow  # a page of its own in Chromium
def test_charts_that_were_never_in_view_are_printed(browser: Browser, path: Path):
    """In the PDF there are the lines of all of them. Without what `beforeprint` does there are
    not: then a PDF of this page has blank charts, as it had."""
    made = []
    for before in ("1", UNPRINTED):
        page, heard = opened(browser, path.as_uri())
        page.wait_for_function("() => window.Plotly && printed.size === 4")
        page.evaluate(before)
        made.append(page.pdf(format="A4", print_background=True))
        page.context.close()
        assert heard == []
    drawn, blank = map(strokes_of, made)

    # a line over time has some 100 points or more, and three engines are drawn
    assert drawn > blank + 300
    assert pages_of(made[0]) <= 12


@pytest.mark.slow
def test_every_chart_on_paper_is_drawn_and_is_gone_from_the_screen_after(sheet: Page):
    """Two of all scenes, two of the scene that was asked for; none is left behind."""
    sheet.evaluate("dispatchEvent(new Event('beforeprint'))")
    drawn = sheet.evaluate(
        "[...document.querySelectorAll('.sheet')].map(s => s.querySelectorAll('.trace').length)"
    )
    inks = sheet.evaluate("document.querySelector('.sheet .xtick text').style.fill")
    sheet.evaluate("dispatchEvent(new Event('afterprint'))")

    assert len(drawn) == 4
    assert min(drawn) >= len(PLAYED)
    assert inks == "rgb(28, 34, 41)"  # of paper, whatever the page is in
    assert sheet.locator(".sheet").count() == 0


def test_a_page_that_is_printed_too_early_says_so(sheet: Page):
    """In the place of a chart that is not drawn; not where it is."""
    content = "getComputedStyle(document.querySelector('.plot[data-paper]'), '::after').content"
    sheet.emulate_media(media="print")
    early = sheet.evaluate(content)
    sheet.evaluate("dispatchEvent(new Event('beforeprint'))")
    drawn = sheet.evaluate(content)
    sheet.evaluate("dispatchEvent(new Event('afterprint'))")
    sheet.emulate_media(media="screen")

    assert "print again" in early
    assert drawn == "none"


def test_panels_that_are_printed_too_early_say_so(sheet: Page):
    """Until the first scene is drawn in them; then they are printed."""
    content = "getComputedStyle(document.querySelector('#panels'), '::after').content"
    sheet.wait_for_function("() => document.querySelector('#panels').dataset.shown")
    sheet.emulate_media(media="print")
    drawn, seen = sheet.evaluate(content), sheet.locator(".panels").is_visible()
    sheet.evaluate("document.querySelector('#panels').removeAttribute('data-shown')")
    early, blank = sheet.evaluate(content), sheet.locator(".panels").is_visible()
    sheet.evaluate("document.querySelector('#panels').dataset.shown = 'again'")
    sheet.emulate_media(media="screen")

    assert (drawn, seen, blank) == ("none", True, False)
    assert "print again" in early


CUT = """() => [...document.querySelectorAll('table')].filter(t => t.offsetParent)
  .filter(t => t.getBoundingClientRect().right > innerWidth + 1).length"""


def test_no_table_is_cut_on_paper(sheet: Page):
    """Every one ends within the margins; made as wide as on screen, the map does not."""
    sheet.emulate_media(media="print")
    shown, cut = sheet.locator("table:visible").count(), sheet.evaluate(CUT)
    sheet.evaluate("document.querySelector('.map').style.minWidth = '60rem'")
    wide = sheet.evaluate(CUT)
    sheet.evaluate("document.querySelector('.map').style.minWidth = ''")
    sheet.emulate_media(media="screen")

    assert (shown >= 3, cut, wide) == (True, 0, 1)


def test_a_scene_that_is_asked_for_has_half_a_page_and_others_none(sheet: Page):
    """Its charts are side by side, no replay, no settings."""
    sheet.emulate_media(media="print")
    sheet.evaluate("dispatchEvent(new Event('beforeprint'))")
    box = sheet.locator(f"#s-{ORBIT}").bounding_box()
    charts = [each.bounding_box() for each in sheet.locator(f"#s-{ORBIT} .sheet").all()]
    others = sheet.locator(f"#s-{HEAD_ON}").is_visible()
    controls = sheet.locator(".player:visible, .saves:visible, #settings:visible").count()
    sheet.evaluate("dispatchEvent(new Event('afterprint'))")
    sheet.emulate_media(media="screen")

    assert box is not None
    assert box["height"] < A4["height"] / 2
    assert len(charts) == 2
    assert charts[0]["x"] + charts[0]["width"] <= charts[1]["x"]  # type: ignore[index]
    assert (others, controls) == (False, 0)


@pytest.mark.long  # as many scenes as a whole run has and one more
@pytest.mark.parametrize("engines", [ENGINES, {**ENGINES, **FETCHED}], ids=["11", "17"])
def test_a_whole_run_is_twelve_pages_at_most(
    browser: Browser, comparisons: list[Comparison], tmp_path: Path, engines: dict[str, EngineRow]
):
    """Of 51 scenes; all scenes on paper are more."""
    many = [as_all_engines(comparisons[1], f"scene_of_long_name_{k}", engines) for k in range(51)]
    pages = []
    for on_paper in ((), [each.scenario.name for each in many]):
        write_small(tmp_path / "r.html", many, on_paper=on_paper)
        page, _ = opened(browser, (tmp_path / "r.html").as_uri())
        page.wait_for_function("() => window.Plotly")
        pages.append(pages_of(page.pdf(format="A4", print_background=True)))
        page.context.close()

    assert pages[0] <= 12 < pages[1]


def as_all_engines(comparison: Comparison, name: str, engines: Iterable[str]) -> Comparison:
    """The comparison under another name, what one engine played given to all."""
    scenario = replace(comparison.scenario, name=name)
    engine, profile = PLAYED[0].split(":")
    mine = [run for run in comparison.runs if run.name == PLAYED[0]]
    table = comparison.table
    rows = table[(table.engine == engine) & (table.profile == profile)]
    whose = [each.split(":") for each in engines]
    runs = [replace(run, engine=e, profile=p, scenario=name) for e, p in whose for run in mine]
    parts = [rows.assign(engine=e, profile=p, scenario=name) for e, p in whose]
    return replace(
        comparison, scenario=scenario, runs=runs, table=type(table)(concatenated(parts, table))
    )


def concatenated(parts: list, table) -> list[dict]:
    """The rows of all parts."""
    return [row for part in parts for row in part[list(table.columns)].to_dict("records")]


def saved(page: Page, kind: str, plot: str) -> str:
    """What a click on `kind` under a chart downloads."""
    chart = page.locator(plot)
    chart.scroll_into_view_if_needed()
    chart.locator(".main-svg .trace").first.wait_for()
    with page.expect_download() as download:
        chart.locator(f"xpath=ancestor::figure//*[@data-save='{kind}']").click()
    return Path(download.value.path()).read_text(encoding="utf-8")


@pytest.mark.slow  # a page of its own in Chromium
def test_the_numbers_of_a_chart_are_saved_as_they_were_computed(
    browser: Browser, path: Path, comparisons: list[Comparison]
):
    """As CSV: also those drawn below the break of the axis, to the digits of a chart; no guide."""
    page, heard = opened(browser, path.as_uri(), accept_downloads=True)
    text = saved(page, "csv", f"#s-{HEAD_ON} .plot[data-chart=convergence]")
    page.context.close()
    rows = list(csv.DictReader(io.StringIO(text)))
    table = comparisons[0].table
    table = table[(table.metric == "position_max_radii") & (table.versus == "truth")]
    expected = {
        (f"{row.engine}:{row.profile}", float(f"{row.dt_s:.5g}")): row.value
        for row in table.itertuples()
    }

    assert list(rows[0]) == ["engine", "dt (s)", "position error (radii)"]
    assert {(row["engine"], float(row["dt (s)"])) for row in rows} == set(expected)
    for row in rows:
        value = expected[row["engine"], float(row["dt (s)"])]
        assert float(row["position error (radii)"]) == pytest.approx(value, rel=1e-2)  # 3 digits
    assert heard == []


@pytest.mark.slow
def test_the_numbers_of_a_chart_by_situation_name_the_situation(browser: Browser, path: Path):
    """Not where a mark stands in its column; those of error against steps name their step size."""
    page, heard = opened(browser, path.as_uri(), accept_downloads=True)
    text, other = (
        saved(page, "csv", f".plot[data-chart={chart}]") for chart in ("situations", "pooled")
    )
    page.context.close()
    rows, points = (list(csv.DictReader(io.StringIO(each))) for each in (text, other))

    assert list(rows[0]) == ["engine", "situation", "error (radii)"]
    assert {row["situation"] for row in rows} == {"Single collisions"}
    failed = [row for row in points if "failed" in row["point"]]
    assert {row["largest error (radii)"] for row in failed} == {""}
    assert all("step size" in row["point"] for row in points if row not in failed)
    assert heard == []


@pytest.mark.slow
def test_a_chart_is_saved_as_a_picture_with_its_title_and_legend(browser: Browser, path: Path):
    """As SVG, in the colours of paper also where the page is dark, without what is hidden."""
    page, heard = opened(
        browser, path.as_uri(), accept_downloads=True, color_scheme="dark", reduced_motion="reduce"
    )
    page.evaluate("name => document.getElementById('s-' + name).scrollIntoView()", HEAD_ON)
    page.wait_for_function("name => players[name]", arg=HEAD_ON)
    page.locator(f"#s-{HEAD_ON} .legend input[value='box2d:shipped']").uncheck()
    svg = saved(page, "svg", f"#s-{HEAD_ON} .plot[data-chart=deviation]")
    page.context.close()

    assert svg.startswith("<svg")
    assert f"Trajectory deviation: {HEAD_ON}" in svg
    assert "pymunk:matched" in svg
    assert "box2d:shipped" not in svg
    assert "rgb(209, 84, 10)" in svg  # pymunk's on paper
    assert heard == []


def test_scenes_on_paper_are_asked_for_after_print(tmp_path: Path):
    """Of a run: half a page for each; one that it does not have is refused, and so are scenes
    without the option and the option without a scene."""
    run = ("run", "free_fall", "near_miss", "--engine", "pymunk:matched", "--dt", str(1 / 120))
    assert crosscheck(*run, "--out", "out", cwd=tmp_path).returncode == 0
    page = tmp_path / "out" / "report.html"
    none = page.read_text(encoding="utf-8")
    done = crosscheck("report", "out", "--print", "near_miss", cwd=tmp_path)
    one = page.read_text(encoding="utf-8")
    refused = [
        crosscheck("report", "out", *more, cwd=tmp_path)
        for more in (("--print", "no_such"), ("near_miss",), ("--print",))
    ]

    assert done.returncode == 0
    assert 'id="s-near_miss" data-name="near_miss" data-on-paper' in one
    assert 'class="scenario half-page"' not in none
    assert one.count('class="scenario half-page"') == 1
    assert [each.returncode for each in refused] == [2, 2, 2]
    assert "--print no_such: not in out, which has free_fall, near_miss" in refused[0].stderr
    assert "after --print" in refused[1].stderr
    assert "name the scenes" in refused[2].stderr
