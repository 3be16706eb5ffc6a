"""What a case of the stability report asks, the engines that play it, what a limit is, and the
search for it: a scan from gentle to harsh up to the first failure, then bisection."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from math import isfinite, isnan, nan, sqrt
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import DISTINCT, ENGINES, changed, row_of
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.causes import Cause
from crosscheck2d.reports.compare.verdicts import Verdict
from crosscheck2d.reports.stability.predicates import REFUSED, Predicate, judge
from crosscheck2d.scenarios.model import Scenario, Scene


class DrivenEngine(NamedTuple):
    """An engine or a variant that plays a case."""

    name: str  # `engine:profile`, or `engine:profile+variant`
    make: Callable[[], Engine]
    change: str = ""  # of a variant: what is changed in it


def make_variant(name: str, variant: str) -> Any:
    # changed at once, and right after `load`
    settings, _, change = ENGINES[name].variants[variant]
    engine: Any = changed(name, **settings)
    if change is None:
        return engine
    load, after = engine.load, change

    def load_and_change(scene: Scene, dt: float) -> None:
        load(scene, dt)
        after(engine)

    engine.load = load_and_change
    return engine


def with_variant(variant: str) -> tuple[str, ...]:
    return tuple(f"{name}+{variant}" for name, row in ENGINES.items() if variant in row.variants)


WITH_FRICTION_ONLY = tuple(name for name, row in ENGINES.items() if row.adds_friction)
# the engines, and after all of these the variants
DRIVEN_ENGINES = {name: DrivenEngine(name, row.make) for name, row in ENGINES.items()} | {
    (key := f"{name}+{variant}"): DrivenEngine(key, partial(make_variant, name, variant), what)
    for name, row in ENGINES.items()
    for variant, (_, what, _) in row.variants.items()
}


@contextmanager
def taking_part(rows: Mapping[str, EngineRow]) -> Iterator[None]:
    """In this context engines' own files, `PATH:own`, and rows of `FETCHED` are tested in this
    process like the rows of `ENGINES`."""
    ENGINES.update(rows)
    DRIVEN_ENGINES.update({name: DrivenEngine(name, row.make) for name, row in rows.items()})
    try:
        yield
    finally:
        for name in rows:
            del ENGINES[name], DRIVEN_ENGINES[name]


def step_size(scenario: Scenario) -> float:
    """s, the only one of a case's scenario."""
    return scenario.dt(scenario.substeps[0])


def played(driven: DrivenEngine, scenario: Scenario) -> Run:
    return play_once(driven.make, driven.name, scenario, step_size(scenario))


def play_as(engine: str, scenario: Scenario) -> Run:
    return played(DRIVEN_ENGINES.get(engine) or DrivenEngine(engine, row_of(engine).make), scenario)


EXACT = "the exact answer"
LIMIT, NEVER_FAILS = "limit", "does not fail"
NEVER_WORKS, ONLY_BEYOND = "never works", "works only beyond"


@dataclass(frozen=True)
class Form:
    name: str
    few: int  # runs at a value that is only scanned; next to the limit all runs are played
    ratio: float  # of failing to working value, at which bisection stops
    # every run at every value is played, also after a failure, and more values are scanned
    whole: bool
    timeout: float  # s that a case may take on one engine


ALL = 10**6  # runs: more than any case has
QUICK = Form("quick", few=4, ratio=1.05, whole=False, timeout=600.0)
FULL = Form("full", few=ALL, ratio=1.01, whole=True, timeout=3600.0)
FORMS = {form.name: form for form in (QUICK, FULL)}


def once(driven: DrivenEngine, scenario: Scenario) -> tuple[Scenario, Run]:
    return scenario, played(driven, scenario)


