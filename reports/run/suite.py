"""A run: play scenarios through engines, each cell once, and write every result to the run's folder
at once."""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from adapters.conformance.conform import no_answer
from adapters.engine_row import EngineRow
from adapters.engines import told_apart
from adapters.run import Run
from reports.run.archive import Archive, stored_scene, trajectory_file
from reports.run.cells import Cell, content_key, digest, scene_hash
from reports.run.folders import RUN
from reports.run.journal import Journal, plain
from reports.run.known_answers import KNOWN_ANSWERS, KNOWN_SCENE, KnownAnswer
from reports.run.machine import about
from reports.run.made import writing
from reports.run.playing import CellResult, conform_here, play_here, source_and_versions
from reports.run.runner import TIMEOUT, run_all
from reports.run.scene_tables import SceneTasks
from reports.run.scenes import open_scene, with_steps
from reports.run.timing_pass import Pass, cells_to_time, is_timed
from reports.run.trajectories import from_trail, packed
from reports.run.worker_process import Failure
from reports.terminal.foreign_text import put_bytes, put_text
from reports.terminal.progress import Progress
from scenarios.files.scene_file import scene_text
from scenarios.model import Scenario


class Check(NamedTuple):
    """The verdict of `crosscheck check` on a solver's file.

    Attributes:
        passed: whether it found no fault.
        says: its sentences, the most important first.
        source: `EngineRow.source` of the text that was checked; "" if there is none.
    """

    passed: bool
    says: list[str]
    source: str


class Checking(NamedTuple):
    """The task to check the file of an engine."""

    engine: str


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
        folder: the working directory of the command, to which relative paths belong.
        files: path of a scene -> the file that is read instead, such as the kept copy of a deleted
            file.
        checks: a solver's file of `engines` -> a picklable task that gives its `Check`.
    """

    scenes: Sequence[str]
    engines: Mapping[str, EngineRow]
    seed: int
    dts: Sequence[float]
    full: bool
    timings: float
    command: str
    folder: str = field(default_factory=os.getcwd)
    files: Mapping[str, Path] = field(default_factory=dict)
    checks: Mapping[str, Callable[[], Check]] = field(default_factory=dict)

    def scenario(self, scene: str) -> Scenario:
        """The scenario behind one of `scenes`, with the steps asked for."""
        return with_steps(
            open_scene(str(self.files.get(scene, scene)), self.seed), self.dts, self.full
        )

    def header(self) -> dict[str, Any]:
        """The first line of the journal; when a run is resumed, its `RunPlan` is made from it."""
        lists = {name: list(getattr(self, name)) for name in ("scenes", "engines", "dts")}
        values = {name: getattr(self, name) for name in ("full", "timings", "folder")}
        return about(self.command, self.seed) | lists | values


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


class OtherVersions(Exception):
    """The source or library versions of a worker differ from those of this machine."""


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
            return self.scene_tasks.cell_ended(self.keep_cell(task, result))
        if isinstance(task, Checking):
            self.progress.done(*keep_check(self.journal, self.plan, task.engine, result))
        else:
            self.progress.done(*keep_answer(self.journal, self.plan, task, result))
        return ()

    def keep_cell(self, cell: Cell, result: CellResult | Failure) -> dict[str, Any]:
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


def tasks_of(plan: RunPlan, scenarios: Mapping[str, Scenario]) -> dict[Any, Callable[[], Any]]:
    """Task -> the picklable function that carries it out. A task is an engine's name (its probes),
    a `Checking`, a `KnownAnswer` or a `Cell`."""
    tasks: dict[Any, Callable[[], Any]] = {
        name: partial(conform_here, name, row) for name, row in plan.engines.items()
    }
    tasks |= {Checking(name): check for name, check in plan.checks.items()}
    if KNOWN_SCENE in plan.scenes:
        tasks |= {answer: answer.reproduce for answer in KNOWN_ANSWERS}
    for scene, scenario in scenarios.items():
        question = replace(scenario, truth=None)  # an engine does not get the exact answer
        for name in told_apart(plan.engines, scenario.scene):
            for cell in (Cell(scene, plan.seed, name, k) for k in scenario.substeps):
                tasks[cell] = partial(play_here, cell, plan.engines[name], question)
    return tasks


def finished_tasks(
    archive: Archive, plan: RunPlan, means: Means, scenarios: Mapping[str, Scenario]
) -> set[Any]:
    """The tasks that have a result in the journal, with the same scene, settings and versions.

    A cell is played again if it was stopped at a shorter time limit than the present one, if its
    trajectory is missing or damaged, or if it failed for a reason outside the engine.
    """
    keys = {
        line["of"]: line["key"] for line in (*archive.conformance.values(), *archive.known_answers)
    }
    asked: tuple[KnownAnswer | str, ...] = (*plan.engines, *KNOWN_ANSWERS)
    done: set[Any] = {task for task in asked if keys.get(name_of(task)) == answer_key(plan, task)}
    done |= {
        Checking(name)
        for name, line in archive.checked.items()
        if name in plan.engines and line["key"] == answer_key(plan, name)
    }
    hashes = {scene: scene_hash(scenario) for scene, scenario in scenarios.items()}
    for record in archive.records:
        cell = Cell(
            record["scene"],
            record["seed"],
            f"{record['engine']}:{record['profile']}",
            record["substeps"],
        )
        if cell.scene not in hashes or cell.engine not in plan.engines:
            continue
        stopped = record["status"] == "timeout" and record["timeout_s"] < means.timeout
        lost = record["damage"]  # its trajectory is missing or damaged
        same = record["cell"] == cell.key(hashes[cell.scene], plan.engines[cell.engine].source)
        if same and not (stopped or lost or record["outside"]):
            done.add(cell)
    return done


def name_of(task: KnownAnswer | str) -> str:
    """The name in the journal of an engine's probes or of a known answer."""
    return task if isinstance(task, str) else repr(task)


