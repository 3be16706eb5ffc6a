"""Makes the tables of a run from its journal, scenario by scenario; a stored comparison is not made
again."""

from __future__ import annotations

import hashlib
import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence, Set
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.reports.compare.against import ITSELF
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.run.answers import ExactAnswer, read_answer
from crosscheck2d.reports.run.archive import Archive, archived_run
from crosscheck2d.reports.run.cells import digest
from crosscheck2d.reports.run.folders import RUN
from crosscheck2d.reports.run.journal import JOURNAL
from crosscheck2d.reports.run.runner import run_all
from crosscheck2d.reports.run.scene_tables import (
    ANSWER,
    PATHS,
    SceneTasks,
    answer_file,
    csv_of,
    in_order,
    kept_scene_table,
    name_of,
    read_scene_table,
    rows_not_judged,
    scene_table_file,
)
from crosscheck2d.reports.run.scenes import Records, scenario_of
from crosscheck2d.reports.run.timing_pass import TABLE, timings
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.reports.terminal.exits import say as warn
from crosscheck2d.reports.terminal.foreign_text import encoded, is_part, put_text, whole
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.no_truth import answered
from crosscheck2d.scenarios.regular import all_of

TABLES = ("deviations.csv", "runs.csv", TABLE)


class Tables(NamedTuple):
    """The tables of a run.

    Attributes:
        runs: runs.csv.
        timed: timings.csv.
        answers: scene -> its exact answer, or why there is none.
        scene_tables: scene -> the file of its scene table.
        unkept: scene -> its comparison, if it has no scene table: it could not be made, or a file
            is missing or damaged.
        unjudged: name of a scene -> why it is not compared with its answer, or not at all, though
            it should be.
    """

    runs: pd.DataFrame
    timed: pd.DataFrame
    answers: dict[str, ExactAnswer]
    scene_tables: dict[str, Path]
    unkept: dict[str, Comparison]
    unjudged: dict[str, str]


def make_tables(archive: Archive, say: Callable[[str], None]) -> Tables:
    """Write deviations.csv, runs.csv and timings.csv; unchanged scenes are not compared again.

    Raises:
        ValueError: no cell has ended, or a scene is not the one that was played.
    """
    by_scene, folder = ordered(archive), archive.folder
    if not by_scene:
        raise ValueError(
            f"{folder / JOURNAL}: no cell has ended yet, so there is nothing to report"
        )
    scene_tasks = compare_missing(archive, by_scene, say)
    answers = {
        scene: read_answer(answer_file(folder, records)) for scene, records in by_scene.items()
    }
    known = {scene: answer for scene, answer in answers.items() if answer is not None}
    assert len(known) == len(by_scene)
    scene_tables = {
        scene: scene_table_file(folder, records, known[scene])
        for scene, records in by_scene.items()
    }
    unkept = {
        scene: unkept_comparison(folder, by_scene[scene], known[scene], scene_table)
        for scene, scene_table in (scene_tasks.unkept | scene_tasks.failed).items()
    }
    unjudged = {
        by_scene[scene][0]["scenario"]: answer.lost
        for scene, answer in known.items()
        if answer.lost
    }
    unjudged |= {
        unkept[scene].scenario.name: not_compared(failure)
        for scene, failure in scene_tasks.failed.items()
    }
    say("writing the tables")
    write_deviations(folder, scene_tables, unkept)
    answer_files = {answer_file(folder, records) for records in by_scene.values()}
    delete_stale(folder / "compared", {*scene_tables.values(), *answer_files, seal_of(folder)})
    runs = table_of_runs([record for records in by_scene.values() for record in records], unkept)
    put_text(folder / "runs.csv", runs.to_csv(index=False))
    timed = timings(archive, scenarios_by_name(folder, by_scene))
    put_text(folder / TABLE, timed.to_csv(index=False, float_format="%.6g"))
    return Tables(runs, timed, known, scene_tables, unkept, unjudged)


def scenarios_by_name(folder: Path, by_scene: Mapping[str, Records]) -> dict[str, Scenario]:
    """Name -> scenario, of every scene that was played."""
    scenarios = [scenario_of(folder, records) for records in by_scene.values()]
    return {scenario.name: scenario for scenario in scenarios}


def compare_missing(
    archive: Archive, by_scene: Mapping[str, Records], say: Callable[[str], None]
) -> SceneTasks:
    """Compute the missing answers and scene tables in worker processes, each within its time
    limit."""
    (archive.folder / "compared").mkdir(exist_ok=True)
    # As much time as the cells had: it is the same option.
    scene_tasks = SceneTasks(
        archive, [], max(record["timeout_s"] for record in archive.records), warn
    )
    tasks = deque(scene_tasks.tasks())
    for records in by_scene.values():
        scenario_of(archive.folder, records)  # raises if a scene has changed
    with closing(run_all({}, os.cpu_count() or 1, scene_tasks.timeout, urgent=tasks)) as results:
        for path, result in results:
            name = by_scene[scene_tasks.scenes[path]][0]["scenario"]
            say(f"{'answered' if path.suffix == ANSWER else 'compared'}: {name}")
            tasks.extend(scene_tasks.task_ended(path, result))
    return scene_tasks