@dataclass(frozen=True)
class Case:
    """One way to fail: a row of the stability report."""

    name: str  # lower-case words, as they stand in limits.csv
    asks: str  # the question in one sentence
    # (value, number of the run from 0) -> what is played at its only step size; fewer runs are the
    # first of more
    scene: Callable[[float, int], Scenario]
    parameter: str  # what is varied, dimensionless where it can be
    values: tuple[float, ...]  # to scan, from gentle to harsh
    predicate: Predicate  # decides whether a run fails
    unit: str = "1"  # of the parameter; "1" for a ratio
    # at a value: 1 where nothing differs, else phases of the collision within a step, or seeds
    runs: int = 1
    whole: bool = False  # whether the parameter counts something
    # variants, keys of `DRIVEN_ENGINES`, that play it besides the engines of `ENGINES`
    also: tuple[str, ...] = ()
    # the run and what it is judged by, where that takes more than one call of `play`
    play: Callable[[DrivenEngine, Scenario], tuple[Scenario, Run]] = once
    quick_values: tuple[float, ...] = ()  # in the quick form, where a run is long: some of `values`
    # whether the first edge is bisected, and the full form scans between the values (not with
    # `by_chance`)
    refines: bool = True
    # how close the bracket is made at best, where a run is long or what is sampled differs much
    ratio: float = 1.0
    # share of the runs at a value that may fail by chance, where what is read is a statistic or the
    # worst of it depends on what is sampled
    by_chance: float = 0.0
    shown_with: str = EXACT  # what a failing run is shown with

    @property
    def harsher(self) -> int:
        return 1 if self.values[-1] > self.values[0] else -1

    @property
    def varies(self) -> str:
        # for a scene file (FILE.toml:speed) the word that `--vary` takes
        return self.name.rpartition(":")[2] if ":" in self.name else self.parameter

    def with_unit(self, text: str) -> str:
        return text if self.unit == "1" else f"{text}, {self.unit}"

    def scan(self, form: Form) -> tuple[float, ...]:
        # The full form contains the values of the quick one. None are added where runs may fail by
        # chance: with more values, too many failures by chance become likelier.
        if not form.whole:
            return self.quick_values or self.values
        if not self.refines or self.by_chance:
            return self.values
        halves = (self.half_way(*pair, self.ratio) for pair in pairwise(self.values))
        values = {*self.values, *filter(None, halves)}
        return tuple(sorted(values, key=lambda value: self.harsher * value))

    def half_way(self, start: float, end: float, ratio: float) -> float | None:
        """The geometric mean of two values; None if they are within the ratio, or if no whole
        number lies between them where one is needed."""
        low, high = min(start, end), max(start, end)
        if high <= low * ratio:
            return None
        if not self.whole:
            return sqrt(low * high)
        middle = round(sqrt(low * high))
        return float(middle) if low < middle < high else None


@dataclass(frozen=True)
class Trial:
    """The runs at one value."""

    value: float
    runs: int  # how many were played
    failed: int
    worst: float  # reading
    # the first that failed: its number, when it did, what happened, the id of its verdict, and the
    # disk (-1: all)
    first: int = -1
    at: float = nan
    event: str = ""
    broken: str = ""
    disk: int = 0
    allowed: int = 0  # how many may fail by chance
    left: bool = False  # whether the search stopped at a failure before it played all runs

    @property
    def works(self) -> bool:
        return self.failed <= self.allowed


@dataclass(frozen=True)
class Limit:
    """What a search found."""

    case: str
    engine: str  # a key of `DRIVEN_ENGINES`
    form: str  # a key of `FORMS`
    # "limit", "does not fail" (up to works_at), "never works" (from fails_at on, but for a few
    # values), or "works only beyond" (at works_at, and not at the gentler fails_at)
    verdict: str
    works_at: float  # the harshest value before the first failure; nan: none
    # the gentlest value at which more runs failed than may by chance; nan: none
    fails_at: float
    trials: tuple[Trial, ...]  # every value tried, from gentle to harsh
    # False if there is more than one edge among the values tried: it works again beyond, or fails
    # at the gentlest as well
    monotone: bool = True
    # the resolution: the largest ratio of two neighbours among the values tried, up to the first
    # failure
    spacing: float = nan
    # with which the reference has this limit, as `sufficient_mechanisms`
    mechanisms: tuple[str, ...] = ()
    cause: Cause | None = None  # why it fails; None where nothing failed
    replay: str = ""  # the first failing run, packed for the page, if there is one
    ratio: float = 1.0  # height over width of the replay
    status: str = "ok"  # or why the search was lost, as in `STATUSES` of run.py

    @property
    def failing(self) -> Trial | None:
        return next((trial for trial in self.trials if trial.value == self.fails_at), None)

    @property
    def refused(self) -> bool:
        # what an engine does not play is no limit of it
        return self.failing is not None and self.failing.broken == REFUSED

    @property
    def runs(self) -> int:
        return sum(trial.runs for trial in self.trials)


