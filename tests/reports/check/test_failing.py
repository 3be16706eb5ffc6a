"""A file whose collision function fails: the parts of task 2 before the failure are judged, no
other is."""

from __future__ import annotations

from pathlib import Path

import pytest

from crosscheck2d.reports.check.accesses import Access, part_of
from crosscheck2d.reports.check.page import write_page
from crosscheck2d.reports.check.verdict import FileCheck, check_file
from tests.reports.check.marked import marks_of
from tests.solvers.mutants import CORRECT

JS = next(path for path in CORRECT if path.name == "plain.js").read_text()
PY = next(path for path in CORRECT if path.name == "plain.py").read_text()
ARRAYS = next(path for path in CORRECT if path.name == "arrays.py").read_text()
PARTS = ("2a", "2b", "2c", "2d")
RIGHT, FAULT, NOT_ASKED = "right", "fault", "not asked"

Changes = dict[str, str]
THROWS_IN_C: Changes = {"(1 + restitution)": "(1 + Restitution)"}
THROWS_IN_D: Changes = {"sphereB.velocity.x -= J": "sphereB.velocity.x -= j"}
TOO_FAR: Changes = {"overlap / 2": "overlap"}
DOUBLED: Changes = {"distance >= sphereA.size": "distance / 2 >= sphereA.size"}
DISPLACEMENT = JS[JS.index("  var overlap") : JS.index("  var vn")]
LAST = "  sphereB.velocity.y -= J / sphereB.mass * ny;\n"
ENDLESS = "  for (var k = 0; k < 2; k + 1) sphereA.velocity.x += J / sphereA.mass * nx;\n"


def checked(folder: Path, text: str, changes: Changes) -> FileCheck:
    """The check of a changed text."""
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = folder / ("solver.py" if text.startswith('"""') else "Exercise.js")
    path.write_text(text)
    return check_file(path)


def verdicts(one: FileCheck) -> list[str]:
    """Of the four parts of task 2."""
    return [one.tasks[part] for part in PARTS]


