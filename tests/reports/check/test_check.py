"""What the check says of right and of wrong solvers: `python -m tests.reports.check.confusion`
makes the whole table."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.adapters.own_solver import gl_matrix
from crosscheck2d.adapters.own_solver.file import SolverFailed, read_solver
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.reports.check.functions import is_read
from crosscheck2d.reports.check.loop import left_out, loop_rows
from crosscheck2d.reports.check.questions import QUESTIONS, Ball, SolverAnswer, ask
from crosscheck2d.reports.check.rows import TASKS
from crosscheck2d.reports.check.scenes import bounds, contact_faults, scene_of, scenes, truth_of
from crosscheck2d.reports.check.solver import check_solver
from crosscheck2d.reports.check.verdict import FileCheck, check_file
from tests.reports.check.confusion import TABLE, judged, said_first, said_too
from tests.reports.check.marked import marks_of
from tests.solvers.mutants import CORRECT, HERE, MUTANTS

# A solver takes half a second: some here, of either language and any task; all of both lists in the
# long test.
FAST, FAST_CORRECT = MUTANTS[::48], CORRECT[::12]


def test_the_catalogue_is_large_enough_and_covers_every_task():
    """At least 20 mutants in each language, one or more for each task; 20 with two faults; 30
    correct solvers, of which each language has ten."""
    assert min(Counter(mutant.base[-2:] for mutant in MUTANTS).values()) >= 20
    assert {mutant.task for mutant in MUTANTS} == set(TASKS) - {"file", "scenes"}
    assert sum(mutant.second is not None for mutant in MUTANTS) >= 20
    assert len(CORRECT) >= 30
    assert min(Counter(path.suffix for path in CORRECT).values()) >= 10


@pytest.mark.parametrize(
    "solvers", [FAST_CORRECT, pytest.param(CORRECT, marks=pytest.mark.long)], ids=["some", "all"]
)
def test_no_correct_solver_is_faulted(solvers: list[Path]):
    """However it is written: no fault, and every task asked that the file has."""
    faults = {path.name: one.sentences for path, one in judged(solvers).items() if not one.passed}

    assert faults == {}


@pytest.mark.parametrize("e", ["0", "0.5", "1"])
@pytest.mark.parametrize(
    ("name", "approach"),
    [("plain.js", "vn >= 0"), ("plain.py", "vn >= 0.0"), ("one_sided.js", "")],
)
def test_no_step_is_faulted_for_its_restitution(name: str, approach: str, e: str, tmp_path: Path):
    """The exercise's step handles an asteroid and the ufo twice. Where rounding leaves an overlap
    and pairs that move apart get an impulse, too, e = 1 restores the velocities."""
    text = (HERE / "correct" / name).read_text("utf-8")
    assert "restitution = 0.9" in text.lower()
    assert approach in text
    text = re.sub("(restitution) = 0.9", rf"\1 = {e}", text, flags=re.I)
    text = text.replace(approach, "1 < 0") if approach else text
    (tmp_path / name).write_text(text, "utf-8")
    with SolverProcess(read_solver(tmp_path / name)) as process:
        rows = loop_rows(process, faulty=False, kicks_apart=True)

    assert len(rows) > 5
    assert [row for row in rows if row.verdict == "fault"] == []


def test_the_pairs_that_a_step_leaves_out_are_counted_if_its_calls_are_known():
    """Of a ufo and three asteroids: asteroids 0 and 1, and 1 and 2. A step that gives only near
    pairs to the collision function calls for none of those that are far apart."""
    spheres = [[Ball((0.0, 0.0))] * 4]
    calls = tuple(("collide", *pair) for pair in ((1, 0), (2, 0), (3, 0), (1, 3)))
    first = "asteroid 0 and asteroid 1"
    known, unknown = SolverAnswer(spheres, calls=calls), SolverAnswer(spheres)

    assert left_out([(1, 2)], [(0, 1)], known) == f"2 pairs, for example {first}"
    assert left_out([(1, 2), (2, 3)], [(0, 1)], known) == f"{first}, asteroid 1 and asteroid 2"
    assert left_out([(1, 2)], [(0, 1)], unknown) == first


def test_a_mutant_is_found_with_its_cause_first(tmp_path: Path):
    """Some of the catalogue; the long test has them all."""
    checks = judged([mutant.write(tmp_path) for mutant in FAST])

    assert [
        mutant.name for mutant in FAST if not said_first(mutant, checks[tmp_path / mutant.name])
    ] == []
    assert spread([checks[tmp_path / mutant.name] for mutant in FAST if not mutant.second]) == {}


def test_what_is_missing_gives_no_points(tmp_path: Path):
    """Nor does what is done instead of it: of 20 points, 8 are for task 1, 2 for each of its four
    quantities, and 7 for the impulse and the new velocities."""
    expected = {"no_impulse.js": 13.0, "exchanged.js": 13.0, "linear_missing.js": 16.0}
    paths = [mutant.write(tmp_path) for mutant in MUTANTS if mutant.name in expected]

    assert {
        one.check.path.name: one.points for one in marks_of(*judged(paths).values())
    } == expected


def test_a_file_with_a_short_reach_is_asked_about_deeper_overlaps(tmp_path: Path):
    """Sizes taken as diameters cost the detection, and leave no task without a judgement."""
    (mutant,) = (mutant for mutant in MUTANTS if mutant.name == "diameters.py")
    (mark,) = marks_of(*judged([mutant.write(tmp_path)]).values())

    assert (mark.points, mark.not_judged) == (18.0, 0.0)


def test_a_comparison_the_wrong_way_round_leaves_nothing_unjudged(tmp_path: Path):
    """Such a file is asked about pairs with a gap; a displacement that is right for overlaps only
    is no fault, and a second mistake is found."""
    plain = (HERE / "correct" / "plain.js").read_text("utf-8")
    turned = plain.replace("distance >= sphereA.size", "distance < sphereA.size")
    sizes = "sphereA.size + sphereB.size - distance"
    texts = {
        "turned.js": turned,
        "clamped.js": turned.replace(f"= {sizes};", f"= Math.max(0, {sizes});"),
        "factor.js": turned.replace("-(1 + restitution)", "-restitution"),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, "utf-8")
    checks = judged([tmp_path / name for name in texts])
    marks = marks_of(*checks.values())

    assert {(one.points, one.not_judged) for one in marks[:1]} == {(18.0, 0.0)}
    assert [(row.task, row.cause) for row in marks[0].check.causes] == [
        ("2a", "the comparison is the wrong way round")
    ]
    assert [row.task for row in marks[1].check.causes] == ["2a"]
    assert (marks[1].points, marks[1].not_judged) == (17.0, 1.0)
    assert [row.task for row in marks[2].check.causes] == ["2a", "2c"]
    assert marks[2].check.causes[1].cause == "the factor is e, not (1 + e)"


def test_a_wrong_sign_of_e_is_found_at_e_of_one(tmp_path: Path):
    """There the impulse is 0, as if there were none: the same text with another e tells it. An
    update that never changes a velocity stays a fault of that."""
    plain = (HERE / "correct" / "plain.js").read_text("utf-8")
    plain = plain.replace("restitution = 0.9", "restitution = 1")
    texts = {
        "sign.js": plain.replace("-(1 + restitution)", "-(1 - restitution)"),
        "nothing.js": plain.replace("J = -(1 + restitution)", "J = -0 * (1 + restitution)"),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, "utf-8")
    sign, nothing = judged([tmp_path / name for name in texts]).values()
    (mark,) = marks_of(sign)

    assert [(row.task, row.cause) for row in sign.causes] == [
        ("2c", "the factor is (1 - e), not (1 + e)")
    ]
    assert (mark.points, mark.not_judged) == (17.0, 0.0)
    assert sign.causes[0].lines == [
        (63, "var J = -(1 - restitution) * vn / (1 / sphereA.mass + 1 / sphereB.mass);")
    ]
    assert [row.task for row in nothing.causes] == ["2d"]


def test_a_mistake_in_a_shared_function_is_named_as_one(tmp_path: Path):
    """Without those that a right integrate calls, too; with them if it is wrong; and nothing is
    said of a file with one fault, or of one whose faults have causes of their own."""
    right = (HERE / "correct" / "helpers.js").read_text("utf-8")
    texts = {
        "minus.js": right.replace("y: a.y - b.y }", "y: a.y + b.y }"),
        "times.js": right.replace("y: k * a.y }", "y: k * a.x }"),
        "one.js": right.replace("(1 + e) * closing", "e * closing"),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, "utf-8")
    minus, times, one = judged([tmp_path / name for name in texts]).values()
    said = "One mistake may be behind these faults, in a function that they share: "

    assert minus.shared == f"{said}minus (line 38), dot (line 40), norm (line 41)."
    assert times.shared == f"{said}plus (line 37), times (line 39)."
    assert one.faults
    assert one.shared == ""
    (mark,) = marks_of(minus)
    assert minus.shared in mark.summary
    assert minus.shared not in replace(mark, low=True).summary


def test_a_step_without_a_scene_is_said_not_to_be_judged(tmp_path: Path):
    """In the same sentence that says that no fault was found."""
    text = (HERE / "correct" / "plain.js").read_text("utf-8")
    (tmp_path / "a.js").write_text(text.replace("function initScene", "function start"), "utf-8")
    (one,) = judged([tmp_path / "a.js"]).values()

    assert one.passed
    assert "performSimStep was not judged: the file has no function initScene" in one.sentences[0]


def test_a_scene_that_is_made_on_loading_is_one(tmp_path: Path):
    """A file without initScene whose ufo and asteroids are there once it is loaded has its step
    judged, in both languages."""
    for kind, ends in (("js", "start();\n"), ("py", "start()\n")):
        text = (HERE / "correct" / f"plain.{kind}").read_text("utf-8")
        text = text.replace("initScene", "start") + ends
        wrong = text.replace("i + 1; j < numAsteroids", "i + 2; j < numAsteroids")
        wrong = wrong.replace("asteroids[i + 1 :]", "asteroids[i + 2 :]")
        (tmp_path / f"right.{kind}").write_text(text, "utf-8")
        (tmp_path / f"wrong.{kind}").write_text(wrong, "utf-8")
        checks = judged([tmp_path / f"right.{kind}", tmp_path / f"wrong.{kind}"])
        right, wrong_one = checks.values()

        assert right.passed
        assert "performSimStep was not judged" not in right.sentences[0]
        assert {row.verdict for row in right.of("loop")} == {"right"}
        assert [row.cause for row in wrong_one.causes] == [
            "a loop of performSimStep leaves pairs out"
        ]


def test_the_end_of_a_file_is_in_its_last_line(tmp_path: Path):
    """Where a bracket is missing V8 reads on, beyond the file's text."""
    (tmp_path / "a.js").write_text("function integrate(sphere, dt) {\n  if (dt) {\n}\n", "utf-8")
    with pytest.raises(SolverFailed, match="line 3"):
        SolverProcess(read_solver(tmp_path / "a.js"))


