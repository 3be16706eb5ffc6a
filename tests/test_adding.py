"""Adding is one file and one row: a copy of the source gets one of everything, which then appears
everywhere."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pytest

ROOT = Path(__file__).parent.parent
SOURCE = ("adapters", "reference_impl", "reports", "scenarios")
TOY = """
import numpy as np

from crosscheck2d.adapters.engine import SILENT, Unsupported
from crosscheck2d.adapters.friction import must_be_frictionless
from crosscheck2d.scenarios.model import State


class Toy:
    listening, wrapping = True, 0.0

    def load(self, scene, dt):
        must_be_frictionless(scene, "a toy")
        if scene.wrap is not None:
            raise Unsupported("a toy has no edges")
        self.scene, self.dt = scene, dt
        self.state = [np.array(scene.position), np.array(scene.velocity), np.array(scene.angle)]
        self.spin = np.array(scene.angular_velocity)
        self.acting = np.zeros_like(scene.position)

    def apply_force(self, disk, force, torque):
        self.acting[disk] += force / self.scene.mass[disk]
        self.spin[disk] += torque / self.scene.inertia[disk] * self.dt

    def step(self, count=1):
        moving = ~self.scene.static[:, None]
        for _ in range(count):
            a = (self.scene.gravity + self.acting) * moving
            self.state[0] += self.state[1] * self.dt + a * self.dt**2 / 2
            self.state[1] += a * self.dt
            self.state[2] += self.spin * self.dt
            self.acting[:] = 0.0

    def read(self):
        return State(*(each.copy() for each in self.state), self.spin.copy())

    def collisions(self):
        return []

    def settings(self):
        return {"collisions": (None, SILENT)}

    def versions(self):
        return {"toyland": "1.5"}

    def close(self):
        pass
"""

# What turns red for an engine that a test has not thought of: the tests of every engine, for this
# one, and those of tables and marks.
SELECTED = ("toy", "table_has_every_engine", "no_mark_of")
PYTEST = [
    *["-q", "--tb=short", "--import-mode=importlib", "--noconftest", "-p", "no:cacheprovider"],
    "-k",
    " or ".join(SELECTED),
    "tests/adapters/test_engines.py",
    "tests/adapters/test_impact_table.py",
    "tests/reports/page/test_colours.py",
]


class Added(NamedTuple):
    """What is written into a file, and in front of what; at its end if that is ""."""

    file: str
    text: str
    before: str = ""


ADDED: dict[str, list[Added]] = {
    "an engine": [
        Added("adapters/toy.py", TOY),
        Added(
            "adapters/engines.py",
            '    "toy:plain": EngineRow(partial(_made, "crosscheck2d.adapters.toy.Toy"),'
            ' "flies through everything", 0.5, FLOAT64,'
            ' outside=True, distributions=("typer",),\n'
            '                     options={"as it is": {}},\n'
            '                     variants={"as_it_is": Variant({}, "nothing")}),\n',
            "}\n\n# engines whose numbers",
        ),
    ],
    "a scenario": [
        Added(
            "scenarios/families/pairs.py",
            '    meet("toy_scene", "Is a toy scene here?", position=[[-6, 0.6], [0, 0]],'
            " velocity=[[12, 0], [0, 0]]),\n",
            '    meet(\n        "near_miss"',
        ),
    ],
    "a metric": [
        Added(
            "reports/compare/metrics.py",
            "def toy_metric(view: View) -> Value | None:\n    return Value(42.0)\n\n\n",
            "BESIDE = ",
        ),
        Added(
            "reports/compare/metrics.py",
            '    Metric(toy_metric, "1", (ITSELF,), "", "42, whatever was played."),\n',
            "    Metric(\n        position_max_radii,",
        ),
    ],
    "a lesson": [
        Added(
            "reports/lessons/toy.py",
            "from crosscheck2d.reports.lessons.lesson import LessonChart, Curve, Lesson, Shown\n"
            'def show():\n    curve = Curve("toy:plain", np.arange(2.0), np.arange(2.0))\n   '
            ' return Shown([LessonChart("a toy", "x", "y", [curve])], None, [])\n\n\n'
            'TOY = Lesson("toy", "9", "A toy lesson", "Is it here?", "It is.", [],'
            ' ["toy:plain"], show)\n',
        ),
        Added(
            "reports/lessons/toy.py",
            "import numpy as np\n\n",
            "from crosscheck2d.reports.lessons.lesson",
        ),
        Added(
            "reports/lessons/catalogue.py",
            "from crosscheck2d.reports.lessons.toy import TOY\n",
            "\nALL",
        ),
        Added("reports/lessons/catalogue.py", "    TOY,\n", ")\nLESSONS"),
    ],
    "a mechanism": [
        Added(
            "adapters/mechanisms/table.py",
            '    "toy:plain": lambda reported, scene, dt: [Mechanism(FRICTION, {"friction":'
            " 0.0})],\n",
            '}\n"""The engines whose',
        ),
    ],
}


