"""Takes the README's picture from a page: uv run python .ci/picture.py reports/out/speed/speed.html"""

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

PICTURE = Path(__file__).parent.parent / "reports" / "speed.png"
QUIET = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]


def main(page: Path) -> None:
    """The pooled chart of error against cost with its legend, without the index beside it."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=QUIET)
        tab = browser.new_page(viewport={"width": 1320, "height": 1400}, device_scale_factor=1.5)
        tab.goto(page.resolve().as_uri())
        chart = tab.locator("#pooled .chart").first
        chart.locator(".main-svg").first.wait_for()
        legend, plot = tab.locator("#pooled .legend").bounding_box(), chart.bounding_box()
        assert legend is not None
        assert plot is not None
        pad = 14  # pixels, so that nothing touches the edge
        left, top, right = legend["x"], min(legend["y"], plot["y"]), plot["x"] + plot["width"]
        height = plot["y"] + plot["height"] - top
        clip = {"x": left - pad, "y": top - pad, "width": right - left + 2 * pad, "height": height + pad}
        tab.screenshot(path=PICTURE, clip=clip, full_page=True)
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
