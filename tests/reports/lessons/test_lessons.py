"""The pages of the lessons: each has a scene that runs and sliders that change its curves, and
every number is of a run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.ablated import AblatedReference
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.commands.serve import application
from crosscheck2d.reports.game.server import Game
from crosscheck2d.reports.lessons import pages
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.conventions import ZERO, table
from crosscheck2d.reports.lessons.lesson import Lesson, run_of
from crosscheck2d.reports.lessons.mechanisms.ablation import ABLATED
from crosscheck2d.reports.lessons.mechanisms.javascript_bounces import VERSIONS
from crosscheck2d.reports.lessons.mechanisms.row import GAP, struck
from crosscheck2d.reports.lessons.meeting import collision_of_the_reference, two
from crosscheck2d.reports.page.style import TRUTH
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.no_truth import answered
from crosscheck2d.scenarios.truth.exact import with_oracle
from tests.reports.lessons.browsing import opened_lesson, wait_until_drawn
from tests.reports.page.browsing import opened, overhang, served

BROWSED, COSTLY = ("order",), ("box", "crowd", "horizon", "limits")
EVERY = [pytest.param(name, marks=() if name in BROWSED else pytest.mark.long) for name in LESSONS]
SLOW = [pytest.param(name, marks=pytest.mark.long if name in COSTLY else ()) for name in LESSONS]


@pytest.mark.parametrize(
    "name",
    [
        "free_fall",
        "bouncing_ball_e1",
        pytest.param("oblique_e09", marks=pytest.mark.slow),
    ],
)
def test_with_nothing_enabled_the_mechanisms_give_the_reference(name: str):
    """To the bit."""
    scene = scenario(name)
    plain = run_of("reference:exercise", scene, 2).trajectory
    ablated = play(AblatedReference(), ABLATED, scene, scene.dt(2)).trajectory

    assert plain is not None
    assert ablated is not None
    assert np.array_equal(plain.position, ablated.position)
    assert np.array_equal(plain.velocity, ablated.velocity)


@pytest.mark.parametrize("name", SLOW)
def test_every_lesson_has_a_scene_that_runs_and_the_exact_answer_beside_it(name: str):
    """Drawn in the replay and, where a chart can show it, in a chart; all who are drawn can be in
    the legend."""
    lesson = LESSONS[name]
    shown = lesson.at(lesson.start)
    drawn = {curve.name for chart in shown.charts for curve in chart.curves}

    assert shown.film is not None
    assert any(run.trajectory is not None for run in shown.film.runs)
    # its disks overlap from the start, or differ in e and no law mixes the two
    assert (shown.film.truth is None) == (name in ("correction", "mixing"))
    # nor has a cost in time, and an error is the distance from it
    assert (TRUTH in drawn) == (name not in ("correction", "mixing", "crowd", "float32"))
    assert drawn | {run.name for run in shown.film.runs} <= set(lesson.names)


def test_the_exact_answer_to_a_row_is_that_of_pair_by_pair():
    """Equal disks, e = 1, collision at one end: all orders of the collisions give everything to the
    last disk."""
    curves = {
        curve.name: np.asarray(curve.y) for curve in LESSONS["row"].at((0, 3, 2)).charts[0].curves
    }

    assert curves[TRUTH].tolist() == [0, 0, 0, 0, 0, 5]
    assert np.abs(curves["reference:exercise"] - curves[TRUTH]).max() <= 1e-12
    assert np.abs(curves["box2d:matched+no_ccd"] - curves[TRUTH]).max() > 1.0


@pytest.mark.parametrize(
    ("n", "change"), [(3, {"restitution": 0.9}), (5, {"mass": np.array([1.0, 2, 1, 3, 1, 2])})]
)
def test_a_row_whose_outcome_depends_on_the_order_has_no_exact_answer(
    n: int, change: dict[str, Any]
):
    """With other masses, or e below 1, it ends when the row is struck; with gaps it goes on."""
    ends = []
    for gap in (0.0, GAP):
        row = struck(n, gap)
        _, truth = answered(with_oracle(replace(row, scene=replace(row.scene, **change))))
        assert truth is not None
        ends.append((truth.horizon, truth.reason))

    (touching, reason), (apart, _) = ends
    assert touching == pytest.approx(1.01 / 5)  # m, from the row, over m/s
    assert "the outcome depends on the order of their collisions" in reason
    assert apart == np.inf


def test_the_numbers_of_a_collision_are_those_of_the_solver():
    """The impulse that lesson 4 writes out is the one the solver reports, and momentum is kept."""
    scene = two(0.9, 10.0, 1.0).scene
    before, after, reported = collision_of_the_reference(scene, 1 / 64)
    steps = LESSONS["meeting"].at((2, 2, 2, 1)).steps
    kick = scene.mass[0] * np.hypot(*(after.velocity[0] - before.velocity[0]))

    assert reported == pytest.approx(kick, rel=1e-14)
    assert f"the solver reports {reported:.3g} N s" in steps["Impulse"]
    assert f"= {reported:.3g} N s; the solver" in steps["Impulse"]
    assert "separation over approach speed: 0.9" in steps["Update"]


@pytest.mark.slow
def test_conventions_are_measured():
    """An engine that is made otherwise is found otherwise: nothing in the table is typed in."""
    rows = {
        row.asked: row.got
        for row in table({name: ENGINES[name] for name in ("pymunk:shipped", "box2d:shipped")})
    }
    slow = rows["What is e of a pair that closes at 0.1 m/s, where 0.5 is stated?"]
    swapped = {row.asked: row.got for row in table({"pymunk:shipped": ENGINES["pymunk:matched"]})}

    assert slow["pymunk:shipped"] == ("0.25", "departs")
    assert slow["box2d:shipped"][1] == "departs"
    unstated = rows["What coefficient of friction acts between two disks, where none is stated?"]
    assert unstated["box2d:shipped"] == ("0.2", "departs")
    assert (
        swapped["What is e of a pair that closes at 0.1 m/s, where 0.5 is stated?"][
            "pymunk:shipped"
        ][1]
        == "keeps"
    )


def test_rounding_is_not_shown_as_a_number():
    """e of box2d:shipped at 0.1 m/s reads 9e-15: no bounce. What is small and no rounding stays."""
    names = ("reference:exercise", "reference:ordered", "box2d:shipped")
    rows = {row.asked: row.got for row in table({name: ENGINES[name] for name in names})}
    slow = rows["What is e of a pair that closes at 0.1 m/s, where 0.5 is stated?"]
    fall = rows["How far is a thrown disk from the parabola after 1 s? (m)"]
    flight = rows["How fast is a free disk of 3.9 mm/s after 2 s? (m/s)"]

    assert slow["box2d:shipped"] == (ZERO, "departs")
    assert fall["reference:ordered"] == (ZERO, "keeps")
    assert fall["reference:exercise"][0] == "−0.0192"
    assert flight["reference:exercise"][0] == "0.00391"
    assert not [got for row in rows.values() for got, _ in row.values() if "×10" in got]


def test_the_conventions_of_friction_say_who_does_not_model_it():
    """The column of what is stated has the number nevertheless; Box2D 3.1 gives half at e = 1."""
    names = ("reference:exercise", "reference:coulomb", "box2d_v3:matched")
    rows = {row.asked: row for row in table({name: ENGINES[name] for name in names})}
    row = rows["What friction acts in a bounce with e = 1, where 0.2 is stated?"]

    assert row.expected == "0.2"
    assert row.got["reference:exercise"] == ("not modelled", "keeps")
    assert row.got["reference:coulomb"] == ("0.2", "keeps")
    half, verdict = row.got["box2d_v3:matched"]
    assert verdict == "departs"
    assert 0.08 < float(half) < 0.101


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """Where the lessons are served."""
    with served(application(Game(["reference:exercise"]))) as url:
        yield f"{url}/lesson"


@pytest.mark.parametrize("name", EVERY)
def test_every_slider_changes_the_curves(browser: Browser, url: str, name: str):
    """Moved by keyboard; no complaint, nothing wider than the window at 400 and 1280 px, nothing
    moves by itself."""
    lesson: Lesson = LESSONS[name]
    page, heard = opened_lesson(
        browser, f"{url}/{name}", viewport={"width": 400, "height": 800}, reduced_motion="reduce"
    )
    drawn = "[...document.querySelectorAll('.curve, .curves .axis')]"
    curves = f"{drawn}.map((each) => each.getAttribute('d') ?? each.textContent).join()"
    for slider in lesson.sliders:
        before = page.evaluate(curves)
        page.locator(f".sliders [name={slider.key}]").focus()
        page.keyboard.press("End" if slider.start < len(slider.values) - 1 else "Home")
        page.evaluate("lesson.ready")
        assert page.evaluate(curves) != before, slider.key
        chosen = "output, option:checked"
        shown = page.locator(f".sliders label:has([name={slider.key}])").locator(chosen)
        own = slider.shown[-1 if slider.start < len(slider.values) - 1 else 0]
        said = page.evaluate("lesson.shown.said").get(slider.key, own)
        assert shown.text_content() == said
    legend = page.locator(".names li:visible").evaluate_all(
        "all => all.map((item) => item.dataset.name)"
    )
    drawn_now = page.evaluate("lesson.shown.drawn")
    narrow = overhang(page)
    page.set_viewport_size({"width": 1280, "height": 900})
    wide = overhang(page)
    playing = page.evaluate("lesson.player ? lesson.player.playing : false")
    page.context.close()

    assert sorted(legend) == sorted(drawn_now)  # who is drawn, and nobody else
    assert (narrow <= 0, wide <= 0, playing, heard) == (True, True, False, [])


@pytest.mark.slow
def test_names_are_chosen_from_a_list_and_numbers_by_a_slider(browser: Browser, url: str):
    """A list says its choice itself, nothing beside it says it again; it goes with the arrow keys,
    prints as it is, and a page that is loaded again starts where its curves do."""
    page, heard = opened_lesson(
        browser, f"{url}/javascript", viewport={"width": 1280, "height": 900}
    )
    off = page.get_by_label("Disabled")
    off.focus()
    page.keyboard.press("ArrowDown")
    page.evaluate("lesson.ready")
    at = page.evaluate("lesson.at")
    beside = page.locator(".sliders label:has(select) output").count()
    options = off.locator("option").all_inner_texts()
    page.emulate_media(media="print")
    prints = off.is_visible()
    page.emulate_media(media="screen")
    page.reload()
    wait_until_drawn(page)
    again = page.evaluate("lesson.at")
    page.context.close()

    kinds = {slider.key: slider.of_names for slider in LESSONS["javascript"].sliders}
    assert kinds == {"e": False, "off": True}
    assert (at, again) == ("1,1", "1,0")
    assert options == list(VERSIONS)
    assert (beside, prints) == (0, True)
    assert heard == []


@pytest.mark.slow
def test_curves_that_coincide_can_be_told_apart(browser: Browser, url: str):
    """Each has its marks at places of its own, and the one that is pointed at, in the legend or in
    the chart, comes to the top; the others fade until it is left."""
    page, heard = opened_lesson(browser, f"{url}/order", viewport={"width": 1280, "height": 1800})
    marks = page.locator(".of").evaluate_all(
        "all => all.map((each) => [...each.querySelectorAll('.mark')]"
        ".map((mark) => mark.getAttribute('transform').split(',')[0]))"
    )
    top = "document.querySelector('.curves svg').lastElementChild.dataset.name"
    before = page.evaluate(top)
    page.locator(".names [data-name='reference:exercise'] button").hover()
    pointed = page.evaluate(top)
    faded = page.locator(".raised .of:not(.top)").count()
    page.mouse.move(0, 0)
    after = page.evaluate(top)
    still = page.locator(".raised").count()
    middle = page.evaluate(
        "(() => { const line = document.querySelector('.of[data-name=\"pymunk:matched\"] .near');"
        " const p = line.getPointAtLength(line.getTotalLength() / 2);"
        " const q = p.matrixTransform(line.getScreenCTM()); return [q.x, q.y]; })()"
    )
    page.mouse.move(*middle)
    in_chart = page.locator(".of.top").evaluate_all("all => all.map((each) => each.dataset.name)")
    page.context.close()

    places = [place for each in marks for place in each]
    assert len(set(places)) == len(places) > 12
    assert (before, pointed, after) == (TRUTH, "reference:exercise", TRUTH)
    assert (faded, still) == (3, 0)
    assert in_chart == ["pymunk:matched"]
    assert heard == []


@pytest.mark.slow
def test_the_list_of_lessons_fits_and_leads_to_each(
    browser: Browser, url: str, monkeypatch: pytest.MonkeyPatch
):
    """With the table of conventions below it, which says when and with what it was measured."""
    monkeypatch.setattr(
        pages, "ENGINES", {name: ENGINES[name] for name in ("pymunk:shipped", "pymunk:matched")}
    )
    page, heard = opened(browser, url, viewport={"width": 400, "height": 800})
    links = page.locator(".shelf a").evaluate_all("all => all.map((a) => a.getAttribute('href'))")
    waits = page.locator("#measured").inner_text()
    page.locator("#measured table").wait_for()
    text = page.locator("#conventions").inner_text()
    wide = overhang(page)
    page.context.close()

    assert links == [f"/lesson/{name}" for name in LESSONS]
    assert waits.startswith("Measuring") or "pymunk" in waits
    assert "pymunk 7.3.1" in text
    assert " UTC" in text
    assert (wide <= 0, heard) == (True, [])


@pytest.mark.parametrize(
    ("path", "status", "said"),
    [
        ("/nothing", 404, "there are particle"),
        ("/order/shown?at=0", 400, "1 places for 2 sliders"),
        ("/order/shown?at=0,99", 400, "must be from 0 to 2"),
        ("/order/shown?at=x,y", 400, "invalid literal"),
        ("/nothing/shown?at=0", 400, "no such lesson"),
    ],
)
def test_what_cannot_be_shown_is_reported(url: str, path: str, status: int, said: str):
    """A status and a sentence, no traceback."""
    with pytest.raises(HTTPError) as refusal:
        urlopen(url + path, timeout=10)

    assert refusal.value.code == status
    assert said in refusal.value.read().decode()


@pytest.mark.slow
def test_a_slider_that_is_dragged_asks_for_where_it_stops(browser: Browser, url: str):
    """Not for every place it passes: a lesson that takes a second would answer half a minute
    later."""
    page, heard = opened_lesson(browser, f"{url}/row", viewport={"width": 1280, "height": 900})
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.evaluate("""for (let k = 0; k < 12; k++) {
          lesson.sliders[1].value = k % 3;
          lesson.sliders[1].dispatchEvent(new Event("input"));
        }""")
    page.evaluate("lesson.ready")
    at = page.evaluate("lesson.at")
    page.context.close()

    assert len(asked) == 2  # the first place, and the last
    assert asked[-1].endswith(f"?at={at}")
    assert heard == []


@pytest.mark.slow
def test_what_departs_is_seen_to_depart():
    """As many digits as it takes: 20 beside a stated 20 would be no departure."""
    rows = table({"box2d_v3:shipped": ENGINES["box2d_v3:shipped"]})

    departing = [(row.expected, *row.got["box2d_v3:shipped"]) for row in rows]
    assert [verdict for _, _, verdict in departing].count("departs") > 3
    assert all(expected != got for expected, got, verdict in departing if verdict == "departs")


@pytest.mark.slow
def test_lesson_7_counts_all_collisions_up_to_the_end_of_the_exact_answer():
    """The event-driven engine stops there and the others go on: within that time it has as many as
    the exact answer, and those of the others are near."""
    shown = LESSONS["horizon"].at(LESSONS["horizon"].start)
    counts = {
        what.removeprefix("collisions of ").removesuffix(" until then"): int(n)
        for what, n in shown.facts
        if what.startswith("collisions")
    }
    exact = counts["the exact answer"]
    assert shown.film is not None
    whole = {run.name: len(run.trajectory.collisions) for run in shown.film.runs if run.trajectory}

    assert counts["event_driven:float64"] == exact > 10
    assert all(exact / 2 < count < 2 * exact for count in counts.values())
    assert whole["reference:exercise"] > counts["reference:exercise"]


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1280, 720), (1024, 768), (400, 800)])
def test_sliders_and_a_chart_fit_the_window_together(
    browser: Browser, url: str, size: tuple[int, int]
):
    """Whatever is scrolled to: the sliders stay at the top. Lesson 9.1 has most of both."""
    width, height = size
    page, heard = opened_lesson(
        browser,
        f"{url}/friction",
        viewport={"width": width, "height": height},
        reduced_motion="reduce",
    )
    seen = []
    for chart in range(3):
        page.evaluate(
            "k => { const chart = document.querySelectorAll('.curves svg')[k];"
            " const sliders = document.querySelector('.sliders');"
            " scrollBy(0, chart.getBoundingClientRect().top - sliders.offsetHeight - 5); }",
            chart,
        )
        top, foot, end = page.evaluate(
            "k => { const box = (each) => each.getBoundingClientRect();"
            " const chart = box(document.querySelectorAll('.curves svg')[k]);"
            " return [box(document.querySelector('.sliders')).top, chart.bottom, innerHeight]; }",
            chart,
        )
        seen.append(top >= 0 and foot <= end)
    page.context.close()

    assert (seen, heard) == ([True] * 3, [])


@pytest.mark.slow
def test_what_is_of_another_setting_is_grey_and_a_long_wait_is_explained(
    browser: Browser, url: str
):
    """Sentences and numbers, too; once the answer is there, nothing is grey and nothing waits."""
    page, heard = opened_lesson(browser, f"{url}/order", viewport={"width": 1280, "height": 900})
    page.evaluate("""() => {
      const asked = window.fetch;
      const told = new Promise((go) => { window.answer = go; });
      window.fetch = (...about) => told.then(() => asked(...about));
    }""")
    opacity = (
        "['.stage-lesson', '.claims', '.facts-table'].map((each) =>"
        " getComputedStyle(document.querySelector(each)).opacity < 1)"
    )
    page.locator(".sliders [name=order]").focus()
    page.keyboard.press("End")
    page.wait_for_function("() => document.querySelector('.waiting').textContent")
    waits = page.locator(".waiting").inner_text()
    grey = page.evaluate(opacity)
    page.evaluate("window.answer()")
    page.evaluate("lesson.ready")
    after = page.locator(".waiting").text_content()
    clear = page.evaluate(opacity)
    page.context.close()

    assert "can take a minute" in waits
    assert (grey, clear, after, heard) == ([True] * 3, [False] * 3, "", [])


@pytest.mark.slow
def test_the_replay_is_on_paper_and_says_whom_it_leaves_out(browser: Browser, url: str):
    """The picture at the time at which it stands, without its buttons."""
    page, heard = opened_lesson(
        browser, f"{url}/javascript", viewport={"width": 1280, "height": 900}
    )
    page.evaluate("lesson.ready")
    said = page.locator(".replayed").inner_text()
    page.emulate_media(media="print")
    box = page.locator(".picture canvas").bounding_box()
    clock, button = page.locator(".clock").is_visible(), page.locator(".play").is_visible()
    page.context.close()

    assert said.strip() == "The replay shows reference:exercise and exact answer only."
    assert box is not None
    assert min(box["width"], box["height"]) > 50
    assert (clock, button, heard) == (True, False, [])
