"""What all tests share: forked workers, one browser, how many examples a property is tried with;
and what the independent checks have to say."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Generator, Iterator

import pytest
from hypothesis import settings
from numba.core.dispatcher import Dispatcher
from playwright.sync_api import Browser

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.run import pool, timing_pass
from tests.forks import LOCKS, compiling_alone, start_worker
from tests.reports.page.browsing import chromium

# Images of containers forbid Python to keep what it has compiled. Each process of the tests would
# then compile all libraries again, which takes three quarters of the time of its start.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# How many examples a property is tried with, unless it says so itself: `few` each time, `many` by
# `--hypothesis-profile many`. No deadline: the first example may load a compiled kernel.
settings.register_profile("few", max_examples=25, deadline=None)
settings.register_profile("many", max_examples=200, deadline=None)
settings.load_profile("few")


# Eight thousand tests are collected, and live to the end. Looking for garbage among them takes half
# the time of collecting them, and in each process that is forked a copy of all they hold.
gc.disable()

START_PROCESS = pool.start_process
COLLECTED = pytest.StashKey[list[pytest.Item]]()


@pytest.hookimpl(wrapper=True)
def pytest_xdist_auto_num_workers() -> Generator[None, int, int]:
    """Two a core: a third of the time of the tests is waiting, for Chromium or
    for another process."""
    return (yield) * 2


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    config.stash[COLLECTED] = [*items]


def pytest_collection_finish() -> None:
    """From now on garbage is looked for, but not among the tests."""
    gc.enable()
    gc.freeze()


def pytest_sessionfinish() -> None:
    """Libraries that count what is left behind find nothing at the end."""
    gc.unfreeze()


@pytest.fixture(scope="session")
def collected(pytestconfig: pytest.Config) -> list[pytest.Item]:
    return pytestconfig.stash[COLLECTED]


@pytest.fixture(autouse=True, scope="session")
def compiled_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        locks = tmp_path_factory.getbasetemp().parent  # common to all processes
        patch.setenv(LOCKS, str(locks))
        patch.setattr(Dispatcher, "compile", compiling_alone(locks))
        yield


@pytest.fixture(autouse=True, scope="session")
def forked_workers() -> Iterator[None]:
    """A run that is played in the process of the tests forks its workers: each start anew would
    take seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pool, "start_process", start_worker)
        patch.setattr(timing_pass, "ROUNDS", 1)  # of many runs no test looks at the times
        yield


@pytest.fixture(autouse=True)
def same_engines() -> Iterator[None]:
    """A test that adds an engine to the table, by `crosscheck play --engine FILE` say, leaves the
    table to the next one as it was."""
    before = dict(ENGINES)
    yield
    if before != ENGINES:
        ENGINES.clear()
        ENGINES.update(before)


@pytest.fixture
def fresh_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool, "start_process", START_PROCESS)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Debian's Chromium, started once, each test with a context of its own; where it is missing the
    tests are skipped, in CI they fail."""
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