def spread(checks: list[FileCheck]) -> dict[str, list[str]]:
    """Of files with one fault each, those that are said to have faults in several tasks."""
    tasks = {one.path.name: sorted({row.task for row in one.faults}) for one in checks}
    return {name: found for name, found in tasks.items() if len(found) > 1}


@pytest.mark.long
def test_the_committed_table_is_what_comes_out(tmp_path: Path):
    """All mutants: found, cause first, the second fault of those with two, as the table says; and
    38 of 40 or better."""
    checks = judged([mutant.write(tmp_path) for mutant in MUTANTS])
    right = {mutant.name: said_first(mutant, checks[tmp_path / mutant.name]) for mutant in MUTANTS}
    rows = {row["solver"]: row for row in csv.DictReader(TABLE.read_text().splitlines())}

    assert sum(right.values()) >= 0.95 * len(right)
    # both parts are missing: one return leaves them out
    assert spread([checks[tmp_path / mutant.name] for mutant in MUTANTS if not mutant.second]) == {
        "no_impulse.js": ["2c", "2d"]
    }
    assert {name: rows[name]["first cause is right"] for name in right} == {
        name: "yes" if is_right else "no" for name, is_right in right.items()
    }
    two = [mutant for mutant in MUTANTS if mutant.second is not None]
    assert [m.name for m in two if not said_too(m, checks[tmp_path / m.name])] == []
    assert {rows[mutant.name]["second is found"] for mutant in two} == {"yes"}


