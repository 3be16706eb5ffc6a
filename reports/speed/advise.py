"""`crosscheck advise`: the cheapest engine and step size that keep an error in one scene, until
when the others keep it, and the engine options that it does not need."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from math import inf, isfinite, nan
from operator import attrgetter
from typing import Any, NoReturn

import numpy as np

from crosscheck2d.adapters.engines import ENGINES, row_of, told_apart
from crosscheck2d.adapters.snippets import write_snippet
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.arguments import checked_engines, checked_scenes, unknown
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed.advice import (
    BUSY,
    LASTING,
    LOUD,
    STATISTICS,
    Advice,
    Attempt,
    Inquiry,
    NoAdvice,
    Requirement,
)
from crosscheck2d.reports.speed.ladder import PURPOSES, STARTS
from crosscheck2d.reports.terminal.console import Console, print_table, print_texts
from crosscheck2d.reports.terminal.exits import DONE, FAILED, refuse, say
from crosscheck2d.reports.terminal.progress import Progress

Row = dict[str, Any]
SHOWN = 3  # ranks: the cheapest and the next two
# fields of the answer, and of its rows -> attributes
ANSWER = {"scenario": "scene", "purpose": "purpose", "error_at_most": "bound", "until_s": "until"}
ANSWER |= {"duration_s": "duration", "collisions_judged": "collisions", "dt_s_tried": "step_sizes"}
ATTEMPT = {"engine": "name", "library": "is_library", "dt_s": "dt", "error": "error"}
CHANGE = {"change": "changed.change", "error_without": "plain.error"}
NINE, AT = "9 of 10\nuntil, s", "at dt,\nms"
SHORT = {  # and headings
    "error_at_finest": ("finest", ""),
    "kept_until_s": ("usual.until", "until,\ns"),
    "kept_from_nine_tenths_until_s": ("usual.lasting", NINE),
    "at_dt_s": ("usual.dt", AT),
    "longest_until_s": ("longest.until", "longest\nuntil,\ns"),
    "longest_from_nine_tenths_until_s": ("longest.lasting", NINE),
    "longest_at_dt_s": ("longest.dt", AT),
    "why": ("reason", ""),
}
# tables: a field of their rows -> its heading; step sizes are shown in ms
CHOICES = {"rank": "", "engine": "engine", "dt_s": "dt, ms", "error": "error"}
CHOICES |= {"error_of_nine_tenths": "9 of 10\nwithin", "us_per_simulated_s": "µs per\nsimulated s"}


def give_advice(
    scene: str, error: str, purpose: str, engines: Sequence[str], seed: int, as_json: bool
) -> NoReturn:
    """Measure and print; exits 0, 1 where no engine keeps the error or there is no exact answer,
    2 on bad input."""
    if purpose not in PURPOSES:
        refuse([unknown("purpose", purpose, PURPOSES) + f"; allowed: {', '.join(PURPOSES)}"])
    bound = bound_of(error)
    (checked,) = checked_scenes([scene], [], False, seed)
    rows = {name: row_of(name) for name in checked_engines(engines, ENGINES)}
    names = told_apart(rows, open_scene(checked, seed).scene)
    with Progress() as progress:
        try:
            requirement = Requirement(checked, seed, purpose, bound)
            advice = Inquiry(requirement, os.cpu_count() or 1, progress).advise(names)
        except NoAdvice as reason:
            say(f"{scene}: {reason}")
            sys.exit(FAILED)
    snippet = snippet_of(advice, checked, seed)
    if as_json:
        print(json.dumps(finite(answer_of(advice)) | {"snippet": snippet}, indent=1))
    else:
        print_advice(advice, snippet)
    sys.exit(DONE if advice.keeping else FAILED)


def bound_of(error: str) -> float:
    text, scale = (error[:-1], 0.01) if error.endswith("%") else (error, 1.0)
    try:
        bound = float(text) * scale
    except ValueError:
        bound = 0.0
    if not (isfinite(bound) and bound > 0):
        refuse([f"--error {error!r} is no positive number; write 1% or 0.01"])
    return bound


def snippet_of(advice: Advice, scene: str, seed: int) -> str:
    ranked = [*advice.ranked, *(advice.statistics.ranked if advice.statistics else ())]
    for _, attempt in ranked:
        if attempt.is_library:
            return write_snippet(attempt.name, open_scene(scene, seed).scene, attempt.dt)
    return ""


def answer_of(advice: Advice) -> Row:
    """The advice as `--json` gives it, where a number that is not finite is null."""

    def row(attempt: Attempt) -> Row:
        return fields(attempt, ATTEMPT) | {"us_per_simulated_s": attempt.cost * 1e6}

    ranked = [
        row(attempt)
        | {"rank": rank, "error_of_nine_tenths": attempt.usually}
        | {"kept_in": attempt.kept_in(advice.bound), "starts": len(attempt.starts)}
        for rank, attempt in advice.ranked
    ]
    changes = [
        row(change.changed)
        | fields(change, CHANGE)
        | {"cost_ratio": change.changed.cost / change.plain.cost}
        | {"verdict": change.verdict(advice.bound, advice.floor)}
        for change in advice.changes
    ]
    ends = {field: attribute for field, (attribute, _) in SHORT.items()}
    return fields(advice, ANSWER) | {
        "cheapest_first": ranked,
        "not_within": [row(x.best) | fields(x, ends) for x in advice.short],
        "not_to_the_end": [row(x) | {"why": x.reason} for x in advice.partial],
        "changes": changes,
        "noise": advice.noise,
        "cores_busy": advice.busy,
        "statistics": answer_of(advice.statistics) if advice.statistics else None,
    }


def fields(of: Any, attributes: Mapping[str, str]) -> Row:
    return {field: attrgetter(path)(of) for field, path in attributes.items()}


def finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [finite(part) for part in value]
    return value if not isinstance(value, float) or isfinite(value) else None


def print_advice(advice: Advice, snippet: str = "") -> None:
    console, answer = Console(), answer_of(advice)
    question = f"{PURPOSES[advice.purpose].what}, at most {number(advice.bound)}"
    console.print(f"{advice.scene}: {question}, {advice.judged}\n", highlight=False)
    if advice.keeping and not advice.quiet:  # before the costs that it concerns
        console.print(f"{sentence_on_times(advice)}\n", highlight=False)
    print_group(console, advice, answer, True)
    if statistics := advice.statistics:
        console.print(
            f"Averages over time need less: `--for {STATISTICS}` (energies, distance from the"
            f" start; at most {number(statistics.bound)})",
            style="bold",
        )
        if statistics.keeping and not statistics.quiet:
            console.print(sentence_on_times(statistics), highlight=False)
        print_group(console, statistics, answer["statistics"], True)
    print_group(console, advice, answer, False)
    partial = "Not advised: what goes wrong in the whole scene"
    for title, rows in ((partial, answer["not_to_the_end"]), ("Why", answer["not_within"])):
        if rows:
            print_texts(console, {row["engine"]: row["why"] for row in rows}, title)
            console.print()
    if advice.changes:
        print_changes(console, advice)
    if advice.keeping and advice.quiet:
        console.print(f"{sentence_on_times(advice)}\n", highlight=False)
    if snippet:
        console.print("The settings that were run:", style="bold")
        console.print(snippet, highlight=False, soft_wrap=True)


def print_group(console: Console, advice: Advice, answer: Row, library: bool) -> None:
    """Print the libraries, or the solvers of this project: those that keep the error, and until
    when the others do."""
    ranked, short, partial = (
        [row for row in answer[key] if row["library"] is library]
        for key in ("cheapest_first", "not_within", "not_to_the_end")
    )
    group = "Libraries" if library else "Solvers of this project"
    if ranked:
        print_choices(console, advice, ranked, group)
    elif short or partial:
        engine = "library" if library else "solver of this project"
        right = " that is right in the whole scene" if partial else ""
        console.print(f"No {engine}{right} keeps this error at any step size tried.", style="bold")
    if short:
        print_short(console, advice, short, group)
    if ranked or short or partial:
        console.print()


def print_rows(
    console: Console, rows: Sequence[Row], headings: Mapping[str, str], title: str
) -> None:
    def cell(field: str, value: Any) -> str:
        return value if field == "engine" else number(value * (1e3 if "dt_s" in field else 1))

    cells = [[cell(field, row[field]) for field in headings] for row in rows]
    print_table(console, [*headings.values()], cells, title)


def print_choices(console: Console, advice: Advice, ranked: Sequence[Row], group: str) -> None:
    part = ", in the whole scene"
    if advice.until < advice.duration:
        part = f": error {advice.judged}; cost of the whole scene"
    shown = [row for row in ranked if row["rank"] <= SHOWN]
    rows = shown if advice.quiet else [row | {"rank": nan} for row in shown]
    print_rows(console, rows, CHOICES, f"{group}, cheapest first{part}")
    console.print(
        f"9 of 10 within: the error of nine tenths of runs from {STARTS} instants of a step.",
        highlight=False,
    )
    if dearer := ranked[len(shown) :]:
        costs = (f"{row['engine']} ({number(row['us_per_simulated_s'])} µs)" for row in dearer)
        console.print(f"Also within it: {', '.join(costs)}.", highlight=False)


def print_short(console: Console, advice: Advice, short: Sequence[Row], group: str) -> None:
    # how near they come; and of an error that only grows until when they keep it
    coarse, fine = (number(advice.step_sizes[k] * 1e3) for k in (0, -1))
    until = {row["engine"]: float(np.nan_to_num(row["longest_until_s"], nan=-inf)) for row in short}
    rows = sorted(short, key=lambda row: (-until[row["engine"]], row["engine"]))
    finest = {"error_at_finest": f"error at\n{fine} ms"}
    title = f"{group} that do not keep it"
    if advice.purpose in LASTING:
        title += f" to {number(advice.until)} s, and until when"
        kept = {field: heading for field, (_, heading) in SHORT.items() if heading}
        headings = {"engine": "engine"} | kept | finest
        note = (
            f"At the usual step size, and at that of {coarse} to {fine} ms which keeps it longest;"
            f" 9 of 10: nine tenths of runs from {STARTS} instants of a step keep it until then."
        )
    else:
        rows = [row if isfinite(row["error"]) else row | {"dt_s": nan} for row in rows]
        headings = {"engine": "engine"} | finest | {"error": "least\nerror", "dt_s": AT}
        note = (
            f"Tried: {coarse} to {fine} ms. A step size counts only if it and every finer one keep"
            " the error, and it does from nine tenths of the instants of a step."
        )
    print_rows(console, rows, headings, title)
    console.print(note, highlight=False)


def print_changes(console: Console, advice: Advice) -> None:
    what = "this part of the scene" if advice.until < advice.duration else "the scene"
    title = f"What {what} does not need: one option changed, at the same step size"
    rows = [
        [
            f"{change.plain.name}, {change.changed.change}",
            " → ".join(number(error, 2) for error in change.errors),
            f"× {number(change.changed.cost / change.plain.cost, 2)}",
            change.verdict(advice.bound, advice.floor),
        ]
        for change in advice.changes
    ]
    print_table(console, ["engine, with", "error", "cost", "verdict"], rows, title, ["verdict"])
    console.print()


def sentence_on_times(advice: Advice) -> str:
    said = f"Two timings of the same engine differ by {advice.noise:.0%}"
    if advice.quiet:
        return f"{said}. Costs that differ by less than {advice.floor:.0%} are the same."
    causes = [said] if advice.noise > LOUD else []
    if advice.busy > BUSY:
        causes.append(f"Other programs keep {advice.busy:.1f} of {os.cpu_count()} cores busy")
    return (
        f"{', and '.join([causes[0], *(each[0].lower() + each[1:] for each in causes[1:])])}, so"
        " times cannot be compared: measure again when the machine is idle."
    )
