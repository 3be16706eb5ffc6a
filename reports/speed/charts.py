"""The charts: error against cost, cost at matched accuracy, cost against the number of disks,
options."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.pareto import ACCURACIES, FAILED, front
from crosscheck2d.reports.compare.pooling import without_idle
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.charts import (
    ZERO,
    Figure,
    broken_axis,
    decades,
    marked_break,
    shortened,
    sized,
)
from crosscheck2d.reports.page.cost_picture import light_marks
from crosscheck2d.reports.page.cost_points import by_engine
from crosscheck2d.reports.speed.cheapest import KINDS
from crosscheck2d.scenarios.model import Array

FRONT, FRONT_OF_STEPS = "Pareto front", "Pareto front of those who take steps"
COST, ERROR = "engine time (µs per simulated second)", "error (radii)"
EDGE = 0.55  # decades between the last gridline and what is drawn at the edge
# radii; smaller errors, below a tenth of the finest accuracy asked for, are drawn below a break of
# the axis
LOWEST = 1e-7
TALL, TALLEST, PER_ROW = 400, 520, 19  # px


@dataclass(frozen=True)
class Axes:
    """The axes of a figure, and where on y errors below `LOWEST` are drawn: below a break, if
    `floor` is neither `ZERO` nor `LOWEST`."""

    x: dict[str, Any]
    y: dict[str, Any]
    floor: float = ZERO

    def lifted(self, errors: pd.Series) -> pd.Series:
        """Where errors are drawn."""
        return errors.where(~(errors < LOWEST), self.floor)


def speed(points: pd.DataFrame, tall: bool = False) -> Figure:
    """Error against cost, a line for each engine over its ladder; `points` of one scene, or pooled
    and then `tall`."""
    drawn = points[measured(points)]
    axes = error_axes(np.append(drawn.cost.to_numpy(float), bare(drawn)), drawn.error)
    steps = drawn[~drawn.engine.isin(KINDS)]
    traces = [front_of(drawn, FRONT, 9, axes), front_of(steps, FRONT_OF_STEPS, 3, axes)]
    for engine, profile, group in by_engine(points):
        fine = group[measured(group)]
        height, left = axes.lifted(fine.error), bare(fine)
        if np.isfinite(left).all():
            cost = fine.cost.to_numpy(float)
            traces.append(light_marks(engine, profile, cost, left, height.to_numpy(float)))
        text = [hover_text(row) for row in fine.to_dict("records")]
        trace = line(engine, profile, fine.cost, height, text)
        if not tall:
            low, high = axes.lifted(fine.error_low), axes.lifted(fine.error_high)
            trace["error_x"] = bars(fine.cost, fine.low, fine.high)
            trace["error_y"] = bars(height, low, high)
        trace["customdata"] = shortened(fine.error.to_numpy(float), 3)  # what is saved as CSV
        traces.append(trace)
    traces += at_the_edge(points, axes)
    return figure(traces, axes, TALLEST if tall else TALL)


def measured(points: pd.DataFrame) -> pd.Series:
    """Whether a point has both an error and a cost."""
    has: pd.Series = points.cost.notna() & np.isfinite(points.error)
    return has


def bare(points: pd.DataFrame) -> Array:
    """µs per simulated second without idle steps, of one scene or pooled; nan where that is not
    known."""
    if "bare" in points:
        return points.bare.to_numpy(float)
    return without_idle(points.cost.to_numpy(float), points.idle.to_numpy(float))


def at_the_edge(points: pd.DataFrame, axes: Axes) -> list[dict[str, Any]]:
    """Points without an error, on the upper edge, and without a cost, at their error: at the cost
    extrapolated from the engine's other dts, else at the right edge."""
    lost, drawn = points[~measured(points)], points[measured(points)]
    if lost.empty:
        return []
    top = edge(axes.y, FAILED) if np.isinf(lost.error).any() else np.nan
    corner = 10 ** (axes.x["range"][1] - 0.05)  # just inside the range
    traces = []
    for engine, profile, group in by_engine(lost):
        others = drawn[(drawn.engine == engine) & (drawn.profile == profile)]
        per_step_size = (
            float((others.cost / 2.0**others.step_size).median()) if len(others) else np.nan
        )
        cost = group.cost.where(group.cost.notna(), per_step_size * 2.0**group.step_size)
        x = cost.fillna(corner).clip(upper=corner)
        y = axes.lifted(group.error).where(np.isfinite(group.error), top)
        text = [hover_text(row) for row in group.to_dict("records")]
        traces.append(marks(engine, profile, x, y, text) | {"cliponaxis": False})
    return traces


