"""Carries out the stability report: every case on every engine, written to a journal as each one
ends, and the table of limits."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import nan
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED, OWN
from crosscheck2d.adapters.npm_packages import version_of
from crosscheck2d.reports.run.journal import Journal, lines_of, of_another_version, plain, unusable
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.run.made import digest_of, writing
from crosscheck2d.reports.run.runner import run_all
from crosscheck2d.reports.run.worker_process import Failure
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
from crosscheck2d.reports.terminal.foreign_text import put_text
from crosscheck2d.reports.terminal.progress import Progress

COLUMNS = (
    *("engine", "profile", "case", "parameter", "works_at", "fails_at", "unit", "predicate"),
    *("seeds", "reason", "verdict", "failed_fraction", "runs", "monotone", "spacing", "tested"),
    *("source", "event", "form", "cause"),
)
LINES = {
    "header": ("seed", "started", "versions", "machine", "form", "files"),
    "task": (),
    "footer": ("tasks", "seconds"),
}
"""The kinds of lines of the journal -> what they hold: what was asked for, and the versions that
played it; a `Task`, with a `Limit`, a `MapOf` or a `LawOf` under the name of its kind; how much was
done."""
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
        """The rows of engines' own files, `PATH:own`, and those of `FETCHED`, among `engines`."""
        return {
            name: ENGINES[name] for name in self.engines if name.endswith(OWN) or name in FETCHED
        }

    @property
    def versions(self) -> dict[str, str]:
        """What decides the numbers, npm packages too."""
        packages = dict.fromkeys(row.package for row in self.added.values() if row.package)
        return {**about("", 0)["versions"], **{name: version_of(name) for name in packages}}


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


def carry_out(
    plan: StabilityPlan, journal: Journal, done: Collection[Task], progress: Progress
) -> None:
    """Do every task that is not in `done`; all results go into the journal's folder."""
    folder = journal.path.parent
    named = [*plan.cases, *(name for name in plan.added if name not in FETCHED)]
    paths = [name.rpartition(":")[0] for name in named]
    files = {path: digest_of(path) for path in paths if path}
    header = about(plan.command, 0) | {"versions": plan.versions, "form": plan.form, "files": files}
    journal.append({"header": header})
    with writing(folder, ["machine.json"]):
        put_text(folder / "machine.json", json.dumps(plain(header), indent=2) + "\n")
    wanted = tasks_of(plan)
    tasks: dict[Any, Callable[[], Any]] = {
        task: partial(task, plan.added) for task in wanted if task not in done
    }
    progress.start(len(tasks), len(wanted))
    with closing(run_all(tasks, plan.workers, FORMS[plan.form].timeout)) as results:
        for task, result in results:
            reason = result.reason if isinstance(result, Failure) else ""
            result = failed(task, result) if isinstance(result, Failure) else result
            journal.append({"task": asdict(task), task.kind: asdict(result)})
            progress.done(f"{task.name}  {task.engine}", result.status, reason)
    journal.append({"footer": {"tasks": len(tasks), "seconds": progress.seconds}})


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


def read(folder: Path) -> StabilityResults:
    """The stability report in a folder, in reading order; raises `ValueError` if its journal
    cannot be used."""
    headers, results = journalled(folder)
    order = {name: k for k, name in enumerate([*CASES, *MAPS, *TOUCHING])}
    engines = engines_now()

    def place(task: Task) -> tuple[int, str, int]:
        return order.get(task.name, len(order)), task.name, engines.index(task.engine)

    ordered = [results[task] for task in sorted(results, key=place)]
    limits = explained([result for result in ordered if isinstance(result, Limit)])
    maps = [result for result in ordered if isinstance(result, MapOf)]
    laws = [result for result in ordered if isinstance(result, LawOf)]
    return StabilityResults(limits, maps, laws, headers[-1])


def journalled(folder: Path) -> tuple[list[dict[str, Any]], dict[Task, Limit | MapOf | LawOf]]:
    """The headers in a folder's journal, and the result of every task; if a task has two lines,
    the later one counts.

    Raises:
        ValueError: as `lines_of`, or a line is of an engine that is not asked for.
    """
    made: dict[str, Callable[[Any], Limit | MapOf | LawOf]] = {
        "limit": limit_from,
        "map": MapOf.from_record,
        "law": LawOf.from_record,
    }
    headers: list[dict[str, Any]] = []
    results: dict[Task, Limit | MapOf | LawOf] = {}
    engines = engines_now()
    for number, kind, line in lines_of(folder, LINES):
        if kind == "header":
            headers.append(line["header"])
        elif kind == "task":
            try:
                task = Task(**line["task"])
                results[task] = made[task.kind](line[task.kind])
            except (KeyError, TypeError, ValueError):
                raise of_another_version(folder, number) from None
            if task.engine not in engines:  # an engine's own file
                raise unusable(folder, number, f"is of {task.engine}, which is not asked for")
    return headers, results


def engines_now() -> list[str]:
    """The engines of all cases in reading order, with those of the plan."""
    return list(
        dict.fromkeys(engine for case in CASES.values() for engine in engines_of(case, ENGINES))
    )


def limit_from(record: dict[str, Any]) -> Limit:
    """The limit in a line of the journal, in which numbers that are not finite are text."""
    trials = (Trial(**trial | floats(trial, "value", "worst", "at")) for trial in record["trials"])
    numbers = floats(record, "works_at", "fails_at", "spacing", "seconds", "ratio")
    whole = {"trials": tuple(trials), "mechanisms": tuple(record["mechanisms"])}
    return Limit(**record | numbers | whole)


def floats(record: Mapping[str, Any], *names: str) -> dict[str, float]:
    """These fields of a record as numbers; other fields may hold the text "nan"."""
    return {name: float(record[name]) for name in names}


def done_before(folder: Path, plan: StabilityPlan) -> tuple[int, set[Task]]:
    """How many tasks ended well in an interrupted run, and those of the plan, if versions and scene
    files are the same.

    Raises:
        ValueError: the journal is none of a stability report.
    """
    headers, results = journalled(folder)
    well = {task for task, result in results.items() if result.status == "ok"}
    same = all(
        header["versions"] == plan.versions
        and all(digest_of(path) == digest for path, digest in header["files"].items())
        for header in headers
    )
    return len(well), well & set(tasks_of(plan)) if same else set()


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
