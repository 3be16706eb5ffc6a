"""The engines of npm packages in the stability report. Where the packages are not fetched, the
tests are skipped."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.adapters.npm_packages import missing
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import (
    DRIVEN_ENGINES,
    QUICK,
    LimitSearch,
    taking_part,
)
from crosscheck2d.reports.stability.results import StabilityPlan, Task
from tests.reports.stability.kept_limits import FILE_OF_FETCHED, Kept, agrees, kept
from tests.reports.terminal.command_line import crosscheck

LACKING = [reason for row in FETCHED.values() if (reason := missing(row.package))]
pytestmark = pytest.mark.skipif(bool(LACKING), reason="; ".join(dict.fromkeys(LACKING)))
SHIPPED = [name for name in FETCHED if name.endswith(":shipped")]


def test_planck_is_driven_to_its_threshold():
    works = {}
    names = ("planck:shipped", "planck:matched")
    with taking_part({name: FETCHED[name] for name in names}):
        for name in names:
            search = LimitSearch(CASES["slow_collision"], name, QUICK)
            works[name] = [search.trial(speed, 1).works for speed in (2.0, 0.5)]

    assert works == {"planck:shipped": [True, False], "planck:matched": [True, True]}
    assert not {*names} & {*ENGINES, *DRIVEN_ENGINES}


def test_a_report_of_a_package_names_its_version_and_no_file():
    with taking_part({"planck:shipped": FETCHED["planck:shipped"]}):
        added = {"planck:shipped": FETCHED["planck:shipped"]}
        plan = StabilityPlan(["spin"], [*added], "quick", added=added)
        alone = StabilityPlan(["spin"], ["pymunk:matched"], "quick")

        assert set(plan.versions) - set(alone.versions) == {"planck"}


FAST = ("tunnelling_head_on", "slow_collision", "far_from_origin")


def marks_of(row: Kept) -> list[pytest.MarkDecorator]:
    """Rapier alone takes two minutes, planck:shipped ten seconds a case."""
    in_the_gate = row.case == "slow_collision" and row.engine in (
        "planck:matched",
        "matter:matched",
    )
    return [] if in_the_gate else [pytest.mark.long]


@pytest.mark.slow
@pytest.mark.parametrize(
    "row",
    [pytest.param(row, marks=marks_of(row)) for row in kept(FILE_OF_FETCHED) if row.case in FAST],
    ids=lambda row: f"{row.case}-{row.engine}",
)
def test_the_quick_form_finds_the_kept_limit_of_the_full_one(row: Kept):
    with taking_part({row.engine: FETCHED[row.engine]}):
        found = LimitSearch(CASES[row.case], row.engine, QUICK).limit()

    assert agrees(found, row), (found.works_at, found.fails_at)


@pytest.mark.slow
def test_what_cuts_a_spin_is_its_limit():
    names = ("planck:shipped", "planck:matched", "rapier2d:shipped", "rapier2d:matched")
    added = {name: FETCHED[name] for name in names}
    limits = {name: Task("spin", name, "quick").run(added) for name in names}
    bracket = 1.05  # that of the quick form
    for name, cut in (("planck:shipped", pi / 2), ("rapier2d:shipped", pi / 4)):
        limit = limits[name]
        assert limit.works_at / bracket <= cut / 0.98 <= limit.fails_at * bracket
    assert limits["planck:matched"].verdict == "does not fail"
    assert limits["rapier2d:matched"].failing.broken == "refused"


@pytest.mark.slow
@pytest.mark.parametrize(
    "names", [["planck:shipped"], pytest.param(SHIPPED, marks=pytest.mark.long)], ids=["one", "all"]
)
def test_the_command_drives_all_of_them_to_their_limits(names: list[str], tmp_path: Path):
    words = [word for name in names for word in ("--engine", name)]
    asked = ("spin", "slow_collision", "dt_and_speed", "touching_break")
    done = crosscheck("stability", *asked, *words, "--out", "limits", cwd=tmp_path)
    assert done.returncode == 0, done.stderr

    limits = pd.read_csv(tmp_path / "limits" / "limits.csv")
    assert set(limits.engine + ":" + limits.profile) == {*names}
    failed = limits[limits.verdict != "does not fail"]
    assert len(failed) >= len(names)
    assert failed.reason.notna().all()
    spins = failed[(failed.case == "spin") & failed.engine.isin(["planck", "rapier2d"])]
    assert spins.reason.str.startswith("rotation is limited to").all()
    assert set(pd.read_csv(tmp_path / "limits" / "maps.csv").engine) == {*names}
    assert set(pd.read_csv(tmp_path / "limits" / "laws.csv").engine) == {*names}
