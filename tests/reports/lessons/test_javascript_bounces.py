"""The recorded numbers of lesson 6.11 are those that the JavaScript engines give, and what it says
of matter is shown by disabling it."""

from __future__ import annotations

import numpy as np
import pytest

from crosscheck2d.adapters.npm_packages import missing, version_of
from crosscheck2d.reports.lessons.mechanisms.javascript_bounces import (
    ENGINES,
    KEPT,
    RESTITUTIONS,
    VERSIONS,
    measured,
    played,
    ratios,
)
from crosscheck2d.reports.lessons.mechanisms.pairs import CLOSING
from crosscheck2d.reports.lessons.mechanisms.recorded import made_with, table_in

LACKING = next(filter(None, map(missing, ("planck", "matter-js", "@dimforge/rapier2d-compat"))), "")
fetched = pytest.mark.skipif(bool(LACKING), reason=LACKING)
CASES = [(name, off, e) for name in ENGINES for off in VERSIONS for e in RESTITUTIONS]


def test_every_engine_has_a_ratio_at_every_speed():
    """In every version, for every e."""
    assert len(table_in(KEPT)) == len(CASES) * len(CLOSING)
    assert all(len(ratios(*case)) == len(CLOSING) for case in CASES)


@fetched
def test_the_engines_give_what_is_recorded():
    """Six digits are kept; what rests is left with rounding."""
    wrong = [
        case
        for case in CASES
        if not np.allclose(measured(*case).ratio, ratios(*case), rtol=6e-6, atol=1e-9)
    ]
    assert wrong == []


def test_the_versions_that_were_recorded_are_those_that_are_pinned():
    """Another version may bounce otherwise."""
    packages = ("planck", "matter-js", "@dimforge/rapier2d-compat")
    assert [name for name in packages if f"{name} {version_of(name)}" not in made_with(KEPT)] == []


@pytest.mark.parametrize("e", RESTITUTIONS)
def test_each_of_the_three_accounts_for_its_part_of_what_matter_loses(e: float):
    """Without air a fast pair keeps more; without rotation, too, all of e; with one iteration slow
    pairs, too, and nothing is left to explain."""
    as_it_is, no_air, no_rotation, one = (ratios("matter", off, e) for off in list(VERSIONS)[:4])

    assert as_it_is[-1] < 0.8 * no_air[-1]
    assert no_air[-1] < 0.8 * e
    assert np.allclose(no_rotation[-5:], e, atol=1e-6)
    assert (no_rotation[:10] < e / 4).all()
    assert np.allclose(one, e, atol=1e-6)


@fetched
def test_a_disk_of_matter_is_a_polygon_and_the_matched_one_has_200_sides():
    """At 100 pixels a metre a disk of 0.1 m has 10 pixels, and 10 sides."""
    setting = "sides of the polygon of a disk"

    assert played("matter", "nothing", 0.9).settings[setting][1] == 10
    assert played("matter", "all that matched lifts", 0.9).settings[setting][1] == 200
