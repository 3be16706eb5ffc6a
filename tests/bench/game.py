"""How smoothly the game flies engines and 21 disks in Chromium: `uv run python -m tests.bench.game
[SECONDS [ENGINE|FILE ...]]`."""

from __future__ import annotations

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence

import numpy as np
from playwright.sync_api import Browser

from crosscheck2d.reports.commands.serve import application
from crosscheck2d.reports.game.command import game_of
from crosscheck2d.reports.game.flight import FRAME
from tests.reports.page.browsing import chromium, opened, served

# What the page itself does, timed: a picture every animation frame, an answer for every question.
LISTEN = """() => {
  window.heard = { drawn: [], drawing: [], engines: [], answer: [] };
  const { draw, arrive } = Game.prototype;
  game.draw = (now) => {
    const began = performance.now();
    draw.call(game, now);
    heard.drawn.push(now);
    heard.drawing.push(performance.now() - began);
  };
  game.arrive = (frame) => {
    heard.answer.push(performance.now() - game.asked);
    heard.engines.push(frame.ms);
    arrive.call(game, frame);
  };
}"""
MEANINGS = {
    "between two pictures": "60 a second are 16.7 ms",
    "to draw a picture": "of these",
    "engines, for a frame": f"must stay below {1e3 * FRAME:.1f} ms, which a frame lasts",
    "from asking to hearing": "engines, server and browser, for one frame or some",
}


def measure(
    browser: Browser, seconds: float, engines: Sequence[str]
) -> tuple[dict[str, np.ndarray], float, list[str]]:
    game = game_of(None, engines)
    with served(application(game)) as url:
        page, heard = opened(browser, url, viewport={"width": 1280, "height": 900})
        # compiled by then
        page.wait_for_function("() => game.field && game.now.frame > 64", timeout=120_000)
        page.keyboard.down("w")
        page.evaluate(LISTEN)
        before = page.evaluate("[game.now.t, performance.now()]")
        page.wait_for_timeout(1e3 * seconds)
        after = page.evaluate("[game.now.t, performance.now()]")
        found = {name: np.array(values) for name, values in page.evaluate("heard").items()}
        page.context.close()
    assert heard == [], heard
    rows = np.diff(found["drawn"]), found["drawing"], found["engines"], found["answer"]
    pace = 1e3 * (after[0] - before[0]) / (after[1] - before[1])
    return dict(zip(MEANINGS, rows)), pace, list(game.engines)


def main(seconds: float, engines: Sequence[str]) -> None:
    with chromium() as browser:
        rows, pace, flown = measure(browser, seconds, engines)
    print(f"{len(flown)} engines, 21 disks, {seconds:g} s: {', '.join(flown)}")
    print(f"{'ms':24}{'mean':>8}{'95 %':>8}{'most':>8}")
    for name, ms in rows.items():
        print(
            f"{name:24}{ms.mean():8.2f}{np.quantile(ms, 0.95):8.2f}{ms.max():8.2f} "
            f" {MEANINGS[name]}"
        )
    rate = 1e3 / rows["between two pictures"].mean()
    print(f"{rate:.1f} pictures a second; the flight goes at {pace:.1%} of the clock's pace")


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("seconds", nargs="?", type=float, default=20.0, metavar="SECONDS")
    parser.add_argument("engine", nargs="*", metavar="ENGINE|FILE")
    asked = parser.parse_args()
    main(asked.seconds, asked.engine)
