"""Writes the page of a class: points, common causes, and the first fault of each student."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from markupsafe import Markup

from crosscheck2d.reports.check.marks import Marked, number
from crosscheck2d.reports.check.page import GENERATOR
from crosscheck2d.reports.check.rows import TASKS
from crosscheck2d.reports.check.terminal import results, same_code, sentence_on
from crosscheck2d.reports.check.verdict import Tally, headline
from crosscheck2d.reports.page.kit import Page, Part, Section, Table, TableCell, Text, render_page
from crosscheck2d.reports.run.made import sealed
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.foreign_text import put_text

BINS = 10  # bars of the distribution, each a tenth of the points


NOTHING = "No file that can be checked."
UNJUDGED = "nothing judged"
PLACE = re.compile(r" \(line \d+, column \d+\)")


def write_class_page(path: Path, marked: Sequence[Marked]) -> None:
    """Write the page of a class to `path`, overwriting what is there; raises `OSError`."""
    root, checks = marked[0].root, [one.check for one in marked]
    twice = [name for name, rows in Counter(one.id for one in marked).items() if rows > 1]
    waits = sum(bool(one.not_judged) for one in marked)
    lead: list[str | Markup] = [f"{results(checks)}."]
    if marked[0].not_read:
        lead.append(sentence_on(marked[0].not_read))
    if waits:
        lead.append(
            "A person decides on the points under not judged, in"
            f" {counted(waits, 'submission')}. They are of questions that could not be asked, and"
            " are in no total."
        )
    if twice:
        lead.append(
            f"Several rows have the same id: {', '.join(twice)}. The file stands beside it."
        )
    most, common = number(marked[0].most), causes(marked)
    sections = [
        Section(
            "Points",
            f"Submissions by total, of {most}. A total on the border of two bars counts in the"
            " upper bar.",
            [bars(distribution(marked))],
            css="pair",
        ),
        Section(
            "Causes",
            "Students by cause. A student may have several." if common else "No fault was found.",
            [bars(common)] if common else [],
            css="pair",
        ),
    ]
    if copies := same_code(root, checks):
        sections.append(
            Section(
                "Files with the same code",
                "These files differ only in spaces and lines of comments. The page cannot tell why:"
                " students may work as a group, or hand in a file as they got it. Files that only"
                " share a cause are not listed here.",
                [Text(items=[", ".join(names) for names in copies])],
                id="copies",
            )
        )
    sections.append(
        Section(
            "Students",
            "Asked counts the questions that could be asked, and wrong the questions with a wrong"
            " answer. Open a row to read what the check says of every task, and where the file is."
            " crosscheck check FILE writes a page with the smallest scene that shows each fault.",
            [students(marked, twice)],
            id="students",
        )
    )
    title = f"{root.resolve().name}: {counted(len(marked), 'submission')}"
    put_text(path, sealed(render_page(Page(title, sections, GENERATOR, lead))))


def students(marked: Sequence[Marked], twice: Sequence[str]) -> Table:
    """A row for each submission, which opens on what the check says."""
    tasks = [task for task in TASKS if any(task in one.worth for one in marked)]
    rows: dict[str, dict[str, object]] = {}
    opens: dict[str, list[Part]] = {}
    for one in marked:
        of_task = {mark.task: mark for mark in one.tasks}
        label = f"{one.id} ({one.name})" if one.id in twice else one.id
        label += f", row {len(rows) + 1}" if label in rows else ""
        cells = {
            task: TableCell(number(mark.points), css=f"status {mark.status.replace(' ', '-')}")
            for task, mark in of_task.items()
            if task in tasks
        }
        counts = {name: count or "" for name, count in zip(Tally._fields, one.check.tally())}
        waits = number(one.not_judged) if one.not_judged else ""
        begin = TableCell(
            "no fault found" if one.check.passed else one.brief, title="\n".join(causes_of(one))
        )
        rows[label] = {
            **{task: cells.get(task, "") for task in tasks},
            "total": number(one.points),
            **counts,
            "not judged": waits,
            "begin with": begin,
        }
        opens[label] = feedback(one)
    frame = pd.DataFrame.from_dict(rows, orient="index", dtype=object)
    return Table(frame, opens=opens, sortable=True, css="students stack", corner="student")


def feedback(one: Marked) -> list[Part]:
    """What the check says of each task of a submission."""
    found: list[Part] = []
    for mark in one.tasks:
        if one.check.loaded or mark.task == "file":
            worth = f"{number(mark.points)} of {number(mark.most)}" if mark.most else "no points"
            counts = zip(one.check.tally(mark.task), Tally._fields)
            tally = ", ".join(f"{count} {name}" for count, name in counts)
            heading = Markup("<b>{}: {}</b> <small>{}</small>").format(mark.title, worth, tally)
            found.append(Text([heading], one.feedback(mark.task)))
    beside = f"; not judged: {', '.join(one.beside)}" if one.beside else ""
    return [*found, Text([f"{one.check.path}{beside}"], css="soft")]


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


def bars(counts: dict[str, int]) -> Table:
    """A row with a bar for each count, in their order."""
    longest = max(counts.values(), default=1) or 1
    bar = '<span class="bar" style="width:{:.1f}%"></span>'
    drawn = [Markup(bar.format(100 * count / longest)) for count in counts.values()]
    cells = {0: list(counts.values()), 1: drawn}
    frame = pd.DataFrame(cells, index=list(counts), dtype=object)
    return Table(frame.set_axis(["", ""], axis="columns"), css="bars")
