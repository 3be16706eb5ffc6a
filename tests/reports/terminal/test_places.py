"""Places with other letters, few letters, and streams that nobody reads: a sentence each, and
nothing is lost."""

import os
import shutil
import subprocess
from pathlib import Path

import pandas as pd
import pytest

from tests.reports.terminal.command_line import CROSSCHECK

SCENE = Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml"
# numba takes no such names
SOLVER = Path(__file__).parents[3] / "tests" / "solvers" / "correct" / "plain.py"
REFUSED = "cannot write to standard output: "


def shell(line: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[bytes]:
    variables = os.environ | {"C": str(CROSSCHECK)} | environment
    return subprocess.run(
        ["bash", "-c", line], cwd=cwd, env=variables, capture_output=True, timeout=300
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("$C list engines >/dev/full", 1, REFUSED + "No space left on device"),
        ("$C list engines | head -0; exit ${PIPESTATUS[0]}", 0, ""),
        ("$C list nothing 2>&-", 2, ""),
        ("$C list engines <&- >&- 2>&-", 1, ""),
        ("PYTHONOPTIMIZE=2 $C list engines", 2, "PYTHONOPTIMIZE=2"),
    ],
)
def test_a_stream_that_takes_nothing_is_one_sentence(
    tmp_path: Path, line: str, code: int, said: str
):
    done = shell(line, tmp_path)
    text = done.stderr.decode()

    assert done.returncode == code
    assert said in text
    assert text.count("\n") == bool(said)


@pytest.mark.slow
@pytest.mark.parametrize("stream", [">/dev/full", pytest.param("2>&- >&-", marks=pytest.mark.long)])
def test_what_was_computed_is_kept_whatever_becomes_of_the_streams(tmp_path: Path, stream: str):
    done = shell(
        f"$C run slow_collision --engine pymunk:matched --out out --workers 1 --timings 0 {stream}",
        tmp_path,
    )

    assert done.returncode == 1
    assert b"Traceback" not in done.stderr
    assert set(pd.read_csv(tmp_path / "out" / "runs.csv").status) == {"ok"}
    assert (tmp_path / "out" / "report.html").stat().st_size > 50_000
    assert shell("$C report out", tmp_path).returncode == 0


@pytest.mark.slow
def test_a_run_with_names_in_other_bytes_is_whole_where_letters_are_few(tmp_path: Path):
    variables = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    here = tmp_path / os.fsdecode(b"pl\xff\xfc")
    here.mkdir()
    (here / os.fsdecode(b"two\xe9.toml")).write_text(SCENE.read_text().split("[[wall]]")[0])
    shutil.copy(SOLVER, here / os.fsdecode(b"own\xe9.py"))
    played = shell(
        "$C run two$'\\xe9'.toml --engine pymunk:matched --engine own$'\\xe9'.py --dt 0.01 --out"
        " o$'\\xff' --workers 1 --timings 0",
        here,
        **variables,
    )
    out = here / os.fsdecode(b"o\xff")
    others = [
        shell(line, here, **variables)
        for line in ("$C report o$'\\xff'", "$C diff o$'\\xff' o$'\\xff'")
    ]

    assert [one.returncode for one in (played, *others)] == [0, 0, 0], played.stderr.decode(
        errors="replace"
    )
    assert b"Traceback" not in played.stderr + others[0].stderr + others[1].stderr
    table = pd.read_csv(out / "deviations.csv")
    assert table.engine.nunique() == 2
    assert set(pd.read_csv(out / "runs.csv").status) == {"ok"}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert (Path(__file__).parents[3] / "reports" / "page" / "kit.js").read_text(
        encoding="utf-8"
    ) in page
    assert "own" in page


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "cp437"])
def test_what_a_console_cannot_write_is_escaped_before_a_table_is_laid_out(
    tmp_path: Path, encoding: str
):
    # one right, and one with a fault, whose sentence is folded
    for name, old in (
        ("Übung 3 Müller (final)", ""),
        ("Zoë Ångström, Gruppe 17", " / sphere.mass"),
    ):
        (tmp_path / "class" / name).mkdir(parents=True)
        text = SOLVER.read_text("utf-8").replace(old or "\0", "")
        (tmp_path / "class" / name / "Exercise.py").write_text(text, "utf-8")
    done = shell("$C check class", tmp_path, PYTHONIOENCODING=encoding, COLUMNS="80")
    lines = done.stdout.decode(encoding).splitlines()

    assert done.returncode == 1, done.stderr
    assert any(r"\xc5ngstr" in line for line in lines) == (encoding == "ascii")
    end = lines[0].index("asked") + len("asked") - 1
    assert [line[end].isdigit() for line in lines[1:3]] == [True, True]
