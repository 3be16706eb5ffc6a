"""What `.ci` runs: every test is played by one of the fast suite, the gate and the long run; GitHub
runs what is run here; the yardstick fails at every change that changed.toml does not state."""

from __future__ import annotations

import importlib.util
import re
import shlex
import subprocess
import sys
import tomllib
from collections import defaultdict
from collections.abc import Collection, Iterable
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parent.parent


def call_of(script: str) -> str:
    """The one command in a script of `.ci` that selects tests by their marks."""
    text = (ROOT / ".ci" / script).read_text("utf-8")
    (call,) = re.findall(r"^(?:exec )?uv run (pytest -m .+)$", text, re.MULTILINE)
    return call


def selected(words: str) -> str:
    options = shlex.split(words)
    return options[options.index("-m") + 1]


OPTIONS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["pytest"]
SUITES = {
    "fast": selected(OPTIONS["ini_options"]["addopts"]),
    "gate": selected(call_of("run")),
    # it also plays every property again, with more examples
    "long": selected(call_of("long")).removesuffix(" or hypothesis"),
}


def suites_of(marks: Collection[str]) -> list[str]:
    known = defaultdict(bool, dict.fromkeys(marks, True))
    return [name for name, words in SUITES.items() if eval(words, {"__builtins__": {}}, known)]


def only_long(tests: Iterable[tuple[str, list[str]]]) -> set[str]:
    """The files of which fast suite and gate play nothing; of each test its name and suites."""
    tests = list(tests)
    seen = {name.split("::")[0] for name, suites in tests if suites != ["long"]}
    return {name.split("::")[0] for name, _ in tests} - seen


def test_every_test_is_played_by_one_suite_and_none_is_the_gate_blind_to(
    collected: list[pytest.Item],
):
    tests = [
        (item.nodeid, suites_of({mark.name for mark in item.iter_markers()})) for item in collected
    ]

    assert [name for name, suites in tests if len(suites) != 1] == []
    assert only_long(tests) == set()


def test_the_marks_say_which_suite():
    assert suites_of([]) == suites_of(["hypothesis", "parametrize"]) == ["fast"]
    assert suites_of(["slow"]) == suites_of(["independent"]) == ["gate"]
    assert suites_of(["long"]) == suites_of(["slow", "long"]) == ["long"]
    assert suites_of(["independent", "long"]) == ["long"]
    tests = [("a.py::one", ["fast"]), ("a.py::two", ["long"]), ("b.py::three", ["long"])]
    assert only_long(tests) == {"b.py"}


# The workflows.

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*"))
CI = ROOT / ".github" / "workflows" / "ci.yml"


def faults_of(workflow: Path) -> str:
    words = ["check_jsonschema", "--builtin-schema", "vendor.github-workflows", str(workflow)]
    done = subprocess.run([sys.executable, "-m", *words], capture_output=True)
    return (done.stdout + done.stderr).decode() if done.returncode else ""


@pytest.mark.slow
def test_the_workflows_are_what_github_takes(tmp_path: Path):
    assert [workflow.name for workflow in WORKFLOWS] == ["ci.yml"]
    assert faults_of(CI) == ""
    wrong = tmp_path / "ci.yml"
    wrong.write_text(CI.read_text(encoding="utf-8").replace("runs-on:", "runs_on:"), "utf-8")
    assert "runs-on" in faults_of(wrong)


def test_they_run_the_gate_and_the_commands_of_the_readme():
    jobs = YAML(typ="safe").load(CI.read_text(encoding="utf-8"))["jobs"]
    runs = {
        name: [step["run"] for step in job["steps"] if "run" in step] for name, job in jobs.items()
    }
    block = (ROOT / "README.md").read_text(encoding="utf-8").split("```sh\n")[1].split("```")[0]

    assert runs == {"gate": ["bash .ci/run"], "readme": block.splitlines()}
    assert jobs["readme"]["strategy"]["matrix"]["os"] == ["macos-latest", "windows-latest"]


# The yardstick.

SCRIPT = ROOT / ".ci" / "yardstick.py"
SPEC = importlib.util.spec_from_file_location("yardstick", SCRIPT)
yardstick = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(yardstick)

ONE, TWO, NAN = (1.0).hex(), (2.0).hex(), "nan"
BASE = {"deviation/a/rms": ONE, "deviation/b/rms": ONE, "status/a": "ok", "trajectory/a": "sha:12"}


