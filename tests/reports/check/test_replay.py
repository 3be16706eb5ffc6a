"""The replay of a smallest scene: slow enough to be watched, and it says where a sphere has gone;
and the rows below it on paper."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser

from crosscheck2d.reports.check.page import WATCHED, speed_of, write_page
from crosscheck2d.reports.check.smallest import Smallest, scenario_of
from crosscheck2d.reports.check.verdict import FileCheck
from crosscheck2d.scenarios.model import Array, Trajectory
from tests.reports.check.marked import marks_of
from tests.reports.check.test_outputs import faults_in
from tests.reports.page.browsing import opened

# what the picture writes at a time, but for its scale bar
WRITTEN = """t => {
  const texts = [], write = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = (text) => texts.push(text);
  players[1].seek(t);
  CanvasRenderingContext2D.prototype.fillText = write;
  return texts.filter((text) => text.includes("away"));
}"""


@cache
def smallest() -> Smallest:
    """A head-on pair; `yours` stays where it is."""
    scenario = scenario_of([(-1, 0, 1, 0, 1, 1), (1, 0, 0, 0, 1, 2)], (0, 0, 0), 0.9, 0.02)
    assert scenario is not None
    count = len(scenario.times)
    still = motion(scenario.times, np.repeat(scenario.scene.position[np.newaxis], count, axis=0))
    moved = still.position + np.array([0.5, 0.0]) * scenario.times[:, np.newaxis, np.newaxis]
    return Smallest(scenario, "sphere 0 rests", still, motion(scenario.times, moved))


def motion(t: Array, position: Array) -> Trajectory:
    """Spheres at these places that do not turn."""
    zero = np.zeros(position.shape[:2])
    return Trajectory(t, position, np.zeros_like(position), zero, zero)


@pytest.mark.parametrize(("duration", "speed"), [(0.3, 0.1), (1.0, 0.25), (2.0, 0.5), (9.0, 1)])
def test_a_short_scene_is_played_slowly(duration: float, speed: float):
    """So that it lasts long enough, where the slowest speed suffices; never faster than it is."""
    assert speed_of(duration) == speed
    assert duration / speed >= min(WATCHED, duration / 0.1)


def test_where_a_sphere_has_gone_is_said(browser: Browser, tmp_path: Path):
    """At the edge of the picture, by an arrow and its distance, as long as it is outside; the page
    begins at the speed of its scene; on paper it stands at its end, and a heading stays with its
    table."""
    one = smallest()
    position = one.yours.position.copy()
    position[-1, 0] += [40.0, 0.0]
    gone = replace(one, yours=replace(one.yours, position=position))
    page_path = tmp_path / "page.html"
    (marked,) = marks_of(FileCheck(tmp_path / "a.js", faults_in("2c")))
    write_page(page_path, replace(marked, scenes=[gone]))
    page, heard = opened(browser, page_path.as_uri(), viewport={"width": 1280, "height": 800})
    page.wait_for_function("() => window.players[1]")
    [early, late] = [page.evaluate(WRITTEN, t) for t in (0.0, one.scenario.duration)]
    speed, chosen = page.evaluate("[players[1].speed, document.querySelector('.speed').value]")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    printed = page.evaluate("players[1].time")
    page.emulate_media(media="print")
    breaks = page.evaluate(
        "['h2', '.says'].map((each) => getComputedStyle(document.querySelector(each)).breakAfter)"
    )
    page.context.close()

    assert heard == []
    assert early == []
    assert len(late) == 1
    assert 35 < float(late[0].split()[0]) < 40
    assert speed == float(chosen) == speed_of(one.scenario.duration)
    assert breaks == ["avoid"] * 2
    assert printed == one.scenario.duration
