"""The JavaScript engines are driven to their limits as the others are."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from adapters.npm_packages import version_of
from tests.adapters.test_javascript import fetched
from tests.reports.terminal.command_line import crosscheck


@fetched
@pytest.mark.slow
def test_a_javascript_engine_fails_where_its_thresholds_say(tmp_path: Path):
    """planck loses the bounce of a collision slower than its threshold, 1 m/s, as Box2D 2.3 does,
    whose code it repeats in float64; with the threshold lifted it does not, and Rapier has none."""
    names = ("planck", "rapier2d:shipped", "box2d:shipped")
    words = [
        "stability",
        "slow_collision",
        *(word for name in names for word in ("--engine", name)),
    ]
    ended = crosscheck(*words, "--out", "out", cwd=tmp_path)
    table = pd.read_csv(tmp_path / "out" / "limits.csv")
    limits = {f"{row.engine}:{row.profile}": row for row in table.itertuples()}
    machine = json.loads((tmp_path / "out" / "machine.json").read_text())

    assert ended.returncode == 0
    assert limits["planck:shipped"].fails_at == limits["box2d:shipped"].fails_at
    assert 0.9 < limits["planck:shipped"].fails_at <= 1.0
    for name in ("planck:matched", "rapier2d:shipped"):
        assert limits[name].verdict == "does not fail"
    assert machine["versions"]["planck"] == version_of("planck")
