"""Points, ids and the formats of marks, of checks that are made up here: no solver is run."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import jsonschema
import pytest

from crosscheck2d.reports.check.class_page import write_class_page
from crosscheck2d.reports.check.command import alphabetical, grading_of
from crosscheck2d.reports.check.formats import FORMATS, SCHEMA
from crosscheck2d.reports.check.marks import Marked, id_of
from crosscheck2d.reports.check.outcomes import OUTCOMES
from crosscheck2d.reports.check.points import (
    AS_A_WHOLE,
    DEFAULT,
    QUESTIONS,
    BadPoints,
    Points,
    read_points,
)
from crosscheck2d.reports.check.rows import UNKNOWN, CheckRow, Verdict
from crosscheck2d.reports.check.verdict import FileCheck
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import CORRECT

REST = f"momentum, rest kept; for the points of a task: {AS_A_WHOLE}"
DATA = Path(__file__).parents[2] / "data" / "marks"
HOSTILE = "=1+1 <b>\x00\x1b[31m \udcff \N{PILE OF POO}\n\r" + "\N{SNOWMAN}" * 300


def row(task: str, name: str, verdict: Verdict = "right", cause: str = "") -> CheckRow:
    """An answer."""
    return CheckRow(name, task, "What?", "1 m", "2 m", verdict, cause, [(3, "x = 1")])


def marked(
    *changed: CheckRow, points: Points | None = None, name: str = "anna", low: bool = False
) -> Marked:
    """A file of which all is right but what is changed."""
    rows = {(task, name): row(task, name) for task, names in QUESTIONS.items() for name in names}
    rows |= {(one.task, one.name): one for one in changed}
    path = Path("class") / name / "Exercise.js"
    check = FileCheck(path, [row("file", "loads"), *rows.values()], restitution=0.9, seconds=1.5)
    return Marked(name, check, Path("class"), points or read_points(), low)


def points_of(*changed: CheckRow) -> dict[str, float]:
    """The points of the tasks that do not have all."""
    return {one.task: one.points for one in marked(*changed).tasks if one.points != one.most}


def test_a_right_file_has_all_points_of_the_two_tasks():
    """20, and a free choice, or what follows from a fault, costs none of them."""
    free = row("2a", "overlap", "free choice", "any")
    follows = row("2d", "velocity of A", "follows", "it follows from the fault in 2c")

    assert (marked().points, marked().most) == (20.0, 20.0)
    assert {one.task for one in marked().tasks} == {"1", "2a", "2b", "2c", "2d"}
    assert points_of(free, follows) == {}


def test_a_fault_costs_the_points_of_its_question_and_a_cause_costs_once():
    """The dearest of the questions that it spoils; two unknown causes are two."""
    impulse = row("2c", "impulse", "fault", "the factor (1 + e) is missing")

    assert points_of(impulse) == {"2c": 1.0}
    assert points_of(impulse, replace(impulse, name="restitution")) == {"2c": 1.0}
    assert points_of(impulse, row("2c", "restitution", "fault", "another")) == {"2c": 0.0}
    assert points_of(
        row("1", "velocity", "fault", UNKNOWN), row("1", "spin", "fault", UNKNOWN)
    ) == {"1": 4.0}


def test_a_fault_in_a_question_without_points_costs_as_the_cheapest_that_has_some():
    """So that no fault of a task is free; nor does it cost more than there is."""
    assert points_of(row("2c", "energy", "fault", "any")) == {"2c": 3.0}
    assert points_of(*(row("2d", n, "fault", n) for n in ("momentum", "rest kept", "x"))) == {
        "2d": 0.0
    }


def test_full_points_for_a_file_with_a_fault_are_explained():
    """The step has no points: who is told of a fault and of 20 of 20 is told why."""
    said = marked(row("loop", "all spheres", "fault", "any")).summary

    assert said.endswith("20 of 20 points. The step, performSimStep gives no points.")
    assert "no points" not in marked(row("1", "spin", "fault", "any")).summary


def test_what_could_not_be_asked_gives_no_points_and_is_counted():
    """A task of which nothing was asked; one question of several; one that fails as a whole."""
    check = marked().check
    rows = [one for one in check.rows if one.task != "2b"] + [row("2b", "one point", "not asked")]
    some = replace(marked(), check=replace(check, rows=rows))
    fails = [one for one in check.rows if one.task != "1"] + [
        row("1", "implemented", "fault", "it throws"),
        row("1", "velocity", "not asked"),
    ]
    failed = replace(marked(), check=replace(check, rows=fails))

    assert (some.points, some.not_judged) == (17.0, 3.0)
    assert marked(row("2c", "restitution", "not asked")).not_judged == 1.0
    assert (failed.points, failed.not_judged) == (12.0, 0.0)


def test_points_are_given_a_task_or_a_question(tmp_path: Path):
    """A number is shared as by default; a task that is left out gives nothing."""
    path = tmp_path / "tasks.toml"
    path.write_text("1 = 4\nloop = 6\n[2c]\nimpulse = 5\n")

    points = read_points(path)
    fault = marked(row("1", "velocity", "fault", "any"), points=points)

    assert points["1"] == {"velocity": 1.0, "position": 1.0, "spin": 1.0, "angle": 1.0}
    assert points["loop"] == dict.fromkeys(QUESTIONS["loop"], 1.0)
    assert (points["2c"], list(points)) == ({"impulse": 5.0}, ["1", "2c", "loop"])
    assert (fault.points, fault.most) == (14.0, 15.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 = ", "is not TOML"),
        ("[1]\n# \udcdcbung\nspin = 1", "line 2 is not UTF-8; save the file as UTF-8"),
        ("1 = 4,5", "write 4.5, not 4,5"),
        ("3 = 1", "there is no task '3'; tasks: 1, 2a,"),
        ("[1]\nvelosity = 1", "task 1 has no question 'velosity'; questions: velocity, position,"),
        ("1 = -1", "task 1: -1 is no number of points, 0 or more"),
        # in a copy of tasks.toml: below all headers, and above them
        (f"{DEFAULT.read_text()}2c = 4\n", f"questions: velocity of A, velocity of B, {REST}"),
        (f"2c = 4\n{DEFAULT.read_text()}", f"as a whole or by question: {AS_A_WHOLE}"),
        ("[2c]\nimpulse = nan", "task 2c, impulse: nan is no number of points"),
        ("2a = true", "task 2a: True is no number"),
        ("2a = 'two'", "task 2a: 'two' is no number"),
        ("1 = 0", "gives no points at all"),
        ("", "gives no points at all"),
        ("1 = 1e308\n2c = 1e308", "gives more than can be added"),
    ],
)
def test_bad_points_are_one_sentence(tmp_path: Path, text: str, message: str):
    """Each names the file, the task and what is allowed."""
    path = tmp_path / "tasks.toml"
    path.write_bytes(text.encode(errors="surrogateescape"))

    with pytest.raises(BadPoints, match=re.escape(message)) as raised:
        read_points(path)

    assert str(raised.value).startswith(f"{path}: ")
    assert "\n" not in str(raised.value)


def test_points_of_an_editor_of_windows_are_read(tmp_path: Path):
    """With a mark before UTF-8, and its ends of lines."""
    path = tmp_path / "tasks.toml"
    path.write_bytes(b"\xef\xbb\xbf# \xc3\x9cbung\r\n[1]\r\nspin = 4.5\r\n")

    assert read_points(path) == {"1": {"spin": 4.5}}


def test_tasks_that_a_file_of_points_leaves_out_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """Else a file with faults in them would have all of its points."""
    path = tmp_path / "tasks.toml"
    path.write_text("1 = 20")
    grading_of(path, "", "full")

    assert "gives no points for task 2a, 2b, 2c, 2d" in capsys.readouterr().err
    grading_of(None, "", "full")
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_every_question_that_may_have_points_is_asked():
    """Of a right file: the table of questions is the check's own. Those that only a faulty file or
    one with another step is asked are not in it."""
    from crosscheck2d.reports.check.verdict import check_file

    plain = next(path for path in CORRECT if path.name == "plain.js")
    found = {(one.task, one.name) for one in check_file(plain).rows}
    known = {(task, name) for task, names in QUESTIONS.items() for name in names}

    # an energy that grows is laid to the impulse where the impulse is wrong
    assert known - found <= {("2c", "energy"), ("loop", "ufo")}
    assert found - known <= {("file", "loads"), ("2d", "energy")}
    assert {(task, name) for task, names in read_points(DEFAULT).items() for name in names} <= found


@pytest.mark.parametrize(
    ("file", "pattern", "expected"),
    [
        ("anna/Exercise.js", "", "anna"),
        ("anna/src/Exercise.js", "", "anna"),
        ("anna.js", "", "anna"),
        ("anna_123_Exercise.js", r"_(\d+)_", "123"),
        ("Anna M_77_file/Exercise.js", r"\d+", "77"),
        ("anna/Exercise.js", r"\d+", "anna"),
        ("anna/Exercise.js", r"\d*", "anna"),  # it matches nothing at all, which is no id
        ("Exercise.js", "", "class"),
        ("gus.zip", "", "gus"),
    ],
)
def test_an_id_is_the_folder_or_the_file_or_what_the_pattern_matches(
    tmp_path: Path, file: str, pattern: str, expected: str
):
    """Below a class; a file named as the exercise says has its folder's name."""
    root = tmp_path / "class"

    assert id_of(root / file, root, re.compile(pattern) if pattern else None) == expected


