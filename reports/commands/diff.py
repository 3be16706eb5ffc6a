"""`crosscheck diff A B`: the differences between two runs (statuses of cells, numbers, times) as a
table; exit 1 if something got worse."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.comparison import COLUMNS
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.verdicts import VERDICTS
from crosscheck2d.reports.compare.view import NOT_JUDGED, rounding_of
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import reading
from crosscheck2d.reports.run.tables import joined
from crosscheck2d.reports.run.timing_pass import is_busy, noise_floor
from crosscheck2d.reports.terminal.console import Console, print_list, print_table
from crosscheck2d.reports.terminal.counts import counted, listed
from crosscheck2d.reports.terminal.exits import DONE, FAILED, FolderTaken, Unusable, refuse, say
from crosscheck2d.reports.terminal.foreign_text import encoded
from crosscheck2d.scenarios.rows import Damaged
from crosscheck2d.scenarios.truth.horizon import DIVERGED

# Measured on two busy cores (load 15 to 20), with 3 scenes and five rounds of timings. Eight runs
# of one build, compared with each other, gave 280 verdicts from 4200 ratios of rounds: 4 were
# "worse", as many with a factor of 1.1 as with 1.35. With the median of the ratios as the factor 8
# were "worse", because other work lengthens a round, but seldom all of them. With every engine
# slowed to 1.5 times its time, 240 verdicts: the factor was above 1.25 in 227, but only 118 were
# "worse". Under such a load the interval is too wide; more rounds and more scenes narrow it.
FACTOR = 1.25
CONFIDENCE = 0.99
# Of the rounding of an engine's numbers. If each coordinate of the start is moved by one rounding,
# the numbers of scenes with few collisions move by up to 56 roundings. Where collisions follow each
# other it is more: up to the horizon of the exact answer `DIVERGED`, which is how the horizon is
# defined. Both are relative to a number above 1, in whatever unit.
ROUNDINGS = 100
ROUNDING = "differs in rounding"
WHOSE = ["scenario", "engine", "profile", "dt_s", "metric", "versus"]
SHOWN = 12  # changes, the worst first
MACHINE = ("system", "architecture", "processor", "cores")
HEADINGS = (
    "engine",
    "status\nworse",
    "status\nbetter",
    "numbers\nthe same",
    "in\nrounding",
    "numbers\nworse",
    "numbers\nbetter",
    "numbers\nother",
    "time\ntaken",
)


class Change(NamedTuple):
    """A difference: the engine, what changed, its value before and after, and the verdict "better",
    "worse", "other" or `ROUNDING`; of a number between two engines also the other one."""

    engine: str
    what: str
    before: str
    after: str
    verdict: str
    factor: float = 1.0
    beside: str = ""


class Timing(NamedTuple):
    """How the times of an engine changed.

    Attributes:
        engine: `engine:profile`.
        factor: median over the cells of the least time after : before.
        low, high: the interval of the median of the `n` ratios, taken round by round.
    """

    engine: str
    factor: float
    low: float
    high: float
    n: int

    @property
    def verdict(self) -> str:
        if self.low > 1 and self.factor > FACTOR:
            return "worse"
        return "better" if self.high < 1 and self.factor < 1 / FACTOR else "same"


Name = tuple[str, str, float]  # scenario, `engine:profile` as the table has it, dt in s
Cells = dict[Name, dict[str, Any]]  # -> the line of the cell


@dataclass(frozen=True)
class Difference:
    """All differences between two runs.

    Attributes:
        warnings: reasons other than the engines why the two may differ.
        statuses, numbers: what changed.
        same: `engine:profile` -> number of values that are equal bit for bit; one between two
            engines counts for both.
        shared: the number of cells (scene, engine and step size) that both runs have.
        timings: of the engines timed in both runs, if the machine is the same.
    """

    warnings: list[str]
    statuses: list[Change]
    numbers: list[Change]
    same: Counter[str]
    shared: int
    timings: list[Timing]

    @property
    def worse(self) -> int:
        verdicts = [change.verdict for change in (*self.statuses, *self.numbers)]
        return [*verdicts, *(timing.verdict for timing in self.timings)].count("worse")


def difference(before: Path, after: Path) -> Difference:
    """Compare what both runs have, in two folders.

    Raises:
        FolderTaken, Unusable, Damaged: a folder cannot be used; says which and what to do.
    """
    with reading(before, COMMAND) as first, reading(after, COMMAND) as second:
        runs = RunResults.read(first), RunResults.read(second)
        tables = table_of(runs[0]), table_of(runs[1])
    cells = by_name(runs[0]), by_name(runs[1])
    both = cells[0].keys() & cells[1].keys()
    machines = [[run.header["machine"][key] for key in MACHINE] for run in runs]
    same_machine = machines[0] == machines[1]
    edited = edited_scenes(*cells)
    # of these scene, settings and versions are the same
    alike = {name for name in both if cells[0][name]["cell"] == cells[1][name]["cell"]}
    numbers, same = changed_numbers(*tables, alike if same_machine else set())
    played = {name for name in both if all(side[name]["status"] == "ok" for side in cells)}
    statuses = changed_statuses(*cells) + changed_judgement(*tables, played)
    numbers, statuses = (
        [
            change._replace(verdict="other")  # nothing in an edited scene is worse or better
            if change.what.partition("  ")[0] in edited and change.verdict in ("worse", "better")
            else change
            for change in changes
        ]
        for changes in (numbers, statuses)
    )
    warnings = [*warnings_of(*runs), *warnings_on_cells(runs, cells, edited)]
    busy = [run for run in runs if run.timings and is_busy(run)]
    warnings += [
        f"{run.folder}: its times are not compared: two timings of the same engine"
        f" differ by a factor of {1 + noise_floor(run).floor:.2f}"
        for run in busy
    ]
    timed = timings_of(*runs, *cells) if same_machine and not busy else []
    return Difference(warnings, statuses, numbers, same, len(both), timed)


def warnings_of(before: RunResults, after: RunResults) -> list[str]:
    """What may differ beside the engines."""
    was, now = before.header, after.header
    warnings = [
        f"differs in machine: {key}: {was['machine'][key]} before, {now['machine'][key]} after"
        for key in MACHINE
        if was["machine"][key] != now["machine"][key]
    ]
    for name in sorted({*was["versions"], *now["versions"]}):
        versions = [header["versions"].get(name, "missing") for header in (was, now)]
        if versions[0] != versions[1]:
            warnings.append(
                f"differs in version: {name}: {versions[0]} before, {versions[1]} after"
            )
    if was["seed"] != now["seed"]:
        warnings.append(f"differs in seed: {was['seed']} before, {now['seed']} after")
    runs = (before, after)
    return warnings + [f"{run.folder} is not complete" for run in runs if not run.complete]


def warnings_on_cells(
    runs: Sequence[RunResults], cells: Sequence[Cells], edited: Sequence[str]
) -> list[str]:
    """On the cells that only one run has, and on edited scenes."""
    warnings = []
    for run, own, other in zip(runs, cells, reversed(cells)):
        if rest := [name for name in own if name not in other]:
            kinds = [dict.fromkeys(engine for _, engine, _ in rest)]
            kinds.append(dict.fromkeys(scene for scene, _, _ in rest))
            engines, scenes = (
                listed([*names[:6], *([f"{len(names) - 6} more"] if len(names) > 6 else [])])
                for names in map(list, kinds)
            )
            warnings.append(
                f"only in {run.folder}: {counted(len(rest), 'cell')} of {engines}, in {scenes}"
            )
    if edited:
        warnings.append(
            f"differs in scene: {listed(edited)}: edited between the runs, so that no result in it"
            " is called worse or better"
        )
    return warnings


def by_name(results: RunResults) -> Cells:
    return {
        (r["scenario"], encoded(f"{r['engine']}:{r['profile']}").decode(), r["dt_s"]): r
        for r in results.records
    }


def edited_scenes(before: Cells, after: Cells) -> list[str]:
    """The names that stand for another scene in each run: a file was edited, or the seed of a
    random scene is another."""
    hashes = [
        {(name[0], record["scene_hash"]) for name, record in cells.items()}
        for cells in (before, after)
    ]
    common = {scene for scene, _ in hashes[0]} & {scene for scene, _ in hashes[1]}
    return sorted({scene for scene, _ in hashes[0] ^ hashes[1]} & common)


def changed_statuses(before: Cells, after: Cells) -> list[Change]:
    changes = []
    for (scenario, engine, dt), cell in before.items():
        was, now = cell["status"], after.get((scenario, engine, dt), cell)["status"]
        if was != now:
            verdict = "worse" if was == "ok" else "better" if now == "ok" else "other"
            changes.append(Change(engine, f"{scenario}  dt {dt:.4g} s  status", was, now, verdict))
    return changes


def changed_judgement(
    before: pd.DataFrame, after: pd.DataFrame, played: Collection[Name]
) -> list[Change]:
    """The cells that both runs `played` but only one judged, so that only that one has numbers."""
    reasons = [
        {
            ((r["scenario"], f"{r['engine']}:{r['profile']}", float(r["dt_s"])), r["versus"]): r
            for r in table[table.metric == "status"].to_dict("records")
        }
        for table in (before, after)
    ]
    changes = []
    for cell, versus in sorted(reasons[0].keys() ^ reasons[1].keys()):
        if cell in played:
            scenario, engine, dt = cell
            what = f"{scenario}  dt {dt:.4g} s  against {versus}: status"
            was, now = (of.get((cell, versus), {"note": "judged"})["note"] for of in reasons)
            verdict = "better" if now == "judged" else "worse"
            changes.append(Change(engine, what, was, now, verdict))
    return changes


def table_of(results: RunResults) -> pd.DataFrame:
    """deviations.csv with all values as text: equal text means equal bits."""
    table = pd.read_csv(BytesIO(joined(results.tables())), dtype=str, keep_default_na=False)
    if list(table.columns) != list(COLUMNS):
        raise Unusable(
            f"{results.folder}: its tables are of another version; make them again: crosscheck"
            f" report {results.folder}"
        )
    return table


def changed_numbers(
    before: pd.DataFrame, after: pd.DataFrame, equal: Collection[Name]
) -> tuple[list[Change], Counter[str]]:
    """Every number that differs between the tables, and how many are equal, by engine.

    The numbers of `equal` cells must have the same bits: any change is worse. Elsewhere the metric
    says which value is better, unless they differ in rounding; a verdict that fails now, and did
    not before, is worse. A deviation between two engines, or a number that only one run judges, is
    then "other".
    """
    both = before.merge(after, on=WHOSE, suffixes=("", "_after"))
    both["name"] = both.engine + ":" + both.profile
    differs = both.value != both.value_after
    changes = []
    for row in both[differs].to_dict("records"):
        scenario, dt = row["scenario"], float(row["dt_s"])
        beside = row["versus"] if ":" in row["versus"] else ""
        engines = [row["name"], beside] if beside else [row["name"]]
        was, now = (float(row[key] or "nan") for key in ("value", "value_after"))
        must = all((scenario, name, dt) in equal for name in engines)
        first, second = (row[key] or NOT_JUDGED for key in ("value", "value_after"))
        what = f"{scenario}  dt {dt:.4g} s  {row['metric']} against {row['versus']}"
        if NOT_JUDGED in (first, second):
            verdict = "other"
        elif must:
            verdict, what = "worse", f"{what} (same cell, other bits)"
        elif is_rounding(engines, was, now):
            verdict = ROUNDING
        elif row["metric"] in VERDICTS:
            fails = [
                not value <= float(row[f"bound{end}"])
                for value, end in ((was, ""), (now, "_after"))
            ]
            verdict = "other" if fails[0] == fails[1] else "worse" if fails[1] else "better"
        else:
            verdict = verdict_of(row["metric"], row["versus"], was, now)
        factor = ratio(was, now)
        changes.append(Change(row["name"], what, first, second, verdict, factor, beside))
    equal_rows = both[~differs]
    between = equal_rows.versus.str.contains(":", regex=False)
    return changes, Counter([*equal_rows.name, *equal_rows.versus[between]])


def is_rounding(engines: Sequence[str], was: float, now: float) -> bool:
    if not (math.isfinite(was) and math.isfinite(now)):
        return False
    bound = max(DIVERGED, *(ROUNDINGS * rounding_of(name) for name in engines))
    return abs(now - was) <= bound * max(1.0, abs(was), abs(now))


def verdict_of(metric: str, versus: str, was: float, now: float) -> str:
    better = METRICS[metric].better if metric in METRICS else ""
    if ":" in versus or better in ("", "as stated"):
        return "other"
    if math.isnan(was) or math.isnan(now):
        return "worse" if math.isnan(now) else "better"
    worse = now < was if better == "higher" else abs(now) > abs(was)
    return "worse" if worse else "better" if abs(now) != abs(was) else "other"


def ratio(was: float, now: float) -> float:
    small, large = sorted((abs(was), abs(now)))
    return large / small if small > 0 and math.isfinite(large) else math.inf


def timings_of(one: RunResults, other: RunResults, before: Cells, after: Cells) -> list[Timing]:
    ratios: dict[str, list[float]] = {}
    least: dict[str, list[float]] = {}
    for name in before.keys() & after.keys():
        was = one.timings.get(before[name]["cell"], {}).get(0)
        now = other.timings.get(after[name]["cell"], {}).get(0)
        if was is None or now is None or was["timed_s"] != now["timed_s"]:
            continue
        rounds = [*zip(was["cost"], now["cost"])]
        alike = before[name]["scene_hash"] == after[name]["scene_hash"]
        if alike and rounds and min(min(rounds)) > 0:
            fastest, then = (min(times) for times in zip(*rounds))
            least.setdefault(name[1], []).append(then / fastest)
            ratios.setdefault(name[1], []).extend(now / was for was, now in rounds)
    return [
        timing(engine, sorted(ratios[engine]), float(np.median(least[engine])))
        for engine in sorted(ratios)
    ]


def timing(engine: str, ratios: list[float], factor: float) -> Timing:
    """The distribution-free interval of the median of sorted ratios, from order statistics (the
    sign test's)."""
    n = len(ratios)
    tail, k = 0.5**n, 0
    while 2 * tail <= 1 - CONFIDENCE:
        k += 1
        tail += math.comb(n, k) * 0.5**n
    low, high = (ratios[k - 1], ratios[n - k]) if k else (0.0, math.inf)
    return Timing(engine, factor, low, high, n)


def show_difference(before: Path, after: Path) -> NoReturn:
    """Print the difference; exits 0, 1 (something got worse, or the runs share no cell) or 2 (a
    folder cannot be used)."""
    try:
        changed = difference(before, after)
    except OSError as fault:
        refuse(f"{fault.filename or f'{before}, {after}'}: {fault.strerror or fault}")
    except (Damaged, FolderTaken, Unusable) as fault:
        refuse(str(fault))
    if not changed.shared:
        say(
            f"{before} and {after} share no cell (scene, engine and step size), so that nothing can"
            " be compared"
        )
        sys.exit(FAILED)
    console = Console()
    for warning in changed.warnings:
        console.print(warning, style="yellow", highlight=False)
    title = "What changed; a number between two engines counts for both"
    print_table(console, HEADINGS, by_engine(changed), title, left=HEADINGS[-1:])
    console.print()
    total = len(changed.statuses) + len(changed.numbers)
    if worst := sorted((*changed.statuses, *changed.numbers), key=severity)[:SHOWN]:
        shown = f"The {len(worst)} largest of {total} changes" if total > SHOWN else "The changes"
        console.print(f"{shown}, before → after", style="italic", highlight=False)
        print_list(console, map(change_text, worst))
        console.print()
    console.print(summary(changed), highlight=False)
    sys.exit(FAILED if changed.worse else DONE)


def by_engine(changed: Difference) -> list[list[str]]:
    timings = {timing.engine: timing for timing in changed.timings}
    changes = *changed.statuses, *changed.numbers
    engines = [*changed.same, *(change.engine for change in changes)]
    engines += [change.beside for change in changes if change.beside]
    rows = []
    for engine in dict.fromkeys((*engines, *timings)):
        statuses, numbers = (
            Counter(x.verdict for x in kind if engine in (x.engine, x.beside))
            for kind in (changed.statuses, changed.numbers)
        )
        counts = [statuses["worse"], statuses["better"]]
        same = str(changed.same[engine])
        others = [numbers[verdict] for verdict in (ROUNDING, "worse", "better", "other")]
        texts = [*(str(n or "") for n in counts), same, *(str(n or "") for n in others)]
        rows.append([engine, *texts, time_text(timings.get(engine))])
    return rows


def change_text(change: Change) -> str:
    values = f"{change.before or 'nan'} → {change.after or 'nan'}"
    return f"{change.verdict}: {change.engine}, {change.what}: {values}"


def time_text(timing: Timing | None) -> str:
    if timing is None:
        return ""
    if timing.high == math.inf:
        return f"×{timing.factor:.2f} (of {timing.n}: too few)"
    verdict = "" if timing.verdict == "same" else f" {timing.verdict}"
    return f"×{timing.factor:.2f} ({timing.low:.2f}–{timing.high:.2f}){verdict}"


def severity(change: Change) -> tuple[bool, bool, bool, float]:
    # worse changes first, rounding last, then statuses first, then by size
    return (
        change.verdict != "worse",
        change.verdict == ROUNDING,
        not change.what.endswith("status"),
        -change.factor,
    )


def summary(changed: Difference) -> str:
    said = f"{counted(changed.worse, 'result') if changed.worse else 'Nothing'} got worse."
    if not changed.timings:
        return f"{said} No times were compared: run both on one machine that is idle."
    return (
        f"{said} A time counts as worse if its factor is above {FACTOR:g} and its whole 99 %"
        " interval above 1."
    )
