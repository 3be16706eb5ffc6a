"""The tidy table deviations.csv: a row for each number, with its run and what it is measured
against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from adapters.run import Run
from reports.compare.against import ITSELF
from reports.compare.view import Value

COLUMNS = (
    "scenario",
    "engine",
    "profile",
    "dt_s",
    "metric",
    "disk",
    "value",
    "unit",
    "versus",
    "at_s",
    "note",
)
TableRow = tuple[str, str, str, float, str, int, float, str, str, float, str]  # as `COLUMNS`


def deviation_row(run: Run, metric: str, value: Value, unit: str, versus: str) -> TableRow:
    """The row of one metric of a run."""
    whose = (run.scenario, run.engine, run.profile, run.dt, metric)
    return (*whose, value.disk, value.value, unit, versus, value.at, value.note)


def status_row(run: Run, why: str, versus: str = ITSELF) -> TableRow:
    """The row of a run without numbers, with the reason."""
    return deviation_row(run, "status", Value(np.nan, note=why), "", versus)


def table_of(rows: Sequence[TableRow]) -> pd.DataFrame:
    """The rows as a table with `COLUMNS`."""
    return pd.DataFrame(rows, columns=list(COLUMNS))
