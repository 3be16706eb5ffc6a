"""Writes check.html: the findings in one file, and the smallest scenes that show them, with the
file's motion beside the right one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.check.evidence import lines_and_formula
from crosscheck2d.reports.check.marks import Marked
from crosscheck2d.reports.check.rows import TASKS, CheckRow, Verdict, shown
from crosscheck2d.reports.check.scene_words import faults_of, scene_lines, together
from crosscheck2d.reports.check.smallest_scene import DT, Smallest
from crosscheck2d.reports.check.terminal import points_of
from crosscheck2d.reports.check.verdict import FileCheck, Tally
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.kit import (
    Page,
    Playback,
    Section,
    Table,
    TableCell,
    Text,
    render_page,
    sourced,
)
from crosscheck2d.reports.page.replay import pack_layers, ratio_of
from crosscheck2d.reports.run.made import sealed
from crosscheck2d.reports.terminal.counts import listed
from crosscheck2d.reports.terminal.foreign_text import put_text
from crosscheck2d.scenarios.model import Trajectory

GENERATOR = "crosscheck check"
# distinct from the truth on light and dark pages, by style.py
YOURS = style.Look("#a3123a", "#ff7a93", (), "diamond", True)
# Faults come first; each group has an explanation.
GROUPS: dict[Verdict, tuple[str, str]] = {
    "fault": (
        "Faults",
        "A cause is named where its formula gives the same numbers to six digits. The lines are"
        " those of your file that read or write what is wrong.",
    ),
    "follows": (
        "Follows from the faults",
        "These answers are wrong because of the faults above. Correct those first.",
    ),
    "free choice": (
        "Free choices",
        "The exercise leaves these open. Whatever you chose is right; this only says what it is.",
    ),
    "right": ("Right", "Asked, and as expected."),
    "not asked": ("Not asked", "These could not be asked; each row says why."),
}
SPEEDS = (0.1, 0.25, 0.5, 1)  # of a replay, simulated seconds in a second
WATCHED = 4.0  # s, long enough to see a collision


def write_page(path: Path, marked: Marked) -> None:
    """Write the page of one file, with the smallest scenes that show its faults, to `path`,
    overwriting what is there."""
    check, name = marked.check, marked.check.path.name
    sections = [findings_section(marked)]
    sections += [scene_section(name, k, one) for k, one in enumerate(marked.scenes, 1)]
    if not check.passed and (hidden := unseen(check, marked.scenes)):
        sections.append(Section("", no_scene(check, hidden)))
    for verdict, (title, about) in GROUPS.items():
        if rows := [row for row in check.rows if row.verdict == verdict]:
            folded = verdict in ("right", "not asked")
            table = rows_table(check, rows)
            sections.append(Section(title, about, [table], folded, css=verdict))
    if check.faults:
        sources = dict.fromkeys(row.read for row in check.faults)
        sections.append(Section("", f"To read: {'; '.join(sources)}."))
    # in order: a set would have another one in each process
    layers = dict.fromkeys(layer for one in marked.scenes for layer in layer_names(name, one))
    digest = "" if check.solver is None else f"; sha256 of the file {check.solver.digest}"
    page = Page(
        f"{name}: {'no fault found' if check.passed else 'what is wrong, and where'}",
        sections,
        GENERATOR,
        looks={layer: style.look(layer) if layer == style.TRUTH else YOURS for layer in layers},
        footer=f"Made by {marked.command}{digest}.",
    )
    put_text(path, sealed(render_page(page)))


def findings_section(marked: Marked) -> Section:
    """What is wrong, with the lines and the formula; then the verdict on each task."""
    check = marked.check
    lines = [lines_and_formula(row) for row in check.findings]
    lines += [[]] * (len(check.sentences) - len(lines))
    items = [sourced(sentence, of) for sentence, of in zip(check.sentences, lines)]
    points = {mark.task: points_of(mark) for mark in marked.tasks}
    rows = {
        TASKS[task]: [
            TableCell(word := check.word(task), css=f"status {word.replace(' ', '-')}"),
            points.get(task, ""),
            *(count or "" for count in check.tally(task)),
        ]
        for task in check.tasks
    }
    heads = ["verdict", "points", *Tally._fields]
    frame = pd.DataFrame.from_dict(rows, orient="index", columns=heads, dtype=object)
    return Section(
        "",
        "",
        [
            Text([] if len(items) > 1 else items, items if len(items) > 1 else [], ordered=True),
            *([Text([check.shared])] if check.shared else []),
            Table(frame, css="plain tasks", corner="task"),
            Text([marked.total]),
        ],
        id="findings",
    )


def scene_section(name: str, number: int, smallest: Smallest) -> Section:
    """A smallest scene: what it shows, as a replay and in words."""
    scenario, layers = smallest.scenario, layers_of(name, smallest)
    labels = {layer: "yours" for layer in layer_names(name, smallest)}
    labels[style.TRUTH] = smallest.right_is
    fault = f"{smallest.fault[0].upper()}{smallest.fault[1:]}."
    facts = [f"Sphere {k}: {line}" for k, line in enumerate(scene_lines(scenario))]
    facts.append(
        f"Steps of {shown(DT)} s; e = {style.number(scenario.scene.restitution)}. A program"
        " searched for it and reduced it to as few spheres and as small numbers as still"
        " show the fault."
    )
    replay = Playback(
        pack_layers(scenario, layers, more={"labels": labels}),
        ratio_of(scenario, layers),
        f"Replay of scene {number}",
        "Rings spread where a collision is. A spoke is the angle. An arrow at the edge: a sphere"
        " has left the picture, and is so far beyond the edge.",
        SPEEDS,
        speed_of(scenario.duration),
    )
    together_words = f" {together(smallest)}" if len(smallest.of) > 1 else ""
    title = f"The smallest scene that shows {faults_of(smallest)}"
    return Section(title, fault + together_words, [replay, Text(items=facts)], css="scene")


def no_scene(check: FileCheck, hidden: Sequence[int]) -> str:
    """Why no scene shows these faults."""
    plural = "s" if len(hidden) > 1 else ""
    if check.restitution is None:
        return f"No scene was played with this file. The rows below show the fault{plural}."
    numbers = listed([str(number) for number in hidden])
    return (
        f"No scene of up to three spheres was found that shows fault{plural} {numbers}: the rows"
        " below do."
    )


def rows_table(check: FileCheck, rows: Sequence[CheckRow]) -> Table:
    """The questions with one verdict."""
    cells = []
    for row in rows:
        number = check.number_of(row)
        cause = f"→ fault {number}" if number else f"→ {row.cause}" if row.cause else ""
        lines = lines_and_formula(row) if row.verdict == "fault" and not number else []
        asked = sourced(row.asked, lines)
        notes = (TableCell(cause),) if cause else ()
        cells.append([row.task, TableCell(asked, notes=notes), row.got, row.expected])
    heads = ["task", "question", "got", "expected"]
    frame = pd.DataFrame(cells, [row.name for row in rows], heads, dtype=object)
    return Table(frame, css="text stack rows", corner="row")


def unseen(check: FileCheck, scenes: Sequence[Smallest]) -> list[int]:
    """The numbers of the faults that no scene shows."""
    seen = {k for one in scenes for k in one.of}
    return [k for k in range(1, len(check.findings) + 1) if k not in seen]


def speed_of(duration: float) -> float:
    """The speed at which a replay begins: the highest at which it takes `WATCHED`; 1: real time."""
    return max((speed for speed in SPEEDS if duration / speed >= WATCHED), default=min(SPEEDS))


def layers_of(name: str, smallest: Smallest) -> list[tuple[Run | None, Trajectory]]:
    """The layers of the replay: the file's motion, and the right one on top."""
    yours = Run(
        name.replace(":", "_"), "own", smallest.scenario.name, DT, trajectory=smallest.yours
    )
    right: list[tuple[Run | None, Trajectory]] = (
        [] if smallest.right is None else [(None, smallest.right)]
    )
    return [(yours, smallest.yours), *right]


def layer_names(name: str, smallest: Smallest) -> list[str]:
    """The names of these layers."""
    return [style.TRUTH if run is None else run.name for run, _ in layers_of(name, smallest)]
