"""What accuracy and many disks cost, and where each method fails: two charts and a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from markupsafe import Markup

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.drawing import Line, draw_lines, new_figure, svg_of
from crosscheck2d.reports.page.kit import Chart, Section, Table, TableCell
from crosscheck2d.reports.page.scenes import OURS, SceneScores, label, smooth
from crosscheck2d.reports.page.summary import Summary, rounded, stand_in

SIZES = Path(__file__).parents[1] / "speed" / "figures.csv"
LIMITS = ("stability_limits.csv", "stability_limits_javascript.csv")
DISPLACEMENT = "radii a step"
CASES = {
    "tunnelling_head_on": ("Fast disks meet head-on", DISPLACEMENT, 1),
    "tunnelling_thin_wall": ("A fast disk meets a thin wall", DISPLACEMENT, 1),
    "fast_gas": ("A fast gas keeps its energy", DISPLACEMENT, 1),
    "column": ("A column stands", "disks", 1),
    "heavy_on_light": ("A heavy disk rests on a light one", "mass ratio", 1),
    "bounce_drift": ("A ball keeps its height", "step / fall time", 1),
    "slow_collision": ("Slow disks bounce", "m/s", -1),
    "friction_in_bounce": ("A bounce has its friction", "e", 1),
    "spin": ("A disk spins freely", "rad a step", 1),
    "scale_down": ("A scene made smaller", "factor", -1),
    "far_from_origin": ("A scene far from the origin", "m", 1),
}
"""Case of the stability atlas -> what should hold, the unit, and 1 if larger is harsher."""
NEAR = 0.8  # of the best limit: as good


def error_against_cost(summary: Summary) -> Section | None:
    """The chart of error against cost, at all step sizes; without times against the number of
    steps. None if there is nothing to draw."""
    if not (scenes := smooth(summary.scenes)):
        return None
    others = [name for names in summary.profiles.values() for name in names]
    names = [name for name in summary.columns if name not in OURS[1:] or not summary.libraries]
    lines = [make_line(summary, scenes, name) for name in names]
    lines += [make_line(summary, scenes, name, faint=True) for name in others if name not in names]
    lines = [line for line in lines if np.isfinite(np.asarray(line.y, float)).any()]
    if not lines:
        return None
    figure, axes = new_figure()
    timed = bool(summary.costs)
    x_title = f"{'engine time for' if timed else 'steps in'} a second of simulation"
    draw_lines(axes, lines, x_title, "error, radii", x_unit="µs" if timed else "")
    thin = " Thin: the other settings." if any(line.faint for line in lines) else ""
    says = f"Medians of {len(scenes)} scenes, at all step sizes; filled: the usual one.{thin}"
    if not timed:
        says += f" {summary.clock.fault}"
    return Section("Error against cost", says, [Chart(svg_of(figure, says))], css="pair", id="cost")


def make_line(
    summary: Summary, scenes: Sequence[SceneScores], name: str, faint: bool = False
) -> Line:
    """(cost, error) at each step size: the geometric mean of the timed scenes, the median of all
    scenes; a scene with fewer step sizes is left out where it has none."""
    rows = []
    for scene in scenes:
        engine, scenario = stand_in(name, scene), scene.comparison.scenario
        for k, dt in enumerate(map(scenario.dt, scenario.substeps)):
            cost = summary.times.get((scene.name, engine, rounded(dt)), np.nan)
            cost = np.log(cost if summary.costs else 1 / dt)
            rows.append((k, cost, scene.error(engine, dt), dt == scene.comparison.middle_dt))
    table = pd.DataFrame(rows, columns=["step", "cost", "error", "usual"]).groupby("step")
    points = table.agg({"cost": "mean", "error": "median"}).dropna()
    # of several numbers that are usual in as many scenes the smallest
    filled = -1 if faint else int(table.usual.sum().argmax())
    error = points.error.where(points.error > 0)
    return Line(name, np.exp(points.cost), error, "" if faint else label(name), filled, faint)


def cost_against_size(summary: Summary) -> Section | None:
    """The chart of the time of a step against the number of disks, as `crosscheck speed` measured
    it; None if it has none of these engines."""
    kept = pd.read_csv(SIZES, comment="#")
    kept = kept[(kept.figure == "cost of a step") & kept.note.isna()]
    kept = kept.astype({"at": float, "value": float})
    kept["name"] = kept.engine + ":" + kept.profile
    lines = [
        Line(name, rows["at"].to_numpy(), rows.value.to_numpy(), label(name))
        for name in summary.columns
        if len(rows := kept[kept.name == name].sort_values("at"))
    ]
    if not lines or not summary.libraries:
        return None
    figure, axes = new_figure()
    draw_lines(axes, lines, "number of disks", "time of a step", y_unit="µs")
    says = (
        "A gas that covers 30 % of a box, by crosscheck speed on another machine. The reference"
        " tests every pair, the others only neighbours."
    )
    drawn = {line.name for line in lines}
    if missing := [label(name) for name in summary.libraries if name not in drawn]:
        says += f" Not measured: {', '.join(missing)}."
    chart = Chart(svg_of(figure, f"Time of a step against the number of disks. {says}"))
    return Section("Cost against the number of disks", says, [chart], css="pair")


def limits(summary: Summary) -> Section | None:
    # an installation has no tests
    folders = [parent / "tests" / "data" for parent in Path(__file__).parents]
    files = [folder / name for name in LIMITS for folder in folders if (folder / name).is_file()]
    if not files or not summary.libraries:
        return None
    kept = pd.concat([pd.read_csv(path) for path in files])
    kept["name"] = kept.engine + ":" + kept.profile
    names = [name for name in summary.columns if not name.endswith(OWN)]
    rows, index = [], []
    for case, (title, unit, sense) in CASES.items():
        reaches = {}  # larger is farther: inf does not fail; nan works only beyond a value
        for row in kept[kept.case == case].to_dict("records"):
            words = {"does not fail": np.inf, "never works": 0.0}
            words["limit"] = float(row["works_at"]) ** sense
            reaches[row["name"]] = words.get(row["verdict"], np.nan)
        rows.append(limit_cells(summary, names, reaches, sense))
        index.append(TableCell(Markup("{} <small>{}</small>").format(title, unit)))
    frame = pd.DataFrame(rows, index, [label(name) for name in names], dtype=object)
    says = (
        "One quantity is made harsher until the engine fails; the number is the last that works."
        " Holds: at all values tried; never: at none; –: not measured. Small: the other settings,"
        " where they reach less far. Found by crosscheck stability --full, not in this run."
    )
    return Section("Where each method fails", says, [Table(frame, css="fixed limits")], id="limits")


def limit_cells(
    summary: Summary, names: Sequence[str], reaches: dict[str, float], sense: int
) -> list[TableCell]:
    """The cells of a row; neighbours that say the same are one."""

    def text(value: float) -> str:  # in the unit of the case
        if np.isnan(value):
            return "–"
        limit = style.number(value**sense, 2) if 0 < value < np.inf else ""
        return limit or ("never" if value == 0 else "holds")

    best = max((reaches.get(name, np.nan) for name in summary.libraries), default=np.nan)
    cells: list[TableCell] = []
    for name in names:
        value = reaches.get(name, np.nan)
        notes = [
            TableCell(f"{other.partition(':')[2]} {text(reaches[other])}", css="soft")
            for other in summary.profiles.get(name.partition(":")[0], ())
            if other != name and reaches.get(other, np.inf) < NEAR * value
        ]
        near = "best" if value >= NEAR * best and name in summary.libraries else ""
        cells.append(TableCell(text(value), css="bad" if value == 0 else near, notes=tuple(notes)))
    if len({(cell.text, cell.notes) for cell in cells}) == 1:
        says = "all hold" if cells[0].text == "holds" else f"all: {cells[0].text}"
        return [TableCell(says, css="soft", span=len(names))] + [TableCell()] * (len(names) - 1)
    if len({cell.css for cell, name in zip(cells, names) if name in summary.libraries}) == 1:
        return [replace(cell, css=cell.css.replace("best", "")) for cell in cells]
    return cells
