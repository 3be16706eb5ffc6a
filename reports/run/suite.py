"""A run: its plan, the tasks of the plan, each with the key of its row, and how they are carried
out: what has no row yet is done, and its row is written as it ends."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from math import isnan, nan
from pathlib import Path
from typing import Any, NamedTuple

from crosscheck2d.adapters.conformance.conform import not_probed
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import told_apart
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run import cells, comparing, playing
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.cluster import Cluster
from crosscheck2d.reports.run.comparing import ANSWER, COMPARED, Record
from crosscheck2d.reports.run.known_answers import KNOWN_ANSWERS, KNOWN_SCENE
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
    """A task of a run: its row has the kind and the key; `what` it is of: a cell, an engine, a
    scene or a known answer."""

    kind: str
    key: str
    what: Any

    @property
    def name(self) -> str:
        """What it is of; the scene of a cell."""
        return self.what.scene if isinstance(self.what, Cell) else str(self.what)


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
) -> Iterator[tuple[RunTask, Callable[[], Any]]]:
    """Each task of a plan with the picklable function that carries it out; cells in reading
    order."""
    for name, row in plan.engines.items():
        probes = RunTask("probes", cells.content_key(name, row.source), name)
        yield probes, partial(playing.conform_here, name, row)
    checker = cells.source_hash(cells.CHECK_SOURCE)
    for name, check in plan.checks.items():
        key = cells.content_key(name, plan.engines[name].source, checker)
        yield RunTask("check", key, name), check
    if KNOWN_SCENE in plan.scenes:
        for known in KNOWN_ANSWERS:
            yield RunTask("known_answer", cells.content_key(repr(known)), known), known.reproduce
    for scene, scenario in scenarios.items():
        source, question = sources[scene], replace(scenario, truth=None)  # no answer for an engine
        for name in told_apart(plan.engines, scenario.scene):
            for cell in (Cell(scene, plan.seed, name, k) for k in scenario.substeps):
                key = cell.key(source.digest, plan.engines[name].source)
                task = RunTask("cell", key, cell)
                yield task, partial(playing.play_here, cell, plan.engines[name], question)
        answer = RunTask(ANSWER, comparing.answer_key(source), scene)
        yield answer, partial(comparing.compute_answer, source)


def header_of(
    plan: RunPlan, tasks: Iterable[RunTask], sources: Mapping[str, SceneSource]
) -> dict[str, Any]:
    """The plan as a row, with the keys of its tasks and what makes each scenario again."""
    lists = {name: list(getattr(plan, name)) for name in ("scenes", "engines", "dts")}
    values = {name: getattr(plan, name) for name in ("full", "timings", "trajectories")}
    keys: dict[str, list[tuple[str, str]]] = {}
    for task in tasks:
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
    tasks = dict(tasks_of(plan, scenarios, sources))
    header = header_of(plan, [task for task in tasks if task.kind != ANSWER], sources)
    before = store.rows.get("run", "plan")
    store.put("run", "plan", header | {"seconds": nan})
    store.rows.delete("run", "table")  # that of an earlier plan
    done = run_tasks(plan, means, store, tasks, scenarios, sources, progress)
    seconds = progress.seconds
    if before is not None and not done and not isnan(before.value["seconds"]):
        seconds = before.value["seconds"]  # of the command that played
    store.put("run", "plan", header | {"seconds": seconds})
    timed = cells_to_time(RunResults.read(store), plan.engines)
    take_timings(store, timed, plan.timings, means, progress)


def run_tasks(
    plan: RunPlan,
    means: Means,
    store: Store,
    tasks: Mapping[RunTask, Callable[[], Any]],
    scenarios: Mapping[str, Scenario],
    sources: Mapping[str, SceneSource],
    progress: Progress,
) -> int:
    """Carry out the tasks that have no usable row, and compare each scene when its answer and all
    its cells are there. Returns how many tasks had none, exact answers not counted."""
    records = usable_rows(store, tasks, means.timeout)
    missing: dict[Any, Callable[[], Any]] = {
        task: work for task, work in tasks.items() if task.key not in records
    }
    scenes: dict[str, list[RunTask]] = {}
    for task in (task for task in tasks if task.kind in ("cell", ANSWER)):
        scenes.setdefault(task.name, []).append(task)
    to_do = len([task for task in missing if task.kind != ANSWER])
    progress.start(to_do, len(tasks) - len(scenes))  # answers are not counted
    urgent: deque[Any] = deque()

    def compare_if_whole(scene: str) -> None:
        if all(task.key in records for task in scenes[scene]):
            rows = [records[task.key] for task in scenes[scene] if task.kind == "cell"]
            key, compare = comparing.compare_task(store, sources[scene], rows)
            if store.get(COMPARED, key) is None:
                urgent.append(((COMPARED, key), compare))

    for scene in scenes:
        compare_if_whole(scene)
    alone = leaving_state(plan, missing)
    limits = means.timeout, means.memory
    waiting = dict.fromkeys(missing)
    with ExitStack() as stack:
        far = None
        if means.scheduler:
            far = stack.enter_context(closing(Cluster(means.scheduler, *limits, alone)))
            here = [task for task in missing if task.kind in HERE]
            urgent.extend((task, missing.pop(task)) for task in here)
        results = run_all(missing, means.workers, *limits, far, alone, urgent)
        for ended, result in stack.enter_context(closing(results)):
            kind, key = ended[:2]
            if kind == COMPARED:
                if not isinstance(result, Failure):  # else the report tries again
                    store.put(kind, key, None, result)
                continue
            task = ended
            del waiting[task]
            if task.kind == ANSWER:
                records[task.key] = comparing.store_answer(store, task.key, result, means.timeout)
            elif task.kind == "cell":
                records[task.key] = store_cell(
                    store, task, scenarios[task.name], result, means.timeout, progress
                )
            else:
                store_finding(store, task, plan, result, progress)
            if task.key in records:
                compare_if_whole(task.name)
            show_waiting(waiting, progress)
    return to_do


def usable_rows(store: Store, tasks: Iterable[RunTask], timeout: float) -> dict[str, Record]:
    """Key -> the row of each task that need not be done again. Without the trajectories, which may
    be more than the memory holds."""
    rows = ((task.key, store.get(task.kind, task.key)) for task in tasks)
    return {
        key: row.value | {"cell": key, "digest": row.digest}
        for key, row in rows
        if row is not None and is_usable(row, timeout)
    }


def leaving_state(plan: RunPlan, tasks: Iterable[RunTask]) -> set[RunTask]:
    """The cells of engines that leave state in their process."""
    return {
        task
        for task in tasks
        if task.kind == "cell" and plan.engines[task.what.engine].leaves_state
    }


def show_waiting(tasks: Collection[RunTask], progress: Progress) -> None:
    """When every cell has ended: show for which exact answers the run still waits."""
    if tasks and all(task.kind == ANSWER for task in tasks):
        first, *rest = (Path(task.what).stem for task in tasks)
        more = f" and {len(rest)} more" if rest else ""
        progress.say(f"the exact answer to {first}{more}")


def store_finding(
    store: Store, task: RunTask, plan: RunPlan, result: Any, progress: Progress
) -> None:
    """Write the row of the probes of an engine, of a check or of a known answer."""
    failed = isinstance(result, Failure)
    status, reason = (result.status, result.reason) if failed else ("ok", "")
    outside = failed and result.outside
    value: dict[str, Any]
    if task.kind == "probes":
        title = f"conformance of {task.what}"
        # a solver of the exercise that hangs breaks no protocol
        how = "departs" if plan.engines[task.what].exercise else "breaks"
        findings = [not_probed(task.what, status, reason, how)] if failed else result  # type: ignore[arg-type]
        value = {"findings": [asdict(finding) for finding in findings]}
    elif task.kind == "known_answer":
        title = f"known answer: {task.what.column} at dt {task.what.dt_s:g} s"
        value = asdict(task.what) | {"ours_J2": nan if failed else result}
    else:
        title = f"check of {task.what}"
        now = not failed and result.source == plan.engines[task.what].source
        outside, value = not now, {"passed": False, "shown": []}
        if now:
            value = {name: getattr(result, name) for name in ("passed", "says", "shown")}
        elif failed:
            value["says"] = [f"It could not be checked: {reason}"]
        else:
            value["says"] = ["It was saved while the run began: check it again."]
    store.put(task.kind, task.key, value | {"outside": outside})
    progress.done(title, status, reason)


def store_cell(
    store: Store,
    task: RunTask,
    scenario: Scenario,
    result: playing.CellResult | Failure,
    timeout: float,
    progress: Progress,
) -> Record:
    """Write the row of a cell; of one whose worker died, or was stopped, with its states up to that
    time. Returns the row with its key and digest."""
    cell: Cell = task.what
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
    row = store.put("cell", task.key, value, file)
    progress.done(f"{run.scenario}  {cell.engine}  dt {run.dt:.4g} s", run.status, run.reason)
    return value | {"cell": task.key, "digest": row.digest}


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
                store.put("timing", key, {"taken": taken, "lines": result})
                progress.done("timing")
            else:
                progress.done("timing", "timeout", f"{seconds:g} s are not enough")
