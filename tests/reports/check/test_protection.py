"""What a check says of the sandbox, and what a hand-in may import."""

from __future__ import annotations

import csv
import subprocess
import sys
import time
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any

import psutil
import pytest

from crosscheck2d.adapters.host.sandbox import GUEST, RUN, Level, levels
from crosscheck2d.reports.check.questions import QUESTIONS, use_seed
from tests.adapters.attacks import GRADED
from tests.adapters.test_host import HEAD
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck

JS = (Path(__file__).parents[2] / "solvers/correct/plain.js").read_text()
PY = (Path(__file__).parents[2] / "solvers/correct/plain.py").read_text()


@pytest.fixture
def group(tmp_path: Path) -> Path:
    """A class of one student, who imports a package that others need other packages for."""
    (tmp_path / "class").mkdir()
    (tmp_path / "class" / "anna.py").write_text(f"import pydantic\n{PY}")
    return tmp_path


def marks(group: Path, *words: str) -> dict[str, str]:
    """The row of the student."""
    done = crosscheck("check", "class", "--format", "csv", *words, cwd=group)
    assert done.returncode in (0, 1), done.stderr
    (row,) = csv.DictReader(StringIO(done.stdout))
    return row


def test_a_package_that_is_not_allowed_is_named_and_is_no_fault(group: Path):
    """Nothing is judged; a person decides."""
    row = marks(group)
    assert "imports pydantic, which is not available here" in row["begin with"]
    assert (row["wrong"], row["not judged"]) == ("0", "20")


@pytest.mark.slow
def test_a_package_comes_with_all_that_it_needs(group: Path):
    """pydantic needs its compiled core, and two more."""
    assert marks(group, "--package", "pydantic")["total"] == "20"


@pytest.mark.parametrize("name", ["nowhere", "crosscheck2d", "tests"])
def test_a_package_has_to_be_installed_and_none_of_this_program(name: str, group: Path):
    """One sentence, before anything is checked."""
    done = crosscheck("check", "class", "--package", name, cwd=group)
    assert done.returncode == 2
    assert f"--package {name}: is not installed, or is a part of this program" in done.stderr


def test_without_a_sandbox_a_folder_of_python_needs_consent(
    group: Path, monkeypatch: pytest.MonkeyPatch
):
    """A folder of JavaScript needs none: V8 has no files and no network."""
    monkeypatch.setenv("CROSSCHECK_SANDBOX", "none")
    done = crosscheck("check", "class", cwd=group)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "--unprotected" in done.stderr
    assert (
        "with all your permissions"
        in crosscheck("check", "class", "--unprotected", cwd=group).stderr
    )
    (group / "class" / "anna.py").rename(group / "anna.py")
    (group / "class" / "ben.js").write_text("function integrate(sphere, dt) {}\n")
    assert crosscheck("check", "class", cwd=group).returncode == 1


@pytest.mark.slow
def test_a_class_is_asked_with_one_random_seed_that_is_recorded(group: Path):
    """So that a recording of the answers is worth nothing; a seed that is given is taken."""
    assert marks(group, "--seed", "12")["seed"] == "12"
    assert len({marks(group)["seed"] for _ in range(2)}) == 2


NOTHING = {
    ".py": (
        "def integrate(sphere, dt): pass\ndef sphereSphereCollisionHandling(a, b): pass\n",
        "import os\n" + HEAD,
    ),
    ".js": (
        "function integrate(sphere, dt) {}\nfunction sphereSphereCollisionHandling(a, b) {}\n",
        "const CLASS = {values!r}[1];\n",
    ),
}


