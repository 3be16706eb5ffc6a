"""The page of a measurement as sections of the page kit: each table of `results.py`, and its
charts of error against cost and of cost against the number of disks."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.mechanisms.table import NAMES
from crosscheck2d.reports.compare.accuracy import (
    ACCURACIES,
    ELSEWHERE,
    UNSTEADY,
    WHO,
    YARDSTICK,
    front,
    said_of_cheaper,
    said_of_pool,
    without_idle,
)
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.drawing import Line, draw_lines, new_figure, svg_of
from crosscheck2d.reports.page.kit import (
    Chart,
    Page,
    Part,
    Section,
    Table,
    TableCell,
    Text,
    neighbours,
    render_page,
    run_section,
)
from crosscheck2d.reports.page.scenes import SITUATIONS, situations_of
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import tables
from crosscheck2d.reports.speed.budget import (
    ALL,
    INTERPLAY,
    LEAST,
    RESIDUAL,
    SUM,
    TIME,
    TO,
    TOTAL,
    cut_scenes,
    explained_share,
)
from crosscheck2d.reports.speed.ladder import scored
from crosscheck2d.reports.speed.plan import PLAIN
from crosscheck2d.reports.speed.results import Results
from crosscheck2d.reports.speed.tables import names_of
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.foreign_text import put_text

GENERATOR = "crosscheck speed"
COST, ERROR = "engine time per simulated second", "error, radii"
# radii; smaller errors, a tenth of the finest accuracy asked for, are drawn here
LOWEST = 1e-7
BUSY = 0.25  # cores that others keep busy, above which the page warns
BUILDS = (
    "Each engine runs in one thread: Box2D 3.1 has threads, which are not asked for. Box2D 3.1 is"
    " built with its default, SSE2 or Neon; Rapier is the npm build without SIMD."
)
VERDICTS = {
    "exact": "is below 10⁻⁶ at any dt",
    UNSTEADY: "is not monotone",
    "failed": "unknown: failed",
}
TERMS = {
    "time of collisions": "a collision is found up to a step late; until then the disks move on"
    " with the old velocity",
    "flight": "x += v dt + α a dt², so x is off by (α − ½) a dt t",
    "restitution": "an e that is not that of the scene: a product of two, or 0 below a threshold",
    "impulse": "from the velocity before or after gravity; all contacts in one solve; soft and"
    " speculative contacts in Box2D 3.1",
    "contact recycling": "a pair that has hardly moved is not tested again: its contact keeps its"
    " normal, or is missed",
    "edges of the box": "the exercise sets a disk that leaves a torus onto the opposite edge, "
    " which cuts off the rest of its step",
    "friction": "friction that is not that of the scene: a default, a product of two coefficients, "
    " a narrower cone, a shorter lever arm",
    "wall skin": "walls that are thicker than the scene states",
    "position correction": "how an overlap is removed: projected at once, or corrected gradually",
    "float32": "every number is rounded to 24 binary digits",
    "CCD, sleep": "the ablated reference does not have these: the engine is compared with itself"
    " without them",
    "interplay": "the change by all mechanisms together, minus the sum of the contributions",
}
Row = Mapping[Hashable, Any]
Columns = Mapping[str, str | Callable[[Row], Any]]


def write_page(path: Path, results: Results, about: Mapping[str, Any]) -> None:
    """Write the page of `results`; `about` holds command, seed, machine, versions, started,
    seconds, load."""
    engines = results.points[np.isfinite(results.points.error)][WHO].drop_duplicates()
    lead = [
        f"{counted(len(engines), 'engine')} in {counted(len(results.scenes), 'scene')} with an"
        " exact answer. The error is the largest distance of any disk from its exact position, in"
        " radii of that disk, up to the horizon of the answer. The time is that inside step,"
        " without reading states or collisions, in rounds of all engines in shuffled order. Error"
        " and time are measured in separate runs.",
        "For your own scene and error: crosscheck advise my_scene.toml --error 1% names the"
        " cheapest engine and step size.",
    ]
    if about["load"] > BUSY:
        lead.append(
            f"The machine was not alone: other work kept {number(about['load'], 2)} of"
            f" {about['machine']['cores']} cores busy when the timing began. Errors do not depend"
            " on that; times do."
        )
    sections = [
        *situation_section(results),
        pooled_section(results),
        versus_section(results),
        models_section(results),
        *budget_sections(results),
        *option_sections(results),
        *sweep_sections(results),
        *size_sections(results),
        driving_section(results),
        scenes_section(results),
    ]
    if items := [f"{what}: {reason}" for what, reason in results.measured.left_out]:
        sections.append(Section(f"Left out: {len(items)}", "", [Text(items=items)], True))
    page = Page(
        "Speed against accuracy",
        [*sections, run_section(about)],
        GENERATOR,
        lead,
        names=[*results.plan.engines, *(sweep.name for sweep in results.plan.sweeps)],
        links=neighbours(path, "speed"),
        footer=f"Made by {about['command']}. The errors come out the same, bit for bit; the times"
        " are this machine's. Every sample is in speed_samples.csv, every error in"
        " speed_errors.csv.",
    )
    put_text(path, render_page(page))


def table_of(
    frame: pd.DataFrame, label: str | Callable[[Row], Any], columns: Columns, **more: Any
) -> Table:
    """A table with a row for each of a frame; `label` and `columns` (heading -> value) are names
    of its columns or functions of a row."""
    rows = frame.to_dict("records")

    def values(of: str | Callable[[Row], Any]) -> list[Any]:
        return [row[of] if isinstance(of, str) else of(row) for row in rows]

    data = {heading: values(of) for heading, of in columns.items()}
    return Table(pd.DataFrame(data, index=values(label), dtype=object), **more)


def name_of(row: Row) -> str:
    return f"{row['engine']}:{row['profile']}"


def failure(row: Row) -> str:
    return f"{row['status']}: {row['reason']}" if row["status"] != "ok" else ""


def situation_section(results: Results) -> list[Section]:
    points, seed = results.points, results.plan.seed
    of_scene = {}
    for scene in results.plan.scenes:
        if (name := open_scene(scene, seed).name) in results.asks:
            of_scene[name] = situations_of(*scored(scene, seed))
    sizes = points.groupby("scenario").step_size.unique()
    middle = points.scenario.map({scene: sorted(k)[len(k) // 2] for scene, k in sizes.items()})
    here = points[points.step_size == middle].assign(situation=points.scenario.map(of_scene))
    here = here.assign(name=names_of(here)).explode("situation")
    medians = here.groupby(["situation", "name"], sort=False)[["error", "cost"]].median()
    titles = [t for t in SITUATIONS if t in set(here.situation)]
    names = list(dict.fromkeys(here.name))
    rows = {}
    for title in titles:
        errors = medians.error.loc[title]
        best = errors[np.isfinite(errors)].min()
        rows[title] = [
            TableCell(
                errors.get(name, np.nan),
                css="best" if errors.get(name) == best else "",
                side=f"{number(medians.cost.get((title, name), np.nan))} µs/s",
            )
            for name in names
        ]
    frame = pd.DataFrame(rows, index=names, dtype=object).T
    frame.index = [TableCell(title, notes=(TableCell(SITUATIONS[title]),)) for title in titles]
    says = (
        "The median, over the scenes of a situation, of the largest position error in radii, at the"
        " middle of the step sizes measured, and of the cost. The report judges all scenes, at"
        " other step sizes, so its answers may differ."
    )
    return [Section("Which engine for what", says, [Table(frame)], id="which")] if titles else []


def drawn_lines(points: pd.DataFrame) -> list[Line]:
    """A line for each engine over its step sizes; faint, the time without idle steps and calls;
    and as the exact answer is drawn, the Pareto front."""
    has = points[points.cost.notna() & np.isfinite(points.error)]
    height = np.maximum(has.error.to_numpy(float), LOWEST)
    best = front(has.cost.to_numpy(float), height)
    lines = [Line(style.TRUTH, has.cost.to_numpy(float)[best], height[best], faint=True)]
    for (engine, profile), group in has.groupby(WHO, sort=False):
        name, error = f"{engine}:{profile}", np.maximum(group.error.to_numpy(float), LOWEST)
        bare = group.bare if "bare" in group else without_idle(group.cost, group.idle)
        lines.append(Line(name, bare, error, faint=True))
        lines.append(Line(name, group.cost, error, name))
    return lines


def write_picture(path: Path, kept: pd.DataFrame) -> None:
    # of the figures that the repository keeps, as a file of its own
    parts = {"pooled error": "error", "pooled cost": "cost", "pooled cost less idle steps": "bare"}
    rows = kept[kept.figure.isin(parts)].assign(figure=kept.figure.map(parts))
    points = rows.pivot(index=[*WHO, "at"], columns="figure", values="value").reset_index()
    figure, axes = new_figure(7.6, 4.6)
    draw_lines(axes, drawn_lines(points), COST, ERROR, x_unit="µs")
    label = "Error against engine time of every engine, pooled over the scenes"
    put_text(path, svg_of(figure, label, alone=True))


def chart_of(
    lines: Sequence[Line],
    label: str,
    title: str,
    caption: str,
    x: str = COST,
    y: str = ERROR,
    x_unit: str = "µs",
) -> Chart:
    figure, axes = new_figure(7.6, 4.6)
    draw_lines(axes, lines, x, y, x_unit=x_unit)
    return Chart(svg_of(figure, label), title, caption)


def pooled_section(results: Results) -> Section:
    pooled = results.pooled
    steps, scenes = pooled.step_size.nunique(), counted(len(results.scenes), "scene")
    caption = (
        f"Each point is an engine at one of the {counted(steps, 'step size')} that all scenes have:"
        f" error and cost are geometric means of the middle half of {scenes}:"
        f" {', '.join(results.scenes)}. {said_of_pool(pooled)} Lower and further left is better. A"
        " scene in which an engine failed has an infinite error and an infinite cost. Thin lines:"
        " the time without that of as many steps and calls in an empty world. The black line is the"
        " Pareto front: no engine is better than its points in both error and cost. Errors below"
        f" {LOWEST:g} are drawn there."
    )
    chart = chart_of(drawn_lines(pooled), "error against cost", "Error against cost", caption)
    parts: list[Part] = [chart, reached_table(results)]
    return Section("All scenes pooled", results.noise_sentence, parts, id="pooled")


def reached_table(results: Results) -> Table:
    rows: dict[str, dict[str, TableCell]] = {}
    for row in results.pooled_reached.to_dict("records"):
        rows.setdefault(name_of(row), {})[row["accuracy"]] = TableCell(cost_of(row), row["why"])
    frame = pd.DataFrame.from_dict(rows, "index", dtype=object)[list(ACCURACIES)]
    caption = (
        "What an error, in radii, costs: µs per simulated second (in how many of the scenes), at"
        " the cheapest step size from which on all finer steps keep it, too. Each engine is"
        f" compared with {YARDSTICK} in the scenes in which both reach it: a cost is the geometric"
        f" mean of that of {YARDSTICK} over all its scenes, times that of the ratios. {NEVER}: in"
        " half of the scenes or more, no dt reaches the error, or the engine fails; k of n: too few"
        f" scenes to compare. {said_of_cheaper(results.pooled_reached)}"
    )
    return Table(frame, corner="Engine", caption=caption)


NEVER, NOT_REACHED = "never", "–"


def cost_of(row: Row) -> str:
    if np.isfinite(row["cost"]):
        got = f" ({row['got']})" if row["of"] > 1 else ""
        return number(row["cost"]) + got
    if row["lost"]:
        return NEVER
    return f"{row['got']} of {row['of']}" if row["of"] > 1 else NOT_REACHED


def versus_section(results: Results) -> Section:
    table = table_of(
        results.versus,
        name_of,
        {
            "changed": "change",
            f"time, × {YARDSTICK}": "ratio",
            "least": "low",
            "most": "high",
            "cheaper in scenes": lambda row: f"{row['cheaper']} of {row['scenes']}",
            "which": "cheaper_in",
            "without idle steps cheaper in": "bare_cheaper",
            "which of these": "bare_cheaper_in",
            "not timed in": "not_timed_in",
        },
        css="text",
        caption="In the same rounds at the same steps, scene by scene; then the same for every"
        " changed setting, in the scenes in which options are measured. An idle step is the loop"
        " that drives the engine from Python and the engine's own fixed cost of a step; the rest is"
        " the cost of the scene.",
    )
    title = f"Where engines with end-of-step detection cost less than {YARDSTICK}"
    return Section(title, "scene by scene", [table], True, "versus")


def models_section(results: Results) -> Section:
    table = table_of(
        results.models,
        "scenario",
        {
            "exact answer": "truth",
            "cheapest model to 10⁻⁶": lambda row: row["model"] or "none",
            "closed form, µs/s": "closed_us",
            "cheapest engine to 10⁻⁶": lambda row: row["engine"] or "none",
            "its cost, µs/s": "cost_us",
            "to 1 %": lambda row: row["loose_engine"] or "none",
            "its cost at 1 %, µs/s": "loose_us",
        },
        css="text",
    )
    says = (
        "How the exact answer of each scene is computed, the cheapest way (engine or closed form)"
        " to an error below 10⁻⁶ radii, and the cheapest engine with an error below 1 %. Exact"
        " answers share no code with any engine, even where an engine would be cheaper. –: no"
        " closed form."
    )
    return Section("The cheapest model that answers each scene", says, [table], True, "models")


def budget_sections(results: Results) -> list[Section]:
    budget, explained = results.measured.budget, results.explained
    if budget.empty:
        return []
    absent = [name for name in results.plan.engines if name not in set(names_of(explained))]
    closed = number(float(budget.closed_deviation_radii.max()), 1)
    texts = [
        "The ablated reference is the hand-written solver with an option for every mechanism by"
        " which engines differ. It starts with exact flight and end-of-step detection. Then each"
        " mechanism of an engine is enabled alone, at the middle dt. The contribution of a"
        " mechanism is the root mean square of what it changes, over disks and samples, in radii.",
        "Contributions are vectors and may cancel: their sum can be smaller than any of them. all"
        " is the ablated reference with all mechanisms enabled, engine is the engine itself, and"
        " residual is their difference. A scene is evaluated until end-of-step detection alone puts"
        " a disk off by more than half a radius: beyond that, contributions do not add up. So the"
        " explained share is that of the evaluated time, with the first seed.",
    ]
    if absent:
        texts.append(
            "The ablated reference has no mechanism of these engines, so they have no budget:"
            f" {', '.join(absent)}."
        )
    parts: list[Part] = [
        Text(texts),
        overview(budget),
        Text(items=[f"{k}: {v}" for k, v in TERMS.items()]),
        Text([f"The contribution of flight equals its formula to {closed} radii."]),
    ]
    if len(cuts := cut_scenes(explained)):
        columns: Columns = {
            "evaluated, s": "until_s",
            "exact answer, s": "horizon_s",
            "share, %": lambda row: f"{100 * row['until_s'] / row['horizon_s']:.0f}",
        }
        caption = "Scenes that are not evaluated up to the end of their exact answer"
        parts.append(table_of(cuts, "scenario", columns, caption=caption))
    parts.append(contributions(budget))
    changed = budget[budget[["off_engine_radii", "off_reference_radii"]].max(axis=1) > LEAST]
    if len(changed):
        columns = {
            "scene": "scenario",
            "without": "contribution",
            "in the engine, radii": "off_engine_radii",
            "in the reference, radii": "off_reference_radii",
            "deviation, radii": lambda row: number(row["off_deviation_radii"], 2),
        }
        caption = (
            f"Mechanisms disabled in the engine itself: {len(changed)}. Disabling one in the engine"
            " must change as much as in the ablated reference with all others enabled."
        )
        parts.append(table_of(changed, name_of, columns, caption=caption))
    says = f"Explained: {explained_share(explained)}."
    return [Section("What the errors are made of", says, parts, True, "budget")]


def causes(budget: pd.DataFrame) -> list[str]:
    contributions = set(budget.contribution)
    return [TIME, *(name for name in NAMES if name in contributions)]


def overview(budget: pd.DataFrame) -> Table:
    """In how many scenes an engine was played, has an error, has it explained, and in how many
    each contribution is the largest; every engine has its row, also one that failed them all."""
    columns = ["played", "errors", "explained", *causes(budget)]
    rows = {}
    for (engine, profile), group in budget.groupby(WHO, sort=False):
        played = group[group.note == ""]
        scenes = played.pivot(index="scenario", columns="contribution", values="position_radii")
        scenes = scenes.reindex(columns=[TOTAL, RESIDUAL, *causes(budget)]).fillna(0.0)
        off, known = scenes[scenes[TOTAL] > LEAST], scenes[causes(budget)]
        largest = known[known.max(axis=1) > LEAST].idxmax(axis=1)
        within = int((off[RESIDUAL] <= TO[0] * off[TOTAL]).sum())
        counts = [int((largest == cause).sum()) for cause in known.columns]
        rows[f"{engine}:{profile}"] = [len(scenes), len(off), within, *counts]
    caption = (
        "Counts of scenes: those played; those with an error above 10⁻⁹ radii; of these, those with"
        " a residual below 1 % of the error; and those in which each contribution is the largest."
    )
    frame = pd.DataFrame(rows, columns, dtype=object).T
    return Table(frame, corner="Engine", caption=caption)


def contributions(budget: pd.DataFrame) -> Table:
    # a row for each scene, which opens the root mean squares of each engine in radii
    opens: dict[str, list[Part]] = {}
    extents = {}
    for scene, here in budget.groupby("scenario", sort=False):
        here = here.assign(name=names_of(here))
        wide = here.pivot(index="name", columns="contribution", values="position_radii")
        of_anybody = [c for c in causes(budget) if c in wide and wide[c].max() > LEAST]
        columns = [TOTAL, RESIDUAL, *of_anybody, INTERPLAY, SUM, ALL]
        wide = wide.reindex(columns=columns, index=[*dict.fromkeys(here.name)])
        notes = here[here.note != ""]
        failed = [f"{row.name} has not played it: {row.note}" for row in notes.itertuples()]
        label = f"budget of {scene}"  # a row's label is its address
        opens[label] = [
            Table(wide.astype(object), caption="–: this engine does not have the mechanism."),
            Text(items=failed),
        ]
        extents[label] = here[["until_s", "horizon_s", "duration_s"]].iloc[0].tolist()
    headings = ["evaluated to, s", "exact answer to, s", "duration, s"]
    frame = pd.DataFrame.from_dict(extents, "index", columns=headings).astype(object)
    return Table(frame, corner="All contributions in", opens=opens)


def option_sections(results: Results) -> list[Section]:
    if results.options.empty:
        return []
    scenes = results.plan.option_scenes
    says = (
        "One option at a time is changed in the matched profile, at the middle dt of"
        f" {len(scenes)} scenes: {', '.join(scenes)}."
    )
    parts = [options_table(results.options)]
    return [Section("Options that a scene does not need", says, parts, True, "options")]


def options_table(options: pd.DataFrame) -> Table:
    return table_of(
        options,
        name_of,
        {
            "change": "change",
            "scene": "scenario",
            "time, × unchanged": "cost_ratio",
            "error, × unchanged": "error_ratio",
            "error, radii": "error_radii",
            "unchanged, radii": "error_radii_plain",
            "failed": failure,
        },
        sortable=True,
        corner="Engine",
        caption="An error of 0 has no ratio.",
    )


def sweep_sections(results: Results) -> list[Section]:
    if results.sweeps.empty:
        return []
    pooled = results.pooled_sweeps
    lines = []
    for (engine, profile), group in pooled.groupby(WHO, sort=False):
        name = str(profile).partition("+")[2] or str(profile)
        lines.append(Line(f"{engine}:{profile}", group.cost, group.error, name))
    count = counted(results.sweeps.scenario.nunique(), "scene")
    absent = tables.without_ratio(results.sweeps)
    without = ", ".join(f"{engine} in {scene}" for engine, scene in absent)
    caption = (
        "One line goes over more iterations or substeps at one dt; that of the matched profile from"
        " 4 times that dt to an eighth of it. Error and cost are divided by those of the matched"
        f" profile at that dt, where all lines meet. A point is the geometric mean of the middle"
        f" half of {count}."
        + (f" These have no ratio, because the divisor is 0: {without}." if without else "")
    )
    x, y = "time / time as matched", "error / error as matched"
    chart = chart_of(lines, "error against cost of sweeps", "Pooled", caption, x, y, "")
    says = (
        "There are two ways to reduce an error at a higher cost: more iterations or substeps at one"
        " dt, or a smaller dt. Where a line of iterations is level, these cost time and do not"
        " reduce the error."
    )
    title = "More work in a step, or more steps"
    return [Section(title, says, [chart, sweeps_table(results.sweeps)], True, "sweeps")]


def sweeps_table(sweeps: pd.DataFrame) -> Table:
    return table_of(
        sweeps,
        "scenario",
        {
            "engine": name_of,
            "value": lambda row: row["change"] or NOT_REACHED,
            "dt, s": "dt_s",
            "error, radii": "error",
            "95 % over the seeds": interval_of_seeds,
            "cost, µs/s": "cost",
            "failed": lambda row: failure(row) if row["failed"] else "",
        },
        sortable=True,
        corner="Scene",
    )


def interval(row: Row, value: str, digits: int) -> str:
    known = np.isfinite(row[value])
    return f"{number(row['low'], digits)} to {number(row['high'], digits)}" if known else ""


def interval_of_seeds(row: Row) -> str:
    if row["seeds"] < 2:
        return NOT_REACHED
    return f"{number(row['error_low'])} to {number(row['error_high'])}"


def size_sections(results: Results) -> list[Section]:
    costs, growth = results.sizes, results.growth
    if costs.empty:
        return []
    lines = [
        Line(f"{engine}:{profile}", group.n, group.cost, f"{engine}:{profile}")
        for (engine, profile), group in costs.groupby(WHO, sort=False)
    ]
    caption = f"A gas that covers 0.3 of its box, e = 1, dt = 1/240 s. {BUILDS}"
    title = "Cost of a step against the number of disks"
    chart = chart_of(lines, title, title, caption, "disks", "engine time of a step, µs", "")
    rows: dict[str, dict[str, TableCell]] = {}
    for row in costs.to_dict("records"):
        worst = f"worst {number(row['worst'])}"
        cell = TableCell(row["cost"], quartiles(row), side=worst)
        rows.setdefault(name_of(row), {})[f"{row['n']} disks"] = cell
    steps = pd.DataFrame.from_dict(rows, "index", dtype=object).fillna("")
    steps = steps[[f"{n} disks" for n in sorted(set(costs.n))]]
    parts: list[Part] = [chart, Table(steps, corner="µs a step"), growth_table(growth)]
    pile = results.pile
    if len(pile):
        columns: Columns = {"awake, µs": PLAIN, "with sleeping, µs": "sleeping"}
        n = int(pile.n.iloc[0])
        parts.append(table_of(pile, "name", columns, corner=f"A settled pile of {n} disks"))
    says = tables.end_of_all_pairs(costs)
    return [Section("How the cost grows", says, parts, id="sizes")]


def growth_table(growth: pd.DataFrame) -> Table:
    return table_of(
        growth,
        name_of,
        {
            "exponent from 100 disks on": "exponent",
            "95 % interval": lambda row: interval(row, "exponent", 3) or "too few sizes",
            "up to, disks": "most",
            "then": "stopped",
        },
    )


def quartiles(row: Row) -> str:
    return f"{number(row['low'])} to {number(row['high'])}, fastest {number(row['best'])}"


def driving_section(results: Results) -> Section:
    table = table_of(
        results.driving,
        name_of,
        {
            "a step, µs, many in a call": "step_us",
            "a call, µs on top": "call_us",
            "a read-out, µs, median of the scenes": "read_us",
            "largest, µs": "read_most_us",
        },
    )
    says = (
        "The cost of a step and of a call in a world with one static disk: the loop around the"
        " engine, and the engine's own fixed cost of a step. Every time on this page includes this"
        " cost, and none includes a read-out. An engine that takes many steps in one call pays for"
        " one call; pymunk and both Box2Ds take one step a call, in a loop of the adapter."
    )
    return Section("Driving from Python", says, [table], True, "driving")


def scenes_section(results: Results) -> Section:
    points = results.points.assign(name=names_of(results.points))
    rows, opens = {}, dict[str, list[Part]]()
    for scene, here in points.groupby("scenario", sort=False):
        fine = here[np.isfinite(here.error)]
        best = fine.name[fine.error.idxmin()] if len(fine) else ""
        until, whole = here.until_s.iloc[0], here.duration_s.iloc[0]
        rows[str(scene)] = [TableCell(results.asks[str(scene)]), until, whole, best]
        opens[str(scene)] = scene_parts(results, str(scene), here)
    headings = ["question", "scored to, s", "duration, s", "nearest engine"]
    frame = pd.DataFrame.from_dict(rows, "index", columns=headings, dtype=object)
    says = "A click opens error against cost, the order of convergence, and every point."
    table = Table(frame, opens=opens, sortable=True, corner="Scene", css="text")
    return Section("Scene by scene", says, [table], id="scenes")


def scene_parts(results: Results, scene: str, points: pd.DataFrame) -> list[Part]:
    noise, seeds = results.noise_floor(scene), int(points.seeds.max())
    until, whole = points.until_s.iloc[0], points.duration_s.iloc[0]
    caption = (
        "A point is one dt; the next point to the right has half of it. Time: the median of the"
        " rounds; thin: without that of as many steps and calls in an empty world."
    )
    if until < whole:
        caption += f" Scored to {until:.3g} of {whole:.3g} s, where the exact answer ends."
    if seeds > 1:
        caption += f" The error is the median over {seeds} seeds, with its 95 % bootstrap interval."
    if noise.pairs:
        caption += (
            " Noise floor: for half of the engines the ratio of two timings is"
            f" {number(noise.low)} to {number(noise.high)}."
        )
    if (points.wrapping > 0).any():
        caption += " The time does not include the wrap, which Python does for engines without one."
    chart = chart_of(drawn_lines(points), f"error against cost, {scene}", "", caption)
    orders = results.orders[results.orders.scenario == scene].merge(
        results.bindings[results.bindings.scenario == scene], on=["scenario", *WHO], how="left"
    )
    reached = {
        (name_of(row), row["accuracy"]): TableCell(row["why"], css="soft")
        if np.isnan(row["cost"])
        else TableCell(row["cost"], f"at dt {number(row['dt_s'])} s")
        for row in results.reached[results.reached.scenario == scene].to_dict("records")
    }

    def cost_at(accuracy: str) -> Callable[[Row], TableCell]:
        return lambda row: reached[name_of(row), accuracy]

    table = table_of(
        orders,
        name_of,
        {
            "order": lambda row: number(row["slope"], 2),
            "interval": lambda row: interval(row, "slope", 2),
            "with finer steps the error": lambda row: TableCell(
                VERDICTS.get(row["verdict"], row["verdict"]),
                css="bad" if row["verdict"] in (ELSEWHERE, UNSTEADY) else "",
            ),
            "failed of the steps": lambda row: (
                f"{row['failed']} of {row['steps']}" if row["failed"] else ""
            ),
            **{f"{accuracy} of a radius": cost_at(accuracy) for accuracy in ACCURACIES},
            "empty step, µs": "step_us",
            "call, µs on top": "call_us",
            "read-out, µs": "read_us",
        },
        caption="Order: the p of error ∝ dtᵖ, with its 95 % interval. Cost: µs per simulated second"
        " at the largest dt that reaches this accuracy.",
    )
    return [chart, table, points_table(points)]


def points_table(points: pd.DataFrame) -> Table:
    return table_of(
        points,
        name_of,
        {
            "dt, s": "dt_s",
            "error, radii": "error",
            "95 % over the seeds": interval_of_seeds,
            "cost, µs/s": "cost",
            "quartiles, µs/s": quartiles,
            "idle steps, µs/s": "idle",
            "wrapping, µs/s": "wrapping",
            "failed": lambda row: (
                f"{row['failed']} of {row['seeds']}: {failure(row)}" if row["failed"] else ""
            ),
        },
        sortable=True,
        corner="Engine",
    )
