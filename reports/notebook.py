"""The functions of `import crosscheck2d`: what the commands do, for a notebook or a script. They
return frames and the types of a scene, which show themselves in a notebook."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES, row_of
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.check.verdict import check_file
from crosscheck2d.reports.compare.against import TRUTH
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.page import drawing, kit, style
from crosscheck2d.reports.page.replay import pack_layers, played, ratio_of
from crosscheck2d.reports.run.arguments import checked_engines, checked_scenes, of_main_job
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import play_cell
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.scenes import open_scene, with_steps
from crosscheck2d.reports.speed.advice import Inquiry, NoAdvice, Requirement
from crosscheck2d.reports.speed.ladder import PURPOSES
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.files.scene_file import scenario_of, scene_text
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import NoTruth, answered

SCORE = "position_max_radii"
HEIGHT = "this.style.height=this.contentDocument.documentElement.scrollHeight+'px'"
SceneLike = str | Path | Scenario  # its name, its file, or itself


class ShownRuns(pd.DataFrame):
    """The rows of runs; shows them as a page. What is made from it is a plain frame."""

    _metadata = ["comparisons"]  # noqa: RUF012 - as pandas wants it
    comparisons: Sequence[Comparison]

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def _repr_html_(self) -> str:
        return framed("Runs", [section_of(comparison) for comparison in self.comparisons])


class ShownScene(Scenario):
    def _repr_html_(self) -> str:
        return framed(self.name, [kit.Section("", self.asks, [start_of(self)])])


class ShownAnswer(Trajectory):
    """The exact answer to `scenario` at its samples, up to `horizon`; it plays itself."""

    scenario: Scenario

    def _repr_html_(self) -> str:
        until = f"Exact up to {style.number(min(self.horizon, self.scenario.duration))} s."
        replay = replay_of(self.scenario, [(None, self)])
        return framed(self.scenario.name, [kit.Section("", f"{until} {self.reason}", [replay])])


def scene(source: SceneLike | None = None, seed: int = 0, **table: Any) -> ShownScene:
    """A scene: by name (`crosscheck list scenarios`), from a TOML file, or from the keys of such a
    file, e.g. `disk=[dict(position=[0, 0], ...)]`.

    Raises:
        ValueError: with a line for each fault.
    """
    if source is not None and table:
        raise ValueError(f"{source} is a whole scene: it cannot be given {', '.join(table)}")
    if source is None:
        found = scenario_of(table, "scene")
    elif isinstance(source, Scenario):
        found = source
    else:
        with raising():
            checked_scenes([str(source)], [], False, seed)
        found = open_scene(str(source), seed)
    return ShownScene(**vars(found))


def truth(of: SceneLike, seed: int = 0) -> ShownAnswer:
    """The exact answer to a scene; raises `NoTruth`, a `ValueError`, with the reason."""
    scenario, trajectory = answered(scene(of, seed))
    if trajectory is None:
        raise NoTruth(scenario.without_truth or "the scene comes without an exact answer")
    answer = ShownAnswer(**vars(trajectory))
    object.__setattr__(answer, "scenario", scenario)
    return answer


def run(
    scenes: SceneLike | Sequence[SceneLike],
    engines: str | Sequence[str] = (),
    dts: float | Sequence[float] = (),
    seed: int = 0,
    timeout: float = 60.0,
) -> ShownRuns:
    """Run scenes through engines and compare: one number a row, as in deviations.csv. A notebook
    shows the score of each engine, its chart if there are several step sizes, and a replay; a
    script can write this page, `_repr_html_()`, to a file.

    Args:
        engines: NAME, NAME:PROFILE or a FILE of your own; default: those of `crosscheck`.
        dts: step sizes in s; default: those of each scene.
        timeout: s that a run may take. A failed run is a row with its reason.
    """
    several = [scenes] if isinstance(scenes, SceneLike) else scenes
    steps = list(np.atleast_1d(dts))
    if not several:
        raise ValueError("scenes=[]: name at least one")
    for dt in steps:
        if not isinstance(dt, (int, float, np.number)) or not dt > 0:
            raise ValueError(f"dts={dts!r}: each must be a number of s, more than 0")
    scenarios = [with_steps(scene(each, seed), steps, False) for each in several]
    with raising():
        names = checked_engines([engines] if isinstance(engines, str) else engines or of_main_job())
    rows = {name: row_of(name) for name in names}
    tasks: dict[Any, Callable[[], Run]] = {
        (number, name, k): partial(
            play_cell, Cell(scenario.name, seed, name, k), rows[name], replace(scenario, truth=None)
        )
        for number, scenario in enumerate(scenarios)
        for name in names
        for k in scenario.substeps
    }
    alone = {task for task in tasks if rows[task[1]].leaves_state}
    ended = dict(run_all(tasks, os.cpu_count() or 1, timeout, alone=alone))
    comparisons = []
    for number, scenario in enumerate(scenarios):
        runs = [
            as_run(ended[task], task[1], task[2], scenario) for task in tasks if task[0] == number
        ]
        comparisons.append(compare(scenario, runs))
    table = ShownRuns(pd.concat([each.table for each in comparisons], ignore_index=True))
    table.comparisons = comparisons
    return table


def check(path: str | Path) -> pd.DataFrame:
    """Check a solver of the exercise, Exercise.js or solver.py: a row for each question. A class
    needs `crosscheck check FOLDER`."""
    if Path(path).is_dir():
        raise ValueError(f"{path}: is a folder; for a class: crosscheck check {path}")
    found = check_file(Path(path))
    if found.refused:
        raise ValueError(found.refused)
    columns = ("task", "name", "verdict", "cause", "asked", "got", "expected")
    return pd.DataFrame([{name: getattr(row, name) for name in columns} for row in found.rows])


def advise(
    of: SceneLike,
    error: float = 0.01,
    purpose: str = "trajectory",
    engines: str | Sequence[str] = (),
    seed: int = 0,
) -> pd.DataFrame:
    """The engines and coarsest step sizes that keep an error in a scene, cheapest first; then those
    not advised, with the reason. Raises `ValueError` for a scene without an exact answer."""
    if purpose not in PURPOSES:
        raise ValueError(f"purpose={purpose!r}: must be one of {', '.join(PURPOSES)}")
    if not isinstance(error, (int, float)) or not error > 0:
        raise ValueError(f"error={error!r}: must be a number more than 0, such as 0.01 for 1 %")
    scenario = scene(of, seed)
    with raising():
        names = checked_engines([engines] if isinstance(engines, str) else engines, ENGINES)
    with TemporaryDirectory() as folder, Progress() as progress:
        file = Path(folder) / f"{scenario.name}.toml"
        file.write_text(scene_text(scenario), encoding="utf-8")
        try:
            requirement = Requirement(str(file), 0, purpose, error)
            answer = Inquiry(requirement, os.cpu_count() or 1, progress).advise(names)
        except NoAdvice as refusal:
            raise ValueError(str(refusal)) from None
    keeping = sorted(answer["cheapest_first"], key=lambda row: row["us_per_simulated_s"])
    rows = [*keeping, *answer["not_to_the_end"], *answer["not_within"]]
    columns = ["engine", "dt_s", "error", "us_per_simulated_s", "not_advised"]
    return pd.DataFrame([row | {"not_advised": row.get("why", "")} for row in rows])[columns]


@contextmanager
def raising() -> Iterator[None]:
    """Context in which what ends a command with a message on standard error is a `ValueError`."""
    with redirect_stderr(io.StringIO()) as told:
        try:
            yield
        except SystemExit:
            raise ValueError(told.getvalue().strip()) from None


def as_run(ended: Run | Failure, name: str, substeps: int, scenario: Scenario) -> Run:
    if isinstance(ended, Run):
        return ended
    lost = Run.unplayed(name, scenario, scenario.dt(substeps))
    return replace(lost, status=ended.status, reason=ended.reason)


def framed(title: str, sections: Sequence[kit.Section]) -> str:
    page = kit.Page(title, sections, "crosscheck2d", names=[*ENGINES, style.TRUTH], footer=" ")
    return (
        f'<iframe srcdoc="{escape(kit.render_page(page))}" onload="{HEIGHT}"'
        ' style="width:100%;height:24em;border:0"></iframe>'
    )


def replay_of(scenario: Scenario, layers: list[tuple[Run | None, Trajectory]]) -> kit.Playback:
    return kit.Playback(pack_layers(scenario, layers), ratio_of(scenario, layers))


def start_of(scenario: Scenario) -> kit.Chart:
    """A drawing of disks, walls and velocities at t = 0."""
    from matplotlib.patches import Circle

    start = scenario.scene
    ends = [start.position - start.radius[:, None], start.position + start.radius[:, None]]
    width, height = np.ptp(np.concatenate([*ends, start.walls.reshape(-1, 2)]), axis=0)
    figure, axes = drawing.new_figure(5.8, 0.4 + 5.4 * float(np.clip(height / width, 0.1, 1.0)))
    for place, radius in zip(start.position, start.radius):
        axes.add_patch(Circle(place, radius, facecolor="none", edgecolor=drawing.INK))
    for wall in start.walls:
        axes.plot(*wall.T, color=drawing.INK)
    axes.quiver(*start.position.T, *start.velocity.T, color=drawing.INK, width=0.004)
    axes.set_aspect("equal")
    axes.autoscale_view()
    return kit.Chart(drawing.svg_of(figure, f"{scenario.name} at the start"))


def section_of(comparison: Comparison) -> kit.Section:
    """The score of each engine at each step size, what failed, and the replay of a scene."""
    scenario, table = comparison.scenario, comparison.table
    scored = table[(table.metric == SCORE) & (table.versus == TRUTH)]
    failed = table[(table.metric == "status") | (table.value > table.bound)]
    columns = {dt: f"{style.number(dt * 1e3)} ms" for dt in dict.fromkeys(table.dt_s)}
    names = list(dict.fromkeys(run.name for run in comparison.runs))
    frame = pd.DataFrame(dict.fromkeys(columns.values(), "–"), names, dtype=object)
    figure, axes = drawing.new_figure()
    lines = []
    for (engine, profile), rows in scored.groupby(["engine", "profile"], sort=False):
        name = f"{engine}:{profile}"
        lines.append(drawing.Line(name, rows.dt_s * 1e3, rows.value, name))
        frame.loc[name, rows.dt_s.map(columns)] = rows.value.map(style.number).to_numpy()
    says = [
        f"{row.engine}:{row.profile}, {columns[row.dt_s]}: {row.metric} {row.note}"
        for row in failed.itertuples()
    ]
    parts: list[kit.Part] = [kit.Table(frame, corner="engine", caption=SAYS), kit.Text(items=says)]
    if lines and len(columns) > 1:
        drawing.draw_lines(axes, lines, "step size, ms", "error, radii")
        parts.append(kit.Chart(drawing.svg_of(figure, "error against step size")))
    if layers := played(comparison):
        parts.append(replay_of(scenario, layers))
    return kit.Section(scenario.name, scenario.without_truth or scenario.asks, parts)


SAYS = "Largest distance of a disk from its exact position, in radii; the replay: the middle step."
