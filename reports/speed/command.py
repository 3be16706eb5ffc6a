"""`crosscheck speed`: measure, write the tables and the page, say what came out."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from math import isfinite
from pathlib import Path
from typing import Any, NoReturn

from rich.table import Table

from adapters.engines import OWN, row_of
from reports.page import style
from reports.run.arguments import checked_engines, checked_scenes, opening
from reports.run.folders import discard, given_back, open_part, place_of, replace_folder
from reports.run.journal import Journal
from reports.run.machine import about
from reports.run.made import Kind, digest_of, writing
from reports.run.scenes import open_scene
from reports.speed import figures
from reports.speed.effort import FULL, QUICK
from reports.speed.explained import sentence
from reports.speed.kept import Kept
from reports.speed.measure import measure
from reports.speed.page import write_page
from reports.speed.pareto import ACCURACIES
from reports.speed.plan import SpeedPlan
from reports.speed.pooling import said_of_pool
from reports.speed.results import Results
from reports.terminal.console import Console
from reports.terminal.exits import DONE, FAILED, broken_off, say
from reports.terminal.foreign_text import put_text
from reports.terminal.progress import Progress

MACHINE, FIGURES, PAGE = "machine.json", "speed_figures.csv", "speed.html"
SPEED = Kind("crosscheck speed", r"journal\.jsonl")


def run_speed(
    scenes: Sequence[str],
    engines: Sequence[str],
    full: bool,
    resume: bool,
    seed: int,
    out: Path,
    command: str,
) -> NoReturn:
    """Measure and report into `out`, or go on with what was interrupted there; exits 0, 1 (no
    result), 2 or 130."""
    effort = FULL if full else QUICK
    # none named: all that the effort has, sizes and options besides
    named = checked_scenes(scenes, [], False, seed)
    effort = replace(effort, scenes=tuple(named)) if named else effort
    plan = SpeedPlan(
        effort.scenes, checked_engines(engines), effort, seed, os.cpu_count() or 1, whole=not named
    )
    header = about(command, seed)
    with opening(out):
        out = place_of(out)
        journal = open_part(out, SPEED)
        with given_back(journal):
            kept = kept_of(plan, header, journal, resume)
    part = kept.journal.path.parent
    with (
        broken_off(part, lambda: f"What has ended is kept in {part}: ask again with --resume"),
        kept.journal,
    ):
        results, header = carry_out(plan, header, kept, resume)
        if not results.measured.errors.size:
            nothing_measured(part, results)
        write_all(part, results, header)
        replace_folder(part, out, SPEED)
    print_summary(results, str(out / PAGE))
    sys.exit(DONE)


def nothing_measured(part: Path, results: Results) -> NoReturn:
    """Leave nothing behind, and say why there is no answer to set a time against; exits 1."""
    discard(part, SPEED)
    for what, why in results.left_out:
        say(f"{what}: {why}")
    say("no scene that was asked for has an exact answer, so there is no error to set against time")
    sys.exit(FAILED)


def kept_of(plan: SpeedPlan, header: Mapping[str, Any], journal: Journal, resume: bool) -> Kept:
    """What is kept of an interrupted measurement of this plan, by the same versions on the same
    machine."""
    files = {scene: digest_of(scene) for scene in plan.scenes if scene.endswith(".toml")}
    files |= {name: row_of(name).source for name in plan.engines if name.endswith(OWN)}
    asked = {
        "scenes": plan.scenes,
        "files": files,
        "engines": plan.engines,
        "effort": asdict(plan.effort),
        "whole": plan.whole,
    }
    scenarios = {scene: open_scene(scene, seed) for scene, seed in plan.seeded_scenes}
    return Kept(
        journal,
        asked | {key: header[key] for key in ("seed", "versions", "machine")},
        resume,
        scenarios,
    )


def carry_out(
    plan: SpeedPlan, header: dict[str, Any], kept: Kept, resume: bool
) -> tuple[Results, dict[str, Any]]:
    """All that was measured, and the header that tables and page carry."""
    with Progress() as progress:
        if resume:
            progress.note(f"tasks of the same plan and versions that had ended: {len(kept)}")
        results = Results(plan, measure(plan, progress, kept))
        progress.say("writing the tables and the page")
        return results, header | {"seconds": progress.seconds, "load": results.measured.busy}


def write_all(folder: Path, results: Results, header: Mapping[str, Any]) -> None:
    """Tables first, then the page, so that what was measured is kept whatever happens to the
    page."""
    with writing(folder, (MACHINE, *results.files, FIGURES, PAGE)):
        put_text(folder / MACHINE, json.dumps(header, indent=1) + "\n")
        results.write(folder)
        if results.plan.whole:
            figures.write(folder / FIGURES, results, header)
        write_page(folder / PAGE, results, header)


def print_summary(results: Results, page: str) -> None:
    """What each accuracy costs, pooled, the noise floor, and where the page is."""
    console = Console()
    title = (
        "µs per simulated second for so small an error, of a radius; median of"
        f" {len(results.scenes)} scenes"
    )
    title += (
        "\n(k of n: so accurate in k scenes only; never: at no dt, or failed, in half of them or"
        " more)"
    )
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("engine", no_wrap=True)
    for accuracy in ACCURACIES:
        table.add_column(accuracy, justify="right", no_wrap=True)
    for (engine, profile), group in results.pooled_reached.groupby(
        ["engine", "profile"], sort=False
    ):
        cells = (
            (
                style.number(row["cost"])
                if isfinite(row["cost"])
                else "never"
                if row["lost"]
                else f"{row['got']} of {row['of']}"
            )
            for row in group.to_dict("records")
        )
        table.add_row(f"{engine}:{profile}", *cells)
    console.print(table)
    console.print(said_of_pool(results.pooled), highlight=False)
    if len(results.explained):
        console.print(f"Error budget: {sentence(results.explained)}.", highlight=False)
    console.print(said_of_noise(results), highlight=False)
    for what, why in results.left_out:
        console.print(f"left out: {what}: {why}", highlight=False)
    console.print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)


def said_of_noise(results: Results) -> str:
    """The noise floor in a sentence, and what to do where it is too loud."""
    noise = results.noise_summary()
    if not noise["pairs"]:
        return "No engine was timed against itself, so the noise floor is not known."
    said = (
        f"Noise floor: an engine against itself reads {noise['median']:.3f}, half of"
        f" {noise['pairs']} pairs from {noise['low']:.3f} to {noise['high']:.3f}."
    )
    if noise["quiet"]:
        return said
    return (
        f"{said} That is too loud: it must stay within 0.95 and 1.05. Measure alone on the machine"
        " to quote a time."
    )
