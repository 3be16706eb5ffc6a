"""Writes the page of a class: points, common causes, and the first fault of each student."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from crosscheck2d.reports.check.marks import Marked, number
from crosscheck2d.reports.check.page import GENERATOR
from crosscheck2d.reports.check.rows import TASKS
from crosscheck2d.reports.check.terminal import results, same_code, sentence_on
from crosscheck2d.reports.check.verdict import Tally, headline
from crosscheck2d.reports.page.documents import render
from crosscheck2d.reports.run.made import sealed
from crosscheck2d.reports.terminal.foreign_text import put_text

BINS = 10  # bars of the distribution, each a tenth of the points


NOTHING = "No file that can be checked."
UNJUDGED = "nothing judged"
PLACE = re.compile(r" \(line \d+, column \d+\)")


class Bar(NamedTuple):
    """A bar of a chart: label, number of students, length as percent of the longest."""

    label: str
    students: int
    length: float


def write_class_page(path: Path, marked: Sequence[Marked]) -> None:
    """Write the page of a class to `path`, overwriting what is there; raises `OSError`."""
    root, checks = marked[0].root, [one.check for one in marked]
    html = render(
        "check/class.html.j2",
        generator=GENERATOR,
        scripts=["check/class.js"],
        styles=["check/check.css", "check/class.css"],
        name=root.resolve().name,
        marked=marked,
        tasks={task: TASKS[task] for task in TASKS if any(task in one.worth for one in marked)},
        results=results(checks),
        waits=sum(bool(one.not_judged) for one in marked),
        twice=[name for name, rows in Counter(one.id for one in marked).items() if rows > 1],
        points=bars(distribution(marked)),
        causes=bars(causes(marked)),
        copies=same_code(root, checks),
        not_read=sentence_on(marked[0].not_read) if marked[0].not_read else "",
        counted=Tally._fields,
        number=number,
        version=version("crosscheck2d"),
    )
    put_text(path, sealed(html))


def distribution(marked: Sequence[Marked]) -> dict[str, int]:
    """The number of submissions in each tenth of the possible points, the last bar with full marks;
    before them, if there are any, those of which nothing could be judged."""
    most = marked[0].most
    judged = [one for one in marked if one.not_judged < most]
    tenths = Counter(min(int(one.points / most * BINS), BINS - 1) for one in judged)
    names = [f"{number(most * k / BINS)} to {number(most * (k + 1) / BINS)}" for k in range(BINS)]
    without = len(marked) - len(judged)
    return ({UNJUDGED: without} if without else {}) | {
        name: tenths[k] for k, name in enumerate(names)
    }


def causes(marked: Sequence[Marked]) -> dict[str, int]:
    """The number of students with each cause, the most common first, then in the order of the
    tasks."""
    found = Counter[str]()
    for one in marked:
        found.update(set(causes_of(one)))
    return dict(sorted(found.items(), key=lambda cause: (-cause[1], cause[0])))


def causes_of(one: Marked) -> list[str]:
    """The causes of one student, without numbers and places in the file."""
    if one.check.refused:
        return [NOTHING]
    if not one.check.loaded:
        return ["The file: it cannot be loaded, or fails as a whole."]
    return [PLACE.sub("", headline(row)) for row in one.check.causes]


def bars(counts: dict[str, int]) -> list[Bar]:
    """Bars of these counts, in their order."""
    longest = max(counts.values(), default=1) or 1
    return [Bar(label, count, round(100 * count / longest, 1)) for label, count in counts.items()]