@pytest.mark.slow
def test_the_same_file_gets_the_same_rows():
    """Nothing is random, and no clock is read."""
    path = CORRECT[-1]

    assert check_solver(path) == check_solver(str(path))


def test_two_mistakes_are_both_reported(tmp_path: Path):
    """One in task 1 and one in 2d: two sentences, in this order, without those that only follow."""
    text = (CORRECT[0].parent / "plain.py").read_text()
    text = text.replace(" / sphere.mass * dt", " * dt").replace(
        "sphereB.velocity.x -= J", "sphereB.velocity.x += J"
    )
    (tmp_path / "solver.py").write_text(
        text.replace("sphereB.velocity.y -= J", "sphereB.velocity.y += J")
    )
    sentences = FileCheck(Path("solver.py"), check_solver(tmp_path / "solver.py")).sentences

    assert "the force is not divided by the mass" in sentences[0]
    assert "the impulse on B has the sign of that on A" in sentences[1]


def test_a_file_that_can_be_loaded_only_once_is_told_so(tmp_path: Path):
    """Each fresh world loads it again: nothing else is blamed for what it then lacks."""
    text = (CORRECT[0].parent / "plain.py").read_text()
    once = "import sys\nassert not hasattr(sys, 'loaded_before')\nsys.loaded_before = True\n"
    (tmp_path / "solver.py").write_text(text.replace("import random\n", once + "import random\n"))
    one = FileCheck(Path("solver.py"), check_solver(tmp_path / "solver.py"))

    assert [row.task for row in one.faults] == ["file"]
    assert "it can be loaded only once: AssertionError" in one.sentences[0]


