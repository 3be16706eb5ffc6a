"""The page is one file that asks nothing of anywhere, draws what was computed, and runs no text it
was given."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Browser, Page, TimeoutError

from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.page.charts import CHARTS, Drawing, packed_charts
from crosscheck2d.reports.page.replay import GRID
from crosscheck2d.reports.page.report import write_page
from tests.reports.page.browsing import opened, overhang
from tests.reports.page.figures import check_figures
from tests.reports.page.small import ASTEROIDS, HEAD_ON, HOSTILE, ORBIT, PLAYED


@pytest.fixture(scope="module")
def desktop(browser: Browser, path: Path) -> Iterator[tuple[Page, list[str]]]:
    """The page at 1280 px, opened once: that takes two seconds."""
    page, heard = opened(browser, path.as_uri(), viewport={"width": 1280, "height": 900})
    yield page, heard
    page.context.close()


@pytest.fixture
def page(desktop: tuple[Page, list[str]]) -> Iterator[Page]:
    """The page at 1280 px, on light, at its top; at the end it has asked for nothing and complained
    of nothing."""
    page, heard = desktop
    page.emulate_media(color_scheme="light")
    page.evaluate("scrollTo({ top: 0, behavior: 'instant' })")
    yield page

    assert heard == []


def with_engine(page: Page, name: str) -> None:
    """Scroll to a scenario and wait until its engine is there."""
    page.evaluate("name => document.getElementById('s-' + name).scrollIntoView()", name)
    page.wait_for_function("name => players[name]", arg=name)


@pytest.mark.parametrize(
    ("name", "charts"),
    [
        (HEAD_ON, len(CHARTS)),
        pytest.param(ORBIT, len(CHARTS), marks=pytest.mark.slow),
        # without a truth there is no error against dt
        pytest.param(ASTEROIDS, len(CHARTS) - 1, marks=pytest.mark.slow),
    ],
)
def test_every_chart_is_drawn_once_it_is_in_view(page: Page, name: str, charts: int) -> None:
    """Each chart holds a drawing with a line an engine; all that have a figure are drawn."""
    plots = page.locator(f"#s-{name} .plot")

    assert plots.count() == charts
    for k in range(plots.count()):
        plots.nth(k).scroll_into_view_if_needed()
        plots.nth(k).locator(".main-svg .scatterlayer .trace").first.wait_for()
        names = plots.nth(k).evaluate("plot => plot.data.map(trace => trace.name)")
        assert set(names) <= {*PLAYED, "∝ dt"}
        assert len(names) >= len(PLAYED) - 1


@pytest.mark.slow
def test_nothing_is_drawn_before_it_is_in_view(browser: Browser, path: Path) -> None:
    """A page just opened has drawn no chart and unpacked no replay of its last scenario."""
    page, _ = opened(browser, path.as_uri())
    drawn = (
        page.locator(f"#s-{ASTEROIDS} .main-svg").count(),
        page.evaluate("name => name in players", ASTEROIDS),
    )
    page.context.close()

    assert drawn == (0, False)


def test_the_replay_moves_disks(page: Page) -> None:
    """Another time is another picture and other positions."""
    with_engine(page, HEAD_ON)
    picture = "name => document.querySelector('#s-' + name + ' canvas').toDataURL()"
    before = page.evaluate(picture, HEAD_ON)
    seek = (
        "name => [0, 1].map(t => { players[name].seek(t); return"
        " players[name].positions('pymunk:matched'); })"
    )
    start, later = page.evaluate(seek, HEAD_ON)

    assert abs(later[0][0] - start[0][0]) > 0.1
    assert page.evaluate(picture, HEAD_ON) != before


@pytest.mark.parametrize(
    "name",
    [
        HEAD_ON,
        pytest.param(ORBIT, marks=pytest.mark.slow),
        pytest.param(ASTEROIDS, marks=pytest.mark.long),
    ],
)
def test_the_replay_shows_the_trajectory(
    page: Page, comparisons: list[Comparison], name: str
) -> None:
    """At the packed instants positions are those of the run, to half a step of the position
    grid."""
    with_engine(page, name)
    comparison = next(each for each in comparisons if each.scenario.name == name)
    instants = np.array(page.evaluate("name => players[name].pack.t", name))
    at_all = (
        "([p, layer]) => players[p].pack.t.map(t => { players[p].seek(t); return"
        " players[p].positions(layer); })"
    )
    shown = [page.evaluate(at_all, [name, engine]) for engine in PLAYED]
    rows = np.rint(instants / comparison.scenario.sample_interval).astype(int)
    for engine, positions in zip(PLAYED, shown):
        run = next(r for r in comparison.runs if r.name == engine and r.dt == comparison.middle_dt)
        assert run.trajectory is not None
        expected = run.trajectory.position[rows]
        half_step = np.ptp(expected, axis=(0, 1)) / GRID / 2
        # A static disk's coordinate may span nothing; the float64 sum of low and step then rounds
        # by itself.
        assert (np.abs(np.array(positions) - expected) <= half_step * (1 + 1e-6) + 1e-12).all()


def test_the_truth_is_not_drawn_beyond_its_horizon(
    page: Page, comparisons: list[Comparison]
) -> None:
    """After the horizon there are no positions of the truth, and the engine says when it ended."""
    with_engine(page, ORBIT)
    truth = comparisons[1].truth
    assert truth is not None
    at = "([name, t]) => { players[name].seek(t); return players[name].positions('truth'); }"
    before, after = (page.evaluate(at, [ORBIT, float(truth.horizon) + s]) for s in (-0.1, 0.1))

    assert before is not None
    assert after is None
    assert "exact answer ends at" in page.locator(f"#s-{ORBIT} .ended").inner_text()


def test_the_replay_is_played_with_the_keyboard(page: Page) -> None:
    """Arrows step by a frame, space plays and stops; nothing plays by itself."""
    with_engine(page, HEAD_ON)
    engine = page.locator(f"#s-{HEAD_ON} .player")
    engine.focus()
    page.evaluate("name => players[name].seek(0)", HEAD_ON)

    assert page.evaluate("name => players[name].playing", HEAD_ON) is False
    engine.press("ArrowRight")
    assert page.evaluate("name => players[name].time === players[name].pack.t[1]", HEAD_ON)
    engine.press("ArrowLeft")
    assert page.evaluate("name => players[name].time", HEAD_ON) == 0
    engine.press(" ")
    page.wait_for_function("name => players[name].time > 0.05", arg=HEAD_ON)
    engine.press(" ")
    assert page.evaluate("name => players[name].playing", HEAD_ON) is False


def test_the_legend_hides_an_engine_everywhere(page: Page) -> None:
    """A box that is not ticked hides disks and lines; "all" brings them back."""
    with_engine(page, HEAD_ON)
    plot = page.locator(f"#s-{HEAD_ON} .plot").first
    plot.scroll_into_view_if_needed()
    plot.locator(".main-svg .trace").first.wait_for()
    visible = "plot => plot.data.find(trace => trace.name === 'pymunk:matched').visible"
    page.locator(f"#s-{HEAD_ON} .legend input[value='pymunk:matched']").uncheck()

    assert page.evaluate("name => players[name].hidden.has('pymunk:matched')", HEAD_ON)
    assert plot.evaluate(visible) is False
    page.locator(f"#s-{HEAD_ON} .picks button").first.click()
    assert plot.evaluate(visible) is True


@pytest.mark.slow
def test_the_index_marks_the_section_that_its_link_leads_to(page: Page) -> None:
    """Short ones, too: of those the next one stands in the window as well."""
    page.locator("#picture .main-svg").first.wait_for()
    links = page.locator("#index a[href^='#']:visible")
    at_top = """hash => Math.abs(document.querySelector(hash).getBoundingClientRect().top) < 50
        && document.querySelector('#index [aria-current]')?.hash === hash"""

    assert links.count() > 10
    for link in links.all()[:-1]:  # the page ends before the last could come to the top
        for last in (False, False, True):  # a chart that is drawn meanwhile may push it away
            link.click()
            try:
                page.wait_for_function(at_top, arg=link.get_attribute("href"), timeout=5_000)
                break
            except TimeoutError:
                assert not last, link.get_attribute("href")


@pytest.mark.slow
def test_charts_follow_the_dark(page: Page) -> None:
    """Where the reader turns to dark, the lines that are drawn take the colours of the dark."""
    with_engine(page, HEAD_ON)
    plot = page.locator(f"#s-{HEAD_ON} .plot").first
    plot.scroll_into_view_if_needed()
    plot.locator(".main-svg .trace").first.wait_for()
    page.emulate_media(color_scheme="dark")

    page.wait_for_function(
        "plot => plot.data.every(t => t.line.color === Object.values(looks).find(l => l.dark ==="
        " t.line.color)?.dark)",
        arg=plot.element_handle(),
    )


def test_every_engine_has_a_panel_of_the_same_scene(page: Page) -> None:
    """Before anything is scrolled to: the exact answer in each, and the path of who played."""
    page.wait_for_function("() => document.getElementById('panels').dataset.shown")
    panels = page.locator("#panels .panel:visible")
    drawn = panels.evaluate_all(
        "all => all.map(each => [each.dataset.name, each.querySelectorAll('.track').length > 0,"
        " each.querySelectorAll('.exact').length > 0])"
    )

    failed = ["box2d_v3:shipped", "box2d_v3:matched"]
    assert drawn == [[name, True, True] for name in PLAYED] + [[n, False, True] for n in failed]


def test_the_index_finds_scenarios(page: Page) -> None:
    """What is typed leaves the scenarios with these words, by name or by question."""
    page.locator("#index input").fill("unstable line")
    found = page.locator("#index li[data-find]:visible a").all_inner_texts()
    page.locator("#index input").fill("")

    assert found == [ORBIT]


def test_text_from_files_is_inert(page: Page) -> None:
    """Hostile questions, reasons, notes and names are shown as they are and run nothing."""
    page.locator("footer").scroll_into_view_if_needed()

    assert page.evaluate("window.hacked") is None
    assert HOSTILE in page.locator(f"#s-{HEAD_ON} .asks").inner_text()
    assert HOSTILE in page.locator(f"#s-{HEAD_ON} .failures").inner_text()
    assert page.locator("main img").count() == 0


def test_the_page_says_what_its_counts_count(page: Page, comparisons: list[Comparison]) -> None:
    """Engines and cells are those of the runs, by name and profile, refused ones too."""
    lede = " ".join(page.locator(".lede").inner_text().split())
    counts = " ".join(page.locator(".lede + .small").inner_text().split())
    runs = [run for comparison in comparisons for run in comparison.runs]

    assert f"through {len({run.name for run in runs})} engines" in lede
    assert f"There are {len(runs)} cells" in counts
    assert f"counts as one engine, for example {runs[0].name}." in counts


def test_failed_and_refused_runs_are_in_sight(page: Page) -> None:
    """The map and the scenario's list both name what crashed and what was refused."""
    cells = page.locator("#map td.failed").all_inner_texts()
    listed = page.locator(f"#s-{ORBIT} .failures li").all_inner_texts()

    assert cells == ["crashed", "refused"] * 3
    assert ["crashed" in listed[0], "refused" in listed[1]] == [True, True]


