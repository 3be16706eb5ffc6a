"""The search: pairs of settings, then setting by setting, again and again until nothing on the
grid is better."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.adapters.conformance.conform import conform
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.adapters.matched import Searched
from crosscheck2d.reports.tune.score import (
    FAILED,
    HARMS,
    Against,
    Make,
    TrialScores,
    against,
    cost_of,
    measured,
    posed,
)
from crosscheck2d.scenarios.families.tuning import FAMILIES

SEEDS = (0, 1, 2, 3)
# times the error: what gains less is kept as it is, as costs are known to some percent only
LEAST = 0.9
SWEEPS = 4
COLUMNS = [
    "engine",
    "setting",
    "value",
    "chosen",
    "same_dt",
    "cost",
    "equal_cost",
    "better",
    "worse",
    "of",
    "harmed",
    "verdict",
    "why",
]
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


def searched_of(engine: str) -> Searched:
    searched = TUNED[engine].searched
    assert searched is not None
    return searched()


class SettingsTrial(NamedTuple):
    """One change of the chosen settings: its cost, what it is against them at equal cost, and, if
    it is better, the probes that it does not keep."""

    change: dict[str, Any]
    cost: float
    result: Against
    departs: list[str]

    @property
    def faults(self) -> list[str]:
        return [*self.result.faults, *self.departs]

    @property
    def verdict(self) -> str:
        """Whether the change is taken: it is better by `LEAST`, or mends runs and is not worse by
        as much; and it breaks nothing."""
        error, mends = self.result.equal_cost, self.result.mends
        if error >= (1 / LEAST if mends else LEAST):
            return NO_BETTER
        return BREAKS if self.faults else BETTER


@dataclass
class SettingsSearch:
    engine: str
    families: tuple[str, ...] = tuple(each.__name__ for each in FAMILIES)
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
        result = against(now, before, cost, self.scenes)
        trial = SettingsTrial(change, cost, result, [])
        if trial.verdict == BETTER:
            trial = trial._replace(departs=sorted(self.kept - self.keeps(settings)))
        what = ", ".join(f"{name} {value:g}" for name, value in change.items())
        self.say(
            f"{self.engine} {what}: {result.equal_cost:.3f}, {result.harmed:+d} runs worse:"
            f" {trial.verdict}"
        )
        return trial

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
                best = min(better, key=lambda each: each.result.equal_cost)
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
    """Columns `COLUMNS`: what is chosen of each setting, every change tried, and what was not
    searched and why.

    same_dt and equal_cost are error over the chosen settings' error, cost a step's over theirs;
    better and worse count scenes and steps that differ by 20 %; harmed the runs that break
    something less those that are mended.
    """
    rows: list[dict[str, Any]] = []
    for name, (_, what) in searched.settings.items():
        rows.append(
            {
                "setting": name,
                "value": shown(chosen[name]),
                "chosen": True,
                "verdict": CHOSEN,
                "why": what,
            }
        )
        rows += [row_of(each) for each in trials if list(each.change) == [name]]
    rows += [row_of(each) for each in trials if len(each.change) > 1]
    rows += [
        {"setting": name, "chosen": False, "verdict": NO_SEARCH, "why": why}
        for name, why in searched.left_alone.items()
    ]
    return with_reasons(
        pd.DataFrame([{"engine": engine} | row for row in rows], columns=COLUMNS)
    ).round(4)


def with_reasons(made: pd.DataFrame) -> pd.DataFrame:
    """The table with the reason why each chosen value is chosen: what the best other value does."""
    made = made.copy()
    for index, row in made[made.verdict == CHOSEN].iterrows():
        others = made[(made.setting == row.setting) & (made.verdict != CHOSEN)]
        best = others.loc[others.equal_cost.idxmin()]
        reason = f"{best.value}: {best.equal_cost:.2f} times the error"
        reason += f", but {best.why.split('; ')[0]}" if best.verdict == BREAKS else ""
        made.loc[index, "why"] = f"{row.why}. Next best is {reason}"
    return made


def row_of(trial: SettingsTrial) -> dict[str, Any]:
    result = trial.result
    return {
        "setting": " + ".join(trial.change),
        "value": " + ".join(map(shown, trial.change.values())),
        "chosen": False,
        "same_dt": result.same_dt,
        "cost": trial.cost,
        "equal_cost": result.equal_cost,
        "better": result.better,
        "worse": result.worse,
        "of": result.of,
        "harmed": result.harmed,
        "verdict": trial.verdict,
        "why": "; ".join(trial.faults),
    }


def shown(value: Any) -> str:
    return str(value) if isinstance(value, bool) else f"{value:.6g}"
