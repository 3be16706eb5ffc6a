"""Writes report.html: one self-contained file that fetches nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd

from reports.compare.comparison import Comparison
from reports.page import cost_points, overview, style
from reports.page.charts import NOISE, POINTS
from reports.page.documents import CHARTED, render
from reports.page.first_screen import first_screen
from reports.page.links import neighbours
from reports.page.own_solvers import Said
from reports.page.page_tables import page_tables
from reports.page.panels import MARKED, panels
from reports.page.sections import by_family, sections_of
from reports.terminal.foreign_text import put_text

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
        scripts=(*CHARTED, "page/panels.js"),
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
