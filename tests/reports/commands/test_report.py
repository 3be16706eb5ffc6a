"""The summary that a run prints: it says of how many scenes each number is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.commands.report import medians, numbers_of_scenes
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.page.overview import OverviewCell
from crosscheck2d.scenarios.catalogue import scenario


def compared(name: str, answered: bool = True) -> Comparison:
    """A scene through two engines at one step size."""
    one = replace(scenario(name), substeps=(1,))
    one = one if answered else replace(one, truth=None, without_truth="it has none here")
    names = "reference:exercise", "pymunk:matched"
    return compare(one, [play(ENGINES[name].make(), name, one, one.dt(1)) for name in names])


def test_the_last_row_counts_the_scenes_of_each_median():
    """A scene without an exact answer has no error of position, but one of energy."""
    answered = [compared("head_on_equal_e09"), compared("oblique_e09")]
    headings, rows, _ = medians([*answered, compared("head_on_equal_e1", answered=False)], set())
    counts = dict(zip(headings, rows[-1]))

    assert counts["engine"] == "in scenes"
    assert counts["Position\nradii"] == "2"
    assert counts["Energy\nof energy"] == "3"
    assert counts["Not\nplayed\nscenes"] == ""  # each number there has its own


def test_the_summary_of_one_scene_has_no_counts():
    """All numbers are of that scene."""
    _, rows, _ = medians([compared("head_on_equal_e09")], set())

    assert [row[0] for row in rows] == ["reference:exercise", "pymunk:matched"]


def test_engines_that_are_judged_in_different_scenes_give_a_range():
    """One without a number is left out of it."""
    cells = [OverviewCell("1", value=1.0, scenes=n) for n in (7, 5, 8)]

    assert numbers_of_scenes([*cells, OverviewCell("–", value=np.nan)]) == "5–8"
    assert numbers_of_scenes(cells[:1]) == "7"
    assert numbers_of_scenes([]) == ""
