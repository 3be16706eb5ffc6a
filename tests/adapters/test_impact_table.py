"""The table of what each engine does with e is what the probes read, and README shows it."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
import pytest

from adapters.conformance import impact_table
from adapters.conformance.impact_table import (
    COLUMNS,
    FRONT,
    OUTSIDE,
    README,
    SHORT,
    in_markdown,
    kept,
    row_of_table,
    short_form,
)
from adapters.engine_row import EngineRow
from adapters.engines import ENGINES, FETCHED, changed
from adapters.npm_packages import missing

ROWS = ENGINES | FETCHED
TABLE = kept().set_index("engine")
QUICK = ("reference:ordered", "pymunk:shipped")
EACH = [  # two seconds each
    pytest.param(
        name,
        marks=[
            *([] if name in QUICK else [pytest.mark.slow]),
            *(
                [pytest.mark.skipif(bool(missing(row.package)), reason=missing(row.package))]
                if row.package
                else []
            ),
        ],
    )
    for name, row in ROWS.items()
]


def drifted(name: str, row: EngineRow) -> list[str]:
    """The columns in which an engine no longer reads what is kept of `name`."""
    fresh, was = row_of_table(name, row), TABLE.loc[name]
    numbers = [
        column
        for column in COLUMNS
        # 1e-3 leaves room for another compiler's last digits, 1e-6 for those of a number near 0
        if not np.isclose(fresh[column], was[column], rtol=1e-3, atol=1e-6, equal_nan=True)
    ]
    return numbers + [key for key in ("numbers", "versions") if fresh[key] != was[key]]


@pytest.mark.parametrize("name", EACH)
def test_an_engine_reads_what_is_kept_of_it(name):
    """With the same versions; else `python -m adapters.conformance.impact_table` writes it anew."""
    assert drifted(name, ROWS[name]) == []


def test_an_engine_with_another_restitution_is_noticed():
    """The negative control: elasticity e for sqrt(e) on a shape."""
    row = EngineRow(partial(changed, "pymunk:shipped", elasticity=0.6), "", 0.0, 2.0**-53)
    assert {"e_slow", "e_2", "e_wall", "e_small"} <= set(drifted("pymunk:shipped", row))


def test_the_table_has_every_engine_and_readme_shows_it():
    """In their order, and nothing that is not in the file."""
    assert list(TABLE.index) == list(ROWS)
    assert in_markdown(kept()) in README.read_text("utf-8")


def test_the_front_page_shows_the_short_form():
    """Every outside engine in a row of its own, with the date and its version; a number that is not
    in the file would be noticed."""
    text = FRONT.read_text("utf-8")
    ours = {name.split(":")[0] for name, row in ROWS.items() if not row.outside}
    other = kept()
    other.loc[other.engine == "planck:matched", "energy"] += 1

    assert impact_table.with_short_form(text, kept()) == text
    assert impact_table.with_short_form(text, other) != text
    assert set(OUTSIDE) == {name.split(":")[0] for name in ROWS} - ours
    assert {"reference", "event_driven"} <= ours


@pytest.mark.parametrize("engine", OUTSIDE)
def test_a_row_of_the_short_form_has_all_profiles_where_they_differ(engine):
    """Before the arrow the number as shipped, behind it as matched; one number where all agree."""
    row = short_form(kept()).splitlines()[2 + OUTSIDE.index(engine)].strip("| ").split(" | ")
    shown = dict(zip(SHORT, (each.split(" → ") for each in row[1:-1]), strict=True))
    profiles = [TABLE.loc[name] for name in ROWS if name.split(":")[0] == engine]

    assert str(profiles[0].versions).split(",")[0] in row[0]
    for key, texts in shown.items():
        numbers = [float(each.removesuffix(" %")) if each != "-" else np.nan for each in texts]
        expected = [each[key] for each in profiles]
        # three digits, or a tenth of a percent
        near = partial(pytest.approx, rel=5e-3, abs=0.051 if key == "energy" else 1e-6, nan_ok=True)
        assert (numbers if len(numbers) > 1 else numbers * len(profiles)) == near(expected), key


def test_an_engine_with_one_profile_or_three_of_any_name_has_a_row(monkeypatch):
    """With one number, or one of each; an engine of this project has none."""
    one = kept().iloc[:1].assign(engine="toy:plain", spin=3.0)
    two, three = one.assign(engine="toy:b"), one.assign(engine="toy:c", spin=4.0)
    monkeypatch.setattr(impact_table, "OUTSIDE", ["toy"])

    def spins(table):
        return [line.split(" | ")[5] for line in short_form(table).splitlines()[2:]]

    assert spins(pd.concat([kept(), one])) == ["3"]
    assert spins(pd.concat([kept(), one, two])) == ["3"]
    assert spins(pd.concat([kept(), one, two, three])) == ["3 → 3 → 4"]


def test_one_engine_is_asked_and_the_rows_of_the_others_are_kept(monkeypatch):
    """In their order; a name that is none is refused."""
    anew = kept().iloc[5:6].assign(date="2100-01-01")
    monkeypatch.setattr(impact_table, "table_of", lambda rows: anew if len(rows) == 2 else None)
    table = impact_table.with_anew(["pymunk"]).reset_index(drop=True)

    assert table.date.ne(kept().date).sum() == 1
    assert table.drop(columns="date").equals(kept().drop(columns="date"))
    assert "Read on 2026-11-23 to 2100-01-01 with" in in_markdown(table)
    with pytest.raises(SystemExit, match="no engine is called pimunk"):
        impact_table.main("pimunk")


def test_the_table_takes_its_place_and_leaves_the_rest_of_a_text():
    """However often it is written."""
    text = f"before\n{impact_table.BEGIN}old\n{impact_table.END}\nafter\n"
    once = impact_table.with_table(text, kept())
    assert once == f"before\n{impact_table.BEGIN}{in_markdown(kept())}{impact_table.END}\nafter\n"
    assert impact_table.with_table(once, kept()) == once


# The readings of an engine that is exact, and of one whose cause is known.


def test_exact_readings_are_read_as_exact():
    """reference:ordered takes every collision at its own time, with friction."""
    row = TABLE.loc["reference:ordered"]
    exact = {
        "threshold": 0,
        "e_slow": 0.5,
        "e_2": 0.5,
        "e_small": 0.5,
        "friction_1": 0.2,
        "lever": 1,
    }
    assert row[list(exact)].to_dict() == pytest.approx(exact, rel=1e-9)
    assert (
        abs(row.energy) < 0.1
    )  # a sample is up to dt / 2 from the top: (g dt / 4)^2 / (2 g), 1e-4 %


def test_the_threshold_of_box2d_is_found_where_it_is_compiled_in():
    """1 m/s, to the 1 % to which it is looked for."""
    assert 1.0 <= TABLE.loc["box2d:shipped"].threshold <= 1.01
    assert TABLE.loc["box2d:shipped"].e_small == 0
