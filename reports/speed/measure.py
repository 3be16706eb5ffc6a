"""The two passes of a measurement: first the errors, in parallel; then the costs, one after the
other with nothing else running."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, groupby
from math import nan
from typing import Any

import pandas as pd

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.reports.run.cells import busy_cores
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.timing import Sample
from crosscheck2d.reports.speed import budget, cheapest, ladder, scored_part, sizes
from crosscheck2d.reports.speed.estimate import estimate
from crosscheck2d.reports.speed.kept import Kept
from crosscheck2d.reports.speed.plan import PLAIN, SCENE, Measurement, Reach, SpeedPlan, middle
from crosscheck2d.reports.terminal.progress import Progress

# s, limits for a ladder and for a timing: they only stop engines that hang
HANGS, ALL_ROUNDS = 600.0, 3600.0
SIZE, WORST_STEP, IN_PILE, TRUTH = "size", "worst step", "pile", "truth"
SLEEPING = "sleeping"  # the option of engines that may let disks sleep
WORDS = ("kind", "engine", "profile", "scenario", "change")
NUMBERS = {"dt_s": float, "n": int, "copy_of": int, "round": int, "place": int} | {
    "cost": float,
    "wrapping": float,
    "runs": int,
}


@dataclass
class Measured:
    """Everything that was measured, one number a row.

    Attributes:
        errors: kind, change, and the columns of `ladder.errors_of`.
        budget: the columns of `budget.budget_of`.
        samples: kind, scenario, engine, profile, change, dt_s, n, copy_of, round, place,
            cost, wrapping, runs; cost in s per simulated second in a scene, in s a step for sizes;
            of the kinds of `stepping.overheads` in s each.
        truths: as `cheapest.closed_form` gives them.
        left_out: (what, reason) of what could not be measured.
        busy: cores that others kept busy when the timing began.
        stopped: (`engine:profile`, number of disks) -> why it was not measured with so many.
    """

    errors: pd.DataFrame = field(default_factory=pd.DataFrame)
    budget: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=budget.COLUMNS))
    samples: pd.DataFrame = field(default_factory=lambda: samples_table([]))
    truths: pd.DataFrame = field(default_factory=pd.DataFrame)
    left_out: list[tuple[str, str]] = field(default_factory=list)
    stopped: dict[tuple[str, int], str] = field(default_factory=dict)
    busy: float = nan


def samples_table(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """`Measured.samples`; a table with its columns if there are no rows."""
    return pd.DataFrame(rows, columns=[*WORDS, *NUMBERS]).astype(NUMBERS)


@dataclass
class Measuring:
    """A measurement under way: first the errors, then the times; results `kept` from an interrupted
    one are not measured again."""

    plan: SpeedPlan
    progress: Progress
    kept: Kept | None = None
    measured: Measured = field(default_factory=Measured)

    def run(self) -> Measured:
        """Both passes of the plan."""
        reach = self.find_reach()
        measurements = list(self.plan.measurements(reach))
        if any(measurement.kind == SCENE for measurement in measurements):
            self.progress.note(estimate(self.plan, measurements, reach))
            played = self.measure_errors(measurements)
            self.measure_budget(reach)
            self.measure_times(played)
        return self.measured

    def find_reach(self) -> Reach:
        """(scene, seed) -> the number of sample intervals that have an exact answer; scenes that
        have none are left out."""
        # In workers, which can be stopped at any time.
        asked = {
            seeded: partial(scored_part.reach_of, *seeded) for seeded in self.plan.seeded_scenes
        }
        reach = {}
        for seeded, result in done(asked, self.plan.workers, self.progress, "exact answer"):
            reach[seeded], why = (0, result.reason) if isinstance(result, Failure) else result
            if why:
                self.leave_out("{}, seed {}".format(*seeded), f"no exact answer: {why}")
        return reach

    def leave_out(self, what: str, why: str | Failure) -> None:
        """Report what could not be measured."""
        why = f"{why.status}: {why.reason}" if isinstance(why, Failure) else why
        self.measured.left_out.append((what, why))

    def measure_errors(self, measurements: Sequence[Measurement]) -> list[Measurement]:
        """The errors of all engines; returns those of the first seed at the steps that were played
        to the end."""
        workers = self.plan.workers
        tasks = {measurement.task: measurement.errors for measurement in measurements}
        results = dict(done(tasks, workers, self.progress, "error", kept=self.kept))
        rows: list[dict[str, Any]] = []
        played = []
        for measurement in measurements:
            found = results[measurement.task]
            if isinstance(found, Failure):
                found = one_step_size_at_a_time(measurement, workers)
            rows += (
                {"kind": measurement.kind, "change": measurement.change} | row for row in found
            )
            if measurement.seed == self.plan.seed:
                well = tuple(r["substeps"] for r in found if r["status"] in ("ok", ladder.FAILS))
                played.append(measurement._replace(step_sizes=well))
        self.measured.errors = pd.DataFrame(rows)
        return played

    def measure_budget(self, reach: Reach) -> None:
        """The error budgets of the engines whose mechanisms are known, at the middle dt."""
        seed = self.plan.seed
        tasks = {
            ("budget", scene, name): partial(budget.budget_of, scene, seed, name, middle(scene))
            for scene in self.plan.budget_scenes
            for name in self.plan.engines
            if name in MECHANISMS and reach[scene, seed]
        }
        results = dict(
            done(tasks, self.plan.workers, self.progress, "error budget", kept=self.kept)
        )
        for task, result in results.items():
            if isinstance(result, Failure):
                self.leave_out(f"error budget of {' '.join(task[1:])}", result)
        found = [results[task] for task in tasks if not isinstance(results[task], Failure)]
        self.measured.budget = pd.DataFrame(chain.from_iterable(found), columns=budget.COLUMNS)

    def measure_times(self, played: Sequence[Measurement]) -> None:
        """The cost of everything that was played to the end, in one process and one thing at a
        time."""
        self.measured.busy = busy_cores()
        rows: list[dict[str, Any]] = []
        truths = []
        tasks = timings(self.plan, played)
        for task, result in done(tasks, 1, self.progress, "time", ALL_ROUNDS, self.kept):
            kind = task[1]
            if isinstance(result, Failure):
                self.leave_out(f"timing of {' '.join(task[1:])}", result)
            elif kind == TRUTH:
                truths.append(result)
            elif kind == SIZE:
                rows += result["samples"]
                self.measured.stopped = {(name, n): why for name, n, why in result["stopped"]}
            else:
                rows += result
        self.measured.samples = samples_table(rows)
        self.measured.truths = pd.DataFrame(truths)


def one_step_size_at_a_time(measurement: Measurement, workers: int) -> list[dict[str, Any]]:
    """A ladder whose worker died or hung, played again one step size at a time, so that the
    other step sizes are kept."""
    rows: list[dict[str, Any]] = []
    for k, result in run_all(
        {k: measurement._replace(step_sizes=(k,)).errors for k in measurement.step_sizes},
        workers,
        HANGS,
    ):
        if isinstance(result, Failure):
            asked = measurement.scene, measurement.seed, measurement.name, k
            result = [ladder.error_row(*asked, result.status, result.reason)]
        rows += result
    return sorted(rows, key=lambda row: row["substeps"])


def timings(
    plan: SpeedPlan, played: Sequence[Measurement]
) -> dict[tuple[Any, ...], Callable[[], Any]]:
    """The tasks of the second pass: all measurements of one kind in one scene are one task,
    because they are compared with each other."""
    repeats: dict[str, Any] = {"rounds": plan.effort.rounds, "budget": plan.effort.budget}
    makes = {name: row_of(name).make for name in plan.engines}
    tasks: dict[tuple[Any, ...], Callable[[], Any]] = {}
    for (kind, scene), group in groupby(played, key=lambda one: one[:2]):
        tasks["time", kind, scene] = partial(
            scene_rows, kind, scene, plan.seed, in_turns(list(group)), repeats
        )
        if kind == SCENE:
            tasks["time", TRUTH, scene] = partial(cheapest.closed_form, scene, plan.seed)
    if plan.whole:
        tasks["time", SIZE] = partial(size_rows, makes, plan, repeats)
    return tasks


def in_turns(
    measurements: Sequence[Measurement],
) -> dict[tuple[tuple[str, str], int, int], Callable[..., Any]]:
    """((name, change), substeps, copy) -> engine.

    On a ladder of a scene each takes part twice at its middle dt, which gives the noise floor.
    """
    return {
        ((one.name, one.change), k, copy): one.make
        for one in measurements
        for place, k in enumerate(one.step_sizes)
        for copy in ((0, 1) if one.kind == SCENE and place == len(one.step_sizes) // 2 else (0,))
    }


def scene_rows(
    kind: str, scene: str, seed: int, measurements: Mapping[Any, Any], repeats: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Rows of `Measured.samples` of measurements as `in_turns` gives them; where these are of a
    scene's ladders, of what is measured beside their steps, too."""
    scenario = open_scene(scene, seed)
    rows = []
    also = {who[0]: make for (who, _, _), make in measurements.items()} if kind == SCENE else {}
    for sample in ladder.times_of(scene, seed, measurements, **repeats, also=also):
        if len(sample.key) == 2:
            name, what = sample.key
            rows.append(sample_row(what, name, sample, scenario=scenario.name))
        else:
            (name, change), k, copy = sample.key
            whose = {"scenario": scenario.name, "change": change, "dt_s": scenario.dt(k)}
            rows.append(sample_row(kind, name, sample, **whose, copy_of=copy))
    return rows


