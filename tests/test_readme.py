"""What the README says to type works as it stands."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from adapters.conformance import PROBES
from adapters.engines import ENGINES
from reports.lessons.catalogue import LESSONS
from scenarios.catalogue import SCENARIOS
from tests.command_line import crosscheck
from tests.solvers.mutants import CORRECT, MUTANTS

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
LINES = [line for kind, block in BLOCKS[1:] if kind == "sh" for line in block.splitlines() if line.strip()]
CLUSTER = [line for line in LINES if "--extra cluster" in line]
COMMANDS = [
    pytest.param(line, marks=[pytest.mark.slow] if " stability " in line else [])  # ten seconds each
    for line in LINES
    if line not in CLUSTER
]
BIN = Path(sys.executable).parent


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the README shows, under the names it gives them."""
    where = tmp_path_factory.mktemp("readme")
    for name, block in re.findall(r"`(\w+\.toml)`[^`]*?:\n\n```toml\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL):
        (where / name).write_text(block)
    solver = ROOT / "tests" / "solvers" / "correct" / "plain.js"
    (where / "class" / "anna").mkdir(parents=True)
    for path in (where, where / "class" / "anna"):
        shutil.copy(solver, path / "Exercise.js")
    return where


def test_the_first_block_is_the_two_commands():
    """They set up and run everything; the gate runs them as they are written."""
    kind, block = BLOCKS[0]

    assert kind == "sh"
    assert block.splitlines() == ["pip install uv && uv run crosscheck", "uv run pytest"]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_readme_succeeds(command: str, folder: Path):
    """Every line of a shell block, run in order in one folder, exits with 0."""
    words = shlex.split(command, comments=True)

    assert words[:2] == ["uv", "run"]
    program, *arguments = words[2:]
    if program == "pytest" and "--solver" not in arguments:
        pytest.skip("runs the tests themselves")
    if program == "crosscheck":
        done = crosscheck(*arguments, cwd=folder)
    else:
        done = subprocess.run([BIN / program, *arguments], cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_three_commands_for_many_machines_play_a_run(tmp_path: Path):
    """Scheduler and worker are started as they are written, but for the address: this machine."""
    pytest.importorskip("distributed")
    scheduler, worker, run = (shlex.split(line)[4:] for line in CLUSTER)
    words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    started = [subprocess.Popen([BIN / scheduler[0], *scheduler[1:], *words], stderr=subprocess.PIPE, text=True)]
    try:
        said = iter(started[0].stderr.readline, "")
        address = next(found[0] for line in said if (found := re.search(r"tcp://[\d.]+:\d+", line)))
        here = [[re.sub(r"tcp://\S+", address, word) for word in words] for words in (worker, run)]
        started.append(subprocess.Popen([BIN / here[0][0], *here[0][1:]], cwd=tmp_path, stderr=subprocess.DEVNULL))
        next(line for line in said if "Register worker" in line)
        done = subprocess.run(
            [BIN / here[1][0], *here[1][1:]], cwd=tmp_path, capture_output=True, text=True, timeout=300
        )
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait()

    assert [scheduler, worker[:2], run[:2]] == [["dask", "scheduler"], ["dask", "worker"], ["crosscheck", "run"]]
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "many" / "report.html").exists()


def test_the_python_blocks_run_one_after_the_other(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """They share their names, as in one session."""
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}

    blocks = [block for kind, block in BLOCKS if kind == "python"]
    assert blocks
    for block in blocks:
        exec(block, names)


def test_the_readme_counts_as_the_tables_do():
    """Scenes, players, probes and lessons are as many as it says."""
    patterns = (r"(\d+) scenes through\s+(\d+) players", r"answers (\d+) probes", r"has (\d+) lessons")
    said = [re.search(pattern, TEXT) for pattern in patterns]

    assert [int(number) for one in said if one for number in one.groups()] == [
        len(SCENARIOS), len(ENGINES), len(PROBES), len(LESSONS),
    ]  # fmt: skip


def test_the_readme_counts_the_solvers_of_the_confusion_table():
    """As many faulty and correct ones as the catalogue has, and the table a row for each."""
    said = re.search(r"what it says of (\d+) solvers with one fault each and of (\d+) without", TEXT)

    assert said is not None
    assert [int(number) for number in said.groups()] == [len(MUTANTS), len(CORRECT)]
    assert len((ROOT / "tests" / "confusion.csv").read_text().splitlines()) == 1 + len(MUTANTS) + len(CORRECT)


def test_every_file_the_readme_names_exists():
    """Paths in backquotes that look like files of the repository are files of the repository."""
    named = set(re.findall(r"`((?:reference_impl|scenarios|adapters|reports|tests|\.ci)/[\w./]*)`", TEXT))

    assert named
    for path in named:
        assert (ROOT / path).exists() or path.startswith("reports/out/"), path  # the latter is there after a run
