"""All scenes of a run at once: the score of every run, and the chart of medians by situation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.verdicts import failures
from crosscheck2d.reports.compare.view import LEAST_SHARE, NOT_JUDGED
from crosscheck2d.reports.page import situations, style
from crosscheck2d.reports.page.charts import ChartLine, Drawing, figure_of
from crosscheck2d.scenarios.model import Array

KEY = "pooled"  # of their figures in the page
# times the errors at the neighbouring step sizes: more says where collisions fall in a step
FLUKE = 5.0
ERROR, ANGLE = "position_max_radii", "angle_max"
SCORES = ["scenario", "name", "error", "angle", "dt_s", "step_size", "middle"]


def scores(comparisons: Sequence[Comparison]) -> pd.DataFrame:
    """A row for each run of a scene that is scored: columns `SCORES`.

    error (radii) and angle (rad) are the largest of any disk in any sample, inf without a result
    or where a verdict fails; a scene without exact answer has rows only of the runs that fail one.
    step_size counts from the coarsest, dt_s is its length, middle: whether it is the middle step
    size. A scene that a solver's own file refuses has no row for that file.
    """
    rows: list[tuple[str, str, float, float, float, int, bool]] = []
    for comparison in comparisons if any(map(scored, comparisons)) else ():
        table, scenario = comparison.table, comparison.scenario.name
        judged = table[(table.versus == style.TRUTH) & table.metric.isin([ERROR, ANGLE])]
        judged = judged[~judged.note.astype(str).str.startswith(NOT_JUDGED)]
        keys = zip(judged.engine + ":" + judged.profile, judged.dt_s, judged.metric)
        found = dict(zip(keys, judged.value.to_numpy(float)))
        steps = sorted({run.dt for run in comparison.runs}, reverse=True)
        failed = failures(table)
        for run in comparison.runs:
            fails = (run.name, run.dt) in failed
            if (run.name.endswith(OWN) and run.status == "unsupported") or not (
                fails or scored(comparison)
            ):
                continue
            error, angle = (
                np.inf if fails else float(found.get((run.name, run.dt, each), np.inf))
                for each in (ERROR, ANGLE)
            )
            middle = run.dt == comparison.middle_dt
            step_size = steps.index(run.dt)
            rows.append((scenario, run.name, error, angle, run.dt, step_size, middle))
    return pd.DataFrame(rows, columns=SCORES).astype({"middle": bool})


def scored(comparison: Comparison) -> bool:
    """Whether a scene has an exact answer for at least `LEAST_SHARE` of its samples after the
    start: before that, the disks of a pile have met nothing."""
    truth, intervals = comparison.truth, comparison.scenario.intervals
    return truth is not None and len(truth) - 1 >= max(1.0, LEAST_SHARE * intervals)


def flukes(found: pd.DataFrame) -> list[tuple[str, str]]:
    """(scenario, `engine:profile`) of the `scores` at the middle step size that are more than
    `FLUKE` times those at both neighbouring ones, and wrong."""
    marked = []
    for (scenario, name), group in found.groupby(["scenario", "name"], sort=False):
        group = group.sort_values("step_size")
        errors, k = group.error.to_numpy(), int(np.argmax(group.middle.to_numpy()))
        between = 0 < k < len(errors) - 1
        least = max(situations.RIGHT, FLUKE * max(errors[k - 1], errors[k + 1])) if between else 0
        if between and least < errors[k] < np.inf:
            marked.append((str(scenario), str(name)))
    return marked


def drawings(
    found: pd.DataFrame, answers: Sequence[situations.Recommendation], untrusted: Set[str]
) -> dict[str, Drawing]:
    """The chart of `scores` without the engines in `untrusted`; {} if there is nothing to draw."""
    trusted = found[~found.name.isin(untrusted)]
    return {"situations": by_situation(trusted, answers)} if answers else {}


def with_marks(drawings: Mapping[str, Drawing]) -> list[str]:
    """The engines that have a mark in one of the charts."""
    traces = [t for drawing in drawings.values() if drawing.figure for t in drawing.figure["data"]]
    return [t["name"] for t in traces if any(y is not None and np.isfinite(y) for y in t["y"])]


def by_situation(found: pd.DataFrame, answers: Sequence[situations.Recommendation]) -> Drawing:
    """A column for each situation, with a mark for each engine at the median of its errors."""
    names = list(dict.fromkeys(found.name))
    middle = found[found.middle]
    lines = []
    for k, name in enumerate(names):
        mine = middle[middle.name == name].set_index("scenario")
        errors = [mine[column_of(answer)].reindex(answer.scenes) for answer in answers]
        medians = [float(each.median()) for each in errors]
        y: Array = np.where(np.isfinite(medians), medians, np.nan)
        x = np.arange(len(answers), dtype=np.float64) + (k - (len(names) - 1) / 2) * 0.7 / max(
            len(names), 1
        )
        lines.append(ChartLine(named(name), x, y))
    axis = {
        "title": "",
        "tickvals": list(range(len(answers))),
        "ticktext": [answer.title.replace(" ", "<br>") for answer in answers],
        "range": [-0.5, len(answers) - 0.5],
    }
    figure = figure_of(
        lines, axis, "error (radii)", markers=len(answers), mode="markers", height=340
    )
    # for the file of its numbers: a mark stands beside the middle of its column
    figure["layout"]["meta"] = {"of": "situation", "columns": [answer.title for answer in answers]}
    return Drawing(
        "Error by situation",
        "Each mark is an engine: the median over the scenes of its largest position error at the"
        " middle step size. For Spin it is the largest error of angle in rad, which is how far a"
        " point on the rim is off, in radii. Lower is better. No mark: it fails in half of the"
        " scenes.",
        figure,
    )


def column_of(answer: situations.Recommendation) -> str:
    """The column of `SCORES` with the errors of a situation."""
    return "angle" if answer.unit == "rad" else "error"


def named(name: str) -> Run:
    """A run with the name of an engine, which determines its look."""
    engine, profile = name.split(":", 1)
    return Run(engine, profile, "", 0.0)
