"""The tidy table deviations.csv: a row for each number, with its run and what it is measured
against; a verdict fails above its bound, other numbers have none. A value is NaN only where it is
not judged, and in the row of a run without numbers; the note says why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.against import ITSELF
from crosscheck2d.reports.compare.verdicts import Verdict
from crosscheck2d.reports.compare.view import Value

COLUMNS = (
    *("scenario", "engine", "profile", "dt_s"),
    *("metric", "disk", "value", "unit", "versus", "at_s", "note", "bound"),
)
TableRow = tuple[str, str, str, float, str, int, float, str, str, float, str, float]  # as `COLUMNS`


def deviation_row(run: Run, metric: str, value: Value, unit: str, versus: str) -> TableRow:
    """The row of one metric of a run; what is judged and no number is infinitely far off."""
    number = np.inf if value.judged and np.isnan(value.value) else value.value
    cell = (run.scenario, run.engine, run.profile, run.dt)
    return (*cell, metric, value.disk, number, unit, versus, value.at, value.note, np.nan)


def verdict_row(run: Run, verdict: Verdict) -> TableRow:
    """The row of one verdict on a run; the note has the second disk, or the wall."""
    disk, *others = verdict.disks or (-1,)
    note = ", ".join(f"with disk {k}" if k >= 0 else f"with wall {-1 - k}" for k in others)
    value = Value(verdict.value, disk, verdict.at, note)
    return (*deviation_row(run, verdict.id, value, verdict.unit, ITSELF)[:-1], verdict.bound)


def status_row(run: Run, reason: str, versus: str = ITSELF) -> TableRow:
    """The row of a run without numbers, with the reason."""
    return deviation_row(run, "status", Value(np.nan, note=reason, judged=False), "", versus)


def table_of(rows: Sequence[TableRow]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=list(COLUMNS))
