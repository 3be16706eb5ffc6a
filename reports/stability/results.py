"""Carries out the stability report: every case on every engine, a row for each as it
ends, and the table of limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import nan
from time import process_time
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED, OWN, parsed
from crosscheck2d.adapters.npm_packages import version_of
from crosscheck2d.reports.run.cells import content_key, source_hash
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.run.made import digest_of
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.explain import explained, with_replays
from crosscheck2d.reports.stability.failures import with_failure
from crosscheck2d.reports.stability.limits import (
    FORMS,
    FULL,
    NEVER_WORKS,
    Case,
    Limit,
    Trial,
    engines_of,
)
from crosscheck2d.reports.stability.maps import MAPS, MapOf, map_of
from crosscheck2d.reports.stability.search import LimitSearch
from crosscheck2d.reports.stability.touching import TOUCHING, LawOf, law_of
from crosscheck2d.reports.stability.variants import WITH_FRICTION_ONLY, taking_part
from crosscheck2d.reports.stability.vary import case_of_file
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.progress import Progress

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


@dataclass(frozen=True)
class StabilityPlan:
    """What was asked for: names of `CASES` or FILE.toml:vary, of `MAPS`, `TOUCHING` and
    `ENGINES`, and a key of `FORMS`."""

    cases: Sequence[str]
    maps: Sequence[str]
    touching: Sequence[str]
    engines: Sequence[str]
    form: str
    workers: int
    command: str

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
        own = row.source if row is not None else ""
        what = repr(task), repr(self.versions), digest_of(path) if path else "", own
        return content_key(*what, source_hash(SOURCE))


@dataclass(frozen=True)
class Task:
    """A case, a map or a scene of touching disks on one engine; tasks do not depend on each
    other."""

    kind: str
    name: str
    engine: str
    form: str

    def __call__(self, added: Mapping[str, EngineRow]) -> Limit | MapOf | LawOf:
        """In the worker: do it, with the rows that the plan adds among the others."""
        with taking_part(added):
            if self.kind == "limit":
                return found_limit(self)
            if self.kind == "law":
                return law_of(self.name, self.engine)
            started = process_time()
            return replace(map_of(self.name, self.engine), seconds=process_time() - started)


def case_named(name: str) -> Case:
    """A case of the table, or of a scene file: FILE.toml:vary."""
    return CASES[name] if name in CASES else case_of_file(*name.rsplit(":", 1))


def expected(tasks: Collection[Task], workers: int) -> str:
    """What these tasks are, and about how long they take, as a sentence."""
    searches = [task for task in tasks if task.kind == "limit"]
    cases = {task.name for task in searches}
    engines = {task.engine.partition("+")[0] for task in searches}
    seconds = sum(SECONDS.get(task.name, OTHERS) for task in tasks) / workers
    parts = [
        f"{counted(len(searches), 'search', 'searches')} ({counted(len(cases), 'case')},"
        f" {counted(len(engines), 'engine')})",
        counted(len(tasks) - len(searches), "other table"),
    ]
    times = FULL_TIMES if any(task.form == FULL.name for task in tasks) else 1
    minutes = max(1, round(seconds * times / 60))
    least = "at least" if times > 1 else "about"
    return (
        f"{' and '.join(parts if len(tasks) > len(searches) else parts[:1])}: {least}"
        f" {counted(minutes, 'minute')} in {counted(workers, 'process', 'processes')}"
    )


def found_limit(task: Task) -> Limit:
    """Search, and explain the first failing run at the limit."""
    started = process_time()
    search = LimitSearch(case_named(task.name), task.engine, FORMS[task.form])
    limit = with_replays(search, replace(search.limit(), case=task.name))
    limit = with_failure(search, limit)
    return replace(limit, seconds=process_time() - started)


def done_before(plan: StabilityPlan, store: Store) -> set[Task]:
    """The tasks of the plan that have a row and ended well."""
    rows = {task: store.get(task.kind, plan.key(task)) for task in tasks_of(plan)}
    return {task for task, row in rows.items() if row and row.value["status"] == "ok"}


def carry_out(plan: StabilityPlan, store: Store, progress: Progress) -> None:
    """Do every task that has no row yet, and write the row of each as it ends."""
    tasks, done = {task: plan.key(task) for task in tasks_of(plan)}, done_before(plan, store)
    header = about(plan.command, 0) | {"versions": plan.versions, "form": plan.form}
    wanted = [(key, asdict(task)) for task, key in tasks.items()]
    store.put(*HEADER, header | {"tasks": wanted})
    work: dict[Any, Callable[[], Any]] = {
        task: partial(task, plan.added) for task in tasks if task not in done
    }
    progress.start(len(work), len(tasks))
    with closing(run_all(work, plan.workers, FORMS[plan.form].timeout)) as results:
        for task, result in results:
            reason = result.reason if isinstance(result, Failure) else ""
            result = failed(task, result) if isinstance(result, Failure) else result
            store.put(task.kind, tasks[task], asdict(result))
            progress.done(f"{task.name}  {task.engine}", result.status, reason)


def tasks_of(plan: StabilityPlan) -> list[Task]:
    """All tasks, the slowest first, so that no long one is left at the end."""
    smooth = [name for name in plan.engines if name not in WITH_FRICTION_ONLY]
    tasks = [
        Task("map", name, engine, plan.form)
        for name in plan.maps
        for engine in MAPS[name].engines(smooth)
    ]
    tasks += [Task("law", name, engine, plan.form) for name in plan.touching for engine in smooth]
    for name in plan.cases:
        tasks += [
            Task("limit", name, engine, plan.form)
            for engine in engines_of(case_named(name), ENGINES)
            if engine.split("+")[0] in plan.engines
        ]
    return sorted(tasks, key=lambda task: (task.name not in LONGEST, -SECONDS.get(task.name, 0.0)))


def failed(task: Task, failure: Failure) -> Limit | MapOf | LawOf:
    """The result of a task whose worker died or was stopped."""
    if task.kind == "map":
        return MapOf(task.name, task.engine, (), status=failure.status)
    if task.kind == "law":
        return LawOf(task.name, task.engine, (), status=failure.status)
    event = f"{failure.status}: {failure.reason}"
    trial = Trial(nan, 1, 1, nan, 0, nan, event, failure.status)
    return Limit(
        task.name, task.engine, task.form, NEVER_WORKS, nan, nan, (trial,), status=failure.status
    )


class StabilityResults(NamedTuple):
    """All that was found: the limits with their reasons, the maps, the laws of touching disks, and
    the header."""

    limits: list[Limit]
    maps: list[MapOf]
    laws: list[LawOf]
    header: dict[str, Any]

    @property
    def all(self) -> list[Limit | MapOf | LawOf]:
        """The result of every task."""
        return [*self.limits, *self.maps, *self.laws]


def read(store: Store) -> StabilityResults:
    """The stability report in a folder, in reading order."""
    plan = store.get(*HEADER)
    assert plan is not None
    made: dict[str, Callable[[Any], Limit | MapOf | LawOf]] = {
        "limit": limit_from,
        "map": MapOf.from_record,
        "law": LawOf.from_record,
    }
    results: dict[Task, Limit | MapOf | LawOf] = {}
    for key, wanted in plan.value["tasks"]:
        task = Task(**wanted)
        if row := store.get(task.kind, key):
            results[task] = made[task.kind](row.value)
    order = {name: k for k, name in enumerate([*CASES, *MAPS, *TOUCHING])}
    engines = engines_now()

    def place(task: Task) -> tuple[int, str, int]:
        return order.get(task.name, len(order)), task.name, engines.index(task.engine)

    ordered = [results[task] for task in sorted(results, key=place)]
    limits = explained([result for result in ordered if isinstance(result, Limit)])
    maps = [result for result in ordered if isinstance(result, MapOf)]
    laws = [result for result in ordered if isinstance(result, LawOf)]
    return StabilityResults(limits, maps, laws, plan.value)


def engines_now() -> list[str]:
    """The engines of all cases in reading order, with those of the plan."""
    return list(
        dict.fromkeys(engine for case in CASES.values() for engine in engines_of(case, ENGINES))
    )


def limit_from(record: dict[str, Any]) -> Limit:
    """The limit in the value of a row."""
    trials = (Trial(**trial | floats(trial, "value", "worst", "at")) for trial in record["trials"])
    numbers = floats(record, "works_at", "fails_at", "spacing", "seconds", "ratio")
    whole = {"trials": tuple(trials), "mechanisms": tuple(record["mechanisms"])}
    return Limit(**record | numbers | whole)


def floats(record: Mapping[str, Any], *names: str) -> dict[str, float]:
    """These fields of a record as numbers; other fields may hold the text "nan"."""
    return {name: float(record[name]) for name in names}


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
