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
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.pareto import kept_from
from crosscheck2d.reports.compare.verdicts import first_failed
from crosscheck2d.reports.compare.view import View, beside, cut
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.cells import busy_cores
from crosscheck2d.reports.run.playing import LOADING, clocked
from crosscheck2d.reports.run.pool import Failure, allow
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.stepping import step_through
from crosscheck2d.reports.run.timing import Sample, Timed, interleaved
from crosscheck2d.reports.speed.causes import cause_of
from crosscheck2d.reports.speed.effort import doublings
from crosscheck2d.reports.speed.measure import done
from crosscheck2d.reports.speed.plan import PLAIN
from crosscheck2d.reports.speed.purposes import PURPOSES
from crosscheck2d.reports.speed.scored_part import STARTS, Scored, scored, starts_within_a_step
from crosscheck2d.reports.speed.tables import summed_up
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.model import Scenario
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
    """One engine at one step size.

    Attributes:
        name: `engine:profile`.
        change: a row of `OPTIONS`, or `PLAIN`.
        substeps: steps in a sample interval.
        dt: s.
        error: of the purpose; inf where the run failed, nan where it cannot be judged.
        reason: why it failed, else "".
        until: s up to which it keeps the error; nan where that is not known.
        starts: its errors from each of `starts_within_a_step`; () where these were not played.
        lasting: s of the scene up to which nine tenths of these keep the error.
        cost: s per simulated second, nan where not timed.
        broken: whether it failed by a verdict.
    """

    name: str
    change: str
    substeps: int
    dt: float
    error: float
    reason: str = ""
    until: float = nan
    starts: tuple[float, ...] = ()
    lasting: float = nan
    cost: float = nan
    broken: bool = False

    @property
    def make(self) -> Callable[[], Engine]:
        """A function that makes the engine."""
        options = {option.change: option.make for option in OPTIONS if option.engine == self.name}
        return options.get(self.change) or row_of(self.name).make

    @property
    def task(self) -> tuple[str, str, int]:
        """The key of the attempt among those of its scene."""
        return (self.name, self.change, self.substeps)

    @property
    def is_library(self) -> bool:
        """Whether the engine is not a solver of this project."""
        return row_of(self.name).outside or self.name.endswith(OWN)

    @property
    def usually(self) -> float:
        """The error that nine tenths of the starts keep; nan where these were not played."""
        count = ceil(NINE_TENTHS * len(self.starts))
        return sorted(self.starts)[count - 1] if count else nan

    def kept_in(self, bound: float) -> int:
        """From how many of the starts it keeps the error."""
        return sum(error <= bound for error in self.starts)

    def holds(self, bound: float) -> bool:
        """Whether it keeps the error in the scene itself and from nine tenths of the starts."""
        return self.error <= bound and self.kept_in(bound) >= NINE_TENTHS * len(self.starts)


class ChangedOption(NamedTuple):
    """An engine with one option changed, and the engine without the change, at the same step
    size."""

    plain: Attempt
    changed: Attempt

    @property
    def errors(self) -> tuple[float, float]:
        """The medians, without the change and with it, over the starts that both were played
        from."""
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
    why: str