def test_a_global_that_only_collects_affects_no_answer():
    """The list of depths is not read; the memo of reduced masses is."""
    text = (CORRECT[0].parent / "memo.py").read_text()
    assert "hits.append(r)" in text
    assert is_read("REDUCED", text)
    assert not is_read("hits", text)


def test_another_restitution_is_a_free_choice_and_is_judged_by_itself():
    """The file with e = 0.5 has no fault, and its scenes have that e."""
    rows = {
        row.name: row
        for row in check_solver(next(path for path in CORRECT if path.name == "unusual_e.js"))
    }

    assert rows["restitution"].verdict == "free choice"
    assert "the file has e = 0.5, the exercise 0.9" in rows["restitution"].cause
    assert rows["oblique"].verdict == "right"


def test_a_free_choice_is_no_fault_and_does_not_read_as_one():
    """`<=`, a one-sided displacement, an impulse on pairs that part, no guard for equal centres:
    what was chosen is said, and nothing else was expected."""
    rows = {
        row.name: row
        for row in check_solver(next(path for path in CORRECT if path.name == "one_sided.js"))
    }

    choices = [rows[name] for name in ("just touching", "shares", "separating", "same centre")]
    assert {row.verdict for row in choices} == {"free choice"}
    assert [row.expected for row in choices] == [
        "yes or no",
        "any shares",
        "none, or that of the formula",
        "anything",
    ]
    touch, split, separating, same_centre = (row.cause for row in choices)
    assert touch == "the comparison is <="
    assert (
        "only A is moved, by the whole overlap. The task asks to displace the two until they meet"
        in split
    )
    assert "does not say how far each one moves" in split
    assert "as the formula is printed" in separating
    assert "the file does not handle this case" in same_centre


def test_an_unknown_mistake_is_said_to_be_unknown(tmp_path: Path):
    """Numbers that no formula of the table gives are reported as numbers."""
    text = (CORRECT[0].parent / "plain.py").read_text()
    (tmp_path / "solver.py").write_text(
        text.replace("J = -(1 + RESTITUTION) * vn", "J = -(1 + RESTITUTION) * vn**3")
    )
    sentences = FileCheck(Path("solver.py"), check_solver(tmp_path / "solver.py")).sentences

    assert "unknown" in sentences[0]
    assert "Got:" in sentences[0]


@pytest.mark.slow
def test_the_numbers_beside_an_unknown_mistake_are_those_of_a_pair_that_is_wrong(tmp_path: Path):
    """Of five pairs the first comes out right: what came is not what was expected."""
    text = (CORRECT[0].parent / "plain.js").read_text()
    assert "var vn = (" in text
    (tmp_path / "solver.js").write_text(text.replace("var vn = (", "var vn = parseInt("))
    (row,) = (row for row in check_solver(tmp_path / "solver.js") if row.name == "impulse")

    assert row.cause.startswith("unknown: it is right for some pairs")
    assert row.got.split()[0] != row.expected.split()[0]


