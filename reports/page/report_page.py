"""Makes report.html: of many scenes the first table, charts, limits and the map; of one scene its
replay and its table. What most readers do not need is folded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.engines import OWN
from crosscheck2d.adapters.snippets import write_snippet
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.kit import (
    Code,
    Page,
    Part,
    Section,
    Table,
    TableCell,
    Text,
    render_page,
    run_section,
)
from crosscheck2d.reports.page.links import neighbours
from crosscheck2d.reports.page.own_solvers import Said, sourced
from crosscheck2d.reports.page.scene_map import map_section, numbers, remarks, replay, title_of
from crosscheck2d.reports.page.scenes import is_library, label, long_label
from crosscheck2d.reports.page.summary import Summary, error_text, step_text
from crosscheck2d.reports.page.trade_offs import cost_against_size, error_against_cost, limits

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


def report_page(
    path: Path,
    summary: Summary,
    *,
    first: Sequence[str],
    conformance: pd.DataFrame,
    known_answers: pd.DataFrame,
    about: Mapping[str, Any],
    said: Mapping[str, Sequence[Said]] = MappingProxyType({}),
) -> str:
    """The page of the scenes of `summary`, which will stand at `path`.

    Args:
        first: sentences before all others: what the reader's own engines break, who is not ranked.
        conformance: a row for each question of a probe.
        known_answers: a row for each reproduced published number.
        about: command, seed, machine, versions, started, and why it is unfinished, or "".
        said: a solver's file -> what `crosscheck check` says of it.
    """
    lead: list[str | Markup] = [*filter(None, [about["unfinished"]]), *first]
    if len(summary.scenes) == 1:
        title, sections = title_of(summary.scenes[0]).capitalize(), one_scene(summary)
    else:
        title, sections = TITLE, many_scenes(summary)
        if sentences := summary.sentences():
            lead.append(Markup(" ").join(sentences))
    sections = [*(check_section(name, rows) for name, rows in said.items()), *sections]
    sections += [
        *settings_section(summary),
        *conformance_section(conformance),
        commands_section(),
        trust_section(summary, known_answers),
        run_section({**about, "engines": engine_versions(summary)}),
    ]
    return render_page(
        Page(
            title,
            sections,
            GENERATOR,
            lead,
            names=[*summary.names, style.TRUTH],
            links=neighbours(path, "report"),
        )
    )


def many_scenes(summary: Summary) -> list[Section]:
    """The sections of a run of several scenes; nothing where there is nothing to say."""
    if not summary.scenes:
        return []
    table = [summary.section()] if summary.situations else []
    charts = [error_against_cost(summary), cost_against_size(summary)]
    pair = [each for each in charts if each is not None]
    found = [*table, *pair, limits(summary), map_section(summary)]
    return [each for each in found if each is not None]


def one_scene(summary: Summary) -> list[Section]:
    """The sections of a run of one scene."""
    [scene] = summary.scenes
    comparison = scene.comparison
    middle = step_text(comparison.middle_dt)
    parts: list[Part] = [*replay(scene, summary), engines_table(summary), *remarks(scene)]
    says = (
        f"The replay is at a step of {middle}. Errors: how far a disk is from its exact place at"
        " worst, in radii of the disk; fails: a verdict, which counts as infinitely far off."
    )
    if summary.clock.fault:
        says += f" {summary.clock.fault}"
    return [Section("", says, parts), *numbers(scene)]


def engines_table(summary: Summary) -> Table:
    """A row for each engine of one scene: its error at each step size, the nearest first."""
    [scene] = summary.scenes
    comparison = scene.comparison
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
        words = "; ".join(scene.words(name))
        rows.append([*errors, cost, TableCell(words, css="bad")])
    heads = [f"error at {step_text(dt)}" for dt in steps]
    heads += ["µs a step", f"what goes wrong, at {step_text(comparison.middle_dt)}"]
    frame = pd.DataFrame(rows, [long_label(name) for name in order], heads, dtype=object)
    wrong = any(scene.words(name) for name in order)
    frame = frame.drop(columns=heads[-2:-1] * (not summary.costs) + heads[-1:] * (not wrong))
    return Table(frame, css="stack engines", corner="engine")


def check_section(name: str, said: Sequence[Said]) -> Section:
    """What `crosscheck check` says of a solver's file, with its lines and the formula."""
    path = name.removesuffix(OWN)
    items = [sourced(sentence, lines) for sentence, lines in said]
    says = f"by crosscheck check {path}, which writes the smallest scene that shows each fault"
    return Section(path, says, [Text(items=items, ordered=len(items) > 1)], id="check")


