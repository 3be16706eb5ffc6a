"""What a case of the stability report asks, how thoroughly it is searched, and what a limit is;
search.py finds one."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass
from itertools import pairwise
from math import nan, sqrt

from crosscheck2d.adapters.engines import DISTINCT
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.causes import Cause
from crosscheck2d.reports.stability.predicates import REFUSED, Predicate
from crosscheck2d.reports.stability.variants import (
    DRIVEN_ENGINES,
    WITH_FRICTION_ONLY,
    DrivenEngine,
    played,
)
from crosscheck2d.scenarios.model import Scenario

EXACT = "the exact answer"
LIMIT, NEVER_FAILS, NEVER_WORKS, ONLY_BEYOND = (
    "limit",
    "does not fail",
    "never works",
    "works only beyond",
)


@dataclass(frozen=True)
class Form:
    """How thorough a search is.

    Attributes:
        few: runs at a value that is only scanned; next to the limit a value gets all runs of
            its case.
        ratio: the ratio of failing to working value at which bisection stops.
        whole: whether every run at every value is played, also after a failure, and whether
            the scan has the values that only this form has.
        timeout: s a case may take on one engine.
    """

    name: str
    few: int
    ratio: float
    whole: bool
    timeout: float


# A gas meets a bad cluster of contacts sooner or later: one in 20 of pymunk's gases is off by 1 %
# from v dt = 0.25 R on, half of them not up to 2 R. The first failure depends on the seed; the
# value at which more than a quarter of the seeds fail does not.
RARELY = 1 / 4
ALL = 10**6  # runs: more than any case has
QUICK = Form("quick", few=4, ratio=1.05, whole=False, timeout=600.0)
FULL = Form("full", few=ALL, ratio=1.01, whole=True, timeout=3600.0)
FORMS = {form.name: form for form in (QUICK, FULL)}


def once(driven: DrivenEngine, scenario: Scenario) -> tuple[Scenario, Run]:
    """One run, judged by the scenario's own truth or by the laws of physics."""
    return scenario, played(driven, scenario)


@dataclass(frozen=True)
class Case:
    """One way to fail: a row of the stability report.

    Attributes:
        name: lower-case words, as they stand in limits.csv.
        scene: (value, number of the run from 0) -> the scenario; it is played at its only step
            size. Fewer runs are the first of more.
        parameter: what is varied, dimensionless where it can be.
        values: to scan, from gentle to harsh.
        predicate: decides whether a run fails.
        asks: the question in one sentence, if it is not the first of the docstring of `scene`.
        unit: of the parameter; "1" for a ratio.
        runs: at a value: 1 where nothing differs, else phases of the collision within a step, or
            seeds.
        whole: whether the parameter counts something.
        also: variants, keys of `DRIVEN_ENGINES`, that play it besides the engines of `ENGINES`.
        play: engine and scenario -> the run and what it is judged by, where that takes more than
            one call of `play`.
        quick_values: to scan in the quick form, where a run is long: some of `values`.
        refines: whether the first edge is bisected, and the full form scans between the values (not
            with `by_chance`).
        ratio: how close the bracket is made at best, where a run is long or what is sampled differs
            much.
        by_chance: share of the runs at a value that may fail by chance, where what is read is a
            statistic or the worst of it depends on what is sampled.
        shown_with: what a failing run is shown with.
        report: a scene of the report that asks something alike; `overview.in_report` says how the
            two differ.
    """

    name: str
    scene: Callable[[float, int], Scenario]
    parameter: str
    values: tuple[float, ...]
    predicate: Predicate
    asks: str = ""
    unit: str = "1"
    runs: int = 1
    whole: bool = False
    also: tuple[str, ...] = ()
    play: Callable[[DrivenEngine, Scenario], tuple[Scenario, Run]] = once
    quick_values: tuple[float, ...] = ()
    refines: bool = True
    ratio: float = 1.0
    by_chance: float = 0.0
    shown_with: str = EXACT
    report: str = ""

    @property
    def question(self) -> str:
        """What it asks, in one sentence."""
        first = (self.scene.__doc__ or "").split("\n\n")[0]
        return self.asks or " ".join(first.split())

    @property
    def harsher(self) -> int:
        """1 if larger values are harsher, -1 if smaller values are."""
        return 1 if self.values[-1] > self.values[0] else -1

    @property
    def varies(self) -> str:
        """The name of what is varied; for a scene file (FILE.toml:speed) the word that `--vary`
        takes."""
        return self.name.rpartition(":")[2] if ":" in self.name else self.parameter

    def with_unit(self, text: str) -> str:
        """The text and the parameter's unit, if it has one."""
        return text if self.unit == "1" else f"{text}, {self.unit}"

    def scan(self, form: Form) -> tuple[float, ...]:
        """The values to scan. The full form adds the values half-way between them, so that it
        contains the quick form's.

        None are added where runs may fail by chance: with more values, too many failures by
        chance become likelier.
        """
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
    """The runs at one value: how many were played, how many failed, the worst reading, and the
    first that failed: when, what happened, the id of its verdict, and the disk (-1: all).

    Up to `allowed` of them may fail by chance. `left`: whether the search stopped at a failure
    before it played all runs.
    """

    value: float
    runs: int
    failed: int
    worst: float
    first: int = -1
    at: float = nan
    event: str = ""
    broken: str = ""
    disk: int = 0
    allowed: int = 0
    left: bool = False

    @property
    def works(self) -> bool:
        """Whether no more runs failed than may fail by chance."""
        return self.failed <= self.allowed


