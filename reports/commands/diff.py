"""`crosscheck diff A B`: the differences between two runs (statuses of cells, numbers, times) as a
table; exit 1 if something got worse."""

from __future__ import annotations

import math
import sys
from collections import Counter, defaultdict
from collections.abc import Sequence
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
VALUES, NOTES = ({"before": name, "after": f"{name}_after"} for name in ("value", "note"))
SHOWN = 12  # changes, the worst first
MACHINE = ("system", "architecture", "processor", "cores")
HEADINGS = {  # of the printed table: what changed, and the verdict
    "status\nworse": ("status", "worse"),
    "status\nbetter": ("status", "better"),
    "numbers\nthe same": ("number", "same"),
    "in\nrounding": ("number", ROUNDING),
    "numbers\nworse": ("number", "worse"),
    "numbers\nbetter": ("number", "better"),
    "numbers\nother": ("number", "other"),
}
TIME = "time\ntaken"


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


class Difference(NamedTuple):
    """All differences between two runs.

    Attributes:
        warnings: reasons other than the engines why the two may differ.
        changes: a row for each: the `CELL`, and `beside` it the other engine of a number between
            two, or ""; its `kind`, "status" or "number"; `what` changed, its value `before` and
            `after`, and the larger value : the smaller as `factor`; the `verdict` "better",
            "worse", "other" or `ROUNDING`.
        same: `engine:profile` -> number of values that are equal bit for bit; one between two
            engines counts for both.
        shared: the number of cells (scene, engine and step size) that both runs have.
        timings: `engine:profile` -> of the engines timed in both runs, if the machine is the same.
    """

    warnings: list[str]
    changes: pd.DataFrame
    same: Counter[str]
    shared: int
    timings: dict[str, Timing]

    @property
    def worse(self) -> int:
        times = [timing.verdict for timing in self.timings.values()]
        return [*self.changes.verdict, *times].count("worse")


def difference(before: Path, after: Path) -> Difference:
    """Compare what both runs have, in two folders.

    Raises:
        FolderTaken, Unusable, Damaged: a folder cannot be used; says which and what to do.
    """
    with reading(before, COMMAND) as first, reading(after, COMMAND) as second:
        runs = RunResults.read(first), RunResults.read(second)
        tables = read_table(runs[0]), read_table(runs[1])
    cells = list_cells(runs[0]), list_cells(runs[1])
    both = cells[0].merge(cells[1], on=CELL, suffixes=("", "_after"))
    edited = sorted({*both.scenario[both.scene_hash != both.scene_hash_after]})
    machines = [[run.header["machine"][key] for key in MACHINE] for run in runs]
    same_machine = machines[0] == machines[1]
    # of cells with the same key scene, settings and versions are the same
    equal = both[both.cell == both.cell_after] if same_machine else both[:0]
    played = both[(both.status == "ok") & (both.status_after == "ok")]
    numbers, same = changed_numbers(*tables, equal)
    statuses = pd.concat([changed_statuses(both), changed_judgement(*tables, played)])
    changes = pd.concat([statuses.assign(beside="", factor=1.0), numbers])
    judged = changes.verdict.isin(["worse", "better"])
    changes.loc[judged & changes.scenario.isin(edited), "verdict"] = "other"
    busy = [run for run in runs if run.times and is_busy(run)]
    warnings = warnings_of(runs, cells, edited) + [
        f"{run.folder}: its times are not compared: two timings of the same engine"
        f" differ by a factor of {1 + noise_floor(run).floor:.2f}"
        for run in busy
    ]
    timings = timings_of(*runs, both) if same_machine and not busy else {}
    return Difference(warnings, changes, same, len(both), timings)


def read_table(results: RunResults) -> pd.DataFrame:
    """deviations.csv with all values as text: equal text means equal bits."""
    table = pd.read_csv(BytesIO(results.table()), dtype=str, keep_default_na=False)
    if list(table.columns) != list(COLUMNS):
        raise Unusable(
            f"{results.folder}: its tables are of another version; make them again: crosscheck"
            f" report {results.folder}"
        )
    return table


