"""What is killed or signalled to stop loses nothing: a worker, the run itself, from outside or by
Ctrl-C."""

import os
import signal
import subprocess
from pathlib import Path

import pytest

from tests.reports.run.sweeps import LONG, assert_nothing_lost, begun, ended_in, lines, undisturbed
from tests.reports.terminal.command_line import crosscheck, wait_for


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of `LONG` that nothing disturbed."""
    return undisturbed(LONG, tmp_path_factory.mktemp("long"))


@pytest.mark.long
def test_a_parent_that_is_killed_leaves_all_that_had_ended(long: Path, tmp_path: Path):
    """`kill -9` in the middle, then resume: nothing lost, nothing twice, and no worker outlives
    it."""
    run = begun(*LONG, cwd=tmp_path, cells=3)
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
def test_workers_that_are_killed_are_replaced_and_their_cells_played_again(
    long: Path, tmp_path: Path
):
    """`kill -9` of a worker, four times during a run; fewer where this process has to wait so long
    for a core that the run ends meanwhile."""
    run = begun(*LONG, cwd=tmp_path, cells=1)
    killed = 0
    for count in (1, 6, 11, 16):
        wait_for(
            lambda count=count: ended_in(tmp_path / "out.part") >= count or run.poll() is not None
        )
        for pid in children_of(run.pid)[:1]:
            os.kill(pid, signal.SIGKILL)
            killed += 1

    assert run.wait(120) == 0
    assert killed
    assert_nothing_lost(tmp_path / "out", long)


@pytest.mark.long
@pytest.mark.parametrize(
    ("how", "code", "word"),
    [(signal.SIGINT, 130, "Interrupted."), (signal.SIGTERM, 143, "Terminated.")],
)
def test_a_run_that_is_signalled_to_stop_keeps_what_was_played_and_says_how_to_go_on(
    long: Path, tmp_path: Path, how: int, code: int, word: str
):
    """Ctrl-C, and what a batch system sends: no worker is left behind, and both commands it names
    do as they say."""
    run = begun(*LONG, "--workers", "1", cwd=tmp_path, cells=3)
    os.killpg(run.pid, how)
    _, said = run.communicate(timeout=60)
    go_on, look = (line.split("crosscheck ")[1].split() for line in said.splitlines()[-2:])

    assert run.returncode == code
    assert word in said
    assert "Traceback" not in said
    with pytest.raises(ProcessLookupError):
        os.killpg(run.pid, 0)
    # 1: of an engine nothing was played yet
    assert crosscheck(*look, cwd=tmp_path).returncode in (0, 1)
    assert crosscheck(*go_on, cwd=tmp_path).returncode == 0
    assert_nothing_lost(tmp_path / "out", long)


def children_of(parent: int) -> list[int]:
    """The worker processes of a run."""
    workers = ["pgrep", "-P", str(parent), "-f", "crosscheck2d.reports.run.worker_process"]
    found = subprocess.run(workers, capture_output=True, text=True)
    return [int(pid) for pid in found.stdout.split()]


def alive(pid: int) -> bool:
    """Whether a process runs, or is at least not yet a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
