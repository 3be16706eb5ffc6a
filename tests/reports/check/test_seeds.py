"""The questions of another seed have other numbers, and find the same causes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.reports.check.questions import COLLISIONS, EXACT, QUESTIONS, questions, use_seed
from crosscheck2d.reports.check.rows import UNKNOWN
from crosscheck2d.reports.check.verdict import check_file, headline
from tests.solvers.mutants import MUTANTS

SEEDS = (1, 7, 99, 4711, 123456)


@pytest.fixture(autouse=True)
def afterwards() -> Iterator[None]:
    """The other tests of this process ask with the numbers that are written down."""
    yield
    use_seed(0)


def test_a_seed_changes_the_numbers_of_all_questions_but_those_on_thresholds():
    """A recording of the answers is worth nothing at another seed; 0 is what is written down."""
    written = questions()
    use_seed(7)
    same = {name for name, question in QUESTIONS.items() if question == written[name]}
    seventh = dict(QUESTIONS)
    use_seed(7)
    assert same == set(EXACT)
    assert seventh == QUESTIONS
    use_seed(0)
    assert written == QUESTIONS


@pytest.mark.parametrize("seed", SEEDS)
def test_a_seed_keeps_what_a_question_is_about(seed: int):
    """Distances, and whether a pair approaches; a swapped pair is the same pair."""
    written = questions()
    use_seed(seed)
    for name, question in QUESTIONS.items():
        if len(question.balls) == 2:
            (a, b), (c, d) = question.balls, written[name].balls
            apart = np.hypot(*np.subtract(a.x, b.x)), np.hypot(*np.subtract(c.x, d.x))
            assert apart[0] == pytest.approx(apart[1], rel=1e-12), name
            closing = [
                float(np.subtract(p.v, q.v) @ np.subtract(p.x, q.x)) for p, q in ((a, b), (c, d))
            ]
            assert np.sign(round(closing[0], 9)) == np.sign(round(closing[1], 9)), name
    for name in COLLISIONS:
        swapped = name.replace("collision/", "swapped/")
        assert QUESTIONS[swapped].balls == QUESTIONS[name].balls


@pytest.mark.long
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("mutant", MUTANTS[::10], ids=lambda mutant: str(mutant.name))
def test_another_seed_finds_the_same_causes(mutant, seed: int, tmp_path: Path):
    """The verdict of every row, and the causes that are known."""
    path = tmp_path / mutant.name
    path.write_text(mutant.text)
    fixed, other = ([said(row) for row in check_file(path, k).rows] for k in (0, seed))
    assert other == fixed


def said(row) -> tuple[str, str, str]:
    """A row without its numbers."""
    cause = headline(row) if row.verdict == "fault" and row.cause != UNKNOWN else ""
    return row.name, row.verdict, re.sub(r"[\d.]+", "#", cause)
