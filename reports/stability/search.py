"""Finds the limit up to which an engine works: a scan from gentle to harsh up to the first
failure, then bisection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite, isnan, nan

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.verdicts import Verdict
from crosscheck2d.reports.stability.limits import (
    ALL,
    LIMIT,
    NEVER_FAILS,
    NEVER_WORKS,
    ONLY_BEYOND,
    Case,
    Form,
    Limit,
    Trial,
)
from crosscheck2d.reports.stability.predicates import judge
from crosscheck2d.reports.stability.variants import DRIVEN_ENGINES
from crosscheck2d.scenarios.model import Scenario


@dataclass
class LimitSearch:
    """The search for the limit of one case on one engine; keeps the verdicts at each value, and the
    first failing run there."""

    case: Case
    engine: str
    form: Form
    readings: dict[float, list[Verdict]] = field(default_factory=dict)
    seen: dict[float, tuple[Scenario, Run]] = field(default_factory=dict)

    def limit(self) -> Limit:
        """Scan to the first failure and bisect between it and the value before; harsher values
        are played too."""
        scan = self.case.scan(self.form)
        first = next(
            (k for k, value in enumerate(scan) if not self.trial(value, self.few).works), len(scan)
        )
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
        """The working and the failing value after bisection, as close as form and case demand."""
        ratio = max(self.form.ratio, self.case.ratio)
        while self.case.refines and (middle := self.case.half_way(good, bad, ratio)) is not None:
            good, bad = (middle, bad) if self.trial(middle).works else (good, middle)
        return good, bad

    def trial(self, value: float, runs: int = ALL, to_the_end: bool = False) -> Trial:
        """Play up to `runs` runs at a value, and stop when more have failed than may (not in the
        full form).

        If a run failed and some may fail by chance, all runs are played.
        """
        most, readings = self.case.runs, self.readings.setdefault(value, [])
        failed = sum(reading.failed for reading in readings)
        while len(readings) < (most if failed or to_the_end else min(runs, most)):
            if failed > self.allowed and not (self.form.whole or to_the_end):
                break
            scenario, run = self.case.play(
                DRIVEN_ENGINES[self.engine], self.case.scene(value, len(readings))
            )
            readings.append(judge(self.case.predicate, scenario, run))
            failed += readings[-1].failed
            if readings[-1].failed:
                self.seen.setdefault(value, (scenario, run))
        return self.tried(value)

    @property
    def few(self) -> int:
        """The runs at a scanned value; at least half of all if some may fail by chance."""
        return max(self.form.few, self.case.runs // 2) if self.case.by_chance else self.form.few

    @property
    def allowed(self) -> int:
        """The number of runs at a value that may fail by chance."""
        return int(self.case.by_chance * self.case.runs)

    def tried(self, value: float) -> Trial:
        """The trial of a value from the readings so far."""
        readings = self.readings[value]
        count, failed = len(readings), sum(reading.failed for reading in readings)
        worst = max((r.value for r in readings if isfinite(r.value)), default=nan)
        if not failed:
            return Trial(value, count, failed, worst)
        first, verdict = next((k, each) for k, each in enumerate(readings) if each.failed)
        disk = verdict.disks[0] if verdict.disks else -1
        happens = verdict.at, verdict.text, verdict.id, disk
        left = count < self.case.runs
        return Trial(value, count, failed, worst, first, *happens, self.allowed, left)

    def limit_of(self, verdict: str, works_at: float, fails_at: float) -> Limit:
        """The limit with all trials from gentle to harsh; at its failing value every run is
        played."""
        if not isnan(fails_at):
            self.trial(fails_at, to_the_end=True)
        trials = tuple(
            self.tried(value)
            for value in sorted(self.readings, key=lambda x: self.case.harsher * x)
        )
        changes = sum(before.works != after.works for before, after in pairwise(trials))
        until = [trial.value for trial in trials]
        if verdict == LIMIT:
            until = until[: until.index(fails_at) + 1]
        spacing = max((max(a / b, b / a) for a, b in pairwise(until)), default=nan)
        names = self.case.name, self.engine, self.form.name
        return Limit(*names, verdict, works_at, fails_at, trials, changes <= 1, spacing)

    def failure(self, limit: Limit) -> tuple[Scenario, Run] | None:
        """The first run that failed at the limit, for the replay; None if none failed."""
        return self.seen.get(limit.fails_at)


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
