"""What commands print fits a terminal of 80 and of 60 columns, and a pipe: no line is wider, no
number is cut, no table wraps."""

import re
import shutil
from math import nan
from pathlib import Path

import pytest
from rich.cells import cell_len
from rich.table import Table

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.command import print_limits
from crosscheck2d.reports.stability.limits import LIMIT, NEVER_FAILS, NEVER_WORKS, Limit, Trial
from crosscheck2d.reports.terminal.console import Console, print_list, print_table, print_texts
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import say
from crosscheck2d.reports.terminal.progress import OneLine, Progress
from tests.reports.terminal.command_line import Done, crosscheck, on_terminal

DATA = Path(__file__).parents[3] / "tests" / "data"
SOLVER = Path(__file__).parents[3] / "tests" / "solvers" / "correct" / "plain.js"
WIDTHS = (80, 60)
CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
COUNT = re.compile(r"\d+/\d+  [\d:-]+ left")
RUN = ("run", "slow_collision", "near_miss", "--dt", str(1 / 60), "--out", "out")


def lines_of(done: Done) -> list[str]:
    return re.split(r"[\r\n]+", CONTROL.sub("", done.stdout))


def faults(lines: list[str], columns: int) -> list[str]:
    code = "The settings that were run:"  # to copy, so that its lines are never broken
    text = lines[: lines.index(code)] if code in lines else lines
    return [line for line in text if cell_len(line) > columns] + [x for x in lines if "…" in x]


def words_of(text: str) -> set[str]:
    return set(text.split())


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cwd = tmp_path_factory.mktemp("runs")
    for out in ("out", "later"):
        done = crosscheck(*RUN[:-1], out, "--engine", "pymunk", "--engine", "box2d_v3", cwd=cwd)
        assert done.returncode == 0, done.stderr
    (cwd / "class" / "anna").mkdir(parents=True)
    shutil.copy(SOLVER, cwd / "class" / "anna" / "Exercise.js")
    return cwd


