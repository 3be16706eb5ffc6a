"""What README.md and the README.md of each folder say to type works as it stands."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import crosscheck2d
from crosscheck2d.adapters.conformance.conform import PROBES
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.scenarios.catalogue import SCENARIOS
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT, MUTANTS

ROOT = Path(__file__).parent.parent
TOP = ("reference_impl", "scenarios", "adapters", "reports", "tests")
DOCUMENTS = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md")]
DOCUMENTS += sorted(
    path for top in TOP for path in (ROOT / top).rglob("README.md") if "out" not in path.parts
)
TEXTS = {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in DOCUMENTS}
TEXT = TEXTS["README.md"]


def blocks_of(text: str) -> list[tuple[str, str]]:
    return re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


LINES = list(
    dict.fromkeys(
        line.split("  #")[0].strip()
        for text in TEXTS.values()
        for kind, block in blocks_of(text)
        if kind == "sh"
        for line in block.splitlines()
        if line.startswith("uv run")
    )
)
CLUSTER = [line for line in LINES if "--extra cluster" in line]
MINUTES = {"uv run crosscheck speed"}  # and the tests themselves
# seconds each, ten for the long ones
MARKS = {
    " advise ": pytest.mark.long,
    " stability my_scene.toml ": pytest.mark.long,
    " run my_scene.toml ": pytest.mark.long,  # the gate plays a file through one engine
    " speed free_fall slow_collision ": pytest.mark.long,
    " stability ": pytest.mark.slow,
    " speed ": pytest.mark.slow,
    " --solver ": pytest.mark.slow,
    " run ": pytest.mark.slow,
    " check ": pytest.mark.slow,
}
COMMANDS = [
    pytest.param(line, marks=[mark for words, mark in MARKS.items() if words in line][:1])
    for line in LINES
    if line not in CLUSTER
    and line not in MINUTES
    and not (line.startswith("uv run pytest") and "--solver" not in line)
]
# Files of a run, and what the exercise's author calls a solver.
WRITTEN = {
    "deviations.csv",
    "runs.csv",
    "timings.csv",
    "machine.json",
    "results.sqlite",
    "limits.csv",
    "speed_budget.csv",
    "solver.py",
    "random.py",
    "marks.csv",
}
BIN = Path(sys.executable).parent


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the README shows, under the names it gives them."""
    where = tmp_path_factory.mktemp("readme")
    shown = re.compile(r"`(\w+\.toml)`[^`]*?:\n\n```toml\n(.*?)^```$", re.MULTILINE | re.DOTALL)
    for text in TEXTS.values():
        for name, block in shown.findall(text):
            (where / name).write_text(block)
    solver = ROOT / "tests" / "solvers" / "correct" / "plain.js"
    (where / "class" / "anna").mkdir(parents=True)
    for path in (where, where / "class" / "anna"):
        shutil.copy(solver, path / "Exercise.js")
    balls = ROOT / "tests" / "adapters" / "strangers" / "canvas_per_frame.js"
    shutil.copy(balls, where / "page.js")
    return where


def test_the_first_block_is_the_two_commands():
    kind, block = blocks_of(TEXT)[0]

    assert kind == "sh"
    assert block.splitlines() == ["pip install uv && uv run crosscheck", "uv run pytest"]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_a_readme_succeeds(command: str, folder: Path):
    words = shlex.split(command, comments=True)

    assert words[:2] == ["uv", "run"]
    program, *arguments = words[2:]
    if program == "crosscheck":
        done = crosscheck(*arguments, cwd=folder)
    else:
        done = subprocess.run(
            [BIN / program, *arguments], cwd=folder, capture_output=True, text=True, timeout=300
        )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_three_commands_for_many_machines_play_a_run(tmp_path: Path):
    pytest.importorskip("distributed")
    scheduler, worker, run = (shlex.split(line)[4:] for line in CLUSTER)
    words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    started = [
        subprocess.Popen(
            [BIN / scheduler[0], *scheduler[1:], *words], stderr=subprocess.PIPE, text=True
        )
    ]
    try:
        said = iter(started[0].stderr.readline, "")
        address = next(found[0] for line in said if (found := re.search(r"tcp://[\d.]+:\d+", line)))
        here = [[re.sub(r"tcp://\S+", address, word) for word in words] for words in (worker, run)]
        started.append(
            subprocess.Popen(
                [BIN / here[0][0], *here[0][1:]], cwd=tmp_path, stderr=subprocess.DEVNULL
            )
        )
        next(line for line in said if "Register worker" in line)
        done = subprocess.run(
            [BIN / here[1][0], *here[1][1:]],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=300,
        )
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait()

    assert [scheduler, worker[:2], run[:2]] == [
        ["dask", "scheduler"],
        ["dask", "worker"],
        ["crosscheck", "run"],
    ]
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "many" / "report.html").exists()


