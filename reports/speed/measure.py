"""The two passes of a measurement: first the errors, in parallel; then the costs, one after the
other with nothing else running. A result is stored as its task ends, so that an interruption loses
none."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from itertools import groupby
from math import inf, nan
from time import perf_counter
from typing import Any

import pandas as pd

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.reports.run.cells import busy_cores, digest, source_hash
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.run.timing import Sample
from crosscheck2d.reports.speed import budget, ladder, sizes
from crosscheck2d.reports.speed.plan import PLAIN, SCENE, Measurement, SpeedPlan, middle
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM, answered_by

# s, limits for a ladder and for a timing: they only stop engines that hang
HANGS, ALL_ROUNDS = 600.0, 3600.0
SIZE, WORST_STEP, IN_PILE, TRUTH = "size", "worst step", "pile", "truth"
SLEEPING = "sleeping"  # the option of engines that may let disks sleep
NUMBERS = {"dt_s": float, "n": int, "copy_of": int, "round": int, "place": int}
NUMBERS |= {"cost": float, "wrapping": float, "runs": int}
COLUMNS = ["kind", "engine", "profile", "scenario", "change", *NUMBERS]  # of samples
SOURCE = ("reports/speed/*.py", "reports/compare/*.py", "reports/run/*.py", "scenarios/**/*.py")
TASK = "measurement"  # the kind of the rows in the store
TRUTH_RUNS = 20  # of a closed form


class Kept:
    """The results of tasks: those of an earlier measurement of the same plan, and new ones as they
    come. A task is a tuple of strings and whole numbers, a result what JSON can hold.

    Attributes:
        first: when the first of the results that were used was measured.
    """

    def __init__(self, store: Store, plan: Mapping[str, Any]) -> None:
        """`plan`: all that decides the results: the request, versions and machine."""
        self.store, self.plan = store, json.dumps([plan, source_hash(SOURCE)], sort_keys=True)
        self.first = now()

    def key(self, task: tuple[Any, ...]) -> str:
        return digest(f"{self.plan} {json.dumps(task)}".encode())

    def get(self, task: tuple[Any, ...]) -> Any:
        row = self.store.get(TASK, self.key(task))
        if row is None:
            return None
        self.first = min(self.first, row.value["at"])
        return row.value["result"]

    def add(self, task: tuple[Any, ...], result: Any) -> None:
        self.store.put(TASK, self.key(task), {"at": now(), "result": result})


def now() -> str:
    # in the form of `started` of a header, with which it is compared
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def samples_table(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=COLUMNS).astype(NUMBERS)


@dataclass
class Measured:
    """Everything that was measured, one number a row.

    samples: kind, scenario, engine, profile, change, dt_s, n, copy_of, round, place, cost,
        wrapping, runs; cost in s per simulated second in a scene, in s a step for sizes; of the
        kinds of `stepping.overheads` in s each.
    """

    # kind, change, and the columns of `ladder.errors_of`
    errors: pd.DataFrame = field(default_factory=pd.DataFrame)
    budget: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=budget.COLUMNS))
    samples: pd.DataFrame = field(default_factory=lambda: samples_table([]))
    truths: pd.DataFrame = field(default_factory=pd.DataFrame)  # rows of `closed_form`
    left_out: list[tuple[str, str]] = field(default_factory=list)  # what, reason
    # (`engine:profile`, number of disks) -> why it was not measured with so many
    stopped: dict[tuple[str, int], str] = field(default_factory=dict)
    busy: float = nan  # cores that others kept busy when the timing began


@dataclass
class Measuring:
    """A measurement under way; results `kept` from an interrupted one are not measured again."""

    plan: SpeedPlan
    progress: Progress
    kept: Kept | None = None
    measured: Measured = field(default_factory=Measured)

    def run(self) -> Measured:
        # in workers, which can be stopped at any time
        tasks = {seeded: partial(ladder.reason_of, *seeded) for seeded in self.plan.seeded_scenes}
        reasons = do_all(tasks, self.plan.workers, self.progress, "exact answer")
        for (scene, seed), reason in reasons.items():
            if reason:
                reason = reason.reason if isinstance(reason, Failure) else reason
                left_out = f"{scene}, seed {seed}", f"no exact answer: {reason}"
                self.measured.left_out.append(left_out)
        answered = [seeded for seeded, reason in reasons.items() if not reason]
        measurements = list(self.plan.measurements(answered))
        if any(measurement.kind == SCENE for measurement in measurements):
            played = self.measure_errors(measurements)
            self.measure_budget([scene for scene, seed in answered if seed == self.plan.seed])
            self.measure_times(played)
        return self.measured

    def measure_errors(self, measurements: Sequence[Measurement]) -> list[Measurement]:
        """The errors of all engines; returns those of the first seed at the steps that were played
        to the end."""
        workers = self.plan.workers
        tasks = {measurement.task: measurement.errors for measurement in measurements}
        results = do_all(tasks, workers, self.progress, "error", kept=self.kept)
        rows: list[dict[str, Any]] = []
        played = []
        for measurement in measurements:
            result = results[measurement.task]
            if isinstance(result, Failure):
                result = one_step_size_at_a_time(measurement, workers)
            kind = {"kind": measurement.kind, "change": measurement.change}
            rows += (kind | row for row in result)
            if measurement.seed == self.plan.seed:
                well = tuple(r["substeps"] for r in result if r["status"] in ("ok", ladder.FAILS))
                played.append(measurement._replace(step_sizes=well))
        self.measured.errors = pd.DataFrame(rows)
        return played

    def measure_budget(self, answered: Sequence[str]) -> None:
        tasks = {
            ("budget", scene, name): partial(
                budget.budget_of, scene, self.plan.seed, name, middle(scene)
            )
            for scene in self.plan.effort.budget_scenes
            for name in self.plan.engines
            if name in MECHANISMS and scene in answered
        }
        results = do_all(tasks, self.plan.workers, self.progress, "error budget", kept=self.kept)
        ended = self.without_failures("error budget", results)
        rows = [row for task in tasks for row in ended.get(task, ())]
        self.measured.budget = pd.DataFrame(rows, columns=budget.COLUMNS)

    def measure_times(self, played: Sequence[Measurement]) -> None:
        self.measured.busy = busy_cores()
        tasks = timings(self.plan, played)
        results = do_all(tasks, 1, self.progress, "time", ALL_ROUNDS, self.kept)
        rows: list[dict[str, Any]] = []
        truths = []
        for (_, kind, *_), result in self.without_failures("timing", results).items():
            if kind == TRUTH:
                truths.append(result)
            elif kind == SIZE:
                rows += result["samples"]
                self.measured.stopped = {(name, n): reason for name, n, reason in result["stopped"]}
            else:
                rows += result
        self.measured.samples = samples_table(rows)
        self.measured.truths = pd.DataFrame(truths)

    def without_failures(self, what: str, results: Mapping[Any, Any]) -> dict[Any, Any]:
        for task, result in results.items():
            if isinstance(result, Failure):
                reason = f"{result.status}: {result.reason}"
                self.measured.left_out.append((f"{what} of {' '.join(task[1:])}", reason))
        return {task: x for task, x in results.items() if not isinstance(x, Failure)}


def one_step_size_at_a_time(measurement: Measurement, workers: int) -> list[dict[str, Any]]:
    """A ladder whose worker died or hung, played again one step size at a time, so that the
    other step sizes are kept."""
    rows: list[dict[str, Any]] = []
    steps = measurement.step_sizes
    alone: dict[Hashable, Any] = {k: measurement._replace(step_sizes=(k,)).errors for k in steps}
    for k, result in run_all(alone, workers, HANGS):
        if isinstance(result, Failure):
            where = measurement.scene, measurement.seed, measurement.name, k
            result = [ladder.error_row(*where, result.status, result.reason)]
        rows += result
    return sorted(rows, key=lambda row: row["substeps"])


def timings(
    plan: SpeedPlan, played: Sequence[Measurement]
) -> dict[tuple[Any, ...], Callable[[], Any]]:
    """The tasks of the second pass: all measurements of one kind in one scene are one task,
    because they are compared with each other."""
    repeats: dict[str, Any] = {"rounds": plan.effort.rounds, "budget": plan.effort.budget}
    tasks: dict[tuple[Any, ...], Callable[[], Any]] = {}
    for (kind, scene), group in groupby(played, key=lambda measurement: measurement[:2]):
        # on a ladder each takes part twice at its middle dt, which gives the noise floor
        engines = {
            ((measurement.name, measurement.change), k, copy): measurement.make
            for measurement in group
            for place, k in enumerate(measurement.step_sizes)
            for copy in range(1 + (kind == SCENE and place == len(measurement.step_sizes) // 2))
        }
        tasks["time", kind, scene] = partial(scene_rows, kind, scene, plan.seed, engines, repeats)
        if kind == SCENE:
            tasks["time", TRUTH, scene] = partial(closed_form, scene, plan.seed)
    if plan.effort.sizes:
        tasks["time", SIZE] = partial(size_rows, plan, repeats)
    return tasks


def scene_rows(
    kind: str, scene: str, seed: int, engines: Mapping[Any, Any], repeats: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Rows of `Measured.samples` of engines by ((name, change), substeps, copy); where these are of
    a scene's ladders, of what is measured beside their steps, too."""
    scenario = open_scene(scene, seed)
    rows = []
    also = {name: make for ((name, _), _, _), make in engines.items()} if kind == SCENE else {}
    for sample in ladder.times_of(scene, seed, engines, **repeats, also=also):
        if len(sample.key) == 2:
            name, what = sample.key
            rows.append(sample_row(what, name, sample, scenario=scenario.name))
        else:
            (name, change), k, copy = sample.key
            whose = {"scenario": scenario.name, "change": change, "dt_s": scenario.dt(k)}
            rows.append(sample_row(kind, name, sample, **whose, copy_of=copy))
    return rows


