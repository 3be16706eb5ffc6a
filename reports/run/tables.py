"""The tables of a run, from its rows; a scene whose comparison has a row is not compared again."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.reports.compare.against import ITSELF
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.run.cells import scene_hash
from crosscheck2d.reports.run.comparing import (
    ANSWER,
    PATHS,
    SceneTasks,
    csv_of,
    read_scene_table,
    rows_not_judged,
)
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.store import FILE
from crosscheck2d.reports.run.timing_pass import TABLE, timings
from crosscheck2d.reports.terminal.exits import Unusable
from crosscheck2d.reports.terminal.foreign_text import encoded
from crosscheck2d.scenarios.no_truth import answered


class Tables(NamedTuple):
    """The tables of a run.

    Attributes:
        runs: runs.csv.
        timed: timings.csv.
        scenes: the answers, tables and failures of all scenes.
        unjudged: name of a scene -> why it is not compared with its answer, or not at all, though
            it should be.
    """

    runs: pd.DataFrame
    timed: pd.DataFrame
    scenes: SceneTasks
    unjudged: dict[str, str]


def make_tables(results: RunResults, say: Callable[[str], None]) -> Tables:
    """Write deviations.csv, runs.csv, timings.csv, and the trajectories if they were asked for.

    Raises:
        Unusable: no cell has ended, or a scene is not the one that was played.
    """
    if not results.records:
        raise Unusable(f"{results.folder / FILE}: no cell has ended, so there is nothing to report")
    for source in results.sources.values():
        if scene_hash(source.scenario()) != source.digest:
            raise Unusable(
                f"{source.name} has changed since it was played; crosscheck run --out"
                f" {results.folder} plays it again"
            )
    tasks = compare_missing(results, say)
    say("writing the tables")
    store, parts, keys, unjudged = results.store, list[bytes](), dict[str, str](), dict[str, str]()
    for scene in (scene for scene in results.by_scene if scene in tasks.answers):
        name, answer = results.sources[scene].name, tasks.answers[scene]
        if answer.lost:
            unjudged[name] = answer.lost
        if failure := tasks.failed.get(scene):
            unjudged[name] = not_compared(failure)
            parts.append(csv_of(not_judged(results, scene, failure).table))
        else:
            keys[scene], csv = tasks.tables[scene]
            parts.append(csv)
    store.put("run", "comparisons", keys)
    store.export("deviations.csv", joined(parts))
    runs = table_of_runs(results.records)
    store.export("runs.csv", runs.to_csv(index=False))
    timed = timings(results)
    store.export(TABLE, timed.to_csv(index=False, float_format="%.6g"))
    export_trajectories(results)
    return Tables(runs, timed, tasks, unjudged)


def joined(parts: Sequence[bytes]) -> bytes:
    """Scene tables as one table, whose header stands only once."""
    rows = [part.partition(b"\n")[2] if number else part for number, part in enumerate(parts)]
    return encoded(b"".join(rows).decode(errors=PATHS))


def export_trajectories(results: RunResults) -> None:
    """Write the trajectories of the plan, if they were asked for, and delete those of other
    plans."""
    names = {}
    for record in results.records if results.header["trajectories"] else ():
        row = results.store.get("cell", record["cell"])
        if row is not None and row.blob:
            names[f"trajectories/{record['cell']}.npz"] = record
            results.store.export(f"trajectories/{record['cell']}.npz", row.blob)
    results.store.delete_exports("trajectories", names)


def compare_missing(results: RunResults, say: Callable[[str], None]) -> SceneTasks:
    """Compute the answers and compare the scenes that have no row, in worker processes, each within
    its time limit."""
    records = {record["cell"]: record for record in results.records}
    # As much time as the cells had: it is the same option.
    timeout = max(record["timeout_s"] for record in results.records)
    tasks = SceneTasks(results.store, results.cells, results.sources, records, timeout)
    urgent = deque(tasks.tasks(partly=True))
    with closing(run_all({}, os.cpu_count() or 1, timeout, urgent=urgent)) as ended:
        for task, result in ended:
            name = results.sources[tasks.scenes[task]].name
            say(f"{'answered' if task[0] == ANSWER else 'compared'}: {name}")
            urgent.extend(tasks.task_ended(task, result, partly=True))
    return tasks


def not_compared(failure: Failure) -> str:
    """Why a scene is not compared."""
    if failure.status == "timeout":
        return f"the comparison took too long: {failure.reason}"
    return f"the comparison could not be made: {failure.status}: {failure.reason}"


def not_judged(results: RunResults, scene: str, failure: Failure) -> Comparison:
    """What can be shown of a scene whose comparison failed: its runs, with no answer."""
    runs = [results.run(record) for record in results.by_scene[scene]]
    why = not_compared(failure)
    scenario = replace(results.sources[scene].scenario(), truth=None, without_truth=why)
    return Comparison(scenario, None, runs, rows_not_judged(runs, why, ITSELF))


def comparisons_of(results: RunResults, tables: Tables) -> list[Comparison]:
    """The comparisons in reading order. Only runs at the middle dt have their trajectories, because
    no others are drawn."""
    comparisons, scenes = [], tables.scenes
    for scene, records in results.by_scene.items():
        if scene in scenes.failed:
            comparisons.append(not_judged(results, scene, scenes.failed[scene]))
            continue
        scenario = scenes.answers[scene].put_into(results.sources[scene].scenario())
        scenario, truth = answered(scenario)
        middle = scenario.middle_substeps
        runs = [results.run(record, record["substeps"] == middle) for record in records]
        table = read_scene_table(scenes.tables[scene].csv)
        comparisons.append(Comparison(scenario, truth, runs, table))
    return comparisons


def setting_text(name: str, pair: Sequence[Any]) -> str:
    """A setting, its requested value and the value in the engine, in the format of runs.csv."""
    asked, used = pair
    return f"{name}: asked {'default' if asked is None else asked}, used {used}"


def table_of_runs(records: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """A row for each cell: what was played, status, engine time, settings and versions."""
    columns = [
        *("scenario", "engine", "profile", "dt_s", "seed", "status", "reason", "step", "until_s"),
        *("seconds", "cell"),
    ]
    rows = [
        {name: record[name] for name in columns}
        | {
            "settings": "; ".join(
                setting_text(name, pair) for name, pair in record["settings"].items()
            ),
            "versions": "; ".join(f"{name} {one}" for name, one in record["versions"].items()),
        }
        for record in records
    ]
    return pd.DataFrame(rows, columns=[*columns, "settings", "versions"])
