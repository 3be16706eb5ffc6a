"""`crosscheck advise`: the cheapest engine and step size that keep an error in one scene, until
when the others keep it, and the engine options that it does not need."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from math import inf, isfinite, nan
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
    Answer,
    Inquiry,
    NoAdvice,
    Requirement,
    floor_of,
)
from crosscheck2d.reports.speed.ladder import PURPOSES, STARTS
from crosscheck2d.reports.terminal.console import Console, print_table, print_texts
from crosscheck2d.reports.terminal.exits import DONE, FAILED, refuse, say
from crosscheck2d.reports.terminal.progress import Progress

SHOWN = 3  # ranks: the cheapest and the next two
# tables: a field of their rows -> its heading; step sizes are shown in ms
CHOICES = {"rank": "", "engine": "engine", "dt_s": "dt, ms", "error": "error"}
CHOICES |= {"error_of_nine_tenths": "9 of 10\nwithin", "us_per_simulated_s": "µs per\nsimulated s"}
NINE, AT = "9 of 10\nuntil, s", "at dt,\nms"
UNTIL = {
    "engine": "engine",
    "kept_until_s": "until,\ns",
    "kept_from_nine_tenths_until_s": NINE,
    "at_dt_s": AT,
    "longest_until_s": "longest\nuntil,\ns",
    "longest_from_nine_tenths_until_s": NINE,
    "longest_at_dt_s": AT,
}


def give_advice(
    scene: str, error: str, purpose: str, engines: Sequence[str], seed: int, as_json: bool
) -> NoReturn:
    """Measure and print; exits 0, 1 where no engine keeps the error or there is no exact answer,
    2 on bad input."""
    if purpose not in PURPOSES:
        refuse([unknown("purpose", purpose, PURPOSES) + f"; allowed: {', '.join(PURPOSES)}"])
    requirement = Requirement(scene, seed, purpose, bound_of(error))
    checked_scenes([scene], [], False, seed)
    at_start = open_scene(scene, seed).scene
    rows = {name: row_of(name) for name in checked_engines(engines, ENGINES)}
    with Progress() as progress:
        try:
            inquiry = Inquiry(requirement, os.cpu_count() or 1, progress)
            answer = inquiry.advise(told_apart(rows, at_start))
        except NoAdvice as reason:
            say(f"{scene}: {reason}")
            sys.exit(FAILED)
    kept = [*answer["cheapest_first"], *(answer["statistics"] or {}).get("cheapest_first", ())]
    best = next((row for row in kept if row["library"]), None)
    snippet = write_snippet(best["engine"], at_start, best["dt_s"]) if best else ""
    if as_json:
        print(json.dumps(finite(answer) | {"snippet": snippet}, indent=1))
    else:
        print_advice(answer, snippet)
    sys.exit(DONE if answer["cheapest_first"] else FAILED)


def bound_of(error: str) -> float:
    text, scale = (error[:-1], 0.01) if error.endswith("%") else (error, 1.0)
    try:
        bound = float(text) * scale
    except ValueError:
        bound = 0.0
    if not (isfinite(bound) and bound > 0):
        refuse([f"--error {error!r} is no positive number; write 1% or 0.01"])
    return bound


def finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [finite(part) for part in value]
    return value if not isinstance(value, float) or isfinite(value) else None


def print_advice(answer: Answer, snippet: str = "") -> None:
    console = Console()
    question = f"{PURPOSES[answer['purpose']].what}, at most {number(answer['error_at_most'])}"
    console.print(f"{answer['scenario']}: {question}, {judged(answer)}\n", highlight=False)
    quiet = isfinite(floor_of(answer["noise"], answer["cores_busy"]))
    on_times = f"{sentence_on_times(answer)}\n" if answer["cheapest_first"] else ""
    if on_times and not quiet:  # before the costs that it concerns
        console.print(on_times, highlight=False)
    print_group(console, answer, True)
    if statistics := answer["statistics"]:
        console.print(
            f"Averages over time need less: `--for {STATISTICS}` (energies, distance from the"
            f" start; at most {number(statistics['error_at_most'])})",
            style="bold",
        )
        if statistics["cheapest_first"] and not isfinite(
            floor_of(statistics["noise"], statistics["cores_busy"])
        ):
            console.print(sentence_on_times(statistics), highlight=False)
        print_group(console, statistics, True)
    print_group(console, answer, False)
    partial = "Not advised: what goes wrong in the whole scene"
    for title, rows in ((partial, answer["not_to_the_end"]), ("Why", answer["not_within"])):
        if rows:
            print_texts(console, {row["engine"]: row["why"] for row in rows}, title)
            console.print()
    if answer["changes"]:
        print_changes(console, answer)
    if on_times and quiet:
        console.print(on_times, highlight=False)
    if snippet:
        console.print("The settings that were run:", style="bold")
        console.print(snippet, highlight=False, soft_wrap=True)


def judged(answer: Answer) -> str:
    part = f"up to {number(answer['until_s'])} of {number(answer['duration_s'])} s"
    early = is_cut(answer) and not answer["collisions_judged"]
    return f"{part}, before any collision" if early else part


def is_cut(answer: Answer) -> bool:
    return bool(answer["until_s"] < answer["duration_s"])


def print_group(console: Console, answer: Answer, library: bool) -> None:
    """Print the libraries, or the solvers of this project: those that keep the error, and until
    when the others do."""
    ranked, short, partial = (
        [row for row in answer[key] if row["library"] is library]
        for key in ("cheapest_first", "not_within", "not_to_the_end")
    )
    group = "Libraries" if library else "Solvers of this project"
    if ranked:
        print_choices(console, answer, ranked, group)
    elif short or partial:
        engine = "library" if library else "solver of this project"
        right = " that is right in the whole scene" if partial else ""
        console.print(f"No {engine}{right} keeps this error at any step size tried.", style="bold")
    if short:
        print_short(console, answer, short, group)
    if ranked or short or partial:
        console.print()


def print_rows(
    console: Console, rows: Sequence[Answer], headings: Mapping[str, str], title: str, note: str
) -> None:
    def cell(field: str, value: Any) -> str:
        return value if field == "engine" else number(value * (1e3 if "dt_s" in field else 1))

    cells = [[cell(field, row[field]) for field in headings] for row in rows]
    print_table(console, [*headings.values()], cells, title)
    console.print(note, highlight=False)


def print_choices(console: Console, answer: Answer, ranked: Sequence[Answer], group: str) -> None:
    part = ", in the whole scene"
    if is_cut(answer):
        part = f": error {judged(answer)}; cost of the whole scene"
    rows = [row for row in ranked if row["rank"] <= SHOWN]
    dearer = ranked[len(rows) :]
    if not isfinite(floor_of(answer["noise"], answer["cores_busy"])):
        rows = [row | {"rank": nan} for row in rows]
    note = f"9 of 10 within: the error of nine tenths of runs from {STARTS} instants of a step."
    print_rows(console, rows, CHOICES, f"{group}, cheapest first{part}", note)
    if dearer:
        costs = (f"{row['engine']} ({number(row['us_per_simulated_s'])} µs)" for row in dearer)
        console.print(f"Also within it: {', '.join(costs)}.", highlight=False)


def print_short(console: Console, answer: Answer, short: Sequence[Answer], group: str) -> None:
    # how near they come; and of an error that only grows until when they keep it
    coarse, *_, fine = (number(dt * 1e3) for dt in answer["dt_s_tried"])
    until = {row["engine"]: float(np.nan_to_num(row["longest_until_s"], nan=-inf)) for row in short}
    rows = sorted(short, key=lambda row: (-until[row["engine"]], row["engine"]))
    finest = {"error_at_finest": f"error at\n{fine} ms"}
    title = f"{group} that do not keep it"
    if answer["purpose"] in LASTING:
        title += f" to {number(answer['until_s'])} s, and until when"
        headings = UNTIL | finest
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
    print_rows(console, rows, headings, title, note)


def print_changes(console: Console, answer: Answer) -> None:
    what = "this part of the scene" if is_cut(answer) else "the scene"
    title = f"What {what} does not need: one option changed, at the same step size"
    rows = [
        [
            f"{change['engine']}, {change['change']}",
            " → ".join(number(error, 2) for error in change["medians"]),
            f"× {number(change['cost_ratio'], 2)}",
            change["verdict"],
        ]
        for change in answer["changes"]
    ]
    print_table(console, ["engine, with", "error", "cost", "verdict"], rows, title, ["verdict"])
    console.print()


def sentence_on_times(answer: Answer) -> str:
    noise, busy = answer["noise"], answer["cores_busy"]
    differ = f"two timings of the same engine differ by {noise:.0%}"
    floor = floor_of(noise, busy)
    if isfinite(floor):
        return f"{upper(differ)}. Costs that differ by less than {floor:.0%} are the same."
    causes = [differ] if noise > LOUD else []
    if busy > BUSY:
        causes.append(f"other programs keep {busy:.1f} of {os.cpu_count()} cores busy")
    return (
        f"{upper(', and '.join(causes))}, so times cannot be compared: measure again when the"
        " machine is idle."
    )


def upper(text: str) -> str:
    return text[:1].upper() + text[1:]
