"""Tables made again are the tables made before, and are made anew where something has changed."""

import ast
import os
import shutil
import signal
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import reports
from adapters.engines import ENGINES
from reports import shares, tables
from reports.archive import Archive
from reports.cells import Cell
from reports.journal import JOURNAL, Journal
from reports.shares import JUDGES, Gathering, compared, name_of, share_of
from reports.suite import Means, Plan, carry_out
from reports.tables import NotCompared, comparisons_of, make_tables
from reports.terminal import Progress


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two engines in a scene with thrusts and one without an answer."""
    folder = tmp_path_factory.mktemp("tables")
    engines = {name: ENGINES[name] for name in ("pymunk:shipped", "pymunk:matched")}
    plan = Plan(["slow_hit", "cradle_touching"], engines, seed=0, dts=[], full=False, timings=0, command="test")
    with Journal(folder) as journal, Progress() as progress:
        carry_out(plan, Means(workers=1), journal, progress)
    return folder


def silent(_: str) -> None:
    """Nobody listens."""


def test_all_is_compared_while_it_is_played(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """When the last cell has ended every share is there: the tables are put together, and no worker is asked."""
    monkeypatch.setattr(tables, "share_of", None)
    archive = Archive.read(folder)
    made = make_tables(archive, silent)

    assert {path.parent.name for path in made.shares.values()} == {"compared"}
    assert len(list((folder / "compared").iterdir())) == len(made.shares) == 2


def test_what_is_kept_is_what_was_compared(folder: Path):
    """Every bit is the same in what is compared here and now and in what the page is made from."""
    archive = Archive.read(folder)
    made = make_tables(archive, silent)
    by_scene = tables.ordered(archive)
    computed = [compared(folder, records) for records in by_scene.values()]

    for one, again in zip(computed, comparisons_of(archive, made)):
        for column in one.table.columns:
            assert np.array_equal(one.table[column], again.table[column], equal_nan=one.table[column].dtype == float), (
                column
            )
        assert [run.name for run in again.middle_runs if run.trajectory] == [run.name for run in again.middle_runs]


def test_a_share_that_is_not_there_or_not_whole_is_made_again(folder: Path, tmp_path: Path):
    """As a worker that was killed while it compared, or a parent while it wrote, leaves it: to the same bytes."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    make_tables(Archive.read(copy), silent)
    whole = (copy / "deviations.csv").read_bytes()
    for path in (copy / "compared").iterdir():
        path.with_name(f"{path.name}.new").write_bytes(path.read_bytes()[:100])
        path.unlink()
    make_tables(Archive.read(copy), silent)

    assert (copy / "deviations.csv").read_bytes() == whole
    assert {path.suffix for path in (copy / "compared").iterdir()} == {".csv"}


def test_a_worker_that_is_killed_while_it_compares_loses_nothing(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """`kill -9` once, after the judge has changed: all is compared anew, nothing is played, the bytes are the same."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    before = make_tables(Archive.read(copy), silent).shares
    whole = (copy / "deviations.csv").read_bytes()
    journal = (copy / JOURNAL).read_bytes()
    monkeypatch.setattr(shares, "judge", lambda: "another metric")
    monkeypatch.setattr(tables, "share_of", partial(killed_once, tmp_path / "mark"))
    after = make_tables(Archive.read(copy), silent).shares

    assert (tmp_path / "mark").exists()
    assert not {*before.values()} & {*after.values()}
    assert (copy / "deviations.csv").read_bytes() == whole
    assert (copy / JOURNAL).read_bytes() == journal


def killed_once(mark: Path, folder: Path, records: list) -> bytes:
    """In the worker: what the system does that has no memory left, the first time only."""
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return share_of(folder, records)


def test_a_scene_is_compared_when_its_last_cell_has_ended_and_not_before(folder: Path):
    """Of two scenes with the cells coming in turn, each gives its task with its own last cell, once."""
    archive = Archive.read(folder)
    cells = [Cell(one["scene"], one["seed"], name_of(one), one["substeps"]) for one in archive.records]
    gathering = Gathering(replace(archive, records=[]), cells)
    for path in (folder / "compared").iterdir():
        path.rename(path.with_suffix(".away"))
    made = [(record["scene"], [path.name for path, _ in gathering.ended(record)]) for record in archive.records]
    again = Gathering(archive, cells[:1])
    resumed = [path.name for path, _ in again.whole()]
    for path in (folder / "compared").iterdir():
        path.rename(path.with_suffix(".csv"))
    last = {scene: max(k for k, (which, _) in enumerate(made) if which == scene) for scene, _ in made}

    assert [k for k, (_, paths) in enumerate(made) if paths] == sorted(last.values())
    assert all(len(paths) <= 1 for _, paths in made)
    assert [name.split("-")[0] for name in resumed] == [scene for scene in last if scene != cells[0].scene]
    assert not list(Gathering(archive, []).whole())


def test_a_comparison_that_fails_is_one_clear_sentence(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """It names the scene and what was raised, in the worker; nothing of it is kept."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    for path in (copy / "compared").iterdir():
        path.unlink()
    monkeypatch.setattr(tables, "share_of", fails)

    with pytest.raises(NotCompared, match=r"\w+ could not be compared: ZeroDivisionError: of a metric"):
        make_tables(Archive.read(copy), silent)
    assert not list((copy / "compared").iterdir())


def fails(*_: object) -> bytes:
    """What a metric with a fault does."""
    raise ZeroDivisionError("of a metric")


def test_a_file_that_is_gone_is_found_though_the_table_was_kept(folder: Path, tmp_path: Path):
    """Its cell is an error now, and the share of its scene is made anew."""
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    make_tables(Archive.read(copy), silent)
    record = Archive.read(copy).records[0]
    (copy / "trajectories" / f"{record['cell']}.npz").unlink()
    runs = make_tables(Archive.read(copy), silent).runs

    assert runs[runs.status != "ok"].cell.tolist() == [record["cell"]]
    assert "is missing" in (copy / "deviations.csv").read_text()


def test_every_file_that_judges_is_in_the_hash():
    """All of reports/ that the comparison imports, so that a changed metric is measured again."""
    root = Path(reports.__file__).parent
    found, waiting = set(), {"comparison"}
    while waiting:
        name = waiting.pop()
        found.add(name)
        for node in ast.walk(ast.parse((root / f"{name}.py").read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "reports":
                parts = {alias.name for alias in node.names} if node.module == "reports" else {node.module[8:]}
                waiting |= parts - found

    assert found == set(JUDGES)