@pytest.fixture(scope="module")
def grown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the source, compiled kernels included, with one of everything added."""
    folder = tmp_path_factory.mktemp("grown") / "crosscheck2d"
    for name in (*SOURCE, "tests"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("out", "*.png"))
    for name in ("README.md", "__init__.py"):
        shutil.copy(ROOT / name, folder)
    for additions in ADDED.values():
        for added in additions:
            path = folder / added.file
            text = path.read_text(encoding="utf-8") if path.exists() else ""
            assert text.count(added.before) == 1 or not added.before, added
            at = text.index(added.before) if added.before else len(text)
            changed = path.stat() if path.exists() else None
            path.write_text(text[:at] + added.text + text[at:], encoding="utf-8")
            # A file newer than the kernels beside it would have them all compiled again, for 20 s;
            # none of these files is compiled.
            if changed:
                os.utime(path, ns=(changed.st_atime_ns, changed.st_mtime_ns))
    return folder


def python(grown: Path, *words: str | Path) -> str:
    path = os.pathsep.join(map(str, (grown.parent, grown)))  # the package, and the tests
    environment = os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, *words],
        cwd=grown,
        env=environment,
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_table_of_contributing_names_what_is_added_here_and_where():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = {
        what: set(re.findall(r"`((?:adapters|reports|scenarios)/[^`]*)`", rest))
        for what, rest in re.findall(r"^\| (an? \w+) \|(.*)$", text, re.MULTILINE)
    }

    assert rows.keys() == ADDED.keys()
    for what, files in rows.items():
        written = {added.file for added in ADDED[what]}
        assert all(any(file.startswith(name) for file in written) for name in files), what


def test_the_command_after_an_engine_is_the_one_that_is_run_here():
    for page in ("CONTRIBUTING.md", "adapters/README.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        assert "uv run python -m crosscheck2d.adapters.conformance.impact_table NAME" in text, page


def test_nothing_of_it_is_in_the_source_itself():
    assert [
        path
        for folder in SOURCE
        for path in (ROOT / folder).rglob("*.py")
        if "toy" in path.read_text()
    ] == []


@pytest.mark.slow
def test_all_that_is_added_is_known_everywhere(grown: Path):
    code = """
