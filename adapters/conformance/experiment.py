"""What each engine does in impacts that were measured, beside the experiment and the exact answer.

`uv run --extra js python -m crosscheck2d.adapters.conformance.experiment` asks all engines with
friction, and writes experiment.csv and the table of adapters/README.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import numpy as np
import pandas as pd

from crosscheck2d.adapters.conformance.impact_table import PHASES, README, replace_table
from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.scenarios.families.experiment import MEASURED, SPEED, oblique_impacts
from crosscheck2d.scenarios.model import Array, State

KEPT = Path(__file__).with_name("experiment.csv")
MARK = "experiment table"
DT = 1 / 32768  # s; 0.05 radii a step
LEAD = 4  # steps before the impact, and its phase
QUANTITIES = {"e_t": "speed along the plate, after / before", "spin_rad_s": "spin after, rad/s"}


def outcomes(end: State) -> dict[str, Array]:
    """(m,) of each quantity, of the state after the impacts.

    Friction turns a sphere that moves to the right clockwise; the experiment states the amount.
    """
    along = SPEED * np.sin(np.radians(MEASURED["angle_deg"]))
    return {"e_t": end.velocity[:, 0] / along, "spin_rad_s": -end.angular_velocity}


def exact() -> dict[str, Array]:
    scenario = oblique_impacts(DT, LEAD)
    assert scenario.truth is not None
    return outcomes(scenario.truth(scenario.times[-1:]).at(0))


def rows_of(name: str, row: EngineRow, expected: Mapping[str, Array]) -> list[dict[str, object]]:
    """A row for each measured number, with the median and the range over `PHASES`; none if the
    engine refuses the scene."""
    runs = []
    with closing(row.make()) as engine:
        for phase in PHASES:
            scenario = oblique_impacts(DT, LEAD + phase)
            try:
                engine.load(scenario.scene, DT)
                engine.step(scenario.intervals)
                runs.append(outcomes(engine.read()))
            except Unsupported:
                return []
    return [
        {
            "quantity": key,
            "angle_deg": MEASURED["angle_deg"][k],
            "experiment": MEASURED[key][k],
            "exact": expected[key][k],
            "engine": name,
            "value": np.median(values := [run[key][k] for run in runs]),
            "low": min(values),
            "high": max(values),
        }
        for key in QUANTITIES
        for k in np.flatnonzero(~np.isnan(MEASURED[key]))
    ]


def table_of(rows: Mapping[str, EngineRow]) -> pd.DataFrame:
    expected = exact()
    return pd.DataFrame([cells for item in rows.items() for cells in rows_of(*item, expected)])


def in_markdown(table: pd.DataFrame) -> str:
    """A line for each measured number; engines that agree in all digits share a column."""
    columns = dict[tuple[str, ...], list[str]]()
    for name, rows in table.groupby("engine", sort=False):
        columns.setdefault(tuple(map(text, rows.quantity, rows.value)), []).append(f"`{name}`")
    first = table[table.engine == table.engine.iloc[0]]
    texts = {
        "quantity": map(QUANTITIES.__getitem__, first.quantity),
        "angle": (f"{angle:.3g}" for angle in first.angle_deg),
        "experiment": map(text, first.quantity, first.experiment),
        "exact": map(text, first.quantity, first.exact),
        **{", ".join(names): cells for cells, names in columns.items()},
    }
    lines = [texts, "-" * len(texts), *zip(*texts.values())]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def text(quantity: str, value: float) -> str:
    return f"{value:.3f}" if quantity == "e_t" else f"{value:.0f}"


def main() -> None:
    """Ask all engines, and write the file and the table."""
    table_of(ENGINES | FETCHED).to_csv(KEPT, index=False, float_format="%.6g")
    page = README.read_text(encoding="utf-8")
    README.write_text(replace_table(page, MARK, in_markdown(pd.read_csv(KEPT))), encoding="utf-8")


if __name__ == "__main__":
    main()