def test_a_failure_in_2c_costs_2c_and_leaves_2a_and_2b_with_their_points(tmp_path: Path):
    """Detection and displacement are right; what comes after the failure is for a person to
    judge."""
    one = checked(tmp_path, JS, THROWS_IN_C)
    (marks,) = marks_of(one)
    points = {mark.task: (mark.points, mark.not_judged) for mark in marks.tasks}

    assert verdicts(one) == [RIGHT, RIGHT, FAULT, NOT_ASKED]
    assert {row.task for row in one.faults} == {"2c"}
    assert [points[part] for part in PARTS] == [(2, 0), (3, 0), (0, 0), (0, 3)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "changes", "expected"),
    [
        pytest.param(JS, THROWS_IN_D, [RIGHT, RIGHT, RIGHT, FAULT], id="2d, after A has got J"),
        pytest.param(
            JS,
            {"sphereA.velocity.x += J": "sphereA.velocity.x += j"},
            [RIGHT, RIGHT, NOT_ASKED, FAULT],
            id="2d",
        ),
        pytest.param(
            JS,
            {"(1 + restitution)": "1"} | THROWS_IN_D,
            [RIGHT, RIGHT, NOT_ASKED, FAULT],
            id="2d, after A has got a wrong J",
        ),
        pytest.param(
            PY, {"(1 + RESTITUTION)": "(1 + e)"}, [RIGHT, RIGHT, FAULT, NOT_ASKED], id="2c, Python"
        ),
        pytest.param(
            ARRAYS,
            {"-(1 + world.restitution)": "-(1 + world.Restitution)"},
            [RIGHT, RIGHT, FAULT, NOT_ASKED],
            id="2c, advance",
        ),
        pytest.param(
            JS,
            {"var overlap = sphereA.size": "var overlap = Size"},
            [RIGHT, FAULT, NOT_ASKED, NOT_ASKED],
            id="2b",
        ),
        pytest.param(
            JS,
            {"if (distance >= sphereA.size": "if (distance >= Size"},
            [FAULT, NOT_ASKED, NOT_ASKED, NOT_ASKED],
            id="2a",
        ),
        pytest.param(
            JS,
            {"1 / sphereB.mass)": "1 / sphereB.Mass)"},
            [RIGHT, RIGHT, FAULT, NOT_ASKED],
            id="no number in 2c",
        ),
        pytest.param(
            JS,
            {"  sphereA.velocity.x += J / sphereA.mass * nx;\n": ENDLESS},
            [RIGHT, RIGHT, NOT_ASKED, FAULT],
            id="endless in 2d",
        ),
        pytest.param(
            JS,
            {"if (distance === 0) {": "if (distance === 0) { for (;;);"},
            [FAULT, RIGHT, RIGHT, RIGHT],
            id="endless for spheres at the same place",
        ),
        pytest.param(
            PY,
            {"    J = -(1": "    while vn:\n        pass\n    J = -(1"},
            [RIGHT, RIGHT, FAULT, NOT_ASKED],
            id="endless in 2c, Python",
            marks=pytest.mark.long,
        ),
        pytest.param(
            JS,
            {"  sphereB.position": "  // sphereB.position", "overlap / 2": "overlap"} | THROWS_IN_C,
            [RIGHT, RIGHT, FAULT, NOT_ASKED],
            id="only A is moved",
        ),
    ],
)
def test_the_parts_before_a_failure_are_right_and_those_after_it_are_not_asked(
    tmp_path: Path, text: str, changes: Changes, expected: list[str]
):
    """Wherever it is: the part itself is the only fault."""
    one = checked(tmp_path, text, changes)

    assert verdicts(one) == expected
    assert {row.task for row in one.faults} == {PARTS[expected.index(FAULT)]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "expected", "causes"),
    [
        pytest.param(
            TOO_FAR | THROWS_IN_C,
            [RIGHT, FAULT, FAULT, NOT_ASKED],
            ["the overlap is counted twice", "Restitution is not defined"],
            id="2b and 2c",
        ),
        pytest.param(
            DOUBLED | THROWS_IN_D,
            [FAULT, RIGHT, RIGHT, FAULT],
            ["the sizes are doubled", "j is not defined"],
            id="2a and 2d",
        ),
        pytest.param(
            {"if (distance >= sphereA.size + sphereB.size) return;": ""} | THROWS_IN_C,
            [FAULT, RIGHT, FAULT, NOT_ASKED],
            ["nothing is compared: all pairs collide", "Restitution is not defined"],
            id="nothing is compared",
        ),
    ],
)
def test_a_fault_before_the_failure_is_named_first(
    tmp_path: Path, changes: Changes, expected: list[str], causes: list[str]
):
    """The negative control: what is judged before a failure can be wrong."""
    one = checked(tmp_path, JS, changes)

    assert verdicts(one) == expected
    assert [cause in row.cause for cause, row in zip(causes, one.causes, strict=True)] == [
        True,
        True,
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        pytest.param(
            {DISPLACEMENT: "", LAST: LAST + DISPLACEMENT} | THROWS_IN_C,
            id="it is to be displaced after the velocities",
        ),
        pytest.param(
            {"  sphereB.position": "  // sphereB.position"} | THROWS_IN_C,
            id="A is moved by half of the overlap",
        ),
    ],
)
def test_a_displacement_that_the_failure_may_have_cut_off_is_not_judged(
    tmp_path: Path, changes: Changes
):
    """Nobody can tell whether the rest of it would have followed."""
    one = checked(tmp_path, JS, changes)

    assert verdicts(one) == [RIGHT, NOT_ASKED, FAULT, NOT_ASKED]
    assert [row.cause for row in one.of("2b")] == [
        "the call fails before it has moved both spheres"
    ]


@pytest.mark.slow
def test_the_page_does_not_say_that_a_scene_was_searched_where_none_can_be_played(tmp_path: Path):
    """A file that fails in a collision plays no scene."""
    one = checked(tmp_path, JS, TOO_FAR | THROWS_IN_C)
    write_page(tmp_path / "check.html", *marks_of(one))
    said = (tmp_path / "check.html").read_text()

    assert "No scene was played with this file. The rows below show the faults." in said
    assert "was found that shows" not in said


def test_the_part_of_an_endless_loop_does_not_depend_on_where_it_was_stopped():
    """A loop of (b) reads sizes and writes a position; whichever access is the latest, it is (b)'s.
    One that reads velocities is not."""
    once = [Access("r", who, field, [22]) for field in ("position", "size") for who in (0, 1)]
    displacing = [
        *(Access("r", who, "size", [26]) for who in (0, 1)),
        *(Access(kind, 0, "position", [26]) for kind in "rw"),
    ]
    approaching = [Access("r", who, field, [26]) for who in (0, 1) for field in WITH_VELOCITY]

    parts = {part_of([*once, *displacing * 100, last], 0, "") for last in displacing}
    others = {part_of([*once, *approaching * 100, last], 0, "") for last in approaching}

    assert (parts, others) == ({"2b"}, {"2c"})


WITH_VELOCITY = ("position", "velocity")
