"""The tables of a run, from its rows; a scene whose comparison has a row is not compared again."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
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

RUNS = [
    *("scenario", "engine", "profile", "dt_s", "seed", "status", "reason", "step", "until_s"),
    *("seconds", "cell", "settings", "versions"),
]


class Tables(NamedTuple):
    """The tables of a run.

    Attributes:
        runs: runs.csv.
        timed: timings.csv.
        answers, parts: scene of which any cell has ended -> its exact answer, its part of
            deviations.csv.
        unjudged: name of a scene -> why it is not compared with its answer, or not at all, though
            it should be.
    """

    runs: pd.DataFrame
    timed: pd.DataFrame
    answers: dict[str, comparing.ExactAnswer]
    parts: dict[str, bytes]
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
    compared = compare_scenes(results, say)
    say("writing the tables")
    store, parts, unjudged = results.store, dict[str, bytes](), dict[str, str]()
    answers = {scene: answer for scene, (answer, _) in compared.items()}
    for scene, (answer, table) in compared.items():
        reason = answer.lost
        if isinstance(table, Failure):
            reason = not_compared(table)
            answers[scene] = comparing.ExactAnswer(None, table.status, reason)
            runs = [results.run(record, False) for record in results.by_scene[scene]]
            table = comparing.csv_of(comparing.rows_not_judged(runs, reason, ITSELF))
        parts[scene] = table
        if reason:
            unjudged[results.sources[scene].name] = reason
    rows = [part.partition(b"\n")[2] if k else part for k, part in enumerate(parts.values())]
    whole = encoded(b"".join(rows).decode(errors=comparing.PATHS))
    store.put("run", "table", None, whole)
    store.export("deviations.csv", whole)
    played = table_of_runs(results.records)
    store.export("runs.csv", played.to_csv(index=False))
    timed = timings(results)
    store.export(TABLE, timed.to_csv(index=False, float_format="%.6g"))
    names = set()
    for record in results.records if results.header["trajectories"] else ():
        if file := comparing.file_of(store, record):
            names.add(name := f"trajectories/{record['cell']}.npz")
            store.export(name, file)
    store.delete_exports("trajectories", names)  # those of other plans
    return Tables(played, timed, answers, parts, unjudged)


def comparisons_of(results: RunResults, tables: Tables) -> Iterator[Comparison]:
    """The comparisons in reading order. Only runs at the middle dt have their trajectories, because
    no others are drawn."""
    for scene, answer in tables.answers.items():
        scenario, truth = answered(answer.put_into(results.sources[scene].scenario()))
        middle = scenario.middle_substeps
        runs = [
            results.run(record, record["substeps"] == middle) for record in results.by_scene[scene]
        ]
        yield Comparison(scenario, truth, runs, comparing.read_scene_table(tables.parts[scene]))


def compare_scenes(
    results: RunResults, say: Callable[[str], None]
) -> dict[str, tuple[comparing.ExactAnswer, bytes | Failure]]:
    """Scene -> its exact answer, and its part of deviations.csv, or why that could not be made.
    Answers and comparisons that have no row are made in worker processes."""
    store, sources = results.store, results.sources
    # As much time as the cells had: it is the same option.
    timeout = max(record["timeout_s"] for record in results.records)

    def carry_out(tasks: dict[Any, Any], what: str) -> Iterator[tuple[str, Any]]:
        with closing(run_all(tasks, os.cpu_count() or 1, timeout)) as ended:
            for scene, result in ended:
                say(f"{what}: {sources[scene].name}")
                yield scene, result

    keys = {scene: comparing.answer_key(sources[scene]) for scene in results.by_scene}
    rows = {scene: store.get(ANSWER, key) for scene, key in keys.items()}
    missing = {
        scene: partial(comparing.compute_answer, sources[scene])
        for scene, row in rows.items()
        if row is None or not is_usable(row, timeout)
    }
    for scene, result in carry_out(missing, "answered"):
        store.put(ANSWER, keys[scene], *comparing.answer_row(result, timeout))
    tasks = {
        scene: comparing.compare_task(store, sources[scene], records)
        for scene, records in results.by_scene.items()
    }
    rows = {scene: store.get(COMPARED, key) for scene, (key, _) in tasks.items()}
    tables: dict[str, bytes | Failure] = {scene: row.blob for scene, row in rows.items() if row}
    lacking = {scene: task for scene, (_, task) in tasks.items() if scene not in tables}
    for scene, result in carry_out(lacking, "compared"):
        tables[scene] = result
        if not isinstance(result, Failure):
            store.put(COMPARED, tasks[scene][0], None, result)
    return {scene: (task.answer, tables[scene]) for scene, (_, task) in tasks.items()}


def not_compared(failure: Failure) -> str:
    if failure.status == "timeout":
        return f"the comparison took too long: {failure.reason}"
    return f"the comparison could not be made: {failure.status}: {failure.reason}"


def table_of_runs(records: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """A row for each cell: what was played, status, engine time, settings and versions."""
    runs = pd.DataFrame(records, columns=RUNS)
    runs["settings"] = [
        "; ".join(
            f"{name}: asked {'default' if asked is None else asked}, used {used}"
            for name, (asked, used) in settings.items()
        )
        for settings in runs.settings
    ]
    runs["versions"] = ["; ".join(map(" ".join, versions.items())) for versions in runs.versions]
    return runs