@pytest.mark.parametrize(
    ("old", "new", "task", "cause"),
    [
        (
            "1 / sphereB.mass)",
            "1 / sphereB.Mass)",
            "2c",
            "the impulse is not a number (a field that does not exist",
        ),
        pytest.param(
            "if (vn >= 0) return;",
            "vn /= sphereB.Mass;",
            "2c",
            "the impulse is not a number (a field that does not",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "if (vn >= 0) return;",
            "vn *= vn / vn;",
            "2c",
            "the velocities of a pair at relative rest become NaN or infinite",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "/ (1 / sphereA.mass + 1 / sphereB.mass)",
            "/ 0",
            "2c",
            "the impulse is not a number (a field that does not",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "-= J / sphereB.mass * nx",
            "-= J / sphereB.mas * nx",
            "2d",
            "the velocity of B becomes NaN or infinite",
            marks=pytest.mark.slow,
        ),
        (
            "  var overlap = ",
            "  var overlap = sphereA.sise - ",
            "2b",
            "the positions become NaN or infinite",
        ),
    ],
)
def test_numbers_that_are_none_have_one_cause_and_accuse_nothing_else(
    tmp_path: Path, old: str, new: str, task: str, cause: str
):
    """A misspelt field is NaN in JavaScript, a division by zero infinite: neither is read as
    another mistake."""
    text = (CORRECT[0].parent / "plain.js").read_text()
    assert old in text
    (tmp_path / "solver.js").write_text(text.replace(old, new))
    faults = [
        row
        for row in check_solver(tmp_path / "solver.js")
        if row.verdict == "fault" and row.task[0] == "2"
    ]

    assert {row.task for row in faults} == {task}
    assert len({row.cause for row in faults}) == 1
    assert faults[0].cause.startswith(cause)


def test_the_bound_on_a_scene_lets_a_right_solver_pass_and_a_wrong_restitution_not():
    """Motions that are exact but for e = 0.85 leave the bound of e = 0.9 wherever there are at most
    three spheres."""
    for (scenario, record), (other, other_record) in zip(scenes(0.9)[1:4], scenes(0.85)[1:4]):
        truth, off = truth_of(scenario, record), truth_of(other, other_record)

        assert (
            np.abs(off.position - truth.position).max()
            > bounds(scenario, record, truth.t, 1e-3).max()
        )


def test_a_contact_is_judged_by_the_formula():
    """The right outcome passes; a velocity off by 1 % does not, nor a reaction at a distance."""
    scene = scene_of([[0.0, 0.0, 1.0, 0.0], [0.9, 0.0, -1.0, 0.0]], [0.5, 0.5], [1.0, 1.0], 0.9)
    before = [[0.0, 0.0, 1.0, 0.0], [0.9, 0.0, -1.0, 0.0]]
    after = [[-0.05, 0.0, -0.9, 0.0], [0.95, 0.0, 0.9, 0.0]]

    assert contact_faults(np.array([before, after]), scene, 0, 1) == {}
    after[1][2] = 0.91
    assert (
        "sphere 1 has (0.91, 0) m/s after it, not (0.9, 0) m/s"
        in contact_faults(np.array([before, after]), scene, 0, 1)["2c"]
    )
    at_touch = np.array([before, after]) + [
        [[0, 0, 0, 0], [0.1, 0, 0, 0]],
        [[0.05, 0, 0, 0], [0.05, 0, 0, 0]],
    ]
    assert "sphere 1 has (0.91, 0) m/s after it" in contact_faults(at_touch, scene, 0, 1)["2c"], (
        "who reacts at a touch is judged"
    )
    assert contact_faults(at_touch[[0, 0]], scene, 0, 1) == {}, "who does not is free"
    far = np.array([before, after]) + np.array([[0.0] * 4, [0.3, 0.0, 0.0, 0.0]])
    assert "collide at a distance" in contact_faults(far, scene, 0, 1)["2a"]
    apart = np.array([before, before]) + [np.zeros((2, 4)), [[-0.1, 0, 0, 0], [0.1, 0, 0, 0]]]
    assert list(contact_faults(apart, scene, 0, 1)) == ["2b", "2c"], "each part by itself"


READS_IT = """function integrate(sphere, dt) {
  sphere.alpha = typeof globalThis['ve' + 'c2'] === 'object' ? globalThis['ve' + 'c2'].mark : 0;
}
"""


def library(mark: int) -> str:
    """A library of that name, which can be reported from others."""
    return f"var vec2 = {{ mark: {mark} }};"


@pytest.fixture
def none_fetched(monkeypatch: pytest.MonkeyPatch):
    """As without the extra `js`."""
    monkeypatch.setattr(gl_matrix, "file_of", lambda _package: None)


