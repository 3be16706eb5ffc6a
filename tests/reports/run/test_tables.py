"""Tables made again are the tables made before, and are made anew where something has changed."""

import ast
import os
import shutil
import signal
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from crosscheck2d.reports.run import cells, comparing
from crosscheck2d.reports.run.cells import JUDGE_SOURCE, ROOT, SOURCES
from crosscheck2d.reports.run.comparing import ANSWER, COMPARED, CompareTask, answer_row
from crosscheck2d.reports.run.pool import Failure
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import Store, reading, writing
from crosscheck2d.reports.run.tables import comparisons_of, make_tables
from crosscheck2d.scenarios.truth import cache
from tests.reports.run.small_runs import make

SCENE = Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml"


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("tables") / "out", SCENE)


@pytest.fixture(scope="module")
def folder(played: Path) -> Path:
    folder = Path(shutil.copytree(played, played.parent / "tables"))
    with writing(folder, COMMAND) as store:
        make_tables(RunResults.read(store), silent)
    return folder


@pytest.fixture
def store(folder: Path, tmp_path: Path):
    with writing(Path(shutil.copytree(folder, tmp_path / "out")), COMMAND) as store:
        yield store


def silent(_: str) -> None:
    """Nobody listens."""


def deviations(store: Store) -> bytes:
    return (store.folder / "deviations.csv").read_bytes()


def test_all_is_compared_while_it_is_played(played: Path):
    with reading(played, COMMAND) as store:
        assert [len(store.rows.keys(kind)) for kind in (ANSWER, COMPARED)] == [2, 2]


def test_what_is_kept_is_what_is_compared(store: Store):
    results = RunResults.read(store)
    made = make_tables(results, silent)
    for (scene, records), comparison in zip(
        results.by_scene.items(), comparisons_of(results, made)
    ):
        source = results.sources[scene]
        csv = CompareTask(store, source, records, comparing.compute_answer(source))()

        pd.testing.assert_frame_equal(comparing.read_scene_table(csv), comparison.table)
        assert all(run.trajectory for run in comparison.middle_runs)


def test_tables_that_are_gone_are_made_again_to_the_same_bytes(store: Store):
    whole = deviations(store)
    for kind in (ANSWER, COMPARED):
        for key in store.rows.keys(kind):
            store.rows.delete(kind, key)
    for name in ("deviations.csv", "runs.csv"):
        (store.folder / name).unlink()
    make_tables(RunResults.read(store), silent)

    assert deviations(store) == whole


def test_a_worker_that_is_killed_while_it_compares_loses_nothing(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    whole, before = deviations(store), {*store.rows.keys(COMPARED)}
    monkeypatch.setattr(comparing, "judge_hash", lambda: "another metric")
    monkeypatch.setattr(comparing, "compare_scene", partial(killed_once, tmp_path / "mark"))
    make_tables(RunResults.read(store), silent)

    assert (tmp_path / "mark").exists()
    assert len({*store.rows.keys(COMPARED)} - before) == 2
    assert deviations(store) == whole


COMPARE = comparing.compare_scene


def killed_once(mark: Path, *given: Any) -> bytes:
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return COMPARE(*given)


def test_a_comparison_that_fails_is_a_row_a_run_and_leaves_the_other_scene(
    store: Store, monkeypatch: pytest.MonkeyPatch
):
    results = RunResults.read(store)
    scene = "slow_collision"
    key, _ = comparing.compare_task(store, results.sources[scene], results.by_scene[scene])
    store.rows.delete(COMPARED, key)
    monkeypatch.setattr(comparing, "compare_scene", fails)
    made = make_tables(results, silent)
    table = pd.read_csv(store.folder / "deviations.csv")
    failed = table[table.scenario == "slow_collision"]
    one, other = comparisons_of(results, made)

    assert made.unjudged == {"slow_collision": WHY}
    assert set(failed.metric) == {"status"}
    assert set(failed.note) == {f"not judged: {WHY}"}
    assert len(failed) == len(one.runs)
    assert (one.truth, one.scenario.without_truth) == (None, WHY)
    assert len(other.table) == (table.scenario != "slow_collision").sum() > len(other.runs)


WHY = "the comparison could not be made: error: ZeroDivisionError: of a metric"


def fails(*_: object) -> bytes:
    raise ZeroDivisionError("of a metric")


def test_an_answer_that_took_too_long_is_computed_again_only_with_more_time(store: Store):
    whole = deviations(store)
    results = RunResults.read(store)
    source = results.sources["slow_collision"]
    late = Failure("timeout", "stopped after 5 s")
    store.put(ANSWER, comparing.answer_key(source), *answer_row(late, 5.0))
    for record in results.records:
        record["timeout_s"] = 5.0
    without = make_tables(results, silent)
    table = pd.read_csv(store.folder / "deviations.csv")
    rows = table[table.scenario == "slow_collision"]
    for record in results.records:
        record["timeout_s"] = 6.0
    again = make_tables(results, silent)

    why = "the exact answer took longer than 5 s (--timeout)"
    assert without.unjudged == {"slow_collision": why}
    assert set(rows[rows.metric == "status"].versus) == {"truth"}
    assert "truth" not in set(rows[rows.metric != "status"].versus)
    assert len(rows[rows.metric != "status"])  # laws and engines are judged
    assert again.unjudged == {}
    assert deviations(store) == whole


def test_trajectories_are_exported_when_asked_for(store: Store):
    plan = store.get("run", "plan").value
    results = RunResults.read(store)
    for asked, names in ((True, {record["cell"] for record in results.records}), (False, set())):
        store.put("run", "plan", plan | {"trajectories": asked})
        make_tables(RunResults.read(store), silent)
        assert {path.stem for path in store.folder.glob("trajectories/*.npz")} == names


def engine_source(root: Path) -> str:
    return cells.source_hash(SOURCES, root)


def judge_source(root: Path) -> str:
    return cells.source_hash(JUDGE_SOURCE, root)


def truth_source(root: Path) -> str:
    return cache.source_hash(root / "scenarios" / "truth")


def test_all_that_the_comparison_imports_of_reports_is_in_the_folder_that_is_hashed():
    folder = ROOT / "reports" / "compare"
    imported = {
        node.module or ""
        for path in folder.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom)
    }

    assert JUDGE_SOURCE[0].startswith("reports/compare/")
    assert {name for name in imported if name.startswith("crosscheck2d.reports")} <= {
        "crosscheck2d.reports.compare",
        *(f"crosscheck2d.reports.compare.{path.stem}" for path in folder.rglob("*.py")),
    }


@pytest.mark.parametrize(
    ("file", "hashed"),
    [
        ("adapters/deeper/pymunk.py", engine_source),
        ("adapters/host/guest/deeper/driver.js", engine_source),
        ("reference_impl/deeper/ordered.py", engine_source),
        ("reports/compare/deeper/metrics.py", judge_source),
        ("scenarios/truth/oracle/deeper/events.py", judge_source),
        ("scenarios/truth/oracle/deeper/events.py", truth_source),
        ("scenarios/truth/deeper/horizon.py", truth_source),
    ],
)
def test_a_file_in_a_folder_of_its_own_is_in_the_hash(file, hashed, tmp_path: Path):
    (tmp_path / file).parent.mkdir(parents=True)
    hashes = []
    for text in ("before", "after"):
        (tmp_path / file).write_text(text)
        cells.source_hash.cache_clear()
        cache.source_hash.cache_clear()
        hashes.append(hashed(tmp_path))

    assert hashes[0] != hashes[1]
