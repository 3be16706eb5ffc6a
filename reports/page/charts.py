"""The charts of a comparison: errors over time, and against the step size. Each is a row in
`CHARTS`."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws, scales, violations
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.view import View, beside
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.documents import deflated
from crosscheck2d.scenarios.model import Array, Trajectory

ZERO = 1e-17
"""On a log axis 0 and smaller values are drawn here: below the rounding of any number compared."""
NOISE = 1e-9
"""Smaller values are drawn below a break of the axis, if there are larger ones: exact answers are
known to a billionth of a radius, and the rounding of an exact engine would take half of a log
axis."""
POINTS = 300
TIME = "time (s)"
# drawn as the zero line if there is no truth; it is not a truth
BASELINE = "reference:exercise"


Figure = dict[str, Any]
"""A figure as plotly.js takes it: its traces, "data", and its "layout". `plotly.graph_objects`
would copy and check every number, for a third of the time that a page takes; a test does that."""


class Drawing(NamedTuple):
    """A heading, a caption of a sentence or two, and the figure; None if the caption says why there
    is none."""

    title: str
    caption: str
    figure: Figure | None


class ChartLine(NamedTuple):
    """One run's numbers: x (k,), y (k,); y may hold nan."""

    run: Run
    x: Array
    y: Array


@dataclass(frozen=True)
class SceneChart:
    """A row of `CHARTS`: what it shows in a line, and the function that draws it for one
    comparison."""

    summary: str
    draw: Callable[[Comparison], Drawing]


def views(comparison: Comparison, other: Trajectory | None) -> list[tuple[Run, View]]:
    """The runs at the middle dt, each beside `other` and cut to the common samples."""
    scenario, truth = comparison.scenario, comparison.truth
    jumps = jumps_of(other, scenario) if other is not None and other is truth else None
    return [
        (run, beside(scenario, run, other, jumps))
        for run in comparison.middle_runs
        if run.trajectory is not None and len(run.trajectory) > 1
    ]


def lines_over_time(
    played: list[tuple[Run, View]], series: Callable[[View], Array | None]
) -> list[ChartLine]:
    """A line for each run: what `series` gives for it, over time."""
    return [
        ChartLine(run, view.played.t, y) for run, view in played if (y := series(view)) is not None
    ]


def momentum(comparison: Comparison) -> Drawing:
    """The error of momentum; if walls take up momentum, its deviation from the truth."""
    if violations.knows_impulses(comparison.scenario):
        caption = (
            "Difference between the momentum and P(0) plus the impulses of weight and thrusts since"
            " then, divided by the Σ m|v| at hand. Lower is better."
        )
        lines = lines_over_time(views(comparison, None), violations.momentum)
        return Drawing(
            "Momentum error", caption, over_time(comparison, lines, "error / Σ m|v| at hand")
        )
    if comparison.truth is None:
        why = (
            "Walls, static disks or turning thrusts take up momentum, and no exact answer says how"
            " much."
        )
        return Drawing("Momentum", why, None)
    scale, lines = scales.momentum(comparison.scenario) or 1.0, []
    for run, view in views(comparison, comparison.truth):
        lines.append(ChartLine(run, view.played.t, view.momentum_deviation / scale))
    caption = (
        "Walls and static disks take up momentum, so it is not conserved. The chart shows its"
        f" distance from the exact momentum, divided by the Σ m|v| at hand. {DELAY}"
    )
    return Drawing(
        "Momentum deviation from the truth",
        caption,
        over_time(comparison, lines, "deviation / Σ m|v| at hand"),
    )


DELAY = (
    "A collision up to three steps late or early is no error here; the delay has its own metric."
)


def energy(comparison: Comparison) -> Drawing:
    """The error of energy, relative to the energy at hand."""
    conserved = violations.keeps_energy(comparison.scenario)
    if not conserved and comparison.truth is None:
        return energy_course(comparison)
    lines = lines_over_time(
        views(comparison, None if conserved else comparison.truth), violations.energy
    )
    against = (
        "its value at the start (at e = 1 collisions take no energy)"
        if conserved
        else "the exact energy"
    )
    caption = (
        f"Distance of the energy from {against}, divided by the energy at hand."
        f"{'' if conserved else f' {DELAY}'} Lower is better."
    )
    return Drawing("Energy error", caption, over_time(comparison, lines, "error / energy at hand"))