def list_cells(results: RunResults) -> pd.DataFrame:
    """The `CELL`, status, key and scene of each cell."""
    names = [encoded(f"{r['engine']}:{r['profile']}").decode() for r in results.records]
    columns = ["scenario", "dt_s", "status", "cell", "scene_hash"]
    return pd.DataFrame(results.records, columns=columns).assign(name=names)


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
            engines, scenes = map(some_of, ([*rest.name.unique()], [*rest.scenario.unique()]))
            warnings.append(
                f"only in {run.folder}: {counted(len(rest), 'cell')} of {engines}, in {scenes}"
            )
    if edited:
        warnings.append(
            f"differs in scene: {listed(edited)}: edited between the runs, so that no result in it"
            " is called worse or better"
        )
    return warnings


def some_of(names: Sequence[str]) -> str:
    more = [f"{len(names) - 6} more"] if len(names) > 6 else []
    return listed([*names[:6], *more])


def changed_statuses(both: pd.DataFrame) -> pd.DataFrame:
    rows = both[both.status != both.status_after]
    verdict = np.select(
        [rows.status == "ok", rows.status_after == "ok"], ["worse", "better"], "other"
    )
    values: dict[str, Any] = {"before": rows.status, "after": rows.status_after, "verdict": verdict}
    return rows[CELL].assign(kind="status", what="status", **values)


def changed_judgement(
    before: pd.DataFrame, after: pd.DataFrame, played: pd.DataFrame
) -> pd.DataFrame:
    """The cells that both runs `played` but only one judged, so that only that one has numbers."""
    reasons = [table[table.metric == "status"][[*WHOSE, "note"]] for table in (before, after)]
    rows = reasons[0].merge(reasons[1], on=WHOSE, how="outer", suffixes=("", "_after"))
    rows["name"] = rows.engine + ":" + rows.profile
    rows = rows.loc[
        (rows.note.isna() != rows.note_after.isna()) & are_in(played, rows, rows.name)
    ].copy()
    values = {name: rows[column].fillna("judged") for name, column in NOTES.items()}
    verdict = np.where(rows.note.isna(), "worse", "better")
    rows["what"] = "against " + rows.versus + ": status"
    changes: pd.DataFrame = rows[[*CELL, "what"]].assign(kind="status", verdict=verdict, **values)
    return changes


def are_in(cells: pd.DataFrame, rows: pd.DataFrame, names: pd.Series) -> Any:
    """Whether each row of a table is of one of the `cells`, for the engine with its name."""
    index = pd.MultiIndex.from_arrays([rows.scenario, names, rows.dt_s.astype(float)])
    return index.isin(cells.set_index(CELL).index)


def changed_numbers(
    before: pd.DataFrame, after: pd.DataFrame, equal: pd.DataFrame
) -> tuple[pd.DataFrame, Counter[str]]:
    """Every number that differs between the tables, and how many are equal, by engine.

    The numbers of `equal` cells must have the same bits: any change is worse. Else the metric says
    which value is better, unless they differ in rounding; a verdict that fails now, and did not
    before, is worse. A deviation between two engines is "other".
    """
    both = before.merge(after, on=[*WHOSE, "metric"], suffixes=("", "_after"))
    both["name"] = both.engine + ":" + both.profile
    both["beside"] = both.versus.where(both.versus.str.contains(":", regex=False), "")
    differs = both.value != both.value_after
    same = Counter([*both.name[~differs], *both.beside[~differs & (both.beside != "")]])
    rows = both[differs]
    second = rows.beside.where(rows.beside != "", rows.name)
    was, now, bound, bound_after = (
        rows[column].replace("", "nan").astype(float)
        for column in ("value", "value_after", "bound", "bound_after")
    )
    small, large = np.minimum(was.abs(), now.abs()), np.maximum(was.abs(), now.abs())
    must_agree = are_in(equal, rows, rows.name) & are_in(equal, rows, second)
    must_agree &= was.notna() & now.notna()
    failed, fails = ~(was <= bound), ~(now <= bound_after)
    better = rows.metric.map({name: metric.better for name, metric in METRICS.items()}).fillna("")
    undirected = (rows.beside != "") | better.isin(["", "as stated"]) | (small == large)
    verdict = np.select(
        [
            was.isna() | now.isna(),
            must_agree,
            is_rounding(rows.name, second, was, now),
            rows.metric.isin([*VERDICTS]),
            undirected,
        ],
        [
            "other",
            "worse",
            ROUNDING,
            np.where(failed == fails, "other", np.where(fails, "worse", "better")),
            "other",
        ],
        np.where(np.where(better == "higher", now < was, now.abs() > was.abs()), "worse", "better"),
    )
    what = rows.metric + " against " + rows.versus
    what += np.where(must_agree, " (same cell, other bits)", "")
    values = {name: rows[column].replace("", NOT_JUDGED) for name, column in VALUES.items()}
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where((small > 0) & np.isfinite(large), large / small, np.inf)
    about: dict[str, Any] = {"kind": "number", "what": what, "verdict": verdict, "factor": factor}
    return rows[[*CELL, "beside"]].assign(**values, **about), same


