"""The summary that a run prints: it says of how many scenes each number is."""

from __future__ import annotations

from dataclasses import replace

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.commands.run import medians, numbers_of_scenes
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.page.scenes import SceneScores, scenes_of
from crosscheck2d.scenarios.catalogue import scenario

NAMES = ("reference:exercise", "pymunk:matched")


def compared(name: str, answered: bool = True) -> Comparison:
    one = replace(scenario(name), substeps=(1,))
    one = one if answered else replace(one, truth=None, without_truth="it has none here")
    return compare(one, [play(ENGINES[name].make(), name, one, one.dt(1)) for name in NAMES])


def scenes(*names: str) -> list[SceneScores]:
    return scenes_of(compared(name) for name in names)


def test_the_last_row_counts_the_scenes_of_each_median():
    unanswered = scenes_of([compared("head_on_equal_e1", answered=False)])
    many = [*scenes("head_on_equal_e09", "oblique_e09"), *unanswered]
    headings, rows, _ = medians(many, NAMES, set())
    counts = dict(zip(headings, rows[-1]))

    assert counts["engine"] == "in scenes"
    assert counts["Position\nradii"] == "2"
    assert counts["Energy\nof energy"] == "3"
    assert counts["Not\nplayed\nscenes"] == ""  # each number there has its own


def test_the_summary_of_one_scene_has_no_counts():
    _, rows, _ = medians(scenes("head_on_equal_e09"), NAMES, set())

    assert [row[0] for row in rows] == [*NAMES]


def test_engines_that_are_judged_in_different_scenes_give_a_range():
    assert numbers_of_scenes([7, 5, 8, 0]) == "5–8"
    assert numbers_of_scenes([7]) == "7"
    assert numbers_of_scenes([]) == ""


def test_who_models_no_friction_has_no_row_and_no_failure():
    _, rows, without = medians(scenes("friction_bounce_e1_mu01", "slip_to_roll"), NAMES, set())

    assert without == [NAMES[0]]
    assert [row[0] for row in rows] == [NAMES[1], "in scenes"]
    assert medians(scenes("oblique_e09"), NAMES, set())[2] == []


def test_an_engine_that_breaks_the_protocol_is_not_scored():
    _, rows, _ = medians(scenes("oblique_e09"), NAMES, {NAMES[1]})

    assert set(rows[1][1:-1]) == {"breaks"}
    assert rows[1][-1] == "0 of 1"