def size_rows(plan: SpeedPlan, repeats: Mapping[str, Any]) -> dict[str, list[Any]]:
    """samples: rows of `Measured.samples` for every number of disks, the worst step with it, and
    the settled piles; stopped: (name, disks, reason)."""
    engines = {name: row_of(name) for name in plan.engines}
    makes = {name: row.make for name, row in engines.items()}
    steps, worst, stopped = sizes.costs(
        makes, plan.effort.sizes, patience=plan.effort.patience, seed=plan.seed, **repeats
    )
    piles = {
        (name, change): partial(row.make, **settings)
        for name, row in engines.items()
        if SLEEPING in row.options
        for change, settings in ((PLAIN, {}), (SLEEPING, row.options[SLEEPING]))
    }
    rows = [
        sample_row(kind, sample.key[0], sample, n=sample.key[1])
        for kind, samples in ((SIZE, steps), (WORST_STEP, worst))
        for sample in samples
    ]
    rows += [
        sample_row(IN_PILE, sample.key[0], sample, n=sizes.PILE, change=sample.key[1])
        for sample in sizes.pile_costs(piles, seed=plan.seed, **repeats)
    ]
    return {"samples": rows, "stopped": [(*key, reason) for key, reason in stopped.items()]}


def sample_row(kind: str, name: str, sample: Sample, **identity: Any) -> dict[str, Any]:
    engine, profile = name.split(":")
    row: dict[str, Any] = {"kind": kind, "engine": engine, "profile": profile}
    row |= {"scenario": "", "change": PLAIN, "dt_s": nan, "n": 0, "copy_of": 0} | identity
    return row | {name: value for name, value in sample._asdict().items() if name != "key"}


