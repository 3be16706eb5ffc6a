"""All scenes of a run at once: the score of every run, and two charts of their medians."""

from __future__ import annotations

from collections.abc import Sequence, Set

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from adapters.play import Run
from reports.compare.comparison import Comparison
from reports.compare.view import NOT_JUDGED
from reports.page import situations, style
from reports.page.charts import ChartLine, Drawing, figure_of

KEY = "pooled"  # of their figures in the page
ERROR, ANGLE = "position_max_radii", "angle_max"
SCORES = [*situations.COLUMNS, "step_size", "middle"]


def scores(comparisons: Sequence[Comparison]) -> pd.DataFrame:
    """A row a run of a scene with an exact answer: columns `SCORES`.

    error (radii) and angle (rad) are the largest of any disk in any sample, inf without a result;
    cost is µs of engine time per simulated second, nan without one; step_size counts from the
    coarsest, middle says whether it is the one in the middle of the ladder.
    """
    rows = []
    for comparison in comparisons:
        # a truth that is lost before its second sample has only the start, which is given to all
        if comparison.truth is None or len(comparison.truth) < 2:
            continue
        table, scenario = comparison.table, comparison.scenario
        judged = table[(table.versus == style.TRUTH) & table.metric.isin([ERROR, ANGLE])]
        judged = judged[~judged.note.astype(str).str.startswith(NOT_JUDGED)]
        found = {
            (f"{row.engine}:{row.profile}", row.dt_s, row.metric): row.value
            for row in judged.itertuples()
        }
        steps = sorted({run.dt for run in comparison.runs}, reverse=True)
        for run in comparison.runs:
            error, angle = (found.get((run.name, run.dt, each), np.inf) for each in (ERROR, ANGLE))
            cost = run.seconds / scenario.duration * 1e6 if np.isfinite(error) else np.nan
            middle = run.dt == comparison.middle_dt
            rows.append((scenario.name, run.name, error, angle, cost, steps.index(run.dt), middle))
    return pd.DataFrame(rows, columns=SCORES)


def drawings(
    found: pd.DataFrame, answers: Sequence[situations.Answer], untrusted: Set[str]
) -> dict[str, Drawing]:
    """Error by situation and error against engine time, from `scores`; {} if there are none."""
    found = found[~found.name.isin(untrusted)]
    if found.empty:
        return {}
    return {"situations": by_situation(found, answers), "cost": against_time(found)}


def by_situation(found: pd.DataFrame, answers: Sequence[situations.Answer]) -> Drawing:
    """A place a situation, a mark an engine at the median of its errors."""
    names = list(dict.fromkeys(found.name))
    middle = found[found.middle]
    lines = []
    for k, name in enumerate(names):
        mine = middle[middle.name == name].set_index("scenario")
        medians = [
            float(mine[column_of(answer)].reindex(answer.scenes).fillna(np.inf).median())
            for answer in answers
        ]
        y = np.where(np.isfinite(medians), medians, np.nan)
        x = np.arange(len(answers)) + (k - (len(names) - 1) / 2) * 0.7 / max(len(names), 1)
        lines.append(ChartLine(named(name), x, y))
    axis = {
        "title": "",
        "tickvals": list(range(len(answers))),
        "ticktext": [answer.title.replace(" ", "<br>") for answer in answers],
        "range": [-0.5, len(answers) - 0.5],
    }
    figure = figure_of(lines, axis, "error (radii)", unit="", mode="markers", height=340)
    return Drawing(
        "Error by situation",
        "A mark is an engine: the median over the scenes of its largest position error at the"
        " middle step size; of Spin its largest error of angle in rad, which is what a point on the"
        " rim is off in radii. Lower is better. No mark: no result in half of the scenes.",
        figure,
    )


def column_of(answer: situations.Answer) -> str:
    """Which column of `SCORES` its errors are."""
    return "angle" if answer.unit == "rad" else "error"


def against_time(found: pd.DataFrame) -> Drawing:
    """A line an engine over the step sizes that all scenes have."""
    steps = int(found.groupby("scenario").step_size.max().min())
    pooled = found[found.step_size <= steps].groupby(["name", "step_size"], sort=False)
    medians = pooled[["error", "cost"]].median().reset_index()
    lines = []
    for name in dict.fromkeys(found.name):
        mine = medians[(medians.name == name) & np.isfinite(medians.error)]
        mine = mine.sort_values("step_size")
        if len(mine):
            lines.append(
                ChartLine(named(name), mine.cost.to_numpy(float), mine.error.to_numpy(float))
            )
    axis = {"title": "engine time (µs per simulated second)", "type": "log"}
    figure: go.Figure | None = (
        figure_of(lines, axis, "error (radii)", unit="µs", height=340) if lines else None
    )
    return Drawing(
        "Error against engine time",
        f"A point is one of {steps + 1} step sizes, each of its coordinates the median of"
        f" {found.scenario.nunique()} scenes; smaller steps to the right. Down and left is better."
        " Times are of this run, in which several processes shared the machine: they tell factors,"
        " not percents. crosscheck speed measures them alone.",
        figure,
    )


def named(name: str) -> Run:
    """A run that carries an engine's name, which decides how it is drawn."""
    engine, profile = name.split(":", 1)
    return Run(engine, profile, "", 0.0)
