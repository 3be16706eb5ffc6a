"""The limits of the pinned versions stay where they are: a new version that fails earlier, or later, shows up here."""

from __future__ import annotations

from dataclasses import replace

import pytest

from reports.stability.cases import CASES
from reports.stability.limits import NEVER_FAILS, QUICK, Limit, Search, players_of
from reports.stability.players import PLAYERS
from tests.stability_limits import SUITE, Kept, kept, reaches

KEPT = kept()
FAST = ("slow_hit", "scale_up", "scale_down", "far_from_origin", "spin", "near_miss", "restitution")
CHANGED = (
    "a change of an engine or of a case: look at it, then keep the new limits: python -m tests.stability_limits OUT"
)


def harsher(case: str) -> int:
    """1 if larger values are harsher, -1 if smaller ones are."""
    return 1 if CASES[case].values[-1] > CASES[case].values[0] else -1


def assert_where_it_was(row: Kept, found: Limit) -> None:
    """The same verdict, and brackets that meet: strict both ways."""
    assert found.verdict == row.verdict, CHANGED
    (works, fails), (works_now, fails_now) = (reaches(one, harsher(row.case)) for one in (row, found))
    assert max(works, works_now) <= min(fails, fails_now), f"{found.works_at}, {found.fails_at}: {CHANGED}"


@pytest.mark.parametrize("row", [row for row in KEPT if row.case in FAST], ids=lambda row: f"{row.case}-{row.player}")
def test_a_limit_is_where_it_was(row: Kept):
    """Found again in the quick form."""
    assert_where_it_was(row, Search(CASES[row.case], row.player, QUICK).limit())


@pytest.mark.slow
@pytest.mark.parametrize(
    "row", [row for row in KEPT if row.case not in FAST], ids=lambda row: f"{row.case}-{row.player}"
)
def test_every_other_limit_is_where_it_was(row: Kept):
    """Found again in the quick form."""
    assert_where_it_was(row, Search(CASES[row.case], row.player, QUICK).limit())


def test_every_case_and_player_is_kept():
    """None is left out, but the suite's own scenes."""
    asked = {
        (name, player) for name, case in CASES.items() if not name.startswith(SUITE) for player in players_of(case)
    }

    assert {(row.case, row.player) for row in KEPT} == asked
    assert {row.player for row in KEPT} == set(PLAYERS)


def test_every_limit_has_a_reason_and_an_untested_one_is_called_likely():
    """A limit without a sentence on why would be a number to wonder at."""
    for row in KEPT:
        if row.verdict == NEVER_FAILS:
            assert row.reason == ""
        else:
            assert row.reason
            assert row.reason.startswith("likely: ") == (row.tested == ""), row


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_an_engine_that_fails_earlier_or_later_is_noticed(factor: float):
    """The negative control: a limit moved by a quarter either way, and one that is gone."""
    row = next(row for row in KEPT if (row.case, row.player) == ("slow_hit", "box2d:shipped"))
    now = Search(CASES[row.case], row.player, QUICK).limit()
    assert_where_it_was(row, now)

    with pytest.raises(AssertionError):
        assert_where_it_was(row, replace(now, works_at=now.works_at * factor, fails_at=now.fails_at * factor))
    with pytest.raises(AssertionError):
        assert_where_it_was(row, Search(CASES[row.case], "box2d:matched", QUICK).limit())
