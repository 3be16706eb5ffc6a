"""A run that is broken off, on this machine or on many, loses nothing and plays nothing twice."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pandas as pd
import pytest

from reports.archive import Archive
from reports.journal import Journal
from tests.command_line import crosscheck

BIN = Path(sys.executable).parent
SMALL = ["run", "slow_hit", "near_miss", "--engine", "reference:exercise", "--engine", "pymunk"]  # 24 cells of ms
LONG = [
    "run",
    "asteroids",
    "--engine",
    "reference:exercise",
    "--engine",
    "reference:lesson",
    "--engine",
    "pymunk",
    "--engine",
    "box2d",
]  # 24 cells of 0.4 s


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of `SMALL` that nothing disturbed."""
    cwd = tmp_path_factory.mktemp("small")
    assert crosscheck(*SMALL, "--out", "whole", cwd=cwd).returncode == 0
    return cwd / "whole"


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of `LONG` that nothing disturbed."""
    cwd = tmp_path_factory.mktemp("long")
    assert crosscheck(*LONG, "--out", "whole", cwd=cwd).returncode == 0
    return cwd / "whole"


def assert_nothing_lost(out: Path, whole: Path) -> None:
    """24 of 24 good cells, none twice in the journal, and the same numbers as if nothing had happened."""
    cells = Counter(line["cell"] for line in lines(out) if "cell" in line)

    assert len(cells) == 24
    assert set(cells.values()) == {1}
    assert set(pd.read_csv(out / "runs.csv").status) == {"ok"}
    assert (out / "deviations.csv").read_bytes() == (whole / "deviations.csv").read_bytes()


def lines(out: Path) -> list[dict]:
    """Of a journal, every one whole."""
    return [json.loads(line) for line in (out / "journal.jsonl").read_text().splitlines()]


def broken_off(whole: Path, out: Path, after: int) -> Path:
    """A copy of a run as a power cut leaves it in the middle of a line of its journal: OUT.part.

    Which of two workers is done first is chance, so the lines are put in order: header, probes, cells.
    """
    part = out.with_name(f"{out.name}.part")
    shutil.copytree(whole, part)
    journal = (part / "journal.jsonl").read_text().splitlines(keepends=True)
    journal.sort(key=lambda line: [f'{{"{kind}"' in line for kind in ("footer", "cell", "conformance", "header")])
    (part / "journal.jsonl").write_text("".join(journal[:after]) + journal[after][:50])
    for name in ("deviations.csv", "runs.csv", "report.html"):
        (part / name).unlink()
    return part


def test_resume_plays_what_a_torn_journal_does_not_have_and_nothing_else(small: Path, tmp_path: Path):
    """Header, 3 conformances and 11 cells are there, half of the next line is not a line."""
    part = broken_off(small, tmp_path / "out", after=15)
    had = len(Archive.read(part).records)
    done = crosscheck("run", "--resume", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert_nothing_lost(tmp_path / "out", small)
    assert lines(tmp_path / "out")[-1]["footer"]["played"] == 24 - had
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_interrupted_run_can_be_reported_and_says_it_is_not_finished(small: Path, tmp_path: Path):
    """Tables and page from what there is; the terminal says how many cells have ended."""
    part = broken_off(small, tmp_path / "out", after=15)
    done = crosscheck("report", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert "Not finished: 11 cells have ended so far" in done.stdout
    assert len(pd.read_csv(part / "runs.csv")) == 11


def test_what_lost_its_trajectory_is_worse_and_is_played_again(small: Path, tmp_path: Path):
    """`diff` sees it, `run --resume` mends it."""
    shutil.copytree(small, tmp_path / "out")
    gone = sorted((tmp_path / "out" / "trajectories").iterdir())[:2]
    for path in gone:
        path.unlink()

    assert crosscheck("diff", small, "out", cwd=tmp_path).returncode == 1
    assert crosscheck("run", "--resume", "out", cwd=tmp_path).returncode == 0
    assert lines(tmp_path / "out")[-1]["footer"]["played"] == 2
    assert (tmp_path / "out" / "deviations.csv").read_bytes() == (small / "deviations.csv").read_bytes()


@pytest.mark.parametrize("line", ["[1, 2]", '{"cell": "0"}', '{"what": 1}'])
def test_a_line_that_is_none_of_ours_is_named(small: Path, tmp_path: Path, line: str):
    """Exit 2 with its number, no traceback."""
    shutil.copytree(small, tmp_path / "out")
    journal = tmp_path / "out" / "journal.jsonl"
    header, *rest = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join([header, line + "\n", *rest]))
    for command in (["report", "out"], ["diff", small, "out"], ["replay", "0", "--out", "out"]):
        done = crosscheck(*command, cwd=tmp_path)
        assert done.returncode == 2
        assert "line 2 " in done.stderr.replace("\n", " ")


def test_a_new_run_does_not_bury_an_interrupted_one(small: Path, tmp_path: Path):
    """Exit 2 with the command that goes on; the folder is as it was."""
    part = broken_off(small, tmp_path / "out", after=15)
    before = (part / "journal.jsonl").read_bytes()
    done = crosscheck(*SMALL, "--out", "out", cwd=tmp_path)

    assert done.returncode == 2
    assert "in which 11 cells have ended" in done.stderr
    assert f"crosscheck run --resume {tmp_path / 'out'}" in done.stderr
    assert (part / "journal.jsonl").read_bytes()[: before.rfind(b"\n") + 1] == before[: before.rfind(b"\n") + 1]


def test_a_second_writer_is_refused_and_a_dead_one_is_no_hindrance(small: Path, tmp_path: Path):
    """The lock is the kernel's: as long as one holds the journal, and no longer."""
    part = broken_off(small, tmp_path / "out", after=15)
    with Journal(part):
        done = [crosscheck(*words, cwd=tmp_path) for words in ((*SMALL, "--out", "out"), ("run", "--resume", "out"))]

    assert [one.returncode for one in done] == [2, 2]
    assert all("is being written by another crosscheck" in one.stderr for one in done)
    Journal(part).__exit__()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "--resume", "nowhere"], "no run is there"),
        (["run", "slow_hit", "--resume", "out"], "it takes no scenarios"),
        (["run", "slow_hit", "--timeout", "inf"], "less than or equal to 1000000"),
        (["run", "slow_hit", "--memory", "10000000000000"], "less than or equal to 1000000000"),
        (["run", "slow_hit", "--memory", "10"], "--memory 10: a worker takes 400 MB"),
        (["run", "slow_hit", "--scheduler", "here"], "--scheduler here: is no address"),
        (["replay", "zzz", "--out", "whole"], "'zzz' is no cell of"),
        (["diff", "whole", "nowhere"], "nowhere: has no journal.jsonl"),
    ],
)
def test_bad_input_is_one_clear_message_and_exit_2(words: list[str], said: str, small: Path):
    """What is wrong and what is allowed; no traceback."""
    if "--scheduler" in words:
        pytest.importorskip("distributed")
    done = crosscheck(*words, cwd=small.parent)

    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in small.parent.iterdir()] == ["whole"]