def settings_section(summary: Summary) -> list[Section]:
    """What "matched" means for each library: code to copy, and the settings that differ."""
    parts: list[Part] = []
    if not summary.chosen:
        return []
    scene = next((s for s in summary.scenes if s.name == "oblique_e09"), summary.scenes[0])
    runs = {run.name: run for run in scene.comparison.middle_runs if run.settings}
    for engine, (name, nearer, farther) in summary.chosen.items():
        of = [each for each in summary.profiles[engine] if each in runs]
        keys = dict.fromkeys(key for each in of for key in runs[each].settings)
        used = {
            each.rpartition(":")[2]: [runs[each].settings.get(key, ("", "–"))[1] for key in keys]
            for each in of
        }
        frame = pd.DataFrame(used, list(keys), dtype=object)
        if len(of) > 1:
            frame = frame[[len(set(map(str, row))) > 1 for row in frame.itertuples(index=False)]]
        note = f"{name.partition(':')[2]} is nearer in {nearer} scenes, farther in {farther}"
        table = Table(frame, css="plain text", corner=label(name))
        code: list[Part] = []
        with suppress(Unsupported, ImportError):  # a run of another machine
            snippet = write_snippet(
                name, scene.comparison.scenario.scene, scene.comparison.middle_dt
            )
            code = [Code(snippet)]
        says = note if len(of) > 1 else ""
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
    return [Section("Settings", says, [intro, *parts], folded=True, id="settings")]


def conformance_section(conformance: pd.DataFrame) -> list[Section]:
    """The probes that an engine answers otherwise than stated."""
    if conformance.empty:
        return []
    asked = conformance[conformance.verdict != "keeps"]
    rows: dict[tuple[str, str], list[str]] = {}
    for row in asked.to_dict("records"):
        expected, got = (style.number(row[key], 4) for key in ("expected", "got"))
        who = long_label(f"{row['engine']}:{row['profile']}")
        rows.setdefault((row["asked"], expected), []).append(f"{who} {got}")
    frame = pd.DataFrame(
        [[stated, "; ".join(answers)] for (_, stated), answers in rows.items()],
        [question for question, _ in rows],
        ["stated", "answers"],
        dtype=object,
    )
    probes = conformance.probe.nunique()
    says = f"{probes} probes before the scenes; {len(rows)} have an answer other than stated"
    table = Table(frame, css="plain text", corner="question")
    return [Section("Conformance", says, [table], folded=True, id="conformance")]


def engine_versions(summary: Summary) -> list[str]:
    """The libraries of each engine with their versions."""
    runs = [run for scene in summary.scenes for run in scene.comparison.runs if run.versions]
    found = {run.engine: ", ".join(map(" ".join, run.versions.items())) for run in runs}
    return [f"{engine}: {versions}" for engine, versions in found.items()]


def commands_section() -> Section:
    """What to do next."""
    code = [Markup("<code>{}</code>").format(command) for command in COMMANDS]
    frame = pd.DataFrame({"": list(COMMANDS.values())}, code, dtype=object)
    return Section(
        "Your solver, your scene",
        "commands",
        [Table(frame, css="plain text")],
        folded=True,
        id="commands",
    )


def trust_section(summary: Summary, known_answers: pd.DataFrame) -> Section:
    """What is proven, what is measured, and what a median hides."""
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
        for row in known_answers.to_dict("records")
    ]
    early = [
        f"{title_of(scene)} up to {style.number(truth.horizon, 2)} of"
        f" {style.number(scene.comparison.scenario.duration)} s"
        for scene in summary.scenes
        if (truth := scene.comparison.truth) is not None
        and truth.horizon < scene.comparison.scenario.duration
    ]
    parts: list[Part] = [Text([Markup(each) for each in paragraphs])]
    if early:
        parts.append(Text([f"Exact answers that end before the scene: {'; '.join(early)}."]))
    if items:
        parts.append(Text(["Known answers from outside:"], items))
    says = "what is proven, what is measured"
    return Section("How far to trust this", says, parts, folded=True, id="trust")
