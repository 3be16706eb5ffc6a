"""The game in a real browser: keys steer, a flight is won, ghosts part, what is saved is what was
flown."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.commands.serve import application
from crosscheck2d.reports.game.flight import FRAME, SHIP
from crosscheck2d.reports.game.server import Game
from crosscheck2d.scenarios.files.scene_file import read_scene_file
from crosscheck2d.scenarios.truth.closed_forms import world_thrusts
from tests.reports.game.test_flight import flown, steered_home
from tests.reports.page.browsing import opened, overhang, served

FLOWN = ["reference:exercise", "pymunk:shipped", "box2d:matched", "event_driven:float64"]


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with served(application(Game(FLOWN))) as url:
        yield url


@contextmanager
def paused(browser: Browser, url: str, width: int = 1280, height: int = 900) -> Iterator[Page]:
    """The game, paused at its first frame; whatever it complained of fails the test."""
    page, heard = opened(
        browser, url, viewport={"width": width, "height": height}, reduced_motion="reduce"
    )
    page.wait_for_function("() => game.field")
    yield page
    page.context.close()
    assert heard == []


@pytest.fixture
def page(browser: Browser, url: str) -> Iterator[Page]:
    with paused(browser, url) as page:
        yield page


@pytest.fixture(scope="module")
def first_frame(browser: Browser, url: str) -> Iterator[Page]:
    with paused(browser, url) as page:
        yield page


def wish(page: Page, **fields: object) -> None:
    for name, value in fields.items():
        before = page.evaluate("game.field && (game.field.seen = true)")
        page.locator(f"#wishes [name={name}]").fill(str(value))
        page.locator(f"#wishes [name={name}]").blur()
        page.wait_for_function("() => !game.field.seen")
        assert before


def fly(page: Page, frames: int) -> None:
    """So many frames on, by the game's own requests, whatever the clock does."""
    page.evaluate(
        """async (frames) => {
          const until = game.now.frame + frames;
          while (game.now.frame < until) {
            game.ask(Math.min(4, until - game.now.frame));
            while (game.waiting) await new Promise((done) => setTimeout(done));
          }
        }""",
        frames,
    )


def saved(page: Page, folder: Path) -> Path:
    with page.expect_download() as download:
        page.locator("#save").click()
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


@pytest.mark.slow
def test_keys_held_and_released_steer_as_the_flight_does(page: Page):
    wish(page, asteroids=0)
    for key, frames in (("w", 64), ("ArrowLeft", 32)):
        page.keyboard.down(key)
        fly(page, frames)
        page.keyboard.up(key)
    fly(page, 32)
    events = [(0, "w", True), (64, "w", False), (64, "a", True), (96, "a", False)]
    ship = flown(FLOWN[:1], 128, events, asteroids=0).solid.state

    assert page.evaluate("game.now.ship") == [
        *ship.position[SHIP],
        *ship.velocity[SHIP],
        ship.angle[SHIP],
        ship.angular_velocity[SHIP],
    ]
    assert ship.velocity[SHIP, 0] == pytest.approx(0.25 * 64 * FRAME, abs=1e-14)


@pytest.mark.long
def test_a_scripted_flight_wins(page: Page):
    wish(page, asteroids=0)
    for frame, key, down in steered_home():
        fly(page, frame - page.evaluate("game.now.frame"))
        (page.keyboard.down if down else page.keyboard.up)(key)

    assert page.locator("#banner.won").inner_text() == "You won"


def test_every_number_of_the_table_has_four_digits(first_frame: Page):
    values = [9.8765432109, 12345.678901, 0.0123456, 0.99999, 4.2e-5, 3.1e-16, 7654321.0, 0]
    shown = [first_frame.evaluate("(value) => figure(value)", value) for value in values]
    vectors = [
        first_frame.evaluate("(pair) => vector(pair)", pair)
        for pair in ([1.23456, -0.00012], [-250.55, 3.21], [0.0, 0.0])
    ]
    energies = first_frame.locator("[data-cell=energy]").all_inner_texts()

    assert shown == [
        "9.877",
        "12350",
        "0.01235",
        "1.000",
        "4.200×10⁻⁵",
        "3×10⁻¹⁶",
        "7.654×10⁶",
        "0",
    ]
    assert vectors == ["1.235, 0.000", "-250.6, 3.2", "0, 0"]
    assert all(len(re.sub(r"\D", "", text)) <= 5 for text in energies if text)


