"""`crosscheck diff A B`: the differences between two runs (statuses of cells, numbers, times) as a
table; exit 1 if something got worse."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
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
CELL = ["scenario", "name", "dt_s"]  # the name is `engine:profile`
WHOSE = ["scenario", "engine", "profile", "dt_s", "versus"]  # in a table
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
    """A difference: the scene, the engine, what changed, its value before and after, and the
    verdict "better", "worse", "other" or `ROUNDING`; of a number between two engines also the other
    one."""

    scenario: str
    engine: str
    what: str
    before: str
    after: str
    verdict: str
    factor: float = 1.0
    beside: str = ""

    @property
    def text(self) -> str:
        values = f"{self.before or 'nan'} → {self.after or 'nan'}"
        return f"{self.verdict}: {self.engine}, {self.what}: {values}"


class Timing(NamedTuple):
    """How the times of an engine changed.

    Attributes:
        factor: median over the cells of the least time after : before.
        low, high: the interval of the median of the `n` ratios, taken round by round.
    """

    factor: float
    low: float
    high: float
    n: int

    @property
    def verdict(self) -> str:
        if self.low > 1 and self.factor > FACTOR:
            return "worse"
        return "better" if self.high < 1 and self.factor < 1 / FACTOR else "same"

    @property
    def text(self) -> str:
        if self.high == math.inf:
            return f"×{self.factor:.2f} (of {self.n}: too few)"
        verdict = "" if self.verdict == "same" else f" {self.verdict}"
        return f"×{self.factor:.2f} ({self.low:.2f}–{self.high:.2f}){verdict}"


@dataclass(frozen=True)
class Difference:
    """All differences between two runs.

    Attributes:
        warnings: reasons other than the engines why the two may differ.
        statuses, numbers: what changed.
        same: `engine:profile` -> number of values that are equal bit for bit; one between two
            engines counts for both.
        shared: the number of cells (scene, engine and step size) that both runs have.
        timings: `engine:profile` -> of the engines timed in both runs, if the machine is the same.
    """

    warnings: list[str]
    statuses: list[Change]
    numbers: list[Change]
    same: Counter[str]
    shared: int
    timings: Mapping[str, Timing]

    @property
    def worse(self) -> int:
        verdicts = [change.verdict for change in (*self.statuses, *self.numbers)]
        return [*verdicts, *(each.verdict for each in self.timings.values())].count("worse")


def difference(before: Path, after: Path) -> Difference:
    """Compare what both runs have, in two folders.

    Raises:
        FolderTaken, Unusable, Damaged: a folder cannot be used; says which and what to do.
    """
    with reading(before, COMMAND) as first, reading(after, COMMAND) as second:
        runs = RunResults.read(first), RunResults.read(second)
        tables = table_of(runs[0]), table_of(runs[1])
    cells = cells_of(runs[0]), cells_of(runs[1])
    both = cells[0].merge(cells[1], on=CELL, suffixes=("", "_after"))
    hashes = [dict(zip(run.scenario, run.scene_hash)) for run in cells]
    edited = sorted(
        scene
        for scene in hashes[0].keys() & hashes[1].keys()
        if len({h[scene] for h in hashes}) > 1
    )
    machines = [[run.header["machine"][key] for key in MACHINE] for run in runs]
    same_machine = machines[0] == machines[1]
    # of cells with the same key scene, settings and versions are the same
    equal = both[both.cell == both.cell_after] if same_machine else both[:0]
    played = both[(both.status == "ok") & (both.status_after == "ok")]
    numbers, same = changed_numbers(*tables, names_of(equal))
    statuses = changed_statuses(both) + changed_judgement(*tables, names_of(played))
    numbers, statuses = (
        [
            change._replace(verdict="other")  # nothing in an edited scene is worse or better
            if change.scenario in edited and change.verdict in ("worse", "better")
            else change
            for change in changes
        ]
        for changes in (numbers, statuses)
    )
    busy = [run for run in runs if run.times and is_busy(run)]
    warnings = warnings_of(runs, cells, edited) + [
        f"{run.folder}: its times are not compared: two timings of the same engine"
        f" differ by a factor of {1 + noise_floor(run).floor:.2f}"
        for run in busy
    ]
    timings = timings_of(*runs, both) if same_machine and not busy else {}
    return Difference(warnings, statuses, numbers, same, len(both), timings)


def table_of(results: RunResults) -> pd.DataFrame:
    """deviations.csv with all values as text: equal text means equal bits."""
    table = pd.read_csv(BytesIO(results.table()), dtype=str, keep_default_na=False)
    if list(table.columns) != list(COLUMNS):
        raise Unusable(
            f"{results.folder}: its tables are of another version; make them again: crosscheck"
            f" report {results.folder}"
        )
    return table


def cells_of(results: RunResults) -> pd.DataFrame:
    """The `CELL`, status, key and scene of each cell."""
    names = [encoded(f"{r['engine']}:{r['profile']}").decode() for r in results.records]
    columns = ["scenario", "dt_s", "status", "cell", "scene_hash"]
    return pd.DataFrame(results.records, columns=columns).assign(name=names)


def names_of(cells: pd.DataFrame) -> set[tuple[str, str, float]]:
    return set(cells[CELL].itertuples(index=False, name=None))


def warnings_of(
    runs: tuple[RunResults, RunResults],
    cells: tuple[pd.DataFrame, pd.DataFrame],
    edited: Sequence[str],
) -> list[str]:
    """What may differ beside the engines, and the cells that only one run has."""
    headers = [run.header for run in runs]
    facts = [(f"machine: {key}", [header["machine"][key] for header in headers]) for key in MACHINE]
    for name in sorted({*headers[0]["versions"], *headers[1]["versions"]}):
        versions = [header["versions"].get(name, "missing") for header in headers]
        facts.append((f"version: {name}", versions))
    facts.append(("seed", [header["seed"] for header in headers]))
    warnings = [
        f"differs in {what}: {was} before, {now} after" for what, (was, now) in facts if was != now
    ]
    warnings += [f"{run.folder} is not complete" for run in runs if not run.complete]
    for run, own, other in zip(runs, cells, reversed(cells)):
        rest = own[~own.set_index(CELL).index.isin(other.set_index(CELL).index)]
        if len(rest):
            engines, scenes = (
                listed([*names[:6], *([f"{len(names) - 6} more"] if len(names) > 6 else [])])
                for names in (list(rest.name.unique()), list(rest.scenario.unique()))
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


def changed_statuses(both: pd.DataFrame) -> list[Change]:
    changes = []
    for row in both[both.status != both.status_after].to_dict("records"):
        was, now = row["status"], row["status_after"]
        verdict = "worse" if was == "ok" else "better" if now == "ok" else "other"
        what = f"{row['scenario']}  dt {row['dt_s']:.4g} s  status"
        changes.append(Change(row["scenario"], row["name"], what, was, now, verdict))
    return changes


def changed_judgement(
    before: pd.DataFrame, after: pd.DataFrame, played: Collection[tuple[str, str, float]]
) -> list[Change]:
    """The cells that both runs `played` but only one judged, so that only that one has numbers."""
    reasons = [table[table.metric == "status"][[*WHOSE, "note"]] for table in (before, after)]
    rows = reasons[0].merge(reasons[1], on=WHOSE, how="outer", suffixes=("", "_after"))
    changes = []
    for row in rows[rows.note.isna() != rows.note_after.isna()].to_dict("records"):
        scenario, name, dt = (
            row["scenario"],
            f"{row['engine']}:{row['profile']}",
            float(row["dt_s"]),
        )
        if (scenario, name, dt) in played:
            what = f"{scenario}  dt {dt:.4g} s  against {row['versus']}: status"
            was, now = (
                "judged" if pd.isna(row[key]) else row[key] for key in ("note", "note_after")
            )
            verdict = "worse" if was == "judged" else "better"
            changes.append(Change(scenario, name, what, was, now, verdict))
    return changes


def changed_numbers(
    before: pd.DataFrame, after: pd.DataFrame, equal: Collection[tuple[str, str, float]]
) -> tuple[list[Change], Counter[str]]:
    """Every number that differs between the tables, and how many are equal, by engine.

    The numbers of `equal` cells must have the same bits: any change is worse.
    """
    both = before.merge(after, on=[*WHOSE, "metric"], suffixes=("", "_after"))
    both["name"], differs = both.engine + ":" + both.profile, both.value != both.value_after
    changes = []
    for row in both[differs].to_dict("records"):
        scenario, name, dt = row["scenario"], row["name"], float(row["dt_s"])
        beside = row["versus"] if ":" in row["versus"] else ""
        engines = [name, beside] if beside else [name]
        what = f"{scenario}  dt {dt:.4g} s  {row['metric']} against {row['versus']}"
        was, now = (row[key] or NOT_JUDGED for key in ("value", "value_after"))
        if NOT_JUDGED in (was, now):
            verdict, factor = "other", math.inf
        else:
            small, large = sorted(abs(float(value)) for value in (was, now))
            factor = large / small if small > 0 and math.isfinite(large) else math.inf
            verdict = verdict_of(row, engines)
            if all((scenario, engine, dt) in equal for engine in engines):
                verdict, what = "worse", f"{what} (same cell, other bits)"
        changes.append(Change(scenario, name, what, was, now, verdict, factor, beside))
    equal_rows = both[~differs]
    between = equal_rows.versus.str.contains(":", regex=False)
    return changes, Counter([*equal_rows.name, *equal_rows.versus[between]])


def verdict_of(row: Mapping[Any, Any], engines: Sequence[str]) -> str:
    """The verdict on a number of these engines whose bits differ, unless they must not.

    The metric says which value is better, unless they differ in rounding; a verdict that fails now,
    and did not before, is worse. A deviation between two engines is "other".
    """
    was, now, metric = float(row["value"]), float(row["value_after"]), row["metric"]
    if is_rounding(engines, was, now):
        return ROUNDING
    if metric in VERDICTS:
        failed, fails = not was <= float(row["bound"]), not now <= float(row["bound_after"])
        return "other" if failed == fails else "worse" if fails else "better"
    better = METRICS[metric].better if metric in METRICS else ""
    if len(engines) > 1 or better in ("", "as stated") or abs(now) == abs(was):
        return "other"
    return "worse" if (now < was if better == "higher" else abs(now) > abs(was)) else "better"


def is_rounding(engines: Sequence[str], was: float, now: float) -> bool:
    if not (math.isfinite(was) and math.isfinite(now)):
        return False
    bound = max(DIVERGED, *(ROUNDINGS * rounding_of(name) for name in engines))
    return abs(now - was) <= bound * max(1.0, abs(was), abs(now))


def timings_of(first: RunResults, second: RunResults, both: pd.DataFrame) -> dict[str, Timing]:
    ratios: dict[str, list[float]] = {}
    least: dict[str, list[float]] = {}
    for row in both[both.scene_hash == both.scene_hash_after].to_dict("records"):
        was, now = first.times.get(row["cell"]), second.times.get(row["cell_after"])
        if was is None or now is None or was["timed_s"] != now["timed_s"]:
            continue
        rounds = [*zip(was["cost"], now["cost"])]
        if rounds and min(min(rounds)) > 0:
            fastest, then = (min(times) for times in zip(*rounds))
            least.setdefault(row["name"], []).append(then / fastest)
            ratios.setdefault(row["name"], []).extend(now / was for was, now in rounds)
    return {
        engine: timing(sorted(ratios[engine]), float(np.median(least[engine])))
        for engine in sorted(ratios)
    }


def timing(ratios: list[float], factor: float) -> Timing:
    """The distribution-free interval of the median of sorted ratios, from order statistics (the
    sign test's)."""
    n = len(ratios)
    tail, k = 0.5**n, 0
    while 2 * tail <= 1 - CONFIDENCE:
        k += 1
        tail += math.comb(n, k) * 0.5**n
    low, high = (ratios[k - 1], ratios[n - k]) if k else (0.0, math.inf)
    return Timing(factor, low, high, n)


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
    changes = [*changed.statuses, *changed.numbers]
    if worst := sorted(changes, key=severity)[:SHOWN]:
        some = len(changes) > SHOWN
        title = f"The {len(worst)} largest of {len(changes)} changes" if some else "The changes"
        console.print(f"{title}, before → after", style="italic", highlight=False)
        print_list(console, [change.text for change in worst])
        console.print()
    worse = f"{counted(changed.worse, 'result') if changed.worse else 'Nothing'} got worse."
    times = "No times were compared: run both on one machine that is idle."
    if changed.timings:
        times = (
            f"A time counts as worse if its factor is above {FACTOR:g} and its whole 99 % interval"
            " above 1."
        )
    console.print(f"{worse} {times}", highlight=False)
    sys.exit(FAILED if changed.worse else DONE)


def by_engine(changed: Difference) -> list[list[str]]:
    kinds = [(changed.statuses, ["worse", "better"])]
    kinds.append((changed.numbers, [ROUNDING, "worse", "better", "other"]))
    changes = [change for kind, _ in kinds for change in kind]
    engines = [*changed.same, *(change.engine for change in changes)]
    engines += [change.beside for change in changes if change.beside]
    rows = []
    for engine in dict.fromkeys((*engines, *changed.timings)):
        texts = []
        for kind, verdicts in kinds:
            counts = Counter(x.verdict for x in kind if engine in (x.engine, x.beside))
            texts += [str(counts[verdict] or "") for verdict in verdicts]
        time = changed.timings[engine].text if engine in changed.timings else ""
        rows.append([engine, *texts[:2], str(changed.same[engine]), *texts[2:], time])
    return rows


def severity(change: Change) -> tuple[bool, bool, bool, float]:
    # worse changes first, rounding last, then statuses first, then by size
    return (
        change.verdict != "worse",
        change.verdict == ROUNDING,
        not change.what.endswith("status"),
        -change.factor,
    )