@pytest.mark.slow
def test_the_page_never_scrolls_sideways(browser: Browser, path: Path) -> None:
    """All fits the width, narrow or wide, however long a word is; wide tables scroll by
    themselves."""
    page, heard = opened(
        browser, path.as_uri(), viewport={"width": 400, "height": 800}, reduced_motion="reduce"
    )
    for name in (HEAD_ON, ORBIT, ASTEROIDS):
        with_engine(page, name)
    page.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
    narrow = overhang(page)
    page.set_viewport_size({"width": 1280, "height": 800})
    wide = overhang(page)
    page.context.close()

    assert (narrow <= 0, wide <= 0) == (True, True)
    assert heard == []


def test_the_page_fits_in_eight_megabytes(path: Path) -> None:
    """Plotly is there once, deflated; what a scenario adds leaves room for forty in 8 MB."""
    html = path.read_text()
    library = html.split('id="library">')[1].split("</script>")[0]

    assert html.count(library[:1000]) == 1
    assert len(library) < 2.5e6
    assert (len(html) - len(library)) / 3 < (8e6 - 2.5e6) / 40
    assert "http://" not in html.split("<script>")[0]


def test_every_figure_is_one_that_plotly_knows(path: Path) -> None:
    """They are plain dicts, because plotly's own class would take a third of the page's time."""
    assert check_figures(path.read_text()) > 3 * len(CHARTS)


