"""An edited journal of `crosscheck speed` or `crosscheck stability` is refused by line or used:
never a traceback."""

import json
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from adapters.engines import row_of
from reports.run.journal import JOURNAL, Journal
from reports.run.journal_lines import kind_of
from reports.run.machine import about
from reports.run.made import digest_of, read_made
from reports.speed import budget, cheapest, lines
from reports.speed.kept import Kept
from reports.speed.measure import in_turns, scene_rows
from reports.speed.plan import PLAIN, SCENE, Measurement
from reports.speed.scored_part import scored
from reports.stability import lines as stability_lines
from reports.stability.command import write_files
from reports.stability.limits import Limit
from reports.stability.maps import MAPS, MapOf
from reports.stability.results import Task, found_limit, journalled
from reports.stability.touching import law_of
from reports.terminal.exits import FolderTaken
from scenarios.catalogue import scenario
from tests.reports.run.test_journal_edits import WRONG, edited, places

SCENES, NAME = {"slow_collision": scenario("slow_collision")}, "reference:exercise"
HEADER = {
    "scenes": ["slow_collision"],
    "files": {},
    "engines": [NAME],
    "effort": {"rounds": 1},
    "whole": False,
} | {key: value for key, value in about("", 0).items() if key in ("seed", "versions", "machine")}
SAMPLE = 60  # edits whose pages are made in the long test


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The journal of a measurement: a ladder, what its error is made of, times and a closed
    form."""
    place = tmp_path_factory.mktemp("measured")
    engine = Measurement(SCENE, "slow_collision", 0, NAME, PLAIN, row_of(NAME).make, (1, 2, 4))
    with Journal(place) as journal:
        kept = Kept(journal, HEADER, False, SCENES)
        kept.add(engine.task, engine.errors())
        kept.add(("budget", "slow_collision", NAME), budget.budget_of("slow_collision", 0, NAME, 2))
        often = {"rounds": 1, "budget": 0.0}
        kept.add(
            ("time", SCENE, "slow_collision"),
            scene_rows(SCENE, "slow_collision", 0, in_turns([engine]), often),
        )
        kept.add(("time", "truth", "slow_collision"), cheapest.closed_form("slow_collision", 0))
    assert scored("slow_collision", 0).scenario.name == "slow_collision"
    return place


@pytest.fixture(scope="module")
def stability(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The journal of an stability: a limit, a law, and a map whose readings are all alike."""
    place = tmp_path_factory.mktemp("stability")
    (place / "trajectories").mkdir()
    one = MAPS["dt_and_speed"]
    tasks = [
        Task(kind, name, "pymunk:matched", "quick")
        for kind, name in (("limit", "spin"), ("law", "touching_break"), ("map", one.name))
    ]
    cells = tuple((x, y, 0.1, False, "") for x, y in product(one.x, one.y))
    found = [
        found_limit(tasks[0], place),
        law_of(tasks[1].name, tasks[1].engine),
        MapOf(one.name, tasks[2].engine, cells),
    ]
    with Journal(place) as journal:
        journal.append({"header": about("", 0) | {"form": "quick", "files": {}}})
        for task, result in zip(tasks, found):
            journal.append({"task": asdict(task), task.kind: asdict(result)})
        journal.append({"footer": {"tasks": 3, "seconds": 1.0}})
    return place


def resumed(folder: Path) -> None:
    """What `speed --resume` makes of a journal before it measures."""
    with Journal(folder) as journal:
        Kept(journal, HEADER, True, SCENES)


READ: dict[str, tuple[dict, Callable[[Path], Any]]] = {
    "measured": (lines.KINDS.models, resumed),
    "stability": (stability_lines.KINDS.models, journalled),
}


@pytest.fixture(params=list(READ))
def journal(request: pytest.FixtureRequest) -> tuple[list[dict], dict, Callable[[Path], Any]]:
    """The lines of a journal, the models of its kinds, and what reads it."""
    folder = request.getfixturevalue(request.param)
    return [json.loads(line) for line in (folder / JOURNAL).read_text().splitlines()], *READ[
        request.param
    ]


