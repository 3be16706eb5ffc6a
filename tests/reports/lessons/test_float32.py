"""The recorded numbers of lesson 6.10 are those that planck and Box2D give, and what is said of
them elsewhere follows from them."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.box2d import Box2DEngine
from crosscheck2d.adapters.npm_packages import missing, version_of
from crosscheck2d.reports.lessons.mechanisms.float32 import claim_of_all, shares_of
from crosscheck2d.reports.lessons.mechanisms.planck import (
    BOX2D,
    KEPT,
    LADDER,
    PROFILES,
    SCENES,
    known,
    largest_deviation,
    measured,
    played,
    whole,
)
from crosscheck2d.reports.lessons.mechanisms.recorded import made_with, table_in
from crosscheck2d.scenarios.catalogue import SCENARIOS
from tests.test_readme import TEXTS

QUICK = [*(("free_fall", profile, 64) for profile in PROFILES), ("galperin_3", "matched", 4)]
EVERY = list(
    zip(*(table_in(KEPT)[column].tolist() for column in ("scenario", "profile", "substeps")))
)
fetched = pytest.mark.skipif(bool(missing("planck")), reason=missing("planck"))
ROWS = table_in(KEPT).set_index(["scenario", "profile", "substeps"])


def differing(fresh: dict[str, float | str | int], columns: tuple[str, ...]) -> list[str]:
    """The numbers that are not those that are kept."""
    row = ROWS.loc[(fresh["scenario"], fresh["profile"], fresh["substeps"])]
    # Six digits are kept, the last of them rounded; 1e-9 radii is how exact the exact answers are.
    return [
        each for each in columns if not np.isclose(fresh[each], row[each], rtol=6e-6, atol=1e-9)
    ]


ROWS_OF_SUITES = (
    QUICK,
    pytest.param(EVERY, marks=pytest.mark.long),
)


def box2d_alone(name: str, profile: str, substeps: int) -> dict[str, float | str | int]:
    """Its part of a row, for which no npm package is needed."""
    error = largest_deviation(whole(played(BOX2D, profile, name, substeps)), known(name)[1], name)
    return {"scenario": name, "profile": profile, "substeps": substeps, "box2d_radii": error}


@pytest.mark.parametrize("rows", ROWS_OF_SUITES, ids=["some", "all"])
def test_box2d_gives_what_is_recorded_beside_planck(rows: list[tuple[str, str, int]]):
    """With the pinned version; else the command of planck.py writes the table anew."""
    wrong = [row for row in rows if differing(box2d_alone(*row), ("box2d_radii",))]
    assert wrong == []


@fetched
@pytest.mark.parametrize("rows", ROWS_OF_SUITES, ids=["some", "all"])
def test_planck_gives_what_is_recorded(rows: list[tuple[str, str, int]]):
    """Its error, and its distance from Box2D."""
    wrong = [row for row in rows if differing(measured(*row), ("planck_radii", "deviation_radii"))]
    assert wrong == []


def test_a_number_that_is_not_recorded_is_noticed():
    """The control: Box2D as shipped is not Box2D as matched, nor is a thousandth more."""
    row = box2d_alone("free_fall", "matched", 64)
    assert differing(row, ("box2d_radii",)) == []
    assert differing(row | {"profile": "shipped"}, ("box2d_radii",)) == ["box2d_radii"]
    more = row | {"box2d_radii": 1.001 * float(row["box2d_radii"])}
    assert differing(more, ("box2d_radii",)) == ["box2d_radii"]


def test_every_scene_with_an_exact_answer_is_recorded():
    """At its middle step size, and those of the lesson at every step size, in both profiles."""
    expected = {
        (name, profile, k)
        for name in SCENARIOS
        if known(name)[1] is not None
        for profile in PROFILES
        for k in {known(name)[0].middle_substeps, *(LADDER if name in SCENES else ())}
    }
    assert sorted(EVERY) == sorted(expected)


def test_the_versions_that_were_recorded_are_those_that_are_pinned():
    """Another version of either gives other numbers."""
    of_box2d = Box2DEngine("shipped").versions()
    pinned = {"planck": version_of("planck")} | of_box2d
    assert [
        f"{name} {version}"
        for name, version in pinned.items()
        if f"{name} {version}" not in made_with(KEPT)
    ] == []


def test_what_adapters_says_of_float32_follows_from_the_table():
    """In how many scenes it is less than 1 % of an error, and in which it is most."""
    shares = shares_of("matched")
    small = sum(abs(share) < 0.01 for share in shares.values())
    most = [f"`{name}`" for name in reversed(shares) if known(name)[1] is not None][:3]
    text = " ".join(TEXTS["adapters/README.md"].split())

    assert (
        f"float32 is less than 1 % of the error of `box2d:matched` in {small} of {len(shares)}"
        f" scenes; most in {most[0]}, {most[1]} and {most[2]}"
    ) in text
    said = claim_of_all("matched", 100 * np.abs(list(shares.values()))).text
    assert f"In {small} of {len(shares)} scenes" in said


def test_a_share_is_the_error_of_box2d_less_that_of_planck(monkeypatch: pytest.MonkeyPatch):
    """Over that of Box2D: 1 where planck is exact, below 0 where Box2D is nearer; none where Box2D
    is exact."""
    rows = [("free_fall", 0.0, 0.1), ("ping_pong", 0.3, 0.2), ("rest_on_floor", 0.1, 0.0)]
    table = pd.DataFrame(
        [(name, "matched", known(name)[0].middle_substeps, p, b) for name, p, b in rows],
        columns=["scenario", "profile", "substeps", "planck_radii", "box2d_radii"],
    )
    monkeypatch.setattr("crosscheck2d.reports.lessons.mechanisms.float32.table_in", lambda _: table)
    shares_of.cache_clear()
    found = shares_of("matched")
    shares_of.cache_clear()

    assert found == pytest.approx({"ping_pong": -0.5, "free_fall": 1.0})
