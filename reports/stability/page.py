"""Writes stability.html: the limits, the maps, and a replay of the first run that failed at each
limit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from math import isfinite, isnan, nan
from pathlib import Path

import numpy as np
import pandas as pd
from markupsafe import Markup

from crosscheck2d.reports.page.drawing import Line, draw_lines, new_figure, svg_of
from crosscheck2d.reports.page.kit import (
    Chart,
    Page,
    Part,
    Playback,
    Section,
    Table,
    TableCell,
    Text,
    neighbours,
    render_page,
    run_section,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.reports.stability.cases import FAMILY_OF, OWN_SCENE, case_named
from crosscheck2d.reports.stability.limits import (
    EXACT,
    FORMS,
    NEVER_FAILS,
    NEVER_WORKS,
    Case,
    Limit,
)
from crosscheck2d.reports.stability.overview import (
    MARKS,
    WORDS,
    bracket,
    findings,
    held,
    in_words,
    where_it_works,
    why,
)
from crosscheck2d.reports.stability.predicates import REFUSED, Predicate
from crosscheck2d.reports.stability.results import StabilityResults
from crosscheck2d.reports.stability.tables import (
    AT_ONCE,
    GAPS,
    MAPS,
    PAIRS,
    TOUCHING,
    AtGap,
    LawOf,
    MapOf,
)
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.foreign_text import put_text

GENERATOR = "crosscheck stability"
FITS = 12  # columns of the table of limits in the width of a page
SHARES = (0.3, 1.0, 5.0, 100.0)  # of the bound of a map: where its colours begin


def write_page(path: Path, results: StabilityResults) -> None:
    names = list(dict.fromkeys(result.engine for result in results.all))
    sections = [
        *limit_sections(results.limits, names),
        *([map_section(results.maps)] if results.maps else []),
        *([law_section(results.laws)] if results.laws else []),
        run_section(results.header),
    ]
    page = Page(
        "Where 2D disk solvers fail",
        sections,
        GENERATOR,
        lead(results, names),
        (*names, TRUTH),
        links=neighbours(path, "stability"),
        footer=WORDS["footer"],
    )
    put_text(path, render_page(page))


def lead(results: StabilityResults, names: Sequence[str]) -> list[str | Markup]:
    form, changed = FORMS[results.header["form"]], [name for name in names if "+" in name]
    how = WORDS["full"] if form.whole else WORDS["quick"].format(form.few)
    cases = {limit.case for limit in results.limits}
    alike = sum(case.startswith("dt_") for case in cases)
    counts = WORDS["engines"].format(counted(len(names) - len(changed), "engine"))
    counts += WORDS["changed"].format(len(changed), changed[0]) if changed else ""
    counts += f". {counted(len(cases), 'case')}"
    counts += WORDS["alike"].format(alike) if alike else ""
    return [Markup(WORDS["lead"]).format(number(100 * (form.ratio - 1)), how), f"{counts}."]


def limit_sections(limits: Sequence[Limit], names: Sequence[str]) -> list[Section]:
    if not limits:
        return []
    engines = [name for name in names if "+" not in name and any(x.engine == name for x in limits)]
    index, rows, groups, opens = [], [], [], dict[str, list[Part]]()
    for name, members in groupby(limits, lambda limit: limit.case):
        case, of_case = case_named(name), list(members)
        of_engine = {limit.engine: limit for limit in of_case}
        label = name if name in FAMILY_OF else Path(name).name
        constant = ", ".join(f"{symbol} {value}" for symbol, value in held(case).items())
        note = "; ".join(filter(None, [case.with_unit(case.parameter), constant]))
        index.append(TableCell(label, title=case.asks, notes=(TableCell(note, css="soft"),)))
        rows.append([cell_of(case, of_engine.get(engine)) for engine in engines])
        groups.append(FAMILY_OF.get(name, OWN_SCENE))
        opens[label] = case_parts(case, of_case)
    heads = [TableCell(name.replace(":", ": "), title=name) for name in engines]
    frame = pd.DataFrame(rows, index=index, columns=heads, dtype=object)
    css = "fixed limits" if len(engines) <= FITS else "plain limits"
    marks = "; ".join(f"{mark}: {meaning}" for mark, meaning in MARKS.items())
    table = Table(frame, groups, opens=opens, css=css, corner="case", caption=f"{marks}.")
    return [
        Section("In short", parts=[Text(items=findings(limits))], id="summary"),
        Section("Limits", WORDS["cells"], [table], id="limits"),
    ]


def cell_of(case: Case, limit: Limit | None) -> TableCell:
    # the gentler the value at which it fails, the deeper its colour
    if limit is None:
        return TableCell("")
    if limit.verdict == NEVER_FAILS:
        return TableCell(in_words(limit), f"does not fail up to {number(limit.works_at)}", css="g0")
    css = "bad"
    if limit.verdict != NEVER_WORKS and limit.status == "ok":
        gentler = sum(case.harsher * value < case.harsher * limit.fails_at for value in case.values)
        css = f"g{max(1, min(4, round(4 * (1 - gentler / len(case.values)))))}"
    return TableCell(in_words(limit), f"{limit.verdict}. {why(limit)}", css=css)


def case_parts(case: Case, limits: Sequence[Limit]) -> list[Part]:
    engines: dict[tuple[str, str, str], list[str]] = {}
    for limit in limits:
        if limit.verdict != NEVER_FAILS:
            source, shown = (limit.cause.source, limit.cause.shown) if limit.cause else ("", "")
            engines.setdefault((why(limit), source, shown), []).append(limit.engine)
    causes = []
    for (text, source, shown), names in engines.items():
        beside = "; ".join(filter(None, [source, f"tested: {shown}" if shown else ""]))
        cause = Markup("<b>{}</b>: {} <small>{}</small>")
        causes.append(cause.format(", ".join(names), text, beside))
    asks = Text([Markup("<b>{}</b>").format(case.asks), *facts(case)])
    folds = [replay_of(case, limit) for limit in limits if limit.failing and limit.replay]
    parts: list[Part] = [asks, limit_table(limits), Text(items=causes)]
    if folds:
        parts += [Text([Markup("<b>The first runs that failed</b>")]), *folds]
    return [*parts, readings(case, limits)]


def facts(case: Case) -> list[str]:
    ends, predicate = (number(case.values[0]), number(case.values[-1])), case.predicate
    fails = predicate.name, predicate.means, above(predicate)
    runs = WORDS["runs"].format(case.runs) if case.runs > 1 else WORDS["one_run"]
    runs += WORDS["by_chance"].format(round(1 / case.by_chance)) if case.by_chance else ""
    return [WORDS["fails"].format(case.with_unit(case.parameter), *ends, *fails), f"{runs}."]


def above(predicate: Predicate) -> str:
    return f"above {number(predicate.bound)} {predicate.unit}".removesuffix(" 1")


def limit_table(limits: Sequence[Limit]) -> Table:
    rows = []
    for limit in limits:
        works, fails = bracket(limit)
        trial = limit.failing if limit.status == "ok" else limit.trials[0]
        event = f"{trial.broken}: {trial.event}" if trial else "–"
        share = f"{trial.failed} of {trial.runs}" if trial else "–"
        odd = where_it_works(limit)
        says = TableCell(event, notes=(TableCell(odd, css="soft"),) if odd else ())
        scanned = "–" if isnan(limit.spacing) else f"× {number(limit.spacing)}"
        fails_cell = TableCell(fails, css="bad" if limit.verdict == NEVER_WORKS else "")
        rows.append([works, fails_cell, scanned, share, str(limit.runs), says])
    heads = ["works at", "fails at", "scanned", "failed there", "runs in all", "what happened"]
    frame = pd.DataFrame(rows, [limit.engine for limit in limits], heads, dtype=object)
    return Table(frame, css="plain text stack", corner="engine", caption=WORDS["scanned"])


def replay_of(case: Case, limit: Limit) -> Section:
    assert limit.failing is not None
    label = f"{case.parameter} = {number(limit.failing.value)}: {limit.failing.event}"
    beside = EXACT if case.shown_with == EXACT else f"the same gas {case.shown_with}"
    replay = Playback(limit.replay, limit.ratio, label, WORDS["replay"].format(beside))
    return Section(limit.engine, label, [replay], folded=True)


def readings(case: Case, limits: Sequence[Limit]) -> Chart | Text:
    """The worst reading of every engine against the parameter, with the bound above which it fails;
    for a case that reads nothing else, the share of runs that failed."""
    predicate, lines = case.predicate, []
    what = (
        f"{predicate.name.capitalize()}, {predicate.unit if predicate.bound else 'share of runs'}"
    )
    caption = WORDS["worst" if predicate.bound else "share"].format(case.parameter)
    for limit in limits:
        points = [
            # 0 is nowhere on a log scale
            (trial.value, abs(trial.worst) or nan if predicate.bound else trial.failed / trial.runs)
            for trial in limit.trials
            if isfinite(trial.value)
            and (isfinite(trial.worst) if predicate.bound else not trial.left)
        ]
        if len(points) > 1:
            x, y = zip(*points)
            lines.append(Line(limit.engine, x, y, limit.engine))
    if not any(y > 0 for line in lines for y in np.asarray(line.y)):
        return Text(["No engine reads more than 0 anywhere."])
    figure, axes = new_figure(9.5, 3.6)
    if predicate.bound:
        axes.axhline(predicate.bound, color="#57626e", linestyle=":", linewidth=1.3)
    if case.harsher < 0:
        axes.invert_xaxis()
    draw_lines(axes, lines, case.with_unit(case.parameter), what, "xy" if predicate.bound else "x")
    return Chart(svg_of(figure, f"{what}, of each engine"), "All readings", caption)


def map_section(maps: Sequence[MapOf]) -> Section:
    names = list(dict.fromkeys(result.name for result in maps))
    opens: dict[str, list[Part]] = {result.engine: [] for result in maps}
    frame = pd.DataFrame("", index=list(opens), columns=names, dtype=object)
    for result in maps:
        frame.loc[result.engine, result.name] = result.status
        if result.cells:
            fails = sum(cell[3] for cell in result.cells)
            frame.loc[result.engine, result.name] = f"{fails} of {len(result.cells)}"
            opens[result.engine].append(grid(result))
    rows = [MAPS[name] for name in names]
    asks = [
        WORDS["map"].format(name, row.asks, row.predicate.means, above(row.predicate))
        for name, row in zip(names, rows)
    ]
    table = Table(frame, opens=opens, css="plain", corner="engine")
    return Section("Two parameters at once", WORDS["maps"], [Text(items=asks), table], id="maps")


def grid(result: MapOf) -> Table:
    # a reading is coloured by its share of the bound
    chart, at = MAPS[result.name], dict[tuple[float, float], TableCell]()
    for x, y, value, failed, kind, event in result.cells:
        happens = f"{kind}: {event}" if failed else ""
        if isnan(value):
            at[x, y] = TableCell("r" if kind == REFUSED else "!", happens, css="bad")
        else:
            depth = sum(value / chart.predicate.bound > share for share in SHARES)
            title = "; ".join(filter(None, [number(value), happens]))
            at[x, y] = TableCell("×" if failed else "", title, css=f"g{depth}")
    rows = [[at[x, y] for x in chart.x] for y in reversed(chart.y)]
    index = [number(y) for y in reversed(chart.y)]
    heads = [TableCell(number(x, 2)) for x in chart.x]
    caption = WORDS["grid"].format(result.name, chart.x_name, chart.y_name)
    frame = pd.DataFrame(rows, index, heads, dtype=object)
    return Table(frame, css="plain number", caption=caption)


def law_section(laws: Sequence[LawOf]) -> Section:
    rows = []
    for law in laws:
        cells = [law_cell(at) for at in law.gaps]
        off = max((at.momentum for at in law.gaps), default=np.nan)
        lost = [TableCell(law.status, css="bad", span=len(GAPS)), *[""] * (len(GAPS) - 1)]
        rows.append([*(cells or lost), "–" if isnan(off) else number(off, 1)])
    gaps = [TableCell(number(gap) if gap else "touching") for gap in GAPS]
    heads = [*gaps, TableCell("momentum", notes=(TableCell("off by, at most", css="soft"),))]
    frame = pd.DataFrame(rows, [law.engine for law in laws], heads, dtype=object)
    groups = [f"{law.name}: {TOUCHING[law.name].asks}" for law in laws]
    sources = [f"{name}: {TOUCHING[name].source}." for name in dict.fromkeys(x.name for x in laws)]
    spans = [(TableCell("gap in radii"), len(GAPS))]
    table = Table(frame, groups, spans, css="plain", corner="engine")
    return Section(
        "Touching disks: which law", WORDS["laws"], [table, Text(items=sources)], id="touching"
    )


def law_cell(at: AtGap) -> TableCell:
    if not at.velocity:
        return TableCell(at.law, css="bad")
    motion = "; ".join(f"({number(x, 2)}, {number(y, 2)})" for x, y in at.velocity)
    title = f"{number(at.off, 2)} off, energy {number(at.energy)}; leave with {motion}"
    words = {PAIRS: ("pairs", ""), AT_ONCE: ("at once", "g1")}
    word, css = words.get(at.law, (f"energy {at.energy:.2f}", "g3"))
    return TableCell(word, title, css=css)
