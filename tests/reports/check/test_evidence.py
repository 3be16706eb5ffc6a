"""What a fault comes with: the part it is filed under, the lines of the file, the formula;
and that no answer depends on the question before it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest

from crosscheck2d.adapters.own_solver.file import read_solver
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.reports.check.accesses import Access, accesses_of, part_of
from crosscheck2d.reports.check.consequences import with_consequences
from crosscheck2d.reports.check.formats import SCHEMA, as_json
from crosscheck2d.reports.check.lines import Source
from crosscheck2d.reports.check.loop import LEAVES_PAIRS_OUT
from crosscheck2d.reports.check.questions import QUESTIONS, ask, ask_in_two_orders
from crosscheck2d.reports.check.rows import UNKNOWN, CheckRow
from crosscheck2d.reports.check.verdict import FileCheck, check_file
from tests.reports.check.confusion import judged
from tests.reports.check.marked import marks_of
from tests.solvers.mutants import CORRECT, HERE, MUTANTS

CORRECT_FILES = HERE / "correct"
FAULTY = (
    "collisions_first.js",
    "against_itself.js",
    "typo_in_d.js",
    "state_in_impulse.py",
    "two_overlap_and_b_sign.js",
    "impulse_sign.js",
    "size_of_a_twice.js",
    "added_in_one_component.js",
)
COUNTS = {  # keeps a count of its calls, which it also writes into the sphere
    "count.js": "let n = 0;\nfunction integrate(s, dt) { s.alpha = ++n; }\n",
    "count.py": "n = 0\ndef integrate(s, dt):\n    global n\n    n += 1\n    s.alpha = n\n",
}


@pytest.fixture(scope="module")
def checks(tmp_path_factory: pytest.TempPathFactory) -> dict[str, FileCheck]:
    """The checks of some faulty files, and of a right one whose loop tests a sphere against
    itself."""
    folder = tmp_path_factory.mktemp("evidence")
    paths = [mutant.write(folder) for mutant in MUTANTS if mutant.name in FAULTY]
    return {p.name: one for p, one in judged([*paths, CORRECT_FILES / "every_order.js"]).items()}


def begin_with(one: FileCheck) -> CheckRow:
    """The fault that is named first."""
    return one.findings[0]


@pytest.mark.slow
def test_collisions_before_integration_are_a_fault_of_the_step(checks: dict[str, FileCheck]):
    """The template integrates first; with it the same pair collides in that step."""
    row = begin_with(checks["collisions_first.js"])

    assert (row.task, row.name, row.got) == (
        "loop",
        "integration first",
        "not the ufo and asteroid 0 and not asteroid 0 and asteroid 1",
    )
    assert "before all spheres are integrated" in row.cause
    assert [row.verdict for row in checks["every_order.js"].rows if row.name == "integration first"]


def test_a_sphere_against_itself_is_the_only_fault_that_is_named(checks: dict[str, FileCheck]):
    """`j = i`: with its line; what the function does to it is no other fault."""
    one = checks["against_itself.js"]

    assert [row.name for row in one.faults] == ["itself"]
    assert "lets a sphere collide with itself" in one.sentences[0]
    assert any("var j = i;" in text for _, text in begin_with(one).lines)


def test_a_wrong_restitution_is_right_at_no_speed(checks: dict[str, FileCheck]):
    """That it is the same wrong one at every speed follows from the fault and is not "right"."""
    speeds = "restitution at other speeds"
    (wrong,) = (row for row in checks["impulse_sign.js"].rows if row.name == speeds)
    (right,) = (row for row in checks["every_order.js"].rows if row.name == speeds)

    assert (wrong.verdict, right.verdict) == ("follows", "right")
    assert (wrong.expected, right.expected) == ("0.9", "0.9")


def test_a_step_whose_functions_are_wrong_is_partly_asked(checks: dict[str, FileCheck]):
    """What projectObjects does is asked, and which calls the step makes; what comes of calls of
    wrong functions is not."""
    assert checks["impulse_sign.js"].word("loop") == "partly asked"
    assert checks["impulse_sign.js"].word("1") == "right"
    assert checks["against_itself.js"].word("loop") == "fault"


def test_a_sphere_against_itself_is_free_where_it_changes_nothing(checks: dict[str, FileCheck]):
    """A function that returns for it is right."""
    one = checks["every_order.js"]
    (row,) = (row for row in one.rows if row.name == "itself")

    assert one.passed
    assert row.verdict == "free choice"


def test_an_error_in_the_code_of_2d_is_filed_under_2d(checks: dict[str, FileCheck]):
    """Not under 2a, where the function begins, which is right; with the line that failed."""
    row = begin_with(checks["typo_in_d.js"])

    assert row.task == "2d"
    assert row.lines == [(64, "sphereA.velocity.x += j / sphereA.mass * nx;")]
    assert checks["typo_in_d.js"].tasks["2a"] == "right"


@pytest.mark.parametrize(
    ("seen", "failed_at", "text", "part"),
    [
        ([], 1, "let d = hypot(x);", "2a"),
        ([("r", 0, "position"), ("r", 1, "position"), ("r", 0, "size")], 30, "d = 1", "2a"),
        ("distance", 30, "let o = oops;", "2b"),
        ("distance", 30, "a.position.x += oops;", "2b"),
        ("displaced", 30, "let J = oops;", "2c"),
        ("impulse", 30, "let x = oops;", "2d"),
        ("displaced", 30, "a['velocity']['x'] += oops", "2d"),
        ("displaced", 30, "if (a.velocity.x >= oops) return;", "2c"),
        ("impulse", 0, "", "2d"),
        ("kicked", 0, "", "2d"),
    ],
)
def test_where_a_call_fails_is_read_from_what_it_had_done(
    seen: str | list, failed_at: int, text: str, part: str
):
    """By the numbers it had read and written; the line that failed decides if it assigns one."""
    distance = [("r", who, field) for who in (0, 1) for field in ("position", "size")]
    displaced = [*distance, ("w", 0, "position"), ("w", 1, "position")]
    impulse = [*displaced, *(("r", who, f) for who in (0, 1) for f in ("velocity", "mass"))]
    known = {"distance": distance, "displaced": displaced, "impulse": impulse}
    known["kicked"] = [*displaced, ("w", 0, "velocity")]
    steps = known[seen] if isinstance(seen, str) else seen
    accesses = [Access(*step, [k + 1]) for k, step in enumerate(steps)]

    assert part_of(accesses, failed_at, "\n" * (failed_at - 1) + text) == part


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "endless_in_d.js",
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in ("endless_in_d.py", "endless_in_b.js")
        ),
    ],
)
def test_an_endless_loop_is_filed_under_the_part_it_stands_in(name: str, tmp_path: Path):
    """It is stopped; what it had written until then says where it is."""
    (mutant,) = (mutant for mutant in MUTANTS if mutant.name == name)
    (one,) = judged([mutant.write(tmp_path)]).values()

    assert one.faults[0].task == mutant.task
    assert "does not come back" in one.sentences[0]


def test_a_wrong_sign_of_j_shows_the_line_of_j_first(checks: dict[str, FileCheck]):
    """And those that apply it; not those of the normal, by which the displacement is right."""
    lines = [text for _, text in begin_with(checks["impulse_sign.js"]).lines]

    assert lines[0].startswith("var J = (1 + restitution)")
    assert len(lines) == 5
    assert all(".velocity." in line for line in lines[1:])


@pytest.mark.parametrize(
    ("old", "new", "shown"),
    [
        ("if (vn >= 0) return;", "if (vn <= 0) return;", "if (vn <= 0) return;"),
        (
            "for (var j = i + 1; j < numAsteroids; j++)",
            "for (var j = i + 1; j < numAsteroids; i++)",
            "for (var j = i + 1; j < numAsteroids; i++) sphere",
        ),
        ("var vn = (", "var vn = ((", "var vn = (("),
        ("(1 / sphereA.mass + 1 / sphereB.mass)", "1", "var J = -(1 + restitution) * vn / 1;"),
        (
            """
  sphereB.velocity.x -= J / sphereB.mass * nx;
  sphereB.velocity.y -= J / sphereB.mass * ny;
