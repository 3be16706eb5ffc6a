"""Finds the limit up to which an engine works: the first failure on the way from gentle to harsh, then bisection."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite, isnan, nan, sqrt

from adapters.play import Run
from reports.stability.players import PLAYERS, Player, played
from reports.stability.predicates import Predicate, Reading, judge
from scenarios.model import Scenario

EXACT, NOT_KNOWN = "the exact answer", "not known"
LIMIT, NEVER_FAILS, NEVER_WORKS, ONLY_BEYOND = "limit", "does not fail", "never works", "works only beyond"


@dataclass(frozen=True)
class Form:
    """How thorough a search is.

    Attributes:
        few: runs at a value that is only passed on the way; next to the limit a value gets all of its case.
        ratio: how close the bracket is made.
        whole: whether every value is played to its last run, also where one has failed, and those that only this form
            scans are, too.
    """

    name: str
    few: int
    ratio: float
    whole: bool


ALL = 10**6  # runs: more than any case has
QUICK = Form("quick", few=4, ratio=1.05, whole=False)
FULL = Form("full", few=ALL, ratio=1.01, whole=True)
FORMS = {form.name: form for form in (QUICK, FULL)}


def once(player: Player, scenario: Scenario) -> tuple[Scenario, Run]:
    """One run, judged by the scenario's own truth or by the laws of physics."""
    return scenario, played(player, scenario)


@dataclass(frozen=True)
class Case:
    """One way to fail.

    Attributes:
        name: lower-case words, as they stand in limits.csv.
        family: the heading it stands under.
        asks: the question in one sentence.
        parameter, unit: what is varied, dimensionless where it can be.
        values: to scan, from gentle to harsh.
        scene: (value, number of the run from 0) -> the scenario; it is played at its only step size. Fewer runs are the
            first of more.
        predicate: what failing means.
        runs: at a value: 1 where nothing differs, else phases of the collision within a step, or seeds.
        whole: whether the parameter counts something.
        also: players of `PLAYERS` besides those of `ENGINES`: an engine with one thing switched.
        play: player and scenario -> the run and what it is judged by, where that takes more than one call of `play`.
        quick_values: to scan in the quick form, where a run is long: some of `values`.
        refines: whether the first edge is bisected, and the full form scans between the values.
        ratio: how close the bracket is made at best, where a run is long or what is drawn differs much.
        by_chance: share of the runs at a value that may fail by chance, where what is read is a statistic or the worst
            of it depends on what is drawn.
        beside: what a failing run is shown beside.
    """

    name: str
    family: str
    asks: str
    parameter: str
    unit: str
    values: tuple[float, ...]
    scene: Callable[[float, int], Scenario]
    predicate: Predicate
    runs: int = 1
    whole: bool = False
    also: tuple[str, ...] = ()
    play: Callable[[Player, Scenario], tuple[Scenario, Run]] = once
    quick_values: tuple[float, ...] = ()
    refines: bool = True
    ratio: float = 1.0
    by_chance: float = 0.0
    beside: str = EXACT

    @property
    def harsher(self) -> int:
        """1 if larger values are harsher, -1 if smaller ones are."""
        return 1 if self.values[-1] > self.values[0] else -1

    def scan(self, form: Form) -> tuple[float, ...]:
        """The values to scan; in the full form those half way between them as well, so that the quick ones are some."""
        if not form.whole:
            return self.quick_values or self.values
        if not self.refines:
            return self.values
        halves = (self.half_way(*pair, self.ratio) for pair in pairwise(self.values))
        return tuple(sorted({*self.values, *filter(None, halves)}, key=lambda value: self.harsher * value))

    def half_way(self, one: float, other: float, ratio: float) -> float | None:
        """The value in the middle of two in their logarithm; None if they are within a ratio, or there is none."""
        low, high = min(one, other), max(one, other)
        if high <= low * ratio:
            return None
        if not self.whole:
            return sqrt(low * high)
        middle = round(sqrt(low * high))
        return float(middle) if low < middle < high else None


