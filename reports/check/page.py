"""Writes check.html: the findings in one file, and the smallest scenes that show them, with the
file's motion beside the right one."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.check.marks import Marked
from crosscheck2d.reports.check.rows import TASKS, Verdict, shown
from crosscheck2d.reports.check.scene_words import faults_of, scene_lines, together
from crosscheck2d.reports.check.smallest_scene import DT, Smallest
from crosscheck2d.reports.check.terminal import points_of
from crosscheck2d.reports.check.verdict import FileCheck, Tally
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.documents import ENGINE, render
from crosscheck2d.reports.page.replay import pack_layers, ratio_of
from crosscheck2d.reports.run.made import sealed
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
SCRIPTS = (*ENGINE, "check/check.js")
SPEEDS = (0.1, 0.25, 0.5, 1)  # of a replay, simulated seconds in a second
WATCHED = 4.0  # s, long enough to see a collision


class SceneShown(NamedTuple):
    """A smallest scene on the page: in words, and as a replay with its layers and first speed."""

    smallest: Smallest
    title: str
    lines: list[str]
    layers: list[str]
    replay: str
    ratio: float
    speed: float


def write_page(path: Path, marked: Marked) -> None:
    """Write the page of one file, with the smallest scenes that show its faults, to `path`,
    overwriting what is there."""
    check, scenes = marked.check, marked.scenes
    shows = [scene_shown(check.path.name, smallest) for smallest in scenes]
    names = dict.fromkeys(name for one in shows for name in one.layers)
    looks = {name: style.look(name) if name == style.TRUTH else YOURS for name in names}
    html = render(
        "check/check.html.j2",
        generator=GENERATOR,
        scripts=SCRIPTS if shows else (),
        styles=["check/check.css"],
        looks=looks,
        name=check.path.name,
        check=check,
        points={mark.task: points_of(mark) for mark in marked.tasks},
        total=marked.total,
        tasks=TASKS,
        groups=GROUPS,
        counted=Tally._fields,
        shows=shows,
        together=together,
        unseen=unseen(check, scenes),
        speeds=SPEEDS,
        dt=shown(DT),
        version=version("crosscheck2d"),
        digest="" if check.solver is None else check.solver.digest,
    )
    put_text(path, sealed(html))


def unseen(check: FileCheck, scenes: Sequence[Smallest]) -> list[int]:
    """The numbers of the faults that no scene shows."""
    seen = {k for one in scenes for k in one.of}
    return [k for k in range(1, len(check.findings) + 1) if k not in seen]


def scene_shown(name: str, smallest: Smallest) -> SceneShown:
    """A scene for the page of the file of this name."""
    scenario, layers = smallest.scenario, layers_of(name, smallest)
    return SceneShown(
        smallest,
        f"The smallest scene that shows {faults_of(smallest)}",
        scene_lines(scenario),
        [style.TRUTH if run is None else run.name for run, _ in layers],
        pack_layers(scenario, layers),
        ratio_of(scenario, layers),
        speed_of(scenario.duration),
    )


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
