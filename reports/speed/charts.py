"""The charts: error against cost, cost at matched accuracy, cost against the number of disks,
options."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from reports.compare.pareto import ACCURACIES, FAILED, front
from reports.compare.pooling import without_idle
from reports.page import style
from reports.page.charts import ZERO, Figure, broken_axis, decades, marked_break, shortened, sized
from reports.page.cost_picture import light_marks
from reports.speed.cheapest import KINDS
from scenarios.model import Array

FRONT, FRONT_OF_STEPS = "Pareto front", "Pareto front of those who take steps"
COST, ERROR = "engine time (µs per simulated second)", "error (radii)"
EDGE = 0.55  # decades between the last gridline and what is drawn at the edge
# radii; smaller errors, below a tenth of the finest accuracy asked for, are drawn below a break of
# the axis
LOWEST = 1e-7
TALL, TALLEST, PER_ROW = 400, 520, 19  # px


def speed(points: pd.DataFrame, tall: bool = False) -> Figure:
    """Error against cost, a line for each engine over its ladder; `points` of one scene, or pooled
    and then `tall`."""
    drawn = points[points.cost.notna() & np.isfinite(points.error)]
    bare = (
        drawn.bare
        if tall
        else pd.Series(without_idle(drawn.cost.to_numpy(), drawn.idle.to_numpy()))
    )
    x_axis = log_axis(COST, np.append(drawn.cost.to_numpy(float), bare.dropna().to_numpy(float)))
    y_axis, floor = error_axis(drawn.error.to_numpy(float))
    traces = fronts(drawn, x_axis, y_axis, floor)
    for engine, profile, group in by_engine(points):
        fine = group[group.cost.notna() & np.isfinite(group.error)]
        spreads = (
            {}
            if tall
            else {
                "error_x": bars(fine.cost, fine.low, fine.high),
                "error_y": bars(
                    *(lifted(fine[name], floor) for name in ("error", "error_low", "error_high"))
                ),
            }
        )
        text = [hover_text(row) for row in records(fine)]
        values = {"customdata": shortened(fine.error, 3)}  # what is saved as CSV
        height = lifted(fine.error, floor)
        cost = fine.cost.to_numpy(float)
        left = fine.bare.to_numpy(float) if tall else without_idle(cost, fine.idle.to_numpy(float))
        if np.isfinite(left).all():
            traces.append(light_marks(engine, profile, cost, left, height.to_numpy(float)))
        traces.append(line(engine, profile, fine.cost, height, text, spreads | values))
    lost = points[~(points.cost.notna() & np.isfinite(points.error))]
    traces += at_the_edge(lost, drawn, x_axis, y_axis, floor)
    return figure(traces, x_axis, y_axis, TALLEST if tall else TALL, floor)


def at_the_edge(
    lost: pd.DataFrame,
    drawn: pd.DataFrame,
    x_axis: dict[str, Any],
    y_axis: dict[str, Any],
    floor: float,
) -> list[dict[str, Any]]:
    """Points without an error, on the upper edge, and without a cost, at their error: at the cost
    extrapolated from the engine's other dts, else at the right edge. `floor`: of `error_axis`.
    """
    if lost.empty:
        return []
    top = edge(y_axis, FAILED) if np.isinf(lost.error).any() else np.nan
    traces = []
    for engine, profile, group in by_engine(lost):
        others = drawn[(drawn.engine == engine) & (drawn.profile == profile)]
        per_step_size = (
            float((others.cost / 2.0**others.step_size).median()) if len(others) else np.nan
        )
        cost = group.cost.where(group.cost.notna(), per_step_size * 2.0**group.step_size)
        corner = 10 ** (x_axis["range"][1] - 0.05)  # just inside the range
        x = cost.fillna(corner).clip(upper=corner)
        y = lifted(group.error, floor).where(np.isfinite(group.error), top)
        trace = line(engine, profile, x, y, [hover_text(row) for row in records(group)])
        traces.append(trace | {"mode": "markers", "cliponaxis": False})
    return traces


def fronts(
    drawn: pd.DataFrame, x_axis: dict[str, Any], y_axis: dict[str, Any], floor: float
) -> list[dict[str, Any]]:
    """The Pareto front of all engines and, narrower, that of the engines that take steps; drawn
    behind the points."""
    steps = drawn[~drawn.engine.isin(KINDS)]
    return [
        front_of(drawn, FRONT, 9, x_axis, y_axis, floor),
        front_of(steps, FRONT_OF_STEPS, 3, x_axis, y_axis, floor),
    ]


def front_of(
    drawn: pd.DataFrame,
    name: str,
    width: int,
    x_axis: dict[str, Any],
    y_axis: dict[str, Any],
    floor: float,
) -> dict[str, Any]:
    """The Pareto front as steps: every point above and right of it is slower and less accurate than
    a point on it.

    Errors drawn at `floor`, below `LOWEST`, count as equal.
    """
    cost, error = drawn.cost.to_numpy(float), lifted(drawn.error, floor).to_numpy(float)
    best = front(cost, error)
    x, y = cost[best], error[best]
    if best:
        right, top = 10 ** x_axis["range"][1], 10 ** y_axis["range"][1]
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
    drawn = points[points.cost.notna() & np.isfinite(points.error)]
    x_axis = log_axis("time / time as matched" if relative else COST, drawn.cost.to_numpy(float))
    errors = drawn.error.to_numpy(float)
    y_axis, floor = (
        (log_axis("error / error as matched", errors), ZERO) if relative else error_axis(errors)
    )
    traces = []
    for engine, profile, group in by_engine(drawn):
        what = profile.partition("+")[2]
        text = [sweep_hover(what, row, relative) for row in records(group)]
        error = group.error if relative else lifted(group.error, floor)
        trace = line(engine, profile, group.cost, error, text)
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
    lost = points[~(points.cost.notna() & np.isfinite(points.error))]
    traces += at_the_edge(lost, drawn, x_axis, y_axis, floor)
    return figure(traces, x_axis, y_axis, TALLEST if relative else TALL, floor)


def sweep_hover(what: str, row: dict[str, Any], relative: bool) -> str:
    """The hover text of a point of a sweep."""
    value = (
        f"{what} {row['change']}<br>"
        if what
        else f"dt / {2.0 ** (row['step_size'] - 2):g}<br>"
        if relative
        else ""
    )
    if not relative:
        return value + hover_text(row)
    return (
        f"{value}{style.number(row['cost'])} × the time, {style.number(row['error'])} × the error"
    )


def matched(reached: pd.DataFrame, tall: bool = False) -> Figure:
    """The cost of each accuracy, a mark for each engine; at the top, engines that do not reach
    it."""
    names = list(dict.fromkeys(zip(reached.engine, reached.profile)))
    y_axis = log_axis(COST, reached.cost.dropna().to_numpy(float))
    not_down = edge(y_axis, "not yet")
    never = edge(y_axis, "never")
    traces = []
    for k, (engine, profile) in enumerate(names):
        group = reached[(reached.engine == engine) & (reached.profile == profile)]
        x = np.arange(len(group)) + (k - (len(names) - 1) / 2) * 0.8 / max(len(names), 1)
        y = group.cost.where(group.cost.notna(), np.where(group.lost, never, not_down))
        text = [
            f"{row['accuracy']} of a radius: "
            + (
                row["why"]
                if np.isnan(row["cost"])
                else f"{style.number(row['cost'])} µs/s {at(row)}{row['why']}"
            )
            for row in records(group)
        ]
        traces.append(line(engine, profile, x, y, text) | {"mode": "markers"})
    x_axis = {
        "title": "accuracy (of a radius)",
        "tickvals": list(range(len(ACCURACIES))),
        "ticktext": list(ACCURACIES),
        "range": [-0.5, len(ACCURACIES) - 0.5],
    }
    return figure(traces, x_axis, y_axis, TALL if tall else None)


def at(row: dict[str, Any]) -> str:
    """ "at dt ..." where there is one."""
    return f"at dt {style.number(row['dt_s'])} s " if np.isfinite(row["dt_s"]) else ""


def sizes(costs: pd.DataFrame, growth: pd.DataFrame) -> Figure:
    """Cost of a step against the number of disks; a cross where an engine was stopped."""
    y_axis = log_axis("engine time (µs per step)", costs.cost.to_numpy(float))
    x_axis = log_axis("disks", np.append(costs.n.to_numpy(float), 10.0))
    traces = []
    stopped = edge(y_axis, "stopped") if (growth.stopped != "").any() else 0.0
    for engine, profile, group in by_engine(costs):
        text = [f"{row['n']:.0f} disks: {spread(row)} µs a step" for row in records(group)]
        traces.append(
            line(
                engine,
                profile,
                group.n,
                group.cost,
                text,
                {
                    "error_y": bars(group.cost, group.low, group.high),
                },
            )
        )
    for row in records(growth[growth.stopped != ""]):
        n, why = row["stopped"].split(": ", 1)
        cross = line(row["engine"], row["profile"], [float(n)], [stopped], [f"{n} disks: {why}"])
        traces.append(cross | {"mode": "markers", "cliponaxis": False})
    return figure(traces, x_axis, y_axis, TALL)


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
            for row in records(group)
        ]
        traces.append(line(engine, profile, x, y, text) | {"mode": "markers"})
    return figure(traces, x_axis, y_axis, 110 + PER_ROW * len(rows))


TICKS = [a * 10.0**b for b in range(-8, 9) for a in (1, 2, 5)]


def line(
    engine: str,
    profile: str,
    x: Any,
    y: Any,
    text: Sequence[str],
    more: dict[str, Any] | None = None,
) -> dict[str, Any]:
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
    } | (more or {})


def by_engine(table: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """(engine, profile, their rows), in the order of appearance."""
    for (engine, profile), group in table.groupby(["engine", "profile"], sort=False):
        yield str(engine), str(profile), group


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


def hover_text(row: dict[str, Any]) -> str:
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


def spread(row: dict[str, Any]) -> str:
    """Median, quartiles and, of one scene's samples, the fastest of a cost."""
    fastest = f", fastest {style.number(row['best'])}" if np.isfinite(row["best"]) else ""
    return (
        f"{style.number(row['cost'])} ({style.number(row['low'])} to"
        f" {style.number(row['high'])}{fastest})"
    )


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Its rows as dicts."""
    return [{str(key): value for key, value in row.items()} for row in table.to_dict("records")]


def log_axis(title: str, values: Array) -> dict[str, Any]:
    """A log axis with a tick a decade or so."""
    return {"title": title} | decades(np.append(values, 1.0) if not len(values) else values)


def error_axis(errors: Array) -> tuple[dict[str, Any], float]:
    """A log axis for errors, and where on it those below `LOWEST` are drawn: below a break of it,
    if there are larger ones, else at `LOWEST`."""
    if not (errors >= LOWEST).any():
        return log_axis(ERROR, np.maximum(errors, LOWEST)), LOWEST
    axis, floor = broken_axis(errors, LOWEST)
    return {"title": ERROR} | axis, floor


def lifted(errors: pd.Series, floor: float) -> pd.Series:
    """Where errors are drawn on an `error_axis`: those below `LOWEST` at its `floor`."""
    return errors.where(~(errors < LOWEST), floor)


def edge(axis: dict[str, Any], label: str) -> float:
    """Make room beyond the upper end of a log axis, with a tick `label`, and return the value
    there."""
    level = axis["range"][1] + EDGE / 2
    axis["range"] = [axis["range"][0], level + EDGE / 2]
    axis["tickvals"] = [*axis["tickvals"], 10**level]
    axis["ticktext"] = [*axis["ticktext"], label]
    return float(10**level)


def figure(
    traces: list[dict[str, Any]],
    x_axis: dict[str, Any],
    y_axis: dict[str, Any],
    height: int | None,
    floor: float = ZERO,
) -> Figure:
    """The figure, with a band where `floor` is below a break of y; page.js adds what all share."""
    layout: dict[str, Any] = {"hovermode": "closest", "xaxis": x_axis, "yaxis": y_axis}
    broken = floor not in (ZERO, LOWEST)
    shaded = marked_break(y_axis, floor) if broken else {}
    return {"data": traces, "layout": layout | shaded | sized(height)}
