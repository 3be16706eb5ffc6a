"""Compare the runs of one scenario with the truth and with each other, in one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.against import ENGINE, ITSELF, TRUTH
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.table import (
    TableRow,
    deviation_row,
    status_row,
    table_of,
    verdict_row,
)
from crosscheck2d.reports.compare.verdicts import verdicts_on
from crosscheck2d.reports.compare.view import View, beside, not_judged
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import answered


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
    """A row for each metric that applies."""
    kind, rows = versus if versus in (ITSELF, TRUTH) else ENGINE, []
    with np.errstate(over="ignore", invalid="ignore"):  # a disk thrown far out gives inf or nan
        for name, metric in METRICS.items():
            if kind in metric.against and (value := metric.of(view)) is not None:
                judged = value if len(view.played) > 1 else not_judged("the start alone")
                rows.append(deviation_row(run, name, judged, metric.unit, versus))
    return rows
