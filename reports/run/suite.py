"""A run: carry out the tasks of a plan that have no row yet, and write the row of each as it
ends."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from math import isnan, nan
from pathlib import Path
from typing import Any

from crosscheck2d.adapters.conformance.conform import not_probed
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run.cells import Cell, content_key, scene_hash
from crosscheck2d.reports.run.cluster import Cluster
from crosscheck2d.reports.run.comparing import ANSWER, COMPARED, SceneTasks
from crosscheck2d.reports.run.known_answers import KnownAnswer
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.run.plan import Means, RunPlan, RunTask, tasks_of
from crosscheck2d.reports.run.playing import CellResult, source_and_versions
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.results import RunResults, sources_of
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.run.timing_pass import CellToTime, cells_to_time, time_cells
from crosscheck2d.reports.run.trajectories import from_trail, packed
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.rows import Row


class OtherVersions(Exception):
    """The source or library versions of a worker differ from those of this machine."""


def carry_out(plan: RunPlan, means: Means, store: Store, progress: Progress) -> None:
    """Run every task of the plan that has no row, take the timings, and write all rows."""
    scenarios = plan.scenarios()
    tasks = dict(tasks_of(plan, scenarios))
    header = plan.header(scenarios, list(tasks)) | {"timing": "", "seconds": nan}
    before = store.rows.get("run", "plan")
    store.put("run", "plan", header)
    store.rows.delete("run", "comparisons")  # those of an earlier plan
    rows = ((task, store.get(task.kind, task.key)) for task in tasks)
    ended = {  # without the trajectories, which may be more than the memory holds
        task: row._replace(blob=b"") for task, row in rows if row and is_usable(row, means)
    }
    Suite(plan, means, store, scenarios, progress).run(tasks, ended, header)
    seconds = progress.seconds
    if before is not None and len(tasks) == len(ended) and not isnan(before.value["seconds"]):
        seconds = before.value["seconds"]  # of the command that played
    store.put("run", "plan", header | {"seconds": seconds})
    cells = cells_to_time(RunResults.read(store), plan.engines)
    take_timings(store, cells, plan.timings, means, progress)


def is_usable(row: Row, means: Means) -> bool:
    """Whether a task with this row need not be done again: unless it was stopped at a shorter time
    limit than the present one, or failed for a reason outside the engine."""
    late = row.value.get("status") == "timeout" and row.value["timeout_s"] < means.timeout
    return not (late or row.value.get("outside"))


@dataclass(frozen=True)
class Suite:
    """The part of a run in which workers carry out the tasks.

    Attributes:
        scenarios: scene -> its scenario.
    """

    plan: RunPlan
    means: Means
    store: Store
    scenarios: Mapping[str, Scenario]
    progress: Progress

    def run(
        self,
        tasks: Mapping[RunTask, Callable[[], Any]],
        ended: Mapping[RunTask, Row],
        header: Mapping[str, Any],
    ) -> None:
        """Carry out the tasks that have not `ended`, and compare each scene when its cells have."""
        cells: dict[str, list[str]] = {}
        for task in (task for task in tasks if task.kind == "cell"):
            cells.setdefault(task.what.scene, []).append(task.key)
        records = {
            task.key: row.value | {"cell": task.key, "digest": row.digest}
            for task, row in ended.items()
            if task.kind == "cell"
        }
        scenes = SceneTasks(self.store, cells, sources_of(header), records, self.means.timeout)
        missing = {task: work for task, work in tasks.items() if task not in ended}
        # A solver's file is checked on this machine, because the file is here; so are scenes
        # compared.
        checks = {task: work for task, work in missing.items() if task.kind == "check"}
        played: dict[Any, Any] = {t: work for t, work in missing.items() if t not in checks}
        left = [task for task in played if task.kind == "cell"]
        alone = {task for task in left if self.plan.engines[task.what.engine].leaves_state}
        urgent: deque[Any] = deque([*checks.items(), *scenes.tasks()])
        self.progress.start(len(missing), len(tasks))
        means, limits = self.means, (self.means.timeout, self.means.memory)
        with ExitStack() as stack:
            far = Cluster(means.scheduler, *limits, alone) if means.scheduler else None
            if far is not None:
                stack.enter_context(far)
            results = run_all(played, means.workers, *limits, far, alone, urgent)
            stack.enter_context(closing(results))
            self.show_waiting(scenes)
            for task, result in results:
                if task[0] in (ANSWER, COMPARED):
                    urgent.extend(scenes.task_ended(task, result))
                elif task.kind == "cell":
                    scenes.records[task.key] = self.keep_cell(task, result)
                    urgent.extend(scenes.next_task(task.what.scene))
                else:
                    self.keep(task, result)
                self.show_waiting(scenes)

    def show_waiting(self, scenes: SceneTasks) -> None:
        """When every cell has ended: show for which exact answers the run still waits."""
        if len(scenes.records) == sum(map(len, scenes.cells.values())) and scenes.awaited:
            first, *rest = scenes.awaited
            more = f" and {len(rest)} more" if rest else ""
            self.progress.say(f"the exact answer to {Path(first).stem}{more}")

    def keep(self, task: RunTask, result: Any) -> None:
        """Write the row of a task that is not a cell, and show its status."""
        failed = isinstance(result, Failure)
        status, reason = (result.status, result.reason) if failed else ("ok", "")
        outside = failed and result.outside
        value: dict[str, Any]
        if task.kind == "probes":
            title = f"conformance of {task.what}"
            # a solver of the exercise that hangs breaks no protocol
            exercise = self.plan.engines[task.what].exercise
            how = "departs" if exercise else "breaks"
            findings = [not_probed(task.what, status, reason, how)] if failed else result  # type: ignore[arg-type]
            value = {"findings": [asdict(finding) for finding in findings]}
        elif task.kind == "known_answer":
            known: KnownAnswer = task.what
            title = f"known answer: {known.column} at dt {known.dt_s:g} s"
            value = asdict(known) | {"ours_J2": nan if failed else result}
        else:
            title = f"check of {task.what}"
            now = not failed and result.source == self.plan.engines[task.what].source
            outside, value = not now, {"passed": False, "shown": []}
            if now:
                value = {name: getattr(result, name) for name in ("passed", "says", "shown")}
            elif failed:
                value["says"] = [f"It could not be checked: {reason}"]
            else:
                value["says"] = ["It was saved while the run began: check it again."]
        self.store.put(task.kind, task.key, value | {"outside": outside})
        self.progress.done(title, status, reason)

    def keep_cell(self, task: RunTask, result: CellResult | Failure) -> dict[str, Any]:
        """Write the row of a cell and show its status; returns its record."""
        cell: Cell = task.what
        scenario = self.scenarios[cell.scene]
        played = failed_cell(cell, scenario, result) if isinstance(result, Failure) else result
        run, samples = played.run, played.samples
        if played.played_by != source_and_versions():
            raise OtherVersions(
                "a worker has other versions or other source of the engines than this machine"
            )
        value = {
            "scene_hash": scene_hash(scenario),
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
            "timeout_s": self.means.timeout,
            "outside": isinstance(result, Failure) and result.outside,
            "settings": run.settings,
            "versions": run.versions,
        }
        row = self.store.put("cell", task.key, value, played.file)
        title = f"{run.scenario}  {cell.engine}  dt {run.dt:.4g} s"
        self.progress.done(title, run.status, run.reason)
        return value | {"cell": task.key, "digest": row.digest}


def failed_cell(cell: Cell, scenario: Scenario, failure: Failure) -> CellResult:
    """The result of a cell whose worker died or was stopped, with the states up to that time."""
    trajectory = from_trail(failure.trail, scenario)
    samples, reason = len(trajectory) if trajectory else 0, failure.reason
    if samples:
        step, t = (samples - 1) * cell.substeps, scenario.times[samples - 1]
        reason += f"; last good state: step {step}, {t:g} s"
    dt = scenario.dt(cell.substeps)
    run = Run(*cell.names, scenario.name, dt, failure.status, reason)
    file = packed(trajectory) if trajectory else b""
    return CellResult(run, samples, file, source_and_versions())


def take_timings(
    store: Store,
    cells: Sequence[CellToTime],
    seconds: float,
    means: Means,
    progress: Progress,
    again: bool = False,
) -> None:
    """Time these cells in at most `seconds`, while no other task runs, unless that was done on this
    machine, and not `again`."""
    plan = store.get("run", "plan")
    assert plan is not None
    machine, seed = about("", 0)["machine"], plan.value["seed"]
    key = content_key(*sorted(cell.key for cell in cells), repr(machine), seed)
    store.put("run", "plan", plan.value | {"timing": key, "timings": seconds})
    if not cells or not seconds or (store.get("timing", key) and not again):
        return
    progress.start(1, 1, f"timing, at most {seconds:g} s")
    work: dict[Any, Callable[[], Any]] = {"timing": partial(time_cells, cells, seconds, seed)}
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
