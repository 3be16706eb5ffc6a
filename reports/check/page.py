"""Writes check.html: what was found in one file, and the smallest scene that shows it, yours beside the exact one."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from adapters.play import Run
from adapters.student import file_hash
from reports import style
from reports.check.rows import TASKS, shown
from reports.check.smallest import DT, Smallest
from reports.check.verdict import FileCheck
from reports.offline import HERE as REPORTS
from reports.offline import content_policy, css, looks_as_json
from reports.replay import pack_layers, ratio_of
from scenarios.model import Scenario, Trajectory

HERE = Path(__file__).parent
GENERATOR = "crosscheck check"
YOURS = style.Look("#a3123a", "#ff7a93", (), "diamond", True)  # apart from the truth in any light, by style.py
SCRIPTS = (REPORTS / "player.js", REPORTS / "player_canvas.js", HERE / "check.js")


def write_page(path: Path, check: FileCheck, smallest: Smallest | None) -> None:
    """Write the page of one file to `path`; raises `FileExistsError` if something else is there."""
    if path.exists() and GENERATOR.encode() not in path.read_bytes()[:4096]:
        raise FileExistsError(f"{path} is there and no page of a check")
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    )
    environment.filters["number"] = style.number
    layers = layers_of(check.path.name, smallest)
    names = [style.TRUTH if run is None else run.name for run, _ in layers]
    looks = {name: style.look(name) if name == style.TRUTH else YOURS for name in names}
    scripts = [script.read_text(encoding="utf-8") for script in SCRIPTS]
    html = environment.get_template("check.html.j2").render(
        name=check.path.name, check=check, tasks=TASKS, smallest=smallest, layers=names, looks=looks,
        scene=[] if smallest is None else scene_lines(smallest.scenario), dt=shown(DT),
        replay="" if smallest is None else pack_layers(smallest.scenario, layers),
        ratio=1 if smallest is None else ratio_of(smallest.scenario, layers),
        css=Markup(css()), looks_json=Markup(looks_as_json(looks)), scripts=[Markup(script) for script in scripts],
        policy=content_policy(scripts), generator=GENERATOR, version=version("crosscheck2d"),
        digest=file_hash(check.path),
    )  # fmt: skip
    path.write_text(html, encoding="utf-8")


def layers_of(name: str, smallest: Smallest | None) -> list[tuple[Run | None, Trajectory]]:
    """The file's motion, and the exact one on top, as the replay takes them."""
    if smallest is None:
        return []
    yours = Run(name.replace(":", "_"), "own", smallest.scenario.name, DT, trajectory=smallest.yours)
    exact: list[tuple[Run | None, Trajectory]] = [] if smallest.truth is None else [(None, smallest.truth)]
    return [(yours, smallest.yours), *exact]


def scene_lines(scenario: Scenario) -> list[str]:
    """A scene in words, a line a sphere."""
    scene, lines = scenario.scene, []
    for k in range(scene.n):
        lines.append(
            f"at {shown(scene.position[k])} m, {shown(scene.velocity[k])} m/s, size {shown(scene.radius[k])} m, "
            f"mass {shown(scene.mass[k])} kg"
        )
        for push in (push for push in scenario.thrusts if push.disk == k):
            lines[-1] += f", force {shown(push.force)} N, torque {shown(push.torque)} N m"
            lines[-1] += f", MoI {shown(scene.inertia[k])} kg m²"
    return lines
