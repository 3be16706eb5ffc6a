"""The cheapest engine and step size that keep a given error in one scene, and the engine options
that the scene does not need: all measured in runs of the scene itself."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf, isfinite, isnan, log, nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.options import OPTIONS
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.pareto import kept_from
from crosscheck2d.reports.compare.verdicts import first_failed
from crosscheck2d.reports.compare.view import beside
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.machine import busy_cores
from crosscheck2d.reports.run.pool import Failure
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.stepping import Stepping
from crosscheck2d.reports.run.timing import Sample, Timed, interleaved
from crosscheck2d.reports.speed.causes import cause_of
from crosscheck2d.reports.speed.effort import doublings
from crosscheck2d.reports.speed.measure import done
from crosscheck2d.reports.speed.plan import PLAIN
from crosscheck2d.reports.speed.purposes import PURPOSES
from crosscheck2d.reports.speed.scored_part import scored
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
TOO_FAR_OFF, SAVES_TIME, NEARER, NO_GAIN = "too far off", "saves time", "more accurate", "no gain"
NOT_COMPARED = "times not compared"
ONLY_HERE = "only at this dt"
# Times are not compared if the noise, or the number of cores kept busy by others, is above these.
# An option is timed in separate runs, so that less than a tenth cannot be resolved on a quiet
# machine.
LOUD, BUSY = 0.1, 0.5
HALF = 0.5  # with at most this part of the error an option counts as more accurate


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
        cost: s per simulated second, nan where not timed.
        broken: whether it failed by a verdict.
    """

    name: str
    change: str
    substeps: int
    dt: float
    error: float
    reason: str = ""
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

    def keeps(self, bound: float) -> bool:
        """Whether its error is known and at most `bound`."""
        return self.error <= bound


class ChangedOption(NamedTuple):
    """An engine with one option changed, and the engine without the change, at the same step
    size; and the errors (without, with) at the next coarser and the next finer one."""

    plain: Attempt
    changed: Attempt
    nearby: Sequence[tuple[float, float]] = ()

    def verdict(self, bound: float, floor: float) -> str:
        """The effect of the change: on the error, or else on the cost, if the cost changes by more
        than the fraction `floor`; inf where costs cannot be compared.

        The error of a single step size depends on where in a step each collision falls: it counts
        as smaller only if it is smaller at the neighbouring step sizes, too.
        """
        ratio = self.changed.cost / self.plain.cost
        if not self.changed.keeps(bound):
            return TOO_FAR_OFF
        if ratio < 1 - floor:
            return SAVES_TIME
        if self.changed.error > HALF * self.plain.error:
            return NO_GAIN if isfinite(floor) else NOT_COMPARED
        return NEARER if all(new <= HALF * old for old, new in self.nearby) else ONLY_HERE


class OutOfReach(NamedTuple):
    """An engine that does not keep the error: its best attempt, its error at the finest step size,
    and the reason."""

    best: Attempt
    finest: float
    why: str


@dataclass(frozen=True)
class Advice:
    """The result of `Inquiry.advice`.

    Attributes:
        scene: the name of the scene.
        until, duration: s, up to where errors are judged, and how long the scene is.
        collisions: how many of the exact answer are judged.
        step_sizes: s, those that were tried, coarse to fine.
        keeping: for every engine that keeps the error, and plays the whole scene without failing a
            verdict, the coarsest step size at which it does, and keeps the error at every finer
            one; cheapest first.
        short: the engines that do not keep it.
        partial: those that keep it where it is judged, but do not play the whole scene, or fail a
            verdict in it at every step size that keeps it; with the reason.
        changes: options of the engines that keep it, changed one at a time.
        noise: the upper quartile of |log(cost / cost of its own copy)| over the engines.
        busy: cores that others kept busy when the timing began; nan where unknown.
    """

    scene: str
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


