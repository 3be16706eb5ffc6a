"""Takes the README's pictures.

uv run python .ci/picture.py game | lesson | PAGE.html PICTURE.png
"""

import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page

sys.path.insert(0, str(Path(__file__).parent.parent))  # the tests are not installed

from crosscheck2d.reports.commands.serve import application
from crosscheck2d.reports.game.command import FIRST
from crosscheck2d.reports.game.server import Game
from tests.reports.page.browsing import chromium, served

REPORTS = Path(__file__).parent.parent / "reports"
PAD = 14  # pixels, so that nothing touches the edge
STEER = """async ([key, down, frames]) => {
  game.key(key, down);
  const until = game.now.frame + frames;
  while (game.now.frame < until) {
    game.ask(1);
    while (game.waiting) await new Promise((done) => setTimeout(done));
  }
}"""
FLIGHT = [
    ("a", True, 8),
    ("a", False, 1),
    ("d", True, 8),
    ("d", False, 1),
    ("w", True, 150),
    ("a", True, 30),
]


def game(browser: Browser, url: str) -> None:
    """The field after some seconds of a flight that is the same every time."""
    tab = browser.new_page(viewport={"width": 980, "height": 900}, reduced_motion="reduce")
    tab.goto(url)
    tab.wait_for_function("() => game.field")
    for keys in FLIGHT:
        tab.evaluate(STEER, list(keys))
    tab.evaluate("game.say('')")
    tab.add_style_tag(content="#banner,.touch,.wishes,#pace{display:none!important}")
    tab.wait_for_timeout(500)
    clip(tab, "game/game.png", ".cockpit", ".engines")


def lesson(browser: Browser, url: str) -> None:
    """The ball that bounces ever higher, with the mechanism enabled."""
    tab = browser.new_page(viewport={"width": 980, "height": 900})
    tab.goto(f"{url}/lesson/gravity")
    tab.wait_for_function("() => window.lesson")
    tab.locator(".sliders [name=order]").select_option("2")
    tab.evaluate("lesson.ready")
    tab.add_style_tag(
        content=".stage-lesson .player{display:none!important}:focus{outline:none!important}"
    )
    clip(tab, "lessons/lesson.png", "h1", ".facts-table")


def clip(tab: Page, name: str, first: str, last: str) -> None:
    """From the top of one element to the foot of another, as wide as the first."""
    top, foot = (tab.locator(each).first.bounding_box() for each in (first, last))
    assert top is not None
    assert foot is not None
    box = {"x": top["x"] - PAD, "y": top["y"] - PAD, "width": top["width"] + 2 * PAD}
    box["height"] = foot["y"] + foot["height"] - box["y"] + PAD
    tab.screenshot(path=REPORTS / name, clip=box, full_page=True)


def first_screen(browser: Browser, page: str, picture: str) -> None:
    """The first screen of a page, in 128 colours."""
    tab = browser.new_page(viewport={"width": 1280, "height": 700})
    tab.goto(Path(page).resolve().as_uri())
    tab.wait_for_timeout(1000)
    tab.screenshot(path=picture)
    Image.open(picture).convert("RGB").quantize(128).save(picture, optimize=True)


def main(what: str, picture: str = "") -> None:
    """One picture."""
    if picture:
        with chromium() as browser:
            first_screen(browser, what, picture)
        return
    with chromium() as browser, served(application(Game(FIRST))) as url:
        {"game": game, "lesson": lesson}[what](browser, url)


if __name__ == "__main__":
    main(*sys.argv[1:])