import json
import runpy
import sys
import pytest
from crosscheck2d.adapters.conformance.conform import conform
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.options import OPTIONS
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.pages import lesson_page
from crosscheck2d.reports.page.style import PALETTE, look, mark_of_file
from crosscheck2d.reports.run.cells import versions
from crosscheck2d.reports.speed.budget import budget_of
from crosscheck2d.reports.stability.limits import DRIVEN_ENGINES
from crosscheck2d.scenarios.catalogue import SCENARIOS
found = conform("toy:plain", ENGINES["toy:plain"])
sys.argv[1:] = ["toy"]
runpy.run_module("crosscheck2d.adapters.conformance.impact_table", run_name="__main__")
tests = pytest.main(PYTEST)
print(json.dumps({
    "names": ["toy:plain" in ENGINES, "toy_scene" in SCENARIOS, "toy_metric" in METRICS],
    "look": look("toy", "plain")[:2] + look("toy", "plain")[3:4] == PALETTE[0],
    "version": versions()["typer"],
    "file": PALETTE[0] in [mark_of_file(f"{k}.js") for k in range(20)],
    "tests": tests,
    "alike": [name for name in ENGINES if look(*name.split(":"))[:2] == look("toy")[:2]],
    "option": [each.change for each in OPTIONS if each.engine == "toy:plain"],
    "variant": DRIVEN_ENGINES["toy:plain+as_it_is"].change,
    "contributions": [row["contribution"] for row in budget_of("free_fall", 0, "toy:plain", 4)],
    "verdicts": {each.probe: each.verdict for each in found},
    "lesson": lesson_page(LESSONS["toy"], LESSONS["toy"].at([]).to_json()),
}))
"""
    *printed, line = python(grown, "-c", f"PYTEST = {PYTEST}\n{code}").splitlines()
    found = json.loads(line)

    assert found["names"] == [True] * 3
    assert found["look"]
    assert found["alike"] == ["toy:plain"]
    assert found["version"] == version("typer")
    assert not found["file"]
    assert found["tests"] == 0, "\n".join(printed)
    assert "| `toy" in (grown / "adapters/README.md").read_text(encoding="utf-8")
    assert found["verdicts"]["collisions_are_reported"] == "not asked"
    assert found["option"] == ["as it is"]
    assert found["variant"] == "nothing"
    assert "friction" in found["contributions"]
    assert found["verdicts"]["free_flight"] == "keeps"
    assert found["verdicts"]["restitution_0.5"] == "departs"  # it has no collisions
    assert "A toy lesson" in found["lesson"]


@pytest.mark.slow
def test_a_run_has_them_in_its_tables_and_on_its_page(grown: Path):
    words = (
        "run",
        "toy_scene",
        "--engine",
        "toy",
        "--dt",
        "0.0166666666666666",
        "--workers",
        "1",
        "--out",
        "out",
    )
    python(grown, "-m", "crosscheck2d.reports", *words)
    table = pd.read_csv(grown / "out" / "deviations.csv")
    page = (grown / "out" / "report.html").read_text(encoding="utf-8")
    runs = pd.read_csv(grown / "out" / "runs.csv")

    assert table[table.metric == "toy_metric"].value.tolist() == [42.0]
    assert set(table.scenario) == {"toy_scene"}
    assert "toyland" in runs.versions[0]
    shown = (
        "toy plain",
        "toy_metric",
        "#5b6b7a",
        "toyland 1.5",
        "restitution",
        "typer",
    )
    for text in shown:
        assert text in page, text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "names"),
    [
        ("speed", ["free_fall"]),
        pytest.param("stability", ["slow_collision"], marks=pytest.mark.long),
    ],
)
def test_speed_and_stability_have_the_engine_on_their_pages(
    grown: Path, command: str, names: list[str]
):
    python(
        grown, "-m", "crosscheck2d.reports", command, *names, "--engine", "toy", "--out", command
    )
    page = (grown / command / f"{command}.html").read_text(encoding="utf-8")

    assert "toy:plain" in re.sub(r"<[^>]+>", "", page)
    assert "#5b6b7a" in page


def test_an_engine_is_named_in_its_files_and_its_row_and_else_only_in_texts_about_it():
    # which engines a lesson shows
    about_it = {"reports/lessons/mechanisms/substeps.py", "reports/lessons/thrust.py"}
    about_it |= {f"reports/lessons/friction/{name}.py" for name in ("bounce", "cone", "rolling")}
    about_it |= {
        "adapters/mechanisms/settings.py",
        "reports/stability/explain.py",
        "reports/compare/causes.py",
    }  # why an engine fails, and which setting removes it, with the source
    # its name with capitals, without which it has that of its row; code to copy, else it has none
    about_it |= {"reports/page/scenes.py", "adapters/snippets.py"}
    named = {
        path.relative_to(ROOT).as_posix()
        for folder in SOURCE
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".js", ".j2", ".css")
        and "out" not in path.parts
        and re.search(r"\bbox2d_v3\b", path.read_text(encoding="utf-8"))
    }

    own = "adapters/box2d_v3.py"
    assert named - about_it == {own, "adapters/engines.py", "adapters/mechanisms/table.py"}
