"""Tables and page of a run, made from its rows; nothing is played."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.page.cost_points import RunTimes
from crosscheck2d.reports.page.findings import findings, not_counted
from crosscheck2d.reports.page.own_engines import is_lawless, own_engine_sentences
from crosscheck2d.reports.page.own_solvers import with_lines
from crosscheck2d.reports.page.report_page import report_page
from crosscheck2d.reports.page.summary import Summary, summarize
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.tables import comparisons_of, make_tables
from crosscheck2d.reports.run.timing_pass import TIMINGS, noise_floor
from crosscheck2d.reports.terminal.counts import counted

PAGE = "report.html"


@dataclass(frozen=True, eq=False)
class Report:
    """The results of a run.

    Attributes:
        results: what it was made from.
        runs: runs.csv.
        summary: its scenes, and what the first table says of them.
        findings: its sentences, which the command prints.
        unjudged: name of a scene -> why it is not compared with its answer, or not at all, though
            it should be.
        said: a solver's file, `PATH:own` -> what `crosscheck check` says of it.
    """

    results: RunResults
    runs: pd.DataFrame
    summary: Summary
    findings: list[str]
    unjudged: Mapping[str, str]
    said: Mapping[str, list[str]]


def make_report(results: RunResults, say: Callable[[str], None]) -> Report:
    """From the rows of a run write deviations.csv, runs.csv, timings.csv and report.html; `say` is
    called with what is being done.

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
    times = tables.timed, noise_floor(results), header["timings"], take_times(results.folder)
    summary = summarize(comparisons, untrusted, RunTimes(*times))
    first, last = [*own, *not_counted(theirs)], not_counted(others)
    checks = results.checked
    page = report_page(
        results.folder / PAGE,
        summary,
        first=[*first, *last],
        conformance=pd.DataFrame([row for rows in asked for row in rows]),
        known_answers=pd.DataFrame(known),
        about=header | {"unfinished": unfinished(results)},
        said={name: with_lines(one["says"], one["shown"]) for name, one in checks.items()},
    )
    results.store.export(PAGE, page)
    says = {name: one["says"] for name, one in checks.items()}
    told = [*first, *findings(summary), *last]
    return Report(results, tables.runs, summary, told, tables.unjudged, says)


def take_times(folder: Path) -> str:
    """The command that takes the times of a run."""
    return shlex.join(["crosscheck", "report", str(folder), "--timings", f"{TIMINGS:g}"])


def unfinished(results: RunResults) -> str:
    """A sentence for the page of a run that has not ended; "" for one that has."""
    if results.complete:
        return ""
    return f"The run was stopped after {counted(len(results.records), 'cell')}."


def how_broken(row: Mapping[str, Any]) -> str:
    """The probe of the protocol that an engine failed: question and answer, or what it raised."""
    if row["got"] == "raised":
        return f"It raised {row['note']}. The probe was: {row['asked']}"
    note = f" ({row['note']})" if row["note"] else ""
    return f"{row['asked']} {str(row['got']).capitalize()}{note}; expected: {row['expected']}."
