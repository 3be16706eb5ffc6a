"""`crosscheck advise`: the cheapest engine and step size that keep an error in one scene, until
when the others keep it, and the engine options that it does not need."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from math import isfinite, isnan
from typing import Any, NoReturn

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
    OutOfReach,
    Requirement,
    reach,
)
from crosscheck2d.reports.speed.ladder import PURPOSES, STARTS
from crosscheck2d.reports.terminal.console import Console, print_table, print_texts
from crosscheck2d.reports.terminal.exits import DONE, FAILED, refuse, say
from crosscheck2d.reports.terminal.progress import Progress

SHOWN = 3  # ranks: the cheapest and the next two
LIBRARIES, OWN_SOLVERS = "libraries", "solvers of this project"


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
        print(json.dumps(to_json(advice) | {"snippet": snippet}, indent=1, allow_nan=False))
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


def to_json(advice: Advice) -> dict[str, Any]:
    # a number that is not finite is null
    return {
        "scenario": advice.scene,
        "purpose": advice.purpose,
        "error_at_most": advice.bound,
        "until_s": advice.until,
        "duration_s": advice.duration,
        "collisions_judged": advice.collisions,
        "dt_s_tried": list(advice.step_sizes),
        "cheapest_first": [
            row_of_attempt(one)
            | {
                "rank": rank,
                "error_of_nine_tenths": finite(one.usually),
                "kept_in": one.kept_in(advice.bound),
                "starts": len(one.starts),
            }
            for rank, one in advice.ranked
        ],
        "not_within": [
            row_of_attempt(row.best)
            | {
                "error_at_finest": finite(row.finest),
                "kept_until_s": finite(row.usual.until),
                "kept_from_nine_tenths_until_s": finite(row.usual.lasting),
                "at_dt_s": row.usual.dt,
                "longest_until_s": finite(row.longest.until),
                "longest_from_nine_tenths_until_s": finite(row.longest.lasting),
                "longest_at_dt_s": row.longest.dt,
                "why": row.reason,
            }
            for row in advice.short
        ],
        "not_to_the_end": [row_of_attempt(one) | {"why": one.reason} for one in advice.partial],
        "changes": [
            row_of_attempt(change.changed)
            | {
                "change": change.changed.change,
                "error_without": finite(change.plain.error),
                "cost_ratio": finite(change.changed.cost / change.plain.cost),
                "verdict": change.verdict(advice.bound, advice.floor),
            }
            for change in advice.changes
        ],
        "noise": finite(advice.noise),
        "cores_busy": finite(advice.busy),
        "statistics": to_json(advice.statistics) if advice.statistics else None,
    }


def row_of_attempt(one: Attempt) -> dict[str, Any]:
    return {
        "engine": one.name,
        "library": one.is_library,
        "dt_s": one.dt,
        "error": finite(one.error),
        "us_per_simulated_s": finite(one.cost * 1e6),
    }


def finite(value: float) -> float | None:
    return value if isfinite(value) else None


def print_advice(advice: Advice, snippet: str = "") -> None:
    console = Console()
    question = f"{PURPOSES[advice.purpose].what}, at most {number(advice.bound)}"
    console.print(f"{advice.scene}: {question}, {advice.judged}\n", highlight=False)
    if advice.keeping and not advice.quiet:  # before the costs that it concerns
        console.print(f"{sentence_on_times(advice)}\n", highlight=False)
    for group in (LIBRARIES, OWN_SOLVERS):
        print_group(console, advice, group)
    if advice.partial:
        reasons = {attempt.name: attempt.reason for attempt in advice.partial}
        print_texts(console, reasons, "Not advised: what goes wrong in the whole scene")
        console.print()
    if advice.short:
        print_texts(console, {row.best.name: row.reason for row in advice.short}, "Why")
        console.print()
    if advice.changes:
        print_changes(console, advice)
    if advice.keeping and advice.quiet:
        console.print(f"{sentence_on_times(advice)}\n", highlight=False)
    if snippet:
        console.print("The settings that were run:", style="bold")
        console.print(snippet, highlight=False, markup=False, soft_wrap=True)


def print_group(console: Console, advice: Advice, group: str) -> None:
    """Print the libraries, or the solvers of this project: those that keep the error, and until
    when the others do; and where no library does, which do for averages over time."""
    library = group == LIBRARIES
    ranked = [(rank, each) for rank, each in advice.ranked if each.is_library is library]
    short = [row for row in advice.short if row.best.is_library is library]
    partial = any(attempt.is_library is library for attempt in advice.partial)
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
    if library and advice.statistics is not None:
        statistics = advice.statistics
        console.print(
            f"Averages over time need less: `--for {STATISTICS}` (energies, distance from the"
            f" start; at most {number(statistics.bound)})",
            style="bold",
        )
        if not statistics.quiet and statistics.keeping:
            console.print(sentence_on_times(statistics), highlight=False)
        print_group(console, statistics, LIBRARIES)


def print_choices(
    console: Console, advice: Advice, ranked: Sequence[tuple[int, Attempt]], group: str
) -> None:
    rows = [
        [str(rank) if advice.quiet else "–", each.name]
        + [number(value) for value in (each.dt * 1e3, each.error, each.usually, each.cost * 1e6)]
        for rank, each in ranked
        if rank <= SHOWN
    ]
    headings = ["", "engine", "dt, ms", "error", "9 of 10\nwithin", "µs per\nsimulated s"]
    title = f"{group.capitalize()}, cheapest first"
    if advice.until < advice.duration:
        title += f": error {advice.judged}; cost of the whole scene"
    else:
        title += ", in the whole scene"
    print_table(console, headings, rows, title)
    console.print(
        f"9 of 10 within: the error of nine tenths of runs from {STARTS} instants of a step.",
        highlight=False,
    )
    if dearer := ranked[len(rows) :]:
        names = ", ".join(f"{each.name} ({number(each.cost * 1e6)} µs)" for _, each in dearer)
        console.print(f"Also within it: {names}.", highlight=False)


def print_short(
    console: Console, advice: Advice, rows_short: Sequence[OutOfReach], group: str
) -> None:
    # how near they come; and of an error that only grows until when they keep it

    def until(one: Attempt) -> list[str]:
        return ["–" if isnan(t) else number(t) for t in (one.until, one.lasting)] + [ms(one.dt)]

    def ms(seconds: float) -> str:
        return number(seconds * 1e3)

    coarse, fine = ms(advice.step_sizes[0]), ms(advice.step_sizes[-1])
    short = sorted(rows_short, key=lambda row: (-reach(row.longest), row.best.name))
    headings, title = ["engine"], f"{group.capitalize()} that do not keep it"
    rows = [[row.best.name] for row in short]
    if advice.purpose in LASTING:
        title += f" to {number(advice.until)} s, and until when"
        until_at = ["until,\ns", "9 of 10\nuntil, s", "at dt,\nms"]
        headings += [*until_at, f"longest\n{until_at[0]}", *until_at[1:]]
        rows = [
            [*row, *until(x.usual), *until(x.longest), number(x.finest)]
            for row, x in zip(rows, short)
        ]
        headings.append(f"error at\n{fine} ms")
        note = (
            f"At the usual step size, and at that of {coarse} to {fine} ms which keeps it longest;"
            f" 9 of 10: nine tenths of runs from {STARTS} instants of a step keep it until then."
        )
    else:
        headings += [f"error at\n{fine} ms", "least\nerror", "at dt,\nms"]
        rows = [
            [*row, number(x.finest), number(x.best.error)]
            + [ms(x.best.dt) if isfinite(x.best.error) else "–"]
            for row, x in zip(rows, short)
        ]
        note = (
            f"Tried: {coarse} to {fine} ms. A step size counts only if it and every finer one keep"
            " the error, and it does from nine tenths of the instants of a step."
        )
    print_table(console, headings, rows, title)
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