def test_the_last_collision_before_a_divergence_is_named(first_frame: Page):
    story = "(diverged) => game.story({ diverged }, 'pymunk:shipped')"
    last = {"t": 2.351, "only": FLOWN[0], "solid": FLOWN[0]}
    said = [
        first_frame.evaluate(story, last | pair)
        for pair in ({"disks": [3, SHIP]}, {"disks": [SHIP, -3]}, {"disks": [2, 5], "only": ""})
    ]
    said.append(first_frame.evaluate(story, last | {"disks": [SHIP]}))
    said.append(first_frame.evaluate(story, last | {"disks": [2, 5], "solid": "pymunk:shipped"}))

    assert said == [
        "2.35 s: ship and disk 3 collide in reference:exercise only",
        "2.35 s: ship and wall 2 collide in reference:exercise only",
        "2.35 s: disk 2 and disk 5 collide in both",
        "2.35 s: ship gets another velocity without a collision",
        "2.35 s: disk 2 and disk 5 collide in reference:exercise only, beside pymunk:shipped",
    ]


@pytest.mark.slow
def test_ghosts_part_after_the_first_collision_and_the_marker_names_the_pair(
    page: Page, tmp_path: Path
):
    # pymunk as shipped makes e2 of e: it diverges at the first collision, whose pair and instant
    # the exact answer reports.
    fly(page, 16)
    together = [flyer["deviation"] for flyer in page.evaluate("game.now.flyers")]
    page.locator("#stop").check()
    page.locator("#pause").click()  # fly on, until it stops by itself
    page.wait_for_function("() => game.paused && game.now.frame > 16", timeout=20_000)
    scenario = read_scene_file(saved(page, tmp_path))
    collisions = scenario.truth(scenario.times).collisions  # type: ignore[misc]
    diverged = page.evaluate("game.now.flyers[1].diverged")
    story = page.locator("tr[data-engine='pymunk:shipped'] [data-cell=diverged]").inner_text()
    marks = page.evaluate("game.sky.last[3]")

    # The exercise sets what leaves onto the edge, and loses what it flew on beyond.
    assert max(together) < 0.71 * FRAME / 16
    assert set(diverged["disks"]) == {collisions.i[0], collisions.j[0]}
    assert 0 <= diverged["t"] - collisions.t[0] <= 2 * FRAME
    pair = "disk {} and disk {}".format(*diverged["disks"]).replace(f"disk {SHIP} ", "ship ")
    assert story == f"{diverged['t']:.2f} s: {pair} collide in both"
    assert marks[0]["name"] == "pymunk:shipped"
    assert page.evaluate("game.now.flyers[1].deviation") > 1e-3


@pytest.mark.slow
def test_a_flight_by_the_clock_is_saved_as_it_was_flown(page: Page, tmp_path: Path):
    wish(page, asteroids=0)
    page.locator("#pause").click()
    page.wait_for_function("() => game.now.frame > 5")
    page.keyboard.down("w")
    page.keyboard.down("d")
    page.wait_for_function("() => game.now.frame > 40")
    page.keyboard.up("d")
    page.keyboard.up("w")
    page.wait_for_function("() => game.now.frame > 60")
    page.keyboard.press("p")
    page.wait_for_function("() => !game.waiting")
    shown, solid = page.evaluate("game.now.ship"), FLOWN[0]
    scenario = read_scene_file(saved(page, tmp_path))
    end = play(
        ENGINES[solid].make(), solid, scenario, scenario.dt(scenario.substeps[1])
    ).trajectory.at(-1)  # type: ignore[union-attr]
    exact = world_thrusts(scenario.scene, scenario.thrusts, scenario.times).at(-1)

    assert len(scenario.thrusts) >= 2
    assert shown == [
        *end.position[SHIP],
        *end.velocity[SHIP],
        end.angle[SHIP],
        end.angular_velocity[SHIP],
    ]
    assert (
        np.abs(exact.position[SHIP] - end.position[SHIP]).max()
        < 0.25 * FRAME / 16 * scenario.duration
    )


