"""Takes the README's picture from a page: uv run python .ci/picture.py reports/out/latest/report.html"""

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

PICTURE = Path(__file__).parent.parent / "reports" / "page.png"
QUIET = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]


def main(page: Path) -> None:
    """The map of position errors, without the index beside it."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=QUIET)
        tab = browser.new_page(viewport={"width": 1320, "height": 1400}, device_scale_factor=1.5)
        tab.goto(page.resolve().as_uri())
        box = tab.locator("#map").bounding_box()
        assert box is not None
        pad = 14  # pixels, so that nothing touches the edge
        clip = {"x": box["x"] - pad, "y": box["y"], "width": box["width"] + 2 * pad, "height": box["height"] + pad}
        tab.screenshot(path=PICTURE, clip=clip, full_page=True)
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