@dataclass(frozen=True)
class Inquiry:
    """What is asked about a scene: which engine keeps an error of `purpose`, a key of `PURPOSES`,
    at the least cost. `scenario` and `truth`: see `scored`.

    Raises:
        NoAdvice: the scene has no exact answer.
    """

    scene: str
    seed: int
    purpose: str
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

    def advice(self, bound: float, names: Sequence[str]) -> Advice:
        """Which of the engines `names` keeps the error within `bound` at the least cost.

        Every engine is played at every step size of the scene's ladder, up to the horizon of the
        exact answer. Those that keep the error play the whole scene and are timed in it, together
        with their options, alone on the machine.

        Raises:
            NoAdvice: the timing failed.
        """
        ladder, scenario = self.ladder, self.scenario
        tried = self.attempts([(name, PLAIN, k) for name in names for k in ladder])
        by_engine = {name: [one for one in tried if one.name == name] for name in names}
        kept = {name: those_that_keep(each, bound) for name, each in by_engine.items()}
        keeping, partly = self.first_to_the_end([each for each in kept.values() if each])
        at = {one.name: one.substeps for one in keeping}
        optional = self.attempts(
            [
                (option.engine, option.change, k)
                for name in at
                for option in OPTIONS
                if option.engine == name
                for k in (*neighbours(at[name], ladder), at[name])
            ]
        )
        able, _ = self.to_the_end([one for one in optional if one.substeps == at[one.name]])
        priced, differences, busy = self.timed([*keeping, *able])
        plain = {one.name: one for one in priced if one.change == PLAIN}
        error_at = {one.task: one.error for one in (*tried, *optional)}
        return Advice(
            scenario.name,
            scenario.duration,
            open_scene(self.scene, self.seed).duration,
            len(scored(self.scene, self.seed).truth.collisions),
            [scenario.dt(k) for k in ladder],
            sorted(plain.values(), key=lambda one: one.cost),
            self.reasons([each for name, each in by_engine.items() if not kept[name]], bound),
            partly,
            [
                ChangedOption(plain[one.name], one, errors_nearby(one, ladder, error_at))
                for one in priced
                if one.change != PLAIN
            ],
            float(np.percentile([*differences.values()], 75)) if differences else nan,
            busy,
        )

    def attempts(self, asked: Iterable[tuple[str, str, int]]) -> list[Attempt]:
        """(`engine:profile`, change, substeps) played, in their order; each in a worker process."""
        dt = self.scenario.dt
        wanted = [Attempt(name, change, k, dt(k), nan) for name, change, k in asked]
        tasks = {
            one.task: partial(error_of, self.scene, self.seed, self.purpose, one) for one in wanted
        }
        outcomes = self.done(tasks, "playing")
        return [
            replace(one, error=inf, reason=f"{outcome.status}: {outcome.reason}")
            if isinstance(outcome := outcomes[one.task], Failure)
            else replace(one, error=outcome[0], reason=outcome[1])
            for one in wanted
        ]

    def first_to_the_end(
        self, ladders: Sequence[Sequence[Attempt]]
    ) -> tuple[list[Attempt], list[Attempt]]:
        """Of each engine the coarsest of its attempts that is able, as in `to_the_end`: where one
        fails a verdict the next finer one is tried. Of those that never are the finest tried."""
        able: list[Attempt] = []
        unable: list[Attempt] = []
        first: dict[str, str] = {}
        while ladders:
            passed, failed = self.to_the_end([each[0] for each in ladders])
            finer = {each[0].name: each[1:] for each in ladders if len(each) > 1}
            able += passed
            for one in failed:
                at_dt = f"{one.reason} (dt {number(one.dt * 1e3)} ms)" if one.broken else one.reason
                coarse = first.setdefault(one.name, at_dt)
                if not (one.broken and one.name in finer):
                    both = dict.fromkeys((coarse, at_dt))
                    unable.append(replace(one, reason="; ".join(both)))
            ladders = [finer[one.name] for one in failed if one.broken and one.name in finer]
        return able, unable

    def to_the_end(self, wanted: Sequence[Attempt]) -> tuple[list[Attempt], list[Attempt]]:
        """The attempts that play the whole scene, beyond the horizon of its exact answer, too, and
        fail no verdict in it; and those that do not, each with the reason."""
        tasks = {one.task: partial(end_of, self.scene, self.seed, one) for one in wanted}
        outcomes = self.done(tasks, "playing to the end")
        able: list[Attempt] = []
        partly: list[Attempt] = []
        for one in wanted:
            outcome = outcomes[one.task]
            if isinstance(outcome, Failure):
                outcome = f"{outcome.status}: {outcome.reason}", False
            why, broken = outcome
            (partly if why else able).append(replace(one, reason=why, broken=broken))
        return able, partly

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

    def reasons(self, ladders: Sequence[Sequence[Attempt]], bound: float) -> list[OutOfReach]:
        """What each engine, of which all attempts are given, coarse to fine, comes to; and the
        cause of its error, at the coarsest step that has at most twice its least error."""
        best = [min(each, key=smallest) for each in ladders]
        tasks = {}
        for least, each in zip(best, ladders):
            if isfinite(least.error):
                at = next(one for one in each if one.error <= 2 * least.error)
                asked = played_as(least.name), at.substeps, self.purpose, bound
                tasks[least.task] = partial(cause_of, self.scene, self.seed, *asked)
        causes = self.done(tasks, "cause of the error", SEARCH)
        unknown = "not known: the search for it did not end"
        return [
            OutOfReach(
                one,
                each[-1].error,
                one.reason
                or (unknown if isinstance(causes[one.task], Failure) else causes[one.task]),
            )
            for one, each in zip(best, ladders)
        ]

    def done(
        self, tasks: Mapping[Any, Any], what: str, patience: float = PATIENCE
    ) -> dict[Any, Any]:
        """The outcome of each task, from worker processes; each may take `patience` s."""
        return dict(done(tasks, self.workers, self.progress, what, patience))