def front_of(drawn: pd.DataFrame, name: str, width: int, axes: Axes) -> dict[str, Any]:
    """The Pareto front as steps, drawn behind the points: every point above and right of it is
    slower and less accurate than a point on it.

    Errors drawn at the floor of the axes, below `LOWEST`, count as equal.
    """
    cost, error = drawn.cost.to_numpy(float), axes.lifted(drawn.error).to_numpy(float)
    best = front(cost, error)
    x, y = cost[best], error[best]
    if best:
        right, top = 10 ** axes.x["range"][1], 10 ** axes.y["range"][1]
        x, y = np.array([x[0], *x, right]), np.array([top, *y, y[-1]])
    colour = style.look(style.TRUTH).light
    return {
        "type": "scatter",
        "x": shortened(x),
        "y": shortened(y),
        "name": name,
        "mode": "lines+markers",
        "line": {"color": colour, "width": width, "shape": "hv"},
        "opacity": 0.16,
        "hoverinfo": "skip",
        "marker": {
            "color": colour,
            "size": [0, *[20] * len(best), 0],
            "symbol": "circle",
            "line": {"width": 0},
        },
    }


def sweeps(points: pd.DataFrame, relative: bool = False) -> Figure:
    """Error against cost: a line for each sweep over its values, and a line for its engine over a
    ladder of dt.

    relative: both are divided by those of the matched engine, at the dt at which the parameter
        is swept.
    """
    drawn = points[measured(points)]
    cost, error = drawn.cost.to_numpy(float), drawn.error.to_numpy(float)
    axes = (
        Axes(log_axis("time / time as matched", cost), log_axis("error / error as matched", error))
        if relative
        else error_axes(cost, drawn.error)
    )
    traces = []
    for engine, profile, group in by_engine(drawn):
        what = profile.partition("+")[2]
        text = [sweep_hover(what, row, relative) for row in group.to_dict("records")]
        height = group.error if relative else axes.lifted(group.error)
        trace = line(engine, profile, group.cost, height, text)
        if what:  # the first and the last are named
            values = group.change.tolist()
            named = [value if k in (0, len(values) - 1) else "" for k, value in enumerate(values)]
            trace |= {
                "mode": "lines+markers+text",
                "texttemplate": named,
                "textposition": "top center",
            }
            trace["textfont"] = {"color": trace["line"]["color"], "size": 11}
        traces.append(trace)
    traces += at_the_edge(points, axes)
    return figure(traces, axes, TALLEST if relative else TALL)


def sweep_hover(what: str, row: Mapping[Hashable, Any], relative: bool) -> str:
    """The hover text of a point of a sweep; `what` is swept, "" for a ladder of dt."""
    value = f"{what} {row['change']}<br>" if what else ""
    if not relative:
        return value + hover_text(row)
    value = value or f"dt / {2.0 ** (row['step_size'] - 2):g}<br>"
    return (
        f"{value}{style.number(row['cost'])} × the time, {style.number(row['error'])} × the error"
    )


def matched(reached: pd.DataFrame, tall: bool = False) -> Figure:
    """The cost of each accuracy, a mark for each engine; at the top, engines that do not reach
    it."""
    engines = list(by_engine(reached))
    y_axis = log_axis(COST, reached.cost.dropna().to_numpy(float))
    not_down = edge(y_axis, "not yet")
    never = edge(y_axis, "never")
    traces = []
    for k, (engine, profile, group) in enumerate(engines):
        x = np.arange(len(group)) + (k - (len(engines) - 1) / 2) * 0.8 / len(engines)
        y = group.cost.where(group.cost.notna(), np.where(group.lost, never, not_down))
        text = [
            f"{row['accuracy']} of a radius: "
            + (
                row["why"]
                if np.isnan(row["cost"])
                else f"{style.number(row['cost'])} µs/s {at(row)}{row['why']}"
            )
            for row in group.to_dict("records")
        ]
        traces.append(marks(engine, profile, x, y, text))
    x_axis = {
        "title": "accuracy (of a radius)",
        "tickvals": list(range(len(ACCURACIES))),
        "ticktext": list(ACCURACIES),
        "range": [-0.5, len(ACCURACIES) - 0.5],
    }
    return figure(traces, Axes(x_axis, y_axis), TALL if tall else None)