@pytest.mark.long
def test_a_saved_flight_is_shown_again_to_the_same_bits(
    browser: Browser, page: Page, tmp_path: Path
):
    page.keyboard.down("w")
    fly(page, 50)
    page.keyboard.up("w")
    fly(page, 30)
    first = page.evaluate("game.now.flyers.map((flyer) => [flyer.x, flyer.energy])")
    scenario = read_scene_file(saved(page, tmp_path))
    with served(application(Game(FLOWN, scenario))) as url:
        again, heard = opened(browser, url)
        again.wait_for_function("() => game.field")
        again.keyboard.down("s")
        again.wait_for_function("() => game.now.over", timeout=20_000)
        last = again.evaluate("game.now.flyers.map((flyer) => [flyer.x, flyer.energy])")
        banner = again.locator("#banner").inner_text()
        again.context.close()

    assert last == first
    assert banner == "The flight ends here"
    assert heard == []


@pytest.mark.slow
def test_any_scene_file_can_be_flown(browser: Browser):
    scenario = read_scene_file(
        Path(__file__).parents[3] / "tests" / "data" / "scenes" / "bumper.toml"
    )
    with served(application(Game(["reference:exercise", "event_driven:float64"], scenario))) as url:
        page, heard = opened(browser, url)
        page.wait_for_function("() => game.now && game.now.over", timeout=30_000)
        left, t = page.evaluate("[game.now.flyers.map((flyer) => flyer.left), game.now.t]")
        page.context.close()

    assert left == ["", ""]
    assert t == pytest.approx(scenario.duration)
    assert heard == []


@pytest.mark.slow
def test_a_finger_steers_too(page: Page):
    wish(page, asteroids=0)
    box = page.locator("[data-key=w]").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 5, box["y"] + 5)
    page.mouse.down()
    fly(page, 20)
    page.mouse.up()
    fly(page, 10)

    assert page.evaluate("game.now.ship[2]") == pytest.approx(0.25 * 20 * FRAME, abs=1e-14)


@pytest.mark.slow
def test_a_lost_connection_is_reported_and_mended(page: Page):
    fly(page, 3)
    page.evaluate("game.socket.close(); game.field.seen = true")
    page.wait_for_function(
        "() => document.getElementById('banner').textContent.includes('Trying again')"
    )
    page.wait_for_function("() => !game.field.seen && game.now.frame === 0", timeout=10_000)


@pytest.mark.slow
def test_another_engine_can_be_solid(page: Page):
    page.locator("[name=solid][value='pymunk:shipped']").check()
    page.wait_for_function("() => game.field.engines[0] === 'pymunk:shipped'")
    page.locator("[name=flies][value='box2d:matched']").uncheck()
    page.wait_for_function("() => game.field.engines.length === 3")

    assert page.evaluate("game.field.engines") == [
        "pymunk:shipped",
        "reference:exercise",
        "event_driven:float64",
    ]


def test_the_page_fits_and_is_reached_by_keyboard(browser: Browser, url: str):
    page, heard = opened(browser, url, viewport={"width": 400, "height": 800}, color_scheme="dark")
    page.wait_for_function("() => game.field && game.now.frame > 10", timeout=20_000)
    too_wide = overhang(page)
    cut = page.evaluate(
        "(({ scrollWidth: a, clientWidth: b }) => a - b)(document.querySelector('.scroll'))"
    )
    names = page.locator(".who").evaluate_all(
        "all => all.map((each) =>"
        " each.offsetHeight < 2 * parseFloat(getComputedStyle(each).fontSize))"
    )
    headed = page.locator("tr.solid td[data-cell=collisions]").evaluate(
        "(cell) => getComputedStyle(cell, '::before').content"
    )
    page.set_viewport_size({"width": 1280, "height": 800})
    too_wide = max(too_wide, overhang(page))
    reached = []
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.append(
            page.evaluate("document.activeElement.id || document.activeElement.name || ''")
        )
    outlined = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    page.context.close()

    assert (too_wide <= 0, cut <= 0, headed) == (True, True, '"Collisions"')
    assert all(names)
    assert {
        "sky",
        "pause",
        "step",
        "again",
        "save",
        "flies",
        "solid",
        "asteroids",
        "restitution",
        "seed",
    } <= set(reached)
    assert outlined != "none"
    assert heard == []


