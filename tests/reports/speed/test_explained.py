"""What the error budget leaves out is said beside the share that it explains."""

from __future__ import annotations

import numpy as np
import pandas as pd

from crosscheck2d.reports.speed import budget, explained
from crosscheck2d.reports.speed.budget import RESIDUAL, TOTAL, budget_of
from crosscheck2d.reports.speed.explained import COLUMNS, cuts, sentence
from crosscheck2d.reports.speed.scored_part import scored


def made_up(*rows: tuple[str, str, float, float, float, float, str]) -> pd.DataFrame:
    """A table of scene, engine, until, horizon, error, residual, note."""
    return pd.DataFrame(
        [
            (scene, 0, engine, "own", 0.1, until, horizon, 9.0, error, left, note)
            for scene, engine, until, horizon, error, left, note in rows
        ],
        columns=COLUMNS,
    )


TABLE = made_up(
    ("short", "a", 0.2, 1.0, 1.0, 0.005, ""),
    ("short", "b", 0.2, 1.0, 1.0, 0.5, ""),
    ("whole", "a", 4.0, 4.0, 1.0, 0.0005, ""),
    ("whole", "b", 4.0, 4.0, np.nan, np.nan, "error: no"),
    ("still", "a", 3.0, 3.0, 0.0, 0.0, ""),
    ("still", "b", 3.0, 3.0, 1e-13, 1e-13, ""),
)


def test_what_is_cut_is_named_once_however_many_engines_played_it():
    """With how long it is evaluated and how long its exact answer lasts."""
    assert cuts(TABLE).to_numpy().tolist() == [["short", 0.2, 1.0]]


def test_the_sentence_says_what_is_cut_at_which_time_and_how_much_is_left():
    """Nothing is cut: said, too; the words differ, so that neither can stand for the other."""
    said, uncut = sentence(TABLE), sentence(TABLE[TABLE.scenario != "short"])

    assert said.startswith(
        "of 3 errors (2 engines in 3 scenes; 2 more below 1e-09 radii; 1 not played) 2 are"
        " explained to 1 %, 1 to 0.1 %"
    )
    assert "over 7 of 8 simulated seconds: 1 scene is cut" in said
    assert "(short at 0.2 of 1 s)" in said
    assert said.endswith("Of the 1 error in scenes that are not cut, 1 is explained to 1 %")
    assert uncut.endswith("over 7 of 7 simulated seconds, up to the end of every exact answer")


def test_the_budget_itself_tells_how_far_it_goes():
    """The gas is cut, and its exact answer ends before the scene; a fall is followed to its end."""
    rows = [
        row
        for scene, k in (("gas_of_100", 4), ("free_fall", 4))
        for row in budget_of(scene, 0, "pymunk:matched", k)
    ]
    table = explained.explained(pd.DataFrame(rows, columns=budget.COLUMNS)).set_index("scenario")
    gas, fall = table.loc["gas_of_100"], table.loc["free_fall"]

    assert 0 < gas.until_s < gas.horizon_s < gas.duration_s
    assert gas.horizon_s == scored("gas_of_100", 0).scenario.duration
    assert fall.until_s == fall.horizon_s == fall.duration_s
    assert [*cuts(table.reset_index()).scenario] == ["gas_of_100"]


def test_a_row_has_the_error_and_what_is_left_of_the_budget():
    """As the contributions have them."""
    rows = pd.DataFrame(budget_of("slow_collision", 0, "box2d:matched", 4), columns=budget.COLUMNS)
    contributions = rows.set_index("contribution").position_radii
    row = explained.explained(rows).iloc[0]

    assert (row.error_radii, row.residual_radii) == (contributions[TOTAL], contributions[RESIDUAL])
    assert row.note == ""
