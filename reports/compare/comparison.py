"""The runs of one scenario beside the truth and each other, in one tidy table, deviations.csv: a
row for each number. A verdict fails above its bound; other numbers have none. A value is NaN only
where it is not judged, and in the row of a run without numbers; the note says why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.against import ENGINE, ITSELF, TRUTH
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.verdicts import Verdict, verdicts_on
from crosscheck2d.reports.compare.view import Value, View, beside, not_judged
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import answered

COLUMNS = (
    *("scenario", "engine", "profile", "dt_s"),
    *("metric", "disk", "value", "unit", "versus", "at_s", "note", "bound"),
)
TableRow = tuple[str, str, str, float, str, int, float, str, str, float, str, float]  # as `COLUMNS`


@dataclass(frozen=True, eq=False)
class Comparison:
    scenario: Scenario
    truth: Trajectory | None  # the exact answer up to its horizon
    runs: Sequence[Run]  # also failed and refused ones, in the order of `ENGINES`, coarse dt first
    table: pd.DataFrame  # one number a row

    @property
    def middle_dt(self) -> float:
        """s, the middle step size, whose errors are the scores of the report."""
        return self.scenario.dt(self.scenario.middle_substeps)

    @property
    def middle_runs(self) -> list[Run]:
        return [run for run in self.runs if run.dt == self.middle_dt]


def compare(scenario: Scenario, runs: Sequence[Run]) -> Comparison:
    """Every metric of every run against the laws, the truth and every other engine at the same dt;
    and its verdicts.

    A run that failed has one row with its status, and no score.
    """
    scenario, truth = answered(scenario)
    jumps = None if truth is None else jumps_of(truth, scenario)
    rows: list[TableRow] = []
    for number, run in enumerate(runs):
        if run.status != "ok":
            rows.append(status_row(run, f"{run.status}: {run.reason}"))
            continue
        rows += _measure(run, beside(scenario, run, None, None), ITSELF)
        if truth is not None:
            rows += _measure(run, beside(scenario, run, truth, jumps), TRUTH)
        for other in runs[number + 1 :]:
            if other.dt == run.dt and other.name != run.name and other.status == "ok":
                view = beside(scenario, run, other.trajectory, None, other.silent)
                rows += _measure(run, view, other.name)
        rows += [verdict_row(run, verdict) for verdict in verdicts_on(run, scenario, truth)]
    return Comparison(scenario, truth, tuple(runs), table_of(rows))


def _measure(run: Run, view: View, versus: str) -> list[TableRow]:
    kind, rows = versus if versus in (ITSELF, TRUTH) else ENGINE, []
    with np.errstate(over="ignore", invalid="ignore"):  # a disk thrown far out gives inf or nan
        for name, metric in METRICS.items():
            if kind in metric.against and (value := metric.of(view)) is not None:
                judged = value if len(view.played) > 1 else not_judged("the start alone")
                rows.append(table_row(run, name, judged, metric.unit, versus))
    return rows


def table_row(
    run: Run, metric: str, value: Value, unit: str, versus: str, bound: float = np.nan
) -> TableRow:
    """The row of one number of a run; what is judged and no number is infinitely far off."""
    number = np.inf if value.judged and np.isnan(value.value) else value.value
    cell = (run.scenario, run.engine, run.profile, run.dt)
    return (*cell, metric, value.disk, number, unit, versus, value.at, value.note, bound)


def verdict_row(run: Run, verdict: Verdict) -> TableRow:
    """The row of one verdict on a run; the note has the second disk, or the wall."""
    disk, *others = verdict.disks or (-1,)
    note = ", ".join(f"with disk {k}" if k >= 0 else f"with wall {-1 - k}" for k in others)
    value = Value(verdict.value, disk, verdict.at, note)
    return table_row(run, verdict.id, value, verdict.unit, ITSELF, verdict.bound)


def status_row(run: Run, reason: str, versus: str = ITSELF) -> TableRow:
    return table_row(run, "status", Value(np.nan, note=reason, judged=False), "", versus)


def table_of(rows: Sequence[TableRow]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=list(COLUMNS))
