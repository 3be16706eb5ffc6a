"""Carries out the stability report: every case on every engine, a row for each as it
ends, the replay of its failing run, and the table of limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, astuple, dataclass, replace
from functools import partial
from math import nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import TypeAdapter

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED, OWN, parsed
from crosscheck2d.adapters.npm_packages import version_of
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.page.replay import COLLISIONS, pack_layers, ratio_of
from crosscheck2d.reports.run.cells import about, content_key, source_hash
from crosscheck2d.reports.run.made import digest_of
from crosscheck2d.reports.run.playing import STATE
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.explain import explained, with_replays
from crosscheck2d.reports.stability.limits import (
    FORMS,
    FULL,
    NEVER_WORKS,
    Case,
    Limit,
    LimitSearch,
    Trial,
    engines_of,
)
from crosscheck2d.reports.stability.tables import MAPS, TOUCHING, LawOf, MapOf, law_of, map_of
from crosscheck2d.reports.stability.variants import WITH_FRICTION_ONLY, taking_part
from crosscheck2d.reports.stability.vary import case_of_file
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.model import Collisions, Scenario, Trajectory, frozen
from crosscheck2d.scenarios.no_truth import NoTruth

COLUMNS = (
    *("engine", "profile", "case", "parameter", "works_at", "fails_at", "unit", "predicate"),
    *("seeds", "reason", "verdict", "failed_fraction", "runs", "monotone", "spacing", "tested"),
    *("source", "event", "form", "cause"),
)
SOURCE = ("reports/stability/**/*.py", "reports/compare/**/*.py", "scenarios/**/*.py")
HEADER = "stability", "plan"  # kind and key of the row with what was asked for
# s of processor time that a search takes in the quick form, the mean of all engines (1200 searches
# on one machine): of the cases that take longest, and of the mean of the others
SECONDS = {
    "thermometer": 6.8,
    "equipartition": 3.7,
    "overfull_box": 3.3,
    "pile_comes_to_rest": 3.2,
    "dt_gas_of_100": 2.0,
    "bounce_drift": 1.4,
    "dense_gas": 1.4,
    "fast_gas": 0.9,
    "stiff_force": 0.8,
    "dt_falling_box": 0.7,
    "dt_column_of_ten": 0.6,
    "insertion_order": 0.6,
}
OTHERS = 0.16
FULL_TIMES = 5  # the time of the full form over that of the quick one: 71 searches in both
# the first in the full form, where they are the longest; in the quick form they are short
LONGEST = ("long_gas", "long_wrapped_gas")
BEFORE, AFTER = 120, 40  # samples of a failure that are shown
REPLAY = 5.0  # s that a replay lasts
Result = Limit | MapOf | LawOf
RESULTS: dict[str, TypeAdapter[Any]] = {
    "limit": TypeAdapter(Limit),
    "map": TypeAdapter(MapOf),
    "law": TypeAdapter(LawOf),
}
"""Kind of a row -> the type of its value."""


@dataclass(frozen=True)
class StabilityPlan:
    """What was asked for: `names` of `CASES`, FILE.toml:vary, `MAPS` and `TOUCHING`, engines of
    `ENGINES`, and a key of `FORMS`."""

    names: Sequence[str]
    engines: Sequence[str]
    form: str
    workers: int = 1
    command: str = ""

    @property
    def added(self) -> dict[str, EngineRow]:
        """The rows of engines' own files, `PATH:own`, of `FETCHED` and of other versions, among
        `engines`."""
        return {
            name: ENGINES[name]
            for name in self.engines
            if name.endswith(OWN) or name in FETCHED or parsed(name)[1]
        }

    @property
    def versions(self) -> dict[str, str]:
        """What decides the numbers, npm packages too."""
        packages = dict.fromkeys(row.package for row in self.added.values() if row.package)
        return {**about("", 0)["versions"], **{name: version_of(name) for name in packages}}

    def key(self, task: Task) -> str:
        """The key of the row of a task: a hash of all that decides its result."""
        path = task.name.rpartition(":")[0]
        row = self.added.get(task.engine)
        what = repr(task), repr(self.versions), digest_of(path) if path else ""
        return content_key(*what, row.source if row else "", source_hash(SOURCE))

    def tasks(self) -> list[Task]:
        """All tasks, the slowest first, so that no long one is left at the end."""
        smooth = [name for name in self.engines if name not in WITH_FRICTION_ONLY]
        tasks = []
        for name in self.names:
            if name in MAPS or name in TOUCHING:
                only = MAPS[name].only if name in MAPS else ()
                engines = [engine for engine in smooth if not only or engine in only]
            else:
                among = engines_of(case_named(name), ENGINES)
                engines = [engine for engine in among if engine.split("+")[0] in self.engines]
            tasks += [Task(name, engine, self.form) for engine in engines]
        return sorted(
            tasks, key=lambda task: (task.name not in LONGEST, -SECONDS.get(task.name, 0.0))
        )

    def done_before(self, store: Store) -> set[Task]:
        """The tasks that have a row and ended well."""
        rows = {task: store.get(task.kind, self.key(task)) for task in self.tasks()}
        return {task for task, row in rows.items() if row and row.value["status"] == "ok"}

    def carry_out(self, store: Store, progress: Progress) -> None:
        """Do every task that has no row yet, and write the row of each as it ends."""
        keys, done = {task: self.key(task) for task in self.tasks()}, self.done_before(store)
        header = about(self.command, 0) | {"versions": self.versions, "form": self.form}
        store.put(*HEADER, header | {"tasks": [(key, astuple(task)) for task, key in keys.items()]})
        work: dict[Any, Callable[[], Any]] = {
            task: partial(task, self.added) for task in keys if task not in done
        }
        progress.start(len(work), len(keys))
        with closing(run_all(work, self.workers, FORMS[self.form].timeout)) as results:
            for task, result in results:
                reason = result.reason if isinstance(result, Failure) else ""
                row = failed(task, result) if isinstance(result, Failure) else result
                store.put(task.kind, keys[task], asdict(row))
                progress.done(f"{task.name}  {task.engine}", row.status, reason)


@dataclass(frozen=True)
class Task:
    """A case, a map or a scene of touching disks on one engine; tasks do not depend on each
    other."""

    name: str
    engine: str
    form: str

    @property
    def kind(self) -> str:
        """Of its row."""
        return "map" if self.name in MAPS else "law" if self.name in TOUCHING else "limit"

    def __call__(self, added: Mapping[str, EngineRow]) -> Result:
        """In the worker: do it, with the rows that the plan adds among the others. A limit comes
        with its cause and its replay."""
        with taking_part(added):
            if self.kind != "limit":
                return (map_of if self.kind == "map" else law_of)(self.name, self.engine)
            search = LimitSearch(case_named(self.name), self.engine, FORMS[self.form])
            limit = replace(search.limit(), case=self.name)
            return with_failure(search, with_replays(search, limit))


def case_named(name: str) -> Case:
    """A case of the table, or of a scene file: FILE.toml:vary."""
    return CASES[name] if name in CASES else case_of_file(*name.rsplit(":", 1))


def expected(tasks: Collection[Task], workers: int) -> str:
    """What these tasks are, and about how long they take, as a sentence."""
    searches = [task for task in tasks if task.kind == "limit"]
    cases = {task.name for task in searches}
    engines = {task.engine.partition("+")[0] for task in searches}
    whole = any(task.form == FULL.name for task in tasks)
    seconds = sum(SECONDS.get(task.name, OTHERS) for task in tasks) / workers
    minutes = max(1, round(seconds * (FULL_TIMES if whole else 1) / 60))
    parts = [
        f"{counted(len(searches), 'search', 'searches')} ({counted(len(cases), 'case')},"
        f" {counted(len(engines), 'engine')})"
    ]
    if len(tasks) > len(searches):
        parts.append(counted(len(tasks) - len(searches), "other table"))
    return (
        f"{' and '.join(parts)}: {'at least' if whole else 'about'} {counted(minutes, 'minute')}"
        f" in {counted(workers, 'process', 'processes')}"
    )


def failed(task: Task, failure: Failure) -> Result:
    """The result of a task whose worker died or was stopped."""
    if task.kind != "limit":
        return (MapOf if task.kind == "map" else LawOf)(
            task.name, task.engine, (), status=failure.status
        )
    event = f"{failure.status}: {failure.reason}"
    trials = (Trial(nan, 1, 1, nan, 0, nan, event, failure.status),)
    names = task.name, task.engine, task.form
    return Limit(*names, NEVER_WORKS, nan, nan, trials, status=failure.status)


def with_failure(search: LimitSearch, limit: Limit) -> Limit:
    """The limit with the replay of its first failing run, from a tenth of the shown time before the
    failure, and the trajectory that is shown with it, if there is one."""
    failing, failure = limit.failing, search.failure(limit)
    if failing is None or failure is None or failure[1].trajectory is None:
        return limit
    scenario, run = failure
    samples, trajectories = near(failing, scenario), [failure[1].trajectory]
    with suppress(NoTruth):
        if scenario.truth is not None:
            trajectories.append(scenario.truth(scenario.times))
    engine, profile = limit.engine.split(":")
    runs = Run(engine, profile, limit.case, run.dt), None
    parts = [part_of(trajectory, samples, scenario) for trajectory in trajectories]
    layers = [(run, part) for run, part in zip(runs, parts) if len(part)]
    first, last = (float(scenario.times[k]) for k in (samples[0], samples[-1]))
    at = min(max(failing.at, first), last) if np.isfinite(failing.at) else first
    opening = {
        "opens": max(first, at - max(0.1 * (last - first), 1.5 * scenario.sample_interval)),
        "pace": (last - first) / REPLAY,
        "event": {"t": at, "disk": failing.disk},
    }
    pack = pack_layers(scenario, layers, samples, opening)
    return replace(limit, replay=pack, ratio=ratio_of(scenario, layers))


def near(failing: Trial, scenario: Scenario) -> NDArray[np.int64]:
    """The samples around the failure, up to `BEFORE` before and `AFTER` after it; if the failure
    is early or late in the run, more from the other side."""
    at = failing.at if np.isfinite(failing.at) else 0.0
    middle = int(np.clip(round(at / scenario.sample_interval), 0, scenario.intervals))
    first = max(0, min(middle - BEFORE, scenario.intervals - BEFORE - AFTER))
    return np.arange(first, min(scenario.intervals, first + BEFORE + AFTER) + 1)


def part_of(whole: Trajectory, shown: NDArray[np.int64], scenario: Scenario) -> Trajectory:
    """A trajectory at those of the samples `shown` that it has, and the collisions between them,
    if they are few enough to show."""
    first, last = shown[0], shown[-1]
    state: dict[str, Any] = {n: frozen(getattr(whole, n)[first : last + 1]) for n in ("t", *STATE)}
    collisions = whole.collisions
    low, high = (k * scenario.sample_interval for k in (first - 0.5, last + 0.5))
    among = (collisions.t >= low) & (collisions.t <= high)
    among &= among.sum() <= COLLISIONS
    columns = [getattr(collisions, name)[among] for name in ("t", "i", "j", "impulse")]
    return replace(whole, **state, collisions=Collisions(*columns))


class StabilityResults(NamedTuple):
    """All that was found, in reading order: the limits with their reasons, the maps, the laws of
    touching disks, and the header."""

    limits: list[Limit]
    maps: list[MapOf]
    laws: list[LawOf]
    header: dict[str, Any]

    @property
    def all(self) -> list[Result]:
        """The result of every task."""
        return [*self.limits, *self.maps, *self.laws]


def read(store: Store) -> StabilityResults:
    """The stability report in a folder."""
    plan = store.get(*HEADER)
    assert plan is not None
    names = {name: k for k, name in enumerate([*CASES, *MAPS, *TOUCHING])}
    engines = list(dict.fromkeys(e for case in CASES.values() for e in engines_of(case, ENGINES)))
    tasks = [(Task(*task), key) for key, task in plan.value["tasks"]]
    tasks.sort(
        key=lambda pair: (
            names.get(pair[0].name, len(names)),
            pair[0].name,
            engines.index(pair[0].engine),
        )
    )
    results: dict[str, list[Any]] = {kind: [] for kind in RESULTS}
    for task, key in tasks:
        if row := store.get(task.kind, key):
            results[task.kind].append(RESULTS[task.kind].validate_python(row.value))
    limits, maps, laws = results.values()
    return StabilityResults(explained(limits), maps, laws, plan.value)


def table(limits: Sequence[Limit]) -> pd.DataFrame:
    """A row for each limit, with the columns `COLUMNS`."""
    return pd.DataFrame([row_of(limit) for limit in limits], columns=list(COLUMNS))


def row_of(limit: Limit) -> dict[str, Any]:
    """The limit as a row of limits.csv."""
    case = case_named(limit.case)
    failing = limit.failing if limit.status == "ok" else limit.trials[0]
    engine, profile = limit.engine.split(":")
    cause = limit.cause
    return {
        "engine": engine,
        "profile": profile,
        "case": limit.case,
        "parameter": case.parameter,
        "works_at": shortened(limit.works_at),
        "fails_at": shortened(limit.fails_at),
        "unit": case.unit,
        "predicate": failing.broken if failing else case.predicate.name,
        "seeds": max(trial.runs for trial in limit.trials),
        "reason": cause.sentence if cause else "",
        "verdict": limit.verdict,
        "failed_fraction": failing.failed / failing.runs if failing else 0.0,
        "runs": limit.runs,
        "monotone": limit.monotone,
        "spacing": shortened(limit.spacing),
        "tested": cause.shown if cause else "",
        "source": cause.source if cause else "",
        "event": failing.event if failing else "",
        "form": limit.form,
        "cause": str(cause.kind) if cause else "",
    }


def shortened(value: float) -> float:
    """The number with six significant digits; no bracket is narrower."""
    return value if math.isnan(value) else float(f"{value:.6g}")
