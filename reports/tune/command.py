"""`crosscheck tune`: the search for the settings of an engine, pair by pair and setting by setting,
again and again until nothing on the grid is better; its table, printed and written."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np
import pandas as pd

from crosscheck2d.adapters.conformance.conform import conform
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.adapters.matched import Searched
from crosscheck2d.reports.run.arguments import opening, unknown
from crosscheck2d.reports.run.cells import content_key, source_hash
from crosscheck2d.reports.terminal.console import Console, print_table
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import DONE, keeping, refuse
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.reports.tune.score import (
    FAILED,
    HARMS,
    MOST_OF_ALL,
    Make,
    TrialScores,
    against,
    cost_of,
    faults_of,
    measured,
    posed,
)
from crosscheck2d.scenarios.families.tuning import FAMILIES

SEEDS = (0, 1, 2, 3)
# times the error: what gains less is kept as it is, as costs are known to some percent only
LEAST = 0.9
SWEEPS = 4
COLUMNS = [
    *("engine", "setting", "value", "chosen", "same_dt", "cost", "equal_cost", "better", "worse"),
    *("of", "harmed", "verdict", "why"),
]
NAME, TUNE = "matched.csv", "crosscheck tune"
SOURCE = ("reports/tune/*.py", "reports/compare/**/*.py", "scenarios/**/*.py")
MATCHED = ":matched"
CHOSEN, BETTER, NO_BETTER, BREAKS = "chosen", "better", "no better", "breaks"
NO_SEARCH = "not searched"
TUNED: dict[str, EngineRow] = {
    name.removesuffix(MATCHED): row
    for name, row in (ENGINES | FETCHED).items()
    if name.endswith(MATCHED) and row.searched is not None
}
"""Engine -> the row of its matched profile, of all that have settings to search."""
UNASKED = tuple(name for name in TUNED if f"{name}{MATCHED}" in ENGINES)
"""Those that are searched where none is named: without what is fetched."""


def tune(engines: Sequence[str], fresh: bool, out: Path) -> NoReturn:
    """Search the settings of `engines`, `UNASKED` if none is named; write matched.csv into
    `out`; exits 0.

    The table of an engine is written as soon as its search has ended. Exits 2 on a name that is no
    engine with settings, or where `out` may not be written, 130 and 143 when interrupted.
    """
    if faults := [unknown("engine", name, TUNED) for name in engines if name not in TUNED]:
        refuse(faults)
    tables: list[pd.DataFrame] = []
    with (
        opening(out, TUNE, fresh) as store,
        keeping(out, lambda: f"{counted(len(tables), 'search', 'searches')} finished."),
        Progress() as bar,
    ):
        for engine in dict.fromkeys(engines or UNASKED):
            key = content_key(engine, source_hash(SOURCE))
            row = store.get("search", key)
            if row is None:
                bar.say(f"{engine}: the exact answers, and the present settings")
                search = SettingsSearch(engine, say=bar.note)
                bar.say(f"{engine}: pairs of settings, and setting by setting")
                row = store.put("search", key, None, search.run().to_csv(index=False).encode())
            # bit for bit as written: only in these columns an empty field is NaN
            missing = {column: [""] for column in ("same_dt", "cost", "equal_cost")}
            tables.append(
                pd.read_csv(
                    BytesIO(row.blob),
                    keep_default_na=False,
                    na_values=missing,
                    dtype={"value": str},
                    float_precision="round_trip",
                )
            )
            matched = pd.concat(tables)
            store.export(NAME, matched.to_csv(index=False))
    show(matched)
    Console().print(f"\n{out / NAME}", style="bold", highlight=False, soft_wrap=True)
    sys.exit(DONE)


def show(table: pd.DataFrame) -> None:
    tried = table[table.verdict != NO_SEARCH]
    # harmed is text where a row has none
    numbers = tried[["equal_cost", "cost", "harmed"]].apply(pd.to_numeric, errors="coerce")
    numbers = numbers.map("{:.3g}".format).replace("nan", "")
    names = tried.engine + ", " + tried.setting + ": " + tried.value
    rows = pd.concat([names, numbers, tried.verdict], axis=1).to_numpy().tolist()
    headings = ["setting", "error", "cost\nof a step", "runs\nworse", "verdict"]
    title = "Errors at equal cost, and costs, as factors of those of the chosen settings"
    print_table(Console(), headings, rows, title, left=headings[-1:])


def searched_of(engine: str) -> Searched:
    searched = TUNED[engine].searched
    assert searched is not None
    return searched()


class SettingsTrial(NamedTuple):
    """One change of the chosen settings: its row of the table, and what it breaks."""

    change: dict[str, Any]
    row: dict[str, Any]
    faults: list[str]

    @property
    def verdict(self) -> str:
        return str(self.row["verdict"])


@dataclass
class SettingsSearch:
    engine: str
    families: tuple[str, ...] = tuple(FAMILIES)
    seeds: tuple[int, ...] = SEEDS
    say: Callable[[str], None] = print
    known: dict[tuple[Any, ...], TrialScores] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.searched = searched_of(self.engine)
        self.chosen = dict(self.searched.chosen)
        self.scenes = posed(self.families, self.seeds)
        self.kept = self.keeps(self.chosen)

    def make(self, settings: dict[str, Any]) -> Make:
        return partial(TUNED[self.engine].make, **settings)

    def keeps(self, settings: dict[str, Any]) -> set[str]:
        row = replace(TUNED[self.engine], make=self.make(settings))
        return {
            finding.probe
            for finding in conform(self.engine + MATCHED, row)
            if finding.verdict == "keeps"
        }

    def played(self, settings: dict[str, Any]) -> TrialScores:
        """What the settings make of the scenes; measured once."""
        key = tuple(settings.values())
        if key not in self.known:
            self.known[key] = measured(self.make(settings), self.scenes)
        return self.known[key]

    def trial(self, change: dict[str, Any]) -> SettingsTrial:
        """The chosen settings with a change, against them without it."""
        settings, before = self.chosen | change, self.played(self.chosen)
        now, one_a_family = self.played(settings), slice(None, None, len(self.seeds))
        fails = (now.harm + before.harm)[one_a_family, -1, HARMS.index(FAILED)] > 0
        timed = [scene for scene, failed in zip(self.scenes[one_a_family], fails) if not failed]
        cost = cost_of(self.make(settings), self.make(self.chosen), timed)
        numbers, faults = against(now, before, cost), faults_of(now, before, self.scenes)
        # better by `LEAST`, or it mends runs and is not worse by as much
        mends = numbers["harmed"] < -MOST_OF_ALL * now.error.size
        verdict = BREAKS if faults else BETTER
        if numbers["equal_cost"] >= (1 / LEAST if mends else LEAST):
            verdict = NO_BETTER
        elif not faults:
            faults = sorted(self.kept - self.keeps(settings))
            verdict = BREAKS if faults else BETTER
        self.say(
            f"{self.engine} {', '.join(f'{name} {value:g}' for name, value in change.items())}:"
            f" {numbers['equal_cost']:.3f}, {numbers['harmed']:+d} runs worse: {verdict}"
        )
        row = numbers | {"setting": " + ".join(change), "cost": cost, "verdict": verdict}
        row |= {"value": " + ".join(map(format_value, change.values()))}
        return SettingsTrial(change, row | {"chosen": False, "why": "; ".join(faults)}, faults)

    def groups(self) -> Iterator[list[dict[str, Any]]]:
        """The changes of each pair of settings that differ in both, and then of each setting: what
        two gain in scenes of their own, neither gains in all by itself."""
        for names, *tried in self.searched.pairs:
            changes = [dict(zip(names, values)) for values in product(*tried)]
            yield [
                each for each in changes if all(each[name] != self.chosen[name] for name in each)
            ]
        for name, (values, _) in self.searched.settings.items():
            yield [{name: value} for value in values if value != self.chosen[name]]

    def sweep(self) -> tuple[list[SettingsTrial], bool]:
        """All trials, taking the best of each setting at once; and whether anything was taken."""
        trials, taken = [], False
        for changes in self.groups():
            group = [self.trial(change) for change in changes]
            trials += group
            better = [each for each in group if each.verdict == BETTER]
            if better:
                best = min(better, key=lambda each: each.row["equal_cost"])
                self.chosen |= best.change
                self.say(f"{self.engine}: {best.change} is taken")
                taken = True
        return trials, taken

    def run(self) -> pd.DataFrame:
        for _ in range(SWEEPS):
            trials, taken = self.sweep()
            if not taken:
                break
        return table(self.engine, self.searched, self.chosen, trials)


def table(
    engine: str, searched: Searched, chosen: dict[str, Any], trials: Sequence[SettingsTrial]
) -> pd.DataFrame:
    """Columns `COLUMNS`: what is chosen of each setting, and what the best other value does; every
    change tried, and what was not searched and why.

    same_dt and equal_cost are error over the chosen settings' error, cost a step's over theirs;
    better and worse count scenes and steps that differ by 20 %; harmed the runs that break
    something less those that are mended.
    """
    rows: list[dict[str, Any]] = []
    for name, (_, meaning) in searched.settings.items():
        others = [trial for trial in trials if list(trial.change) == [name]]
        best = min(others, key=lambda trial: np.nan_to_num(trial.row["equal_cost"], nan=np.inf))
        why = f"{meaning}. Next best is {best.row['value']}: {best.row['equal_cost']:.2f} times the"
        why += " error" + (f", but {best.faults[0]}" if best.verdict == BREAKS else "")
        row = {"setting": name, "value": format_value(chosen[name]), "chosen": True}
        rows.append(row | {"verdict": CHOSEN, "why": why})
        rows += [trial.row for trial in others]
    rows += [trial.row for trial in trials if len(trial.change) > 1]
    for name, reason in searched.left_alone.items():
        rows.append({"setting": name, "chosen": False, "verdict": NO_SEARCH, "why": reason})
    return pd.DataFrame([{"engine": engine} | row for row in rows], columns=COLUMNS).round(4)


def format_value(value: Any) -> str:
    return str(value) if isinstance(value, bool) else f"{value:.6g}"
