"""The same scene in every engine: each panel draws what its engine played over the exact answer,
and says its error and its cost, or why there is none."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Browser, Page

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.page import overview, panels
from crosscheck2d.reports.page.cost_points import NO_CLOCK, RunTimes
from crosscheck2d.reports.page.overview import OverviewCell
from crosscheck2d.reports.page.panels import drawn_of, numbers_of
from crosscheck2d.reports.page.replay import GRID
from crosscheck2d.reports.run.timing import noise_of
from crosscheck2d.reports.run.timing_pass import COLUMNS
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.no_truth import answered
from tests.reports.page.browsing import opened, overhang
from tests.reports.page.small import ASTEROIDS, HEAD_ON, ORBIT, PLAYED, write_small

QUIET, LOUD = noise_of([0.97, 1.0, 1.02]), noise_of([0.7, 1.0, 1.3])


def simply(name: str, *engines: str) -> Comparison:
    """A scene of the catalogue at its middle step, with the truth, without a table."""
    scene, truth = answered(scenario(name))
    runs = [
        play(ENGINES[each].make(), each, scene, scene.dt(scene.middle_substeps)) for each in engines
    ]
    return Comparison(scene, truth, runs, pd.DataFrame())


@pytest.mark.parametrize(
    ("name", "axes", "title"),
    [
        ("free_fall", "path", "y (m)"),
        ("bouncing_ball_e09", "y", "height (m)"),
        ("wall_to_wall", "x", "x (m)"),
        ("rest_on_floor", "y", "height (m)"),
    ],
)
def test_what_keeps_to_a_line_is_drawn_over_time(name: str, axes: str, title: str):
    """A path in the plane else; height where nothing should move."""
    drawn = drawn_of(simply(name, "reference:exercise"))

    assert (drawn.axes, drawn.titles[1]) == (axes, title)
    assert drawn.titles[0] == ("x (m)" if axes == "path" else "time (s)")


def test_a_scene_that_every_engine_refuses_has_no_panels():
    """There is nothing to set beside its exact answer."""
    one = simply("friction_bounce_e1_mu05", "reference:exercise", "reference:lesson")
    assert one.truth is not None
    assert {run.status for run in one.runs} == {"unsupported"}
    assert panels.panels([one], ["reference:exercise", "reference:lesson"], {}, NO_CLOCK) is None


def test_of_many_disks_the_one_is_drawn_that_is_farthest_from_its_place():
    """In most engines; of a few all are drawn, but none that cannot move."""
    many = simply("asteroids", "reference:exercise", "pymunk:matched")
    [disk] = drawn_of(many).disks
    assert many.truth is not None
    off = [
        laws.deviation(run.trajectory, many.truth, many.scenario.scene).max(axis=0)
        for run in many.runs
        if run.trajectory is not None
    ]
    radius = many.scenario.scene.radius

    assert disk == int(np.argmax(np.median(off / radius, axis=0)))
    fixed = simply("disk_between_static_disks", "reference:exercise")
    assert drawn_of(fixed).disks == np.flatnonzero(~fixed.scenario.scene.static).tolist()


def test_where_nothing_was_played_but_the_start_the_axes_have_a_length():
    """Of a run that ended at once, in a scene without an exact answer; a path of no length is
    drawn over time."""
    one = simply("free_fall", "reference:exercise")
    whole = one.runs[0].trajectory
    assert whole is not None
    names = ("t", "position", "velocity", "angle", "angular_velocity")
    start = replace(whole, **{name: getattr(whole, name)[:1] for name in names})
    drawn = drawn_of(replace(one, truth=None, runs=[replace(one.runs[0], trajectory=start)]))

    assert drawn.axes == "y"
    assert drawn.until == drawn.box[2] == one.scenario.sample_interval
    assert drawn.box[3] > drawn.box[1]


def test_an_engine_that_goes_far_does_not_shrink_the_others():
    """The axes hold all of the exact answer, and half as much again for engines that go beyond."""
    one = simply("bouncing_ball_e09", "reference:exercise")
    trajectory = one.runs[0].trajectory
    assert trajectory is not None
    gone = replace(one.runs[0], trajectory=replace(trajectory, position=100 * trajectory.position))
    near, far = drawn_of(one).box, drawn_of(replace(one, runs=[gone])).box
    assert one.truth is not None
    heights = one.truth.position[:, 0, 1]

    assert far[3] == pytest.approx(heights.max() + panels.ROOM * np.ptp(heights))
    assert near[3] < far[3]
    assert far[1] <= heights.min()


@pytest.mark.parametrize(
    ("cell", "cost", "said"),
    [
        (OverviewCell("0.071", "at 1 s", 7), 12.34, ("", "", "0.071 radii", "12 µs")),
        (OverviewCell("0.071", "at 1 s", 7), np.nan, ("", "", "0.071 radii", "")),
        (OverviewCell("not judged", "3 of 100"), 12.34, ("", "", "not judged", "12 µs")),
        (
            OverviewCell("crashed", "signal 11", failed=True),
            np.nan,
            ("crashed", "signal 11", "", ""),
        ),
        (
            OverviewCell("no friction", "none modelled"),
            np.nan,
            ("no friction", "none modelled", "", ""),
        ),
    ],
)
def test_a_panel_says_error_and_cost_or_why_there_is_none(
    cell: OverviewCell, cost: float, said: tuple[str, ...]
):
    """Of a run that was not played to its end the reason alone."""
    assert numbers_of(cell, cost) == said


def made(comparisons: list[Comparison], clock: RunTimes = NO_CLOCK) -> panels.Panels:
    """The section of these scenes."""
    names = overview.names_of(comparisons)
    found = panels.panels(comparisons, names, overview.heat_map(comparisons, names), clock)
    assert found is not None
    return found


def test_costs_are_those_of_the_scene_and_only_where_times_can_be_trusted():
    """A scene that was timed stands first in the picker; on a busy machine none has costs."""
    two = [simply(name, *PLAYED[:2]) for name in ("bouncing_ball_e09", "free_fall")]
    dt = two[1].middle_dt
    row = ["free_fall", *PLAYED[0].split(":"), dt, 1.0, 5, 12.5, 12.0, 13.0, 1.0, 2.0, 0.0, np.nan]
    table = pd.DataFrame([row], columns=COLUMNS)
    costs = panels.costs_of(RunTimes(table, QUIET, 12.0))

    assert costs == {"free_fall": {(PLAYED[0], dt): 12.5}}
    assert panels.costs_of(RunTimes(table, LOUD, 12.0)) == {}
    timed = made_tables(two, RunTimes(table, QUIET, 12.0))
    assert list(timed.groups) == [panels.TIMED, "Walls, floors and fixed disks"]
    assert timed.groups[panels.TIMED] == ["free_fall"]
    assert timed.first == "free_fall"


def made_tables(comparisons: list[Comparison], clock: RunTimes) -> panels.Panels:
    """As `made`, of comparisons without a table: no error is known."""
    names = overview.names_of(comparisons)
    unknown = {
        each.scenario.name: [OverviewCell("not judged")] * len(names) for each in comparisons
    }
    found = panels.panels(comparisons, names, unknown, clock)
    assert found is not None
    return found


def test_the_section_opens_with_a_scene_that_tells_engines_apart():
    """Which has an exact answer, and which most engines play; not one in which all are where they
    should be, nor one in which all are off."""
    one = simply("free_fall", "reference:exercise")
    drawn = drawn_of(one)

    def priority(*shares: float, truth: bool = True) -> tuple[bool, int, bool, int]:
        off_by = {str(k): share for k, share in enumerate(shares)}
        scene = one if truth else replace(one, truth=None)
        return panels.priority(scene, replace(drawn, off_by=off_by), {})

    assert priority(0.0, 0.5, 0.0) > priority(0.0, 0.001, 0.0) == priority(0.5, 0.5, 0.5)
    assert priority(0.0, 0.0) > priority(0.5)
    assert priority(0.5) > priority(0.0, 0.5, truth=False)


def test_a_single_engine_and_a_run_of_nothing_have_no_panels():
    """There is nothing to set beside each other."""
    one = simply("free_fall", "reference:exercise")
    lost = replace(one, runs=[Run("pymunk", "matched", "free_fall", one.middle_dt, "error", "?")])

    assert panels.panels([one], ["reference:exercise"], {}, NO_CLOCK) is None
    assert panels.panels([replace(lost, truth=None)], list(PLAYED), {}, NO_CLOCK) is None


def test_the_engines_of_npm_are_named_where_they_could_be():
    """In the main job without the extra; not where somebody chose engines."""
    main = simply("free_fall", "reference:exercise")
    cells = {"free_fall": [OverviewCell("not judged")] * 20}
    every = [*ENGINES]

    assert panels.panels([main], every, cells, NO_CLOCK).javascript  # type: ignore[union-attr]
    for names in (every[:3], [*every, "planck:matched"]):
        assert not panels.panels([main], names, cells, NO_CLOCK).javascript  # type: ignore[union-attr]


# In Chromium.


@pytest.fixture(scope="module")
def desktop(browser: Browser, path: Path) -> Iterator[Page]:
    """The page at 1280 px."""
    page, heard = opened(browser, path.as_uri(), viewport={"width": 1280, "height": 900})
    yield page
    page.context.close()
    assert heard == []


def chosen(page: Page, name: str) -> None:
    """Choose a scene and wait until its panels are drawn."""
    page.locator("#panels select").select_option(name)
    page.wait_for_function(
        "name => document.getElementById('panels').dataset.shown === name", arg=name
    )


TRACKS = """async ([name, engine]) => {
  const scene = JSON.parse(new TextDecoder().decode(await unpack('panels:all')))[name];
  const pack = readPack(await unpack('replay:' + name));
  const [track] = tracksOf(pack, scene).get(engine);
  const { width, height, left, right, top, bottom } = FRAME;
  const [x, y] = scalesOf(scene, width - left - right, height - top - bottom);
  const panel = document.querySelector(`#panels [data-name="${engine}"]`);
  const drawn = panel.querySelector('.track').getAttribute('d');
  return { t: pack.t.slice(0, track.length), track, drawn, line: lineOf(track, x, y, false) };
}"""


def followed(page: Page, comparison: Comparison, engine: str, shown_of: str) -> bool:
    """Whether the panel of `engine` draws the first disk of what `shown_of` played."""
    name = comparison.scenario.name
    found = page.evaluate(TRACKS, [name, engine])
    run = next(each for each in comparison.middle_runs if each.name == shown_of)
    assert run.trajectory is not None
    rows = np.rint(np.array(found["t"]) / comparison.scenario.sample_interval).astype(int)
    drawn = drawn_of(comparison)
    moved = run.trajectory.position[rows][:, drawn.disks[0]]
    expected = moved[:, 0] if drawn.axes == "x" else moved[:, 1]
    # a step of the grid that positions are packed on
    grid = np.ptp(run.trajectory.position) / GRID
    return found["drawn"] == found["line"] and bool(
        np.abs(np.array(found["track"])[:, 1] - expected).max() <= grid
    )


@pytest.mark.slow  # a page of its own in Chromium
@pytest.mark.parametrize("k", [0, 1])
def test_a_panel_draws_what_its_engine_played(desktop: Page, comparisons: list[Comparison], k: int):
    """To the grid of the replay, up to the end of the exact answer; the control: it is not what
    another engine played."""
    comparison = comparisons[k]
    chosen(desktop, comparison.scenario.name)

    assert followed(desktop, comparison, "pymunk:matched", "pymunk:matched")
    assert not followed(desktop, comparison, "pymunk:matched", "box2d:shipped")


@pytest.mark.slow
def test_engines_that_did_not_play_are_shown_as_such(desktop: Page):
    """Their panels have the exact answer, no path of theirs, and the outcome with its reason; the
    others have an error."""
    chosen(desktop, HEAD_ON)
    said = {
        each.get_attribute("data-name"): (
            each.locator(".track").count(),
            each.locator(".exact").count(),
            each.locator(".outcome-of").inner_text(),
        )
        for each in desktop.locator("#panels .panel").all()
    }

    assert list(said) == [*PLAYED, "box2d_v3:shipped", "box2d_v3:matched"]
    for name in PLAYED:
        assert said[name][:2] == (2, 2)
        assert said[name][2].startswith("error: ")
        assert said[name][2].endswith(" radii")  # no scene of this page was timed
    for name, outcome in (
        ("box2d_v3:shipped", "crashed: </script>"),
        ("box2d_v3:matched", "refused: no a_name"),
    ):
        assert said[name][:2] == (0, 2)
        assert said[name][2].startswith(outcome)


@pytest.mark.slow
def test_the_error_of_a_panel_is_that_of_the_map(desktop: Page):
    """The same cell, in every scene."""
    for name in (HEAD_ON, ORBIT):
        chosen(desktop, name)
        row = desktop.locator(f"#map tr:has(a[href='#s-{name}']) td").all_inner_texts()[
            : len(PLAYED)
        ]
        errors = desktop.locator("#panels .panel:visible .outcome-of b").all_inner_texts()

        assert errors[: len(PLAYED)] == [f"{text} radii" for text in row]


@pytest.mark.slow
def test_a_link_in_a_scene_opens_its_panels(desktop: Page):
    """And the section leads back to the scene."""
    desktop.locator(f"a[data-panels={ORBIT}]").click()
    desktop.wait_for_function(
        "name => document.getElementById('panels').dataset.shown === name", arg=ORBIT
    )

    assert desktop.locator("#panels select").input_value() == ORBIT
    assert desktop.locator("#panels .more").get_attribute("href") == f"#s-{ORBIT}"
    asks = desktop.locator(f"#s-{ORBIT} .asks").inner_text()
    assert desktop.locator("#panels .asks").inner_text() == asks


@pytest.mark.slow
def test_panels_are_told_apart_without_colour(desktop: Page):
    """By the shape of their marks, filled or open."""
    chosen(desktop, HEAD_ON)
    signs = desktop.locator("#panels .sign").evaluate_all(
        "all => all.map(each => each.getAttribute('d') + each.getAttribute('class'))"
    )

    assert len(set(signs)) == len(PLAYED)


@pytest.mark.slow
def test_costs_stand_below_the_panels_of_a_scene_that_was_timed(
    browser: Browser, comparisons: list[Comparison], tmp_path: Path
):
    """In another one it is said of each engine that it was not."""
    row = [HEAD_ON, *PLAYED[0].split(":"), comparisons[0].middle_dt, 1.0, 5]
    table = pd.DataFrame([[*row, 12.5, 12.0, 13.0, 1.0, 2.0, 0.0, np.nan]], columns=COLUMNS)
    write_small(tmp_path / "r.html", comparisons, clock=RunTimes(table, QUIET, 12.0))
    page, heard = opened(browser, (tmp_path / "r.html").as_uri())
    said = {}
    for name in (HEAD_ON, ORBIT):
        chosen(page, name)
        texts = page.locator("#panels .outcome-of").all_inner_texts()[: len(PLAYED)]
        said[name] = [text.split("\n")[-1] for text in texts]
    page.context.close()

    assert said == {
        HEAD_ON: ["cost: 12 µs", "not timed", "not timed"],
        ORBIT: ["not timed"] * len(PLAYED),
    }
    assert heard == []


TOPS = """() => [...document.querySelectorAll('#panels .panel')]
  .map(each => each.getBoundingClientRect().top)"""


@pytest.mark.slow
def test_panels_fit_a_narrow_page_and_paper(browser: Browser, path: Path):
    """Two beside each other at 400 px; on paper five, drawn although they were never in view, and
    on one sheet with their heading."""
    page, heard = opened(browser, path.as_uri(), viewport={"width": 400, "height": 800})
    for name in (ASTEROIDS, ORBIT, HEAD_ON):
        chosen(page, name)
        assert overhang(page) <= 0
    narrow = page.evaluate(TOPS)
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 703, "height": 1032})
    printed = page.evaluate(TOPS)
    drawn = page.locator("#panels .panel:visible .track").count()
    breaks, height = page.locator("#panels").evaluate(
        "(all) => [getComputedStyle(all).breakInside, all.getBoundingClientRect().height]"
    )
    page.context.close()

    assert breaks == "avoid"
    assert height < 1032
    assert narrow[0] == narrow[1] < narrow[2]
    assert (len(printed), len(set(printed)), drawn) == (5, 1, 2 * len(PLAYED))
    assert heard == []


def test_what_is_packed_is_small(comparisons: list[Comparison]):
    """The paths are those of the replays: a scene adds a kilobyte at most."""
    assert len(made(comparisons).packed) < 1000 * len(comparisons)
    assert json.dumps(HEAD_ON) not in made(comparisons).packed