def at(row: Mapping[Hashable, Any]) -> str:
    """ "at dt ..." where there is one."""
    return f"at dt {style.number(row['dt_s'])} s " if np.isfinite(row["dt_s"]) else ""


def sizes(costs: pd.DataFrame, growth: pd.DataFrame) -> Figure:
    """Cost of a step against the number of disks; a cross where an engine was stopped."""
    y_axis = log_axis("engine time (µs per step)", costs.cost.to_numpy(float))
    x_axis = log_axis("disks", np.append(costs.n.to_numpy(float), 10.0))
    traces = []
    stopped = edge(y_axis, "stopped") if (growth.stopped != "").any() else 0.0
    for engine, profile, group in by_engine(costs):
        rows = group.to_dict("records")
        text = [
            f"{row['n']:.0f} disks: {spread(row)} µs a step; the worst {style.number(row['worst'])}"
            for row in rows
        ]
        trace = line(engine, profile, group.n, group.cost, text)
        traces.append(trace | {"error_y": bars(group.cost, group.low, group.high)})
    for row in growth[growth.stopped != ""].to_dict("records"):
        n, why = row["stopped"].split(": ", 1)
        cross = marks(row["engine"], row["profile"], [float(n)], [stopped], [f"{n} disks: {why}"])
        traces.append(cross | {"cliponaxis": False})
    return figure(traces, Axes(x_axis, y_axis), TALL)


def options(table: pd.DataFrame, ratio: str, title: str) -> Figure:
    """A row for each change, a mark for each scene: `ratio` ("cost_ratio", "error_ratio") to the
    unchanged engine, 1: the same; a change that failed the scene stands at the right edge.
    """
    rows = list(dict.fromkeys(zip(table.engine, table.profile, table.change)))[::-1]
    values = table[ratio].to_numpy(float)
    known = np.append(values[np.isfinite(values) & (values > 0)], [0.9, 1.1])
    low, high = np.log10(known.min()) - 0.1, np.log10(known.max()) + 0.1
    ticks = TICKS if high - low < 2 else TICKS[::3]  # on a phone there is no room for more
    x_axis: dict[str, Any] = {
        "title": title,
        "type": "log",
        "range": [low, high],
        "tickvals": ticks,
        "ticktext": [style.number(tick) for tick in ticks],
    }
    failed = edge(x_axis, FAILED) if np.isinf(table.error_radii).any() else np.nan
    y_axis = {
        "title": "",
        "tickvals": list(range(len(rows))),
        "range": [-0.7, len(rows) - 0.3],
        "ticktext": [f"{engine}: {change}" for engine, _, change in rows],
    }
    traces: list[dict[str, Any]] = [
        {
            "type": "scatter",
            "x": [1, 1],
            "y": [-1, len(rows)],
            "mode": "lines",
            "hoverinfo": "skip",
            "name": "no change",
            "line": {"color": style.look(style.TRUTH).light, "width": 1.2, "dash": "dot"},
        }
    ]
    for engine, profile, group in by_engine(table):
        y = [rows.index((engine, profile, change)) for change in group.change]
        x = group[ratio].where(np.isfinite(group[ratio]) & (group[ratio] > 0))
        x = x.where(np.isfinite(group.error_radii), failed)
        text = [
            f"{row['change']}, {row['scenario']}: ×{style.number(row[ratio])}<br>error"
            f" {style.number(row['error_radii'])} radii, unchanged"
            f" {style.number(row['error_radii_plain'])}<br>{spread(row)} µs/s, unchanged"
            f" {style.number(row['cost_plain'])}"
            for row in group.to_dict("records")
        ]
        traces.append(marks(engine, profile, x, y, text))
    return figure(traces, Axes(x_axis, y_axis), 110 + PER_ROW * len(rows))


TICKS = [a * 10.0**b for b in range(-8, 9) for a in (1, 2, 5)]