def edits(whole: list[dict]) -> Iterator[tuple[int, dict, str]]:
    """(Number of a line, the line edited, what was done) for every field of every line, to all of
    `WRONG`."""
    for number, line in enumerate(whole):
        for at in places(line):
            for what, value in WRONG.items():
                yield number, edited(line, at, value), f"line {number + 1} {at} {what}"


def put(folder: Path, whole: list[dict], number: int = -1, line: Any = None) -> Path:
    """A folder with these lines, one of them another."""
    text = [json.dumps(line if k == number else each) for k, each in enumerate(whole)]
    (folder / JOURNAL).write_text("\n".join(text) + "\n")
    return folder


def fault_of(read: Callable[[Path], Any], folder: Path) -> str:
    """Why the journal there cannot be used; "" if it can."""
    try:
        read(folder)
    except (ValueError, FolderTaken) as fault:
        return str(fault)
    return ""


def test_a_journal_as_it_was_written_is_taken(journal: tuple, tmp_path: Path):
    """The control: nothing is refused that a command writes."""
    whole, _, read = journal
    assert fault_of(read, put(tmp_path, whole)) == ""


def test_every_edit_of_every_field_is_taken_or_refused(journal: tuple):
    """Thousands of edits, most of which no journal may hold: nothing but `ValueError` says so."""
    whole, models_, _ = journal
    refused = taken = 0
    for _, line, _ in edits(whole):
        try:
            kind_of(line, models_)
            taken += 1
        except ValueError:
            refused += 1

    assert refused > taken > 0
    assert refused + taken > 2000


def test_what_is_refused_names_its_line(journal: tuple, tmp_path: Path):
    """File, number, and what to do, of a sample of the edits; or it is a journal of something
    else."""
    whole, _, read = journal
    for number, line, what in random.Random(15).sample([*edits(whole)], 150):
        said = fault_of(read, put(tmp_path, whole, number, line))
        named = f"{JOURNAL}: line {number + 1}: ", "of something else", "has no header"
        assert not said or any(words in said for words in named), what
        assert not set("\x1b\r\0") & set(said), what


@pytest.mark.parametrize(
    "line", ["[" * 10**6, "{" * 10**6, "NaN", '"x"', "1e999", "\x00", '{"header": 1, "task": 2}']
)
def test_a_line_that_is_none_is_named(journal: tuple, tmp_path: Path, line: str):
    """Brackets in brackets without end, a number, a text, two kinds at once."""
    whole, _, read = journal
    with (put(tmp_path, whole) / JOURNAL).open("a") as file:
        file.write(line + "\n")
    assert f"line {len(whole) + 1}: " in fault_of(read, tmp_path)


def test_a_line_that_is_torn_is_as_good_as_none(journal: tuple, tmp_path: Path):
    """The last, without its end."""
    whole, _, read = journal
    with (put(tmp_path, whole) / JOURNAL).open("a") as file:
        file.write('{"task": ["err')
    assert fault_of(read, tmp_path) == ""


def test_a_line_that_is_there_twice_counts_once(journal: tuple, tmp_path: Path):
    """The later holds; a second header is refused where there is but one."""
    whole, _, read = journal
    assert fault_of(read, put(tmp_path, [*whole, whole[1]])) == ""


