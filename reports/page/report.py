"""Page and findings of a run, made from its tables; nothing is played."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.page import cost_points, overview, style
from crosscheck2d.reports.page.charts import NOISE, POINTS
from crosscheck2d.reports.page.cost_points import RunTimes
from crosscheck2d.reports.page.documents import CHARTED, render
from crosscheck2d.reports.page.findings import findings, not_counted
from crosscheck2d.reports.page.first_screen import first_screen
from crosscheck2d.reports.page.links import neighbours
from crosscheck2d.reports.page.own_engines import is_lawless, own_engine_sentences
from crosscheck2d.reports.page.own_solvers import Said, with_lines
from crosscheck2d.reports.page.page_tables import page_tables
from crosscheck2d.reports.page.panels import MARKED, panels
from crosscheck2d.reports.page.sections import by_family, sections_of
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.tables import comparisons_of, make_tables
from crosscheck2d.reports.run.timing_pass import TIMINGS, noise_floor
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.foreign_text import put_text

GENERATOR = "crosscheck run"
PAPER_CHARTS = ("deviation", "convergence")  # of a scene, where it is printed


def write_page(
    path: Path,
    comparisons: Sequence[Comparison],
    *,
    findings: Sequence[str],
    untrusted: Set[str],
    conformance: pd.DataFrame,
    known_answers: pd.DataFrame,
    about: Mapping[str, Any],
    lessons: Mapping[str, Any],
    clock: cost_points.RunTimes = cost_points.NO_CLOCK,
    said: Mapping[str, Sequence[Said]] = MappingProxyType({}),
    on_paper: Sequence[str] = (),
) -> None:
    """Write the page of `comparisons`, in reading order, to `path`.

    Args:
        findings: the sentences of the first screen.
        untrusted: the engines that are not scored, as they break the protocol.
        conformance: a row for each question of a probe.
        known_answers: a row for each reproduced published number.
        about: command, seed, machine, versions, started, seconds, and why it is unfinished, or "".
        lessons: name -> an object with its number, title and question.
        clock: the times of the run.
        said: a solver's file -> what `crosscheck check` says of it.
        on_paper: the scenarios that get half a page each in print.
    """
    names = overview.names_of(comparisons)
    tables = page_tables(comparisons, untrusted, conformance, known_answers)
    html = render(
        "page/page.html.j2",
        generator=GENERATOR,
        scripts=(*CHARTED, "page/scene_panels.js"),
        looks=style.looks_of((*names, style.TRUTH)),
        plotly=True,
        names=names,
        untrusted=untrusted,
        first=first_screen(comparisons, untrusted, clock, findings, said),
        tables=tables,
        panels=panels(comparisons, names, tables.heat_map, clock),
        marked=MARKED,
        families=by_family(sections_of(comparisons)),
        lessons=lessons,
        links=neighbours(path, "report"),
        on_paper=on_paper,
        paper_charts=PAPER_CHARTS,
        points=POINTS,
        noise=NOISE,
        about=about,
    )
    put_text(path, html)


PAGE = "report.html"


@dataclass(frozen=True, eq=False)
class Report:
    """The results of a run.

    Attributes:
        results: what it was made from.
        comparisons: one for each scenario, in reading order.
        runs: runs.csv.
        findings: the sentences on top.
        untrusted: the engines that broke the protocol, and the reader's own that break a law:
            their rows stay in the tables, but they are not scored.
        unjudged: name of a scene -> why it is not compared with its answer, or not at all, though
            it should be.
        said: a solver's file, `PATH:own` -> what `crosscheck check` says of it.
    """

    results: RunResults
    comparisons: list[Comparison]
    runs: pd.DataFrame
    findings: list[str]
    untrusted: set[str]
    unjudged: Mapping[str, str]
    said: Mapping[str, list[str]]


def make_report(
    results: RunResults,
    say: Callable[[str], None],
    lessons: Mapping[str, Any],
    on_paper: Sequence[str] = (),
) -> Report:
    """From the rows of a run write deviations.csv, runs.csv, timings.csv and report.html; `say` is
    called with what is being done.

    `lessons`: name -> a lesson, for the page's list of them; `on_paper`: scenarios to print with
    the page.

    Raises:
        FolderTaken: one of these exists and is not this program's.
        ValueError: no cell has ended, or a scene is not the one that was played.
    """
    header = results.header
    tables = make_tables(results, say)
    say("writing the page")
    comparisons = comparisons_of(results, tables)
    # an interrupt may come first
    began = {run.name for comparison in comparisons for run in comparison.runs}
    engines = [name for name in header["engines"] if name in began and name in results.conformance]
    asked = [results.conformance[name] for name in engines]
    known = sorted(
        results.known_answers,
        key=lambda row: (row["column"], row["dt_s"], row["made_by"]),
        reverse=True,
    )
    broken = {
        f"{row['engine']}:{row['profile']}": how_broken(row)
        for rows in asked
        for row in reversed(rows)  # so that the first fault is reported
        if row["verdict"] == "breaks"
    }
    untrusted = set(broken)
    untrusted |= {name for name, rows in zip(engines, asked) if is_lawless(rows)}
    own = [sentence for rows in asked for sentence in own_engine_sentences(rows)]
    theirs = {name: how for name, how in broken.items() if name.endswith(OWN)}
    others = {name: how for name, how in broken.items() if name not in theirs}
    sentences = [
        *own,
        *not_counted(theirs),
        *findings(comparisons, untrusted),
        *not_counted(others),
    ]
    checks = results.checked
    with results.store.exporting(PAGE) as path:
        write_page(
            path,
            comparisons,
            findings=sentences,
            untrusted=untrusted,
            conformance=pd.DataFrame([row for rows in asked for row in rows]),
            known_answers=pd.DataFrame(known),
            about=header | {"seconds": results.seconds, "unfinished": unfinished(results)},
            clock=RunTimes(
                tables.timed, noise_floor(results), header["timings"], take_times(results.folder)
            ),
            lessons=lessons,
            said={name: with_lines(one["says"], one["shown"]) for name, one in checks.items()},
            on_paper=on_paper,
        )
    says = {name: one["says"] for name, one in checks.items()}
    return Report(results, comparisons, tables.runs, sentences, untrusted, tables.unjudged, says)


def take_times(folder: Path) -> str:
    """The command that takes the times of a run."""
    return shlex.join(["crosscheck", "report", str(folder), "--timings", f"{TIMINGS:g}"])


def unfinished(results: RunResults) -> str:
    """A sentence for the page of a run that has not ended; "" for one that has."""
    if results.complete:
        return ""
    return f"The run was stopped after {counted(len(results.records), 'cell')}."


def how_broken(row: Mapping[str, Any]) -> str:
    """The probe of the protocol that an engine failed: question and answer."""
    note = f" ({row['note']})" if row["note"] else ""
    return f"{row['asked']} {str(row['got']).capitalize()}{note}; expected: {row['expected']}."