@pytest.mark.slow
@pytest.mark.skipif(Level.BUBBLEWRAP not in levels(), reason="needs bubblewrap")
def test_a_hostile_hand_in_earns_nothing_and_harms_nobody(tmp_path: Path):
    """A class of all attacks that compute nothing, and two honest files: it ends, the honest have
    their points, the others none; no file is changed, no process is left."""
    folder = tmp_path / "class"
    folder.mkdir()
    (folder / "anna.py").write_text(PY)
    (folder / "ben.js").write_text(JS)
    for name, attack in GRADED.items():
        functions, head = NOTHING[Path(name).suffix]
        values = ["", str(folder), 1, "", "127.0.0.1", 1, ""]
        text = head.replace("{values!r}", repr(values)) + f"{attack}\n"
        # first and last, so that an import cannot replace what it lacks
        (folder / name).write_text(f"{text}{functions}" if "import" not in name else text)
    (folder / "carl").mkdir()
    (folder / "carl" / "solver.py").write_text("from helper import *\n")
    for link, target in {
        "carl/helper.py": "../anna.py",
        "dora.py": "anna.py",
        "emil/solver.py": "../anna.py",
    }.items():
        (folder / link).parent.mkdir(exist_ok=True)
        (folder / link).symlink_to(target)
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}
    done = subprocess.run(
        [CROSSCHECK, "check", "class", "--format", "csv", "--out", "marks.csv"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=400,
    )
    assert done.returncode == 1, done.stderr
    first = (tmp_path / "marks.csv").read_text()
    marks = {row["id"]: row["total"] for row in csv.DictReader(StringIO(first))}
    time.sleep(1.0)

    assert marks == {"anna": "20", "ben": "20"} | dict.fromkeys(
        [*(Path(name).stem for name in GRADED), "carl", "dora", "emil"], "0"
    )
    assert (tmp_path / "marks.csv").read_text() == first
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before
    assert {path.name for path in tmp_path.iterdir()} == {"class", "marks.csv"}
    commands = [
        p.info["cmdline"] or []
        for p in psutil.process_iter(["cmdline", "ppid"])
        if p.info["ppid"] == 1
    ]
    assert not [words for words in commands if RUN in words]


def recorded() -> str:
    """A file that has recorded what a right one does with the questions of seed 0."""
    sys.path.append(str(GUEST))
    driver: Any = import_module("driver")
    honest: dict[str, Any] = {}
    exec(PY, honest)
    table = {}
    use_seed(0)
    for question in QUESTIONS.values():
        spheres = [driver.sphere_of(row) for row in question.request["spheres"]]
        for name, *words in question.request["calls"]:
            on = [spheres[k] for k in words[: {"integrate": 1, "collide": 2}.get(name, 0)]]
            key = repr([*map(driver.row_of, on), *words[len(on) :]])
            if on:
                honest[driver.EXERCISE[name]](*on, *words[len(on) :])
                table[key] = [driver.row_of(s) for s in on]
    return RECORDED.format(table=table)


RECORDED = """TABLE = {table!r}
def row(s):
    vectors = (s.position.x, s.position.y, s.velocity.x, s.velocity.y, s.force.x, s.force.y)
    return [*map(float, (*vectors, s.alpha, s.angularVelocity, s.torque, s.mass, s.MoI, s.size))]
def replay(spheres, *words):
    for s, r in zip(spheres, TABLE.get(repr([*map(row, spheres), *words]), ())):
        s.position.x, s.position.y, s.velocity.x, s.velocity.y = r[:4]
        s.alpha, s.angularVelocity = r[6:8]
def integrate(sphere, dt): replay([sphere], dt)
def sphereSphereCollisionHandling(a, b): replay([a, b])
"""


@pytest.mark.slow
def test_recorded_answers_earn_nothing_of_a_class(group: Path):
    """They are right at the seed that was recorded, which shows that the recording works."""
    (group / "class" / "anna.py").write_text(recorded())
    assert float(marks(group, "--seed", "0")["total"]) >= 10
    assert [marks(group, "--seed", str(seed))["total"] for seed in (5, 4711)] == ["0", "0"]
    assert marks(group)["total"] == "0"
