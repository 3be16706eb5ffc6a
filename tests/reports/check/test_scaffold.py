"""The autograders for Gradescope, GitHub Classroom and PrairieLearn, in folders that stand for
their machines."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from reports.check.points import DEFAULT
from tests.reports.check.test_marks import schema_of
from tests.reports.check.test_outputs import RIGHT, WRONG
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck


def test_a_scaffold_is_written_to_an_empty_folder_only(tmp_path: Path):
    """Its scripts can be executed; somebody's folder is kept; one sentence and exit 2."""
    first, again = (
        crosscheck("check", "--scaffold", "gradescope", "new", "--hints", "low", cwd=tmp_path)
        for _ in range(2)
    )
    other = crosscheck("check", "--scaffold", "moodle", "x", cwd=tmp_path)
    (tmp_path / "bad.toml").write_text("1 = -1")
    bad = crosscheck("check", "--scaffold", "gradescope", "x", "--points", "bad.toml", cwd=tmp_path)
    files = {path.name: os.access(path, os.X_OK) for path in (tmp_path / "new").iterdir()}

    assert [one.returncode for one in (first, again, other, bad)] == [0, 2, 2, 2]
    assert again.stderr == "new: is there and not empty; name another folder\n"
    assert other.stderr == "--scaffold moodle: is none of gradescope, classroom, prairielearn\n"
    assert "task 1: -1 is no number of points" in bad.stderr
    assert {name for name, runs in files.items() if runs} == {"setup.sh", "run_autograder"}
    assert (tmp_path / "new" / "tasks.toml").read_text() == DEFAULT.read_text()
    assert "--hints low" in (tmp_path / "new" / "run_autograder").read_text()
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_the_autograder_answers_every_submission(tmp_path: Path):
    """A right file, a wrong one, none at all: results each time, and no failure of the grader; a
    bad grader fails."""
    crosscheck("check", "--scaffold", "gradescope", "source", cwd=tmp_path)
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    (tmp_path / "venv" / "bin" / "crosscheck").symlink_to(CROSSCHECK)
    submission = tmp_path / "submission"
    submission.mkdir()
    scores = []
    for text in (RIGHT.read_text(), WRONG.write(submission).read_text(), None):
        shutil.rmtree(submission)
        submission.mkdir()
        if text is not None:
            (submission / "Exercise.js").write_text(text)
        status = run(tmp_path)
        results = json.loads((tmp_path / "results" / "results.json").read_text())
        scores.append((status, results["score"]))
    (tmp_path / "source" / "tasks.toml").write_text("1 = -1")

    assert scores == [(0, 20.0), (0, 17.0), (0, 0.0)]
    assert run(tmp_path) != 0
    assert not (tmp_path / "results" / "results.json").exists(), "no results of another submission"


def run(home: Path) -> int:
    """The exit status of run_autograder in a folder that stands for /autograder."""
    return subprocess.run(
        [home / "source" / "run_autograder"],
        env=os.environ | {"AUTOGRADER": str(home)},
        capture_output=True,
        timeout=120,
    ).returncode


def workflow(folder: Path) -> dict[str, Any]:
    """The steps of the workflow that was written to a folder, by name or by what they use."""
    written = (folder / ".github" / "workflows" / "classroom.yml").read_text(encoding="utf-8")
    steps = yaml.safe_load(written)["jobs"]["check"]["steps"]
    return {step.get("name") or step["uses"].partition("@")[0]: step for step in steps}


def test_the_workflow_of_classroom_hands_its_results_to_the_reporter(tmp_path: Path):
    """The reporter reads the variable that is named for the step that it is told of."""
    done = crosscheck("check", "--scaffold", "classroom", "new", "--hints", "low", cwd=tmp_path)
    steps = workflow(tmp_path / "new")
    reporter = steps["classroom-resources/autograding-grading-reporter"]
    (runner,) = reporter["with"]["runners"].split(",")
    told = reporter["env"][f"{runner.upper()}_RESULTS"]

    assert done.returncode == 0
    assert told == f"${{{{ steps.{steps['Check']['id']}.outputs.result }}}}"
    assert "--hints low" in steps["Check"]["run"]
    assert (tmp_path / "new" / ".grading" / "tasks.toml").read_text() == DEFAULT.read_text()


@pytest.mark.slow
def test_the_step_of_classroom_answers_every_submission(tmp_path: Path):
    """Played as GitHub plays it, in the student's repository: a right file, a wrong one, none; a
    bad grader fails."""
    crosscheck("check", "--scaffold", "classroom", "repository", cwd=tmp_path)
    repository, output = tmp_path / "repository", tmp_path / "output"
    script = workflow(repository)["Check"]["run"]
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    (tmp_path / "venv" / "bin" / "crosscheck").symlink_to(CROSSCHECK)

    def play() -> int:
        output.write_text("")
        return subprocess.run(
            ["bash", "-e", "-o", "pipefail", "-c", script],
            cwd=repository,
            env=os.environ | {"RUNNER_TEMP": str(tmp_path), "GITHUB_OUTPUT": str(output)},
            capture_output=True,
            timeout=120,
        ).returncode

    scores = []
    wrong = WRONG.write(tmp_path).read_text()
    for text in (RIGHT.read_text(), wrong, None):
        file = repository / "Exercise.js"
        file.unlink() if text is None else file.write_text(text)
        status = play()
        name, _, result = output.read_text().partition("=")
        results = json.loads(base64.b64decode(result))
        jsonschema.validate(results, schema_of("classroom"))
        scores.append((status, name, sum(test["score"] for test in results["tests"])))
    (repository / ".grading" / "tasks.toml").write_text("1 = -1")

    assert scores == [(0, "result", 20.0), (0, "result", 17.0), (0, "result", 0.0)]
    assert play() != 0