def closed_form(scene: str, seed: int) -> dict[str, Any]:
    """scenario, truth (the kind of its exact answer) and closed_us: µs per simulated second to
    compute a closed form. An answer computed in many digits is cached on disk, so its cost cannot
    be measured by asking again."""
    scenario = ladder.scored(scene, seed).scenario
    model, cost = answered_by(scenario), nan
    if model == CLOSED_FORM and scenario.truth is not None:
        ends = scenario.times[[0, -1]]  # an engine is not read on the way either
        best = inf
        for _ in range(TRUTH_RUNS):
            started = perf_counter()
            scenario.truth(ends)
            best = min(best, perf_counter() - started)
        cost = best / scenario.duration * 1e6
    return {"scenario": scenario.name, "truth": model, "closed_us": cost}


def do_all(
    tasks: Mapping[Any, Callable[[], Any]],
    workers: int,
    progress: Progress,
    what: str,
    patience: float = HANGS,
    kept: Kept | None = None,
) -> dict[Any, Any]:
    """Task -> its result or `Failure`, the kept ones first, then new ones as they come."""
    known: dict[Hashable, Any] = {task: kept.get(task) for task in tasks} if kept else {}
    results = {task: result for task, result in known.items() if result is not None}
    missing = {task: do for task, do in tasks.items() if task not in results}
    if missing:
        progress.start(len(missing), len(tasks), what)
    for task, result in run_all(missing, workers, patience) if missing else ():
        failed = isinstance(result, Failure)
        if kept is not None and not failed:
            kept.add(task, result)
        label = " ".join(str(part) for part in task if part not in (what, PLAIN))
        progress.done(f"{what}: {label}", *(result[:2] if failed else ("ok", "")))
        results[task] = result
    return results