def test_the_python_blocks_run_on_the_scene_beside_them(
    folder: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(folder)
    blocks = [
        block for text in TEXTS.values() for kind, block in blocks_of(text) if kind == "python"
    ]
    assert blocks
    for block in blocks:
        *lines, last = block.strip().splitlines()
        assert {line for line in lines if "import" in line} == {"import crosscheck2d"}
        names: dict[str, Any] = {}
        exec("\n".join(lines), names)
        table = eval(last, names)
        assert len(table) == 2 * len({*zip(table.engine, table.profile)}) > 2
        assert np.isfinite(table.value).all()
        assert (crosscheck2d.truth(names["scene"]).collisions.j >= 0).any()


def test_the_readme_counts_as_the_tables_do():
    patterns = {
        "scenes": r"(\d+) scenes through",
        "probes": r"answers (\d+) probes",
        "lessons": r"lesson`: (\d+) lessons",
    }
    said = {what: re.search(pattern, TEXT) for what, pattern in patterns.items()}

    assert {what: int(found.group(1)) for what, found in said.items() if found} == {
        "scenes": len(SCENARIOS),
        "probes": len(PROBES),
        "lessons": len(LESSONS),
    }


def test_the_readme_counts_the_solvers_of_the_confusion_table():
    said = re.search(
        r"what `check` says of (\d+) solvers with one or two faults and of (\d+) without",
        TEXTS["reports/check/README.md"],
    )

    assert said is not None
    assert [int(number) for number in said.groups()] == [len(MUTANTS), len(CORRECT)]
    assert len((ROOT / "tests" / "data" / "confusion.csv").read_text().splitlines()) == 1 + len(
        MUTANTS
    ) + len(CORRECT)


@pytest.mark.parametrize("document", TEXTS)
def test_every_file_that_a_document_names_exists(document: str):
    folder = (ROOT / document).parent
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", TEXTS[document])
    named = set(
        re.findall(
            r"`((?:reference_impl|scenarios|adapters|reports|tests|\.ci)/[\w./]*)`", TEXTS[document]
        )
    )
    beside = set(re.findall(r"`(\w+\.(?:py|csv|json|html\.j2))`", TEXTS[document]))

    assert links or named or beside
    for path in links:
        assert (folder / path).exists(), path
    for path in named:
        # the latter is there after a run
        assert (ROOT / path).exists() or path.startswith("reports/out/"), path
    for path in beside - WRITTEN:
        assert (folder / path).exists(), path


def test_the_functions_of_a_score_are_in_the_files_that_architecture_names():
    drawing = TEXTS["ARCHITECTURE.md"].partition("```\n")[2].partition("```")[0]
    lines = re.findall(r"^[|+\s]*([a-z_, ]+?)[|\s]+(?<=\s)([a-z_/]+\.py)$", drawing, flags=re.M)
    named = [(name, path) for names, path in lines for name in names.split(", ")]
    known = [(name, path) for name, path in named if path != "adapters/engine.py"]  # its verbs

    assert len(known) == 11
    assert [
        (name, path)
        for name, path in known
        if f"def {name}(" not in (ROOT / path).read_text("utf-8")
    ] == []


def test_architecture_names_at_most_twelve_files():
    assert len({*re.findall(r"[\w/]+\.py\b", TEXTS["ARCHITECTURE.md"])}) <= 12


def test_the_front_page_is_short_and_leads_to_every_other():
    assert len(TEXT.splitlines()) <= 120
    linked = {
        (ROOT / document).parent.joinpath(path).resolve()
        for document, text in TEXTS.items()
        for path in re.findall(r"\]\((?!https?:)([^)#]+)\)", text)
        if document.count("/") < 2
    }
    assert [
        document
        for document in set(TEXTS) - {"README.md"}
        if not {ROOT / document, (ROOT / document).parent} & linked
    ] == []


def test_every_file_of_the_source_is_named_where_its_folder_is_explained():
    # In the README.md of its folder. A folder without one, whose files are all of one kind, is
    # itself named in the README.md of the folder above. The file of an engine has its name.
    files = {path for top in TOP[:-1] for path in (ROOT / top).rglob("*.py")}
    files -= {ROOT / "adapters" / f"{name.partition(':')[0]}.py" for name in ENGINES}
    missing = []
    for path in sorted(path for path in files if path.name != "__init__.py"):
        place, name = path.parent, path.name
        if not (place / "README.md").exists():
            place, name = place.parent, place.name + "/"
        if f"`{name}" not in TEXTS[f"{place.relative_to(ROOT).as_posix()}/README.md"]:
            missing.append(path.relative_to(ROOT).as_posix())

    assert missing == []


def test_what_is_read_first_is_short():
    first = (
        "README.md",
        "scenarios/model.py",
        "reference_impl/exercise.py",
        "adapters/engine.py",
        "adapters/play.py",
        "reports/compare/comparison.py",
    )

    lines = [line for path in first for line in (ROOT / path).read_text("utf-8").splitlines()]
    assert len([line for line in lines if not line.startswith("| `")]) < 700
    assert set(first[1:]) <= set(re.findall(r"`([\w/]+\.py)`", TEXTS["ARCHITECTURE.md"]))
