"""Tables made again are the tables made before, and are made anew where something has changed."""

import ast
import os
import shutil
import signal
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from reports.run.answers import answer_here, answer_of, no_answer, put_answer, read_answer
from reports.run.archive import Archive
from reports.run.journal import JOURNAL, Journal
from reports.run.scene_tables import (
    ANSWER,
    JUDGE_SOURCE,
    SceneTable,
    SceneTasks,
    answer_file,
    compared,
    name_of,
    scene_table_of,
)
from reports.run.tasks import Means, RunPlan
from reports.run.worker_process import Failure

from adapters.engines import ENGINES
from reports.run import cells, scene_tables, tables
from reports.run.cells import ROOT, Cell
from reports.run.suite import carry_out
from reports.run.tables import comparisons_of, make_tables
from reports.terminal.progress import Progress
from scenarios.catalogue import scenario
from scenarios.truth import cache


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two engines in a scene with thrusts and one without an answer."""
    folder = tmp_path_factory.mktemp("tables")
    engines = {name: ENGINES[name] for name in ("pymunk:shipped", "pymunk:matched")}
    plan = RunPlan(
        ["slow_collision", "cradle_touching"],
        engines,
        seed=0,
        dts=[],
        full=False,
        timings=0,
        command="test",
    )
    with Journal(folder) as journal, Progress() as progress:
        carry_out(plan, Means(workers=1), journal, progress)
    return folder


def silent(_: str) -> None:
    """Nobody listens."""


@pytest.mark.slow
def test_all_is_compared_while_it_is_played(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """When the last cell has ended every scene table is there: the tables are put together, and no
    worker is asked."""
    monkeypatch.setattr(scene_tables, "scene_table_of", None)
    monkeypatch.setattr(scene_tables, "answer_here", None)
    archive = Archive.read(folder)
    made = make_tables(archive, silent)

    assert {path.parent.name for path in made.scene_tables.values()} == {"compared"}
    assert len(list((folder / "compared").glob("*.csv"))) == len(made.scene_tables) == 2
    assert len(list((folder / "compared").glob("*.npz"))) == len(made.answers) == 2


def test_what_is_kept_is_what_was_compared(folder: Path):
    """Every bit is the same in what is compared here and now and in what the page is made from."""
    archive = Archive.read(folder)
    made = make_tables(archive, silent)
    by_scene = tables.ordered(archive)
    computed = [
        compared(folder, records, answer_here(folder, records)) for records in by_scene.values()
    ]

    for one, again in zip(computed, comparisons_of(archive, made)):
        for column in one.table.columns:
            assert np.array_equal(
                one.table[column], again.table[column], equal_nan=one.table[column].dtype == float
            ), column
        assert [run.name for run in again.middle_runs if run.trajectory] == [
            run.name for run in again.middle_runs
        ]


def test_a_share_that_is_not_there_or_not_whole_is_made_again(folder: Path, tmp_path: Path):
    """As a worker that was killed while it compared, or a parent while it wrote, leaves it: to the
    same bytes."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    make_tables(Archive.read(copy), silent)
    whole = (copy / "deviations.csv").read_bytes()
    for path in (copy / "compared").iterdir():
        path.with_name(".crosscheck-1.part").write_bytes(path.read_bytes()[:100])
        path.unlink()
    make_tables(Archive.read(copy), silent)

    assert (copy / "deviations.csv").read_bytes() == whole
    assert {path.suffix for path in (copy / "compared").iterdir()} == {".csv", ANSWER, ".digest"}


