"""A Chromium that reaches nothing but this machine, and a server in a thread for it; for the tests
of served pages."""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest
import uvicorn
from playwright.sync_api import Browser, Page, sync_playwright
from starlette.applications import Starlette

from crosscheck2d.reports.page.server import HOST, config_of, taken_socket

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


@contextmanager
def chromium() -> Iterator[Browser]:
    """Debian's Chromium; where it is missing the tests are skipped, in CI they fail."""
    program = shutil.which("chromium")
    if program is None:
        if os.environ.get("CI") == "true":
            pytest.fail("chromium is not installed: apt-get install chromium")
        pytest.skip("chromium is not installed")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def served(app: Starlette) -> Iterator[str]:
    listening = taken_socket(0)
    server = uvicorn.Server(config_of(app))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
    thread.start()
    try:
        yield f"http://{HOST}:{listening.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


def opened(browser: Browser, url: str, **context: Any) -> tuple[Page, list[str]]:
    """The page at `url`, and what it said on the console or asked of other machines; a file may ask
    for nothing."""
    page = browser.new_context(**context).new_page()
    heard: list[str] = []
    page.route(
        lambda each: not belongs(each, url),
        lambda route: (heard.append(route.request.url), route.abort())[1],
    )
    page.on("console", lambda message: heard.append(message.text))
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.goto(url)
    return page, heard


def belongs(asked: str, url: str) -> bool:
    host = urlsplit(url).hostname
    if host is None:
        return asked.startswith(("data:", "blob:")) or asked.split("#")[0] == url.split("#")[0]
    return urlsplit(asked).hostname == host


def overhang(page: Page) -> int:
    return page.evaluate(
        "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    )