def neighbours(substeps: int, ladder: Sequence[int]) -> list[int]:
    """The next coarser and the next finer step size of the ladder, those that there are."""
    k = ladder.index(substeps)
    return [*ladder[max(k - 1, 0) : k], *ladder[k + 1 : k + 2]]


def errors_nearby(
    one: Attempt, ladder: Sequence[int], error_at: Mapping[tuple[str, str, int], float]
) -> list[tuple[float, float]]:
    """The errors of the engine without a change and with it, at the neighbouring step sizes."""
    return [
        (error_at[one.name, PLAIN, k], error_at[one.name, one.change, k])
        for k in neighbours(one.substeps, ladder)
    ]


def smallest(one: Attempt) -> float:
    """Sort key: the error; an attempt that failed or cannot be judged comes last."""
    return one.error if isfinite(one.error) else inf


def those_that_keep(ladder: Sequence[Attempt], bound: float) -> list[Attempt]:
    """The attempts, coarse to fine, that keep the error together with all finer ones.

    An attempt that keeps it by chance, with a larger error at a finer step, does not count.
    """
    kept = kept_from(np.array([one.error for one in ladder]), bound)
    return [one for one, keeps in zip(ladder, kept) if keeps]


def error_of(scene: str, seed: int, purpose: str, one: Attempt) -> tuple[float, str]:
    """The error of one run up to the horizon; inf and the reason if it failed."""
    scenario, truth = scored(scene, seed)
    run = play_once(one.make, one.name, scenario, one.dt)
    if run.status != "ok" or run.trajectory is None:
        return inf, f"{run.status}: {run.reason}"
    error = PURPOSES[purpose].error(beside(scenario, run, truth, jumps_of(truth, scenario)))
    return error, "" if not isnan(error) else "too little of it can be judged"


def end_of(scene: str, seed: int, one: Attempt) -> tuple[str, bool]:
    """Why the attempt does not play the whole scene, and how far it gets, or the verdict that it
    fails in it; "" if neither; and whether it is a verdict."""
    scenario = open_scene(scene, seed)
    run = play_once(one.make, one.name, scenario, one.dt)
    if run.status == "ok":
        failed = first_failed(run, scenario, scored(scene, seed).truth)
        return (f"{failed.text} at {failed.at:.3g} s", True) if failed else ("", False)
    until = f", up to {run.trajectory.t[-1]:.3g} s" if run.trajectory is not None else ""
    return f"{run.status}{until}: {run.reason}", False


def times_of_whole(
    scene: str, seed: int, makes: Mapping[tuple[Any, int, int], Callable[[], Engine]]
) -> list[Sample]:
    """Timing samples, s per simulated second, by (task, substeps, copy), over the whole scene: what
    comes after the horizon of its exact answer may cost more than what comes before."""
    scenario = open_scene(scene, seed)
    what = [
        Timed(key, Stepping(make, scenario, key[1]), scenario.duration)
        for key, make in makes.items()
    ]
    return interleaved(what, ROUNDS, BUDGET, seed)


def played_as(name: str) -> str:
    """The engine whose bits this engine gives in the scene, which may be itself."""
    return row_of(name).bits_of or name