def is_rounding(name: pd.Series, second: pd.Series, was: pd.Series, now: pd.Series) -> Any:
    """Whether two numbers of an engine, or of two, differ by no more than their rounding."""
    rounding = np.maximum(name.map(rounding_of), second.map(rounding_of)).astype(float)
    large = np.maximum(was.abs(), now.abs())
    bound = np.maximum(DIVERGED, ROUNDINGS * rounding)
    return np.isfinite(large) & ((now - was).abs() <= bound * np.maximum(large, 1.0))


def timings_of(first: RunResults, second: RunResults, both: pd.DataFrame) -> dict[str, Timing]:
    ratios, least = defaultdict[str, list[float]](list), defaultdict[str, list[float]](list)
    rows = both[both.scene_hash == both.scene_hash_after]
    for name, key, key_after in zip(rows.name, rows.cell, rows.cell_after):
        was, now = first.times.get(key), second.times.get(key_after)
        if was is None or now is None or was["timed_s"] != now["timed_s"]:
            continue
        costs = np.array([*zip(was["cost"], now["cost"])])
        if costs.size and costs.min() > 0:
            fastest, then = costs.min(axis=0)
            least[name].append(then / fastest)
            ratios[name] += [*(costs[:, 1] / costs[:, 0])]
    return {
        name: timing(sorted(ratios[name]), float(np.median(least[name]))) for name in sorted(ratios)
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
    print_table(console, ["engine", *HEADINGS, TIME], by_engine(changed), title, left=[TIME])
    console.print()
    if len(changes := changed.changes):
        # worse changes first, rounding last, then statuses first, then by size
        verdict, numbers = changes.verdict, changes.kind == "number"
        order = np.lexsort((-changes.factor, numbers, verdict == ROUNDING, verdict != "worse"))
        worst = changes.iloc[order[:SHOWN]]
        some = len(changes) > SHOWN
        title = f"The {SHOWN} largest of {len(changes)} changes" if some else "The changes"
        console.print(f"{title}, before → after", style="italic", highlight=False)
        print_list(console, map(sentence_on, worst.itertuples()))
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


def sentence_on(change: Any) -> str:
    what = f"{change.scenario}  dt {float(change.dt_s):.4g} s  {change.what}"
    return f"{change.verdict}: {change.name}, {what}: {change.before} → {change.after}"


def by_engine(changed: Difference) -> list[list[str]]:
    between = changed.changes[changed.changes.beside != ""]
    changes = pd.concat([changed.changes, between.assign(name=between.beside)])
    counts = changes.value_counts(["name", "kind", "verdict"]).to_dict()
    counts |= {(name, "number", "same"): count for name, count in changed.same.items()}
    return [
        [
            name,
            *(str(counts.get((name, *what), "")) for what in HEADINGS.values()),
            changed.timings[name].text if name in changed.timings else "",
        ]
        for name in dict.fromkeys([*changed.same, *changes.name, *changed.timings])
    ]
