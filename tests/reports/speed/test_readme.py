"""What README.md and reports/speed/README.md say in numbers follows from the kept tables."""

from __future__ import annotations

import re
from math import inf
from pathlib import Path

import pandas as pd

from crosscheck2d.adapters.engines import DISTINCT
from crosscheck2d.reports.compare.pareto import YARDSTICK
from crosscheck2d.reports.speed import figures
from crosscheck2d.reports.speed.tables import COMPARED
from tests.measured import MEASURED
from tests.reports.speed import statements as speed_figures

ROOT = Path(__file__).parents[3]
FRONT = (ROOT / "README.md").read_text("utf-8")
SPEED = (ROOT / "reports" / "speed" / "README.md").read_text("utf-8")


def test_the_caption_of_the_picture_follows_from_the_kept_table():
    text = " ".join(SPEED.split())

    assert speed_figures.caption(figures.read(figures.KEPT)) in text
    assert "the geometric mean over the scenes, without the best and the worst quarter" in text


def stated(text: str) -> list[tuple[float, float]]:
    of_errors = " ".join(text.split()).split("divides their error ")[1].split(". They come")[0]
    return [
        (float(low), float(high)) for low, high in re.findall(r"by ([\d.]+) to ([\d.]+)", of_errors)
    ]


def outside(kept: pd.DataFrame, text: str) -> set[str]:
    """The engines with end-of-step detection for which what the text says of half a step is not
    true."""
    falls, wrong = speed_figures.halving(kept)[0], set()
    for names, (low, high) in zip(speed_figures.LATE_BY_KIND.values(), stated(text), strict=True):
        for name in names:
            # A number is printed to a tenth.
            ratios = falls.loc[name].dropna()
            if not ((ratios > low - 0.051) & (ratios < high + 0.051)).all():
                wrong.add(name)
    return wrong


def test_what_half_a_step_buys_is_true_of_every_engine_with_end_of_step_detection():
    # None is left out, and the ranges hold for each; one whose error grows is no exception without
    # a word. The control: with a tenth of the coarsest error an engine falls out of its range,
    # whichever it is.
    kept, late = figures.read(figures.KEPT), {YARDSTICK, *COMPARED}
    spoken_of = [name for names in speed_figures.LATE_BY_KIND.values() for name in names]
    assert sorted(spoken_of) == sorted(late)
    ordered = {"reference:ordered", "event_driven:float64"}
    assert late & MEASURED == (set(DISTINCT) & MEASURED) - ordered
    assert outside(kept, SPEED) == set()
    assert ("below 1: the error grows" in " ".join(SPEED.split())) == (
        speed_figures.halving(kept)[0] < 1
    ).any(axis=None)

    controlled = set()
    for name in late:
        worse = kept.copy()
        of_name = (worse.figure == "pooled error") & (worse.engine + ":" + worse.profile == name)
        finite = sorted(worse["at"][of_name & (worse.value < inf)], key=int)
        if len(finite) < 2:  # it fails in too many scenes: there is no ratio
            continue
        worse.loc[of_name & (worse["at"] == finite[0]), "value"] /= 10
        assert outside(worse, SPEED) == {name}
        controlled.add(name)
    assert {YARDSTICK, "pymunk:matched", "box2d:matched"} <= controlled


def test_the_scenes_in_which_smaller_steps_do_not_help_are_counted_for_every_engine():
    table = SPEED.split("falls by less than a tenth")[1]

    assert [name for name in DISTINCT if name in MEASURED and f"\n| {name} | " not in table] == []


def test_the_page_on_speed_ends_with_what_follows_from_the_kept_tables():
    assert SPEED.endswith(f"less there.\n\n{speed_figures.measured()}")


def test_nothing_else_is_said_of_who_costs_least():
    assert (FRONT + SPEED).count("costs least") == 1
