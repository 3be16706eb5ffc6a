"""A page of sections, of every kind of part, in Chromium."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from playwright.sync_api import Browser, Page

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.reports.page import kit, style
from crosscheck2d.reports.page.drawing import Line, draw_lines, new_figure, svg_of
from crosscheck2d.reports.page.replay import pack_layers, played, ratio_of
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.page.browsing import opened, overhang

HOSTILE = "</script><script>window.hacked = 1</script><img src=x onerror='window.hacked = 2'>"
NAMES = ("pymunk:shipped", "reference:exercise")


def some_chart() -> kit.Chart:
    figure, axes = new_figure()
    lines = [Line(name, [10.0, 100.0], [1.0, 0.1], name, filled=0) for name in NAMES]
    draw_lines(axes, lines, "time", "error", x_unit="µs")
    return kit.Chart(svg_of(figure, HOSTILE), HOSTILE, "A sentence.")


def some_replay() -> kit.Playback:
    scene = scenario("oblique_e09")
    dt = scene.dt(scene.middle_substeps)
    runs = [play(ENGINES[name].make(), name, scene, dt) for name in NAMES]
    layers = played(compare(scene, runs))
    facts = {"key": "oblique", "panels": True, "words": {NAMES[0]: HOSTILE}}
    return kit.Playback(pack_layers(scene, layers, more=facts), ratio_of(scene, layers))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cell = kit.TableCell(
        0.5, HOSTILE, css="best", side="3 µs", notes=(kit.TableCell("sinks", link="#a_b"),)
    )
    frame = pd.DataFrame({"x": [cell, 2.0], "y": [HOSTILE, None]}, ["a b", "b"], dtype=object)
    opens = {"a b": [some_replay(), kit.Text([HOSTILE], ["item"])]}
    sections = [
        kit.Section("Table", HOSTILE, [kit.Table(frame, ["G", "G"], opens=opens, sortable=True)]),
        kit.Section("Chart", "", [some_chart()], css="pair"),
        kit.Section("Fold", "folded", [kit.Code("a = 1 < 2"), some_replay()], True, "fold"),
    ]
    page = kit.Page("A page", sections, "test", [HOSTILE], [*NAMES, style.TRUTH])
    path = tmp_path_factory.mktemp("kit") / "page.html"
    path.write_text(kit.render_page(page), encoding="utf-8")
    return path


def test_a_row_opens_by_click_by_key_and_by_address(browser: Browser, path: Path):
    page, heard = opened(browser, path.as_uri())
    row = page.locator("tr.opened")
    button = page.get_by_role("button", name="a b")
    button.click()
    row.locator("canvas").first.wait_for()
    assert row.locator("canvas").count() == len(NAMES)
    assert "First visible difference: pymunk:shipped" in row.inner_text()
    button.press("Enter")
    assert row.count() == 0
    page.get_by_role("link", name="sinks").press("Enter")
    row.locator("canvas").first.wait_for()
    row.locator(".chips input").first.uncheck()
    assert row.locator("canvas").count() == len(NAMES) - 1
    page.context.close()
    page, more = opened(browser, path.as_uri() + "#fold")
    page.locator("details[open] canvas").first.wait_for()
    hacked = page.evaluate("window.hacked ?? 0")
    page.context.close()

    assert (heard, more, hacked) == ([], [], 0)


def drawn_colour(page: Page) -> str:
    return page.locator("figure.chart path[style*='fill: none']").last.evaluate(
        "path => getComputedStyle(path).stroke"
    )


def test_colours_of_a_chart_follow_the_page_and_its_text_stays_text(browser: Browser, path: Path):
    page, _ = opened(browser, path.as_uri(), color_scheme="light")
    light = drawn_colour(page)
    page.emulate_media(color_scheme="dark")
    dark = drawn_colour(page)
    labels = page.locator("figure.chart svg text").all_text_contents()
    page.context.close()

    assert light != dark
    assert {*NAMES, "time", "error"} <= {*labels}


def test_nothing_runs_over_at_400_px_nor_on_paper(browser: Browser, path: Path):
    page, _ = opened(browser, path.as_uri(), viewport={"width": 400, "height": 800})
    narrow = overhang(page)
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 700, "height": 990})
    paper = overhang(page)
    page.context.close()

    assert (narrow, paper) == (0, 0)


def test_a_cell_covers_columns_and_a_row_is_a_group_once():
    frame = pd.DataFrame([[kit.TableCell("all", span=2), "", 3]], ["a"], dtype=object)
    [(group, label, cells)] = kit.Table(frame, ["G"]).rows

    assert group is not None
    assert (group.text, label.text, [cell.text for cell in cells]) == ("G", "a", ["all", "3"])