def test_a_worker_that_is_killed_while_it_compares_loses_nothing(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """`kill -9` once, after the judge has changed: all is compared anew, nothing is played, the
    bytes are the same."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    before = make_tables(Archive.read(copy), silent).scene_tables
    whole = (copy / "deviations.csv").read_bytes()
    journal = (copy / JOURNAL).read_bytes()
    monkeypatch.setattr(scene_tables, "judge_hash", lambda: "another metric")
    monkeypatch.setattr(scene_tables, "scene_table_of", partial(killed_once, tmp_path / "mark"))
    after = make_tables(Archive.read(copy), silent).scene_tables

    assert (tmp_path / "mark").exists()
    assert not {*before.values()} & {*after.values()}
    assert (copy / "deviations.csv").read_bytes() == whole
    assert (copy / JOURNAL).read_bytes() == journal


def killed_once(mark: Path, *given: Any) -> SceneTable:
    """In the worker: what the system does that has no memory left, the first time only."""
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return scene_table_of(*given)


def test_a_scene_is_answered_then_compared_when_its_last_cell_has_ended_and_not_before(
    folder: Path, tmp_path: Path
):
    """Of two scenes with the cells coming in turn, each gives its task with its own last cell,
    once, then the next."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    whole = {path: path.read_bytes() for path in (copy / "compared").iterdir()}
    for path in whole:
        path.unlink()
    archive = Archive.read(copy)
    cells = [
        Cell(one["scene"], one["seed"], name_of(one), one["substeps"]) for one in archive.records
    ]
    scene_tasks = SceneTasks(replace(archive, records=[]), cells, 60.0, pytest.fail)
    made = [(record["scene"], [*scene_tasks.cell_ended(record)]) for record in archive.records]
    last = {
        scene: max(k for k, (which, _) in enumerate(made) if which == scene) for scene, _ in made
    }
    resumed = [path.name for path, _ in SceneTasks(archive, cells[:1], 60.0, pytest.fail).tasks()]
    first = [task for _, tasks in made for task in tasks]
    assert scene_tasks.asked == list(last)  # which the person who waits is shown
    assert not scene_tasks.playing
    then = [task for path, work in first for task in scene_tasks.task_ended(path, work())]
    after = [task for path, work in then for task in scene_tasks.task_ended(path, work())]

    assert [k for k, (_, tasks) in enumerate(made) if tasks] == sorted(last.values())
    assert all(len(tasks) <= 1 for _, tasks in made)
    assert [name.split("-")[0] for name in resumed] == [
        scene for scene in last if scene != cells[0].scene
    ]
    assert [path.suffix for path, _ in (*first, *then)] == [ANSWER] * 2 + [".csv"] * 2
    assert (
        after == list(SceneTasks(archive, [], 60.0, pytest.fail).tasks()) == scene_tasks.asked == []
    )
    assert {path: path.read_bytes() for path in (copy / "compared").glob("*.csv")} == {
        path: text for path, text in whole.items() if path.suffix == ".csv"
    }


def test_a_comparison_that_fails_is_a_row_a_run_and_leaves_the_other_scene(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """It says what was raised, in the worker; the scene is held to no answer; nothing of it is
    kept."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    for path in (copy / "compared").glob("slow_collision*.csv"):
        path.unlink()
    monkeypatch.setattr(scene_tables, "scene_table_of", fails)
    archive = Archive.read(copy)
    made = make_tables(archive, silent)
    table = pd.read_csv(copy / "deviations.csv")
    said = table[table.scenario == "slow_collision"]
    one, other = comparisons_of(archive, made)

    assert made.unjudged == {"slow_collision": WHY}
    assert set(said.metric) == {"status"}
    assert set(said.note) == {f"not judged: {WHY}"}
    assert len(said) == len(one.runs)
    assert (one.truth, one.scenario.without_truth) == (None, WHY)
    assert len(other.table) == (table.scenario == "cradle_touching").sum() > len(other.runs)
    assert not list((copy / "compared").glob("slow_collision*.csv"))


WHY = "the comparison could not be made: error: ZeroDivisionError: of a metric"


def test_what_took_too_long_is_had_again_only_with_more_time(folder: Path, tmp_path: Path):
    """An answer that was not had in 5 s is not tried again within 5 s; within 6 s it is, and all is
    as it was."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    whole = (copy / "deviations.csv").read_bytes() if (copy / "deviations.csv").exists() else b""
    archive = replace(
        Archive.read(copy), records=[r | {"timeout_s": 5.0} for r in Archive.read(copy).records]
    )
    (records,) = [
        records for scene, records in tables.ordered(archive).items() if scene == "slow_collision"
    ]
    put_answer(answer_file(copy, records), no_answer(Failure("timeout", "stopped after 5 s"), 5.0))
    without = make_tables(archive, silent)
    table = pd.read_csv(copy / "deviations.csv")
    said = table[(table.scenario == "slow_collision") & (table.metric == "status")]
    again = make_tables(
        replace(archive, records=[r | {"timeout_s": 6.0} for r in archive.records]), silent
    )

    assert without.unjudged == {
        "slow_collision": "the exact answer took longer than 5 s (--timeout)"
    }
    assert set(said.versus) == {"truth"}
    assert len(said) == len(records)
    assert "truth" not in set(
        table[(table.scenario == "slow_collision") & (table.metric != "status")].versus
    )
    # laws and engines are judged
    assert len(table[(table.scenario == "slow_collision") & (table.metric != "status")])
    assert again.unjudged == {}
    assert whole in (b"", (copy / "deviations.csv").read_bytes())


@pytest.mark.parametrize("name", ["line_gas", "falling_box", "cradle_touching"])
def test_an_answer_comes_back_from_its_file_bit_for_bit(tmp_path: Path, name: str):
    """All its arrays, where and why it ends; of none why there is none; a torn file is none."""
    one = answer_of(scenario(name))
    put_answer(tmp_path / "answer.npz", one)
    back = read_answer(tmp_path / "answer.npz")
    text = (tmp_path / "answer.npz").read_bytes()
    (tmp_path / "answer.npz").write_bytes(text[:-20])

    assert back is not None
    assert back[1:] == one[1:]
    assert bits(back.record) == bits(one.record)
    assert read_answer(tmp_path / "answer.npz") is None


def bits(one: Any) -> Any:
    """All that a record holds, arrays as bytes, whatever fields it has."""
    if is_dataclass(one):
        return [bits(getattr(one, each.name)) for each in fields(one)]
    return one.tobytes() if isinstance(one, np.ndarray) else one


def fails(*_: object) -> SceneTable:
    """What a metric with a fault does."""
    raise ZeroDivisionError("of a metric")


def test_a_file_that_is_gone_is_found_though_the_table_was_kept(folder: Path, tmp_path: Path):
    """Its cell is an error now, and the scene table of its scene is made anew."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    make_tables(Archive.read(copy), silent)
    record = Archive.read(copy).records[0]
    (copy / "trajectories" / f"{record['cell']}.npz").unlink()
    runs = make_tables(Archive.read(copy), silent).runs

    assert runs[runs.status != "ok"].cell.tolist() == [record["cell"]]
    assert "is missing" in (copy / "deviations.csv").read_text()


def test_all_that_the_comparison_imports_of_reports_is_in_the_folder_that_is_hashed():
    """So that a changed metric is measured again."""
    folder = ROOT / "reports" / "compare"
    imported = {
        node.module or ""
        for path in folder.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom)
    }

    assert JUDGE_SOURCE[0].startswith("reports/compare/")
    assert {name for name in imported if name.startswith("reports")} <= {
        "reports.compare",
        *(f"reports.compare.{path.stem}" for path in folder.rglob("*.py")),
    }


@pytest.mark.parametrize(
    ("file", "hashed"),
    [
        ("adapters/pymunk.py", cells.source_hash),
        ("adapters/own_solver/driver.js", cells.source_hash),
        ("reference_impl/ordered.py", cells.source_hash),
        ("reports/compare/metrics.py", scene_tables.judge_hash),
        ("scenarios/truth/oracle/events.py", scene_tables.judge_hash),
        (
            "scenarios/truth/oracle/events.py",
            lambda root: cache.source_hash(root / "scenarios" / "truth"),
        ),
        (
            "scenarios/truth/horizon.py",
            lambda root: cache.source_hash(root / "scenarios" / "truth"),
        ),
    ],
)
def test_a_file_that_is_moved_into_a_folder_of_its_own_stays_in_the_hash(
    file, hashed, tmp_path: Path
):
    """Else a change of it would be served by results that it did not make."""
    where, moved = (
        tmp_path / "before" / file,
        tmp_path / "after" / Path(file).parent / "deeper" / Path(file).name,
    )
    for root in ("before", "after"):
        for top in ("adapters", "reference_impl", "scenarios", "reports"):
            shutil.copytree(
                ROOT / top,
                tmp_path / root / top,
                ignore=shutil.ignore_patterns("out", "__pycache__"),
            )
    moved.parent.mkdir()
    (tmp_path / "after" / file).rename(moved)
    at_first = hashed(tmp_path / "before"), hashed(tmp_path / "after")
    for path in (where, moved):
        path.write_text(path.read_text() + "\n")
    getattr(hashed, "cache_clear", cache.source_hash.cache_clear)()

    assert hashed(tmp_path / "before") != at_first[0]
    assert hashed(tmp_path / "after") != at_first[1]
