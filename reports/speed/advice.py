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
from crosscheck2d.reports.compare.view import beside, cut
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
Answer = dict[str, Any]


class NoAdvice(Exception):
    """No advice can be given for the scene; str() says why."""


@dataclass(frozen=True)
class Attempt:
    """One engine at one step size."""

    name: str  # `engine:profile`
    change: str  # a row of `OPTIONS`, or `PLAIN`
    substeps: int  # steps in a sample interval
    dt: float  # s
    error: float = nan  # of the purpose; inf where the run failed, nan where it cannot be judged
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
        return sorted(self.starts)[most_of(self.starts) - 1] if self.starts else nan

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

    def play(self, attempt: Attempt, part: Scored | None = None) -> Attempt:
        """The attempt with its error in a part of the scene, by default in all that has an exact
        answer, and until when, s, it keeps the bound."""
        scenario, truth = part or scored(self.scene, self.seed)
        allow(LOADING)  # a kernel's first compilation is no time of an engine
        run = play_once(attempt.make, attempt.name, scenario, attempt.dt, clocked())
        error, until = PURPOSES[self.purpose].error, nan
        if run.trajectory is not None and len(run.trajectory) > 1:
            jumps = jumps_of(truth, scenario) if self.purpose == "energy" else None
            view = beside(scenario, run, truth, jumps)
            if self.purpose in LASTING:
                low, high = 1, len(view.played)  # samples: the start is given
                while low < high:  # bisection, as the error only grows
                    k = (low + high + 1) // 2
                    early = replace(view, played=cut(view.played, k), other=cut(truth, k))
                    low, high = (low, k - 1) if error(early) > self.bound else (k, high)
                until = float(view.played.t[low - 1])
        if run.status != "ok" or run.trajectory is None:
            failure = f"{run.status}: {run.reason}"
            return replace(attempt, error=inf, reason=failure, until=until)
        value = error(view)
        reason = "too little of it can be judged" if isnan(value) else ""
        return replace(attempt, error=value, reason=reason, until=until)

    def play_starts(self, attempt: Attempt, every: int = 1) -> Attempt:
        """The attempt with its errors from every `every`-th of the starts within a step, and until
        when nine tenths of these keep the bound."""
        errors, until = list[float](), list[float]()
        whole = scored(self.scene, self.seed).scenario.duration
        starts = starts_within_a_step(self.scene, self.seed, attempt.dt)
        for begin, part in islice(starts, 0, None, every):
            played = self.play(attempt, part)
            errors.append(played.error)
            keeps = played.error <= self.bound
            until.append(whole if keeps else played.until and begin + played.until)
        lasting = nan
        if self.purpose in LASTING:
            lasting = float(np.sort(np.nan_to_num(until))[len(until) - most_of(until)])
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