@pytest.mark.parametrize(
    "wrong",
    [
        {"data": [{"type": "scatter", "colour": "red"}]},
        {"data": [{"type": "scatter", "mode": "dots"}]},
        {"layout": {"xaxis": {"type": "logarithmic"}}},
        {"data": [{"type": "scatter", "y": [float("nan")]}]},
    ],
)
def test_a_figure_that_plotly_does_not_know_is_found(wrong: dict[str, Any]) -> None:
    """The control of `check_figures`."""
    packed = packed_charts({"wrong": Drawing("", "", wrong)})
    with pytest.raises(ValueError):  # noqa: PT011 - plotly's and json's
        check_figures(f'<script type="text/plain" id="charts:wrong">{packed}</script>')


def test_a_page_of_nothing_can_be_written(tmp_path: Path) -> None:
    """Without scenarios, probes and known answers there is still a page, with the command that
    makes it."""
    about = {
        "command": "crosscheck run nothing",
        "seed": 1,
        "machine": {},
        "versions": {},
        "started": "",
        "seconds": 0,
        "unfinished": "",
    }
    nothing = pd.DataFrame()
    write_page(
        tmp_path / "r.html",
        [],
        findings=[],
        untrusted=set(),
        conformance=nothing,
        known_answers=nothing,
        about=about,
        lessons=LESSONS,
    )

    assert "crosscheck run nothing" in (tmp_path / "r.html").read_text()


@pytest.mark.slow
def test_the_browser_of_these_tests_hears_what_a_page_asks_for(
    browser: Browser, tmp_path: Path
) -> None:
    """A page that asks for another file, for another machine, and complains: all three are heard,
    data is not."""
    path = tmp_path / "asks.html"
    own = "data:image/gif;base64,R0lGODlhAQABAAAAACwAAAAAAQABAAAC"
    images = f"<img src=other.png><img src=http://elsewhere.invalid/a.png><img src={own}>"
    path.write_text(f"<!doctype html>{images}<script>console.error('ouch')</script>")
    page, heard = opened(browser, path.as_uri())
    page.wait_for_load_state("networkidle")
    page.context.close()

    assert {"ouch", (tmp_path / "other.png").as_uri(), "http://elsewhere.invalid/a.png"} <= set(
        heard
    )
    assert not any(each.startswith("data:") for each in heard)
