"""Tables and page of a run, made from its rows; nothing is played. Of many scenes the page has the
first table, charts, limits and the map; of one scene its replay and its table. What most readers do
not need is folded."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.engines import OWN
from crosscheck2d.adapters.snippets import write_snippet
from crosscheck2d.reports.page import findings, kit, style
from crosscheck2d.reports.page.kit import (
    Part,
    Said,
    Section,
    Table,
    TableCell,
    Text,
    neighbours,
    sourced,
    with_lines,
)
from crosscheck2d.reports.page.scene_map import map_section, numbers, remarks, replays, title_of
from crosscheck2d.reports.page.scenes import is_library, label, long_label
from crosscheck2d.reports.page.summary import Summary, error_text, run_times, step_text, summarize
from crosscheck2d.reports.page.trade_offs import cost_against_size, error_against_cost, limits
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.tables import comparisons_of, make_tables
from crosscheck2d.reports.run.timing_pass import TIMINGS, noise_floor
from crosscheck2d.reports.terminal.counts import counted

PAGE = "report.html"
GENERATOR = "crosscheck run"
TITLE = "2D disk engines against the exact answer"
COMMANDS = {
    "crosscheck check Exercise.js": "what is right and wrong in your solver, with the line and the"
    " likely cause; a folder is a class, with marks",
    "crosscheck run --engine Exercise.js --engine pymunk --engine reference": "your solver as a"
    " column of this page",
    "crosscheck advise my_scene.toml --error 1%": "the cheapest engine and step for a scene of"
    " yours, and the options that it does not need",
    "crosscheck speed": "what an accuracy costs, and what each error is made of",
    "crosscheck stability": "where each engine fails, with the failing run",
    "crosscheck lesson": "why engines differ: lessons with sliders and the exact answer",
}


@dataclass(frozen=True, eq=False)
class Report:
    results: RunResults  # what it was made from
    runs: pd.DataFrame  # runs.csv
    summary: Summary
    findings: list[str]  # sentences, which the command prints
    unjudged: Mapping[str, str]  # a scene -> why it is not compared with its answer, or not at all
    said: Mapping[str, list[str]]  # a solver's file, `PATH:own` -> what `crosscheck check` says


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
    comparisons = [*comparisons_of(results, tables)]
    # an interrupt may come first
    began = {run.name for comparison in comparisons for run in comparison.runs}
    engines = [name for name in header["engines"] if name in began and name in results.conformance]
    probes = [results.conformance[name] for name in engines]
    broken = {
        f"{row['engine']}:{row['profile']}": row
        for rows in probes
        for row in reversed(rows)  # so that the first fault is reported
        if row["verdict"] == "breaks"
    }
    lawless = (name for name, rows in zip(engines, probes) if findings.is_lawless(rows))
    untrusted = {*broken, *lawless}
    own = {name: row for name, row in broken.items() if name.endswith(OWN)}
    first = [sentence for rows in probes for sentence in findings.own_engine_sentences(rows)]
    first += findings.not_counted(own)
    last = findings.not_counted({name: row for name, row in broken.items() if name not in own})
    limit, again = header["timings"], take_times(results.folder)
    times = run_times(tables.timed, noise_floor(results), limit, again)
    summary = summarize(comparisons, untrusted, times)
    cells = counted(len(results.records), "cell")
    unfinished = "" if results.complete else f"The run was stopped after {cells}."
    checks = results.checked
    page = report_page(
        results.folder / PAGE,
        summary,
        first=[*first, *last],
        conformance=pd.DataFrame([row for rows in probes for row in rows]),
        known_answers=sorted(
            results.known_answers,
            key=lambda row: (row["column"], row["dt_s"], row["made_by"]),
            reverse=True,
        ),
        about=header | {"unfinished": unfinished},
        checks={name: with_lines(row["says"], row["shown"]) for name, row in checks.items()},
    )
    results.store.export(PAGE, page)
    says = {name: row["says"] for name, row in checks.items()}
    sentences = [*first, *findings.findings(summary), *last]
    return Report(results, tables.runs, summary, sentences, tables.unjudged, says)


def take_times(folder: Path) -> str:
    return shlex.join(["crosscheck", "report", str(folder), "--timings", f"{TIMINGS:g}"])


def report_page(
    path: Path,
    summary: Summary,
    *,
    first: Sequence[str],
    conformance: pd.DataFrame,
    known_answers: Sequence[Mapping[str, Any]],
    about: Mapping[str, Any],
    checks: Mapping[str, Sequence[Said]] = MappingProxyType({}),
) -> str:
    """The page of the scenes of `summary`, which will stand at `path`; it begins with `first`.

    `conformance` has a row for each question of a probe, `known_answers` one for each reproduced
    published number; `about`: command, seed, machine, versions, started, and why it is unfinished,
    or ""; `checks`: a solver's file -> what `crosscheck check` says of it.
    """
    lead: list[str | Markup] = [*filter(None, [about["unfinished"]]), *first]
    sections: list[Section | None] = []
    for name, sentences in checks.items():
        file, items = name.removesuffix(OWN), [sourced(*sentence) for sentence in sentences]
        says = f"by crosscheck check {file}, which writes the smallest scene that shows each fault"
        text = Text(items=items, ordered=len(items) > 1)
        sections.append(Section(file, says, [text], id="check"))
    if len(summary.scenes) == 1:
        title = title_of(summary.scenes[0]).capitalize()
        sections += one_scene(summary)
    else:
        title = TITLE
        if summary.situations:
            sections.append(summary.section())
        if summary.scenes:
            sections += [error_against_cost(summary), cost_against_size(summary)]
            sections += [limits(summary), map_section(summary)]
        if computed := summary.sentences():
            lead.append(Markup(" ").join(computed))
    commands = [Markup("<code>{}</code>").format(command) for command in COMMANDS]
    table = Table(
        pd.DataFrame({"": list(COMMANDS.values())}, commands, dtype=object), css="plain text"
    )
    versions = [f"{k}: {', '.join(map(' '.join, v.items()))}" for k, v in summary.versions.items()]
    sections += [
        settings_section(summary),
        conformance_section(conformance),
        Section("Your solver, your scene", "commands", [table], folded=True, id="commands"),
        trust_section(summary, known_answers),
        kit.run_section({**about, "engines": versions}),
    ]
    return kit.render_page(
        kit.Page(
            title,
            [section for section in sections if section is not None],
            GENERATOR,
            lead,
            names=[*summary.names, style.TRUTH],
            links=neighbours(path, "report"),
        )
    )


def one_scene(summary: Summary) -> list[Section]:
    """The sections of a run of one scene; its table has a row for each engine, the nearest first,
    with the error at each step size."""
    [scene] = summary.scenes
    comparison = scene.comparison
    middle = step_text(comparison.middle_dt)
    steps = sorted({run.dt for run in comparison.runs}, reverse=True)
    order = sorted(
        summary.names, key=lambda name: (np.nan_to_num(scene.error(name), nan=np.inf), name)
    )
    best = min((scene.error(name) for name in order if is_library(name)), default=np.nan)
    rows = []
    for name in order:
        errors = [
            TableCell(
                "refuses" if scene.refuses(name) else error_text(scene.error(name, dt)),
                css="best" * (dt == comparison.middle_dt and scene.error(name) == best),
            )
            for dt in steps
        ]
        cost = summary.costs.get((scene.name, name), np.nan)
        rows.append([*errors, cost, TableCell("; ".join(scene.words(name)), css="bad")])
    heads = [f"error at {step_text(dt)}" for dt in steps]
    heads += ["µs a step", f"what goes wrong, at {middle}"]
    frame = pd.DataFrame(rows, [long_label(name) for name in order], heads, dtype=object)
    wrong = any(scene.words(name) for name in order)
    frame = frame.drop(columns=heads[-2:-1] * (not summary.costs) + heads[-1:] * (not wrong))
    table = Table(frame, css="stack engines", corner="engine")
    says = (
        f"The replay is at a step of {middle}. Errors: how far a disk is from its exact place at"
        " worst, in radii of the disk; fails: a verdict, which counts as infinitely far off."
    )
    if summary.clock.fault:
        says += f" {summary.clock.fault}"
    parts = [*replays(scene, summary), table, *remarks(scene)]
    return [Section("", says, parts), *numbers(scene)]


def settings_section(summary: Summary) -> Section | None:
    if not summary.chosen:
        return None
    scene = next((s for s in summary.scenes if s.name == "oblique_e09"), summary.scenes[0])
    runs = {run.name: run for run in scene.comparison.middle_runs if run.settings}
    parts: list[Part] = []
    for engine, (name, nearer, farther) in summary.chosen.items():
        profiles = [profile for profile in summary.profiles[engine] if profile in runs]
        keys = dict.fromkeys(key for profile in profiles for key in runs[profile].settings)
        used = {
            profile.rpartition(":")[2]: [
                runs[profile].settings.get(key, ("", "–"))[1] for key in keys
            ]
            for profile in profiles
        }
        frame = pd.DataFrame(used, list(keys), dtype=object)
        says = ""
        if len(profiles) > 1:
            frame = frame[[len(set(map(str, row))) > 1 for row in frame.itertuples(index=False)]]
            profile = name.partition(":")[2]
            says = f"{profile} is nearer in {nearer} scenes, farther in {farther}"
        code: list[Part] = []
        with suppress(Unsupported, ImportError):  # a run of another machine
            dt = scene.comparison.middle_dt
            code = [kit.Code(write_snippet(name, scene.comparison.scenario.scene, dt))]
        table = Table(frame, css="plain text", corner=label(name))
        parts.append(Section(label(name), says, [*code, table], True, f"settings_{engine}"))
    intro = Text(
        [
            f"The settings that each library has in {title_of(scene)}, as code to copy, and those"
            " that differ between the profiles; adapters/README.md says why. The first table has"
            " one profile for each library in all scenes, because a program runs with one: the one"
            " that is nearer by more than a factor of 2 in more scenes."
        ]
    )
    says = "what matched means for each library"
    return Section("Settings", says, [intro, *parts], folded=True, id="settings")


def conformance_section(conformance: pd.DataFrame) -> Section | None:
    if conformance.empty:
        return None
    answers: dict[tuple[str, str], list[str]] = {}
    for row in conformance[conformance.verdict != "keeps"].to_dict("records"):
        expected, got = (style.number(row[key], 4) for key in ("expected", "got"))
        name = long_label(f"{row['engine']}:{row['profile']}")
        answers.setdefault((row["asked"], expected), []).append(f"{name} {got}")
    frame = pd.DataFrame(
        [[stated, "; ".join(of)] for (_, stated), of in answers.items()],
        [question for question, _ in answers],
        ["stated", "answers"],
        dtype=object,
    )
    probes = conformance.probe.nunique()
    says = f"{probes} probes before the scenes; {len(answers)} have an answer other than stated"
    table = Table(frame, css="plain text", corner="question")
    return Section("Conformance", says, [table], folded=True, id="conformance")


def trust_section(summary: Summary, known_answers: Sequence[Mapping[str, Any]]) -> Section:
    paragraphs = [
        "<b>Proven</b>: the exact answers, to 1e-9 of the smallest radius. They share no code with"
        " any engine, and are used up to the horizon: the time after which rounding alone would"
        " part two correct solvers.",
        "<b>Measured</b>: all errors and times. One or two scenes of a situation are timed. The"
        " time of pymunk and Box2D contains a call from Python in each step, about 1 µs; that of"
        " the JavaScript engines is taken inside V8 and contains its warm-up.",
        "<b>Judged without an exact answer</b>: verdicts, over the whole run: tunnelling, overlap"
        " that stays, energy, momentum, rest. A run that fails one counts as infinitely far off"
        " (crosscheck list verdicts).",
        "<b>Medians hide failures</b>: the red words name the worst scene of a row, and the map"
        " shows every scene. In crowds an error doubles with every few collisions, so that most"
        " engines part from the exact answer; what counts there is when.",
        "<b>Our own engines</b> are never nearest, and the exact answers import none of their code."
        " The reference does not model friction; in scenes with friction its copy that does stands"
        " for it.",
    ]
    items = [
        f"{row['made_by']} at a step of {style.number(row['dt_s'])} s gives"
        f" {style.number(row['ours_J2'], 6)} J², published for {row['column']}:"
        f" {style.number(row['published_J2'], 6)} ({row['source']})"
        for row in known_answers
    ]
    early = [
        f"{title_of(scene)} up to {style.number(truth.horizon, 2)} of"
        f" {style.number(scene.comparison.scenario.duration)} s"
        for scene in summary.scenes
        if (truth := scene.comparison.truth) is not None
        and truth.horizon < scene.comparison.scenario.duration
    ]
    parts: list[Part] = [Text([Markup(paragraph) for paragraph in paragraphs])]
    if early:
        parts.append(Text([f"Exact answers that end before the scene: {'; '.join(early)}."]))
    if items:
        parts.append(Text(["Known answers from outside:"], items))
    says = "what is proven, what is measured"
    return Section("How far to trust this", says, parts, folded=True, id="trust")
