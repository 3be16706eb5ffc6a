"""The page of a measurement as sections of the page kit: each table of `tables.Results`, and its
charts of error against cost and of cost against the number of disks. Its words are in page.toml."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from string import Formatter
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.mechanisms.table import NAMES
from crosscheck2d.reports.compare.accuracy import (
    ACCURACIES,
    ELSEWHERE,
    UNSTEADY,
    WHO,
    front,
    said_of_cheaper,
    said_of_pool,
    without_idle,
)
from crosscheck2d.reports.page import kit, style
from crosscheck2d.reports.page.drawing import Line, draw_lines, new_figure, svg_of
from crosscheck2d.reports.page.kit import neighbours
from crosscheck2d.reports.page.scenes import SITUATIONS, situations_of
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import budget
from crosscheck2d.reports.speed.ladder import scored
from crosscheck2d.reports.speed.tables import Results, end_of_all_pairs, names_of, pooled_sweeps
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.foreign_text import put_text

GENERATOR = "crosscheck speed"
COST, ERROR = "engine time per simulated second", "error, radii"
# radii; smaller errors, a tenth of the finest accuracy asked for, are drawn here
LOWEST = 1e-7
BUSY = 0.25  # cores that others keep busy, above which the page warns
NEVER, NOT_REACHED = "never", "–"
VERDICTS = {
    "exact": "is below 10⁻⁶ at any dt",
    UNSTEADY: "is not monotone",
    "failed": "unknown: failed",
}
TEXT: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("page.toml").read_text(encoding="utf-8")
)


class NumberFormatter(Formatter):
    """Fills `{name:digits}` in with a number of so many digits, of three without."""

    def format_field(self, value: Any, format_spec: str) -> str:
        return value if isinstance(value, str) else number(value, int(format_spec or 3))


FORMAT = NumberFormatter()


def text(key: str, part: str, **values: Any) -> str:
    words = " ".join(str(TEXT[key].get(part, "")).split())
    return FORMAT.vformat(words, (), values).strip()


def section(key: str, parts: Sequence[kit.Part], **values: Any) -> kit.Section:
    folded = TEXT[key].get("folded", False)
    return kit.Section(text(key, "title"), text(key, "says", **values), parts, folded, key)


def table(key: str, frame: pd.DataFrame, **cells: Any) -> kit.Table:
    """A table with a row for each of a frame; `cells` are columns beside those of the frame. A text
    of which no number is known is NaN."""
    words, frame = TEXT[key], frame.assign(**cells)
    if "profile" in frame:
        frame["name"] = names_of(frame)
    if "status" in frame:  # and in how many of the seeds
        counts = zip(frame.failed, frame.seeds) if "seeds" in frame else ()
        seeds = [f"{failed} of {seeds}: " for failed, seeds in counts] or [""] * len(frame)
        failures = zip(seeds, frame.status, frame.reason)
        frame["failure"] = [f"{k}{s}: {why}" if s != "ok" else "" for k, s, why in failures]
    rows: list[Any] = frame.to_dict("records")

    def cell(row: dict[str, Any], of: str) -> Any:
        names = re.findall(r"{(\w+)", of)
        if names and all(pd.isna(row[name]) for name in names):
            return np.nan
        return FORMAT.vformat(of, (), row) if names else row[of]

    columns = {head: [cell(row, of) for row in rows] for head, of in words["columns"].items()}
    index = [row[words.get("label", "name")] for row in rows]
    known = {name: words[name] for name in ("sortable", "css", "corner") if name in words}
    data = pd.DataFrame(columns, index=index, dtype=object)
    return kit.Table(data, caption=text(key, "caption", count=len(frame)), **known)


def write_page(path: Path, results: Results, about: Mapping[str, Any]) -> None:
    """Write the page of `results`; `about` holds command, seed, machine, versions, started,
    seconds, load."""
    engines = results.points[np.isfinite(results.points.error)][WHO].drop_duplicates()
    scenes, plan = counted(len(results.asks), "scene"), results.plan
    lead = [text("page", "lead", engines=counted(len(engines), "engine"), scenes=scenes)]
    lead.append(text("page", "advise"))
    if about["load"] > BUSY:
        lead.append(text("page", "busy", load=about["load"], cores=about["machine"]["cores"]))
    options = plan.effort.option_scenes
    sections = [
        situation_section(results),
        pooled_section(results),
        section("versus", [table("versus", results.versus)]),
        section("models", [table("models", results.models.replace("", "none"))]),
        budget_section(results),
        None
        if results.options.empty
        else section(
            "options",
            [table("options", results.options)],
            count=len(options),
            scenes=", ".join(options),
        ),
        sweep_section(results),
        size_section(results),
        section("driving", [table("driving", results.driving)]),
        scenes_section(results),
    ]
    if items := [f"{what}: {reason}" for what, reason in results.measured.left_out]:
        sections.append(kit.Section(f"Left out: {len(items)}", "", [kit.Text(items=items)], True))
    page = kit.Page(
        "Speed against accuracy",
        [*filter(None, sections), kit.run_section(about)],
        GENERATOR,
        lead,
        names=[*plan.engines, *(sweep.name for sweep in plan.sweeps)],
        links=neighbours(path, "speed"),
        footer=text("page", "footer", command=about["command"]),
    )
    put_text(path, kit.render_page(page))


def situation_section(results: Results) -> kit.Section | None:
    points, plan = results.points, results.plan
    of_scene = {}
    for scene in plan.effort.scenes:
        if (name := open_scene(scene, plan.seed).name) in results.asks:
            of_scene[name] = situations_of(*scored(scene, plan.seed))
    sizes = points.groupby("scenario").step_size.unique()
    middle = points.scenario.map({scene: sorted(k)[len(k) // 2] for scene, k in sizes.items()})
    here = points[points.step_size == middle].assign(name=names_of)
    here = here.assign(situation=here.scenario.map(of_scene)).explode("situation")
    medians = here.groupby(["situation", "name"], sort=False)[["error", "cost"]].median()
    names, rows = list(dict.fromkeys(here.name)), {}
    for title in (title for title in SITUATIONS if title in set(here.situation)):
        cells = medians.loc[title].reindex(names)
        best = cells.error[np.isfinite(cells.error)].min()
        rows[kit.TableCell(title, notes=(kit.TableCell(SITUATIONS[title]),))] = [
            kit.TableCell(error, css="best" if error == best else "", side=f"{number(cost)} µs/s")
            for error, cost in zip(cells.error, cells.cost)
        ]
    frame = pd.DataFrame([*rows.values()], [*rows], names, dtype=object)
    return section("which", [kit.Table(frame)]) if rows else None


def drawn_lines(points: pd.DataFrame) -> list[Line]:
    """A line for each engine over its step sizes; faint, the time without idle steps and calls;
    and as the exact answer is drawn, the Pareto front."""
    has = points[points.cost.notna() & np.isfinite(points.error)]
    has = has.assign(name=names_of, error=has.error.clip(lower=LOWEST))
    if "bare" not in has:
        has["bare"] = without_idle(has.cost, has.idle)
    best = has.iloc[front(has.cost.to_numpy(float), has.error.to_numpy(float))]
    lines = [Line(style.TRUTH, best.cost.to_numpy(), best.error.to_numpy(), faint=True)]
    for name, group in has.groupby("name", sort=False):
        lines.append(Line(str(name), group.bare, group.error, faint=True))
        lines.append(Line(str(name), group.cost, group.error, str(name)))
    return lines


def drawn(
    lines: Sequence[Line],
    label: str,
    x: str = COST,
    y: str = ERROR,
    x_unit: str = "µs",
    alone: bool = False,
) -> str:
    figure, axes = new_figure(7.6, 4.6)
    draw_lines(axes, lines, x, y, x_unit=x_unit)
    return svg_of(figure, label, alone=alone)


def write_picture(path: Path, kept: pd.DataFrame) -> None:
    # of the figures that the repository keeps, as a file of its own
    parts = {"pooled error": "error", "pooled cost": "cost", "pooled cost less idle steps": "bare"}
    rows = kept[kept.figure.isin(parts)].assign(figure=kept.figure.map(parts))
    points = rows.pivot(index=[*WHO, "at"], columns="figure", values="value").reset_index()
    label = "Error against engine time of every engine, pooled over the scenes"
    put_text(path, drawn(drawn_lines(points), label, alone=True))


def pooled_section(results: Results) -> kit.Section:
    pooled, scenes = results.pooled, counted(len(results.asks), "scene")
    caption = text(
        "pooled",
        "caption",
        steps=counted(pooled.step_size.nunique(), "step size"),
        scenes=scenes,
        names=", ".join(results.asks),
        pool=said_of_pool(pooled),
        lowest=LOWEST,
    )
    svg = drawn(drawn_lines(pooled), "error against cost")
    chart = kit.Chart(svg, "Error against cost", caption)
    return section("pooled", [chart, reached_table(results)], noise=results.noise_sentence)


def in_first_order(table: pd.DataFrame, columns: str) -> pd.DataFrame:
    # cell by name and `columns`, the names in the order of appearance
    wide = table.pivot(index="name", columns=columns, values="cell")
    return wide.loc[[*dict.fromkeys(table.name)]]


def reached_table(results: Results) -> kit.Table:
    reached = results.pooled_reached
    rows = reached.to_dict("records")
    cells: list[Any] = [kit.TableCell(cost_of(row), row["why"]) for row in rows]
    frame = in_first_order(reached.assign(name=names_of, cell=cells), "accuracy")
    caption = text("reached", "caption", cheaper=said_of_cheaper(reached))
    return kit.Table(frame[[*ACCURACIES]], corner="Engine", caption=caption)


def cost_of(row: Mapping[Hashable, Any]) -> str:
    if np.isfinite(row["cost"]):
        got = f" ({row['got']})" if row["of"] > 1 else ""
        return number(row["cost"]) + got
    if row["lost"]:
        return NEVER
    return f"{row['got']} of {row['of']}" if row["of"] > 1 else NOT_REACHED


def budget_section(results: Results) -> kit.Section | None:
    frame, explained = results.measured.budget, results.explained
    if frame.empty:
        return None
    texts = [text("budget", "reference"), text("budget", "sum")]
    absent = [name for name in results.plan.engines if name not in set(names_of(explained))]
    if absent:
        texts.append(text("budget", "absent", names=", ".join(absent)))
    closed = float(frame.closed_deviation_radii.max())
    parts: list[kit.Part] = [
        kit.Text(texts),
        overview(frame),
        kit.Text(items=[f"{name}: {text('terms', name)}" for name in TEXT["terms"]]),
        kit.Text([text("budget", "flight", closed=closed)]),
    ]
    if len(cuts := budget.cut_scenes(explained)):
        share = (100 * cuts.until_s / cuts.horizon_s).map("{:.0f}".format)
        parts.append(table("cut", cuts, share=share))
    parts.append(contributions(frame))
    changed = frame[frame[["off_engine_radii", "off_reference_radii"]].max(axis=1) > budget.LEAST]
    if len(changed):
        parts.append(table("disabled", changed))
    return section("budget", parts, share=budget.explained_share(explained))


def causes(parts: pd.DataFrame) -> list[str]:
    contributions = set(parts.contribution)
    return [budget.TIME, *(name for name in NAMES if name in contributions)]


def overview(parts: pd.DataFrame) -> kit.Table:
    """In how many scenes an engine was played, has an error, has it explained, and in how many
    each contribution is the largest; every engine has its row, also one that failed them all."""
    rows = {}
    for (engine, profile), group in parts.groupby(WHO, sort=False):
        played = group[group.note == ""]
        scenes = played.pivot(index="scenario", columns="contribution", values="position_radii")
        scenes = scenes.reindex(columns=[budget.TOTAL, budget.RESIDUAL, *causes(parts)]).fillna(0.0)
        off, known = scenes[scenes[budget.TOTAL] > budget.LEAST], scenes[causes(parts)]
        largest = known[known.max(axis=1) > budget.LEAST].idxmax(axis=1)
        within = off[budget.RESIDUAL] <= budget.TO[0] * off[budget.TOTAL]
        counts = {"played": len(scenes), "errors": len(off), "explained": int(within.sum())}
        counts |= {cause: int((largest == cause).sum()) for cause in known.columns}
        rows[f"{engine}:{profile}"] = counts
    frame = pd.DataFrame.from_dict(rows, "index", dtype=object)
    return kit.Table(frame, corner="Engine", caption=text("budget", "overview"))


def contributions(parts: pd.DataFrame) -> kit.Table:
    # a row for each scene, which opens the root mean squares of each engine in radii
    opens: dict[str, list[kit.Part]] = {}
    extents = {}
    for scene, here in parts.groupby("scenario", sort=False):
        here = here.assign(name=names_of)
        wide = here.pivot(index="name", columns="contribution", values="position_radii")
        known = [c for c in causes(parts) if c in wide and wide[c].max() > budget.LEAST]
        totals = [budget.INTERPLAY, budget.SUM, budget.ALL]
        columns = [budget.TOTAL, budget.RESIDUAL, *known, *totals]
        wide = wide.reindex(columns=columns, index=[*dict.fromkeys(here.name)])
        notes = here[here.note != ""]
        items = [text("budget", "failed", name=n, note=x) for n, x in zip(notes.name, notes.note)]
        label = f"budget of {scene}"  # a row's label is its address
        caption = text("budget", "all")
        opens[label] = [kit.Table(wide.astype(object), caption=caption), kit.Text(items=items)]
        extents[label] = here[["until_s", "horizon_s", "duration_s"]].iloc[0].tolist()
    headings = ["evaluated to, s", "exact answer to, s", "duration, s"]
    frame = pd.DataFrame.from_dict(extents, "index", columns=headings).astype(object)
    return kit.Table(frame, corner="All contributions in", opens=opens)


def sweep_section(results: Results) -> kit.Section | None:
    sweeps = results.sweeps
    if sweeps.empty:
        return None
    pooled, absent = pooled_sweeps(sweeps)
    lines = []
    for (engine, profile), group in pooled.groupby(WHO, sort=False):
        name = str(profile).partition("+")[2] or str(profile)
        lines.append(Line(f"{engine}:{profile}", group.cost, group.error, name))
    caption = text("sweeps", "pooled", scenes=counted(sweeps.scenario.nunique(), "scene"))
    if absent:
        names = ", ".join(f"{engine} in {scene}" for engine, scene in absent)
        caption += f" {text('sweeps', 'without', names=names)}"
    x, y = "time / time as matched", "error / error as matched"
    chart = kit.Chart(drawn(lines, "error against cost of sweeps", x, y, ""), "Pooled", caption)
    named = sweeps.assign(change=sweeps.change.replace("", NOT_REACHED))
    return section("sweeps", [chart, seeds_table("sweeps", named)])


def seeds_table(key: str, frame: pd.DataFrame) -> kit.Table:
    several = frame.seeds > 1
    low, high = frame.error_low.where(several), frame.error_high.where(several)
    return table(key, frame, error_low=low, error_high=high)


def size_section(results: Results) -> kit.Section | None:
    costs = results.sizes.assign(name=names_of)
    if costs.empty:
        return None
    lines = [
        Line(str(name), group.n, group.cost, str(name))
        for name, group in costs.groupby("name", sort=False)
    ]
    title = "Cost of a step against the number of disks"
    svg = drawn(lines, title, "disks", "engine time of a step, µs", "")
    quartiles = "{low} to {high}, fastest {best}"
    rows: list[Any] = costs.to_dict("records")
    cells: list[Any] = [
        kit.TableCell(
            row["cost"],
            FORMAT.vformat(quartiles, (), row),
            side=f"worst {number(row['worst'])}",
        )
        for row in rows
    ]
    steps = in_first_order(costs.assign(cell=cells), "n").fillna("")
    parts: list[kit.Part] = [
        kit.Chart(svg, title, text("sizes", "caption")),
        kit.Table(steps.rename(columns="{} disks".format), corner="µs a step"),
        table("growth", results.growth),
    ]
    if len(results.pile):
        parts.append(table("pile", results.pile))
    return section("sizes", parts, sentence=end_of_all_pairs(costs))


def scenes_section(results: Results) -> kit.Section:
    points = results.points.assign(name=names_of)
    rows, opens = {}, dict[str, list[kit.Part]]()
    for key, here in points.groupby("scenario", sort=False):
        scene, fine = str(key), here[np.isfinite(here.error)]
        best = fine.name[fine.error.idxmin()] if len(fine) else ""
        until, whole = here.until_s.iloc[0], here.duration_s.iloc[0]
        rows[scene] = [kit.TableCell(results.asks[scene]), until, whole, best]
        opens[scene] = scene_parts(results, scene, here)
    headings = ["question", "scored to, s", "duration, s", "nearest engine"]
    frame = pd.DataFrame.from_dict(rows, "index", columns=headings, dtype=object)
    return section("scenes", [kit.Table(frame, (), (), opens, True, "text", "Scene")])


def scene_parts(results: Results, scene: str, points: pd.DataFrame) -> list[kit.Part]:
    noise, seeds = results.noise_floor(scene), int(points.seeds.max())
    until, whole = points.until_s.iloc[0], points.duration_s.iloc[0]
    says = {
        "caption": True,
        "until": until < whole,
        "seeds": seeds > 1,
        "noise": noise.pairs > 0,
        "wrapping": (points.wrapping > 0).any(),
    }
    values = {"until": until, "whole": whole, "seeds": seeds, "low": noise.low, "high": noise.high}
    caption = " ".join(text("scenes", part, **values) for part, holds in says.items() if holds)
    svg = drawn(drawn_lines(points), f"error against cost, {scene}")
    orders, bindings, reached = (
        frame[frame.scenario == scene].drop(columns="scenario")
        for frame in (results.orders, results.bindings, results.reached)
    )
    cells: list[Any] = [
        kit.TableCell(row["why"], css="soft")
        if np.isnan(row["cost"])
        else kit.TableCell(row["cost"], f"at dt {number(row['dt_s'])} s")
        for row in reached.to_dict("records")
    ]
    costs = (
        reached.assign(cell=cells).pivot(index=WHO, columns="accuracy", values="cell").reset_index()
    )
    frame = orders.merge(bindings, on=WHO, how="left").merge(costs, on=WHO, how="left")
    verdicts: list[Any] = [
        kit.TableCell(VERDICTS.get(v, v), css="bad" * (v in (ELSEWHERE, UNSTEADY)))
        for v in frame.verdict
    ]
    failed = [f"{k} of {n}" if k else "" for k, n in zip(frame.failed, frame.steps)]
    known = frame.slope.notna()
    shown = {"low": frame.low.where(known), "high": frame.high.where(known)}
    parts = table("orders", frame, verdict=verdicts, failure=failed, **shown)
    return [kit.Chart(svg, "", caption), parts, seeds_table("points", points)]