def test_the_table_is_on_the_first_screen(first_frame: Page):
    bottom = first_frame.evaluate(
        "document.querySelector('.engines').getBoundingClientRect().bottom"
    )

    assert first_frame.locator("tr[data-engine]").count() == sum(
        not row.adds_friction for row in ENGINES.values()
    )
    assert bottom <= 900


BOXES = """() => {
  const pen = game.sky.canvas.getContext("2d"), { left, bottom, right, top } = game.sky.view;
  const names = game.field.engines.slice(0, 3);
  return [[-3.5, 0.3], [left, top], [right, bottom], [right, 0]].map(([x, y]) => {
    const taken = [game.sky.drawName(pen, game.sky.last[0][0])];
    for (const name of names) {
      taken.push(game.sky.drawLabel(pen, { x, y, name, text: `${name} 1 × 2` }, taken));
    }
    return taken;
  });
}"""
RADII = """() => {
  const arcs = [], name = game.field.engines[0], arc = CanvasRenderingContext2D.prototype.arc;
  CanvasRenderingContext2D.prototype.arc = (x, y, r) => arcs.push(r);
  const pen = game.sky.canvas.getContext("2d"), one = { x: 0, y: 0, name };
  game.sky.drawRing(pen, one, []);
  game.sky.drawRing(pen, one, [one]);
  game.sky.drawRing(pen, { x: 2, y: 0, name }, [one, one]);
  CanvasRenderingContext2D.prototype.arc = arc;
  return arcs;
}"""


def test_labels_of_rings_at_one_place_do_not_lie_on_each_other(first_frame: Page):
    width, height, _ = first_frame.evaluate("game.sky.size")
    first, second, elsewhere = first_frame.evaluate(RADII)

    for taken in first_frame.evaluate(BOXES):
        for k, (left, top, right, bottom) in enumerate(taken):
            assert min(left, top, width - right, height - bottom) > -1
            for other in taken[:k]:
                beside = right <= other[0] or other[2] <= left
                assert beside or bottom <= other[1] or other[3] <= top
    assert first < second
    assert elsewhere == first


def test_with_reduced_motion_nothing_moves_by_itself(first_frame: Page):
    first_frame.wait_for_timeout(200)

    assert first_frame.evaluate("[game.now.frame, game.paused]") == [0, True]
    assert "starts the flight" in first_frame.locator("#banner").inner_text()


@pytest.mark.long
def test_the_frame_time_is_measured_by_a_command():
    words = [sys.executable, "-m", "tests.bench.game", "1"]
    done = subprocess.run(
        words, cwd=Path(__file__).parents[3], capture_output=True, text=True, timeout=120
    )
    lines = done.stdout.splitlines()
    numbers = [
        [float(number) for number in re.findall(r"\d+\.\d\d", line[:50])] for line in lines[2:6]
    ]

    assert done.returncode == 0, done.stderr
    assert lines[0].startswith("4 engines, 21 disks")
    assert all(0 < mean <= most and part <= most for mean, part, most in numbers)
    assert float(lines[-1].split()[0]) > 1.0


@pytest.mark.slow
def test_the_page_tells_its_frame_time(page: Page):
    fly(page, 30)

    assert re.search(
        r"\d+ frames a second.* engines take \d+\.\d ms", page.locator("#pace").inner_text()
    )


@pytest.mark.slow
def test_a_page_of_an_earlier_server_is_loaded_anew(browser: Browser):
    game = Game(["reference:exercise", "pymunk:shipped"])
    with served(application(game)) as url:
        page, heard = opened(browser, url, reduced_motion="reduce")
        page.wait_for_function("() => game.field")
        game.engines, game.mark = ["reference:exercise", "box2d:shipped"], "later"
        page.evaluate("game.socket.close()")
        page.wait_for_function(
            "() => document.body.dataset.server === 'later' && window.game?.field", timeout=10_000
        )
        flown, ticked = page.evaluate(
            "[game.field.engines, game.rows.filter((row) => !row.matches('.off')).length]"
        )
        page.context.close()

    assert (flown, ticked, heard) == (["reference:exercise", "box2d:shipped"], 2, [])
