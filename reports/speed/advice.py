"""The cheapest engine and step size that keep a given error in one scene wherever its collisions
fall within a step, until when the others keep it, and the engine options that the scene does not
need: all measured in runs of the scene itself."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from math import ceil, inf, isfinite, isnan, log, nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import OWN, row_of
from crosscheck2d.adapters.mechanisms.options import OPTIONS
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare.accuracy import kept_from
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.verdicts import first_failed
from crosscheck2d.reports.compare.view import View, beside, cut
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.cells import busy_cores
from crosscheck2d.reports.run.playing import LOADING, clocked
from crosscheck2d.reports.run.pool import Failure, allow
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed.causes import cause_of
from crosscheck2d.reports.speed.ladder import (
    PURPOSES,
    STARTS,
    Scored,
    scored,
    starts_within_a_step,
    times_of,
)
from crosscheck2d.reports.speed.measure import do_all
from crosscheck2d.reports.speed.plan import PLAIN, doublings
from crosscheck2d.reports.speed.tables import summed_up
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.no_truth import NoTruth

PATIENCE, ALL_ROUNDS = 60.0, 600.0  # s that a run, and all timings together, may take
SEARCH = 180.0  # s for the search of a cause, some ten runs and the error budget
ROUNDS, BUDGET = 11, 0.4  # of timing, and s of it for one engine
# steps times disks of one run, some seconds of the slowest engine; fewer than `FEW` disks count as
# `FEW`, as a step with them costs no less
MOST_WORK, FEW = 1_000_000, 10
NINE_TENTHS = 0.9  # of the starts within a step, in which a step size must keep the error
TOO_FAR_OFF, SAVES_TIME, NEARER, NO_GAIN = "too far off", "saves time", "more accurate", "no gain"
NOT_COMPARED = "times not compared"
# Times are not compared if the noise, or the number of cores kept busy by others, is above these.
# An option is timed in separate runs, so that less than a tenth cannot be resolved on a quiet
# machine.
LOUD, BUSY = 0.1, 0.5
HALF = 0.5  # with at most this part of the error an option counts as more accurate
STATISTICS = "statistics"
FOURTH = 4  # an option is played from every fourth start: there are more options than engines
LASTING = ("trajectory", "energy")  # purposes whose error only grows: it is kept until an instant


class NoAdvice(Exception):
    """No advice can be given for the scene; str() says why."""


@dataclass(frozen=True)
class Attempt:
    """One engine at one step size."""

    name: str  # `engine:profile`
    change: str  # a row of `OPTIONS`, or `PLAIN`
    substeps: int  # steps in a sample interval
    dt: float  # s
    error: float  # of the purpose; inf where the run failed, nan where it cannot be judged
    reason: str = ""  # why it failed
    until: float = nan  # s up to which it keeps the error; nan where that is not known
    starts: tuple[float, ...] = ()  # errors from `starts_within_a_step`; () where not played
    lasting: float = nan  # s of the scene up to which nine tenths of these keep the error
    cost: float = nan  # s per simulated second; nan where not timed
    broken: bool = False  # whether it failed by a verdict

    @property
    def make(self) -> Callable[[], Engine]:
        options = {option.change: option.make for option in OPTIONS if option.engine == self.name}
        return options.get(self.change) or row_of(self.name).make

    @property
    def task(self) -> tuple[str, str, int]:
        return (self.name, self.change, self.substeps)

    @property
    def is_library(self) -> bool:
        return row_of(self.name).outside or self.name.endswith(OWN)

    @property
    def usually(self) -> float:
        """The error that nine tenths of the starts keep; nan where these were not played."""
        count = ceil(NINE_TENTHS * len(self.starts))
        return sorted(self.starts)[count - 1] if count else nan

    def kept_in(self, bound: float) -> int:
        return sum(error <= bound for error in self.starts)

    def holds(self, bound: float) -> bool:
        return self.error <= bound and self.kept_in(bound) >= NINE_TENTHS * len(self.starts)


class Requirement(NamedTuple):
    """A scene, a key of `PURPOSES`, and how large its error may be. The methods are what a worker
    does."""

    scene: str
    seed: int
    purpose: str
    bound: float

    def play(self, attempt: Attempt) -> Attempt:
        return self.play_part(scored(self.scene, self.seed), attempt)

    def play_part(self, part: Scored, attempt: Attempt) -> Attempt:
        """The attempt with its error in a part of the scene, and until when, s, it keeps the
        bound."""
        scenario, truth = part
        allow(LOADING)  # a kernel's first compilation is no time of an engine
        run = play_once(attempt.make, attempt.name, scenario, attempt.dt, clocked())
        until = nan
        if run.trajectory is not None and len(run.trajectory) > 1:
            jumps = jumps_of(truth, scenario) if self.purpose == "energy" else None
            view = beside(scenario, run, truth, jumps)
            until = self.kept_until(view) if self.purpose in LASTING else nan
        if run.status != "ok" or run.trajectory is None:
            failure = f"{run.status}: {run.reason}"
            return replace(attempt, error=inf, reason=failure, until=until)
        error = PURPOSES[self.purpose].error(view)
        reason = "" if not isnan(error) else "too little of it can be judged"
        return replace(attempt, error=error, reason=reason, until=until)

    def kept_until(self, view: View) -> float:
        """s, the last sample up to which a run keeps the bound; found by bisection, as its error
        only grows."""
        assert view.other is not None
        low, high = 1, len(view.played)  # samples: the start is given
        while low < high:
            k = (low + high + 1) // 2
            early = replace(view, played=cut(view.played, k), other=cut(view.other, k))
            far_off = PURPOSES[self.purpose].error(early) > self.bound
            low, high = (low, k - 1) if far_off else (k, high)
        return float(view.played.t[low - 1])

    def play_starts(self, attempt: Attempt, every: int = 1) -> Attempt:
        """The attempt with its errors from every `every`-th of the starts within a step, and until
        when nine tenths of these keep the bound."""
        errors, until = list[float](), list[float]()
        whole = scored(self.scene, self.seed).scenario.duration
        starts = starts_within_a_step(self.scene, self.seed, attempt.dt)
        for begin, part in islice(starts, 0, None, every):
            played = self.play_part(part, attempt)
            errors.append(played.error)
            keeps = played.error <= self.bound
            until.append(whole if keeps else played.until and begin + played.until)
        count = len(errors) - ceil(NINE_TENTHS * len(errors))
        lasting = float(np.sort(np.nan_to_num(until, nan=0.0))[count])
        lasting = lasting if self.purpose in LASTING else nan
        return replace(attempt, starts=tuple(errors), lasting=lasting)

    def play_to_the_end(self, attempt: Attempt) -> Attempt:
        """The attempt in the whole scene, beyond the horizon of its exact answer, too: with the
        reason why it ends early, and how far it gets, or with the verdict that it fails."""
        scenario = open_scene(self.scene, self.seed)
        allow(LOADING)
        run = play_once(attempt.make, attempt.name, scenario, attempt.dt, clocked())
        if run.status != "ok":
            until = f", up to {run.trajectory.t[-1]:.3g} s" if run.trajectory is not None else ""
            return replace(attempt, reason=f"{run.status}{until}: {run.reason}")
        failed = first_failed(run, scenario, scored(self.scene, self.seed).truth)
        reason = f"{failed.text} at {failed.at:.3g} s" if failed else ""
        return replace(attempt, reason=reason, broken=failed is not None)

    def find_cause(self, name: str, substeps: int) -> str:
        allow(LOADING + SEARCH)  # with time to compile the ablated reference
        return cause_of(self.scene, self.seed, name, substeps, self.purpose, self.bound)


class ChangedOption(NamedTuple):
    """An engine without a change of an option, and with it, at the same step size."""

    plain: Attempt
    changed: Attempt

    @property
    def errors(self) -> tuple[float, float]:
        """The medians over the starts that both were played from."""
        every = len(self.plain.starts) // len(self.changed.starts)
        return float(np.median(self.plain.starts[::every])), float(np.median(self.changed.starts))

    def verdict(self, bound: float, floor: float) -> str:
        """The effect of the change: on the error, or else on the cost, if the cost changes by more
        than the fraction `floor`; inf where costs cannot be compared."""
        if not self.changed.holds(bound):
            return TOO_FAR_OFF
        if self.changed.cost / self.plain.cost < 1 - floor:
            return SAVES_TIME
        before, after = self.errors
        if after <= HALF * before:
            return NEARER
        return NO_GAIN if isfinite(floor) else NOT_COMPARED


class OutOfReach(NamedTuple):
    """An engine that does not keep the error to the end: its best attempt, its error at the finest
    step size, the attempts at the usual step size and at the one that keeps it longest, and the
    reason."""

    best: Attempt
    finest: float
    usual: Attempt
    longest: Attempt
    reason: str


@dataclass(frozen=True)
class Advice:
    """The result of `Inquiry.advise`.

    keeping: for every engine that keeps the error and plays the whole scene without failing a
        verdict, the coarsest step size that does from nine tenths of the starts within a step, too,
        and keeps the error at every finer one; cheapest first.
    short: the engines that do not keep it.
    partial: those that keep it where it is judged, but do not play the whole scene, or fail a
        verdict in it at every step size that keeps it; with the reason.
    """

    scene: str
    purpose: str
    bound: float
    until: float  # s, up to where errors are judged
    duration: float  # s, of the scene
    collisions: int  # of the exact answer, that are judged
    step_sizes: Sequence[float]  # s, those that were tried, coarse to fine
    keeping: Sequence[Attempt]
    short: Sequence[OutOfReach]
    partial: Sequence[Attempt]
    changes: Sequence[ChangedOption]  # of the engines that keep it, one option at a time
    noise: float  # the upper quartile of |log(cost / cost of its own copy)| over the engines
    busy: float  # cores that others kept busy when the timing began; nan where unknown
    statistics: Advice | None = None  # for averages over time, where no library keeps the error

    @property
    def judged(self) -> str:
        early = self.until < self.duration and not self.collisions
        part = f"up to {number(self.until)} of {number(self.duration)} s"
        return f"{part}, before any collision" if early else part

    @property
    def quiet(self) -> bool:
        return self.noise <= LOUD and not self.busy > BUSY

    @property
    def floor(self) -> float:
        """The fraction by which two costs must differ to be compared; inf where none can be."""
        return max(self.noise, LOUD) if self.quiet else inf

    @property
    def ranked(self) -> list[tuple[int, Attempt]]:
        """(rank, attempt) of `keeping`, the libraries first: those that cost at most `floor` more
        than the first of a rank have the same rank."""
        rows = list[tuple[int, Attempt]]()
        for library in (True, False):
            rank, least = 0, -inf
            group = [attempt for attempt in self.keeping if attempt.is_library is library]
            for k, attempt in enumerate(group, 1):
                if not attempt.cost <= least * (1 + self.floor):
                    rank, least = k, attempt.cost
                rows.append((rank, attempt))
        return rows


@dataclass(frozen=True)
class Inquiry:
    """Which engine meets a requirement at the least cost.

    Raises:
        NoAdvice: the scene has no exact answer.
    """

    requirement: Requirement
    workers: int
    progress: Progress

    def __post_init__(self) -> None:
        scene, seed, *_ = self.requirement
        try:
            scored(scene, seed)
        except NoTruth as refusal:
            raise NoAdvice(
                f"no exact answer: {refusal}. To compare the engines with each other and with the"
                f" laws of physics: crosscheck run {shlex.quote(scene)}"
            ) from refusal

    @property
    def part(self) -> Scored:
        return scored(self.requirement.scene, self.requirement.seed)

    @property
    def ladder(self) -> tuple[int, ...]:
        scenario = self.part.scenario
        return doublings(scenario, MOST_WORK // max(scenario.scene.n, FEW))

    def advise(self, names: Sequence[str]) -> Advice:
        """Which of the engines `names` keeps the error at the least cost.

        Every engine is played at every step size of the scene's ladder, up to the horizon of the
        exact answer. Those that keep the error play the whole scene, and from several instants of
        a step; then they are timed, together with their options, alone on the machine.

        Raises:
            NoAdvice: the timing failed.
        """
        requirement, (scenario, truth) = self.requirement, self.part
        bound = requirement.bound
        tried = self.attempts((name, PLAIN, k) for name in names for k in self.ladder)
        ladders = {name: [each for each in tried if each.name == name] for name in names}
        keeping, partly, unsteady = self.confirmed(
            [rest for each in ladders.values() if (rest := those_that_keep(each, bound))]
        )
        at = {attempt.name: attempt.substeps for attempt in keeping}
        changed = (x for x in OPTIONS if x.engine in at)
        optional = self.attempts((x.engine, x.change, at[x.engine]) for x in changed)
        able, _ = self.to_the_end(self.from_every_start(optional, FOURTH))
        priced, differences, busy = self.timed([*keeping, *able])
        plain = {attempt.name: attempt for attempt in priced if attempt.change == PLAIN}
        ended = {attempt.name for attempt in (*keeping, *partly)}
        advice = Advice(
            scenario.name,
            requirement.purpose,
            bound,
            scenario.duration,
            open_scene(requirement.scene, requirement.seed).duration,
            len(truth.collisions),
            [scenario.dt(k) for k in self.ladder],
            sorted(plain.values(), key=lambda attempt: attempt.cost),
            self.out_of_reach(
                [ladder for name, ladder in ladders.items() if name not in ended],
                {attempt.name: attempt for attempt in unsteady},
            ),
            partly,
            [ChangedOption(plain[each.name], each) for each in priced if each.change != PLAIN],
            float(np.percentile([*differences.values()], 75)) if differences else nan,
            busy,
        )
        libraries = [name for name, (first, *_) in ladders.items() if first.is_library]
        if requirement.purpose == STATISTICS or not libraries or at.keys() & set(libraries):
            return advice
        averages = replace(self, requirement=requirement._replace(purpose=STATISTICS))
        return replace(advice, statistics=averages.advise(libraries))

    def attempts(self, asked: Iterable[tuple[str, str, int]]) -> list[Attempt]:
        dt = self.part.scenario.dt
        wanted = [Attempt(name, change, k, dt(k), nan) for name, change, k in asked]
        return self.outcomes(wanted, self.requirement.play, "playing", error=inf)

    def from_every_start(self, wanted: Sequence[Attempt], every: int = 1) -> list[Attempt]:
        play = partial(self.requirement.play_starts, every=every)
        what = f"playing from {STARTS // every} instants of a step"
        return self.outcomes(wanted, play, what, starts=(inf,) * STARTS)

    def to_the_end(self, wanted: Sequence[Attempt]) -> tuple[list[Attempt], list[Attempt]]:
        """The attempts that play the whole scene and fail no verdict in it; and those that do not,
        each with the reason."""
        played = self.outcomes(wanted, self.requirement.play_to_the_end, "playing to the end")
        return [x for x in played if not x.reason], [x for x in played if x.reason]

    def outcomes(
        self,
        wanted: Sequence[Attempt],
        play: Callable[[Attempt], Attempt],
        what: str,
        **failed: Any,
    ) -> list[Attempt]:
        """The attempts played; those whose worker failed with these fields, and the reason."""
        tasks = {attempt.task: partial(play, attempt) for attempt in wanted}
        results = do_all(tasks, self.workers, self.progress, what, PATIENCE)
        for attempt in wanted:
            result = results[attempt.task]
            if isinstance(result, Failure):
                reason = f"{result.status}: {result.reason}"
                results[attempt.task] = replace(attempt, reason=reason, **failed)
        return [results[attempt.task] for attempt in wanted]

    def confirmed(
        self, ladders: Sequence[Sequence[Attempt]]
    ) -> tuple[list[Attempt], list[Attempt], list[Attempt]]:
        """Of each engine the coarsest of its attempts that is able, as in `to_the_end`, and holds
        from every start: where one fails a verdict, or holds from too few, the next finer one is
        tried. Then those that are never able, the finest tried, and those that never hold."""
        able, unable, unsteady = list[Attempt](), list[Attempt](), list[Attempt]()
        first: dict[str, str] = {}
        while ladders:
            finer = {ladder[0].name: ladder[1:] for ladder in ladders if len(ladder) > 1}
            passed, failed = self.to_the_end([ladder[0] for ladder in ladders])
            again = list[str]()
            for attempt in self.from_every_start(passed):
                if attempt.holds(self.requirement.bound):
                    able.append(attempt)
                elif attempt.name in finer:
                    again.append(attempt.name)
                else:
                    unsteady.append(attempt)
            for attempt in failed:
                at_dt = attempt.reason
                if attempt.broken:
                    at_dt += f" (dt {number(attempt.dt * 1e3)} ms)"
                coarse = first.setdefault(attempt.name, at_dt)
                if attempt.broken and attempt.name in finer:
                    again.append(attempt.name)
                else:
                    both = dict.fromkeys((coarse, at_dt))
                    unable.append(replace(attempt, reason="; ".join(both)))
            ladders = [finer[name] for name in again]
        return able, unable, unsteady

    def timed(
        self, played: Sequence[Attempt]
    ) -> tuple[list[Attempt], dict[tuple[str, int], float], float]:
        """The attempts with their costs in the whole scene; for each engine and step size the
        difference of two timings of the same engine, |log(cost / cost of its copy)|; and the number
        of cores that others used."""
        if not played:
            return [], {}, nan
        makes = {(attempt.task, attempt.substeps, 0): attempt.make for attempt in played}
        twice = [attempt for attempt in played if attempt.change == PLAIN]
        makes |= {(attempt.task, attempt.substeps, 1): attempt.make for attempt in twice}
        scene, seed, *_ = self.requirement
        task = partial(times_of, scene, seed, makes, ROUNDS, BUDGET, whole=True)
        busy = busy_cores()
        [samples] = do_all({("time",): task}, 1, self.progress, "timing", ALL_ROUNDS).values()
        if isinstance(samples, Failure):
            raise NoAdvice(f"the timing ended: {samples.status}: {samples.reason}")
        times = summed_up(pd.DataFrame(samples), ["key"])
        cost = dict(zip(times.key, times.cost))
        priced = [replace(each, cost=cost[each.task, each.substeps, 0]) for each in played]
        differences = {
            (each.name, each.substeps): abs(log(cost[each.task, each.substeps, 1] / each.cost))
            for each in priced
            if each.change == PLAIN
        }
        return priced, differences, busy

    def out_of_reach(
        self, ladders: Sequence[Sequence[Attempt]], unsteady: Mapping[str, Attempt]
    ) -> list[OutOfReach]:
        """What each engine, of which all attempts are given, coarse to fine, comes to; until when
        it keeps the error; and the cause of its error, at the coarsest step that has at most twice
        its least error."""
        dt = self.part.scenario.dt(self.part.scenario.middle_substeps)
        best = [min(each, key=lambda x: inf if isnan(x.error) else x.error) for each in ladders]
        usual = [next((x for x in each if x.dt <= dt), each[-1]) for each in ladders]
        longest = [max(each, key=lambda x: (reach(x), x.dt)) for each in ladders]
        if self.requirement.purpose in LASTING:
            lasting = dict.fromkeys(x for x in (*usual, *longest) if not isnan(x.until))
            until = {x.task: x for x in (*self.from_every_start([*lasting]), *unsteady.values())}
            usual, longest = ([until.get(x.task, x) for x in each] for each in (usual, longest))
        tasks = {}
        for least, ladder in zip(best, ladders):
            if isfinite(least.error):
                at = next(attempt for attempt in ladder if attempt.error <= 2 * least.error)
                bits = row_of(least.name).bits_of or least.name  # what plays the same
                tasks[least.task] = partial(self.requirement.find_cause, bits, at.substeps)
        causes = do_all(tasks, self.workers, self.progress, "cause of the error", SEARCH)
        rows = []
        for row in zip(best, (ladder[-1].error for ladder in ladders), usual, longest):
            name, reason = row[0].name, row[0].reason
            if not reason:
                cause = causes[row[0].task]
                failed = isinstance(cause, Failure)
                reason = "not known: the search for it did not end" if failed else cause
            if name in unsteady:
                reason = (
                    f"at {number(1e3 * unsteady[name].dt)} ms it keeps the error from"
                    f" {unsteady[name].kept_in(self.requirement.bound)} of {STARTS} instants of a"
                    f" step only; {reason}"
                )
            rows.append(OutOfReach(*row, reason))
        return rows


def reach(attempt: Attempt) -> float:
    # sort key: until when it keeps the error
    return -inf if isnan(attempt.until) else attempt.until


def those_that_keep(ladder: Sequence[Attempt], bound: float) -> list[Attempt]:
    """The attempts, coarse to fine, that keep the error together with all finer ones. One that
    keeps it by chance, with a larger error at a finer step, does not count."""
    keeps = kept_from(np.array([attempt.error for attempt in ladder]), bound)
    return [attempt for attempt, keep in zip(ladder, keeps) if keep]