def library_read(path: Path) -> float:
    """The mark of the gl-matrix that a solver finds; 0 if it finds none."""
    with SolverProcess(read_solver(path)) as process:
        return ask(process, {"force": QUESTIONS["force"]})["force"].last[0].alpha


def test_gl_matrix_is_there_for_who_calls_it_and_for_nobody_else(tmp_path: Path):
    """A name of its own in the text loads it; a file without one has no such globals, and no other
    text of it."""
    (tmp_path / "gl-matrix.js").write_text(library(1))
    for name, text in {"with.js": READS_IT + "// vec2\n", "without.js": READS_IT}.items():
        (tmp_path / name).write_text(text)

    assert library_read(tmp_path / "with.js") == 1.0
    assert library_read(tmp_path / "without.js") == 0.0
    assert read_solver(tmp_path / "without.js").imported == ()


@pytest.mark.slow
@pytest.mark.usefixtures("none_fetched")
def test_the_gl_matrix_beside_the_file_comes_before_that_of_npm_and_the_nearest_package_first(
    tmp_path: Path,
):
    """One after the other is put there, each before all that were there."""
    solver = tmp_path / "class" / "anna" / "Exercise.js"
    solver.parent.mkdir(parents=True)
    solver.write_text(READS_IT + "// vec2\n")
    nearer = [
        tmp_path / "node_modules" / "gl-matrix" / "main.js",
        tmp_path / "node_modules" / "gl-matrix" / "gl-matrix-min.js",
        tmp_path / "node_modules" / "gl-matrix" / "dist" / "gl-matrix.js",
        tmp_path / "class" / "node_modules" / "gl-matrix" / "dist" / "gl-matrix-min.js",
        solver.parent / "gl-matrix-2.8.1.min.js",
        solver.parent / "gl-matrix-min.js",
        solver.parent / "gl-matrix.js",
    ]
    (tmp_path / "node_modules" / "gl-matrix").mkdir(parents=True)
    (tmp_path / "node_modules" / "gl-matrix" / "package.json").write_text('{"main": "main.js"}')
    assert library_read(solver) == 0.0
    for mark, path in enumerate(nearer, 1):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(library(mark))
        assert library_read(solver) == mark


@pytest.mark.slow
def test_from_version_3_on_the_names_are_taken_out_of_gl_matrix(tmp_path: Path):
    """Unless the file has such a name of its own, which stays as it is."""
    (tmp_path / "gl-matrix.js").write_text("var glMatrix = { vec2: { mark: 5 } };")
    (tmp_path / "plain.js").write_text(READS_IT + "// vec2\n")
    (tmp_path / "named.js").write_text("const { vec2 } = glMatrix;\n" + READS_IT)
    (tmp_path / "own.js").write_text("var vec2 = { mark: 6 };\n" + READS_IT)

    assert [library_read(tmp_path / f"{name}.js") for name in ("plain", "named", "own")] == [
        5.0,
        5.0,
        6.0,
    ]


def test_the_gl_matrix_that_is_fetched_comes_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """After that of a folder above; without it a solver gets the one of the extra."""
    solver = tmp_path / "anna" / "Exercise.js"
    solver.parent.mkdir()
    solver.write_text(READS_IT + "// vec2\n")
    fetched = tmp_path / "cache" / "gl-matrix-min.js"
    fetched.parent.mkdir()
    fetched.write_text(library(7))
    monkeypatch.setattr(gl_matrix, "file_of", lambda _package: fetched)
    assert library_read(solver) == 7.0
    (tmp_path / "node_modules" / "gl-matrix").mkdir(parents=True)
    (tmp_path / "node_modules" / "gl-matrix" / "gl-matrix.js").write_text(library(8))
    assert library_read(solver) == 8.0


def test_gl_matrix_is_read_once_and_decides_what_the_solver_is(tmp_path: Path):
    """As a module beside a solver.py: what is saved later is not played, and another library is
    another solver."""
    path = tmp_path / "Exercise.js"
    path.write_text(READS_IT + "// vec2\n")
    (tmp_path / "gl-matrix.js").write_text(library(1))
    before = read_solver(path)
    (tmp_path / "gl-matrix.js").write_text(library(2))
    after = read_solver(path)
    with SolverProcess(before) as process:
        assert ask(process, {"force": QUESTIONS["force"]})["force"].last[0].alpha == 1.0

    assert (before.digest, [name for name, _ in before.imported]) == (
        after.digest,
        ["gl-matrix.js"],
    )
    assert before.source != after.source