def energy_course(comparison: Comparison) -> Drawing:
    """The energy itself, if there is no exact answer to compare it with."""
    scene = comparison.scenario.scene
    lines = []
    for run, view in views(comparison, None):
        scale = scales.energy(comparison.scenario) or 1.0
        lines.append(ChartLine(run, view.played.t, laws.energy(view.played, scene) / scale))
    caption = (
        "No exact answer says how much energy the collisions should take. So this is not an error"
        " but the energy itself, divided by the energy at hand. Without thrusts it must never rise."
    )
    return Drawing(
        "Energy", caption, over_time(comparison, lines, "energy / energy at hand", log=False)
    )


def deviation(comparison: Comparison) -> Drawing:
    """The largest position error of any disk."""
    scene, truth = comparison.scenario.scene, comparison.truth
    held: Run | None = None
    if truth is None:
        played = [run for run in comparison.middle_runs if run.trajectory is not None]
        held = next((run for run in played if run.name == BASELINE), played[0] if played else None)
        if held is None:
            return Drawing("Trajectories", "No engine played this scene.", None)
    lines = [
        ChartLine(run, view.played.t, (view.deviation / scene.radius).max(axis=1))
        for run, view in views(comparison, held.trajectory if held else truth)
        if run is not held
    ]
    if held is None:
        caption = (
            "Largest distance of any disk from its exact position, in radii of that disk. Lower is"
            " better."
        )
        return Drawing(
            "Trajectory deviation", caption, over_time(comparison, lines, "off the truth (radii)")
        )
    caption = (
        f"There is no exact answer. The chart shows the distance from the disks of {held.name},"
        " which may be wrong, too."
    )
    deviation = f"deviation from {held.name}"
    return Drawing(
        deviation.capitalize(), caption, over_time(comparison, lines, f"{deviation} (radii)")
    )


def convergence(comparison: Comparison) -> Drawing:
    """How the position error shrinks with the step size."""
    title = "Error against dt"
    if comparison.truth is None:
        return Drawing(
            title, "There is no exact answer, so there is no error to show against dt.", None
        )
    table = comparison.table
    rows = table[(table.metric == "position_max_radii") & (table.versus == style.TRUTH)]
    lines = []
    for (engine, profile), group in rows.groupby(["engine", "profile"], sort=False):
        ladder = group.sort_values("dt_s")
        run = Run(str(engine), str(profile), comparison.scenario.name, 0.0)
        lines.append(ChartLine(run, ladder.dt_s.to_numpy(float), ladder.value.to_numpy(float)))
    if not lines:
        return Drawing(title, "No run has a position error to show.", None)
    steps = sorted({float(x) for line in lines for x in line.x})
    marks = [style.number(x, 2) for x in steps]
    dt_axis = {"title": "dt (s)", "type": "log", "tickvals": steps, "ticktext": marks}
    guide = first_order(lines, steps)
    figure = figure_of(lines, dt_axis, "position error (radii)", guide=guide, markers=len(steps))
    caption = (
        "Largest position error at every step size. The dotted line is first order: it falls as dt"
        " does. A steeper line is of higher order. A flat line has an error that no smaller step"
        " removes."
    )
    return Drawing(title, caption, figure)


def first_order(lines: Sequence[ChartLine], steps: list[float]) -> list[dict[str, Any]]:
    """A guide of slope 1 through the middle of the lines; none if there are no lines."""
    shown = np.concatenate([line.y for line in lines])
    shown = shown[np.isfinite(shown) & (shown > ZERO)]
    if not len(shown) or len(steps) < 2:
        return []
    y = float(np.median(shown)) / float(np.median(steps)) * np.array(steps)
    line = {"color": style.look(style.TRUTH).light, "dash": "dot", "width": 1}
    look = {"mode": "lines", "line": line, "opacity": 0.55, "name": "∝ dt", "hoverinfo": "skip"}
    return [{"type": "scatter", "x": steps, "y": shortened(y)} | look]


