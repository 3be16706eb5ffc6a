"""Every test is played by one of three: the fast suite, the gate, the long run."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections import defaultdict
from collections.abc import Collection, Iterable
from pathlib import Path

import pytest

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
