"""Finds the limit up to which a player works: a coarse scan of a case's parameter, then bisection of the first edge."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite, nan, sqrt

from adapters.play import Run
from reports.stability.players import PLAYERS, Player, played
from reports.stability.predicates import Predicate, Reading, judge
from scenarios.model import Scenario

EXACT, NOT_KNOWN = "the exact answer", "not known"
LIMIT, NEVER_FAILS, NEVER_WORKS, ONLY_BEYOND = "limit", "does not fail", "never works", "works only beyond"


@dataclass(frozen=True)
class Form:
    """How thorough a search is: runs at a value, how close the bracket is made, every how many values are scanned."""

    name: str
    runs: int
    ratio: float
    every: int


QUICK = Form("quick", runs=4, ratio=1.05, every=2)
FULL = Form("full", runs=16, ratio=1.01, every=1)
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
        scene: (value, number of the run from 0, of how many) -> the scenario; it is played at its only step size.
        predicate: what failing means.
        drawn: whether the runs at a value differ (in the phase of the hit within a step, or in what is drawn).
        whole: whether the parameter counts something.
        also: players of `PLAYERS` besides those of `ENGINES`: an engine with one thing switched.
        play: player and scenario -> the run and what it is judged by, where that takes more than one call of `play`.
        quick_values: to scan in the quick form, where it is not every other one of `values`.
        refines: whether the first edge is bisected.
        ratio: how close the bracket is made at best, where a run is long or what is drawn differs much.
        by_chance: share of the runs at a value that may fail by chance, where what is read is a statistic.
        most_runs, quick_runs: at a value, in all forms and in the quick one, where a run is long.
        beside: what a failing run is shown beside.
    """

    name: str
    family: str
    asks: str
    parameter: str
    unit: str
    values: tuple[float, ...]
    scene: Callable[[float, int, int], Scenario]
    predicate: Predicate
    drawn: bool = False
    whole: bool = False
    also: tuple[str, ...] = ()
    play: Callable[[Player, Scenario], tuple[Scenario, Run]] = once
    quick_values: tuple[float, ...] = ()
    refines: bool = True
    ratio: float = 1.0
    by_chance: float = 0.0
    most_runs: int = 10**6
    quick_runs: int = 10**6
    beside: str = EXACT

    def scan(self, form: Form) -> tuple[float, ...]:
        """The values to scan; the last of them always."""
        if form.every == 1:
            return self.values
        return self.quick_values or tuple(sorted_like(self.values, {*self.values[:: form.every], self.values[-1]}))

    def runs(self, form: Form) -> int:
        """How many runs a value gets."""
        most = self.most_runs if form.every == 1 else min(self.most_runs, self.quick_runs)
        return min(form.runs, most) if self.drawn else 1


def sorted_like(order: Sequence[float], chosen: set[float]) -> list[float]:
    """The chosen ones in the order in which they stand."""
    return [value for value in order if value in chosen]


@dataclass(frozen=True)
class Trial:
    """All runs at one value: how many, how many of them failed, the worst reading, and the first that failed.

    So many as are `allowed` may fail by chance.
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
        works_at: of the first two neighbours of which the gentler works and the harsher fails, the gentler; nan: none.
        fails_at: the harsher: more runs failed than may by chance; nan: none.
        trials: every value tried, from gentle to harsh.
        monotone: False if there is more than one edge: it works again beyond, or fails before as well.
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
    """One case on one player; remembers what was tried and the first failing run next to the limit."""

    case: Case
    player: str
    form: Form
    tried: dict[float, Trial] = field(default_factory=dict)
    seen: dict[float, tuple[Scenario, Run]] = field(default_factory=dict)

    def limit(self) -> Limit:
        """Scan, then bisect the first edge."""
        scan = list(self.case.scan(self.form))
        works = [self.trial(value).works for value in scan]
        edge = first_edge(works)
        if edge is None and works[0]:
            return self.limit_of(NEVER_FAILS, scan[-1], nan)
        if edge is None:
            return self.limit_of(NEVER_WORKS, nan, scan[0])
        near, far = scan[edge], scan[edge + 1]
        good, bad = (near, far) if works[edge] else (far, near)
        while self.case.refines and (middle := self.between(good, bad)) is not None:
            good, bad = (middle, bad) if self.trial(middle).works else (good, middle)
        return self.limit_of(LIMIT if works[edge] else ONLY_BEYOND, good, bad)

    def between(self, good: float, bad: float) -> float | None:
        """The value to try next, or None if the bracket is close enough."""
        low, high, ratio = min(good, bad), max(good, bad), max(self.form.ratio, self.case.ratio)
        if self.case.whole:
            middle = round(sqrt(low * high))
            return float(middle) if low < middle < high and high > low * ratio else None
        if high <= low * ratio:
            return None
        return sqrt(low * high)

    def trial(self, value: float) -> Trial:
        """Play all runs at one value."""
        if value not in self.tried:
            self.tried[value] = self.played(value)
        return self.tried[value]

    def played(self, value: float) -> Trial:
        """All runs at one value; the first that fails is remembered."""
        case, count = self.case, self.case.runs(self.form)
        readings: list[Reading] = []
        first = -1
        for run_number in range(count):
            scenario, run = case.play(PLAYERS[self.player], case.scene(value, run_number, count))
            reading = judge(case.predicate, scenario, run)
            readings.append(reading)
            if reading.failed and first < 0:
                first = run_number
                self.seen[value] = scenario, run
        failed = sum(reading.failed for reading in readings)
        worst = max((r.value for r in readings if isfinite(r.value)), default=nan)
        if first < 0:
            return Trial(value, count, failed, worst)
        broke, allowed = readings[first], int(case.by_chance * count)
        return Trial(value, count, failed, worst, first, broke.at, broke.event, broke.broken, broke.disk, allowed)

    def limit_of(self, verdict: str, works_at: float, fails_at: float) -> Limit:
        """The limit, with all that was tried in the order of the scan."""
        order = sorted(self.tried, reverse=self.case.values[0] > self.case.values[-1])
        trials = tuple(self.tried[value] for value in order)
        changes = sum(one.works != other.works for one, other in pairwise(trials))
        return Limit(
            self.case.name, self.player, self.form.name, verdict, works_at, fails_at, trials, monotone=changes <= 1
        )

    def failure(self, limit: Limit) -> tuple[Scenario, Run] | None:
        """The first run that failed at the limit, for the replay; None if none failed."""
        return self.seen.get(limit.fails_at)


def first_edge(works: Sequence[bool]) -> int | None:
    """The first k with works[k] and not works[k + 1]; else the first with the reverse; None if all are the same."""
    for first in (True, False):
        for k in range(len(works) - 1):
            if works[k] == first and works[k + 1] != first:
                return k
    return None


def players_of(case: Case) -> list[str]:
    """Who plays a case: every row of `ENGINES`, and the case's own switches, in the order of `PLAYERS`."""
    return [name for name, player in PLAYERS.items() if not player.switch or name in case.also]
