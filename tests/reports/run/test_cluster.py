"""Many machines: of a dask cluster a worker may die, or the scheduler go, and nothing is lost."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from crosscheck2d.reports.run.cluster import NoScheduler, connect
from tests.reports.run.small_runs import LONG, cells_in
from tests.reports.run.test_disturbed import again, assert_nothing_lost, begun, undisturbed
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck, wait_for

pytest.importorskip("distributed")
DASK = CROSSCHECK.with_name("dask")


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return undisturbed(LONG, tmp_path_factory.mktemp("long"))


@pytest.mark.long
def test_a_machine_that_dies_takes_no_cell_along(long: Path, tmp_path: Path):
    with cluster(tmp_path) as (scheduler, machines):
        run = begun(*LONG, "--scheduler", scheduler, cwd=tmp_path, cells=3)
        machines[0].kill()
        had = cells_in(tmp_path / "out")
        _, said = run.communicate(timeout=200)

    assert 3 <= had < 24
    assert run.returncode == 0, said
    assert_nothing_lost(tmp_path / "out", long)


@pytest.mark.long
def test_a_scheduler_that_goes_is_one_clear_message_and_the_run_can_be_resumed_here(
    long: Path, tmp_path: Path
):
    with cluster(tmp_path) as (scheduler, _):
        run = begun(*LONG, "--scheduler", scheduler, cwd=tmp_path, cells=3)
    _, said = run.communicate(timeout=200)

    assert run.returncode == 1
    sentence, *_ = said[said.index("the scheduler has gone") :].splitlines()
    assert sentence.startswith("the scheduler has gone. Kept: ")
    assert "Traceback" not in said
    again(LONG, tmp_path)
    assert_nothing_lost(tmp_path / "out", long)


def test_without_the_extra_it_is_one_sentence(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(NoScheduler, match="it needs the package distributed, which is not"):
        connect("tcp://foo:1")


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("here", "--scheduler here: is no address; one is like tcp://192.168.0.7:8786"),
        ("tcp://127.0.0.1:1", "--scheduler tcp://127.0.0.1:1: no scheduler answers there"),
    ],
)
def test_an_address_where_no_scheduler_is_is_one_clear_message(
    tmp_path: Path, address: str, said: str
):
    done = crosscheck("run", "slow_collision", "--scheduler", address, cwd=tmp_path)

    assert done.returncode == 2
    assert done.stderr.startswith(said)
    assert len(done.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())


@contextmanager
def cluster(cwd: Path) -> Iterator[tuple[str, list[subprocess.Popen]]]:
    log = (cwd / "scheduler.log").open("w")
    words = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    processes = [subprocess.Popen([DASK, *words], cwd=cwd, stderr=log)]
    try:
        wait_for(lambda: "Scheduler at:" in (cwd / "scheduler.log").read_text())
        address = re.search(r"tcp://[\d.]+:\d+", (cwd / "scheduler.log").read_text())[0]
        for _ in range(2):
            words = ["worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            processes.append(subprocess.Popen([DASK, *words], cwd=cwd, stderr=subprocess.DEVNULL))
        wait_for(lambda: (cwd / "scheduler.log").read_text().count("Register worker") == 2)
        yield address, processes[1:]
    finally:
        for process in processes:
            process.kill()
            process.wait()
        log.close()