def size_rows(
    makes: Mapping[str, Callable[..., Any]], plan: SpeedPlan, repeats: Mapping[str, Any]
) -> dict[str, list[Any]]:
    """samples: rows of `Measured.samples` for every number of disks, and the worst step with it;
    stopped: (name, disks, why)."""
    found, worst, stopped = sizes.costs(
        makes, plan.effort.sizes, patience=plan.effort.patience, seed=plan.seed, **repeats
    )
    rows = [
        sample_row(kind, sample.key[0], sample, n=sample.key[1])
        for kind, samples in ((SIZE, found), (WORST_STEP, worst))
        for sample in samples
    ]
    piles = {
        (name, change): make
        for name in makes
        if SLEEPING in (options := row_of(name).options)
        for change, make in (
            (PLAIN, makes[name]),
            (SLEEPING, partial(makes[name], **options[SLEEPING])),
        )
    }
    rows += [
        sample_row(IN_PILE, sample.key[0], sample, n=sizes.PILE, change=sample.key[1])
        for sample in sizes.pile_costs(piles, seed=plan.seed, **repeats)
    ]
    return {"samples": rows, "stopped": [(name, n, why) for (name, n), why in stopped.items()]}


def sample_row(kind: str, name: str, sample: Sample, **identity: Any) -> dict[str, Any]:
    """A sample as a row of `Measured.samples`."""
    engine, profile = name.split(":")
    row: dict[str, Any] = {"kind": kind, "engine": engine, "profile": profile}
    row |= {"scenario": "", "change": PLAIN, "dt_s": nan, "n": 0, "copy_of": 0} | identity
    row |= sample._asdict()
    del row["key"]
    return row


def done(
    tasks: Mapping[Any, Any],
    workers: int,
    progress: Progress,
    what: str,
    patience: float = HANGS,
    kept: Kept | None = None,
) -> Iterable[tuple[Any, Any]]:
    """Run the tasks with progress; yields the kept results first, then new ones as they come."""
    left = {task: do for task, do in tasks.items() if kept is None or task not in kept}
    if kept is not None:
        yield from ((task, kept[task]) for task in tasks if task not in left)
    if not left:
        return
    progress.start(len(left), len(tasks), what)
    for task, result in run_all(left, workers, patience):
        failed = isinstance(result, Failure)
        if kept is not None and not failed:
            kept.add(task, result)
        label = " ".join(str(part) for part in task if part not in (what, PLAIN))
        progress.done(f"{what}: {label}", *(result[:2] if failed else ("ok", "")))
        yield task, result