@pytest.mark.slow
def test_a_parent_that_is_killed_leaves_all_that_had_ended(long: Path, tmp_path: Path):
    """`kill -9` in the middle, then resume: nothing lost, nothing twice, and no worker outlives it."""
    run = subprocess.Popen([BIN / "crosscheck", *LONG, "--out", "out"], cwd=tmp_path, stderr=subprocess.DEVNULL)
    wait_for(lambda: ended_in(tmp_path / "out.part") >= 3)
    workers = children_of(run.pid)
    run.kill()
    run.wait()
    had = ended_in(tmp_path / "out.part")
    done = crosscheck("run", "--resume", "out", cwd=tmp_path)

    assert 3 <= had < 24
    assert workers
    assert not [pid for pid in workers if alive(pid)]
    assert done.returncode == 0, done.stderr
    assert_nothing_lost(tmp_path / "out", long)
    assert lines(tmp_path / "out")[-1]["footer"]["played"] == 24 - had


@pytest.mark.slow
def test_workers_that_are_killed_are_replaced_and_their_cells_played_again(long: Path, tmp_path: Path):
    """`kill -9` of a worker, four times during a run."""
    run = subprocess.Popen([BIN / "crosscheck", *LONG, "--out", "out"], cwd=tmp_path, stderr=subprocess.DEVNULL)
    killed = 0
    for count in (1, 6, 11, 16):
        wait_for(lambda count=count: ended_in(tmp_path / "out.part") >= count or run.poll() is not None)
        for pid in children_of(run.pid)[:1]:
            os.kill(pid, signal.SIGKILL)
            killed += 1

    assert run.wait(120) == 0
    assert killed == 4
    assert_nothing_lost(tmp_path / "out", long)


