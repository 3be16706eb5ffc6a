"""Writes stability.html: the limits, the maps, and a replay of the first run that failed at each
limit."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isnan
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
from crosscheck2d.reports.stability.cases import FAMILY_OF, case_named
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
    bracket,
    findings,
    held,
    in_report,
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
CELLS = (
    "Each cell shows the first value, from gentle to harsh, at which an engine fails: the"
    " deeper the colour, the gentler that value. Below each name are the parameter that is"
    " varied, and the step size dt and the radius R of the disks that move, if constant. A row"
    " opens on its failing runs, their causes and all readings."
)
WHICH_LAW = (
    "When a disk strikes touching disks, mechanics does not determine the order of their"
    " collisions. There is no single right answer, so engines are not scored. The table names the"
    " law that an engine follows, within 2 % of the incoming speed, at gaps from none to a radius."
    " pairs: Newton's law for one pair after the other; if the disks do not touch, this is the"
    " exact answer. at once: Newton's law at all contacts in one solve. Both laws conserve the"
    " energy. If an engine follows neither, the cell shows the share of the energy that remains."
    " Some engines do not take disks that just touch as a contact. Without a gap they follow pairs,"
    " but another law if the disks overlap by a rounding error: crosscheck lesson row shows this"
    " for pymunk."
)


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
        footer="The table is in limits.csv, the maps are in maps.csv, and the laws of touching"
        " disks in laws.csv.",
    )
    put_text(path, render_page(page))


def lead(results: StabilityResults, names: Sequence[str]) -> list[str | Markup]:
    form, changed = FORMS[results.header["form"]], [name for name in names if "+" in name]
    how = (
        "The full form plays all runs of a case at every value, and values half way between those"
        " of the quick form."
        if form.whole
        else f"The quick form plays {form.few} runs at each value, and next to the limit all runs"
        " of the case; it stops at the first failing run of a value."
    )
    cases = list(dict.fromkeys(limit.case for limit in results.limits))
    alike = sum(case.startswith("dt_") for case in cases)
    engines = counted(len(names) - len(changed), "engine")
    counts = f"Each profile of an engine counts as one engine. This page has {engines}"
    if changed:
        counts += (
            f", and {len(changed)} with one setting changed (such as {changed[0]}), which play only"
            " the cases that name them and have no column in the table of limits"
        )
    counts += f". {counted(len(cases), 'case')}"
    if alike:
        counts += (
            f"; {alike} of them play a scene of the report at other steps, from fine to coarse"
        )
    return [
        Markup(
            "One parameter of a scene is changed from gentle to harsh until each engine fails. A"
            " limit is a bracket around the <b>first</b> failure: the last value at which no run"
            " fails, and the first value at which a run fails. The bracket is narrowed to {} %, or"
            " as far as the case allows. {}"
        ).format(number(100 * (form.ratio - 1)), how),
        counts + ".",
    ]


def limit_sections(limits: Sequence[Limit], names: Sequence[str]) -> list[Section]:
    if not limits:
        return []
    by_case: dict[str, list[Limit]] = {}
    for limit in limits:
        by_case.setdefault(limit.case, []).append(limit)
    engines = [name for name in names if "+" not in name and any(x.engine == name for x in limits)]
    index, rows, groups, opens = [], [], [], dict[str, list[Part]]()
    for name, members in by_case.items():
        case, of_engine = case_named(name), {limit.engine: limit for limit in members}
        label = name if name in FAMILY_OF else Path(name).name
        kept = ", ".join(f"{symbol} {value}" for symbol, value in held(case).items())
        note = "; ".join(filter(None, [case.with_unit(case.parameter), kept]))
        index.append(TableCell(label, title=case.asks, notes=(TableCell(note, css="soft"),)))
        rows.append([cell_of(case, of_engine.get(engine)) for engine in engines])
        groups.append(FAMILY_OF.get(name, "A scene of your own"))
        opens[label] = case_parts(case, members)
    heads = [TableCell(name.replace(":", ": "), title=name) for name in engines]
    frame = pd.DataFrame(rows, index=index, columns=heads, dtype=object)
    css = "fixed limits" if len(engines) <= FITS else "plain limits"
    marks = "; ".join(f"{mark}: {meaning}" for mark, meaning in MARKS.items())
    table = Table(frame, groups, opens=opens, css=css, corner="case", caption=f"{marks}.")
    return [
        Section("In short", parts=[Text(items=findings(limits))], id="summary"),
        Section("Limits", CELLS, [table], id="limits"),
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
    predicate = case.predicate
    span = f"from {number(case.values[0])} to {number(case.values[-1])}"
    runs = "Runs: one at each value; nothing in it is random"
    if case.runs > 1:
        runs = (
            f"Runs: up to {case.runs} at each value: the phase of the collision in its step, evenly"
            " spread and random, or the seed differs; a failure in fewer than one of"
            f" {case.runs} runs may be missed"
        )
    if case.by_chance:
        runs += f"; one in {round(1 / case.by_chance)} may fail, as the result depends on the seed"
    sentences = [
        f"Varied: {case.with_unit(case.parameter)}, {span}. Fails: {predicate.name},"
        f" {predicate.means} ({above(predicate)}).",
        f"{runs}.",
    ]
    return [*sentences, f"In the report: {text}"] if (text := in_report(case)) else sentences


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
    caption = "scanned: the largest factor between neighbouring values; a failure between two of"
    caption += " them can be missed."
    return Table(frame, css="plain text stack", corner="engine", caption=caption)


def replay_of(case: Case, limit: Limit) -> Section:
    assert limit.failing is not None
    label = f"{case.parameter} = {number(limit.failing.value)}: {limit.failing.event}"
    beside = EXACT if case.shown_with == EXACT else f"the same gas {case.shown_with}"
    caption = (
        "From just before the failure; at speed 1 all of it takes five seconds. In black:"
        f" {beside}, where there is one."
    )
    replay = Playback(limit.replay, limit.ratio, label, caption)
    return Section(limit.engine, label, [replay], folded=True)


def readings(case: Case, limits: Sequence[Limit]) -> Chart | Text:
    """The worst reading of every engine against the parameter, with the bound above which it fails;
    for a case that reads nothing else, the share of runs that failed."""
    predicate, lines = case.predicate, []
    what = f"{predicate.name.capitalize()}, {predicate.unit}"
    caption = (
        f"The worst of the runs played at each value of {case.parameter}, harsher to the right."
        " Above the dotted line the engine fails. Where a line ends, the engine refused the scene,"
        " stopped, or gave 0 or a value that is not a number."
    )
    if not predicate.bound:
        what = f"{predicate.name.capitalize()}, share of runs"
        caption = (
            f"The share of the runs at each value of {case.parameter} that failed; harsher to the"
            " right. Values at which the quick form stopped at the first failing run are not drawn."
        )
    for limit in limits:
        trials = [trial for trial in limit.trials if isfinite(trial.value)]
        if predicate.bound:
            trials = [trial for trial in trials if isfinite(trial.worst)]
            y = [abs(trial.worst) or np.nan for trial in trials]  # 0 is nowhere on a log scale
        else:
            trials = [trial for trial in trials if not trial.left]
            y = [trial.failed / trial.runs for trial in trials]
        if len(trials) > 1:
            lines.append(Line(limit.engine, [trial.value for trial in trials], y, limit.engine))
    if not lines or not any(np.any(np.asarray(line.y) > 0) for line in lines):
        return Text(["No engine reads more than 0 anywhere."])
    figure, axes = new_figure(9.5, 3.6)
    if predicate.bound:
        axes.axhline(predicate.bound, color="#57626e", linestyle=":", linewidth=1.3)
    if case.harsher < 0:
        axes.invert_xaxis()
    draw_lines(axes, lines, case.with_unit(case.parameter), what, "xy" if predicate.bound else "x")
    return Chart(svg_of(figure, f"{what}, of each engine"), "All readings", caption)


def map_section(maps: Sequence[MapOf]) -> Section:
    engines = list(dict.fromkeys(result.engine for result in maps))
    drawn = {(result.engine, result.name): result for result in maps}
    names = [name for name in MAPS if any(result.name == name for result in maps)]
    rows, opens = [], dict[str, list[Part]]()
    for engine in engines:
        results = [drawn.get((engine, name)) for name in names]
        opens[engine] = [grid(result) for result in results if result and result.cells]
        rows.append(
            [
                f"{sum(cell[3] for cell in result.cells)} of {len(result.cells)}"
                if result and result.cells
                else (result.status if result else "")
                for result in results
            ]
        )
    frame = pd.DataFrame(rows, engines, names, dtype=object)
    asks = [
        f"{name}: {MAPS[name].asks} An engine fails where {MAPS[name].predicate.means}:"
        f" {above(MAPS[name].predicate)}."
        for name in names
    ]
    table = Table(frame, opens=opens, css="plain", corner="engine")
    says = "At how many of the values each engine fails. A row opens on its maps. An engine that"
    says += " has no such parameter has no number."
    return Section("Two parameters at once", says, [Text(items=asks), table], id="maps")


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
    caption = (
        f"{result.name}. Across: {chart.x_name}. Upwards: {chart.y_name}. Pale: far below the"
        " bound. Deep, with ×: it fails. r: refused; !: stopped early. Point at a cell for its"
        " number."
    )
    frame = pd.DataFrame(rows, index, heads, dtype=object)
    return Table(frame, css="plain number", caption=caption)


def law_section(laws: Sequence[LawOf]) -> Section:
    ordered = [law for name in TOUCHING for law in laws if law.name == name]
    rows = []
    for law in ordered:
        off = max((at.momentum for at in law.gaps), default=np.nan)
        cells = [law_cell(at) for at in law.gaps] or [
            TableCell(law.status, css="bad", span=len(GAPS))
        ]
        blank = [""] * (len(GAPS) - len(cells))
        rows.append([*cells, *blank, "–" if isnan(off) else number(off, 1)])
    gaps = [TableCell(number(gap) if gap else "touching") for gap in GAPS]
    heads = [*gaps, TableCell("momentum", notes=(TableCell("off by, at most", css="soft"),))]
    frame = pd.DataFrame(rows, [law.engine for law in ordered], heads, dtype=object)
    groups = [f"{law.name}: {TOUCHING[law.name].asks}" for law in ordered]
    sources = [f"{name}: {TOUCHING[name].source}." for name in dict.fromkeys(x.name for x in laws)]
    spans = [(TableCell("gap in radii"), len(GAPS))]
    table = Table(frame, groups, spans, css="plain", corner="engine")
    says = WHICH_LAW + " Point at a cell for its numbers."
    return Section("Touching disks: which law", says, [table, Text(items=sources)], id="touching")


def law_cell(at: AtGap) -> TableCell:
    if not at.velocity:
        return TableCell(at.law, css="bad")
    motion = "; ".join(f"({number(x, 2)}, {number(y, 2)})" for x, y in at.velocity)
    title = f"{number(at.off, 2)} off, energy {number(at.energy)}; leave with {motion}"
    words = {PAIRS: ("pairs", ""), AT_ONCE: ("at once", "g1")}
    word, css = words.get(at.law, (f"energy {at.energy:.2f}", "g3"))
    return TableCell(word, title, css=css)