@dataclass(frozen=True)
class Advice:
    """The result of `Inquiry.advice`.

    Attributes:
        scene: the name of the scene.
        purpose, bound: which error, and how large it may be.
        until, duration: s, up to where errors are judged, and how long the scene is.
        collisions: how many of the exact answer are judged.
        step_sizes: s, those that were tried, coarse to fine.
        keeping: for every engine that keeps the error and plays the whole scene without failing a
            verdict, the coarsest step size that does from nine tenths of the starts within a step,
            too, and keeps the error at every finer one; cheapest first.
        short: the engines that do not keep it.
        partial: those that keep it where it is judged, but do not play the whole scene, or fail a
            verdict in it at every step size that keeps it; with the reason.
        changes: options of the engines that keep it, changed one at a time.
        noise: the upper quartile of |log(cost / cost of its own copy)| over the engines.
        busy: cores that others kept busy when the timing began; nan where unknown.
        statistics: where no library keeps the error, the advice for averages over time.
    """

    scene: str
    purpose: str
    bound: float
    until: float
    duration: float
    collisions: int
    step_sizes: Sequence[float]
    keeping: Sequence[Attempt]
    short: Sequence[OutOfReach]
    partial: Sequence[Attempt]
    changes: Sequence[ChangedOption]
    noise: float
    busy: float
    statistics: Advice | None = None

    @property
    def judged(self) -> str:
        """The part of the scene in which errors are judged, as the end of a sentence."""
        early = self.until < self.duration and not self.collisions
        part = f"up to {number(self.until)} of {number(self.duration)} s"
        return f"{part}, before any collision" if early else part

    @property
    def quiet(self) -> bool:
        """Whether its times can be compared."""
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
            group = [one for one in self.keeping if one.is_library is library]
            for k, one in enumerate(group, 1):
                if not one.cost <= least * (1 + self.floor):
                    rank, least = k, one.cost
                rows.append((rank, one))
        return rows


