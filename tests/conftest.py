"""What the tests of all pages share: one browser a file; and what the independent checks have to
say."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from reports.run import worker
from tests.forks import FRESH, Forked
from tests.reports.page.browsing import chromium


@pytest.fixture(autouse=True, scope="session")
def forked_workers() -> Iterator[None]:
    """A run that is played in the process of the tests forks its workers: each start anew would
    take seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker, "start", Forked)
        yield


@pytest.fixture
def fresh_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """For what is said of the workers themselves: each an interpreter of its own, as users have
    it."""
    monkeypatch.setattr(worker, "start", FRESH)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Debian's Chromium; where it is missing the tests are skipped, in CI they fail."""
    with chromium() as browser:
        yield browser


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """A line for everything that a test records as `found`: what an independent check compared, and
    how well it met."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for name, value in report.user_properties:
                if name == "found":
                    terminalreporter.write_line(str(value))
