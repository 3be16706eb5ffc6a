"""The page that its tests look at, made once."""

from __future__ import annotations

from pathlib import Path

import pytest

from crosscheck2d.reports.compare.comparison import Comparison
from tests.reports.page.small import ASTEROIDS, HEAD_ON, HOSTILE, LONG, ORBIT, played, write_small


@pytest.fixture(scope="package")
def comparisons() -> list[Comparison]:
    """A scene with a truth, one whose truth ends early, one without a truth that wraps and
    turns."""
    return [
        played(HEAD_ON, asks=f"Is this inert? {HOSTILE} {LONG}", source=HOSTILE),
        played(ORBIT),
        played(ASTEROIDS, truth=None, without_truth=HOSTILE),
    ]


@pytest.fixture(scope="package")
def path(comparisons: list[Comparison], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("out") / "latest" / "report.html"
    path.parent.mkdir()
    write_small(path, comparisons)
    return path