@pytest.mark.parametrize(
    ("fixture", "number", "at", "value", "said"),
    [
        (
            "measured",
            1,
            ("result", 0, "scenario"),
            "other",
            "result[0].scenario = 'other': must be 'slow_collision'",
        ),
        (
            "measured",
            1,
            ("result", 0, "error_radii"),
            -1.0,
            "result[0].error_radii = -1.0: must be a number that is",
        ),
        ("measured", 1, ("result", 0, "dt_s"), 0.5, "result[0].dt_s = 0.5: must divide"),
        (
            "measured",
            1,
            ("result", 0, "substeps"),
            3,
            "must have a row for each step that the task names",
        ),
        ("measured", 1, ("task", 2), "../../../x.toml", "must be of a scene that is measured"),
        ("measured", 1, ("task", 0), "x", "must begin as one of error scene"),
        ("measured", 1, ("task",), ["budget", "free_fall"], "must have as many parts as one of"),
        ("measured", 3, ("result", 0, "round"), 7, "must have each round"),
        ("measured", 3, ("result", 0, "engine"), "other", "must have each round"),
        ("measured", 3, ("result", 0, "cost"), 1e300, "result[0].cost = 1e+300: must be less than"),
        ("stability", 0, ("header", "form"), "x", "header.form = 'x': must be 'quick' or 'full'"),
        (
            "stability",
            0,
            ("header", "files"),
            {"../x": "y"},
            "header.files.../x = 'y': must match pattern",
        ),
        (
            "stability",
            1,
            ("limit", "trials", 0, "value"),
            1e9,
            "limit.trials[0].value = 1000000000.0: must be from",
        ),
        ("stability", 1, ("limit", "intervention"), "x", "limit.intervention = 'x': must be"),
        (
            "stability",
            1,
            ("limit", "case"),
            "../x.toml:dt",
            "limit: must be of the task's name and engine",
        ),
        ("stability", 2, ("law", "gaps", 0, 5), [[1]], "gaps[0][5]: must hold numbers"),
        ("stability", 3, ("map", "cells", 0, 0), 17, "cells: must be those of the map's grid"),
        (
            "stability",
            3,
            ("task", "engine"),
            "pymunk:x",
            "map: must be of the task's name and engine",
        ),
    ],
)
def test_what_does_not_fit_is_named(
    fixture: str,
    number: int,
    at: tuple,
    value: Any,
    said: str,
    tmp_path: Path,
    request: pytest.FixtureRequest,
):
    """By line, key, value and what is allowed."""
    text = (request.getfixturevalue(fixture) / JOURNAL).read_text().splitlines()
    whole = [json.loads(line) for line in text]
    fault = fault_of(
        READ[fixture][1], put(tmp_path, whole, number, edited(whole[number], at, value))
    )

    assert f"{JOURNAL}: line {number + 1}: " in fault
    assert said in fault
    assert re.search(r"; (delete|without)", fault)


@pytest.mark.parametrize(
    "text",
    [
        "[" * 10**6,
        "{}",
        "[]",
        "1",
        '{"command": 1, "finished": true, "files": {}}',
        "\0",
        '{"command": "x", "finished": "y", "files": {}}',
    ],
)
def test_a_record_of_what_was_made_that_is_none_is_as_good_as_none(tmp_path: Path, text: str):
    """made.json: what is in the folder then is nobody's."""
    (tmp_path / "made.json").write_text(text)
    assert read_made(tmp_path) is None


def test_a_file_that_never_ends_has_no_digest(tmp_path: Path):
    """A journal may name any path."""
    assert digest_of("/dev/zero") == digest_of(tmp_path) == digest_of("a\0b") == ""


@pytest.mark.long
def test_pages_are_made_of_what_is_taken(stability: Path, tmp_path: Path):
    """Of the edits that are let pass, a sample is written: an exception would fail this test."""
    whole = [json.loads(line) for line in (stability / JOURNAL).read_text().splitlines()]
    taken = [
        (number, line, what)
        for number, line, what in edits(whole)
        if not fault_of(journalled, put(tmp_path, whole, number, line))
    ]
    assert len(taken) > SAMPLE
    for number, line, what in random.Random(15).sample(taken, SAMPLE):
        write_files(put(tmp_path, whole, number, line))
        assert (tmp_path / "stability.html").exists(), what


def test_a_text_that_reads_nan_stays_a_text(measured: Path, stability: Path, tmp_path: Path):
    """It became a number when it was read back, and a traceback where it was taken for text."""
    whole = [json.loads(line) for line in (measured / JOURNAL).read_text().splitlines()]
    whole[1]["result"][0]["reason"] = "nan"
    with Journal(put(tmp_path, whole)) as journal:
        assert Kept(journal, HEADER, True, SCENES)[tuple(whole[1]["task"])][0]["reason"] == "nan"
    whole = [json.loads(line) for line in (stability / JOURNAL).read_text().splitlines()]
    whole[1]["limit"]["source"] = "nan"
    _, results = journalled(put(tmp_path, whole))
    assert [one.source for one in results.values() if isinstance(one, Limit)] == ["nan"]
