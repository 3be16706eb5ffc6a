"""The first picture of the page: error against cost of all engines, with a summary of three
sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from reports.compare.order import FINEST, NEARER
from reports.compare.pareto import NEAR, front, kept_from
from reports.compare.pooling import POOLED, UNSURE, WHO, middle_half, pooled, without_idle
from reports.page import style
from reports.page.charts import Drawing, broken_axis, decades, marked_break, shortened
from reports.run.timing import Noise, noise_of
from reports.run.timing_pass import BUSY, COLUMNS
from reports.terminal.counts import counted
from scenarios.model import Array

KEY = "error-cost"  # of its figures in the page
TIME, STEPS = "engine time (µs per simulated second)", "steps per simulated second"
ERROR = "largest error (radii)"
TALL = 460  # px
MARGIN = 1 + BUSY  # costs closer than the accepted noise count as equal
GOOD = "#1d8a63"  # the best corner, on a light and on a dark page


class RunTimes(NamedTuple):
    """The times of a run.

    Attributes:
        table: timings.csv.
        noise: the ratios of two timings of one engine.
        asked: the time limit of the timing pass, s.
    """

    table: pd.DataFrame
    noise: Noise
    asked: float

    @property
    def fault(self) -> str:
        """Why no time is shown, as a sentence; "" if times are shown."""
        if not self.asked:
            return "This run took no times (--timings 0)."
        if self.table.empty or not self.noise.pairs:
            return f"The engines could not be timed within {self.asked:g} s."
        if self.noise.floor > BUSY:
            return (
                "The machine was busy: an engine timed twice differs from itself by"
                f" {style.number(100 * self.noise.floor, 2)} %, so no times are shown."
            )
        return ""


NO_CLOCK = RunTimes(pd.DataFrame(columns=COLUMNS), noise_of([]), 0.0)


class ErrorCost(NamedTuple):
    """What the page shows.

    Attributes:
        drawings: scenario, or `POOLED` -> its picture. sentences: three, on speed and error, or two
        on error.
        fault: why there are no times, or "".
        caption: what a point shows.
        costs: a row for each engine, see `costs_of`; empty without times.
    """

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
    return ErrorCost(drawings, said, clock.fault, caption(len(scenes), clock), costs)


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
        said += (
            f", over {scenes} scenes that need different things: the geometric mean without the"
            " best and the worst quarter"
        )
    left = "fewer steps" if clock.fault else "cheaper"
    said += (
        f". Lower is nearer to the exact answer, further left is {left}. A dotted line that ends in"
        " a cross: smaller steps bring this engine no nearer, so an error below it is not reached"
        " at any step size."
    )
    if clock.fault:
        return said
    least, most = int(clock.table.rounds.min()), int(clock.table.rounds.max())
    rounds = f"{least} to {most} interleaved rounds" if least < most else counted(most, "round")
    return (
        f"{said} The light mark left of a point is the cost without the calls from Python: the cost"
        " of as many steps in a world in which nothing moves is taken off. Times are medians of"
        f" {rounds}; an engine timed twice differs from itself by"
        f" {style.number(100 * clock.noise.floor, 2)}\u00a0%."
    )


def points(scores: pd.DataFrame, clock: RunTimes) -> pd.DataFrame:
    """A row for each scenario, engine and step size that was timed, or without times for each that
    was played: error in radii, and the columns of `with_times`; without times the cost is the
    number of steps per simulated second.
    """
    found = with_times(scores, clock).assign(failed=(~np.isfinite(scores.error)).to_numpy(int))
    if clock.fault:
        played = found.error.map(np.isfinite)
        return found.assign(cost=(1 / found.dt_s).where(played), idle=0.0)
    timed = found[found.scenario.isin(clock.table.scenario)]
    return timed.assign(idle=timed.idle.where(timed.cost.notna(), 0.0))


def with_times(scores: pd.DataFrame, clock: RunTimes) -> pd.DataFrame:
    """The rows of `scores` with engine, profile, cost and idle (what of it is the binding's), in µs
    per simulated second, and read, µs of a read-out: nan where that was not timed, or where no time
    is shown."""
    names = scores.name.str.split(":", n=1)
    keys = ["scenario", *WHO, "dt_s"]
    times = clock.table.head(0 if clock.fault else len(clock.table)).rename(
        columns={"cost_us_per_s": "cost", "binding_us_per_s": "idle", "read_us": "read"}
    )
    numbers = ["dt_s", "cost", "idle", "read"]
    times = times[[*keys, *numbers[1:]]].astype(dict.fromkeys(numbers, float))
    found = scores.assign(engine=names.str[0], profile=names.str[1]).astype({"dt_s": float})
    return found.merge(times, on=keys, how="left")


def picture(table: pd.DataFrame, axis: str) -> go.Figure:
    """Error against cost: a line for each engine over its step sizes."""
    drawn = table[table.cost.notna() & np.isfinite(table.error)]
    costs, errors = (drawn[column].to_numpy(float) for column in ("cost", "error"))
    x_axis: dict[str, Any] = {"title": axis} | decades(np.append(costs, 1.0))
    x_axis["range"] = cost_range(np.append(costs, bare(drawn)))
    broken, floor = (
        broken_axis(errors, FINEST) if (errors >= FINEST).any() else (decades(errors), 0)
    )
    y_axis = {"title": ERROR} | broken
    top = room_above(y_axis) if not np.isfinite(table.error).all() else np.nan
    traces: list[dict[str, Any]] = []
    for engine, profile, group in by_engine(table):
        traces += traces_of(engine, profile, group, floor, top, x_axis["range"])
    layout: dict[str, Any] = {
        "hovermode": "closest",
        "xaxis": x_axis,
        "yaxis": y_axis,
        "height": TALL,
    }
    layout |= marked_break(y_axis, floor) if floor > 0 else {}
    return go.Figure(
        traces,
        layout
        | best_corner(
            layout.get("shapes", []), "near and cheap" if axis == TIME else "near in few steps"
        ),
    )


def cost_range(costs: Array) -> list[float]:
    """The range of a log axis for costs."""
    if not len(costs):
        return [0.0, 1.0]
    return [float(np.log10(costs.min())) - 0.25, float(np.log10(costs.max())) + 0.35]


def room_above(axis: dict[str, Any]) -> float:
    """Make room above a log axis for points without a result, and return the value there."""
    level = axis["range"][1] + 0.3
    axis["range"] = [axis["range"][0], level + 0.3]
    axis["tickvals"] = [*axis["tickvals"], 10**level]
    axis["ticktext"] = [*axis["ticktext"], "failed"]
    return float(10**level)


def best_corner(shapes: Sequence[Any], says: str) -> dict[str, Any]:
    """The layout that marks where an engine should be: lower left."""
    paper = {"xref": "paper", "yref": "paper"}
    corner = {
        "type": "path",
        "path": "M0,0 L0.24,0 C0.24,0.17 0.13,0.3 0,0.3 Z",
        "layer": "below",
        "fillcolor": GOOD,
        "opacity": 0.13,
        "line": {"width": 0},
    }
    text = {
        "text": f"<b>best</b><br>{says}",
        "x": 0.012,
        "y": 0.02,
        "xanchor": "left",
        "yanchor": "bottom",
        "align": "left",
        "showarrow": False,
        "font": {"size": 12, "color": GOOD},
    }
    return {"shapes": [*shapes, corner | paper], "annotations": [text | paper]}


def traces_of(
    engine: str, profile: str, group: pd.DataFrame, floor: float, top: float, x_range: list[float]
) -> Iterator[dict[str, Any]]:
    """The traces of one engine: light marks, line, errors that it does not reach, failures."""
    look = style.look(engine, profile)
    name = f"{engine}:{profile}"
    fine = group[group.cost.notna() & np.isfinite(group.error)].sort_values("step_size")
    common = {"type": "scatter", "name": name, "cliponaxis": False}
    cost, height = fine.cost.to_numpy(float), np.maximum(fine.error.to_numpy(float), floor)
    left = bare(fine)
    if (left < cost).any():
        yield light_marks(engine, profile, cost, left, height)
    yield common | {
        "mode": "lines+markers",
        "x": shortened(cost),
        "y": shortened(height),
        "text": [said_of(row) for row in fine.to_dict("records")],
        "customdata": shortened(fine.error.to_numpy(float), 3),
        "hovertemplate": "%{text}",
        "line": {"color": look.light, "dash": look.plotly_dash, "width": 1.9},
        "marker": {"symbol": look.symbol, "size": 10, "color": look.light},
    }
    if no_nearer(fine):
        k = int(np.argmin(height))
        yield common | {
            "mode": "lines+markers",
            "x": shortened([cost[k], 10 ** (x_range[1] - 0.06)]),
            "y": shortened([height[k]] * 2),
            "hoverinfo": "skip",
            "opacity": 0.7,
            "line": {"color": look.light, "dash": "1px,4px", "width": 1.3},
            "marker": {
                "symbol": "x-thin",
                "size": [0, 9],
                "line": {"color": look.light, "width": 2},
            },
        }
    lost = group[~np.isfinite(group.error)]
    if len(lost):
        others = fine.cost / 2.0**fine.step_size
        place = float(others.median()) if len(fine) else 10 ** x_range[1]
        at = np.clip(place * 2.0**lost.step_size, 10 ** x_range[0], 10 ** (x_range[1] - 0.1))
        yield common | {
            "mode": "markers",
            "x": shortened(at),
            "y": [top] * len(lost),
            "text": [f"{name}: failed"] * len(lost),
            "customdata": [None] * len(lost),  # neither cost nor error: both are only places
            "hovertemplate": "%{text}",
            "marker": {"symbol": look.symbol, "size": 10, "color": look.light},
        }


def light_marks(
    engine: str, profile: str, cost: Array, left: Array, height: Array
) -> dict[str, Any]:
    """A trace of marks where the points would be without the cost of calls from Python, each with a
    thin line to its point."""
    look = style.look(engine, profile)
    return {
        "type": "scatter",
        "name": f"{engine}:{profile}",
        "mode": "markers",
        "x": shortened(left),
        "y": shortened(height),
        "opacity": 0.35,
        "hoverinfo": "skip",
        "showlegend": False,
        "marker": {"symbol": look.symbol, "size": 7, "color": look.light},
        "error_x": {
            "type": "data",
            "symmetric": False,
            "array": shortened(cost - left),
            "arrayminus": [0.0] * len(left),
            "thickness": 1,
            "width": 0,
            "color": look.light,
        },
    }


def bare(found: pd.DataFrame) -> Array:
    """µs per simulated second without the binding's part, of a scene or pooled."""
    cost = found.cost.to_numpy(float)
    left = (
        found.bare.to_numpy(float) if "bare" in found else without_idle(cost, found.idle.to_numpy())
    )
    return np.where(np.isfinite(left), left, cost)


def by_engine(table: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """(engine, profile, its rows), in the order of appearance."""
    for (engine, profile), group in table.groupby(WHO, sort=False):
        yield str(engine), str(profile), group


def said_of(row: Mapping[Any, Any]) -> str:
    """The text shown on hovering over a point."""
    name = f"{row['engine']}:{row['profile']}"
    step = f", dt {style.number(row['dt_s'])} s" if np.isfinite(row["dt_s"]) else ""
    lines = [f"{name}{step}", f"error {style.number(row['error'])} radii"]
    if row["scenario"] == POOLED:
        lines[0] += f", step size {int(row['step_size']) + 1} of each scene"
        lines[0] += f", over {counted(int(row['of']), 'scene')}"  # fewer, if it refused some
    part = row["cost"] - row.get("bare", np.nan) if row["scenario"] == POOLED else row["idle"]
    if part > 0:
        lines.append(
            f"{style.number(row['cost'])} µs/s, of which the binding {style.number(part)} µs/s"
        )
    if np.isfinite(row.get("read", np.nan)):
        lines.append(f"a read-out {style.number(row['read'])} µs")
    return "<br>".join(lines)


def no_nearer(fine: pd.DataFrame) -> bool:
    """Whether the error of an engine falls by less than a tenth from the coarsest to the finest
    step, and is not yet below `FINEST`."""
    error = fine.error.to_numpy(float)
    return len(error) > 1 and error[-1] > max(FINEST, NEARER * error[0])


def sentences(found: pd.DataFrame, table: pd.DataFrame, fault: str) -> list[str]:
    """Three sentences on error and cost: the engines that no other beats in both, the cheapest for
    an error of `NEAR` radii, the effect of halving the step. Without times two, on errors.

    table: the points of the first picture; `found` has those scene by scene.
    """
    if fault:
        return [nearest(table), halving(table, False)]
    return [unbeaten(table), cheapest(found), halving(table, True)]


def unbeaten(table: pd.DataFrame) -> str:
    """The engines for which no other is both nearer and cheaper; and those that would join them
    without the binding's part."""
    rows = table[table.cost.notna() & np.isfinite(table.error)]
    rows = rows.assign(name=rows.engine + ":" + rows.profile, bare=bare(rows))
    if rows.empty:
        return "No engine has both a time and an error."
    best, joining = front_of(rows)
    rest = rows[~rows.name.isin(rows.name[rows.error <= FINEST])]
    others, joining_others = front_of(rest)
    said = (
        f"No engine is both nearer to the exact answer and cheaper, per simulated second, than"
        f" {', '.join(best)}."
    )
    if len(rest) < len(rows) and others:
        said += f" Of those that are not right to a millionth of a radius: {', '.join(others)}."
    if names := list(dict.fromkeys([*joining, *joining_others])):
        said += f" If calls from Python cost nothing, {', '.join(names)} would be unbeaten as well."
    return said


def front_of(rows: pd.DataFrame) -> tuple[list[str], list[str]]:
    """The engines on the Pareto front, each with error and cost of its cheapest point there; and
    the names of those that only the binding's part keeps off it."""
    error = np.maximum(rows.error.to_numpy(float), FINEST)
    cost, names = rows.cost.to_numpy(float), rows.name.tolist()
    best: dict[str, str] = {}
    for k in front(cost, error):
        numbers = style.number(rows.error.iloc[k], 2), style.number(cost[k], 2)
        best.setdefault(names[k], f"{numbers[0]} radii for {numbers[1]} µs")
    bare_best = dict.fromkeys(names[k] for k in front(rows.bare.to_numpy(float), error))
    joining = [name for name in bare_best if name not in best]
    return [f"{name} ({numbers})" for name, numbers in best.items()], joining


def cheapest(found: pd.DataFrame) -> str:
    """The engine of least cost for an error of `NEAR` radii, scene by scene, each at its cheapest
    step size; none where only the binding decides."""
    wins: dict[str, list[float]] = {}
    even = 0
    scenes = list(dict.fromkeys(found.scenario))
    for scene in scenes:
        ways = [
            way
            for _, _, group in by_engine(found[found.scenario == scene])
            for way in cheapest_step(group)
        ]
        if not ways:
            continue
        name, cost, left = min(ways, key=lambda way: way[1])
        rivals = [other for other in ways if other[0] != name]
        if all(surely_less((cost, left), (c, b)) for _, c, b in rivals):
            wins.setdefault(name, []).append(cost)
        else:
            even += 1
    if not wins and not even:
        return f"No engine keeps within {NEAR:g} radii in any of {counted(len(scenes), 'scene')}."
    of = f"Of {counted(len(scenes), 'scene')}"
    if not wins:
        return f"{of}, in none one engine is clearly the cheapest within {NEAR:g} radii."
    parts = [
        f"{name} in {len(costs)} ({style.number(middle_half(np.array(costs)), 2)} µs)"
        for name, costs in sorted(wins.items(), key=lambda item: -len(item[1]))
    ]
    parts += [f"none clearly in {even}"] if even else []
    nowhere = len(scenes) - even - sum(map(len, wins.values()))
    parts += [f"none reaches that in {nowhere}"] if nowhere else []
    return (
        f"{of}, the cheapest engine with an error of at most {NEAR:g} radii is {', '.join(parts)}."
        " Without the cost of calls from Python these are the same."
    )


def surely_less(mine: tuple[float, float], theirs: tuple[float, float]) -> bool:
    """Whether one (cost, cost without the binding's part) is less than another in both numbers, by
    more than their noise."""
    (cost, left), (other, other_left) = mine, theirs
    return MARGIN * cost < other and left + UNSURE * cost < other_left - UNSURE * other


def cheapest_step(group: pd.DataFrame) -> Iterator[tuple[str, float, float]]:
    """(name, cost, cost without the binding's part) of the cheapest step size from which on the
    error is at most `NEAR`; empty if there is none."""
    group = group.sort_values("step_size")
    held = group[kept_from(group.error.to_numpy(float), NEAR) & group.cost.notna().to_numpy()]
    if len(held):
        k = int(np.argmin(held.cost.to_numpy(float)))
        row = held.iloc[k]
        yield f"{row.engine}:{row.profile}", float(row.cost), float(bare(held)[k])


def nearest(table: pd.DataFrame) -> str:
    """The engines nearest to the exact answer at the finest step size, and the farthest."""
    finest = table[table.step_size == table.step_size.max()].sort_values("error", kind="stable")
    finest = finest[np.isfinite(finest.error)]
    if finest.empty:
        return "No engine was played to its end."
    said = [
        f"{row['engine']}:{row['profile']} ({style.number(row['error'], 2)} radii)"
        for row in finest.to_dict("records")
    ]
    last = f", last {said[-1]}" if len(said) > 3 else ""
    return (
        f"Nearest to the exact answer at the smallest step size: {', then '.join(said[:3])}{last}."
    )


def halving(table: pd.DataFrame, timed: bool) -> str:
    """The mean effect of halving the step on time and error, from the coarsest to the finest step,
    and the engines whose error it does not reduce. (A single halving may do more, or increase the
    error.)"""
    dearer, nearer, stuck = [], [], []
    for engine, profile, group in by_engine(table):
        fine = group[group.cost.notna() & np.isfinite(group.error)].sort_values("step_size")
        error, cost = fine.error.to_numpy(float), fine.cost.to_numpy(float)
        if len(fine) < 2 or error[0] <= FINEST:
            continue
        halvings = fine.step_size.iloc[-1] - fine.step_size.iloc[0]
        if no_nearer(fine):
            stuck.append(f"{engine}:{profile}")
        else:
            dearer.append((cost[-1] / cost[0]) ** (1 / halvings))
            nearer.append((error[0] / max(error[-1], FINEST)) ** (1 / halvings))
    if not nearer and not stuck:
        return "At every step size all engines are right to a millionth of a radius."
    spent = ", at more cost" if timed else ""
    lost = f"bring{{}} {', '.join(stuck)} no nearer to the exact answer{spent}."
    if not nearer:
        return f"Smaller steps {lost.format('')}"
    costs = f"multiplies the time by {span(dearer)} and " if timed else ""
    said = f"On average half the step {costs}divides the error by {span(nearer)}"
    return (
        f"{said}; it {lost.format('s')}" if stuck else f"{said}, for every engine that takes steps."
    )


def span(ratios: Sequence[float]) -> str:
    """The range of the ratios as text."""
    low, high = f"{min(ratios):.1f}", f"{max(ratios):.1f}"
    return low if low == high else f"{low} to {high}"