@dataclass(frozen=True)
class Inquiry:
    """Which engine meets a requirement at the least cost."""

    requirement: Requirement
    workers: int
    progress: Progress

    @property
    def ladder(self) -> tuple[int, ...]:
        scenario, _ = scored(self.requirement.scene, self.requirement.seed)
        return doublings(scenario, MOST_WORK // max(scenario.scene.n, FEW))

    def advise(self, names: Sequence[str]) -> Answer:
        """Which of the engines `names` keeps the error at the least cost: what `--json` prints,
        with nan or inf for what is not a number there.

        Every engine is played at every step size of the scene's ladder, up to the horizon of the
        exact answer. Those that keep the error play the whole scene, and from several instants of
        a step; then they are timed, together with their options, alone on the machine.

        The answer has, among others:
            cheapest_first: for every engine that keeps the error and plays the whole scene without
                failing a verdict, the coarsest step size that does from nine tenths of the starts
                within a step, too, and keeps the error at every finer one; the libraries first.
            not_within: the engines that do not keep it.
            not_to_the_end: those that keep it where it is judged, but do not play the whole scene,
                or fail a verdict in it at every step size that keeps it.
            changes: of the engines that keep it, one option at a time; medians: the errors without
                the change and with it, over the starts that both were played from.
            noise: the upper quartile of |log(cost / cost of its own copy)| over the engines.
            cores_busy: by others when the timing began.
            statistics: the answer for averages over time, where no library keeps the error.

        Raises:
            NoAdvice: the scene has no exact answer, or the timing failed.
        """
        scene, seed, purpose, bound = self.requirement
        try:
            scenario, truth = scored(scene, seed)
        except NoTruth as refusal:
            raise NoAdvice(
                f"no exact answer: {refusal}. To compare the engines with each other and with the"
                f" laws of physics: crosscheck run {shlex.quote(scene)}"
            ) from refusal
        tried = self.attempts((name, PLAIN, k) for name in names for k in self.ladder)
        ladders = {name: [each for each in tried if each.name == name] for name in names}
        able = [rest for each in ladders.values() if (rest := those_that_keep(each, bound))]
        keeping, partly, unsteady = self.confirmed(able)
        at = {attempt.name: attempt.substeps for attempt in keeping}
        changed = (x for x in OPTIONS if x.engine in at)
        optional = self.attempts((x.engine, x.change, at[x.engine]) for x in changed)
        options, _ = self.to_the_end(self.from_every_start(optional, FOURTH))
        priced, differences, busy = self.timed([*keeping, *options])
        noise = float(np.percentile([*differences.values()], 75)) if differences else nan
        plain = {attempt.name: attempt for attempt in priced if attempt.change == PLAIN}
        ended = {attempt.name for attempt in (*keeping, *partly)}
        others = {name: ladder for name, ladder in ladders.items() if name not in ended}
        floor = floor_of(noise, busy)
        answer = {
            "scenario": scenario.name,
            "purpose": purpose,
            "error_at_most": bound,
            "until_s": scenario.duration,
            "duration_s": open_scene(scene, seed).duration,
            "collisions_judged": len(truth.collisions),
            "dt_s_tried": [scenario.dt(k) for k in self.ladder],
            "cheapest_first": ranked_rows([*plain.values()], bound, floor),
            "not_within": self.out_of_reach(others, {each.name: each for each in unsteady}),
            "not_to_the_end": [as_row(each) | {"why": each.reason} for each in partly],
            "changes": [
                change_row(plain[each.name], each, bound, floor)
                for each in priced
                if each.change != PLAIN
            ],
            "noise": noise,
            "cores_busy": busy,
            "statistics": None,
        }
        libraries = [name for name, (first, *_) in ladders.items() if first.is_library]
        if purpose != STATISTICS and libraries and not at.keys() & set(libraries):
            averages = replace(self, requirement=self.requirement._replace(purpose=STATISTICS))
            answer["statistics"] = averages.advise(libraries)
        return answer

    def attempts(self, asked: Iterable[tuple[str, str, int]]) -> list[Attempt]:
        dt = scored(self.requirement.scene, self.requirement.seed).scenario.dt
        wanted = [Attempt(name, change, k, dt(k)) for name, change, k in asked]
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
                at_dt = f" (dt {number(attempt.dt * 1e3)} ms)" if attempt.broken else ""
                reason = attempt.reason + at_dt
                coarse = first.setdefault(attempt.name, reason)
                if attempt.broken and attempt.name in finer:
                    again.append(attempt.name)
                else:
                    both = dict.fromkeys((coarse, reason))
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
        plain = [attempt for attempt in played if attempt.change == PLAIN]
        copies = [(attempt, 0) for attempt in played] + [(attempt, 1) for attempt in plain]
        makes = {(each.task, each.substeps, copy): each.make for each, copy in copies}
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
            (each.name, each.substeps): abs(
                log(cost[each.task, each.substeps, 1] / cost[each.task, each.substeps, 0])
            )
            for each in plain
        }
        return priced, differences, busy

    def out_of_reach(
        self, ladders: Mapping[str, Sequence[Attempt]], unsteady: Mapping[str, Attempt]
    ) -> list[Answer]:
        """A row for each engine, of which all attempts are given, coarse to fine: its least error;
        until when it keeps the error, at the usual step size and at the one that keeps it longest;
        and the cause of its error, at the coarsest step that has at most twice the least."""
        scenario, _ = scored(self.requirement.scene, self.requirement.seed)
        dt, bound = scenario.dt(scenario.middle_substeps), self.requirement.bound
        best, usual, longest, tasks = {}, {}, {}, {}
        for name, ladder in ladders.items():
            best[name] = min(ladder, key=lambda x: inf if isnan(x.error) else x.error)
            usual[name] = next((x for x in ladder if x.dt <= dt), ladder[-1])
            longest[name] = max(ladder, key=lambda x: (-inf if isnan(x.until) else x.until, x.dt))
            if isfinite(least := best[name].error):
                at = next(attempt for attempt in ladder if attempt.error <= 2 * least)
                bits = row_of(name).bits_of or name  # what plays the same
                tasks[best[name].task] = partial(self.requirement.find_cause, bits, at.substeps)
        from_starts: dict[Any, Attempt] = {}
        if self.requirement.purpose in LASTING:
            both = (pair for name in ladders for pair in (usual[name], longest[name]))
            lasting = dict.fromkeys(attempt for attempt in both if not isnan(attempt.until))
            played = self.from_every_start([*lasting])
            from_starts = {attempt.task: attempt for attempt in (*played, *unsteady.values())}
        causes = do_all(tasks, self.workers, self.progress, "cause of the error", SEARCH)
        rows = []
        for name, ladder in ladders.items():
            reason = best[name].reason
            if not reason:
                reason = causes[best[name].task]
                if isinstance(reason, Failure):
                    reason = "not known: the search for it did not end"
            if name in unsteady:
                reason = (
                    f"at {number(1e3 * unsteady[name].dt)} ms it keeps the error from"
                    f" {unsteady[name].kept_in(bound)} of {STARTS} instants of a step only;"
                    f" {reason}"
                )
            row = as_row(best[name]) | {"error_at_finest": ladder[-1].error}
            for what, attempt in (("", usual[name]), ("longest_", longest[name])):
                attempt = from_starts.get(attempt.task, attempt)
                kept = what or "kept_"
                row |= {f"{kept}until_s": attempt.until, f"{what}at_dt_s": attempt.dt}
                row |= {f"{kept}from_nine_tenths_until_s": attempt.lasting}
            rows.append(row | {"why": reason})
        return rows


