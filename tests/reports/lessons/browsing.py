"""A lesson's page in Chromium."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Browser, Page

from tests.reports.page.browsing import opened


def opened_lesson(browser: Browser, url: str, **context: Any) -> tuple[Page, list[str]]:
    """The page at `url` as soon as its curves are drawn, and what it said on the console or asked
    of other machines."""
    page, heard = opened(browser, url, **context)
    wait_until_drawn(page)
    return page, heard


def wait_until_drawn(page: Page) -> None:
    """Until its curves are there."""
    page.wait_for_function("() => window.lesson && document.querySelector('.curve')")