@pytest.mark.slow
def test_a_machine_that_dies_takes_no_cell_along(long: Path, tmp_path: Path):
    """Two dask workers, of which one is killed in the middle of the run: the other plays its cells, too."""
    pytest.importorskip("distributed")
    with cluster(tmp_path) as (scheduler, machines):
        words = [*LONG, "--out", "out", "--scheduler", scheduler]
        run = subprocess.Popen([BIN / "crosscheck", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
        wait_for(lambda: ended_in(tmp_path / "out.part") >= 3 or run.poll() is not None)
        machines[0].kill()
        had = ended_in(tmp_path / "out.part")
        _, said = run.communicate(timeout=200)

    assert 3 <= had < 24
    assert run.returncode == 0, said
    assert_nothing_lost(tmp_path / "out", long)


@pytest.mark.slow
def test_a_scheduler_that_goes_is_one_clear_message_and_the_run_can_be_resumed_here(long: Path, tmp_path: Path):
    """Exit 1; what was played is kept, and goes on without a cluster."""
    pytest.importorskip("distributed")
    with cluster(tmp_path) as (scheduler, _):
        words = [*LONG, "--out", "out", "--scheduler", scheduler]
        run = subprocess.Popen([BIN / "crosscheck", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
        wait_for(lambda: ended_in(tmp_path / "out.part") >= 3 or run.poll() is not None)
    _, said = run.communicate(timeout=200)

    assert run.returncode == 1
    assert "the scheduler has gone" in said
    assert "Traceback" not in said
    assert crosscheck("run", "--resume", "out", cwd=tmp_path).returncode == 0
    assert_nothing_lost(tmp_path / "out", long)


@pytest.mark.slow
def test_a_full_disk_is_one_clear_message_and_the_run_goes_on_when_there_is_room(small: Path, tmp_path: Path):
    """A tmpfs of 400 kB: exit 1, the journal whole; with more room, resumed to the same numbers."""
    with mounted(tmp_path / "disk", "size=400k") as disk:
        done = crosscheck(*SMALL, "--out", disk / "out", cwd=tmp_path)
        said = done.stderr.splitlines()
        had = len(Archive.read(disk / "out.part").records)
        lines(disk / "out.part")
        subprocess.run(["mount", "-o", "remount,size=40m", disk], check=True)
        again = crosscheck("run", "--resume", disk / "out", cwd=tmp_path)

        assert done.returncode == 1
        assert [line for line in said if "No space left on device" in line]
        assert "Traceback" not in done.stderr
        assert 0 < had < 24
        assert again.returncode == 0, again.stderr
        assert_nothing_lost(disk / "out", small)


def test_a_folder_that_cannot_be_written_is_one_clear_message(small: Path, tmp_path: Path):
    """A tmpfs that is mounted read-only: exit 2, also for a report there."""
    with mounted(tmp_path / "disk", "size=40m") as disk:
        shutil.copytree(small, disk / "had")
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        done = [
            crosscheck(*words, cwd=tmp_path) for words in ((*SMALL, "--out", disk / "out"), ("report", disk / "had"))
        ]

    assert [one.returncode for one in done] == [2, 2]
    assert all("Read-only file system" in one.stderr for one in done)
    assert not [one for one in done if "Traceback" in one.stderr]


@contextmanager
def mounted(where: Path, options: str) -> Iterator[Path]:
    """A small file system in memory; skips the test where it may not be mounted."""
    where.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", where], capture_output=True).returncode:
        pytest.skip("mounting a tmpfs takes root")
    try:
        yield where
    finally:
        subprocess.run(["umount", where], check=True)


@contextmanager
def cluster(cwd: Path) -> Iterator[tuple[str, list[subprocess.Popen]]]:
    """The address of a dask scheduler with two workers of one thread, started as the README says."""
    log = (cwd / "scheduler.log").open("w")
    words = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    processes = [subprocess.Popen([BIN / "dask", *words], cwd=cwd, stderr=log)]
    try:
        wait_for(lambda: "Scheduler at:" in (cwd / "scheduler.log").read_text())
        address = re.search(r"tcp://[\d.]+:\d+", (cwd / "scheduler.log").read_text())[0]
        for _ in range(2):
            words = ["worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            processes.append(subprocess.Popen([BIN / "dask", *words], cwd=cwd, stderr=subprocess.DEVNULL))
        wait_for(lambda: (cwd / "scheduler.log").read_text().count("Register worker") == 2)
        yield address, processes[1:]
    finally:
        for process in processes:
            process.kill()
            process.wait()
        log.close()


def ended_in(part: Path) -> int:
    """How many cells have ended, as the journal has it."""
    return (part / "journal.jsonl").read_text().count('"cell"') if (part / "journal.jsonl").exists() else 0


def children_of(parent: int) -> list[int]:
    """The worker processes of a run."""
    found = subprocess.run(["pgrep", "-P", str(parent), "-f", "reports.worker_process"], capture_output=True, text=True)
    return [int(pid) for pid in found.stdout.split()]


def alive(pid: int) -> bool:
    """Whether a process runs, or is at least not yet a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_for(done: Callable[[], bool]) -> None:
    """Until it is done, for two minutes at most."""
    for _ in range(2400):
        if done():
            return
        time.sleep(0.05)
    pytest.fail("nothing happened within two minutes")
