"""What README.md and reports/speed/README.md say in numbers follows from the kept tables."""

from __future__ import annotations

from pathlib import Path

from reports.speed import figures
from tests.reports.speed import statements as speed_figures

ROOT = Path(__file__).parents[3]
FRONT = (ROOT / "README.md").read_text("utf-8")
SPEED = (ROOT / "reports" / "speed" / "README.md").read_text("utf-8")


def test_the_caption_of_the_picture_follows_from_the_kept_table():
    """Word for word but for line breaks: `python -m tests.reports.speed.statements` prints it."""
    assert speed_figures.caption(figures.read(figures.KEPT)) in " ".join(FRONT.split())
    assert "the geometric mean of the middle half of the scenes" in " ".join(FRONT.split())


def test_the_page_on_speed_ends_with_what_follows_from_the_kept_tables():
    """Line for line, and nothing else stands there."""
    assert SPEED.endswith(f"less there.\n\n{speed_figures.measured()}")


def test_nothing_else_is_said_of_who_costs_least():
    """No second sentence, which no table would hold."""
    assert (FRONT + SPEED).count("costs least") == 1