def not_compared(failure: Failure) -> str:
    """Why a scene is not compared."""
    if failure.status == "timeout":
        return f"the comparison took too long: {failure.reason}"
    return f"the comparison could not be made: {failure.status}: {failure.reason}"


def unkept_comparison(
    folder: Path, records: Records, answer: ExactAnswer, scene_table: bytes | Failure
) -> Comparison:
    """What can be shown of a scene without a scene table; if its comparison failed, it is compared
    with no answer."""
    runs = [archived_run(folder, record) for record in records]
    scenario = scenario_of(folder, records)
    if isinstance(scene_table, bytes):
        scenario, truth = answered(answer.put_into(scenario))
        return Comparison(scenario, truth, runs, read_scene_table(scene_table))
    why = not_compared(scene_table)
    scenario = replace(scenario, truth=None, without_truth=why)
    return Comparison(scenario, None, runs, rows_not_judged(runs, why, ITSELF))


def comparisons_of(archive: Archive, tables: Tables) -> list[Comparison]:
    """The comparisons in reading order. Only runs at the middle dt have their trajectories, because
    no others are drawn."""
    comparisons = []
    for scene, records in ordered(archive).items():
        if scene in tables.unkept:
            comparisons.append(tables.unkept[scene])
            continue
        scenario, truth = answered(
            tables.answers[scene].put_into(scenario_of(archive.folder, records))
        )
        runs = [
            archived_run(
                archive.folder,
                record,
                with_trajectory=record["substeps"] == scenario.middle_substeps,
            )
            for record in records
        ]
        comparisons.append(
            Comparison(
                scenario,
                truth,
                runs,
                read_scene_table(kept_scene_table(tables.scene_tables[scene])),
            )
        )
    return comparisons


def ordered(archive: Archive) -> dict[str, list[dict[str, Any]]]:
    """Scene -> the lines of its cells, in the requested order of scenes and engines, coarse dt
    first."""
    by_scene: dict[str, list[dict[str, Any]]] = {scene: [] for scene in archive.header["scenes"]}
    for record in archive.records:
        by_scene[record["scene"]].append(record)
    engines = archive.header["engines"]
    return {scene: in_order(records, engines) for scene, records in by_scene.items() if records}


def write_deviations(
    folder: Path, scene_tables: Mapping[str, Path], unkept: Mapping[str, Comparison]
) -> None:
    """Concatenate the scene tables into deviations.csv, and store its digest beside them."""
    all_of_it = hashlib.sha256()
    with whole(folder / "deviations.csv") as file:
        for number, (scene, scene_table) in enumerate(scene_tables.items()):
            csv = csv_of(unkept[scene].table) if scene in unkept else kept_scene_table(scene_table)
            rows = csv.partition(b"\n")[2] if number else csv  # the header only once
            text = encoded(rows.decode(errors=PATHS))
            all_of_it.update(text)
            file.write(text)
    with whole(seal_of(folder)) as file:  # even if there is a pipe at this path
        file.write(all_of_it.hexdigest()[:16].encode())


def seal_of(folder: Path) -> Path:
    """The file with the digest of deviations.csv; `diff` refuses a table with another digest."""
    return folder / "compared" / "deviations.digest"


def is_sealed(folder: Path) -> bool:
    """Whether deviations.csv is unchanged."""
    return all_of(seal_of(folder)) == digest(all_of(folder / "deviations.csv")).encode()


def delete_stale(folder: Path, kept: Set[Path]) -> None:
    """Delete the answers and scene tables that are not in `kept`, and no other file."""
    for other in set(folder.iterdir()) - kept:
        if is_part(other) or RUN.names(f"{folder.name}/{other.name}"):
            other.unlink()


def setting_text(name: str, pair: Sequence[Any]) -> str:
    """A setting, its requested value and the value in the engine, in the format of runs.csv."""
    asked, used = pair
    return f"{name}: asked {'default' if asked is None else asked}, used {used}"


def table_of_runs(
    records: Sequence[dict[str, Any]], unkept: Mapping[str, Comparison]
) -> pd.DataFrame:
    """A row for each cell: what was played, status, engine time, settings and versions."""
    found = {
        (run.scenario, run.name, run.dt): {"status": run.status, "reason": run.reason}
        for comparison in unkept.values()
        for run in comparison.runs
    }
    columns = [
        "scenario",
        "engine",
        "profile",
        "dt_s",
        "seed",
        "status",
        "reason",
        "step",
        "until_s",
        "seconds",
        "cell",
    ]
    rows = [
        {name: record[name] for name in columns}
        | found.get((record["scenario"], name_of(record), record["dt_s"]), {})
        | {
            "until_s": float(record["until_s"]),
            "settings": "; ".join(
                map(setting_text, record["settings"], record["settings"].values())
            ),
            "versions": "; ".join(
                f"{name} {version}" for name, version in record["versions"].items()
            ),
        }
        for record in records
    ]
    return pd.DataFrame(rows, columns=[*columns, "settings", "versions"])
