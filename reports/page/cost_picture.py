"""The picture of error against cost: a line for each engine over its step sizes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.order import FINEST
from crosscheck2d.reports.compare.pooling import POOLED
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.charts import Figure, broken_axis, decades, marked_break, shortened
from crosscheck2d.reports.page.cost_points import bare, by_engine, no_nearer
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.scenarios.model import Array

TIME, STEPS = "engine time (µs per simulated second)", "steps per simulated second"
ERROR = "largest error (radii)"
TALL = 460  # px
GOOD = "#1d8a63"  # the best corner, on a light and on a dark page


def picture(table: pd.DataFrame, axis: str) -> Figure:
    """Error against cost: a line for each engine over its step sizes."""
    drawn = table[table.cost.notna() & np.isfinite(table.error)]
    costs, errors = (drawn[column].to_numpy(float) for column in ("cost", "error"))
    x_axis: dict[str, Any] = {"title": axis} | decades(np.append(costs, 1.0))
    x_axis = with_two_ticks(x_axis | {"range": cost_range(np.append(costs, bare(drawn)))})
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
    says = "near and cheap" if axis == TIME else "near in few steps"
    return {"data": traces, "layout": layout | best_corner(layout.get("shapes", []), says)}


def cost_range(costs: Array) -> list[float]:
    """The range of a log axis for costs."""
    if not len(costs):
        return [0.0, 1.0]
    return [float(np.log10(costs.min())) - 0.25, float(np.log10(costs.max())) + 0.35]


def with_two_ticks(axis: dict[str, Any]) -> dict[str, Any]:
    """A log axis with ticks at 1, 2 and 5 times powers of ten, if its range has fewer than two of
    its own."""
    low, high = axis["range"]
    if sum(low <= np.log10(tick) <= high for tick in axis["tickvals"]) >= 2:
        return axis
    every = [k * 10.0**n for n in range(math.floor(low), math.ceil(high) + 1) for k in (1, 2, 5)]
    ticks = [tick for tick in every if low <= np.log10(tick) <= high]
    return axis | {"tickvals": ticks, "ticktext": [style.number(tick) for tick in ticks]}


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