def students() -> list[Marked]:
    """One of each kind: right, faulty, with hints and without, not loaded, refused, hostile."""
    faulty = [
        row("2c", "impulse", "fault", "the factor (1 + e) is missing"),
        row("2d", "velocity of B", "not asked", "it fails"),
        row("scenes", "crowd", "follows", "it follows from the faults above"),
        row("2a", "just touching", "free choice", "the comparison is <"),
    ]
    hostile = marked(
        row("1", "velocity", "fault", HOSTILE),
        row("1", "implemented", "fault", HOSTILE),
        row("loop", "step", "fault", HOSTILE),
        name=HOSTILE.replace("\x00", ""),
    )
    broken = [row("file", "loads", "fault", HOSTILE)]
    return [
        marked(),
        marked(*faulty),
        marked(*faulty, low=True),
        replace(marked(), check=FileCheck(Path("class/dora"), broken)),
        replace(marked(), check=FileCheck(Path("class/eve"), [], "class/eve: holds no .js file")),
        hostile,
    ]


def read_csv(text: str) -> list[dict[str, Any]]:
    """The rows by header; one that is too long has the key None."""
    return list(csv.DictReader(StringIO(text)))


def read_xml(text: str) -> dict[str, Any]:
    """An element, and those in it."""

    def element(one: ElementTree.Element) -> dict[str, Any]:
        return {
            "tag": one.tag,
            "attributes": dict(one.attrib),
            "elements": [element(child) for child in one],
        }

    return element(ElementTree.fromstring(text))


