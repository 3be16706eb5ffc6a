"""Tables made again are the tables made before, and are made anew where something has changed."""

import ast
import shutil
from pathlib import Path

import numpy as np
import pytest

import reports
from adapters.engines import ENGINES
from reports import tables
from reports.archive import Archive
from reports.journal import Journal
from reports.suite import Means, Plan, carry_out
from reports.tables import JUDGES, comparisons_of, make_tables
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


def test_what_is_kept_is_what_was_compared(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """The second time nothing is compared, and every bit is the same, in the file and in what the page is made from."""
    archive = Archive.read(folder)
    computed = []
    measure = tables.compare
    monkeypatch.setattr(tables, "compare", lambda *words: computed.append(measure(*words)) or computed[-1])
    make_tables(archive, silent)
    before = (folder / "deviations.csv").read_bytes()
    made = make_tables(archive, silent)

    assert len(computed) == 2
    assert (folder / "deviations.csv").read_bytes() == before
    for one, again in zip(computed, comparisons_of(archive, made)):
        for column in one.table.columns:
            assert np.array_equal(one.table[column], again.table[column], equal_nan=one.table[column].dtype == float), (
                column
            )
        assert [run.name for run in again.middle_runs if run.trajectory] == [run.name for run in again.middle_runs]


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
