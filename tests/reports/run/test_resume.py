"""A run that was broken off is gone on with: nothing is lost, nothing is played twice, nothing is
buried."""

import shutil
from pathlib import Path

import pandas as pd
import pytest

from crosscheck2d.reports.run.archive import Archive
from crosscheck2d.reports.run.journal import Journal
from tests.reports.run.sweeps import SMALL, assert_nothing_lost, broken_off, lines, undisturbed
from tests.reports.terminal.command_line import crosscheck

pytestmark = pytest.mark.slow  # each plays a run twice


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of `SMALL` that nothing disturbed."""
    return undisturbed(SMALL, tmp_path_factory.mktemp("small"))


def test_resume_plays_what_a_torn_journal_does_not_have_and_nothing_else(
    small: Path, tmp_path: Path
):
    """Header, 3 conformances and 11 cells are there, half of the next line is not a line."""
    part = broken_off(small, tmp_path / "out", after=15)
    had = len(Archive.read(part).records)
    done = crosscheck("run", "--resume", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert_nothing_lost(tmp_path / "out", small)
    assert lines(tmp_path / "out")[-1]["footer"]["played"] == 24 - had
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_interrupted_run_can_be_reported_and_says_it_is_not_finished(
    small: Path, tmp_path: Path
):
    """Tables and page from what there is; terminal and page say how many cells have ended. The page
    of the whole run says nothing of it."""
    part = broken_off(small, tmp_path / "out", after=15)
    done = crosscheck("report", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert "Not finished: 11 cells ended so far" in done.stdout
    assert "The run was stopped after 11 cells." in (part / "report.html").read_text()
    assert "The run was stopped" not in (small / "report.html").read_text()
    assert len(pd.read_csv(part / "runs.csv")) == 11


def test_an_engine_that_was_asked_but_has_not_played_yet_does_not_spoil_the_page(
    small: Path, tmp_path: Path
):
    """Broken off after the first cell: the probes of all have ended, one engine has a row."""
    broken_off(small, tmp_path / "out", after=5)
    done = crosscheck("report", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert "Not finished: 1 cell ended so far" in done.stdout
    assert (tmp_path / "out.part" / "report.html").exists()


def test_what_lost_its_trajectory_is_worse_and_is_played_again(small: Path, tmp_path: Path):
    """`diff` sees it, `run --resume` mends it."""
    shutil.copytree(small, tmp_path / "out")
    gone = sorted((tmp_path / "out" / "trajectories").iterdir())[:2]
    for path in gone:
        path.unlink()

    assert crosscheck("diff", small, "out", cwd=tmp_path).returncode == 1
    assert crosscheck("run", "--resume", "out", cwd=tmp_path).returncode == 0
    assert lines(tmp_path / "out")[-1]["footer"]["played"] == 2
    assert (tmp_path / "out" / "deviations.csv").read_bytes() == (
        small / "deviations.csv"
    ).read_bytes()


@pytest.mark.parametrize("line", ["[1, 2]", '{"cell": "0"}', '{"what": 1}'])
def test_a_line_that_is_none_of_ours_is_named(small: Path, tmp_path: Path, line: str):
    """Exit 2 with its number, no traceback."""
    shutil.copytree(small, tmp_path / "out")
    journal = tmp_path / "out" / "journal.jsonl"
    header, *rest = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join([header, line + "\n", *rest]))
    for command in (["report", "out"], ["diff", small, "out"]):
        done = crosscheck(*command, cwd=tmp_path)
        assert done.returncode == 2
        assert "line 2:" in done.stderr.replace("\n", " ")


def test_a_new_run_does_not_bury_an_interrupted_one(small: Path, tmp_path: Path):
    """Exit 2 with the command that goes on; the folder is as it was."""
    part = broken_off(small, tmp_path / "out", after=15)
    before = (part / "journal.jsonl").read_bytes()
    done = crosscheck(*SMALL, "--out", "out", cwd=tmp_path)

    assert done.returncode == 2
    assert "an interrupted run with 11 finished cells" in done.stderr
    assert f"crosscheck run --resume {tmp_path / 'out'}" in done.stderr
    assert (part / "journal.jsonl").read_bytes()[: before.rfind(b"\n") + 1] == before[
        : before.rfind(b"\n") + 1
    ]


def test_a_second_writer_is_refused_and_a_dead_one_is_no_hindrance(small: Path, tmp_path: Path):
    """The lock is the kernel's: as long as one holds the journal, and no longer."""
    part = broken_off(small, tmp_path / "out", after=15)
    with Journal(part):
        done = [
            crosscheck(*words, cwd=tmp_path)
            for words in ((*SMALL, "--out", "out"), ("run", "--resume", "out"))
        ]

    assert [one.returncode for one in done] == [2, 2]
    assert all("is being written by another crosscheck" in one.stderr for one in done)
    Journal(part).__exit__()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "--resume", "nowhere"], "no run is there"),
        (["run", "slow_collision", "--resume", "out"], "it takes no scenarios"),
        (["run", "slow_collision", "--timeout", "inf"], "less than or equal to 1000000"),
        (
            ["run", "slow_collision", "--memory", "10000000000000"],
            "less than or equal to 1000000000",
        ),
        (["run", "slow_collision", "--memory", "10"], "--memory 10: a worker needs 400 MB"),
        (["diff", "whole", "nowhere"], "nowhere: has no journal.jsonl"),
    ],
)
def test_bad_input_is_one_clear_message_and_exit_2(words: list[str], said: str, small: Path):
    """What is wrong and what is allowed; no traceback."""
    done = crosscheck(*words, cwd=small.parent)

    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in small.parent.iterdir()] == ["whole"]