READERS: dict[str, Callable[[str], Any]] = {
    "json": json.loads,
    "junit": read_xml,
    "gradescope": json.loads,
    "csv": read_csv,
}


def schema_of(name: str) -> dict[str, Any]:
    """The schema of a format; of a table that of a row."""
    path = SCHEMA if name == "json" else DATA / f"{name}.schema.json"
    schema = json.loads(path.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return {"type": "array", "items": schema, "$defs": schema["$defs"]} if name == "csv" else schema


def test_every_format_has_a_reader_a_schema_and_a_place_in_the_help():
    """All but the table, which is for people."""
    schemas = {path.name.partition(".")[0] for path in DATA.glob("*.schema.json")} | {"json"}
    words = re.findall(r"\w+", crosscheck("check", "--help", cwd=DATA).stdout)

    assert set(FORMATS) - {"table"} == set(READERS)
    assert set(READERS) <= schemas
    assert set(FORMATS) <= set(words)


@pytest.mark.parametrize("name", READERS)
def test_what_is_written_is_as_its_schema_says(name: str):
    """Of every kind of student, and of all at once where a format takes a class."""
    kind, schema = FORMATS[name], schema_of(name)
    groups = [[one] for one in students()] + ([] if kind.single else [students()])
    for group in groups:
        text = kind.text(group)
        jsonschema.validate(READERS[name](text), schema)
        assert kind.mark in text.encode(errors="backslashreplace")[:4096]


def test_every_format_says_which_points_a_person_decides_on(tmp_path: Path):
    """Beside the total, or the task: a file of which 10 of 20 points could not be judged, because
    no collision was seen."""
    unseen = ("2b", "2c", "2d")
    rows = [one for one in marked().check.rows if one.task not in unseen]
    rows += [row(task, "implemented", "not asked", "no pair collides") for task in unseen]
    (tmp_path / "Exercise.js").touch()
    check = replace(marked().check, path=tmp_path / "Exercise.js", rows=rows)
    one = replace(marked(), check=check, root=tmp_path / "Exercise.js", low=True)
    write_class_page(tmp_path / "class.html", [replace(one, root=tmp_path)])
    said = "10 points could not be judged: a person decides."

    assert (one.points, one.not_judged) == (10.0, 10.0)
    for name in ("table", "junit", "gradescope"):
        assert said in FORMATS[name].text([one]), name
    for points in (3, 4):
        assert f"{points} points could not be judged" in FORMATS["gradescope"].text([one])
    assert READERS["csv"](FORMATS["csv"].text([one]))[0]["not judged"] == "10"
    assert "A person decides on the points under" in (tmp_path / "class.html").read_text()


@pytest.mark.parametrize(
    ("name", "edit"),
    [
        ("gradescope", lambda one: one["tests"][0].update(status="pass")),
        ("gradescope", lambda one: one["tests"][0].update(visibility="shown")),
        ("gradescope", lambda one: one["tests"][0].pop("score")),
        ("gradescope", lambda one: one.update(points=1)),
        ("gradescope", lambda one: one["tests"][0].update(number=1)),
        ("json", lambda one: one["files"][0].pop("id")),
        ("json", lambda one: one["files"][0]["marks"]["1"].update(points=-1)),
        ("csv", lambda rows: rows[0].update({None: ["more"]})),
        ("csv", lambda rows: rows[0].update(id="=1+1")),
        ("csv", lambda rows: rows[0].update({"task 1": "8,0"})),
        ("junit", lambda one: one["elements"][0]["elements"][0].update(tag="test")),
        ("junit", lambda one: one["elements"][0]["attributes"].pop("failures")),
    ],
)
def test_a_schema_rejects_what_its_reader_would_not_take(name: str, edit: Callable[[Any], object]):
    """Negative controls: one change of a valid file each."""
    written = READERS[name](FORMATS[name].text([marked()]))
    edit(written)
    schema = schema_of(name)
    if name == "csv":
        written = [{str(key): value for key, value in one.items()} for one in written]

    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(written, schema)


def test_all_formats_tell_the_same_points():
    """Gradescope adds up its tests."""
    for one in students():
        written = {name: READERS[name](FORMATS[name].text([one])) for name in READERS}
        (line,) = written["csv"]

        assert sum(test["score"] for test in written["gradescope"]["tests"]) == one.points
        assert written["gradescope"]["score"] == one.points
        assert float(line["total"]) == one.points
        assert written["json"]["files"][0]["points"] == one.points


def test_a_status_means_the_same_in_every_format():
    """The one table; what is refused, or could not be asked, never passes."""
    faulty = students()[1]
    tests = json.loads(FORMATS["gradescope"].text([faulty]))["tests"]
    statuses = [mark.status for mark in faulty.tasks]

    assert statuses == ["right", "right", "right", "fault", "not asked"]
    assert [test["status"] for test in tests] == [
        OUTCOMES[status].gradescope for status in statuses
    ]
    assert [status for status, one in OUTCOMES.items() if one.points != "given"] == [
        status for status, one in OUTCOMES.items() if one.gradescope == "failed"
    ]


FEW = [(task, name) for task, names in QUESTIONS.items() for name in names[:3]]


def test_low_hints_tell_the_question_and_the_numbers_and_no_cause():
    """With full hints the cause, the lines and the formula stand there, too."""
    fault = row("2c", "impulse", "fault", "the factor (1 + e) is missing")
    full, low = ("\n".join(marked(fault, low=low).feedback("2c")) for low in (False, True))

    assert "What? Got: 1 m. Expected: 2 m." in full
    assert low == "impulse: wrong answer. What? Got: 1 m. Expected: 2 m."
    assert "the factor (1 + e) is missing" in full
    assert "line 3: x = 1" in full
    assert "exercise: J = -(1 + e)" in full


def test_a_table_of_marks_names_who_handed_in_nothing():
    """A row a student; without points, with the reason."""
    rows = read_csv(FORMATS["csv"].text(students()))

    assert len(rows) == len(students())
    assert [one["total"] for one in rows][:2] == ["20", "15.5"]
    assert (rows[4]["total"], rows[4]["begin with"]) == ("0", "holds no .js file")
    assert rows[0]["seconds"] == "1.50"


def test_names_are_sorted_as_people_do():
    """A letter with an accent is at the letter, a small one at the large one."""
    names = ["Zoe", "Ärger", "anna", "Bodo", "Émile", "Emil"]

    assert [path.name for path in sorted(map(Path, names), key=alphabetical)] == [
        *("anna", "Ärger", "Bodo", "Emil", "Émile", "Zoe"),
    ]