def test_the_question_of_prairielearn_names_its_grader_and_its_file(tmp_path: Path):
    """As PrairieLearn's documentation of questions and of external grading has it; two questions
    of a course have two UUIDs."""
    done = [crosscheck("check", "--scaffold", "prairielearn", n, cwd=tmp_path) for n in "ab"]
    infos = [json.loads((tmp_path / n / "question" / "info.json").read_text()) for n in "ab"]
    question = tmp_path / "a" / "question"
    entrypoint = infos[0]["externalGradingOptions"]["entrypoint"]
    grader = question / Path(entrypoint).relative_to("/grade")

    assert [one.returncode for one in done] == [0, 0]
    for info in infos:
        jsonschema.validate(info, schema_of("prairielearn_question"))
    assert infos[0]["uuid"] != infos[1]["uuid"]
    assert os.access(grader, os.X_OK)
    assert (grader.parent / "tasks.toml").read_text() == DEFAULT.read_text()
    assert '<pl-file-upload file-names="Exercise.js">' in (question / "question.html").read_text()
    copied = re.search(
        r"^COPY (.+) \./$", (tmp_path / "a" / "image" / "Dockerfile").read_text(), re.M
    )
    assert copied is not None
    assert copied[1].split() == ["uv.toml", "crosscheck2d-*.whl"]


@pytest.mark.slow
def test_the_grader_of_prairielearn_answers_every_submission(tmp_path: Path):
    """Played as PrairieLearn plays it, in a folder that stands for /grade: a right file, a wrong
    one, one that does not load, none; a bad grader leaves no results."""
    crosscheck("check", "--scaffold", "prairielearn", "new", "--hints", "low", cwd=tmp_path)
    grade, programs = tmp_path / "grade", tmp_path / "programs"
    shutil.copytree(tmp_path / "new" / "question" / "tests", grade / "tests")
    programs.mkdir()
    (programs / "crosscheck").symlink_to(CROSSCHECK)

    def play(text: str | None) -> int:
        shutil.rmtree(grade / "student", ignore_errors=True)
        shutil.rmtree(grade / "results", ignore_errors=True)  # a container of its own for each
        (grade / "student").mkdir()
        if text is not None:
            (grade / "student" / "Exercise.js").write_text(text)
        return subprocess.run(
            [grade / "tests" / "grade.sh"],
            env=os.environ | {"GRADE": str(grade), "PATH": f"{programs}:{os.environ['PATH']}"},
            capture_output=True,
            timeout=120,
        ).returncode

    answers = []
    wrong = WRONG.write(tmp_path).read_text()
    for text in (RIGHT.read_text(), wrong, "function integrate( {", None):
        status = play(text)
        results = json.loads((grade / "results" / "results.json").read_text(encoding="utf-8"))
        jsonschema.validate(results, schema_of("prairielearn"))
        answers.append((status, results["gradable"], results.get("score"), "images" in results))
    (grade / "tests" / "tasks.toml").write_text("1 = -1")

    assert answers == [
        (0, True, 1.0, False),
        (0, True, 17 / 20, True),
        (0, False, None, False),
        (0, False, None, False),
    ]
    assert play(wrong) != 0
    assert not (grade / "results" / "results.json").exists()


def test_every_scaffold_fetches_gl_matrix_while_it_is_built(tmp_path: Path):
    """By npm, which the extra js brings, into the cache that the check reads later: where students
    are graded there is no network."""
    places = {
        "gradescope": ("setup.sh", "run_autograder", "$home/cache"),
        "classroom": (*2 * (".github/workflows/classroom.yml",), "$RUNNER_TEMP/cache"),
        "prairielearn": (*2 * ("image/Dockerfile",), "/crosscheck/cache"),
    }
    for kind, (builds, runs, cache) in places.items():
        crosscheck("check", "--scaffold", kind, kind, cwd=tmp_path)
        built = (tmp_path / kind / builds).read_text(encoding="utf-8")
        run_later = (tmp_path / kind / runs).read_text(encoding="utf-8")

        assert re.search(r'"\$\(echo \S*crosscheck2d-\*\.whl\)\[js\]"', built)
        assert '-c "from adapters.npm_packages import fetch; fetch()"' in built
        assert all(
            re.search(rf'CROSSCHECK_CACHE="?{re.escape(cache)}', one) for one in (built, run_later)
        )
