"""Runs that are disturbed, and run again: nothing is lost, nothing is made twice, and the tables
have the same bytes as those of a run that nothing disturbed."""

import os
import random
import shutil
import signal
import sqlite3
import subprocess
import time
from pathlib import Path

import pytest

from crosscheck2d.reports.run.results import COMMAND
from crosscheck2d.reports.run.store import FILE, writing
from tests.reports.run.small_runs import LONG, SMALL, cells_in, read
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck, wait_for

pytestmark = pytest.mark.slow  # each is a run or some
TRAJECTORIES = "--trajectories"


def undisturbed(words: list[str], cwd: Path) -> Path:
    done = crosscheck(*words, TRAJECTORIES, "--out", "whole", cwd=cwd)
    assert done.returncode == 0, done.stderr
    return cwd / "whole"


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return undisturbed(SMALL, tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return undisturbed(LONG, tmp_path_factory.mktemp("long"))


def begun(*words: str | Path, cwd: Path, cells: int) -> subprocess.Popen[str]:
    command = [CROSSCHECK, *words, TRAJECTORIES, "--out", "out"]
    run = subprocess.Popen(
        command, cwd=cwd, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_for(lambda: cells_in(cwd / "out") >= cells or run.poll() is not None)
    return run


def assert_nothing_lost(out: Path, whole: Path) -> None:
    assert (out / "deviations.csv").read_bytes() == (whole / "deviations.csv").read_bytes()
    names = sorted(path.name for path in (whole / "trajectories").iterdir())
    assert sorted(path.name for path in (out / "trajectories").iterdir()) == names
    for name in names:
        assert (out / "trajectories" / name).read_bytes() == (
            whole / "trajectories" / name
        ).read_bytes()
    rows = [
        [line.split(",")[:9] for line in (folder / "runs.csv").read_text().splitlines()]
        for folder in (out, whole)
    ]
    assert rows[0] == rows[1]
    assert cells_in(out) == cells_in(whole) > 0


def again(words: list[str], cwd: Path) -> None:
    done = crosscheck(*words, TRAJECTORIES, "--out", "out", cwd=cwd)
    assert done.returncode == 0, done.stderr


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def children_of(parent: int) -> list[int]:
    return [int(pid) for pid in Path(f"/proc/{parent}/task/{parent}/children").read_text().split()]


@pytest.mark.parametrize("times", [2, pytest.param(20, marks=pytest.mark.long)])
def test_a_run_that_is_killed_at_random_is_gone_on_with(small: Path, tmp_path: Path, times: int):
    draw = random.Random(times)
    for _ in range(times):
        command = [CROSSCHECK, *SMALL, TRAJECTORIES, "--timings", "1", "--out", "out"]
        run = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL)
        if draw.random() < 0.8:
            time.sleep(draw.uniform(0.5, 6.0))
        else:
            wait_for(lambda run=run: run.poll() is not None or cells_in(tmp_path / "out") > 3)
        workers = [] if run.poll() is not None else children_of(run.pid)
        run.kill()
        run.wait()
        wait_for(lambda workers=workers: not any(map(alive, workers)))
    again(SMALL, tmp_path)

    assert_nothing_lost(tmp_path / "out", small)


def test_workers_that_are_killed_are_replaced(long: Path, tmp_path: Path):
    run = begun(*LONG, cwd=tmp_path, cells=1)
    killed = 0
    for count in (1, 8, 16):
        wait_for(lambda count=count: cells_in(tmp_path / "out") >= count or run.poll() is not None)
        for pid in children_of(run.pid)[:1] if run.poll() is None else []:
            os.kill(pid, signal.SIGKILL)
            killed += 1

    assert run.wait(300) == 0
    assert killed
    assert_nothing_lost(tmp_path / "out", long)


@pytest.mark.parametrize(
    ("how", "status"),
    [(signal.SIGINT, 130), pytest.param(signal.SIGTERM, 143, marks=pytest.mark.long)],
)
def test_a_signal_keeps_what_has_ended_and_says_how_to_go_on(
    long: Path, tmp_path: Path, how: int, status: int
):
    run = begun(*LONG, "--workers", "1", cwd=tmp_path, cells=3)
    os.killpg(run.pid, how)
    _, said = run.communicate(timeout=60)

    assert run.returncode == status
    assert f"Interrupted. Kept: {cells_in(tmp_path / 'out')} finished cells." in said
    assert "Traceback" not in said
    # 1: of an engine nothing was played yet
    assert crosscheck("report", "out", cwd=tmp_path).returncode in (0, 1)
    again(LONG, tmp_path)
    assert_nothing_lost(tmp_path / "out", long)


def test_two_runs_into_one_folder_are_one(small: Path, tmp_path: Path):
    command = [CROSSCHECK, *SMALL, TRAJECTORIES, "--out", "out"]
    both = [
        subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) for _ in "ab"
    ]
    ended = [(one.communicate()[1], one.returncode) for one in both]

    assert sorted(code for _, code in ended) in ([0, 0], [0, 2])
    assert not [said for said, _ in ended if "Traceback" in said]
    assert_nothing_lost(tmp_path / "out", small)


