"""The table of what each engine does with e is what the engines do, and README shows it."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from crosscheck2d.adapters.conformance import impact_table
from crosscheck2d.adapters.conformance.impact_table import (
    COLUMNS,
    COUNT,
    MARK,
    PHASES,
    RANGE,
    README,
    STEP_SIZES,
    cell,
    collide,
    in_markdown,
    kept,
    pairs,
    replace_table,
    rows_of_table,
)
from crosscheck2d.adapters.conformance.probe import DT
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED, changed, row_of
from crosscheck2d.adapters.npm_packages import missing

ROWS = ENGINES | FETCHED
TABLE = kept().set_index(["engine", "dt"])
FINE, COARSE = "1/256 s", "1/60 s"
QUICK = ("reference:ordered", "pymunk:shipped")
EACH = [  # a second each
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
    columns = list[str]()
    for fresh in rows_of_table(name, row):
        was = TABLE.loc[(name, fresh["dt"])]
        columns += [
            column
            for column in (f"{key}{end}" for key in COLUMNS for end in RANGE)
            # 1e-3 leaves room for another compiler's last digits, 1e-6 for those of a number near 0
            if not np.isclose(fresh[column], was[column], rtol=1e-3, atol=1e-6, equal_nan=True)
        ]
        columns += [key for key in ("numbers", "versions") if fresh[key] != was[key]]
    return columns


@pytest.mark.parametrize("name", EACH)
def test_an_engine_reads_what_is_kept_of_it(name):
    assert drifted(name, ROWS[name]) == []


def test_an_engine_with_another_restitution_is_noticed():
    row = EngineRow(partial(changed, "pymunk:shipped", elasticity=0.6), "", 0.0, 2.0**-53)
    assert {"e_slow", "e_2", "e_wall", "e_small"} <= set(drifted("pymunk:shipped", row))


def test_the_table_has_every_engine_at_two_step_sizes_and_readme_shows_it():
    assert list(TABLE.index) == [(name, dt) for name in ROWS for dt in (FINE, COARSE)]
    assert [f"1/{round(1 / dt)} s" for dt in STEP_SIZES] == [FINE, COARSE]
    assert in_markdown(kept()) in README.read_text("utf-8")


def test_a_cell_has_32_readings_at_phases_that_fill_a_step():
    assert len(PHASES) == COUNT == 32
    assert np.diff(np.sort(PHASES)).max() == pytest.approx(1 / 32)
    with closing(row_of("pymunk:matched").make()) as engine:
        assert {len(read(engine, DT)) for _, read in COLUMNS.values()} == {COUNT}


@pytest.mark.parametrize("name", ["pymunk:shipped", "box2d:shipped", "box2d_v3:shipped"])
def test_the_pairs_of_a_scene_do_not_disturb_each_other(name):
    scene, alone = pairs(2.0, DT, spin=40.0), list[np.ndarray]()
    with closing(row_of(name).make()) as engine:
        _, together = collide(engine, scene, DT)
        for k in range(0, COUNT, 5):
            rows = [2 * k, 2 * k + 1, 2 * COUNT]
            some = {
                key: value[rows]
                for key, value in vars(scene).items()
                if key not in ("walls", "gravity", "restitution", "friction", "wrap")
            }
            some["position"] = some["position"] - [0.0, some["position"][0, 1]]
            alone.append(collide(engine, replace(scene, **some), DT)[1])
    apart = np.stack([together[2 * k : 2 * k + 2] for k in range(0, COUNT, 5)])

    # float32 rounds a spin of 40 to 2e-6
    assert np.abs(apart - alone).max() <= 1e-4


def test_the_air_of_an_engine_is_not_taken_for_its_e():
    with closing(row_of("pymunk:matched").make()) as engine:
        load = engine.load

        def load_with_air(scene, dt):
            load(scene, dt)
            engine.space.damping = 0.5  # of each speed is left after 1 s

        engine.load = load_with_air
        e = COLUMNS["e_2"][1](engine, DT)
    # In the step of the collision the speed that it makes loses nothing; 24 steps would lose 6 %.
    assert e == pytest.approx(0.5, rel=1.01 * (0.5**-DT - 1))


@pytest.mark.parametrize(
    ("column", "spread", "text"),
    [
        ("e_2", (0.5, 0.5, 0.5), "0.5"),
        ("e_2", (0.1, 0.00461, 0.1), "0.1 (0.00461 to 0.1)"),
        ("energy", (6.19, -0.2, 6.85), "+6.2 (-0.2 to +6.8)"),
        ("energy", (-1e-9, -1e-9, 1e-9), "+0.0"),
        ("spin", (np.nan, np.nan, np.nan), "-"),
    ],
)
def test_a_cell_is_the_median_with_the_range(column, spread, text):
    assert cell(column, *spread) == text


def test_one_engine_is_asked_and_the_rows_of_the_others_are_kept(monkeypatch):
    anew = kept()[lambda table: table.engine == "pymunk:shipped"].assign(date="2100-01-01")
    monkeypatch.setattr(impact_table, "table_of", lambda rows: anew if len(rows) == 2 else None)
    table = impact_table.with_anew(["pymunk"]).reset_index(drop=True)

    assert table.date.ne(kept().date).sum() == 2
    assert table.drop(columns="date").equals(kept().drop(columns="date"))
    assert "to 2100-01-01 with" in in_markdown(table).replace("\n", " ")
    with pytest.raises(SystemExit, match="no engine is called pimunk"):
        impact_table.main("pimunk")


def test_the_table_takes_its_place_and_leaves_the_rest_of_a_text():
    begin, end = "<!-- impact table -->\n", "<!-- end of impact table -->\nafter\n"
    once = replace_table(f"before\n{begin}old\n{end}", MARK, "new\n")
    assert once == f"before\n{begin}new\n{end}"
    assert replace_table(once, MARK, "new\n") == once


# The readings of an engine that is exact, and of one whose cause is known.


def test_exact_readings_are_read_as_exact():
    exact = {
        "threshold": 0,
        "e_slow": 0.5,
        "e_2": 0.5,
        "e_small": 0.5,
        "friction_1": 0.2,
        "lever": 1,
        "energy": 0,
    }
    for dt in (FINE, COARSE):
        row = TABLE.loc[("reference:ordered", dt)]
        for key, number in exact.items():
            spread = row[[f"{key}{end}" for end in RANGE]].tolist()
            assert spread == pytest.approx([number] * 3, rel=1e-9, abs=1e-9), key


def test_the_threshold_of_both_box2ds_is_found_where_it_is_compiled_in():
    # 1 m/s, to the 1 % to which it is looked for.
    for name in ("box2d:shipped", "box2d_v3:shipped"):
        row = TABLE.loc[(name, FINE)]
        assert 1.0 <= row.threshold_low <= row.threshold_high <= 1.01
        assert row.e_small == 0


def test_the_cap_on_spin_is_a_quarter_or_an_eighth_of_a_turn_a_step():
    # It depends on the step: 300 rad/s are below it at 1/256 s in Box2D 2.3.
    caps = {("box2d", COARSE): 60 / 4, ("box2d_v3", COARSE): 60 / 8, ("box2d_v3", FINE): 256 / 8}
    for (engine, dt), turns in caps.items():
        # float32; and Box2D 3.1 turns (cos, sin), whose length is rounded
        assert TABLE.loc[(f"{engine}:shipped", dt)].spin == pytest.approx(2 * np.pi * turns, 1e-4)
    assert TABLE.loc[("box2d:shipped", FINE)].spin == 300