def over_time(
    comparison: Comparison, lines: list[ChartLine], title: str, log: bool = True
) -> Figure | None:
    """A figure of lines over time, with a mark where the truth ends; None if there is no line."""
    if not lines:
        return None
    duration, truth = comparison.scenario.duration, comparison.truth
    if log:  # the start is exact for all: its 0 would take up half of the axis
        lines = [ChartLine(run, x[1:], y[1:]) for run, x, y in lines]
    figure = figure_of(
        [thinned(line) for line in lines], {"title": TIME, "range": [0, duration]}, title, log=log
    )
    if truth is not None and truth.horizon < duration:
        mark_end(figure, truth.horizon, duration)
    return figure


def mark_end(figure: Figure, horizon: float, duration: float) -> None:
    """Draw a line into `figure` where the truth ends, with a label on the side that has more
    room."""
    ink = {"dash": "dot", "width": 1, "color": style.look(style.TRUTH).light}
    end = {"type": "line", "x0": horizon, "x1": horizon, "y0": 0, "y1": 1, "yref": "paper"}
    label = {
        "text": "exact answer ends",
        "x": horizon,
        "y": 1,
        "yref": "paper",
        "showarrow": False,
        "xanchor": "left" if horizon < duration / 2 else "right",
        "yanchor": "top",
    }
    layout = figure["layout"]
    layout["shapes"] = [*layout.get("shapes", []), end | {"line": ink}]
    layout["annotations"] = [label]


def figure_of(
    lines: list[ChartLine],
    x_axis: dict[str, Any],
    title: str,
    log: bool = True,
    markers: int = 7,
    guide: Sequence[dict[str, Any]] = (),
    unit: str = "s",
    mode: str = "lines+markers",
    height: int | None = None,
) -> Figure:
    """A figure with a trace for each line, in the look of its engine and with `markers` marks, and
    `guide` behind them.

    unit: of x; mode: of plotly, marks alone do not show x on hovering; height: px, default that of
        all figures.
    """
    traces = list(guide)
    values = np.concatenate([line.y for line in lines])
    y_axis, floor = broken_axis(values, NOISE) if log else ({}, -np.inf)
    at = "" if mode == "markers" else f" at %{{x:.4g}} {unit}"
    for line in lines:
        look = style.look(line.run.engine, line.run.profile)
        clipped = log and bool((line.y < floor).any())
        traces.append(
            {
                "type": "scatter",
                "x": shortened(line.x, 5),
                "y": shortened(np.where(line.y < floor, floor, line.y), 4 if log else 5),
                "name": line.run.name,
                "mode": mode,
                "connectgaps": True,
                "line": {"color": look.light, "dash": look.plotly_dash, "width": 1.7},
                "marker": {
                    "symbol": look.symbol,
                    "size": 8,
                    "color": look.light,
                    "maxdisplayed": markers,
                },
                "hovertemplate": f"%{{{'customdata' if clipped else 'y'}:.3g}}{at}",
            }
            | ({"customdata": shortened(line.y, 3)} if clipped else {})
        )
    layout = {"hovermode": "closest", "xaxis": x_axis, "yaxis": {"title": title} | y_axis}
    return {"data": traces, "layout": layout | marked_break(y_axis, floor) | sized(height)}


def sized(height: int | None) -> dict[str, Any]:
    """The layout of a figure that has a height of its own, px."""
    return {"height": height} if height else {}


def broken_axis(values: Array, bound: float) -> tuple[dict[str, Any], float]:
    """A log axis for `values` >= 0, and the position on it of values below its range.

    If only some values are below `bound`, the axis is broken: it begins a little below the smallest
    of the others, and all values below `bound` are drawn there, with a tick that says so. Else it
    goes down to `ZERO`.
    """
    real = values[np.isfinite(values)]
    upper = real[real >= bound]
    if len(upper) in (0, len(real)):
        return decades(values), ZERO
    axis, start = decades(upper), float(np.log10(upper.min())) - 0.3
    ticks = [(at, text) for at, text in zip(axis["tickvals"], axis["ticktext"]) if at > 10**start]
    floor = start - 0.5
    text = f"< 10<sup>{np.log10(bound):.0f}</sup>".replace("-", "−")
    return axis | {
        "range": [floor - 0.4, axis["range"][1]],
        "tickvals": [*(at for at, _ in ticks), 10.0**floor],
        "ticktext": [*(label for _, label in ticks), text],
    }, float(10.0**floor)


