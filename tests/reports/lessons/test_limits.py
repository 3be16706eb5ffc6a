"""Lesson 8: its brackets are those of the stability report, measured when asked for, and its run is
the one that fails."""

from __future__ import annotations

import re

import numpy as np
import pytest

from crosscheck2d.adapters.engines import DISTINCT, ENGINES
from crosscheck2d.reports.lessons import limits
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.limits import HARSHNESS, SEEN, limits_of
from crosscheck2d.reports.page.style import TRUTH
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import DRIVEN_ENGINES, DrivenEngine, play_as
from tests.measured import MEASURED
from tests.reports.stability.kept_limits import agrees, kept

LESSON = LESSONS["limits"]
PLAYED = list(DISTINCT)
NAMES = [seen.case for seen in SEEN.values()]


def at(case: str, engine: str, place: int) -> tuple[int, int, int]:
    """Where the sliders are for this."""
    return NAMES.index(case), PLAYED.index(engine), place


@pytest.mark.parametrize(
    "name",
    [
        "far_from_origin",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("slow_collision", "spin")),
    ],
)
def test_the_brackets_are_those_of_the_stability_report(name: str):
    """Searched here and now they hold the limits of the full form."""
    rows = {row.engine: row for row in kept() if row.case == name}
    found = {limit.engine: limit for limit in limits_of(name)}

    assert {engine for engine in found if engine.split("+")[0] in MEASURED} == set(rows)
    for engine, row in rows.items():
        assert found[engine].verdict == row.verdict
        assert agrees(found[engine], row)


@pytest.mark.slow
def test_another_engine_has_another_bracket(monkeypatch: pytest.MonkeyPatch):
    """The limit of Box2D is not typed in: what is given its name without the threshold does not
    fail."""
    place = at("slow_collision", "box2d:shipped", 5)
    with monkeypatch.context() as patch:
        patch.setattr(limits, "limits_of", limits_of.__wrapped__)
        patch.setattr(limits, "engines_of", lambda _: ["box2d:shipped"])
        patch.setitem(
            DRIVEN_ENGINES,
            "box2d:shipped",
            DrivenEngine("box2d:shipped", ENGINES["box2d:matched"].make),
        )
        without = dict(LESSON.at(place).facts)["box2d:shipped"]

    assert without == "does not fail up to 0.001 m/s"
    again = dict(LESSON.at(place).facts)["box2d:shipped"]
    works, fails = map(
        float, re.fullmatch(r"works at ([\d.]+), fails at ([\d.]+) m/s", again).groups()
    )
    assert fails < 1.0 < works < 1.06 * fails


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "engine", "place", "fails"),
    [
        ("slow_collision", "box2d:shipped", 1, False),
        ("slow_collision", "box2d:shipped", 3, True),
        ("slow_collision", "box2d:matched", 3, False),
        ("tunnelling_thin_wall", "pymunk:matched", 3, False),
        ("tunnelling_thin_wall", "pymunk:matched", 5, True),
        ("tunnelling_thin_wall", "event_driven:float64", 8, False),
        ("spin", "box2d:matched", 8, True),
        pytest.param("near_miss", "box2d_v3:shipped", 7, True, marks=pytest.mark.slow),
    ],
)
def test_the_run_fails_beyond_the_limit_and_only_there(
    case: str, engine: str, place: int, fails: bool
):
    """What is drawn leaves the exact answer, and the replay marks where; else it stays, and marks
    nothing."""
    shown = LESSON.at(at(case, engine, place))
    curves = {curve.name: np.asarray(curve.y) for curve in shown.charts[0].curves}
    here = shown.steps["Here"]

    assert ("event" in shown.opening) == fails
    assert ("0 of" in here or "none of" in here or "it works" in here) != fails
    if fails and engine in curves:
        k = len(curves[engine])
        way = np.ptp(curves[TRUTH])
        # A near miss leaves it by the thousandth part of a way that is none at all.
        assert np.abs(curves[engine] - curves[TRUTH][:k]).max() > (
            0.2 * way if case != "near_miss" else 1e-4
        )


@pytest.mark.slow
def test_refusals_are_shown_beside_the_exact_answer():
    """Box2D refuses a spin it would cut: there is nothing of it to draw, the reason is reported."""
    shown = LESSON.at(at("spin", "box2d:matched", 8))

    assert [curve.name for curve in shown.charts[0].curves] == [TRUTH]
    assert "the most that Box2D allows" in shown.steps["Here"]
    assert "b2_maxRotation" in shown.steps["Why"]


@pytest.mark.parametrize(
    ("engine", "bullets"), [("box2d:matched", True), ("box2d_v3:matched", False)]
)
def test_bullets_are_where_the_text_says(engine: str, bullets: bool):
    """As the engine itself reports it, in two disks that meet; CCD is on in both."""
    settings = play_as(engine, CASES["tunnelling_head_on"].scene(0.5, 0)).settings

    assert settings["continuous collision"][1] is True
    assert settings["continuous collision between disks"][1] is bullets


def test_box2d_sweeps_disks_against_walls_and_only_bullets_against_disks():
    """It gets farther at a thin wall than an engine without CCD, and between two disks only where
    what moves is a bullet."""
    limit = {(row.case, row.engine): row for row in kept()}
    for box, bullets in (("box2d", "matched"), ("box2d_v3", "matched+bullets")):
        for case in ("tunnelling_thin_wall", "tunnelling_head_on"):
            without = limit[case, "reference:exercise"].fails_at
            swept = "shipped" if "wall" in case else bullets
            assert limit[case, f"{box}:{swept}"].works_at > 2 * without
        assert limit["tunnelling_head_on", f"{box}:shipped"].fails_at < 1.2 * without


def test_every_case_has_its_values_within_the_report():
    """From the case's gentlest to its harshest, or to where a replay can still show it."""
    for seen in SEEN.values():
        values, ladder = CASES[seen.case].values, [seen.value(place) for place in HARSHNESS]
        assert ladder[0] == pytest.approx(values[0])
        assert min(values) <= min(ladder)
        assert max(ladder) <= max(values)
        assert len(set(ladder)) == len(ladder)


@pytest.mark.slow
def test_the_slider_says_the_parameter_of_its_case():
    """With its unit: what the same place means depends on the case."""
    said = [
        LESSON.at(at(name, "pymunk:matched", 3)).said["place"]
        for name in ("slow_collision", "tunnelling_thin_wall")
    ]

    assert said == ["closing speed = 0.275 m/s", "v dt / R = 1"]


@pytest.mark.slow
def test_the_share_that_is_drawn_is_of_all_runs_as_the_text_counts_them():
    """The search itself stops at the first run that fails, which made every share 1."""
    values = [SEEN["a fast disk meets another"].value(place) for place in HARSHNESS]
    place = values.index(4.0)
    shown = LESSON.at(at("tunnelling_head_on", "pymunk:matched", place))
    failed, runs = re.search(r"(\d+) of (\d+) runs fail", shown.steps["Here"]).groups()
    x, y = shown.x("pymunk:matched", 1), shown.y("pymunk:matched", 1)

    assert (failed, runs) == ("16", "32")  # half of the phases, by geometry: 2 R missed in each 4 R
    assert y[np.isclose(x, 4.0)].tolist() == [int(failed) / int(runs)]
