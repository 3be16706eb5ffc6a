"""Checks with the points that they have by default, as the formats take them."""

from __future__ import annotations

from crosscheck2d.reports.check.marks import Marked, id_of
from crosscheck2d.reports.check.points import read_points
from crosscheck2d.reports.check.verdict import FileCheck


def marks_of(*checks: FileCheck) -> list[Marked]:
    """Each as if its file had been named alone."""
    points = read_points()
    return [Marked(id_of(one.path, one.path), one, one.path, points) for one in checks]
