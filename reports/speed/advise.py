"""`crosscheck advise`: the cheapest engine and step size that keep an error in one scene, and the
engine options that it does not need."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from math import isfinite
from typing import Any, NoReturn

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.arguments import checked_engines, checked_scenes, unknown
from crosscheck2d.reports.speed.advice import BUSY, LOUD, Advice, Attempt, Inquiry, NoAdvice
from crosscheck2d.reports.speed.purposes import PURPOSES
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import DONE, FAILED, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.reports.terminal.tables import print_table, print_texts

SHOWN = 3  # the cheapest and the next two


def give_advice(
    scene: str, error: str, purpose: str, engines: Sequence[str], seed: int, as_json: bool
) -> NoReturn:
    """Measure and print; exits 0, 1 where no engine keeps the error or there is no exact answer,
    2 on bad input."""
    if purpose not in PURPOSES:
        refuse([unknown("purpose", purpose, PURPOSES) + f"; allowed: {', '.join(PURPOSES)}"])
    bound = bound_of(error)
    (checked,) = checked_scenes([scene], [], False, seed)
    names = checked_engines(engines, ENGINES)
    with Progress() as progress:
        try:
            asked = Inquiry(checked, seed, purpose, os.cpu_count() or 1, progress)
            advice = asked.advice(bound, names)
        except NoAdvice as why:
            say(f"{scene}: {why}")
            sys.exit(FAILED)
    if as_json:
        print(json.dumps(as_plain(advice, purpose, bound), indent=1, allow_nan=False))
    else:
        print_advice(advice, purpose, bound)
    sys.exit(DONE if advice.keeping else FAILED)


def bound_of(error: str) -> float:
    """The number that "1%" or "0.01" stands for; exits 2 unless it is a positive number."""
    text, scale = (error[:-1], 0.01) if error.endswith("%") else (error, 1.0)
    try:
        bound = float(text) * scale
    except ValueError:
        bound = 0.0
    if not (isfinite(bound) and bound > 0):
        refuse([f"--error {error!r} is no positive number; write 1% or 0.01"])
    return bound


def as_plain(advice: Advice, purpose: str, bound: float) -> dict[str, Any]:
    """The advice as JSON values; a number that is not finite is null."""
    return {
        "scenario": advice.scene,
        "purpose": purpose,
        "error_at_most": bound,
        "until_s": advice.until,
        "duration_s": advice.duration,
        "collisions_judged": advice.collisions,
        "dt_s_tried": list(advice.step_sizes),
        "cheapest_first": [row_of_attempt(one) for one in advice.keeping],
        "not_within": [
            row_of_attempt(short.best) | {"error_at_finest": finite(short.finest), "why": short.why}
            for short in advice.short
        ],
        "not_to_the_end": [row_of_attempt(one) | {"why": one.reason} for one in advice.partial],
        "changes": [
            row_of_attempt(change.changed)
            | {
                "change": change.changed.change,
                "error_without": finite(change.plain.error),
                "cost_ratio": finite(change.changed.cost / change.plain.cost),
                "verdict": change.verdict(bound, advice.floor),
            }
            for change in advice.changes
        ],
        "noise": finite(advice.noise),
        "cores_busy": finite(advice.busy),
    }


def row_of_attempt(one: Attempt) -> dict[str, Any]:
    """An attempt as JSON values."""
    return {
        "engine": one.name,
        "dt_s": one.dt,
        "error": finite(one.error),
        "us_per_simulated_s": finite(one.cost * 1e6),
    }


def finite(value: float) -> float | None:
    """The number; None if it is not finite."""
    return value if isfinite(value) else None


def print_advice(advice: Advice, purpose: str, bound: float) -> None:
    """Print the engines that keep the error, those that do not, the options, and how reliable the
    times are."""
    console = Console()
    console.print(
        f"{advice.scene}: {PURPOSES[purpose].what}, at most {number(bound)}, {advice.judged}",
        highlight=False,
    )
    console.print()
    if advice.keeping and not advice.quiet:  # before the costs that it concerns
        console.print(f"{sentence_on_times(advice)}\n", highlight=False)
    if advice.keeping:
        print_choices(console, advice)
    else:
        which = "engine that is right in the whole scene" if advice.partial else "engine"
        console.print(f"No {which} keeps this error at any step size tried.", style="bold")
    if advice.partial:
        console.print()
        print_texts(
            console,
            {one.name: one.reason for one in advice.partial},
            "Not advised: what goes wrong in the whole scene",
        )
    if advice.short:
        console.print()
        print_short(console, advice)
    if advice.changes:
        console.print()
        print_changes(console, advice, bound)
    if advice.keeping and advice.quiet:
        console.print(f"\n{sentence_on_times(advice)}", highlight=False)


def print_choices(console: Console, advice: Advice) -> None:
    """The cheapest and the next two, and the names and costs of the others."""
    rows = [
        [one.name, number(one.dt * 1e3), number(one.error), number(one.cost * 1e6)]
        for one in advice.keeping[:SHOWN]
    ]
    headings = ["engine", "dt, ms", "error", "µs per\nsimulated s"]
    title = "Cheapest first, in the whole scene"
    if advice.until < advice.duration:
        title = f"Cheapest first: error {advice.judged}; cost of the whole scene"
    print_table(console, headings, rows, title)
    if dearer := advice.keeping[SHOWN:]:
        names = ", ".join(f"{one.name} ({number(one.cost * 1e6)} µs)" for one in dearer)
        console.print(f"Also within it: {names}.", highlight=False)


def print_short(console: Console, advice: Advice) -> None:
    """Print the engines that do not keep the error. One that keeps it at a coarser step size than
    the finest does so by chance: a step size counts only if every finer one keeps it, too."""
    coarse, *_, fine = advice.step_sizes
    title = f"Not within it at {number(fine * 1e3)} ms, the finest of the step sizes tried"
    rows = [
        [
            best.name,
            number(finest),
            number(best.error),
            number(best.dt * 1e3) if isfinite(best.error) else "–",
        ]
        for best, finest, _ in advice.short
    ]
    headings = ["engine", f"error at\n{number(fine * 1e3)} ms", "least\nerror", "at dt,\nms"]
    print_table(console, headings, rows, title)
    console.print(
        f"Tried: {number(coarse * 1e3)} to {number(fine * 1e3)} ms. A step size counts only if"
        " every finer one keeps the error, too.",
        highlight=False,
    )
    console.print()
    print_texts(console, {best.name: why for best, _, why in advice.short}, "Why")


def print_changes(console: Console, advice: Advice, bound: float) -> None:
    """Print the effect of each option of the engines that keep the error."""
    what = "this part of the scene" if advice.until < advice.duration else "the scene"
    title = f"What {what} does not need: one option changed, at the same step size"
    rows = [
        [
            f"{change.plain.name}, {change.changed.change}",
            f"{number(change.plain.error, 2)} → {number(change.changed.error, 2)}",
            f"× {number(change.changed.cost / change.plain.cost, 2)}",
            change.verdict(bound, advice.floor),
        ]
        for change in advice.changes
    ]
    print_table(console, ["engine, with", "error", "cost", "verdict"], rows, title, ["verdict"])


def sentence_on_times(advice: Advice) -> str:
    """A sentence on how far the times can be compared."""
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