def engines_of(case: Case, rows: Container[str] = DISTINCT) -> list[str]:
    # An engine that only adds friction to another plays only the cases that name it.
    return [
        name
        for name in DRIVEN_ENGINES
        if name in case.also or (name in rows and name not in WITH_FRICTION_ONLY)
    ]


@dataclass
class LimitSearch:
    """The search for the limit of one case on one engine; keeps the verdicts at each value, and in
    `seen` the first failing run there."""

    case: Case
    engine: str
    form: Form
    readings: dict[float, list[Verdict]] = field(default_factory=dict)
    seen: dict[float, tuple[Scenario, Run]] = field(default_factory=dict)

    def limit(self) -> Limit:
        scan, few = self.case.scan(self.form), self.form.few
        if self.case.by_chance:  # at least half of the runs
            few = max(few, self.case.runs // 2)
        first = next((k for k, x in enumerate(scan) if not self.trial(x, few).works), len(scan))
        # the scan plays few runs at a value; all runs there may show a failure
        while first and not self.trial(scan[first - 1]).works:
            first -= 1
        works = [True] * first + [self.trial(value).works for value in scan[first:]]
        if all(works):
            return self.limit_of(NEVER_FAILS, scan[-1], nan)
        if edge := first_edge(works):
            return self.limit_of(LIMIT, *self.bracket(scan[edge - 1], scan[edge]))
        if not works[-1]:
            return self.limit_of(NEVER_WORKS, nan, scan[0])
        edge = len(works) - works[::-1].index(False)
        return self.limit_of(ONLY_BEYOND, *self.bracket(scan[edge], scan[edge - 1]))

    def bracket(self, good: float, bad: float) -> tuple[float, float]:
        ratio = max(self.form.ratio, self.case.ratio)
        while self.case.refines and (middle := self.case.half_way(good, bad, ratio)) is not None:
            good, bad = (middle, bad) if self.trial(middle).works else (good, middle)
        return good, bad

    def trial(self, value: float, runs: int = ALL, to_the_end: bool = False) -> Trial:
        """Play up to `runs` runs at a value; all of them if one fails. Stops when more have failed
        than may, but in the full form."""
        case, readings = self.case, self.readings.setdefault(value, [])
        allowed = int(case.by_chance * case.runs)
        failed = sum(reading.failed for reading in readings)
        while len(readings) < (case.runs if failed or to_the_end else min(runs, case.runs)):
            if failed > allowed and not (self.form.whole or to_the_end):
                break
            driven, scene = DRIVEN_ENGINES[self.engine], case.scene(value, len(readings))
            scenario, run = case.play(driven, scene)
            readings.append(judge(case.predicate, scenario, run))
            if readings[-1].failed:
                failed += 1
                self.seen.setdefault(value, (scenario, run))
        worst = max((r.value for r in readings if isfinite(r.value)), default=nan)
        if not failed:
            return Trial(value, len(readings), failed, worst)
        first, verdict = next((k, reading) for k, reading in enumerate(readings) if reading.failed)
        disk = verdict.disks[0] if verdict.disks else -1
        happens = verdict.at, verdict.text, verdict.id, disk
        left = len(readings) < case.runs
        return Trial(value, len(readings), failed, worst, first, *happens, allowed, left)

    def limit_of(self, verdict: str, works_at: float, fails_at: float) -> Limit:
        if not isnan(fails_at):
            self.trial(fails_at, to_the_end=True)
        values = sorted(self.readings, key=lambda x: self.case.harsher * x)
        trials = tuple(self.trial(value, 0) for value in values)
        changes = sum(before.works != after.works for before, after in pairwise(trials))
        if verdict == LIMIT:
            values = values[: values.index(fails_at) + 1]
        spacing = max((max(a / b, b / a) for a, b in pairwise(values)), default=nan)
        names = self.case.name, self.engine, self.form.name
        return Limit(*names, verdict, works_at, fails_at, trials, changes <= 1, spacing)


def first_edge(works: Sequence[bool]) -> int | None:
    """The first value that fails after a stretch of values that work, if that is longer than all
    that fails before it; None if there is none.

    An engine that fails at the gentlest values may work at some harsher ones by luck: a step of a
    third of the run may meet its one collision. That is no limit.
    """
    start = 0
    for k, (before, after) in enumerate(pairwise(works), 1):
        if after and not before:
            start = k
        if before and not after and k - start > works[:start].count(False):
            return k
    return None