def most_of(starts: Sequence[float]) -> int:
    return ceil(NINE_TENTHS * len(starts))


def as_row(attempt: Attempt) -> Answer:
    return {
        "engine": attempt.name,
        "library": attempt.is_library,
        "dt_s": attempt.dt,
        "error": attempt.error,
        "us_per_simulated_s": attempt.cost * 1e6,
    }


def floor_of(noise: float, busy: float) -> float:
    """The fraction by which two costs must differ to be compared; inf where none can be."""
    return max(noise, LOUD) if noise <= LOUD and not busy > BUSY else inf


def ranked_rows(keeping: Iterable[Attempt], bound: float, floor: float) -> list[Answer]:
    """The libraries first, the cheapest first: those that cost at most `floor` more than the first
    of a rank have the same rank."""
    rows = []
    for library in (True, False):
        rank, least = 0, -inf
        group = sorted((x for x in keeping if x.is_library is library), key=lambda x: x.cost)
        for k, attempt in enumerate(group, 1):
            if not attempt.cost <= least * (1 + floor):
                rank, least = k, attempt.cost
            row = as_row(attempt) | {"rank": rank, "error_of_nine_tenths": attempt.usually}
            rows.append(row | {"kept_in": attempt.kept_in(bound), "starts": len(attempt.starts)})
    return rows


def change_row(plain: Attempt, changed: Attempt, bound: float, floor: float) -> Answer:
    """An engine with a change of an option against it without, at the same step size; the verdict
    is on the error, or else on the cost, if it changes by more than the fraction `floor`."""
    every = len(plain.starts) // len(changed.starts)
    before, after = float(np.median(plain.starts[::every])), float(np.median(changed.starts))
    ratio = changed.cost / plain.cost
    if not changed.holds(bound):
        verdict = TOO_FAR_OFF
    elif ratio < 1 - floor:
        verdict = SAVES_TIME
    elif after <= HALF * before:
        verdict = NEARER
    else:
        verdict = NO_GAIN if isfinite(floor) else NOT_COMPARED
    row = as_row(changed) | {"change": changed.change, "error_without": plain.error}
    return row | {"cost_ratio": ratio, "verdict": verdict, "medians": [before, after]}


def those_that_keep(ladder: Sequence[Attempt], bound: float) -> list[Attempt]:
    """The attempts, coarse to fine, that keep the error together with all finer ones. One that
    keeps it by chance, with a larger error at a finer step, does not count."""
    keeps = kept_from(np.array([attempt.error for attempt in ladder]), bound)
    return [attempt for attempt, keep in zip(ladder, keeps) if keep]