@pytest.mark.usefixtures("none_fetched")
def test_who_calls_gl_matrix_where_there_is_none_is_reported_where_to_put_it(tmp_path: Path):
    """One sentence, where it is called and where what lies there is no library; nothing where the
    name is his own."""
    path = tmp_path / "Exercise.js"
    path.write_text((CORRECT[0].parent / "gl_vec3.js").read_text())
    with pytest.raises(
        SolverFailed,
        match=r"mat4 is not defined: put the gl-matrix\.js that the exercise hands out",
    ):
        SolverProcess(read_solver(path))
    (tmp_path / "gl-matrix.js").write_text("import { vec2 } from 'elsewhere';")
    with pytest.raises(
        SolverFailed, match=r"calls gl-matrix\.js, which cannot be loaded .*; put the gl-matrix\.js"
    ):
        SolverProcess(read_solver(path))


COLLIDE = "function sphereSphereCollisionHandling(sphereA, sphereB) {\n"


@pytest.mark.usefixtures("none_fetched")
def test_a_file_whose_gl_matrix_is_missing_is_not_judged(tmp_path: Path):
    """It may be right: it has no fault and no points, whether it calls gl-matrix where it is loaded
    or only in a collision, or what lies beside it is no library."""
    path = tmp_path / "Exercise.js"
    path.write_text((CORRECT[0].parent / "gl_vec3.js").read_text())
    at_once = check_file(path)
    (tmp_path / "gl-matrix.js").write_text("import { vec2 } from 'elsewhere';")
    no_library = check_file(path)
    (tmp_path / "gl-matrix.js").unlink()
    plain = next(file for file in CORRECT if file.name == "plain.js").read_text()
    path.write_text(plain.replace(COLLIDE, COLLIDE + "  var n = vec2.create();\n"))
    in_a_collision = check_file(path)

    for one in (at_once, no_library, in_a_collision):
        assert (one.rows, one.faults) == ([], [])
        assert "cannot be judged without the gl-matrix that it calls" in one.refused
        assert "put the gl-matrix.js that the exercise hands out beside the file" in one.refused


def test_what_opens_a_window_in_a_browser_costs_nothing(tmp_path: Path):
    """alert, confirm and prompt are closed at once, as by somebody who only wants to go on."""
    path = tmp_path / "Exercise.js"
    plain = next(file for file in CORRECT if file.name == "plain.js").read_text()
    calls = "  if (confirm('go on?') || prompt('how far?')) return;\n  alert('x');\n"
    path.write_text(plain.replace(COLLIDE, COLLIDE + calls))

    assert check_file(path).passed


def test_a_worker_answers_in_order_and_reads_back_what_it_was_given():
    """A call that does nothing to a sphere far away leaves its 12 numbers, bit for bit, in both
    languages."""
    for name in ("plain.js", "plain.py"):
        with SolverProcess(read_solver(CORRECT[0].parent / name)) as process:
            far = QUESTIONS["touch"]._replace(
                balls=(Ball((0.1, 0.2), (1 / 3, 0.7)), Ball((9.0, 1e-7), m=5e-324))
            )
            answer = ask(process, {"far": far})["far"]

        assert answer.last == list(far.balls)


def test_the_step_is_judged_beside_a_wrong_impulse(tmp_path: Path):
    """By its calls: a ufo that is integrated twice is found, and the pairs are right."""
    text = next(file for file in CORRECT if file.name == "plain.js").read_text()
    path = tmp_path / "Exercise.js"
    for old, new in ((REDUCED, SUM), (ONCE, 2 * ONCE)):
        assert text.count(old) == 1
        text = text.replace(old, new)
    path.write_text(text)
    one = check_file(path)
    step = {row.name: row.verdict for row in one.of("loop")}

    assert [row.cause for row in one.causes if row.task == "loop"] == [TWICE]
    assert (step["all spheres"], step["pairs"]) == ("fault", "right")


REDUCED, SUM = "(1 / sphereA.mass + 1 / sphereB.mass)", "(sphereA.mass + sphereB.mass)"
ONCE, TWICE = "  integrate(ufo, dt);\n", "performSimStep integrates the ufo 2 times"
