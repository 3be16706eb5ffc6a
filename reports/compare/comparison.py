"""Runs of one scenario set against the truth and against each other, as one tidy table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from adapters.engine_row import FLOAT64
from adapters.engines import ENGINES
from adapters.run import Run
from reports.compare.delays import Jumps, jumps_of
from reports.compare.faces import SAME, interval
from reports.compare.metrics import METRICS
from reports.compare.view import Value, View, not_judged
from scenarios.model import Collisions, Scenario, Trajectory
from scenarios.no_truth import NoTruth

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


@dataclass(frozen=True, eq=False)
class Comparison:
    """One scenario, all that was played of it, and what came out.

    Attributes:
        scenario: the question.
        truth: the exact answer up to its horizon, or None.
        runs: every run, failed and refused ones too, in the order of `ENGINES`, coarse dt first.
        table: one number a row, columns `COLUMNS`.
    """

    scenario: Scenario
    truth: Trajectory | None
    runs: Sequence[Run]
    table: pd.DataFrame

    @property
    def middle_dt(self) -> float:
        """s, the step size in the middle of the ladder: where a scenario is read when one must be
        chosen."""
        return self.scenario.dt(self.scenario.substeps[len(self.scenario.substeps) // 2])

    @property
    def middle_runs(self) -> list[Run]:
        """The runs at the middle dt, failed ones too."""
        return [run for run in self.runs if run.dt == self.middle_dt]


def compare(scenario: Scenario, runs: Sequence[Run]) -> Comparison:
    """Every metric of every run against the laws, the truth and every other engine at the same
    dt."""
    scenario, truth = answered(scenario)
    jumps = None if truth is None else jumps_of(truth, scenario)
    rows: list[tuple] = []
    for run in runs:
        # what it played before it failed is kept in its file, but earns no score
        if run.status != "ok":
            rows.append(
                _row(run, "status", Value(np.nan, note=f"{run.status}: {run.reason}"), "", "itself")
            )
            continue
        for versus, other in _opponents(run, runs, truth):
            rows += _measure(scenario, run, versus, other, jumps if versus == "truth" else None)
    return Comparison(scenario, truth, tuple(runs), pd.DataFrame(rows, columns=list(COLUMNS)))


def answered(scenario: Scenario) -> tuple[Scenario, Trajectory | None]:
    """The scenario and its truth at its samples; where there is none, the scenario says why."""
    if scenario.truth is None:
        return scenario, None
    try:
        return scenario, scenario.truth(scenario.times)
    except NoTruth as refusal:
        return replace(scenario, truth=None, without_truth=str(refusal)), None


def _opponents(
    run: Run, runs: Sequence[Run], truth: Trajectory | None
) -> Iterator[tuple[str, Trajectory | None]]:
    """What a run is set against: the laws, the truth, and each engine that stands after it in the
    list."""
    yield "itself", None
    if truth is not None:
        yield "truth", truth
    for other in runs[runs.index(run) + 1 :]:
        if other.dt == run.dt and other.name != run.name and other.status == "ok":
            yield other.name, other.trajectory


def _measure(
    scenario: Scenario, run: Run, versus: str, other: Trajectory | None, jumps: Jumps | None
) -> list[tuple]:
    assert run.trajectory is not None
    kind = versus if versus in ("itself", "truth") else "engine"
    k = len(run.trajectory) if other is None else min(len(run.trajectory), len(other))
    # a solver's file keeps float64
    rounding = ENGINES[run.name].rounding if run.name in ENGINES else FLOAT64
    view = View(
        scenario,
        run.dt,
        cut(run.trajectory, k),
        None if other is None else cut(other, k),
        jumps,
        rounding,
    )
    rows = []
    # what was thrown far enough overflows; the value says so
    with np.errstate(over="ignore", invalid="ignore"):
        for name, metric in METRICS.items():
            if kind in metric.against and (value := metric.of(view)) is not None:
                rows.append(
                    _row(
                        run,
                        name,
                        value if k > 1 else not_judged("the start alone"),
                        metric.unit,
                        versus,
                    )
                )
    return rows


def cut(trajectory: Trajectory, k: int) -> Trajectory:
    """The first `k` samples and the collisions up to the last of them."""
    if k == len(trajectory):
        return trajectory
    names = ("t", "position", "velocity", "angle", "angular_velocity")
    collisions = trajectory.collisions
    # Steps, and so collisions, lie on the grid of the samples: a collision at the last of them is
    # kept, however it rounds.
    early = collisions.t <= trajectory.t[k - 1] + SAME * interval(trajectory)
    kept = Collisions(
        collisions.t[early], collisions.i[early], collisions.j[early], collisions.impulse[early]
    )
    return replace(
        trajectory, **{name: getattr(trajectory, name)[:k] for name in names}, collisions=kept
    )


def _row(run: Run, metric: str, value: Value, unit: str, versus: str) -> tuple:
    whose = (run.scenario, run.engine, run.profile, run.dt, metric)
    return (*whose, value.disk, value.value, unit, versus, value.at, value.note)  # as `COLUMNS`
