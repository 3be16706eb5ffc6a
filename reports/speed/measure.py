"""The two passes: first how far off everybody is, in parallel; then, alone on the machine, what it costs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from typing import Any

import pandas as pd

from adapters.engines import row_of
from adapters.features import FEATURES, Feature
from adapters.habits import HABITS
from reports.machine import busy_cores
from reports.runner import run_all
from reports.speed import budget, ladder, models, sizes
from reports.speed.effort import Effort
from reports.speed.timing import Sample
from reports.terminal import Progress
from reports.worker_process import Failure
from scenarios.catalogue import DRAWN

HANGS, ALL_ROUNDS = 600.0, 3600.0  # s a ladder and a timing may take: against what hangs, no limit of what is measured
SCENE, FEATURE, SIZE, IDLE = "scene", "feature", "size", "idle"
PLAIN = ""  # the change of an engine that is not changed


@dataclass(frozen=True)
class Plan:
    """What is asked for: scenes and engines by name, how much, from which seed, with how many workers.

    whole: not only these scenes, but the changed engines and the numbers of disks, too.
    """

    scenes: Sequence[str]
    engines: Sequence[str]
    effort: Effort
    seed: int
    workers: int
    whole: bool = True

    @property
    def features(self) -> list[Feature]:
        """The rows of `FEATURES` for the engines that are asked for."""
        return [feature for feature in FEATURES if self.whole and feature.engine in self.engines]

    @property
    def feature_scenes(self) -> tuple[str, ...]:
        """Where the changed engines are measured, if any are."""
        return self.effort.feature_scenes if self.features else ()

    @property
    def budget_scenes(self) -> tuple[str, ...]:
        """Where errors are taken apart: in the scenes asked for, if any are."""
        return self.effort.budget_scenes if self.whole else tuple(self.scenes)


@dataclass
class Measured:
    """Everything that was measured, one number a row.

    Attributes:
        errors: kind, change, and the columns of `ladder.errors_of`.
        budget: the columns of `budget.budget_of`.
        samples: kind, scenario, engine, profile, change, dt_s, n, copy_of, singly, round, place, cost, wrapping, runs;
            cost in s per simulated second for scenes and features, in s a step for sizes and idle worlds.
        truths: as `models.closed_form` gives them.
        left_out: (what, reason) of what could not be measured.
        busy: cores that others kept busy when the timing began.
        stopped: (`engine:profile`, number of disks) -> why it was not measured with so many.
    """

    errors: pd.DataFrame = field(default_factory=pd.DataFrame)
    budget: pd.DataFrame = field(default_factory=pd.DataFrame)
    samples: pd.DataFrame = field(default_factory=pd.DataFrame)
    truths: pd.DataFrame = field(default_factory=pd.DataFrame)
    left_out: list[tuple[str, str]] = field(default_factory=list)
    stopped: dict[tuple[str, int], str] = field(default_factory=dict)
    busy: float = float("nan")


def measure(plan: Plan, progress: Progress) -> Measured:
    """Both passes of all that is planned."""
    measured = Measured()
    reaches = reach(plan, measured, progress)
    scenes = [scene for scene in plan.scenes if reaches.get((scene, plan.seed))]
    if scenes:
        measure_errors(plan, scenes, reaches, measured, progress)
        measure_budget(plan, reaches, measured, progress)
        measure_times(plan, scenes, measured, progress)
    return measured


def reach(plan: Plan, measured: Measured, progress: Progress) -> dict[tuple[str, int], int]:
    """(scene, seed) -> how many sample intervals have an exact answer; those that have none are told of."""
    wanted = dict.fromkeys((*plan.scenes, *plan.feature_scenes))
    draws = [(scene, seed) for scene in wanted for seed in plan.effort.seeds_of(scene, plan.seed)]
    draws += [(scene, plan.seed) for scene in plan.budget_scenes if scene not in wanted]
    found = {}
    drawn = {draw: partial(ladder.reach_of, *draw) for draw in draws if draw[0] in DRAWN}  # these may take seconds each
    answers = [(draw, ladder.reach_of(*draw)) for draw in draws if draw not in drawn]
    for (scene, seed), result in chain(answers, done(drawn, plan.workers, progress, "exact answer")):
        found[scene, seed], why = (0, result.reason) if isinstance(result, Failure) else result
        if why:
            measured.left_out.append((f"{scene}, seed {seed}", f"no exact answer: {why}"))
    return found


def measure_errors(plan: Plan, scenes: Sequence[str], reaches: Mapping[tuple[str, int], int],
                   measured: Measured, progress: Progress) -> None:  # fmt: skip
    """How far off every engine is in every scene at every dt of its ladder, and every changed engine at one dt."""
    tasks: dict[tuple, Callable[[], list[dict]]] = {}
    for scene in scenes:
        for seed in plan.effort.seeds_of(scene, plan.seed):
            if reaches[scene, seed]:
                rungs = plan.effort.ladder(ladder.open_scene(scene, seed))
                for name in plan.engines:
                    make = row_of(name).make
                    tasks[scene, seed, name, PLAIN] = partial(ladder.errors_of, scene, seed, name, make, rungs)
    for scene, name, change, make in changed(plan):
        rungs = [middle(scene)]
        tasks[scene, plan.seed, name, change, FEATURE] = partial(ladder.errors_of, scene, plan.seed, name, make, rungs)
    results = dict(done(tasks, plan.workers, progress, "error"))
    rows: list[dict[str, Any]] = []
    for key, task in tasks.items():
        failed = isinstance(results[key], Failure)
        kind = FEATURE if key[-1] == FEATURE else SCENE
        for row in rung_by_rung(task, plan.workers) if failed else results[key]:
            rows.append({"kind": kind, "change": key[3]} | row)
    measured.errors = pd.DataFrame(rows)


def rung_by_rung(task: Callable[[], list[dict]], workers: int) -> list[dict]:
    """A ladder whose worker died or hung once more, each rung by itself, so that the others are kept."""
    assert isinstance(task, partial)
    scene, seed, name, make, rungs = task.args
    tasks = {k: partial(ladder.errors_of, scene, seed, name, make, [k]) for k in rungs}
    rows: list[dict[str, Any]] = []
    for k, result in run_all(tasks, workers, HANGS):
        if isinstance(result, Failure):
            engine, profile = name.split(":")
            scenario = ladder.open_scene(scene, seed)
            result = [{
                "scenario": scenario.name, "seed": seed, "engine": engine, "profile": profile,
                "dt_s": scenario.dt(k), "substeps": k, "status": result.status, "reason": result.reason,
                "error_radii": float("inf"), "change_radii": float("nan"),
            }]  # fmt: skip
        rows += result
    return sorted(rows, key=lambda row: row["substeps"])


def measure_budget(plan: Plan, reaches: Mapping[tuple[str, int], int], measured: Measured, progress: Progress) -> None:
    """What the errors are made of, of the engines whose habits are known, at the middle dt."""
    tasks = {
        (scene, name): partial(budget.budget_of, scene, plan.seed, name, middle(scene))
        for scene in plan.budget_scenes for name in plan.engines if name in HABITS and reaches[scene, plan.seed]
    }  # fmt: skip
    results = dict(done(tasks, plan.workers, progress, "parts of the error"))
    for key, result in results.items():
        if isinstance(result, Failure):
            measured.left_out.append((f"error budget of {' '.join(key)}", f"{result.status}: {result.reason}"))
    rows = [row for key in tasks if not isinstance(results[key], Failure) for row in results[key]]
    measured.budget = pd.DataFrame(rows, columns=budget.COLUMNS)


def measure_times(plan: Plan, scenes: Sequence[str], measured: Measured, progress: Progress) -> None:
    """What everything costs that was played to its end: one process, one thing at a time."""
    effort, seed, played = plan.effort, plan.seed, measured.errors
    played = played[(played.status == "ok") & (played.seed == seed)]
    makes = {name: row_of(name).make for name in plan.engines}
    often: dict[str, Any] = {"rounds": effort.rounds, "budget": effort.budget}
    tasks: dict[tuple, Callable[[], Any]] = {}
    for scene in scenes:
        name = ladder.open_scene(scene, seed).name
        rows = played[(played.kind == SCENE) & (played.scenario == name)]
        tasks[SCENE, scene] = partial(ladder.times_of, scene, seed, copies(rows, makes), **often)
        tasks["truth", scene] = partial(models.closed_form, scene, seed)
    for scene in plan.feature_scenes:
        players = {
            ((name, change), middle(scene), 0): make
            for at, name, change, make in changed(plan)
            if at == scene and len(of_change(played, scene, name, change))
        }
        tasks[FEATURE, scene] = partial(ladder.times_of, scene, seed, players, **often)
    if plan.whole:
        tasks[(SIZE,)] = partial(sizes.costs, makes, effort.sizes, patience=effort.patience, seed=seed, **often)
    tasks[(IDLE,)] = partial(sizes.driving, makes, seed=seed, **often)
    rows_of_samples: list[dict[str, Any]] = []
    truths = []
    measured.busy = busy_cores()
    for key, result in done(tasks, 1, progress, "time", ALL_ROUNDS):
        if isinstance(result, Failure):
            measured.left_out.append((f"timing of {' '.join(key)}", f"{result.status}: {result.reason}"))
        elif key[0] == "truth":
            truths.append(result)
        else:
            if key[0] == SIZE:
                result, measured.stopped = result
            rows_of_samples += (sample_row(key, sample) for sample in result)
    measured.samples, measured.truths = pd.DataFrame(rows_of_samples), pd.DataFrame(truths)


def copies(rows: pd.DataFrame, makes: Mapping[str, Callable]) -> dict[tuple[str, int, int], Callable]:
    """(name, substeps, copy) -> engine; at its middle dt each takes part twice, which gives the noise floor."""
    players = {}
    for (engine, profile), ladder_rows in rows.groupby(["engine", "profile"], sort=False):
        rungs = ladder_rows.substeps.tolist()
        for k in rungs:
            for copy in (0, 1) if k == rungs[len(rungs) // 2] else (0,):
                players[f"{engine}:{profile}", int(k), copy] = makes[f"{engine}:{profile}"]
    return players


def changed(plan: Plan) -> Iterable[tuple[str, str, str, Callable]]:
    """(scene, engine, change, make) of every feature and of the engines they are set against, the plain ones first."""
    for scene in plan.feature_scenes:
        for name in dict.fromkeys(feature.engine for feature in plan.features):
            yield scene, name, PLAIN, row_of(name).make
        for feature in plan.features:
            yield scene, feature.engine, feature.change, feature.make


def of_change(rows: pd.DataFrame, scene: str, name: str, change: str) -> pd.DataFrame:
    """The rows of one changed engine in one scene."""
    engine, profile = name.split(":")
    return rows[
        (rows.kind == FEATURE) & (rows.scenario == scene) & (rows.engine == engine)
        & (rows.profile == profile) & (rows.change == change)
    ]  # fmt: skip


def middle(scene: str) -> int:
    """Steps in a sample interval at the dt the report shows."""
    rungs = ladder.open_scene(scene, 0).substeps
    return rungs[len(rungs) // 2]


def sample_row(key: tuple, sample: Sample) -> dict[str, Any]:
    """A sample as a row of `Measured.samples`."""
    kind, scenario, change, n, singly, copy, dt = key[0], "", PLAIN, 0, False, 0, float("nan")
    if kind in (SCENE, FEATURE):
        opened = ladder.open_scene(key[1], 0)
        who, substeps, copy = sample.key
        scenario, dt = opened.name, opened.dt(substeps)
        name, change = (who, PLAIN) if kind == SCENE else who
    elif kind == SIZE:
        name, n = sample.key
    else:
        name, singly = sample.key
    engine, profile = name.split(":")
    return {
        "kind": kind, "scenario": scenario, "engine": engine, "profile": profile, "change": change, "dt_s": dt,
        "n": n, "copy_of": copy, "singly": singly, "round": sample.round, "place": sample.place,
        "cost": sample.cost, "wrapping": sample.wrapping, "runs": sample.runs,
    }  # fmt: skip


def done(
    tasks: Mapping, workers: int, progress: Progress, what: str, patience: float = HANGS
) -> Iterable[tuple[Any, Any]]:
    """Run the tasks and say so; results as they come."""
    if not tasks:
        return
    progress.start(len(tasks), len(tasks), what)
    for key, result in run_all(tasks, workers, patience):
        failed = result if isinstance(result, Failure) else ("ok", "")
        progress.done(f"{what}: {' '.join(str(part) for part in key)}", *failed[:2])
        yield key, result
