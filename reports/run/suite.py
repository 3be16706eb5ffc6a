"""A run: its plan, the tasks of the plan, each with the key of its row, and how they are carried
out: what has no row yet is done, and its row is written as it ends."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from math import isnan, nan
from pathlib import Path
from typing import Any, NamedTuple

from crosscheck2d.adapters.conformance.conform import Finding, not_probed
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import told_apart
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run import cells, comparing, playing
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.cluster import Cluster
from crosscheck2d.reports.run.comparing import ANSWER, COMPARED, Record
from crosscheck2d.reports.run.known_answers import KNOWN_ANSWERS, KNOWN_SCENE, KnownAnswer
from crosscheck2d.reports.run.pool import TIMEOUT, Failure, run_all
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.scenes import SceneSource, open_scene, with_steps
from crosscheck2d.reports.run.store import Store, is_usable
from crosscheck2d.reports.run.timing_pass import CellToTime, cells_to_time, time_cells
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.files.scene_file import scene_text
from crosscheck2d.scenarios.model import Scenario

# With a cluster, too, these are carried out on this machine: a solver's file is here, and so is the
# cache of exact answers.
HERE = ("check", ANSWER)


class OtherVersions(Exception):
    """The source or library versions of a worker differ from those of this machine."""


class Check(NamedTuple):
    """The verdict of `crosscheck check` on a solver's file.

    Attributes:
        passed: whether it found no fault.
        says: its sentences, the most important first.
        shown: for each sentence the lines of the file and the exercise's formula, a text each.
        source: `EngineRow.source` of the text that was checked; "" if there is none.
    """

    passed: bool
    says: list[str]
    shown: list[list[str]]
    source: str


class RunTask(NamedTuple):
    """A task of a run, whose row has this kind and key.

    Attributes:
        name: of its engine or its scene.
        work: what a worker does.
        row: the value and the blob of its row, from the result or `Failure` and the time limit, s.
        title: what progress calls it; "" if it is not counted.
        alone: whether it needs a process of its own.
    """

    kind: str
    key: str
    name: str
    work: Callable[[], Any]
    row: Callable[[Any, float], tuple[Record, bytes]]
    title: str = ""
    alone: bool = False


@dataclass(frozen=True)
class RunPlan:
    """The scenes, engines and settings of a run: all that decides its numbers.

    Attributes:
        scenes: names of the catalogue or paths of scene files, in reading order.
        engines: `engine:profile`, or a solver's file as `PATH:own`, -> its row, in reading order.
        seed: seed of random scenes.
        dts: step sizes in s instead of each scenario's own; empty: its own.
        full: two finer steps for every scenario.
        timings: s that the timing pass at the end may take; 0: no timing pass.
        command: the command line that runs this plan again.
        checks: a solver's file of `engines` -> a picklable task that gives its `Check`.
        trajectories: whether the trajectories are exported.
    """

    scenes: Sequence[str]
    engines: Mapping[str, EngineRow]
    seed: int
    dts: Sequence[float]
    full: bool
    timings: float
    command: str
    checks: Mapping[str, Callable[[], Check]] = field(default_factory=dict)
    trajectories: bool = False


@dataclass(frozen=True)
class Means:
    """The processes, time and memory for carrying out a plan; they change no number.

    Attributes:
        workers: processes that play at once.
        timeout: s a cell may take, and the exact answer to a scene.
        memory: bytes a worker may take; 0: no limit.
        scheduler: address of the dask scheduler whose workers play; "": this machine.
    """

    workers: int
    timeout: float = TIMEOUT
    memory: int = 0
    scheduler: str = ""


def tasks_of(
    plan: RunPlan, scenarios: Mapping[str, Scenario], sources: Mapping[str, SceneSource]
) -> Iterator[RunTask]:
    """Each task of a plan; cells in reading order."""
    work: Callable[[], Any]
    for name, row in plan.engines.items():
        key, work = cells.content_key(name, row.source), partial(playing.conform_here, name, row)
        to_row = partial(probes_row, name, row)
        yield RunTask("probes", key, name, work, to_row, f"conformance of {name}")
    checker = cells.source_hash(cells.CHECK_SOURCE)
    for name, check in plan.checks.items():
        text = plan.engines[name].source
        key, to_row = cells.content_key(name, text, checker), partial(check_row, text)
        yield RunTask("check", key, name, check, to_row, f"check of {name}")
    for known in KNOWN_ANSWERS if KNOWN_SCENE in plan.scenes else ():
        key, to_row = cells.content_key(repr(known)), partial(known_row, known)
        title = f"known answer: {known.column} at dt {known.dt_s:g} s"
        yield RunTask("known_answer", key, known.column, known.reproduce, to_row, title)
    for scene, scenario in scenarios.items():
        source, question = sources[scene], replace(scenario, truth=None)  # no answer for an engine
        for name in told_apart(plan.engines, scenario.scene):
            row = plan.engines[name]
            for cell in (Cell(scene, plan.seed, name, k) for k in scenario.substeps):
                key = cell.key(source.digest, row.source)
                work = partial(playing.play_here, cell, row, question)
                title = f"{scenario.name}  {name}  dt {scenario.dt(cell.substeps):.4g} s"
                to_row = partial(cell_row, cell, scenario)
                yield RunTask("cell", key, scene, work, to_row, title, row.leaves_state)
        key, work = comparing.answer_key(source), partial(comparing.compute_answer, source)
        yield RunTask(ANSWER, key, scene, work, comparing.answer_row)


def probes_row(
    name: str, row: EngineRow, result: list[Finding] | Failure, _: float
) -> tuple[Record, bytes]:
    if isinstance(result, Failure):
        # a solver of the exercise that hangs breaks no protocol
        how = "departs" if row.exercise else "breaks"
        result = [not_probed(name, result.status, result.reason, how)]  # type: ignore[arg-type]
    return {"findings": [asdict(finding) for finding in result]}, b""


def check_row(source: str, result: Check | Failure, _: float) -> tuple[Record, bytes]:
    """`source` of the file that plays."""
    if not isinstance(result, Failure) and result.source == source:
        return {name: getattr(result, name) for name in ("passed", "says", "shown")}, b""
    says = "It was saved while the run began: check it again."
    if isinstance(result, Failure):
        says = f"It could not be checked: {result.reason}"
    return {"passed": False, "shown": [], "says": [says], "outside": True}, b""


def known_row(known: KnownAnswer, result: float | Failure, _: float) -> tuple[Record, bytes]:
    return asdict(known) | {"ours_J2": nan if isinstance(result, Failure) else result}, b""


def cell_row(
    cell: Cell, scenario: Scenario, result: playing.CellResult | Failure, timeout: float
) -> tuple[Record, bytes]:
    """Of one whose worker died, or was stopped, with its states up to that time."""
    if isinstance(result, Failure):
        trajectory = playing.from_trail(result.trail, scenario)
        samples, reason = len(trajectory) if trajectory else 0, result.reason
        if samples:
            step, t = (samples - 1) * cell.substeps, scenario.times[samples - 1]
            reason += f"; last good state: step {step}, {t:g} s"
        dt = scenario.dt(cell.substeps)
        engine, profile = cell.engine.split(":")
        run = Run(engine, profile, scenario.name, dt, result.status, reason)
        file, outside = playing.pack(trajectory) if trajectory else b"", result.outside
    else:
        run, samples, file, outside = result.run, result.samples, result.file, False
        if result.played_by != playing.source_and_versions():
            raise OtherVersions(
                "a worker has other versions or other source of the engines than this machine"
            )
    value = {
        "scene_hash": cells.scene_hash(scenario),
        "substeps": cell.substeps,
        "scenario": run.scenario,
        "engine": run.engine,
        "profile": run.profile,
        "dt_s": run.dt,
        "status": run.status,
        "reason": run.reason,
        "frictionless": run.frictionless,
        "step": (samples - 1) * cell.substeps if samples else -1,
        "until_s": float(scenario.times[samples - 1]) if samples else nan,
        "seconds": run.seconds,
        "timeout_s": timeout,
        "outside": outside,
        "settings": run.settings,
        "versions": run.versions,
    }
    return value, file


def store_result(
    store: Store, task: RunTask, result: Any, timeout: float, progress: Progress
) -> Record:
    """Write the row of a task. Returns its value with its key and digest."""
    failed = isinstance(result, Failure)
    value, blob = task.row(result, timeout)
    value.setdefault("outside", failed and result.outside)
    row = store.put(task.kind, task.key, value, blob)
    if task.title:
        status, reason = (result.status, result.reason) if failed else ("ok", "")
        progress.done(task.title, value.get("status", status), value.get("reason", reason))
    return value | {"cell": task.key, "digest": row.digest}


def header_of(
    plan: RunPlan, tasks: Iterable[RunTask], sources: Mapping[str, SceneSource]
) -> dict[str, Any]:
    """The plan as a row, with the keys of its tasks and what makes each scenario again."""
    lists = {name: list(getattr(plan, name)) for name in ("scenes", "engines", "dts")}
    values = {name: getattr(plan, name) for name in ("full", "timings", "trajectories")}
    keys: dict[str, list[tuple[str, str]]] = {}
    for task in tasks:
        if task.kind != ANSWER:
            keys.setdefault(task.kind, []).append((task.key, task.name))
    made = {scene: source._asdict() for scene, source in sources.items()}
    row = cells.about(plan.command, plan.seed) | lists | values
    return row | {"tasks": keys, "sources": made, "folder": os.getcwd(), "timing": ""}


def carry_out(plan: RunPlan, means: Means, store: Store, progress: Progress) -> None:
    """Carry out every task of the plan that has no row, take the timings, and write all rows."""
    scenarios = {
        scene: with_steps(open_scene(scene, plan.seed), plan.dts, plan.full)
        for scene in plan.scenes
    }
    sources = {
        scene: SceneSource(
            scenario.name,
            plan.seed,
            tuple(scenario.substeps),
            scene_text(scenario) if scene.endswith(".toml") else "",
            cells.scene_hash(scenario),
        )
        for scene, scenario in scenarios.items()
    }
    tasks = {task.key: task for task in tasks_of(plan, scenarios, sources)}
    header = header_of(plan, tasks.values(), sources)
    before = store.rows.get("run", "plan")
    store.put("run", "plan", header | {"seconds": nan})
    store.rows.delete("run", "table")  # that of an earlier plan
    done = run_tasks(means, store, tasks, sources, progress)
    seconds = progress.seconds
    if before is not None and not done and not isnan(before.value["seconds"]):
        seconds = before.value["seconds"]  # of the command that played
    store.put("run", "plan", header | {"seconds": seconds})
    timed = cells_to_time(RunResults.read(store), plan.engines)
    take_timings(store, timed, plan.timings, means, progress)


def run_tasks(
    means: Means,
    store: Store,
    tasks: Mapping[str, RunTask],
    sources: Mapping[str, SceneSource],
    progress: Progress,
) -> int:
    """Carry out the tasks that have no usable row, and compare each scene when its answer and all
    its cells are there. Returns how many tasks had none, exact answers not counted."""
    records = usable_rows(store, tasks.values(), means.timeout)
    waiting = {key: task for key, task in tasks.items() if key not in records}
    missing: dict[Any, Callable[[], Any]] = {key: task.work for key, task in waiting.items()}
    alone = {key for key, task in waiting.items() if task.alone}
    scenes: dict[str, list[RunTask]] = {}
    for task in tasks.values():
        if task.kind in ("cell", ANSWER):
            scenes.setdefault(task.name, []).append(task)
    to_do = [task for task in waiting.values() if task.title]  # without the answers
    progress.start(len(to_do), len(tasks) - len(scenes))
    urgent: deque[Any] = deque()

    def compare_if_whole(scene: str) -> None:
        if all(task.key in records for task in scenes[scene]):
            rows = [records[task.key] for task in scenes[scene] if task.kind == "cell"]
            key, compare = comparing.compare_task(store, sources[scene], rows)
            if store.get(COMPARED, key) is None:
                urgent.append((key, compare))

    for scene in scenes:
        compare_if_whole(scene)
    limits = means.timeout, means.memory
    with ExitStack() as stack:
        far = None
        if means.scheduler:
            far = stack.enter_context(closing(Cluster(means.scheduler, *limits, alone)))
            here = [key for key, task in waiting.items() if task.kind in HERE]
            urgent.extend((key, missing.pop(key)) for key in here)
        results = run_all(missing, means.workers, *limits, far, alone, urgent)
        for key, result in stack.enter_context(closing(results)):
            if key not in tasks:
                if not isinstance(result, Failure):  # else the report tries again
                    store.put(COMPARED, key, None, result)
                continue
            task = waiting.pop(key)
            records[key] = store_result(store, task, result, means.timeout, progress)
            if task.kind in ("cell", ANSWER):
                compare_if_whole(task.name)
            if all(task.kind == ANSWER for task in waiting.values()):
                show_waiting([*waiting.values()], progress)
    return len(to_do)


def usable_rows(store: Store, tasks: Iterable[RunTask], timeout: float) -> dict[str, Record]:
    """Key -> the row of each task that need not be done again. Without the trajectories, which may
    be more than the memory holds."""
    rows = ((task.key, store.get(task.kind, task.key)) for task in tasks)
    return {
        key: row.value | {"cell": key, "digest": row.digest}
        for key, row in rows
        if row is not None and is_usable(row, timeout)
    }


def show_waiting(answers: Sequence[RunTask], progress: Progress) -> None:
    if answers:
        more = f" and {len(answers) - 1} more" if answers[1:] else ""
        progress.say(f"the exact answer to {Path(answers[0].name).stem}{more}")


def take_timings(
    store: Store,
    timed: Sequence[CellToTime],
    seconds: float,
    means: Means,
    progress: Progress,
    again: bool = False,
) -> None:
    """Time these cells in at most `seconds`, while no other task runs, unless that was done on this
    machine, and not `again`."""
    plan = store.get("run", "plan")
    assert plan is not None
    machine, seed = cells.about("", 0)["machine"], plan.value["seed"]
    key = cells.content_key(*sorted(cell.key for cell in timed), repr(machine), seed)
    store.put("run", "plan", plan.value | {"timing": key, "timings": seconds})
    if not timed or not seconds or (store.get("timing", key) and not again):
        return
    progress.start(1, 1, f"timing, at most {seconds:g} s")
    work: dict[Any, Callable[[], Any]] = {"timing": partial(time_cells, timed, seconds, seed)}
    with closing(run_all(work, 1, seconds + means.timeout, means.memory)) as results:
        for _, result in results:
            if isinstance(result, Failure):
                progress.done("timing", result.status, result.reason)
            elif result:
                taken = datetime.now(UTC).isoformat(timespec="milliseconds")
                store.put("timing", key, {"taken": taken} | result)
                progress.done("timing")
            else:
                progress.done("timing", "timeout", f"{seconds:g} s are not enough")