def test_an_edited_row_is_made_again_and_a_torn_file_is_one_sentence(small: Path, tmp_path: Path):
    out = Path(shutil.copytree(small, tmp_path / "out"))
    with sqlite3.connect(out / FILE) as file:
        file.execute(
            "update results set blob = x'00' where rowid in"
            " (select rowid from results where kind = 'cell' limit 3)"
        )
    file.close()
    done = crosscheck(*SMALL, TRAJECTORIES, "--out", "out", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr.count("is not what was written: it is made again") == 3
    assert_nothing_lost(out, small)

    (out / FILE).write_bytes((out / FILE).read_bytes()[:30_000])
    torn = crosscheck(*SMALL, "--out", "out", cwd=tmp_path)
    assert (torn.returncode, len(torn.stderr.splitlines())) == (2, 1)
    assert "is damaged" in torn.stderr


def test_what_was_played_is_not_played_again_and_other_plans_use_it(small: Path, tmp_path: Path):
    out = Path(shutil.copytree(small, tmp_path / "out"))
    with writing(out, COMMAND) as store:
        before = {key: store.get("cell", key).digest for key in store.rows.keys("cell")}
    words = ["run", "near_miss", "--engine", "pymunk:matched", "--out", "out", "--timings", "0"]
    assert crosscheck(*words, cwd=tmp_path).returncode == 0
    digests = {record["digest"] for record in read(out).records}
    assert len(digests) == 4
    assert digests <= {*before.values()}
    assert set(line.split(",")[0] for line in (out / "runs.csv").read_text().splitlines()[1:]) == {
        "near_miss"
    }
    assert not (out / "trajectories").exists() or not [*(out / "trajectories").iterdir()]

    assert crosscheck(*words, "--fresh", cwd=tmp_path).returncode == 0
    assert not {record["digest"] for record in read(out).records} & digests


@pytest.fixture
def disk(tmp_path: Path):
    place = tmp_path / "disk"
    place.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", str(place)]
    if subprocess.run(words, capture_output=True).returncode:
        pytest.skip("no file system can be mounted")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_full_disk_is_one_sentence_and_what_has_ended_is_kept(disk: Path, tmp_path: Path):
    words = [*SMALL, "--timings", "0", "--out", str(disk / "out")]
    full = crosscheck(*words, cwd=tmp_path)
    had = cells_in(disk / "out")
    subprocess.run(["mount", "-o", "remount,size=40m", str(disk)], check=True)
    more = crosscheck(*words, cwd=tmp_path)

    assert full.returncode == 1
    assert "No space left on device. " in full.stderr
    assert "Traceback" not in full.stderr
    assert 0 < had < 24
    assert more.returncode == 0, more.stderr
    assert cells_in(disk / "out") == 24


def test_a_read_only_folder_is_one_sentence_and_can_be_compared(
    disk: Path, tmp_path: Path, small: Path
):
    subprocess.run(["mount", "-o", "remount,size=40m", str(disk)], check=True)
    shutil.copytree(small, disk / "out")
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
    refused = [
        crosscheck(*SMALL, "--out", str(disk / name), cwd=tmp_path) for name in ("out", "new")
    ]
    compared = crosscheck("diff", str(disk / "out"), str(small), cwd=tmp_path)

    assert [done.returncode for done in refused] == [2, 2]
    assert all("Read-only file system; name a folder" in done.stderr for done in refused)
    assert compared.returncode == 0, compared.stderr