""",
            "\n",
            "sphereA.velocity.x += J / sphereA.mass * nx;",
        ),
    ],
    ids=["the guard", "the loop", "what cannot be read", "J without masses", "B left out"],
)
def test_the_line_at_fault_is_shown_even_if_it_reads_no_sphere(
    tmp_path: Path, old: str, new: str, shown: str
):
    """The condition, the head of the loop, the line that does not parse, that of J; and where B is
    left out, the lines beside which its own belong."""
    path = tmp_path / "Exercise.js"
    text = (CORRECT_FILES / "plain.js").read_text("utf-8")
    path.write_text(text.replace(old, new), "utf-8")
    (one,) = judged([path]).values()

    assert old in text
    assert any(line.startswith(shown) for _, line in begin_with(one).lines)


def test_a_fault_shows_the_lines_of_the_file_and_the_formula(checks: dict[str, FileCheck]):
    """Of each of two faults: the lines that write what is wrong, and how the exercise has it; in
    JSON, too."""
    one = checks["two_overlap_and_b_sign.js"]
    text = one.solver.text.splitlines() if one.solver else []
    overlap, sign = one.findings
    reported = as_json(marks_of(one))
    rows = {row["name"]: row for row in reported["files"][0]["rows"]}

    jsonschema.validate(reported, json.loads(SCHEMA.read_text()))
    assert "counted twice" in overlap.cause
    assert overlap.lines[0][1].startswith("var overlap")
    assert all("overlap" in line and text[k - 1].strip() == line for k, line in overlap.lines)
    assert overlap.formula.startswith("|xA' - xB'| = sizeA + sizeB")
    assert [line for _, line in sign.lines] == [
        "sphereB.velocity.x += J / sphereB.mass * nx;",
        "sphereB.velocity.y += J / sphereB.mass * ny;",
    ]
    assert rows["velocity of B"]["formula"] == "vA' = vA + J n / mA, vB' = vB - J n / mB"
    assert rows["velocity of B"]["lines"][0]["line"] == sign.lines[0][0]
    assert rows["velocity"]["lines"] == []


@pytest.mark.parametrize(
    ("cause", "task", "lines"),
    [
        ("the normal is not normalised", "2c", [47, 48, 52, 53]),
        ("dx is used for dy, too", "2a", [47, 48, 50, 52, 53]),
        ("the squared distance is used as the distance", "2b", [49]),
        ("A is moved along x only", "2b", [56, 57]),
        ("brackets are missing: sizes / 2 - distance", "2b", [55, 56, 57, 58, 59]),
        ("the velocity of B is left out", "2c", [61]),
        ("the mass of A is used for both", "2c", [63]),
        ("it follows from the faults above", "scenes", []),
    ],
)
def test_the_lines_are_those_in_which_the_cause_is(cause: str, task: str, lines: list[int]):
    """Not all that the part of the task reads or writes: of plain.js, whose lines are known."""
    solver = read_solver(CORRECT_FILES / "plain.js")
    row = CheckRow("a row", task, "", "", "", "fault", cause)
    with SolverProcess(solver) as process:
        found = Source(process, solver.text).of(row)

    assert [line for line, _ in found] == lines


def test_pairs_that_are_left_out_show_the_calls_and_the_heads_of_their_loops():
    """Of performSimStep in plain.js: where a loop begins and ends decides which pairs it has."""
    solver = read_solver(CORRECT_FILES / "plain.js")
    row = CheckRow("pairs", "loop", "", "", "", "fault", LEAVES_PAIRS_OUT)
    with SolverProcess(solver) as process:
        found = Source(process, solver.text).of(row)

    assert [line for line, _ in found] == [85, 86, 87, 88]


PUSH = (
    (
        "function norm",
        "function push(s, J, n) { s.velocity = plus(s.velocity, times(J / s.mass, n)); }\n"
        "function norm",
    ),
    ("A.velocity = minus(A.velocity, times(J / A.mass, n));", "push(A, J, n);"),
    ("B.velocity = plus(B.velocity, times(J / B.mass, n));", "push(B, J, n);"),
)
ENDLESS = "while (gap < 0) { A.position.x += 0; B.position.y += 0; }"


@pytest.mark.parametrize(
    ("changes", "lines"),
    [
        pytest.param(
            [("{ x: a.x - b.x, y: a.y - b.y }", "{ x: a.x - b.x, y: a.y + b.y }")],
            ["function minus", "var r = minus(", "var gap", "if (gap > 0)"],
            id="in a helper",
        ),
        pytest.param(
            [("minus(A.velocity, B.velocity), n)", "minus(A.velocity, B.velocity), r)")],
            ["var closing", "A.velocity =", "B.velocity ="],
            id="in one of two places",
        ),
        pytest.param(
            [("if (gap > 0)", "if (gap < 0)")],
            ["var gap", "if (gap < 0)"],
            id="in the comparison",
        ),
        pytest.param(
            PUSH,
            ["function push", "push(A"],
            id="in a call of a function of one's own",
        ),
        pytest.param(
            [("var closing", f"{ENDLESS}\n  var closing")],
            ["while (gap < 0)"],
            id="in an endless loop",
        ),
        pytest.param(
            [
                ("function norm", "var last = { x: 0, y: 0 };\nfunction norm"),
                ("var closing", "last.x += n.x;\n  var closing"),
                ("times(J / B.mass, n)", "times(J / B.mass * last.x, n)"),
            ],
            ["var last", "last.x += n.x"],
            id="in what is kept",
        ),
    ],
)
def test_the_lines_lead_to_the_mistake(
    changes: Sequence[tuple[str, str]], lines: list[str], tmp_path: Path
):
    """Of helpers.js, whose vectors are read by functions that know no sphere."""
    text = (CORRECT_FILES / "helpers.js").read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "helpers.js").write_text(text, "utf-8")
    first = begin_with(check_file(tmp_path / "helpers.js"))

    assert len(first.lines) == len(lines), first
    for (number, shown), begin in zip(first.lines, lines):
        assert shown.startswith(begin)
        assert text.splitlines()[number - 1].strip() == shown


def test_one_wrong_component_is_one_fault_and_costs_one_question(checks: dict[str, FileCheck]):
    """No known formula gives vA.y: pairs at rest, moving apart or exchanged, and the momentum, show
    the same mistake. The lines are those that write the velocity of A."""
    one = checks["added_in_one_component.js"]
    wrong = {row.name for row in one.rows if row.verdict in ("fault", "follows")}
    (mark,) = marks_of(one)

    assert {row.cause for row in one.faults} == {
        "only vA.y is wrong: no known mistake gives its numbers"
    }
    assert wrong > {"velocity of A", "momentum", "separating", "A and B exchanged", "at rest"}
    assert [text for _, text in begin_with(one).lines] == [
        "sphereA.velocity.x += J / sphereA.mass * nx;",
        "sphereA.velocity.y += (2 * unA + J / sphereA.mass) * ny;",
    ]
    assert (mark.points, mark.not_judged) == (18.5, 0.0)


def test_a_size_used_twice_is_one_fault(checks: dict[str, FileCheck]):
    """Of the detection: the overlap, and what depends on who is A, follow from it."""
    assert [row.name for row in checks["size_of_a_twice.js"].faults] == ["overlap"]


@pytest.mark.parametrize("name", ["complex_numbers.py", "plain.js"])
def test_the_lines_that_are_shown_are_those_of_the_task_and_not_of_a_helper(name: str):
    """`put(a.velocity, ...)` is where a velocity is written, not the body of put."""
    solver = read_solver(CORRECT_FILES / name)
    with SolverProcess(solver) as process:
        seen = accesses_of(process, QUESTIONS["collision/light on heavy"], solver.text)
    lines = solver.text.splitlines()
    wrote = {field: {a.line for a in seen if (a.kind, a.field) == ("w", field)} for field in FIELDS}

    assert wrote["position"]
    assert not wrote["position"] & wrote["velocity"]
    for field, numbers in wrote.items():
        assert all(field in lines[k - 1] for k in numbers)


FIELDS = ("position", "velocity")


@pytest.mark.parametrize("name", COUNTS)
def test_a_question_in_a_fresh_world_is_the_first_that_was_asked(name: str, tmp_path: Path):
    """Any number of them: the file counts to one each time. In one world it counts on."""
    (tmp_path / name).write_text(COUNTS[name])
    asked = {k: QUESTIONS["force"] for k in "abc"}
    with SolverProcess(read_solver(tmp_path / name)) as process:
        alone = ask(process, asked, afresh=True)
        together = ask(process, asked)
        answers, others = ask_in_two_orders(process, asked)

    assert [answer.last[0].alpha for answer in alone.values()] == [1, 1, 1]
    assert [answer.last[0].alpha for answer in together.values()] == [2, 3, 4]
    assert [answer.last[0].alpha for answer in answers.values()] == [1, 1, 1]
    assert set(others) == {"a", "b", "c"}


def test_a_module_beside_a_solver_is_new_in_a_fresh_world_too(tmp_path: Path):
    """It may keep state as well as the file itself."""
    (tmp_path / "counter.py").write_text("n = 0\n")
    text = "import counter\ndef integrate(s, dt):\n    counter.n += 1\n    s.alpha = counter.n\n"
    (tmp_path / "solver.py").write_text(text)
    with SolverProcess(read_solver(tmp_path / "solver.py")) as process:
        alone = ask(process, {k: QUESTIONS["force"] for k in "ab"}, afresh=True)

    assert [answer.last[0].alpha for answer in alone.values()] == [1, 1]


def test_who_keeps_a_value_is_told_so_and_nothing_else_is_blamed(checks: dict[str, FileCheck]):
    """J += for J =: the global by its name, and its line; the step around it is not accused."""
    one = checks["state_in_impulse.py"]
    row = begin_with(one)

    assert (row.task, row.name) == ("2c", "same answer again")
    assert "keeps a value in the global J from one call to the next" in row.cause
    assert any("J += -(1" in text for _, text in row.lines)
    assert one.word("loop") == "partly asked"
    assert {row.name for row in one.faults if row.task != "scenes"} == {"same answer again"}


def test_who_remembers_what_changes_nothing_is_right():
    """The negative control: a memo of unit vectors in a global."""
    path = next(path for path in CORRECT if path.name == "reflection_matrix.js")
    with SolverProcess(read_solver(path)) as process:
        asked = {name: q for name, q in QUESTIONS.items() if not name.startswith("reach/")}
        _, others = ask_in_two_orders(process, asked)

    assert others == {}


@pytest.fixture(scope="module")
def consequences(tmp_path_factory: pytest.TempPathFactory) -> dict[str, FileCheck]:
    """The checks of files whose fault shows in several tasks, and of one with two faults."""
    folder = tmp_path_factory.mktemp("consequences")
    names = ("mass_of_a_twice.js", "two_masses_and_b_mass.py", "typo_in_c.js", "root_missing.js")
    paths = [mutant.write(folder) for mutant in MUTANTS if mutant.name in names]
    return {path.name: one for path, one in judged(paths).items()}


@pytest.mark.slow
def test_what_depends_on_who_is_a_is_a_fault_of_the_part_that_makes_it_so(
    consequences: dict[str, FileCheck],
):
    """With a wrong mass in J both get opposite impulses: 2d is right. Where B also takes the mass
    of A they do not: 2d is wrong by itself."""
    found = {
        name: [(row.task, row.cause) for row in one.faults if row.name == "A and B exchanged"]
        for name, one in consequences.items()
    }

    assert found["mass_of_a_twice.js"] == [("2c", "the mass of A is used for both")]
    assert consequences["mass_of_a_twice.js"].tasks["2d"] == "right"
    assert found["two_masses_and_b_mass.py"] == [
        ("2d", "the impulse on B is divided by the mass of A")
    ]


def test_what_follows_from_a_fault_in_another_task_is_no_fault_of_its_own(
    consequences: dict[str, FileCheck],
):
    """A typo in 2c stops the step, too; a root that is missing in 2a spoils 2b and 2c. In JSON the
    verdict is one of the schema; two faults remain two."""
    typo, root = consequences["typo_in_c.js"], consequences["root_missing.js"]

    jsonschema.validate(as_json(marks_of(typo, root)), json.loads(SCHEMA.read_text()))
    assert [task for task, word in typo.tasks.items() if word == "fault"] == ["2c"]
    assert typo.tasks["loop"] == "follows"
    assert [root.tasks[task] for task in ("2a", "2b", "2c", "scenes")] == ["fault"] + 3 * [
        "follows"
    ]
    assert "it follows from the fault in 2a" in {row.cause for row in root.rows}
    assert len(consequences["two_masses_and_b_mass.py"].findings) == 2


def test_an_unknown_fault_follows_from_nothing_that_is_right():
    """Only what was found wrong before can cause it: the same cause once, or a displacement that
    changes velocities."""
    rows = [
        CheckRow(name, task, "", "", "", verdict, cause)
        for name, task, verdict, cause in (
            ("velocities", "2b", "right", ""),
            ("impulse", "2c", "fault", UNKNOWN),
            ("momentum", "2d", "fault", UNKNOWN),
        )
    ]
    pushed = [replace(rows[0], verdict="fault", cause="the displacement changes it"), *rows[1:]]

    assert with_consequences(rows) == rows
    assert [row.verdict for row in with_consequences(pushed)] == ["fault", "follows", "follows"]


LINES = {  # mutant -> the beginning of the line with its mistake
    "mass_squared.js": "var m2",
    "speed_not_normal.js": "var vn",
    "velocities_returned.js": "return [",
    "mean_with_last.js": "lastJ = J",
    "a_stopped_first.js": "sphereA.velocity.x = sphereA.velocity.y = 0",
}


def test_the_line_of_a_local_variable_is_among_those_of_its_fault(tmp_path: Path):
    """A mistake may be in a line that reads and writes no sphere."""
    paths = [mutant.write(tmp_path) for mutant in MUTANTS if mutant.name in LINES]
    lines = {p.name: [text for _, text in begin_with(c).lines] for p, c in judged(paths).items()}

    assert set(lines) == set(LINES)
    assert all(any(line.startswith(LINES[name]) for line in lines[name]) for name in LINES), lines
