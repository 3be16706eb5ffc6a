"""The command line as people and scripts use it: files, words, exit status."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES, FETCHED, NAMED
from crosscheck2d.reports.compare.comparison import COLUMNS
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.verdicts import VERDICTS
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.run import arguments
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS
from tests.reports.run.small_runs import read
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck, forked

SCENES = Path(__file__).parents[3] / "tests" / "data" / "scenes"
SMALL = f"run slow_collision near_miss --engine reference --engine pymunk:matched --dt {1 / 60}"
SMALL = SMALL.split()


@pytest.fixture(scope="module")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cwd = tmp_path_factory.mktemp("small")
    done = crosscheck(*SMALL, "--out", "here", cwd=cwd)

    assert done.returncode == 0, done.stderr
    assert str(cwd / "here" / "report.html") in done.stdout
    return cwd / "here"


def test_help_loads_no_number_library():
    code = (
        "import sys; from crosscheck2d.reports.cli import app\n"
        "from typer.testing import CliRunner\n"
        "assert CliRunner().invoke(app, ['run', '--help']).exit_code == 0\nprint([name for"
        " name in ('numpy', 'pandas', 'numba', 'matplotlib', 'pymunk') if name in sys.modules])"
    )

    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip()
        == "[]"
    )


def test_list_explains_everything_that_has_a_name(tmp_path: Path):
    listed = crosscheck("list", cwd=tmp_path).stdout

    for name in (*ENGINES, *SCENARIOS, *METRICS, *VERDICTS, *CASES, *LESSONS):
        assert name in listed


def test_what_reads_only_the_beginning_of_a_list_ends_it_silently(tmp_path: Path):
    words = f"{CROSSCHECK} list | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", words], cwd=tmp_path, capture_output=True, text=True)

    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{len(ENGINES | FETCHED | NAMED)} engines\n"


def test_a_run_that_names_its_engines_fetches_no_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(arguments, "fetch", lambda: pytest.fail("fetched"))
    monkeypatch.setattr(arguments, "missing", lambda _: arguments.ABSENT)
    words = ("run", "slow_collision", "--engine", "pymunk", "--timings", "0", "--out", "out")

    assert crosscheck(*words, cwd=tmp_path).returncode == 0


def test_a_run_writes_its_files(small_run: Path):
    runs = pd.read_csv(small_run / "runs.csv", keep_default_na=False)
    deviations = pd.read_csv(small_run / "deviations.csv")
    results = read(small_run)

    assert list(deviations.columns) == list(COLUMNS)
    assert len(runs) == 2 * 4
    assert set(runs.status) == {"ok"}
    assert {record["cell"] for record in results.records} == set(runs.cell)
    # and the conformance of five engines
    assert sum(map(len, results.header["tasks"].values())) == 8 + 5
    assert results.header["seed"] == 0
    assert results.complete
    assert (small_run / "report.html").stat().st_size < 8e6


def test_tables_are_made_again_from_the_rows(small_run: Path):
    names = ("deviations.csv", "runs.csv")
    before = {name: (small_run / name).read_bytes() for name in names}
    for name in names:
        (small_run / name).unlink()

    assert crosscheck("report", small_run, cwd=small_run.parent).returncode == 0
    assert {name: (small_run / name).read_bytes() for name in names} == before


@pytest.mark.slow
def test_a_scene_nobody_here_wrote_is_played(tmp_path: Path):
    scene = tmp_path / "mine.toml"
    scene.write_text((SCENES / "two.toml").read_text())
    done = crosscheck("run", scene, "--engine", "pymunk", "--out", "out", cwd=tmp_path)
    versus = set(pd.read_csv(tmp_path / "out" / "deviations.csv").versus)
    scene.unlink()

    assert done.returncode == 0, done.stderr
    assert versus == {"itself", "truth", "pymunk:matched"}
    assert crosscheck("report", "out", cwd=tmp_path).returncode == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("run head_on_equl_e1", "'head_on_equl_e1' is not known; did you mean head_on_equal_e1"),
        ("run slow_collision --engine pymonk", "engine 'pymonk' is not known; did you mean pymunk"),
        ("run slow_collision --engine box2d:mached", "did you mean box2d:matched"),
        ("run slow_collision --dt 0.007", "--dt 0.007 does not fit slow_collision"),
        ("run slow_collision --dt -1", "--dt -1 does not fit slow_collision"),
        ("run slow_collision --dt nan", "--dt nan does not fit slow_collision"),
        ("run nowhere.toml", "nowhere.toml"),
        ("run slow_collision --seed -1", "--seed"),
        ("list engine", "did you mean engines"),
        ("truth asteroid", "scenario 'asteroid' is not known; did you mean asteroids"),
        ("truth nowhere.toml", "nowhere.toml"),
        ("report nowhere", "nowhere: has no results.sqlite"),
        ("fly", "fly"),
    ],
)
def test_bad_input_is_one_clear_message_and_exit_2(words: str, said: str, tmp_path: Path):
    done = crosscheck(*words.split(), cwd=tmp_path)

    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_truth_prints_the_exact_answer(tmp_path: Path):
    reported, listed = (
        crosscheck("truth", "line_gas", *more, cwd=tmp_path).stdout for more in ([], ["--events"])
    )
    for word in ("closed form", "horizon", "error bound", "258 more: --events"):
        assert word in reported
    assert len(listed.splitlines()) > 272
    assert "listed by disk, not in their order" not in listed
    row = crosscheck("truth", "cradle_touching", cwd=tmp_path).stdout
    assert "Collisions at one instant are listed by disk, not in their order." in row
    answer = json.loads(crosscheck("truth", "asteroids", "--json", cwd=tmp_path).stdout)
    assert answer["method"] in ("certified", "two-precision")
    assert (answer["horizon_s"], answer["reason"], len(answer["collisions"])) == (10.0, "", 20)


def test_truth_prints_the_state_of_each_disk_at_a_time(tmp_path: Path):
    text = crosscheck("truth", "free_fall", "--at", "0.5", cwd=tmp_path).stdout
    assert "at 0.5 s" in text
    assert "spin, rad/s" in text
    stacked = str(SCENES / "break.toml")
    early = json.loads(crosscheck("truth", stacked, "--at", "0", "--json", cwd=tmp_path).stdout)
    cue = early["state"]["disks"][0]
    assert cue["velocity_m_s"] == [1.0, 0.0]
    late = crosscheck("truth", stacked, "--at", "1.9", cwd=tmp_path)
    assert (late.returncode, late.stdout) == (1, "")
    assert "no exact answer at 1.9 s: disks 0, 1, 2 touch at once" in late.stderr
    never = crosscheck("truth", stacked, "--at=-1", cwd=tmp_path)
    assert (never.returncode, never.stdout) == (2, "")
    assert "--at -1: must be from 0 to" in never.stderr


def test_truth_says_why_there_is_none(tmp_path: Path):
    thrust = "disk = 0\nstart = 0\nstop = 2\nforce = [1, 0]\nframe = 'body'\n"
    turning = f"{(SCENES / 'two.toml').read_text()}\n[[thrust]]\n{thrust}"
    (tmp_path / "turning.toml").write_text(turning)
    done = crosscheck("truth", "turning.toml", "--at", "1.5", cwd=tmp_path)

    assert done.returncode == 1
    assert "while a thrust that turns with it acts" in done.stderr


@pytest.mark.parametrize("terminal", [True, False])
def test_who_waits_for_an_exact_answer_sees_so_on_a_terminal_only(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    with Progress() as progress:
        progress.say("the exact answer to it")
    assert ("the exact answer to it" in capsys.readouterr().err) == terminal


@pytest.mark.parametrize(
    "words", [["run", "--out", "new"], ["truth"], ["stability", "--vary", "speed"], ["play"]]
)
def test_a_pipe_for_a_scene_hangs_no_command(words: list[str], tmp_path: Path):
    os.mkfifo(tmp_path / "pipe.toml")
    done = forked(words[0], "pipe.toml", *words[1:], cwd=tmp_path)
    assert done.returncode == 2
    assert "pipe.toml: is a pipe or a device; must be a readable TOML file" in done.stderr
    assert "Traceback" not in done.stderr


def test_truth_tells_what_comes_to_rest_and_all_outcomes(tmp_path: Path):
    reported = crosscheck("truth", str(SCENES / "settles.toml"), cwd=tmp_path).stdout
    assert "comes to rest" in reported
    broken = crosscheck("truth", str(SCENES / "break.toml"), cwd=tmp_path).stdout
    for words in (
        "Outcome 2 of 2; none is the truth",
        "0: (-0.125, -0.216506)",
        "0: (-0.125, 0.216506)",
        "still known",
    ):
        assert words in broken
    answer = json.loads(
        crosscheck("truth", str(SCENES / "break.toml"), "--json", cwd=tmp_path).stdout
    )
    assert len(answer["outcomes"]) == 2
    assert answer["outcomes"][0]["order"]
    assert any("momentum" in said for said in answer["still_known"])


def test_all_faults_of_all_scene_files_come_at_once(tmp_path: Path):
    (tmp_path / "a.toml").write_text(
        (SCENES / "two.toml").read_text().replace("radius = 0.25", "radius = -0.25")
    )
    (tmp_path / "b.toml").write_text("name = 3\n")
    done = crosscheck("run", "a.toml", "b.toml", cwd=tmp_path)

    assert done.returncode == 2
    assert "a.toml: disk[0].radius = -0.25: must be positive" in done.stderr
    assert "b.toml: name = 3" in done.stderr


def test_a_scene_file_may_not_take_a_name_that_is_taken(tmp_path: Path):
    (tmp_path / "mine.toml").write_text(
        (SCENES / "two.toml").read_text().replace('"two-disks"', '"slow_collision"')
    )
    done = crosscheck("run", "mine.toml", cwd=tmp_path)

    assert done.returncode == 2
    assert "taken by a scenario of the catalogue" in done.stderr


def test_a_folder_that_holds_something_else_is_left_alone(small_run: Path, tmp_path: Path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("years of work")
    (small_run / "note.txt").write_text("mine")
    done = (
        crosscheck(*SMALL, "--out", "out", cwd=tmp_path),
        crosscheck(*SMALL, "--out", small_run, cwd=tmp_path),
    )
    (small_run / "note.txt").unlink()

    assert [one.returncode for one in done] == [2, 2]
    assert "thesis.txt" in done[0].stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["thesis.txt"]


@pytest.mark.slow
def test_an_earlier_run_is_replaced_as_a_whole(small_run: Path):
    again = crosscheck(
        "run", "near_miss", "--engine", "pymunk:matched", "--out", "here", cwd=small_run.parent
    )

    assert again.returncode == 0
    assert set(pd.read_csv(small_run / "runs.csv").scenario) == {"near_miss"}
    assert [path.name for path in small_run.parent.iterdir()] == ["here"]
