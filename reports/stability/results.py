"""Carries out the stability report: every case on every engine, a row for each as it ends, and the
replay of its failing run."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from math import nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.npm_packages import version_of
from crosscheck2d.reports.page.replay import COLLISIONS, Layers, pack_layers, ratio_of
from crosscheck2d.reports.run.cells import about, content_key, source_hash
from crosscheck2d.reports.run.made import digest_of
from crosscheck2d.reports.run.playing import STATE
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.stability.cases import CASES, case_named
from crosscheck2d.reports.stability.explain import explained, with_replays
from crosscheck2d.reports.stability.limits import (
    FORMS,
    FULL,
    NEVER_WORKS,
    WITH_FRICTION_ONLY,
    Limit,
    LimitSearch,
    Trial,
    engines_of,
    taking_part,
)
from crosscheck2d.reports.stability.tables import MAPS, TOUCHING, LawOf, MapOf, law_of, map_of
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.model import Collisions, Scenario, Trajectory, frozen
from crosscheck2d.scenarios.no_truth import answered

SOURCE = (
    *("reports/stability/**/*.py", "reports/stability/*.toml"),
    *("reports/compare/**/*.py", "scenarios/**/*.py"),
)
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
# kind of a row -> the type of its value
RESULTS: dict[str, TypeAdapter[Any]] = {
    "limit": TypeAdapter(Limit),
    "map": TypeAdapter(MapOf),
    "law": TypeAdapter(LawOf),
}


class Task(NamedTuple):
    """A case, a map or a scene of touching disks on one engine; tasks do not depend on each
    other."""

    name: str
    engine: str
    form: str

    @property
    def kind(self) -> str:
        return "map" if self.name in MAPS else "law" if self.name in TOUCHING else "limit"

    def run(self, added: Mapping[str, EngineRow]) -> Result:
        # in the worker, which does not have the rows that the plan adds
        with taking_part(added):
            if self.kind != "limit":
                return (map_of if self.kind == "map" else law_of)(self.name, self.engine)
            search = LimitSearch(case_named(self.name), self.engine, FORMS[self.form])
            return with_replay(search, with_replays(search, search.limit()))

    def lost(self, failure: Failure) -> Result:
        """The result where the worker died or was stopped."""
        if self.kind != "limit":
            return (MapOf if self.kind == "map" else LawOf)(
                self.name, self.engine, (), status=failure.status
            )
        event = f"{failure.status}: {failure.reason}"
        trials = (Trial(nan, 1, 1, nan, 0, nan, event, failure.status),)
        return Limit(*self, NEVER_WORKS, nan, nan, trials, status=failure.status)


@dataclass(frozen=True)
class StabilityPlan:
    """What was asked for: `names` of `CASES`, FILE.toml:vary, `MAPS` and `TOUCHING`, engines of
    `ENGINES`, and a key of `FORMS`."""

    names: Sequence[str]
    engines: Sequence[str]
    form: str
    workers: int = 1
    command: str = ""
    # engines' own files, fetched packages and other versions
    added: Mapping[str, EngineRow] = field(default_factory=dict)

    @property
    def versions(self) -> dict[str, str]:
        packages = dict.fromkeys(row.package for row in self.added.values() if row.package)
        return {**about("", 0)["versions"], **{name: version_of(name) for name in packages}}

    def key(self, task: Task) -> str:
        """The key of the row of a task: a hash of all that decides its result."""
        path = task.name.rpartition(":")[0]
        row = self.added.get(task.engine)
        what = repr(task), repr(self.versions), digest_of(path) if path else ""
        return content_key(*what, row.source if row else "", source_hash(SOURCE))

    def tasks(self) -> list[Task]:
        # the slowest first, so that no long one is left at the end
        smooth = [name for name in self.engines if name not in WITH_FRICTION_ONLY]
        tasks = []
        for name in self.names:
            if name in MAPS or name in TOUCHING:
                varied = name in MAPS and MAPS[name].play is not None
                engines = [engine for engine in smooth if not varied or ENGINES[engine].work]
            else:
                among = engines_of(case_named(name), ENGINES)
                engines = [engine for engine in among if engine.split("+")[0] in self.engines]
            tasks += [Task(name, engine, self.form) for engine in engines]
        return sorted(
            tasks, key=lambda task: (task.name not in LONGEST, -SECONDS.get(task.name, 0.0))
        )

    def done_before(self, store: Store) -> set[Task]:
        rows = {task: store.get(task.kind, self.key(task)) for task in self.tasks()}
        return {task for task, row in rows.items() if row and row.value["status"] == "ok"}

    def carry_out(self, store: Store, done: Collection[Task], progress: Progress) -> None:
        """Carry out the tasks that were not done before."""
        keys = {task: self.key(task) for task in self.tasks()}
        header = about(self.command, 0) | {"versions": self.versions, "form": self.form}
        store.put(*HEADER, header | {"tasks": [(key, task) for task, key in keys.items()]})
        work: dict[Any, Callable[[], Any]] = {
            task: partial(task.run, self.added) for task in keys if task not in done
        }
        progress.start(len(work), len(keys))
        with closing(run_all(work, self.workers, FORMS[self.form].timeout)) as results:
            for task, result in results:
                reason = result.reason if isinstance(result, Failure) else ""
                row = task.lost(result) if isinstance(result, Failure) else result
                store.put(task.kind, keys[task], asdict(row))
                progress.done(f"{task.name}  {task.engine}", row.status, reason)


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


def with_replay(search: LimitSearch, limit: Limit) -> Limit:
    """The limit with the replay of its first failing run, from a tenth of the shown time before the
    failure, and the trajectory that is shown with it, if there is one."""
    failing, failure = limit.failing, search.seen.get(limit.fails_at)
    if failing is None or failure is None or failure[1].trajectory is None:
        return limit
    scenario, run = failure
    samples, (_, true) = near(failing, scenario), answered(scenario)
    layers: Layers = [(run, part_of(failure[1].trajectory, samples, scenario))]
    if true is not None and len(part := part_of(true, samples, scenario)):
        layers.append((None, part))
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


def part_of(whole: Trajectory, samples: NDArray[np.int64], scenario: Scenario) -> Trajectory:
    """A trajectory at those of the samples that it has, and the collisions between them, if they
    are few enough to show."""
    first, last = samples[0], samples[-1]
    state: dict[str, Any] = {n: frozen(getattr(whole, n)[first : last + 1]) for n in ("t", *STATE)}
    collisions = whole.collisions
    low, high = (k * scenario.sample_interval for k in (first - 0.5, last + 0.5))
    among = (collisions.t >= low) & (collisions.t <= high)
    among &= among.sum() <= COLLISIONS
    columns = [getattr(collisions, name)[among] for name in ("t", "i", "j", "impulse")]
    return replace(whole, **state, collisions=Collisions(*columns))


class StabilityResults(NamedTuple):
    """In reading order; the limits have their reasons."""

    limits: list[Limit]
    maps: list[MapOf]
    laws: list[LawOf]
    header: dict[str, Any]

    @property
    def all(self) -> list[Result]:
        return [*self.limits, *self.maps, *self.laws]


def read_results(store: Store) -> StabilityResults:
    plan = store.get(*HEADER)
    assert plan is not None
    names = {name: k for k, name in enumerate([*CASES, *MAPS, *TOUCHING])}
    engines = list(dict.fromkeys(e for case in CASES.values() for e in engines_of(case, ENGINES)))

    def order(pair: tuple[Task, str]) -> tuple[int, str, int]:
        task = pair[0]
        return names.get(task.name, len(names)), task.name, engines.index(task.engine)

    results: dict[str, list[Any]] = {kind: [] for kind in RESULTS}
    for task, key in sorted(((Task(*task), key) for key, task in plan.value["tasks"]), key=order):
        if row := store.get(task.kind, key):
            results[task.kind].append(RESULTS[task.kind].validate_python(row.value))
    limits, maps, laws = results.values()
    return StabilityResults(explained(limits), maps, laws, plan.value)