def assert_fits(columns: int, *words: str | Path, cwd: Path) -> None:
    done = on_terminal(columns, *words, cwd=cwd)
    lines = [line for line in lines_of(done) if str(cwd) not in line]

    assert done.returncode == 0, done.stdout
    assert len(lines) > 5
    assert faults(lines, columns) == []


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (80, ("--help",)),
        pytest.param(80, ("run", "--help"), marks=pytest.mark.slow),
        pytest.param(80, ("list",), marks=pytest.mark.slow),
        (60, ("list",)),
    ],
)
def test_what_is_printed_at_once_fits_its_terminal(words: tuple, columns: int, tmp_path: Path):
    assert_fits(columns, *words, cwd=tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("columns", [60, pytest.param(80, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    "words",
    [
        ("truth", "galperin_31"),
        ("truth", DATA / "scenes" / "break.toml"),
        ("report", "out"),
        ("diff", "out", "later"),
        ("check", "class"),
        pytest.param(("check", SOLVER), marks=pytest.mark.long),
        pytest.param(("advise", "head_on_equal_e09", "--engine", "pymunk"), marks=pytest.mark.long),
        pytest.param(
            ("stability", "slow_collision", "--engine", "pymunk", "--out", "limits"),
            marks=pytest.mark.long,
        ),
        pytest.param(
            ("speed", "free_fall", "--engine", "pymunk", "--out", "speed"), marks=pytest.mark.long
        ),
        ("lesson", "order", "--export", "order.html"),
    ],
    ids=lambda words: f"{words[0]}-{Path(words[1]).stem}",
)
def test_what_takes_its_time_fits_its_terminal(words: tuple, columns: int, runs: Path):
    assert_fits(columns, *words, cwd=runs)


@pytest.mark.slow
@pytest.mark.parametrize("columns", [60, pytest.param(80, marks=pytest.mark.long)])
def test_a_run_counts_on_a_terminal_in_whole_numbers(columns: int, tmp_path: Path):
    done = on_terminal(columns, *RUN, "--engine", "pymunk", cwd=tmp_path)
    lines = lines_of(done)
    counts = [line for line in lines if " left" in line]

    assert done.returncode == 0, done.stdout
    assert counts
    assert all(COUNT.search(line) for line in counts)
    assert faults([line for line in lines if str(tmp_path) not in line], columns) == []
    assert "0/0" not in done.stdout


def test_the_check_of_widths_finds_a_table_that_does_not_fit(capsys: pytest.CaptureFixture[str]):
    table = Table("engine", *("position",) * 6, box=None)
    table.add_row("event_driven:float64", *("6.29×10⁻¹⁵",) * 6)
    Console(width=60).print(table)
    cut = capsys.readouterr().out
    Console(width=120).print(table)
    wide = capsys.readouterr().out

    assert faults(cut.splitlines(), 60)
    assert faults(wide.splitlines(), 80)


def test_a_pipe_gets_results_and_no_progress(tmp_path: Path):
    done = crosscheck(*RUN, "--engine", "pymunk", cwd=tmp_path)

    assert done.stderr == ""
    assert "\x1b" not in done.stdout
    for word in ("writing the page", "0/0", " left", "0:00:0"):
        assert word not in done.stdout


@pytest.mark.parametrize("columns", WIDTHS)
def test_no_number_of_a_table_is_lost_on_a_narrow_terminal(
    columns: int, capsys: pytest.CaptureFixture[str]
):
    rows = [
        [name, *(f"{10.0**-k:.3g}_{row}" for k in range(6))] for row, name in enumerate(ENGINES)
    ]
    headings = ["engine", "a", "b", "c", "d\ne", "a heading", "f"]
    shown = {}
    for width in (columns, 400):
        print_table(Console(width=width), headings, rows, "title")
        shown[width] = capsys.readouterr().out

    assert words_of(shown[columns]) == words_of(shown[400])
    assert faults(shown[columns].splitlines(), columns) == []
    assert shown[400].count("pymunk:matched") == 1


@pytest.mark.parametrize("columns", WIDTHS)
def test_the_limits_of_all_engines_fit(columns: int, capsys: pytest.CaptureFixture[str]):
    trial = Trial(0.00123456, 1, 1, 1.0)
    kinds = {LIMIT: 0.00123456, NEVER_FAILS: nan, NEVER_WORKS: 0.1}
    limits = [
        Limit(case, engine, "quick", kind, nan, fails_at, (trial,))
        for case, (kind, fails_at) in zip(list(CASES)[:3], kinds.items())
        for engine in ENGINES
    ]
    print_limits(Console(width=columns), limits)
    lines = capsys.readouterr().out.splitlines()

    assert faults(lines, columns) == []
    assert sum(line.count("0.00123") for line in lines) == len(ENGINES)
    assert any(line.startswith("everywhere ") and "every value" in line for line in lines)
    assert not any("refused" in line or "works again" in line for line in lines)


@pytest.mark.parametrize("columns", [60, 80, 200])
@pytest.mark.parametrize("total", [9, 123456])
def test_the_progress_leaves_out_words_and_cuts_no_number(
    columns: int, total: int, capsys: pytest.CaptureFixture[str]
):
    console, task = Console(width=columns), "simbenchmark_bouncing  pymunk:matched  dt 0.01667 s"
    lines = []
    with Progress() as progress:
        progress.start(total, total)
        progress.done(task)
        for prepare in (lambda: None, lambda: progress.start(0, 9)):
            prepare()
            progress.say(task)
            console.print(OneLine(console).render(progress.bar.tasks[0]))
            lines += capsys.readouterr().out.rstrip("\n").split("\n")
    counted, uncounted = lines

    assert faults(lines, columns) == []
    assert COUNT.search(counted)
    assert f"1/{total}  " in counted
    assert " s each" in counted
    assert "matched" not in counted or "pymunk:matched  " in counted
    assert "0/" not in uncounted  # neither 0/0 nor a time left


@pytest.mark.parametrize("columns", WIDTHS)
def test_texts_and_lists_wrap_below_themselves(columns: int, capsys: pytest.CaptureFixture[str]):
    console, text = Console(width=columns), "one two three four " * 8
    print_texts(console, {"a name": text, "another name, longer than the others": text}, "title")
    print_list(console, [text, text])
    printed = capsys.readouterr().out

    assert faults(printed.splitlines(), columns) == []
    assert printed.count("three") == 32


def test_a_message_is_folded_between_words_and_a_path_stays_whole(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "24")
    say("scene.toml: no disk moves, so that every one is static, in /a/path/longer/than/a/line")

    assert capsys.readouterr().err.splitlines() == [
        "scene.toml: no disk",
        "moves, so that every one",
        "is static, in",
        "/a/path/longer/than/a/line",
    ]


def test_things_are_counted_in_one_way():
    assert [counted(n, "scene") for n in (0, 1, 2)] == ["0 scenes", "1 scene", "2 scenes"]
    assert [counted(n, "search", "searches") for n in (1, 2)] == ["1 search", "2 searches"]
