"""The first picture of the page: error against cost of all engines, with a summary of three
sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.reports.compare.pooling import POOLED, WHO, pooled
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.charts import Drawing
from crosscheck2d.reports.page.cost_picture import STEPS, TIME, picture
from crosscheck2d.reports.page.cost_points import RunTimes, bare, by_engine, points
from crosscheck2d.reports.page.cost_sentences import sentences
from crosscheck2d.reports.terminal.counts import counted

KEY = "error-cost"  # of its figures in the page


class ErrorCost(NamedTuple):
    """What the page shows.

    Attributes:
        names: the engines that have a point, or a failure, in one of the pictures.
        drawings: scenario, or `POOLED` -> its picture.
        sentences: three, on speed and error, or two on error.
        fault: why there are no times, or "".
        caption: what a point shows.
        costs: a row for each engine, see `costs_of`; empty without times.
    """

    names: Sequence[str]
    drawings: Mapping[str, Drawing]
    sentences: Sequence[str]
    fault: str
    caption: str
    costs: Sequence[Mapping[str, Any]]


def error_cost(scores: pd.DataFrame, clock: RunTimes, untrusted: Set[str]) -> ErrorCost | None:
    """Error against cost from the scores of a run (columns `pooled.SCORES`) and its times, without
    the engines in `untrusted`; None if no scene has an exact answer."""
    trusted = scores[~scores.name.isin(untrusted)]
    found = points(trusted, clock) if len(trusted) else trusted
    if found.empty:
        return None
    scenes = list(dict.fromkeys(found.scenario))
    tables = {scene: found[found.scenario == scene] for scene in scenes}
    if len(scenes) > 1:
        tables = {POOLED: pooled(found)} | tables
    axis = STEPS if clock.fault else TIME
    drawings = {
        scene: Drawing(title_of(scene, len(scenes)), "", picture(table, axis))
        for scene, table in tables.items()
    }
    said = sentences(found, next(iter(tables.values())), clock.fault)
    costs = [] if clock.fault else costs_of(found, next(iter(tables.values())))
    names = list(dict.fromkeys(found.name))
    return ErrorCost(names, drawings, said, clock.fault, caption(len(scenes), clock), costs)


def costs_of(found: pd.DataFrame, table: pd.DataFrame) -> list[dict[str, Any]]:
    """name, cost and bare (without the binding's part; µs per simulated second) of every engine at
    each step size of the first picture, and read: µs of a read-out, median over the scenes."""
    reads = found.groupby(WHO).read.median()
    rows = []
    for engine, profile, group in by_engine(table):
        group = group.sort_values("step_size")
        both = list(zip(group.cost.tolist(), bare(group).tolist()))
        read = float(reads[engine, profile])
        rows.append({"name": f"{engine}:{profile}", "costs": both, "read": read})
    return rows


def title_of(scene: str, scenes: int) -> str:
    """The name of a picture in the picker."""
    return f"all {scenes} scenes" if scene == POOLED else scene


def caption(scenes: int, clock: RunTimes) -> str:
    """The caption."""
    said = "A point is an engine at one step size"
    if scenes > 1:
        said += f": the geometric mean over {scenes} scenes, without the best and the worst quarter"
    left = "fewer steps" if clock.fault else "cheaper"
    said += (
        f". Lower is nearer to the exact answer, further left is {left}. A dotted line that ends in"
        " a cross means that the smallest of these steps brings this engine less than a tenth"
        " nearer than the largest: no step size of this run has an error below the cross."
    )
    if clock.fault:
        return said
    least, most = int(clock.table.rounds.min()), int(clock.table.rounds.max())
    rounds = f"{least} to {most} interleaved rounds" if least < most else counted(most, "round")
    return (
        f"{said} The light mark left of a point is the cost without the calls from Python, which is"
        " measured as the cost of as many steps in a world in which nothing moves. Times are"
        f" medians of {rounds}. Two timings of the same engine differ by"
        f" {style.number(100 * clock.noise.floor, 2)}\u00a0%."
    )
