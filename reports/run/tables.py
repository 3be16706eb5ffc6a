"""The tables of a run, from its rows; a scene whose comparison has a row is not compared again."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import pandas as pd

from crosscheck2d.reports.compare.against import ITSELF
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.run import comparing
from crosscheck2d.reports.run.cells import scene_hash
from crosscheck2d.reports.run.comparing import ANSWER, COMPARED
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.store import FILE, is_usable
from crosscheck2d.reports.run.timing_pass import TABLE, timings
from crosscheck2d.reports.terminal.exits import Unusable
from crosscheck2d.reports.terminal.foreign_text import encoded
from crosscheck2d.scenarios.no_truth import answered


class ComparedScene(NamedTuple):
    """The exact answer to a scene; its part of deviations.csv, or why it could not be made."""

    answer: comparing.ExactAnswer
    table: bytes | Failure


class Tables(NamedTuple):
    """The tables of a run.

    Attributes:
        runs: runs.csv.
        timed: timings.csv.
        scenes: scene -> how it was compared.
        unjudged: name of a scene -> why it is not compared with its answer, or not at all, though
            it should be.
    """

    runs: pd.DataFrame
    timed: pd.DataFrame
    scenes: Mapping[str, ComparedScene]
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
    scenes = compare_scenes(results, say)
    say("writing the tables")
    store, parts, unjudged = results.store, list[bytes](), dict[str, str]()
    for scene, (answer, table) in scenes.items():
        name = results.sources[scene].name
        if answer.lost:
            unjudged[name] = answer.lost
        if isinstance(table, Failure):
            unjudged[name] = not_compared(table)
            parts.append(comparing.csv_of(not_judged(results, scene, table).table))
        else:
            parts.append(table)
    table = joined(parts)
    store.put("run", "table", None, table)
    store.export("deviations.csv", table)
    runs = table_of_runs(results.records)
    store.export("runs.csv", runs.to_csv(index=False))
    timed = timings(results)
    store.export(TABLE, timed.to_csv(index=False, float_format="%.6g"))
    names = set()
    for record in results.records if results.header["trajectories"] else ():
        row = store.get("cell", record["cell"])
        if row is not None and row.blob:
            names.add(name := f"trajectories/{record['cell']}.npz")
            store.export(name, row.blob)
    store.delete_exports("trajectories", names)  # those of other plans
    return Tables(runs, timed, scenes, unjudged)


def joined(parts: Sequence[bytes]) -> bytes:
    """Scene tables as one table, whose header stands only once."""
    rows = [part.partition(b"\n")[2] if number else part for number, part in enumerate(parts)]
    return encoded(b"".join(rows).decode(errors=comparing.PATHS))


def compare_scenes(results: RunResults, say: Callable[[str], None]) -> dict[str, ComparedScene]:
    """Scene -> how it was compared, of those of which any cell has ended. Answers and comparisons
    that have no row are made in worker processes."""
    store, sources, cores = results.store, results.sources, os.cpu_count() or 1
    # As much time as the cells had: it is the same option.
    timeout = max(record["timeout_s"] for record in results.records)
    answers: dict[Any, Callable[[], comparing.ExactAnswer]] = {}
    for scene in results.by_scene:
        row = store.get(ANSWER, comparing.answer_key(sources[scene]))
        if row is None or not is_usable(row, timeout):
            answers[scene] = partial(comparing.compute_answer, sources[scene])
    with closing(run_all(answers, cores, timeout)) as ended:
        for scene, result in ended:
            say(f"answered: {sources[scene].name}")
            key, values = (
                comparing.answer_key(sources[scene]),
                comparing.answer_row(result, timeout),
            )
            store.put(ANSWER, key, *values)
    tasks = {
        scene: comparing.compare_task(store, sources[scene], records)
        for scene, records in results.by_scene.items()
    }
    tables: dict[str, bytes | Failure] = {}
    missing: dict[Any, comparing.CompareTask] = {}
    for scene, (key, task) in tasks.items():
        if row := store.get(COMPARED, key):
            tables[scene] = row.blob
        else:
            missing[scene] = task
    with closing(run_all(missing, cores, timeout)) as ended:
        for scene, result in ended:
            say(f"compared: {sources[scene].name}")
            tables[scene] = result
            if not isinstance(result, Failure):
                store.put(COMPARED, tasks[scene][0], None, result)
    return {scene: ComparedScene(task.answer, tables[scene]) for scene, (_, task) in tasks.items()}


def not_compared(failure: Failure) -> str:
    if failure.status == "timeout":
        return f"the comparison took too long: {failure.reason}"
    return f"the comparison could not be made: {failure.status}: {failure.reason}"


def not_judged(results: RunResults, scene: str, failure: Failure) -> Comparison:
    """What can be shown of a scene whose comparison failed: its runs, with no answer."""
    runs = [results.run(record) for record in results.by_scene[scene]]
    why = not_compared(failure)
    scenario = replace(results.sources[scene].scenario(), truth=None, without_truth=why)
    return Comparison(scenario, None, runs, comparing.rows_not_judged(runs, why, ITSELF))


def comparisons_of(results: RunResults, tables: Tables) -> list[Comparison]:
    """The comparisons in reading order. Only runs at the middle dt have their trajectories, because
    no others are drawn."""
    comparisons = []
    for scene, records in results.by_scene.items():
        answer, compared = tables.scenes[scene]
        if isinstance(compared, Failure):
            comparisons.append(not_judged(results, scene, compared))
            continue
        scenario = answer.put_into(results.sources[scene].scenario())
        scenario, truth = answered(scenario)
        middle = scenario.middle_substeps
        runs = [results.run(record, record["substeps"] == middle) for record in records]
        table = comparing.read_scene_table(compared)
        comparisons.append(Comparison(scenario, truth, runs, table))
    return comparisons


def table_of_runs(records: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """A row for each cell: what was played, status, engine time, settings and versions."""
    columns = [
        *("scenario", "engine", "profile", "dt_s", "seed", "status", "reason", "step", "until_s"),
        *("seconds", "cell"),
    ]
    rows = []
    for record in records:
        settings = [
            f"{name}: asked {'default' if asked is None else asked}, used {used}"
            for name, (asked, used) in record["settings"].items()
        ]
        versions = [f"{name} {version}" for name, version in record["versions"].items()]
        row = {name: record[name] for name in columns}
        rows.append(row | {"settings": "; ".join(settings), "versions": "; ".join(versions)})
    return pd.DataFrame(rows, columns=[*columns, "settings", "versions"])