@dataclass(frozen=True)
class Trial:
    """The runs at one value: how many, how many of them failed, the worst reading, and the first that failed.

    So many as are `allowed` may fail by chance. `left`: whether it was left at a failure, with runs not played.
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
        """Whether no more runs failed than may by chance."""
        return self.failed <= self.allowed


@dataclass(frozen=True)
class Limit:
    """What a search found; plain numbers and text, so that it goes into a journal as it is.

    Attributes:
        case, player: names; the player is a key of `PLAYERS`.
        form: of `FORMS`.
        verdict: "limit", "does not fail" (up to works_at), "never works" (from fails_at on), or "works only beyond"
            (at works_at, and not at the gentler fails_at).
        works_at: the harshest value before the first failure, where all runs of the form were played; nan: none.
        fails_at: the first failure on the way from gentle to harsh: more runs failed than may by chance; nan: none.
        trials: every value tried, from gentle to harsh.
        monotone: False if there is more than one edge among the values tried: it works again beyond,
            or fails at the gentlest as well.
        spacing: the resolution: the largest ratio of two neighbours among the values tried, up to the first failure.
        seconds: of processor time that the search took.
        cured: the change of `CURES` with which the failing run works; "" if none was found, or looked for.
        twin: the habits with which the reference has this limit, as `twin_of`; "" likewise.
        reason, source, tested: why, where that stands, and how it was tested: "" is a likely reason.
    """

    case: str
    player: str
    form: str
    verdict: str
    works_at: float
    fails_at: float
    trials: tuple[Trial, ...]
    monotone: bool = True
    spacing: float = nan
    cured: str = ""
    twin: str = ""
    reason: str = ""
    source: str = ""
    tested: str = ""
    seconds: float = nan
    status: str = "ok"

    @property
    def failing(self) -> Trial | None:
        """The trial at `fails_at`."""
        return next((trial for trial in self.trials if trial.value == self.fails_at), None)

    @property
    def word(self) -> str:
        """What stands in a table where there is no limit, "" where there is one."""
        if self.status != "ok":
            return self.status
        if self.verdict == NEVER_WORKS:
            return "refused" if self.failing is not None and self.failing.broken == "refused" else "never"
        return "–" if self.verdict == NEVER_FAILS else ""

    @property
    def sign(self) -> str:
        """Before `fails_at` in a table: "≤" or "≥" where it fails up to there, and works beyond."""
        if self.verdict != ONLY_BEYOND:
            return ""
        return "≤" if self.works_at > self.fails_at else "≥"

    @property
    def why(self) -> str:
        """The reason, called likely where nothing tested it."""
        known = self.tested or not self.reason or self.reason.startswith(NOT_KNOWN)
        return self.reason if known else f"likely: {self.reason}"

    @property
    def runs(self) -> int:
        """All runs behind it."""
        return sum(trial.runs for trial in self.trials)


@dataclass
class Search:
    """One case on one player; remembers what was read at each value and the first failing run there."""

    case: Case
    player: str
    form: Form
    readings: dict[float, list[Reading]] = field(default_factory=dict)
    seen: dict[float, tuple[Scenario, Run]] = field(default_factory=dict)

    def limit(self) -> Limit:
        """Scan until the first failure, bisect between it and what works before; then see what works again beyond."""
        scan = self.case.scan(self.form)
        first = next((k for k, value in enumerate(scan) if not self.trial(value, self.form.few).works), len(scan))
        while first and not self.trial(scan[first - 1]).works:  # the few runs on the way did not show it
            first -= 1
        works = [True] * first + [self.trial(value).works for value in scan[first:]]
        if all(works):
            return self.limit_of(NEVER_FAILS, scan[-1], nan)
        if not any(works):
            return self.limit_of(NEVER_WORKS, nan, scan[0])
        edge = next((k for k in range(1, len(scan)) if works[k - 1] and not works[k]), None)
        if edge is not None:
            return self.limit_of(LIMIT, *self.bracket(scan[edge - 1], scan[edge]))
        edge = works.index(True)
        return self.limit_of(ONLY_BEYOND, *self.bracket(scan[edge], scan[edge - 1]))

    def bracket(self, good: float, bad: float) -> tuple[float, float]:
        """What works and what fails, brought together by bisection as close as form and case say."""
        ratio = max(self.form.ratio, self.case.ratio)
        while self.case.refines and (middle := self.case.half_way(good, bad, ratio)) is not None:
            good, bad = (middle, bad) if self.trial(middle).works else (good, middle)
        return good, bad

    def trial(self, value: float, runs: int = ALL, to_the_end: bool = False) -> Trial:
        """Play a value up to so many runs; it is left where more have failed than may, unless the form is the full one.

        Where a run has failed that may have by chance, all are played.
        """
        most, readings = self.case.runs, self.readings.setdefault(value, [])
        failed = sum(reading.failed for reading in readings)
        while len(readings) < (most if failed or to_the_end else min(runs, most)):
            if failed > self.allowed and not (self.form.whole or to_the_end):
                break
            scenario, run = self.case.play(PLAYERS[self.player], self.case.scene(value, len(readings)))
            readings.append(judge(self.case.predicate, scenario, run))
            failed += readings[-1].failed
            if readings[-1].failed:
                self.seen.setdefault(value, (scenario, run))
        return self.tried(value)

    @property
    def allowed(self) -> int:
        """How many runs at a value may fail by chance."""
        return int(self.case.by_chance * self.case.runs)

    def tried(self, value: float) -> Trial:
        """What is known of a value."""
        readings = self.readings[value]
        count, failed = len(readings), sum(reading.failed for reading in readings)
        worst = max((r.value for r in readings if isfinite(r.value)), default=nan)
        if not failed:
            return Trial(value, count, failed, worst)
        first = next(k for k, reading in enumerate(readings) if reading.failed)
        one, left = readings[first], count < self.case.runs
        return Trial(value, count, failed, worst, first, one.at, one.event, one.broken, one.disk, self.allowed, left)

    def limit_of(self, verdict: str, works_at: float, fails_at: float) -> Limit:
        """The limit, with all that was tried from gentle to harsh; at its failure every run is played."""
        if not isnan(fails_at):
            self.trial(fails_at, to_the_end=True)
        trials = tuple(self.tried(value) for value in sorted(self.readings, key=lambda x: self.case.harsher * x))
        changes = sum(one.works != other.works for one, other in pairwise(trials))
        until = [trial.value for trial in trials]
        if verdict == LIMIT:
            until = until[: until.index(fails_at) + 1]
        spacing = max((max(one / other, other / one) for one, other in pairwise(until)), default=nan)
        names = self.case.name, self.player, self.form.name
        return Limit(*names, verdict, works_at, fails_at, trials, changes <= 1, spacing)

    def failure(self, limit: Limit) -> tuple[Scenario, Run] | None:
        """The first run that failed at the limit, for the replay; None if none failed."""
        return self.seen.get(limit.fails_at)


def players_of(case: Case) -> list[str]:
    """Who plays a case: every row of `ENGINES`, and the case's own switches, in the order of `PLAYERS`."""
    return [name for name, player in PLAYERS.items() if not player.switch or name in case.also]