@dataclass(frozen=True)
class Inquiry:
    """A scene about which is asked: which engine keeps an error at the least cost.

    Raises:
        NoAdvice: the scene has no exact answer.
    """

    scene: str
    seed: int
    workers: int
    progress: Progress

    def __post_init__(self) -> None:
        try:
            scored(self.scene, self.seed)
        except NoTruth as refusal:
            raise NoAdvice(
                f"no exact answer: {refusal}. To compare the engines with each other and with the"
                f" laws of physics: crosscheck run {shlex.quote(self.scene)}"
            ) from refusal

    @property
    def scenario(self) -> Scenario:
        """The scenario up to the horizon of its exact answer."""
        return scored(self.scene, self.seed).scenario

    @property
    def ladder(self) -> tuple[int, ...]:
        """Steps in a sample interval, coarse to fine."""
        return doublings(self.scenario, MOST_WORK // max(self.scenario.scene.n, FEW))

    def advice(self, purpose: str, bound: float, names: Sequence[str]) -> Advice:
        """Which of the engines `names` keeps the error of `purpose`, a key of `PURPOSES`, within
        `bound` at the least cost.

        Every engine is played at every step size of the scene's ladder, up to the horizon of the
        exact answer. Those that keep the error play the whole scene, and from several instants of
        a step; then they are timed, together with their options, alone on the machine.

        Raises:
            NoAdvice: the timing failed.
        """
        wanted = [(name, PLAIN, k) for name in names for k in self.ladder]
        tried = self.attempts(wanted, purpose, bound)
        by_engine = {name: [one for one in tried if one.name == name] for name in names}
        keeping, partly, unsteady = self.confirmed(
            [rest for each in by_engine.values() if (rest := those_that_keep(each, bound))],
            purpose,
            bound,
        )
        at = {one.name: one.substeps for one in keeping}
        optional = self.attempts(
            [(x.engine, x.change, at[x.engine]) for x in OPTIONS if x.engine in at], purpose, bound
        )
        able, _ = self.to_the_end(self.from_every_start(optional, purpose, bound, FOURTH))
        priced, differences, busy = self.timed([*keeping, *able])
        plain = {one.name: one for one in priced if one.change == PLAIN}
        ended = {one.name for one in (*keeping, *partly)}
        advice = Advice(
            self.scenario.name,
            purpose,
            bound,
            self.scenario.duration,
            open_scene(self.scene, self.seed).duration,
            len(scored(self.scene, self.seed).truth.collisions),
            [self.scenario.dt(k) for k in self.ladder],
            sorted(plain.values(), key=lambda one: one.cost),
            self.out_of_reach(
                [each for name, each in by_engine.items() if name not in ended],
                {one.name: one for one in unsteady},
                purpose,
                bound,
            ),
            partly,
            [ChangedOption(plain[one.name], one) for one in priced if one.change != PLAIN],
            float(np.percentile([*differences.values()], 75)) if differences else nan,
            busy,
        )
        if purpose == STATISTICS or any(one.is_library for one in keeping):
            return advice
        libraries = [name for name, (first, *_) in by_engine.items() if first.is_library]
        also = self.advice(STATISTICS, bound, libraries) if libraries else None
        return replace(advice, statistics=also)

    def attempts(
        self, asked: Iterable[tuple[str, str, int]], purpose: str, bound: float
    ) -> list[Attempt]:
        """(`engine:profile`, change, substeps) played, in their order; each in a worker process."""
        dt = self.scenario.dt
        wanted = [Attempt(name, change, k, dt(k), nan) for name, change, k in asked]
        tasks = {
            one.task: partial(play_scene, self.scene, self.seed, purpose, bound, one)
            for one in wanted
        }
        outcomes = self.done(tasks, "playing")
        return [
            replace(one, error=inf, reason=f"{outcome.status}: {outcome.reason}")
            if isinstance(outcome := outcomes[one.task], Failure)
            else outcome
            for one in wanted
        ]

    def from_every_start(
        self, wanted: Sequence[Attempt], purpose: str, bound: float, every: int = 1
    ) -> list[Attempt]:
        """The attempts with their errors from every `every`-th of the starts within a step, and
        until when nine tenths of these keep the bound."""
        tasks = {
            one.task: partial(play_starts, self.scene, self.seed, purpose, bound, one, every)
            for one in wanted
        }
        outcomes = self.done(tasks, f"playing from {STARTS // every} instants of a step")
        return [
            replace(one, starts=(inf,) * STARTS) if isinstance(outcome, Failure) else outcome
            for one in wanted
            for outcome in (outcomes[one.task],)
        ]

    def confirmed(
        self, ladders: Sequence[Sequence[Attempt]], purpose: str, bound: float
    ) -> tuple[list[Attempt], list[Attempt], list[Attempt]]:
        """Of each engine the coarsest of its attempts that is able, as in `to_the_end`, and holds
        from every start: where one fails a verdict, or holds from too few, the next finer one is
        tried. Then those that are never able, the finest tried, and those that never hold."""
        able, unable, unsteady = list[Attempt](), list[Attempt](), list[Attempt]()
        first: dict[str, str] = {}
        while ladders:
            finer = {each[0].name: each[1:] for each in ladders if len(each) > 1}
            passed, failed = self.to_the_end([each[0] for each in ladders])
            again = list[str]()
            for one in self.from_every_start(passed, purpose, bound):
                if one.holds(bound):
                    able.append(one)
                elif one.name in finer:
                    again.append(one.name)
                else:
                    unsteady.append(one)
            for one in failed:
                at_dt = f"{one.reason} (dt {number(one.dt * 1e3)} ms)" if one.broken else one.reason
                coarse = first.setdefault(one.name, at_dt)
                if one.broken and one.name in finer:
                    again.append(one.name)
                else:
                    both = dict.fromkeys((coarse, at_dt))
                    unable.append(replace(one, reason="; ".join(both)))
            ladders = [finer[name] for name in again]
        return able, unable, unsteady

    def to_the_end(self, wanted: Sequence[Attempt]) -> tuple[list[Attempt], list[Attempt]]:
        """The attempts that play the whole scene, beyond the horizon of its exact answer, too, and
        fail no verdict in it; and those that do not, each with the reason."""
        tasks = {one.task: partial(end_of, self.scene, self.seed, one) for one in wanted}
        outcomes = self.done(tasks, "playing to the end")
        able, unable = list[Attempt](), list[Attempt]()
        for one in wanted:
            outcome = outcomes[one.task]
            if isinstance(outcome, Failure):
                outcome = f"{outcome.status}: {outcome.reason}", False
            reason, broken = outcome
            (unable if reason else able).append(replace(one, reason=reason, broken=broken))
        return able, unable

    def timed(
        self, played: Sequence[Attempt]
    ) -> tuple[list[Attempt], dict[tuple[str, int], float], float]:
        """The attempts with their costs in the whole scene; for each engine and step size the
        difference of two timings of the same engine, |log(cost / cost of its copy)|; and the number
        of cores that others used."""
        if not played:
            return [], {}, nan
        makes = {(one.task, one.substeps, 0): one.make for one in played}
        twice = {(one.task, one.substeps, 1): one.make for one in played if one.change == PLAIN}
        task = partial(times_of_whole, self.scene, self.seed, makes | twice)
        busy = busy_cores()
        [(_, samples)] = done({("time",): task}, 1, self.progress, "timing", ALL_ROUNDS)
        if isinstance(samples, Failure):
            raise NoAdvice(f"the timing ended: {samples.status}: {samples.reason}")
        times = summed_up(pd.DataFrame(samples), ["key"])
        cost = dict(zip(times.key, times.cost))
        priced = [replace(one, cost=cost[one.task, one.substeps, 0]) for one in played]
        differences = {
            (one.name, one.substeps): abs(log(cost[one.task, one.substeps, 1] / one.cost))
            for one in priced
            if one.change == PLAIN
        }
        return priced, differences, busy

    def out_of_reach(
        self,
        ladders: Sequence[Sequence[Attempt]],
        unsteady: Mapping[str, Attempt],
        purpose: str,
        bound: float,
    ) -> list[OutOfReach]:
        """What each engine, of which all attempts are given, coarse to fine, comes to; until when
        it keeps the error; and the cause of its error, at the coarsest step that has at most twice
        its least error."""
        best = [min(each, key=lambda x: inf if isnan(x.error) else x.error) for each in ladders]
        usual = [next((x for x in each if x.dt <= self.usual), each[-1]) for each in ladders]
        longest = [max(each, key=lambda one: (reach(one), one.dt)) for each in ladders]
        if purpose in LASTING:
            lasting = dict.fromkeys(one for one in (*usual, *longest) if not isnan(one.until))
            until = {one.task: one for one in self.from_every_start([*lasting], purpose, bound)} | {
                one.task: one for one in unsteady.values()
            }
            usual, longest = ([until.get(x.task, x) for x in each] for each in (usual, longest))
        tasks = {}
        for least, each in zip(best, ladders):
            if isfinite(least.error):
                at = next(one for one in each if one.error <= 2 * least.error)
                bits = row_of(least.name).bits_of or least.name  # what plays the same
                asked = bits, at.substeps, purpose, bound
                tasks[least.task] = partial(cause, self.scene, self.seed, *asked)
        causes = self.done(tasks, "cause of the error", SEARCH)
        rows = []
        for row in zip(best, (each[-1].error for each in ladders), usual, longest):
            name, reason = row[0].name, row[0].reason
            if not reason:
                searched = causes[row[0].task]
                failed = isinstance(searched, Failure)
                reason = "not known: the search for it did not end" if failed else searched
            if name in unsteady:
                count = f"{unsteady[name].kept_in(bound)} of {STARTS}"
                reason = (
                    f"at {number(1e3 * unsteady[name].dt)} ms it keeps the error from {count}"
                    + (f" instants of a step only; {reason}")
                )
            rows.append(OutOfReach(*row, reason))
        return rows

    @property
    def usual(self) -> float:
        """s, the middle step size of the scene."""
        return self.scenario.dt(self.scenario.middle_substeps)

    def done(
        self, tasks: Mapping[Any, Any], what: str, patience: float = PATIENCE
    ) -> dict[Any, Any]:
        """The outcome of each task, from worker processes; each may take `patience` s."""
        return dict(done(tasks, self.workers, self.progress, what, patience))


def reach(one: Attempt) -> float:
    """Sort key: until when it keeps the error."""
    return -inf if isnan(one.until) else one.until


def those_that_keep(ladder: Sequence[Attempt], bound: float) -> list[Attempt]:
    """The attempts, coarse to fine, that keep the error together with all finer ones.

    An attempt that keeps it by chance, with a larger error at a finer step, does not count.
    """
    kept = kept_from(np.array([one.error for one in ladder]), bound)
    return [one for one, keeps in zip(ladder, kept) if keeps]


def play_part(part: Scored, purpose: str, bound: float, one: Attempt) -> Attempt:
    """The attempt with its error in a part of the scene, and until when, s, it keeps the bound."""
    scenario, truth = part
    allow(LOADING)  # a kernel's first compilation is no time of an engine
    run = play_once(one.make, one.name, scenario, one.dt, clocked())
    until = nan
    if run.trajectory is not None and len(run.trajectory) > 1:
        jumps = jumps_of(truth, scenario) if purpose == "energy" else None
        view = beside(scenario, run, truth, jumps)
        until = kept_until(view, purpose, bound) if purpose in LASTING else nan
    if run.status != "ok" or run.trajectory is None:
        return replace(one, error=inf, reason=f"{run.status}: {run.reason}", until=until)
    error = PURPOSES[purpose].error(view)
    reason = "" if not isnan(error) else "too little of it can be judged"
    return replace(one, error=error, reason=reason, until=until)


def play_scene(scene: str, seed: int, purpose: str, bound: float, one: Attempt) -> Attempt:
    """The attempt played from the beginning of the scene up to the horizon."""
    return play_part(scored(scene, seed), purpose, bound, one)


def play_starts(
    scene: str, seed: int, purpose: str, bound: float, one: Attempt, every: int = 1
) -> Attempt:
    """The attempt with its errors from every `every`-th of the starts within a step, and until
    when nine tenths of these keep the bound."""
    errors, until, whole = list[float](), list[float](), scored(scene, seed).scenario.duration
    for begin, part in islice(starts_within_a_step(scene, seed, one.dt), 0, None, every):
        played = play_part(part, purpose, bound, one)
        errors.append(played.error)
        until.append(whole if played.error <= bound else played.until and begin + played.until)
    count = len(errors) - ceil(NINE_TENTHS * len(errors))
    lasting = float(np.sort(np.nan_to_num(until, nan=0.0))[count])
    return replace(one, starts=tuple(errors), lasting=lasting if purpose in LASTING else nan)


def kept_until(view: View, purpose: str, bound: float) -> float:
    """s, the last sample up to which a run keeps the bound; found by bisection, as its error only
    grows."""
    assert view.other is not None
    low, high = 1, len(view.played)  # samples: the start is given
    while low < high:
        k = (low + high + 1) // 2
        early = replace(view, played=cut(view.played, k), other=cut(view.other, k))
        low, high = (low, k - 1) if PURPOSES[purpose].error(early) > bound else (k, high)
    return float(view.played.t[low - 1])


def end_of(scene: str, seed: int, one: Attempt) -> tuple[str, bool]:
    """Why the attempt does not play the whole scene, and how far it gets, or the verdict that it
    fails in it; "" if neither; and whether it is a verdict."""
    scenario = open_scene(scene, seed)
    allow(LOADING)
    run = play_once(one.make, one.name, scenario, one.dt, clocked())
    if run.status == "ok":
        failed = first_failed(run, scenario, scored(scene, seed).truth)
        return (f"{failed.text} at {failed.at:.3g} s", True) if failed else ("", False)
    until = f", up to {run.trajectory.t[-1]:.3g} s" if run.trajectory is not None else ""
    return f"{run.status}{until}: {run.reason}", False


def cause(*asked: Any) -> str:
    """As `cause_of`, with time to compile the ablated reference."""
    allow(LOADING + SEARCH)
    return cause_of(*asked)


def times_of_whole(
    scene: str, seed: int, makes: Mapping[tuple[Any, int, int], Callable[[], Engine]]
) -> list[Sample]:
    """Timing samples, s per simulated second, by (task, substeps, copy), over the whole scene: what
    comes after the horizon of its exact answer may cost more than what comes before."""
    scenario = open_scene(scene, seed)
    what = [
        Timed(key, partial(step_through, make, scenario, key[1]), scenario.duration)
        for key, make in makes.items()
    ]
    return interleaved(what, ROUNDS, BUDGET, seed)
