"""`crosscheck speed`: measure, write the tables and the page, print a summary."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NoReturn

from crosscheck2d.adapters.engines import ENGINES, OWN, row_of
from crosscheck2d.reports.compare.accuracy import ACCURACIES, WHO, said_of_cheaper, said_of_pool
from crosscheck2d.reports.run.arguments import checked_engines, checked_scenes, opening
from crosscheck2d.reports.run.cells import about
from crosscheck2d.reports.run.made import digest_of
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.speed import figures
from crosscheck2d.reports.speed.budget import explained_share
from crosscheck2d.reports.speed.measure import Kept, Measuring
from crosscheck2d.reports.speed.page import NEVER, NOT_REACHED, cost_of, write_page
from crosscheck2d.reports.speed.plan import FULL, QUICK, SpeedPlan
from crosscheck2d.reports.speed.tables import Results
from crosscheck2d.reports.terminal.console import Console, print_list, print_table, print_texts
from crosscheck2d.reports.terminal.exits import DONE, FAILED, keeping, say
from crosscheck2d.reports.terminal.progress import Progress

MACHINE, FIGURES, PAGE = "machine.json", "speed_figures.csv", "speed.html"
SPEED = "crosscheck speed"


def run_speed(
    scenes: Sequence[str],
    engines: Sequence[str],
    full: bool,
    fresh: bool,
    seed: int,
    out: Path,
    command: str,
) -> NoReturn:
    """Measure and report into `out`, or go on with what was interrupted there; exits 0, 1 (no
    result), 2 or 130."""
    effort = FULL if full else QUICK
    # without named scenes: all scenes of the effort, the sizes and the options
    named = checked_scenes(scenes, [], False, seed)
    effort = effort.of_scenes(named) if named else effort
    plan = SpeedPlan(effort, checked_engines(engines, ENGINES), seed, os.cpu_count() or 1)
    header = about(command, seed)
    with opening(out, SPEED, fresh) as store:
        kept = kept_of(plan, header, store)
        with keeping(out, lambda: "The finished part is kept: give the same command again"):
            with Progress() as progress:
                measured = Measuring(plan, progress, kept).run()
                progress.say("writing the tables and the page")
                header |= {"seconds": progress.seconds, "load": measured.busy}
            header["measured"] = kept.first
            if measured.errors.empty:
                for what, reason in measured.left_out:
                    say(f"{what}: {reason}")
                say("no scene that was asked for has an exact answer, so no error can be measured")
                sys.exit(FAILED)
            results = Results(plan, measured)
            write_all(store, results, header)
        print_summary(results, str(store.folder / PAGE))
        if kept.first < header["started"]:
            Console().print(
                f"Some of it was measured before, from {kept.first} on: --fresh measures again",
                highlight=False,
            )
    sys.exit(DONE)


def kept_of(plan: SpeedPlan, header: Mapping[str, Any], store: Store) -> Kept:
    files = {scene: digest_of(scene) for scene in plan.effort.scenes if scene.endswith(".toml")}
    files |= {name: row_of(name).source for name in plan.engines if name.endswith(OWN)}
    asked = {"files": files, "engines": plan.engines, "effort": asdict(plan.effort)}
    return Kept(store, asked | {key: header[key] for key in ("seed", "versions", "machine")})


def write_all(store: Store, results: Results, header: Mapping[str, Any]) -> None:
    # tables first, so that what was measured is kept whatever happens to the page
    store.export(MACHINE, json.dumps(header, indent=1) + "\n")
    for name, table in results.files.items():
        store.export(name, table.to_csv(index=False))
    if results.plan.effort.sizes:
        with store.exporting(FIGURES) as path:
            figures.write(path, results, header)
    with store.exporting(PAGE) as path:
        write_page(path, results, header)


def print_summary(results: Results, page: str) -> None:
    console = Console()
    scenes = len(results.asks)
    rows = [
        [f"{engine}:{profile}", *map(cost_of, group.to_dict("records"))]
        for (engine, profile), group in results.pooled_reached.groupby(WHO, sort=False)
    ]
    title = "What an error, in radii, costs: µs per simulated second"
    title += " (in how many of the scenes)" if scenes > 1 else ""
    print_table(console, ["engine", *ACCURACIES], rows, title)
    console.print()
    most = f", in half of the {scenes} scenes or more" if scenes > 1 else ""
    meanings = {
        NEVER: f"at no step size, or the engine failed{most}",
        NOT_REACHED: "not at the step sizes that were tried",
    }
    cells = {cell for row in rows for cell in row[1:]}
    marks = {mark: meaning for mark, meaning in meanings.items() if mark in cells}
    if any(" of " in cell for cell in cells):
        marks[f"k of {scenes}"] = f"in k of the {scenes} scenes, too few to compare"
    print_texts(console, marks)
    sentences = [said_of_pool(results.pooled), said_of_cheaper(results.pooled_reached)]
    if len(results.explained):
        sentences.append(f"Error budget: {explained_share(results.explained)}.")
    sentences.append(results.noise_sentence)
    sentences += [f"Left out: {what}: {reason}." for what, reason in results.measured.left_out]
    print_list(console, filter(None, sentences))
    console.print(f"\n{page}", style="bold", highlight=False, soft_wrap=True)