@dataclass(frozen=True)
class Limit:
    """What a search found.

    Attributes:
        case, engine: names; the engine is a key of `DRIVEN_ENGINES`.
        form: of `FORMS`.
        verdict: "limit", "does not fail" (up to works_at), "never works" (from fails_at on, but for
            a few values), or "works only beyond" (at works_at, and not at the gentler fails_at).
        works_at: the harshest value before the first failure, where all runs of the form were
            played; nan: none.
        fails_at: the first failure on the way from gentle to harsh: more runs failed than may by
            chance; nan: none.
        trials: every value tried, from gentle to harsh.
        monotone: False if there is more than one edge among the values tried: it works again
            beyond, or fails at the gentlest as well.
        spacing: the resolution: the largest ratio of two neighbours among the values tried, up to
            the first failure.
        seconds: of processor time that the search took.
        intervention: the change of `INTERVENTIONS` with which the failing run works; "" if none was
            found, or looked for.
        settings: of the engine with which the failing run works, in words; without `settings_help`
            those that do not help; "" if none were tried.
        mechanisms: with which the reference has this limit, as `sufficient_mechanisms`; () if none
            were found, or looked for.
        cause: why it fails; None where nothing failed.
        replay, ratio: of the first failing run, packed for the page, and its height over its width;
            "" if there is none.
        status: "ok", or why the search was lost, as in `STATUSES` of run.py.
    """

    case: str
    engine: str
    form: str
    verdict: str
    works_at: float
    fails_at: float
    trials: tuple[Trial, ...]
    monotone: bool = True
    spacing: float = nan
    intervention: str = ""
    settings: str = ""
    settings_help: bool = False
    mechanisms: tuple[str, ...] = ()
    cause: Cause | None = None
    replay: str = ""
    ratio: float = 1.0
    seconds: float = nan
    status: str = "ok"

    @property
    def failing(self) -> Trial | None:
        """The trial at `fails_at`."""
        return next((trial for trial in self.trials if trial.value == self.fails_at), None)

    @property
    def refused(self) -> bool:
        """Whether the engine does not play what it meets at `fails_at`: that is no limit of it."""
        return self.failing is not None and self.failing.broken == REFUSED

    @property
    def runs(self) -> int:
        """The number of runs on which it rests."""
        return sum(trial.runs for trial in self.trials)


def engines_of(case: Case, rows: Container[str] = DISTINCT) -> list[str]:
    """The engines that play a case: these rows of `ENGINES`, and the variants that the case
    names, in the order of `DRIVEN_ENGINES`.

    An engine that only adds friction to another plays only the cases that name it.
    """
    alone = [name for name in DRIVEN_ENGINES if name in rows and name not in WITH_FRICTION_ONLY]
    return [name for name in DRIVEN_ENGINES if name in alone or name in case.also]
