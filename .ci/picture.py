"""Takes the README's pictures: the chart of a page, the game, a lesson.

uv run python .ci/picture.py reports/out/speed/speed.html | game | lesson
"""

import sys
from pathlib import Path

from playwright.sync_api import Browser, Page

sys.path.insert(0, str(Path(__file__).parent.parent))  # the tests are not installed

from crosscheck2d.reports.commands.serve import application
from crosscheck2d.reports.game.command import FIRST
from crosscheck2d.reports.game.server import Game
from tests.reports.page.browsing import chromium, served

LEGEND = """() => Plotly.relayout(document.querySelector('#pooled .plot'), {
  showlegend: true, legend: { x: 1.02, y: 1, itemwidth: 40 },
  'margin.r': 230, 'font.size': 13, autosize: true })"""
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


def pooled_chart(browser: Browser, page: str) -> None:
    """The pooled chart of error against cost, as wide as a README, with its legend in it."""
    tab = browser.new_page(viewport={"width": 980, "height": 1400}, device_scale_factor=2)
    tab.goto(Path(page).resolve().as_uri())
    tab.add_style_tag(
        content="#index,fieldset.legend,#pooled figcaption,.saves{display:none!important}"
    )
    tab.add_style_tag(content=".stage{grid-template-columns:1fr!important}")
    tab.locator("#pooled .chart .main-svg").first.wait_for()
    tab.evaluate(LEGEND)
    clip(tab, "speed/speed.png", "#pooled .plot", "#pooled .plot")


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


def main(what: str) -> None:
    """One picture."""
    with chromium() as browser:
        if what in ("game", "lesson"):
            with served(application(Game(FIRST))) as url:
                {"game": game, "lesson": lesson}[what](browser, url)
        else:
            pooled_chart(browser, what)


if __name__ == "__main__":
    main(sys.argv[1])
