"""README's sentences on speed and accuracy are those that follow from the kept tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from reports.speed import figures
from tests import speed_figures

TEXT = " ".join((Path(__file__).parent.parent / "README.md").read_text().split())
FROM = {
    speed_figures.costs: figures.KEPT, speed_figures.as_far: figures.KEPT, speed_figures.millionth: figures.KEPT,
    speed_figures.nearer: figures.ORDERS, speed_figures.spelt: figures.EXPLAINED,
}  # fmt: skip


@pytest.mark.parametrize("sentence", list(FROM), ids=lambda sentence: sentence.__name__)
def test_a_sentence_follows_from_the_kept_table(sentence: Callable):
    """Word for word but for line breaks: `python -m tests.speed_figures` prints them all."""
    assert sentence(figures.read(FROM[sentence])) in TEXT


def test_nothing_else_is_said_of_who_costs_least():
    """No second sentence, which no table would hold."""
    assert TEXT.count("costs least") == 1
    assert "costs least in" in TEXT


def test_the_picture_is_told_to_be_what_it_is():
    """The statistic of its points."""
    assert "the geometric mean of the middle half of the scenes" in TEXT