def answer_key(plan: RunPlan, task: KnownAnswer | str) -> str:
    """The `content_key` of the probes of an engine, or of a known answer."""
    return content_key(name_of(task), plan.engines[task].source if isinstance(task, str) else "")


def keep_answer(
    journal: Journal, plan: RunPlan, task: KnownAnswer | str, result: Any
) -> tuple[str, str, str]:
    """Write the result of a known answer or of an engine's probes to the journal; returns the
    task in words, its status, and the reason of a failure."""
    failure = result if isinstance(result, Failure) else None
    status, reason = (failure.status, failure.reason) if failure else ("ok", "")
    if isinstance(task, KnownAnswer):
        line: dict[str, Any] = {
            "known_answer": asdict(task) | {"ours_J2": float("nan") if failure else result}
        }
        said = f"known answer: {task.column} at dt {task.dt_s:g} s"
    else:
        findings = [no_answer(task, status, reason)] if failure else result
        line = {"conformance": [asdict(finding) for finding in findings]}
        said = f"conformance of {task}"
    # No key matches "": a failure outside the engine is tried again when the run is resumed.
    key = "" if failure and failure.outside else answer_key(plan, task)
    journal.append(line | {"of": name_of(task), "key": key})
    return said, status, reason


def keep_check(
    journal: Journal, plan: RunPlan, engine: str, result: Check | Failure
) -> tuple[str, str, str]:
    """Write the verdict of `crosscheck check` on an engine's file to the journal; returns the task
    in words, its status, and the reason of a failure."""
    said, status, reason = f"check of {engine}", "ok", ""
    passed, says, key = False, ["It was saved while the run began: check it by itself."], ""
    if isinstance(result, Failure):
        says = [f"It could not be checked: {result.reason}"]
        status, reason = result.status, result.reason
    elif result.source == plan.engines[engine].source:
        passed, says, key = result.passed, result.says, answer_key(plan, engine)
    # No key matches "": the file is checked again when the run is resumed.
    journal.append({"checked": {"passed": passed, "says": says}, "of": engine, "key": key})
    return said, status, reason


def keep_cell(
    journal: Journal,
    scenario: Scenario,
    means: Means,
    cell: Cell,
    key: str,
    result: CellResult | Failure,
) -> dict[str, Any]:
    """Write the trajectory of the cell with this `key`, then its line, which is returned."""
    played = failed(cell, scenario, result) if isinstance(result, Failure) else result
    run, samples = played.run, played.samples
    if played.played_by != source_and_versions():
        raise OtherVersions(
            "a worker has other versions or other source of the engines than this machine"
        )
    path = trajectory_file(journal.path.parent, key)
    if played.file:
        put_bytes(path, played.file)
    record = {
        "cell": key,
        "scene_hash": scene_hash(scenario),
        "scene": cell.scene,
        "seed": cell.seed,
        "substeps": cell.substeps,
        "scenario": run.scenario,
        "engine": run.engine,
        "profile": run.profile,
        "dt_s": run.dt,
        "status": run.status,
        "reason": run.reason,
        "step": (samples - 1) * cell.substeps if samples else -1,
        "until_s": float(scenario.times[samples - 1]) if samples else float("nan"),
        "seconds": run.seconds,
        "timeout_s": means.timeout,
        "outside": isinstance(result, Failure) and result.outside,
        "file": digest(played.file) if played.file else "",
        "settings": run.settings,
        "versions": run.versions,
    }
    journal.append(record)
    return record


def failed(cell: Cell, scenario: Scenario, failure: Failure) -> CellResult:
    """The result of a cell whose worker died or was stopped, with the states up to that time."""
    trajectory = from_trail(failure.trail, scenario)
    samples = len(trajectory) if trajectory else 0
    last = (
        f"; last good state: step {(samples - 1) * cell.substeps},"
        f" {scenario.times[samples - 1]:g} s"
        if samples
        else ""
    )
    run = Run(
        *cell.names,
        scenario.name,
        scenario.dt(cell.substeps),
        failure.status,
        failure.reason + last,
    )
    return CellResult(
        run, samples, packed(trajectory) if trajectory else b"", source_and_versions()
    )


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
