"""Measured impacts beside the exact answer and the engines."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.conformance import experiment
from crosscheck2d.adapters.conformance.experiment import (
    DT,
    KEPT,
    LEAD,
    MARK,
    in_markdown,
    replace_table,
    rows_of,
)
from crosscheck2d.adapters.conformance.impact_table import README
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, changed
from crosscheck2d.scenarios.families.experiment import (
    FRICTION,
    MEASURED,
    RESTITUTION,
    oblique_impacts,
)
from crosscheck2d.scenarios.truth.exact import with_oracle

TABLE = pd.read_csv(KEPT)
# the angle, in degrees, above which friction cannot end the slip of a sphere within the impact
SLIDES = np.degrees(np.arctan(7 / 2 * FRICTION * (1 + RESTITUTION)))


def departures(quantity: str) -> pd.Series:
    # Of the experiment from the exact answer, relative; by angle.
    rows = TABLE[TABLE.quantity == quantity].drop_duplicates("angle_deg").set_index("angle_deg")
    return abs(rows.experiment / rows.exact - 1)


def test_the_experiment_is_within_a_percent_of_the_exact_speed_where_the_sphere_slides():
    speed, spin = departures("e_t"), departures("spin_rad_s")
    assert round(speed[speed.index > SLIDES].min(), 4) >= 0.001
    assert speed[speed.index > SLIDES].max() <= 0.0065
    assert spin[spin.index > SLIDES].max() == pytest.approx(0.077, abs=5e-4)
    assert "0.1 to 0.65 %" in README.read_text("utf-8")


def test_the_model_ends_where_a_real_sphere_springs_back():
    assert departures("e_t").max() == departures("e_t")[20.22] == pytest.approx(0.16, abs=5e-3)
    assert departures("spin_rad_s").idxmax() < SLIDES == pytest.approx(32.52, abs=5e-3)


def test_the_formula_is_the_answer_of_the_oracle():
    scenario = oblique_impacts(DT, LEAD + 0.3)
    oracle = with_oracle(replace(scenario, truth=None, without_truth="not yet"))
    ours, exact = (one.truth(one.times[-1:]).at(0) for one in (scenario, oracle))
    assert ours.velocity == pytest.approx(exact.velocity, rel=1e-13)
    assert ours.angular_velocity == pytest.approx(exact.angular_velocity, rel=1e-13)
    assert ours.position == pytest.approx(exact.position, abs=1e-15)


def test_every_measured_number_is_in_the_table_beside_every_engine_that_takes_it():
    count = sum(int((~np.isnan(MEASURED[key])).sum()) for key in experiment.QUANTITIES)
    assert (TABLE.groupby("engine").size() == count).all()
    assert {"reference:ordered", "pymunk:shipped", "box2d_v3:matched"} <= {*TABLE.engine}
    page = README.read_text("utf-8")
    assert replace_table(page, MARK, in_markdown(TABLE)) == page


@pytest.mark.parametrize(
    "name", ["reference:ordered", "pymunk:matched", "box2d:shipped", "box2d_v3:matched"]
)
def test_an_engine_reads_what_is_kept_of_it(name):
    rows = pd.DataFrame(rows_of(name, ENGINES[name], experiment.exact()))
    kept = TABLE[TABLE.engine == name].reset_index(drop=True)
    assert rows.drop(columns="engine").columns.equals(kept.drop(columns="engine").columns)
    for column in ("experiment", "exact", "value", "low", "high"):
        # 1e-3 leaves room for another compiler's last digits
        assert rows[column].to_numpy() == pytest.approx(kept[column].to_numpy(), rel=1e-3)


def test_an_engine_with_another_friction_departs():
    row = EngineRow(partial(changed, "pymunk:matched", friction=1.1), "", 0.0, 2.0**-53)
    rows = pd.DataFrame(rows_of("pymunk:matched", row, experiment.exact()))
    slides = rows[(rows.quantity == "e_t") & (rows.angle_deg > SLIDES)]
    assert abs(slides.value / slides.exact - 1).max() > 0.0065