def marked_break(axis: Mapping[str, Any], floor: float) -> dict[str, Any]:
    """The layout that shades what is below the break of a `broken_axis`, and strikes the axis
    through there; {} where there is none."""
    if not axis or floor <= ZERO:
        return {}
    top = floor * 10**0.4
    band = {"x0": 0, "x1": 1, "xref": "paper", "y0": 10.0 ** axis["range"][0], "y1": top}
    look = {"fillcolor": style.look(style.TRUTH).light, "opacity": 0.07, "line": {"width": 0}}
    strokes = [
        {"type": "line", "xref": "paper", "x0": -0.01, "x1": 0.01}
        | {"y0": top * 10 ** (at - 0.05), "y1": top * 10 ** (at + 0.05)}
        | {"line": {"width": 1.5, "color": "#888"}}
        for at in (0.0, 0.1)
    ]
    return {"shapes": [{"type": "rect", "layer": "below"} | band | look, *strokes]}


def decades(values: Array) -> dict[str, Any]:
    """Range and ticks of a log axis for `values` >= 0, with a tick "0" at `ZERO` if any is drawn
    there."""
    values = values[np.isfinite(values)]
    real = values[values >= ZERO]
    low = int(np.floor(np.log10(real.min()))) if len(real) else -16
    high = int(np.ceil(np.log10(real.max()))) if len(real) else -15
    zero = bool((values < ZERO).any())
    low, high = (-17 if zero else low), max(high, low + 1)
    every = max(1, -(-(high - low) // 6))
    ticks = [k for k in range(high, low - 1, -every) if not zero or k > low + every / 2]
    text = [f"10<sup>{k}</sup>".replace("-", "−") if k not in (0, 1) else str(10**k) for k in ticks]
    if zero:
        ticks, text = [*ticks, low], [*text, "0"]
    return {
        "type": "log",
        "range": [low - 0.35, high + 0.25],
        "tickvals": [10.0**k for k in ticks],
        "ticktext": text,
    }


def thinned(line: ChartLine) -> ChartLine:
    """At most `POINTS` points of a line: the smallest and the largest of each section stay, so that
    no peak is lost."""
    k = len(line.y)
    if k <= POINTS:
        return line
    keep = {0, k - 1}
    for stretch in np.array_split(np.arange(k), POINTS // 2 - 1):
        known = stretch[np.isfinite(line.y[stretch])]
        if len(known):
            keep |= {int(known[np.argmin(line.y[known])]), int(known[np.argmax(line.y[known])])}
    order = sorted(keep)
    return ChartLine(line.run, line.x[order], line.y[order])


def shortened(values: Array | Sequence[float], digits: int = 4) -> list[float | None]:
    """Numbers to `digits` significant digits, finer than a pixel; None for nan."""
    listed = np.asarray(values, float).tolist()
    return [float(f"{v:.{digits}g}") if isfinite(v) else None for v in listed]


CHARTS: dict[str, SceneChart] = {
    "momentum": SceneChart("momentum error over time", momentum),
    "energy": SceneChart("energy error over time", energy),
    "deviation": SceneChart("distance to the truth over time", deviation),
    "convergence": SceneChart("position error against dt", convergence),
}


def packed_charts(drawings: Mapping[str, Drawing]) -> str:
    """The figures as JSON, deflated, as base64; page.js adds what all figures share."""
    figures = {key: each.figure for key, each in drawings.items() if each.figure is not None}
    return deflated(json.dumps(figures, separators=(",", ":"), default=listed))


def listed(values: Any) -> list[Any]:
    """The values of an array or a column for JSON, which has no nan."""
    return [None if v != v else v for v in np.asarray(values).tolist()]
