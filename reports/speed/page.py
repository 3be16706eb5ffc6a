"""Writes speed.html, a single file that loads nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.order import ELSEWHERE, UNSTEADY
from crosscheck2d.reports.compare.pareto import ACCURACIES, YARDSTICK, said_of_cheaper
from crosscheck2d.reports.compare.pooling import said_of_pool
from crosscheck2d.reports.page import situations, style
from crosscheck2d.reports.page.charts import Drawing, packed_charts
from crosscheck2d.reports.page.documents import CHARTED, render
from crosscheck2d.reports.page.links import neighbours
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import budget_tables, charts, explained, tables
from crosscheck2d.reports.speed.budget import RESIDUAL, TOTALS
from crosscheck2d.reports.speed.results import QUIET, Results
from crosscheck2d.reports.speed.scored_part import scored
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.foreign_text import put_text

GENERATOR = "crosscheck speed"
FLAGGED = (ELSEWHERE, UNSTEADY)
BUILDS = (
    "Each engine runs in one thread: Box2D 3.1 has threads, which are not asked for. Box2D 3.1 is"
    " built with its default, SSE2 or Neon; Rapier is the npm build without SIMD."
)


class SpeedSection(NamedTuple):
    """A group of charts under one legend, with a table."""

    key: str
    title: str
    text: str
    drawings: dict[str, Drawing]
    charts: str
    orders: list[dict[Hashable, Any]]
    names: list[str]


def write_page(path: Path, results: Results, about: Mapping[str, Any]) -> None:
    """Write the page of `results`; `about` holds command, seed, machine, versions, started,
    seconds, load."""
    names = (*results.names, *(sweep.name for sweep in results.plan.sweeps), style.TRUTH)
    looks = style.looks_of(names)
    answers = situations.answers(middle_scores(results), situated(results), set())
    html = render(
        "speed/speed.html.j2",
        generator=GENERATOR,
        scripts=CHARTED,
        styles=["speed/speed.css"],
        looks=looks,
        plotly=True,
        names=results.names,
        played=played(results.points),
        about=about,
        pooled=pooled_section(results),
        rough=sum(situations.FRICTION in places for places in situated(results).values()),
        answers=answers,
        whole=situations.whole(answers),
        far_off=situations.FAR_OFF,
        links=neighbours(path, "speed"),
        sizes=sizes_section(results),
        options=options_section(results),
        sweeps=sweep_sections(results),
        sweep_rows=results.sweeps.to_dict("records"),
        sections=[section_of(results, name) for name in results.scenes],
        noise=results.noise_floor(),
        quiet=results.noise_floor().floor <= QUIET,
        growth=results.growth.to_dict("records"),
        models=results.models.to_dict("records"),
        driving=results.driving.to_dict("records"),
        option_rows=results.options.to_dict("records"),
        versus=results.versus.to_dict("records"),
        own=YARDSTICK,
        left_out=results.left_out,
        accuracies=list(ACCURACIES),
        flagged=FLAGGED,
        option_scenes=results.plan.option_scenes,
        budget=budget_section(results),
        totals=(*TOTALS, RESIDUAL),
    )
    put_text(path, html)


def middle_scores(results: Results) -> pd.DataFrame:
    """A row for each engine and scene, at the middle of the step sizes measured:
    `situations.COLUMNS`; angles are not measured here."""
    points = results.points
    sizes = points.groupby("scenario").step_size.unique()
    middle = points.scenario.map({name: sorted(k)[len(k) // 2] for name, k in sizes.items()})
    here = points[points.step_size == middle]
    return here.assign(name=here.engine + ":" + here.profile, angle=np.nan)[situations.COLUMNS]


def played(points: pd.DataFrame) -> list[str]:
    """The engines with an error in one of the scenes; one that only adds friction has none in
    scenes without."""
    found = points[np.isfinite(points.error)]
    return list(dict.fromkeys(found.engine + ":" + found.profile))


def situated(results: Results) -> dict[str, list[str]]:
    """Scene -> what `situations.situations_of` says of it, of those that were measured."""
    seed, found = results.plan.seed, {}
    for scene in results.plan.scenes:
        if (name := open_scene(scene, seed).name) in results.asks:
            found[name] = situations.situations_of(*scored(scene, seed))
    return found


def section(
    key: str,
    title: str,
    text: str,
    drawings: dict[str, Drawing],
    orders: pd.DataFrame | None = None,
) -> SpeedSection:
    """A `SpeedSection`, its figures packed."""
    traces = [
        trace["name"]
        for each in drawings.values()
        if each.figure is not None
        for trace in each.figure["data"]
    ]
    names = [name for name in dict.fromkeys(traces) if ":" in name]
    rows = [] if orders is None else orders.to_dict("records")
    return SpeedSection(key, title, text, drawings, packed_charts(drawings), rows, names)


def pooled_section(results: Results) -> SpeedSection:
    """All scenarios at once."""
    count_of_scenes = counted(len(results.scenes), "scene")
    steps = results.pooled.step_size.nunique()
    drawings = {
        "speed": Drawing(
            "Error against cost",
            f"Each point is an engine at one of the {counted(steps, 'step size')} that all scenes"
            f" have: error and cost are geometric means of the middle half of {count_of_scenes}:"
            f" {', '.join(results.scenes)}. {said_of_pool(results.pooled)} A scene in which an"
            " engine failed has an infinite error and an infinite cost. The light mark left of a"
            " point is the cost without that of as many steps and calls in an empty world. Lower"
            " and further left is better. The broad grey line is the Pareto front: no engine is"
            " better than its points in both error and cost. The narrow line is the Pareto front"
            " of the engines that take steps.",
            charts.speed(results.pooled, tall=True),
        ),
        "matched": Drawing(
            "Cost at matched accuracy",
            "The cost of reaching an error: that of the cheapest step size from which on all finer"
            f" steps keep it, too. Each engine is compared with {YARDSTICK} in the scenes in which"
            f" both reach it. A mark is the geometric mean of the cost of {YARDSTICK} over all its"
            " scenes, times the geometric mean of the ratios. never: in half of the scenes or more,"
            " no dt reaches the error, or the engine fails. not yet: in half or more, the finest dt"
            " measured does not reach it. Hover over a mark for the numbers of scenes."
            f" {said_of_cheaper(results.pooled_reached)}",
            charts.matched(results.pooled_reached, tall=True),
        ),
    }
    return section("pooled", "All scenes pooled", "", drawings)


def section_of(results: Results, scene: str) -> SpeedSection:
    """One scenario."""
    points = results.points[results.points.scenario == scene]
    reached = results.reached[results.reached.scenario == scene]
    seeds = int(points.seeds.max())
    spread = (
        f" The error is the median over {seeds} seeds, its bar the 95 % bootstrap interval."
        if seeds > 1
        else ""
    )
    noise = results.noise_floor(scene)
    floor = (
        " Noise floor: for half of the engines the ratio of two timings is"
        f" {style.number(noise.low)} to {style.number(noise.high)}."
        if noise.pairs
        else ""
    )
    until, whole = points.until_s.iloc[0], points.duration_s.iloc[0]
    scored = (
        f" Scored to {until:.3g} of {whole:.3g} s, where the exact answer ends."
        if until < whole
        else ""
    )
    wrapping = (points.wrapping > 0).any()
    budgets = (
        " The time does not include the wrap, which Python does for engines without one: hover"
        " over a point to see it."
        if wrapping
        else ""
    )
    drawings = {
        "speed": Drawing(
            "Error against cost",
            f"A point is one dt; the next point to the right has half of it.{scored}{spread} Time:"
            " the median of the rounds, with bars from quartile to quartile. The light mark is the"
            f" time without that of as many steps and calls in an empty world.{floor}{budgets}",
            charts.speed(points),
        ),
        "matched": Drawing(
            "Cost at matched accuracy",
            "never: no dt reaches the error, because the engine converges to another motion, or"
            " fails. not yet: the finest dt measured does not reach it.",
            charts.matched(reached),
        ),
    }
    return section(scene, scene, results.asks[scene], drawings, results.order_table(scene))


def sizes_section(results: Results) -> SpeedSection | None:
    """Cost against the number of disks."""
    if results.sizes.empty:
        return None
    drawing = Drawing(
        "Cost of a step against the number of disks",
        "A gas that covers 0.3 of its box, e = 1, dt = 1/240 s. Bars are quartiles; hover for the"
        f" worst step. {tables.end_of_all_pairs(results.sizes)}"
        f" {tables.cost_of_sleep(results.measured)} {BUILDS}",
        charts.sizes(results.sizes, results.growth),
    )
    return section("sizes", "How the cost grows", "", {"sizes": drawing})


def budget_section(results: Results) -> dict[str, Any] | None:
    """The error budget."""
    budget = results.measured.budget
    if budget.empty:
        return None
    table = results.explained
    contributions = set(table.engine + ":" + table.profile)
    return {
        "sentence": explained.sentence(table),
        "cuts": explained.extent(table).cuts,
        "absent": [name for name in results.names if name not in contributions],
        "overview": budget_tables.overview(budget),
        "scenes": [
            budget_tables.of_scene(budget, scene) for scene in dict.fromkeys(budget.scenario)
        ],
        "off": budget_tables.ablated_in_both(budget),
        "closed": float(budget.closed_deviation_radii.max()),
    }


def options_section(results: Results) -> SpeedSection | None:
    """The cost and the effect of each option that the scenes do not need."""
    table = results.options
    if table.empty:
        return None
    many = np.isfinite(table.cost_ratio).any()
    drawings = {
        "cost": Drawing(
            "Its cost",
            "Time divided by that of the matched profile; right of the dotted line the option costs"
            " more.",
            charts.options(table, "cost_ratio", "time / time unchanged") if many else None,
        ),
        "error": Drawing(
            "Its effect on the error",
            "Error divided by that of the matched profile; right of the dotted line it is larger.",
            charts.options(table, "error_ratio", "error / error unchanged"),
        ),
    }
    return section("options", "Options that a scene does not need", "", drawings)


def sweep_sections(results: Results) -> list[SpeedSection]:
    """The effect of more iterations and substeps, and that of smaller steps for the same time."""
    if results.sweeps.empty:
        return []
    count = results.sweeps.scenario.nunique()
    without = ", ".join(
        f"{engine} in {scene}" for engine, scene in tables.without_ratio(results.sweeps)
    )
    pooled = Drawing(
        "Pooled",
        "Dotted: more iterations or substeps at one dt, from left to right; the first and the last"
        " number are named. Solid: the matched profile, from 4 times that dt to an eighth of it."
        " Error and cost are divided by those of the matched profile at that dt, where all lines"
        f" meet. A point is the geometric mean of the middle half of {counted(count, 'scene')}."
        + (f" These have no ratio, because the divisor is 0: {without}." if without else ""),
        charts.sweeps(results.pooled_sweeps, relative=True),
    )
    each = {
        str(scene): Drawing(str(scene), open_scene(str(scene), 0).asks, charts.sweeps(points))
        for scene, points in results.sweeps.groupby("scenario", sort=False)
    }
    return [
        section("sweeps", "More work in a step, or more steps", "", {"sweeps": pooled}),
        section("sweeps-each", "The same, scene by scene", "", each),
    ]