def line(engine: str, profile: str, x: Any, y: Any, text: Sequence[str]) -> dict[str, Any]:
    """A trace in the style of its engine, with the hover text of each point."""
    look = style.look(engine, profile)
    return {
        "type": "scatter",
        "x": shortened(np.asarray(x, float), 5),
        "y": shortened(np.maximum(np.asarray(y, float), ZERO) if np.size(y) else [], 4),
        "name": f"{engine}:{profile}",
        "mode": "lines+markers",
        "text": list(text),
        "hovertemplate": "%{text}",
        "line": {"color": look.light, "dash": look.plotly_dash, "width": 1.7},
        "marker": {"symbol": look.symbol, "size": 9, "color": look.light},
    }


def marks(engine: str, profile: str, x: Any, y: Any, text: Sequence[str]) -> dict[str, Any]:
    """The same without the line between its points."""
    return line(engine, profile, x, y, text) | {"mode": "markers"}


def bars(middle: Any, low: Any, high: Any) -> dict[str, Any]:
    """Thin bars from low to high; none where there is nothing between them."""
    middle, low, high = (np.asarray(a, float) for a in (middle, low, high))
    up = np.where(np.isfinite(high), high, middle) - middle
    down = middle - np.where(np.isfinite(low), low, middle)
    return {
        "type": "data",
        "symmetric": False,
        "array": shortened(np.maximum(up, 0), 3),
        "arrayminus": shortened(np.maximum(down, 0), 3),
        "thickness": 0.8,
        "width": 0,
    }


def hover_text(row: Mapping[Hashable, Any]) -> str:
    """The hover text of a point."""
    if row["failed"] and not np.isfinite(row["error"]):
        why = f": {row['status']}, {row['reason']}" if row["reason"] else ""
        return f"{at(row)}failed in {row['failed']} of {row['seeds']}{why}"
    error = style.number(row["error"])
    if row["error_high"] != row["error_low"]:
        error += (
            f" ({style.number(row['error_low'])} to {style.number(row['error_high'])},"
            f" {row['seeds']} seeds)"
        )
    lines = [f"{at(row)}error {error} radii".strip()]
    lines.append(f"{spread(row)} µs/s" if np.isfinite(row["cost"]) else "not timed")
    if np.isfinite(row["idle"]):
        lines.append(f"as many steps of an empty world {style.number(row['idle'])} µs/s")
    if row["wrapping"] > 0:
        lines.append(f"besides, {style.number(row['wrapping'])} µs/s of wrapping in Python")
    return "<br>".join(lines)


def spread(row: Mapping[Hashable, Any]) -> str:
    """Median, quartiles and, of one scene's samples, the fastest of a cost."""
    fastest = f", fastest {style.number(row['best'])}" if np.isfinite(row["best"]) else ""
    return (
        f"{style.number(row['cost'])} ({style.number(row['low'])} to"
        f" {style.number(row['high'])}{fastest})"
    )


def log_axis(title: str, values: Array) -> dict[str, Any]:
    """A log axis with a tick a decade or so."""
    return {"title": title} | decades(np.append(values, 1.0) if not len(values) else values)


def error_axes(costs: Array, errors: pd.Series) -> Axes:
    """Log axes for costs and errors; y is broken where only some errors are below `LOWEST`."""
    x, drawn = log_axis(COST, costs), errors.to_numpy(float)
    if not (drawn >= LOWEST).any():
        return Axes(x, log_axis(ERROR, np.maximum(drawn, LOWEST)), LOWEST)
    axis, floor = broken_axis(drawn, LOWEST)
    return Axes(x, {"title": ERROR} | axis, floor)


def edge(axis: dict[str, Any], label: str) -> float:
    """Make room beyond the upper end of a log axis, with a tick `label`, and return the value
    there."""
    level = axis["range"][1] + EDGE / 2
    axis["range"] = [axis["range"][0], level + EDGE / 2]
    axis["tickvals"] = [*axis["tickvals"], 10**level]
    axis["ticktext"] = [*axis["ticktext"], label]
    return float(10**level)


def figure(traces: list[dict[str, Any]], axes: Axes, height: int | None) -> Figure:
    """The figure, with a band below a break of y; page.js adds what all share."""
    layout: dict[str, Any] = {"hovermode": "closest", "xaxis": axes.x, "yaxis": axes.y}
    broken = axes.floor not in (ZERO, LOWEST)
    shaded = marked_break(axes.y, axes.floor) if broken else {}
    return {"data": traces, "layout": layout | shaded | sized(height)}
