"""A run: play scenarios through engines, each cell once, and write every result to the run's folder
at once."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from crosscheck2d.reports.run.archive import Archive, stored_scene
from crosscheck2d.reports.run.cells import Cell, scene_hash
from crosscheck2d.reports.run.folders import RUN
from crosscheck2d.reports.run.journal import Journal, plain
from crosscheck2d.reports.run.known_answers import KnownAnswer
from crosscheck2d.reports.run.made import writing
from crosscheck2d.reports.run.playing import CellResult
from crosscheck2d.reports.run.results import keep_cell, keep_check, keep_known_answer, keep_probes
from crosscheck2d.reports.run.runner import run_all
from crosscheck2d.reports.run.scene_tables import SceneTasks
from crosscheck2d.reports.run.tasks import Checking, Means, RunPlan, finished_tasks, tasks_of
from crosscheck2d.reports.run.timing_pass import Pass, cells_to_time, is_timed
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.reports.terminal.foreign_text import put_text
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.files.scene_file import scene_text
from crosscheck2d.scenarios.model import Scenario


def carry_out(plan: RunPlan, means: Means, journal: Journal, progress: Progress) -> None:
    """Run every task of the plan that has no result in the journal, take the timings, and write all
    results to the journal and its folder."""
    folder = journal.path.parent
    scenarios = {scene: plan.scenario(scene) for scene in plan.scenes}
    tasks = tasks_of(plan, scenarios)
    begin(plan, journal, scenarios, len(tasks))
    archive = Archive.read(folder)
    finished = finished_tasks(archive, plan, means, scenarios)
    missing = {task: work for task, work in tasks.items() if task not in finished}
    cells = [task for task in missing if isinstance(task, Cell)]
    scene_tasks = SceneTasks(archive, cells, means.timeout, progress.note)
    Playing(plan, means, journal, scenarios, scene_tasks, progress).run(missing, len(tasks))
    archive = Archive.read(folder)
    take_timings(archive, plan, means, journal, scenarios, progress)
    delete_unused_trajectories(archive)
    footer = {"tasks": len(tasks), "played": len(missing), "seconds": progress.seconds}
    journal.append({"footer": footer})


@dataclass(frozen=True)
class Playing:
    """The part of a run in which workers carry out the tasks and their results are kept.

    Attributes:
        scenarios: scene -> its scenario.
        scene_tasks: the tasks of the scenes whose cells have all ended: exact answer and
            comparison.
    """

    plan: RunPlan
    means: Means
    journal: Journal
    scenarios: Mapping[str, Scenario]
    scene_tasks: SceneTasks
    progress: Progress

    def run(self, missing: Mapping[Any, Callable[[], Any]], tasks: int) -> None:
        """Carry out the `missing` ones of `tasks` tasks, and compare each scene when its cells have
        ended."""
        # A solver's file is checked on this machine, because the file is here; so are scenes
        # compared.
        checks = {task: work for task, work in missing.items() if isinstance(task, Checking)}
        played = {task: work for task, work in missing.items() if task not in checks}
        alone = {task for task in played if isinstance(task, Cell) and self.leaves_state(task)}
        urgent: deque[Any] = deque([*checks.items(), *self.scene_tasks.tasks()])
        self.progress.start(len(missing), tasks)
        if not missing:
            self.show_waiting()
        limits = self.means.timeout, self.means.memory
        with closing(
            run_all(played, self.means.workers, *limits, self.means.scheduler, alone, urgent)
        ) as results:
            for task, result in results:
                urgent.extend(self.keep(task, result))
                self.show_waiting()

    def leaves_state(self, cell: Cell) -> bool:
        """Whether the engine of a cell needs a new process for each cell."""
        return self.plan.engines[cell.engine].leaves_state

    def keep(self, task: Any, result: Any) -> Iterable[Any]:
        """Write the result of a task and show its status; returns the tasks that can start now."""
        if isinstance(task, Path):  # the file of an exact answer or of a comparison
            return self.scene_tasks.task_ended(task, result)
        if isinstance(task, Cell):
            return self.scene_tasks.cell_ended(self.kept_cell(task, result))
        if isinstance(task, Checking):
            self.progress.done(*keep_check(self.journal, self.plan, task.engine, result))
        elif isinstance(task, KnownAnswer):
            self.progress.done(*keep_known_answer(self.journal, task, result))
        else:
            self.progress.done(*keep_probes(self.journal, self.plan, task, result))
        return ()

    def kept_cell(self, cell: Cell, result: CellResult | Failure) -> dict[str, Any]:
        """Write the result of a cell and show its status; returns the cell's line of the
        journal."""
        scenario = self.scenarios[cell.scene]
        key = cell.key(scene_hash(scenario), self.plan.engines[cell.engine].source)
        line = keep_cell(self.journal, scenario, self.means, cell, key, result)
        shown = f"{line['scenario']}  {cell.engine}  dt {line['dt_s']:.4g} s"
        self.progress.done(shown, line["status"], line["reason"])
        return line

    def show_waiting(self) -> None:
        """When every cell has ended: show for which exact answers the run still waits."""
        if self.scene_tasks.asked and not self.scene_tasks.playing:
            self.progress.say(waiting_for(self.scene_tasks.asked))


def waiting_for(scenes: Sequence[str]) -> str:
    """The sentence part that names the scenes whose exact answer is being computed."""
    more = f" and {len(scenes) - 1} more" if len(scenes) > 1 else ""
    return f"the exact answer to {Path(scenes[0]).stem}{more}"


def begin(plan: RunPlan, journal: Journal, scenarios: Mapping[str, Scenario], tasks: int) -> None:
    """Make the folders, copy the scene files, write the header to the journal and to
    machine.json."""
    folder = journal.path.parent
    for name in ("trajectories", "scenes", "compared"):
        (folder / name).mkdir(exist_ok=True)
    named = {scene: scenarios[scene].name for scene in plan.scenes if scene.endswith(".toml")}
    copies = {
        copy: scene_text(scenarios[scene])
        for scene, name in named.items()
        # if the plan reads the copy itself, the original scene file is gone
        if (copy := stored_scene(folder, name)) != plan.files.get(scene)
    }
    header = plan.header() | {"tasks": tasks, "names": named}
    about_it = folder / "machine.json"
    with writing(folder, [path.relative_to(folder).as_posix() for path in (*copies, about_it)]):
        for path, text in copies.items():
            put_text(path, text)
        put_text(about_it, json.dumps(plain(header), indent=2) + "\n")
    journal.append({"header": header})


def take_timings(
    archive: Archive,
    plan: RunPlan,
    means: Means,
    journal: Journal,
    scenarios: Mapping[str, Scenario],
    progress: Progress,
) -> None:
    """Run the timing pass, unless its result is in the journal; no other task runs meanwhile."""
    cells = cells_to_time(archive, plan.engines, scenarios) if plan.timings else []
    if not cells or is_timed(archive, cells):
        return
    progress.start(1, 1, f"timing, at most {plan.timings:g} s")
    task: dict[Any, Callable[[], Any]] = {"timing": Pass(cells, plan.timings, plan.seed)}
    with closing(run_all(task, 1, plan.timings + means.timeout, means.memory)) as results:
        for _, result in results:
            if isinstance(result, Failure):
                progress.done("timing", result.status, result.reason)
            else:
                for line in result:
                    journal.append(line)
                progress.done("timing")


def delete_unused_trajectories(archive: Archive) -> None:
    """Delete the trajectories of cells that the journal no longer names."""
    named = {record["cell"] for record in archive.records}
    for path in (archive.folder / "trajectories").iterdir():
        if path.stem not in named and RUN.names(f"trajectories/{path.name}"):
            path.unlink()