def entry(pattern: str, count: object, direction: str, **more: object) -> str:
    fields = {"pattern": pattern, "count": count, "direction": direction, "issue": 36}
    fields |= {"point": "2", "reason": "a reason"} | more
    return "[[change]]\n" + "".join(f"{key} = {value!r}\n" for key, value in fields.items())


def kinds(new: dict[str, str], changes: str = "") -> list[str]:
    """The faults of a measurement, each by its first word."""
    return [fault.split("\t")[0] for fault in yardstick.compare(BASE, new, changes)]


def test_equal_measurements_and_new_ids_pass():
    assert kinds(BASE) == []
    assert kinds(BASE | {"deviation/c/rms": ONE}) == []


@pytest.mark.parametrize(
    ("changed", "fault"),
    [
        ({"deviation/a/rms": TWO}, "higher"),
        ({"deviation/a/rms": (1.0 - 2**-53).hex()}, "lower"),
        ({"deviation/a/rms": NAN}, "status"),
        ({"status/a": "timeout"}, "status"),
        ({"trajectory/a": "sha:13"}, "status"),
    ],
)
def test_a_change_without_an_entry_fails(changed: dict[str, str], fault: str):
    assert kinds(BASE | changed) == [fault]


def test_a_missing_id_fails_and_only_gone_allows_it():
    new = {key: value for key, value in BASE.items() if key != "status/a"}
    assert kinds(new) == ["gone"]
    assert kinds(new, entry("status/*", 1, "any")) == ["gone", "count"]
    assert kinds(new, entry("status/*", 1, "gone")) == []


def test_an_entry_takes_exactly_its_count():
    new = BASE | {"deviation/a/rms": TWO, "deviation/b/rms": TWO}
    assert kinds(new, entry("deviation/*/rms", 2, "higher")) == []
    assert kinds(new, entry("deviation/*/rms", 1, "higher")) == ["count"]
    assert kinds(new, entry("deviation/*/rms", 3, "any")) == ["count"]
    assert kinds(BASE, entry("deviation/*/rms", 1, "any")) == ["count"]


def test_another_direction_or_pattern_fails():
    new = BASE | {"deviation/a/rms": TWO}
    assert kinds(new, entry("deviation/*", 1, "lower")) == ["higher", "count"]
    assert kinds(new, entry("deviation/b/*", 1, "higher")) == ["higher", "count"]


def test_a_renamed_id_is_compared_with_its_base():
    renamed = '[renamed]\nrms = "root_mean_square"\n'
    new = {key.replace("rms", "root_mean_square"): value for key, value in BASE.items()}
    assert kinds(new) == ["gone", "gone"]
    assert kinds(new, renamed) == []
    assert kinds(new | {"deviation/a/root_mean_square": TWO}, renamed) == ["higher"]


@pytest.mark.parametrize(
    "wrong",
    [entry("*", "all", "any"), entry("*", 1, "up"), entry("*", 1, "any", why="so"), "[[change]]"],
)
def test_an_entry_that_is_no_entry_is_refused(wrong: str):
    with pytest.raises(ValueError, match=r"changed\.toml, entry 1"):
        yardstick.compare(BASE, BASE, wrong)


def test_the_kept_changes_can_be_read_and_the_base_has_every_kind():
    yardstick.read_changes((yardstick.KEPT / "changed.toml").read_text())
    kept = tomllib.loads((yardstick.KEPT / "base.toml").read_text())
    expected = {"deviation", "status", "trajectory", "truth", "limit", "probe", "check", "lesson"}
    assert kept["numbers"].keys() == expected | {"exit"}


def test_random_scenes_are_the_same_everywhere_and_have_what_they_should():
    scenes = [tomllib.loads(yardstick.random_scene(k)) for k in range(yardstick.RANDOM_SCENES)]
    assert yardstick.random_scene(7) == yardstick.random_scene(7)
    for has in (
        lambda scene: "wrap" in scene and scene["gravity"][1],
        lambda scene: "wrap" in scene and scene["friction"],
        lambda scene: "wall" in scene and scene["friction"] and scene["restitution"] < 1,
        lambda scene: "thrust" in scene and "box" in scene,
        lambda scene: any(disk.get("static") for disk in scene["disk"]),
    ):
        assert sum(map(bool, map(has, scenes))) >= 10
