"""Writes check.html: what was found in one file, and the smallest scene that shows it, yours beside
the exact one."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

from adapters.run import Run
from reports.check.rows import TASKS, Verdict, shown
from reports.check.smallest import DT, Smallest
from reports.check.verdict import FileCheck
from reports.page import style
from reports.page.documents import ENGINE, render
from reports.page.replay import pack_layers, ratio_of
from reports.run.made import sealed
from reports.terminal.foreign_text import put_text
from scenarios.model import Scenario, Trajectory

GENERATOR = "crosscheck check"
# apart from the truth in any light, by style.py
YOURS = style.Look("#a3123a", "#ff7a93", (), "diamond", True)
# Faults stand first; what a group is, is said in words.
GROUPS: dict[Verdict, tuple[str, str]] = {
    "fault": (
        "Faults",
        "A cause is named where its formula gives the same numbers to six digits. The lines are"
        " those of your file that read or write what is wrong.",
    ),
    "free choice": (
        "Free choices",
        "The exercise leaves these open. Whatever you chose is right; this only says what it is.",
    ),
    "right": ("Right", "Asked, and as expected."),
    "not asked": ("Not asked", "These could not be asked; each row says why."),
}
SCRIPTS = (*ENGINE, "check/check.js")


def write_page(path: Path, check: FileCheck, smallest: Smallest | None) -> None:
    """Write the page of one file to `path`, over whatever is there."""
    layers = layers_of(check.path.name, smallest)
    names = [style.TRUTH if run is None else run.name for run, _ in layers]
    looks = {name: style.look(name) if name == style.TRUTH else YOURS for name in names}
    html = render(
        "check/check.html.j2",
        generator=GENERATOR,
        scripts=SCRIPTS if smallest else (),
        styles=["check/check.css"],
        looks=looks,
        name=check.path.name,
        check=check,
        tasks=TASKS,
        groups=GROUPS,
        smallest=smallest,
        layers=names,
        scene=[] if smallest is None else scene_lines(smallest.scenario),
        dt=shown(DT),
        replay="" if smallest is None else pack_layers(smallest.scenario, layers),
        ratio=1 if smallest is None else ratio_of(smallest.scenario, layers),
        version=version("crosscheck2d"),
        digest="" if check.solver is None else check.solver.digest,
    )
    put_text(path, sealed(html))


def layers_of(name: str, smallest: Smallest | None) -> list[tuple[Run | None, Trajectory]]:
    """The file's motion, and the exact one on top, as the replay takes them."""
    if smallest is None:
        return []
    yours = Run(
        name.replace(":", "_"), "own", smallest.scenario.name, DT, trajectory=smallest.yours
    )
    exact: list[tuple[Run | None, Trajectory]] = (
        [] if smallest.truth is None else [(None, smallest.truth)]
    )
    return [(yours, smallest.yours), *exact]


def scene_lines(scenario: Scenario) -> list[str]:
    """A scene in words, a line a sphere."""
    scene, lines = scenario.scene, []
    for k in range(scene.n):
        lines.append(
            f"at {shown(scene.position[k])} m, {shown(scene.velocity[k])} m/s, size"
            f" {shown(scene.radius[k])} m, mass {shown(scene.mass[k])} kg"
        )
        for thrust in (thrust for thrust in scenario.thrusts if thrust.disk == k):
            lines[-1] += f", force {shown(thrust.force)} N, torque {shown(thrust.torque)} N m"
            lines[-1] += f", MoI {shown(scene.inertia[k])} kg m²"
    return lines
