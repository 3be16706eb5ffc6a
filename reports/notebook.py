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
from crosscheck2d.adapters.run import Run, unplayed_run
from crosscheck2d.reports.check.rows import TASKS
from crosscheck2d.reports.check.verdict import FileCheck, check_file
from crosscheck2d.reports.compare.against import TRUTH
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.drawing import INK, RULE, Line, draw_lines, new_figure, svg_of
from crosscheck2d.reports.page.kit import (
    Chart,
    Page,
    Part,
    Playback,
    Section,
    Table,
    TableCell,
    render_page,
)
from crosscheck2d.reports.page.replay import name_of, pack_layers, played, ratio_of
from crosscheck2d.reports.run.arguments import checked_engines, checked_scenes, of_main_job
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import play_cell
from crosscheck2d.reports.run.runner import run_all
from crosscheck2d.reports.run.scenes import open_scene, with_steps
from crosscheck2d.reports.run.worker_process import Failure
from crosscheck2d.reports.speed.advice import Advice, Inquiry, NoAdvice
from crosscheck2d.reports.speed.purposes import PURPOSES
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.files.scene_file import scenario_of, scene_text
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import NoTruth, answered

SCORE = "position_max_radii"
HEIGHT = "this.style.height=this.contentDocument.documentElement.scrollHeight+'px'"


def framed(title: str, sections: Sequence[Section], names: Sequence[str] = ()) -> str:
    """A page of its own within a notebook, as high as it is."""
    page = Page(title, sections, "crosscheck2d", names=[*names, style.TRUTH], footer=" ")
    return (
        f'<iframe srcdoc="{escape(render_page(page))}" onload="{HEIGHT}"'
        ' style="width:100%;height:24em;border:0"></iframe>'
    )


class ShownFrame(pd.DataFrame):
    """A frame that shows itself as a page; what is made from it is a plain frame."""

    _metadata = ["page"]  # noqa: RUF012 - as pandas wants it
    page: Callable[[], str]

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def _repr_html_(self) -> str:
        return self.page()


def showing(frame: pd.DataFrame, page: Callable[[], str]) -> ShownFrame:
    """The frame, with what makes its page."""
    made = ShownFrame(frame)
    made.page = page
    return made


class OpenScene(Scenario):
    """A scenario that draws its start."""

    def _repr_html_(self) -> str:
        return framed(self.name, [Section("", self.asks, [Chart(start_of(self))])])


class Answer(Trajectory):
    """The exact answer to `scenario` at its samples, up to `horizon`; it plays itself."""

    scenario: Scenario

    def _repr_html_(self) -> str:
        until = f"Exact up to {style.number(min(self.horizon, self.scenario.duration))} s."
        replay = replay_of(self.scenario, [(None, self)])
        return framed(self.scenario.name, [Section("", f"{until} {self.reason}", [replay])])


def scene(source: str | Path | Scenario | None = None, seed: int = 0, **table: Any) -> OpenScene:
    """A scene: by name (`crosscheck list scenarios`), from a TOML file, or from the keys of such a
    file, e.g. `disk=[dict(position=[0, 0], ...)]`.

    Raises:
        ValueError: with a line for each fault.
    """
    if isinstance(source, Scenario):
        found = source
    elif source is None:
        found = scenario_of(table, "scene")
    else:
        with raising():
            checked_scenes([str(source)], [], False, seed)
        found = open_scene(str(source), seed)
    return OpenScene(**vars(found))


def truth(scene_or_name: str | Path | Scenario, seed: int = 0) -> Answer:
    """The exact answer to a scene; raises `NoTruth`, a `ValueError`, with the reason."""
    scenario, trajectory = answered(scene(scene_or_name, seed))
    if trajectory is None or not len(trajectory):
        why = trajectory.reason if trajectory is not None else scenario.without_truth
        raise NoTruth(why or "the scene comes without an exact answer")
    answer = Answer(**vars(trajectory))
    object.__setattr__(answer, "scenario", scenario)
    return answer


def run(
    scenes: str | Path | Scenario | Sequence[str | Path | Scenario],
    engines: str | Sequence[str] = (),
    dts: float | Sequence[float] = (),
    seed: int = 0,
    timeout: float = 60.0,
) -> ShownFrame:
    """Run scenes through engines and compare: one number a row, as in deviations.csv.

    Args:
        engines: NAME, NAME:PROFILE or a FILE of your own; default: those of `crosscheck`.
        dts: step sizes in s; default: those of each scene.
        timeout: s that a run may take. A failed run is a row with its reason.
    """
    several = [scenes] if isinstance(scenes, str | Path | Scenario) else scenes
    steps = [float(dt) for dt in np.atleast_1d(np.asarray(dts, float))]
    asked = [with_steps(scene(each, seed), steps, False) for each in several]
    with raising():
        names = checked_engines([engines] if isinstance(engines, str) else engines or of_main_job())
    rows = {name: row_of(name) for name in names}
    tasks: dict[Any, Callable[[], Run]] = {
        cell: partial(play_cell, cell, rows[name], replace(scenario, truth=None))
        for number, scenario in enumerate(asked)
        for name in names
        for k in scenario.substeps
        for cell in [Cell(str(number), seed, name, k)]
    }
    alone = {cell for cell in tasks if rows[cell.engine].leaves_state}
    ended = dict(run_all(tasks, os.cpu_count() or 1, timeout, alone=alone))
    comparisons = [
        compare(
            scenario,
            [as_run(ended[cell], cell, scenario) for cell in tasks if cell.scene == str(number)],
        )
        for number, scenario in enumerate(asked)
    ]
    table = pd.concat([each.table for each in comparisons], ignore_index=True)
    return showing(table, partial(page_of_runs, comparisons, names))


def check(path: str | Path) -> ShownFrame:
    """Check a solver of the exercise, Exercise.js or solver.py: a row for each question."""
    found = check_file(Path(path))
    if found.refused:
        raise ValueError(found.refused)
    columns = ("task", "name", "verdict", "cause", "asked", "got", "expected")
    frame = pd.DataFrame([{name: getattr(row, name) for name in columns} for row in found.rows])
    return showing(frame, partial(page_of_check, found))


def advise(
    scene_or_name: str | Path | Scenario,
    error: float = 0.01,
    purpose: str = "trajectory",
    engines: str | Sequence[str] = (),
    seed: int = 0,
) -> ShownFrame:
    """The cheapest engines and step sizes that keep an error in a scene, cheapest first; then those
    that do not, with the reason. Raises `ValueError` for a scene without an exact answer."""
    if purpose not in PURPOSES or not error > 0:
        allowed = f"purpose must be one of {', '.join(PURPOSES)}, error more than 0"
        raise ValueError(f"purpose={purpose!r}, error={error!r}: {allowed}")
    scenario = scene(scene_or_name, seed)
    with raising():
        names = checked_engines([engines] if isinstance(engines, str) else engines, ENGINES)
    with TemporaryDirectory() as folder, Progress() as progress:
        file = Path(folder) / f"{scenario.name}.toml"
        file.write_text(scene_text(scenario), encoding="utf-8")
        try:
            inquiry = Inquiry(str(file), 0, purpose, os.cpu_count() or 1, progress)
            advice = inquiry.advice(error, names)
        except NoAdvice as refusal:
            raise ValueError(str(refusal).partition(". To compare")[0]) from None
    frame = frame_of_advice(advice)
    says = f"{PURPOSES[purpose].what}, at most {style.number(error)}, {advice.judged}"
    shown = [Section("", says, [Table(frame.set_index("engine"), corner="engine")])]
    return showing(frame, partial(framed, f"Advice on {scenario.name}", shown))


@contextmanager
def raising() -> Iterator[None]:
    """Context in which what ends a command with a message on standard error is a `ValueError`."""
    with redirect_stderr(io.StringIO()) as told:
        try:
            yield
        except SystemExit:
            raise ValueError(told.getvalue().strip()) from None


def as_run(ended: Run | Failure, cell: Cell, scenario: Scenario) -> Run:
    """The run of a cell, though its process has failed."""
    if isinstance(ended, Run):
        return ended
    lost = unplayed_run(cell.engine, scenario, scenario.dt(cell.substeps))
    return replace(lost, status=ended.status, reason=ended.reason)


def replay_of(scenario: Scenario, layers: list[tuple[Run | None, Trajectory]]) -> Playback:
    """What was played, the exact answer on top."""
    return Playback(pack_layers(scenario, layers), ratio_of(scenario, layers))


def start_of(scenario: Scenario) -> Any:
    """A drawing of disks, walls and velocities at t = 0."""
    from matplotlib.patches import Circle

    start = scenario.scene
    ends = [start.position - start.radius[:, None], start.position + start.radius[:, None]]
    width, height = np.ptp(np.concatenate([*ends, start.walls.reshape(-1, 2)]), axis=0)
    figure, axes = new_figure(5.8, 0.4 + 5.4 * float(np.clip(height / width, 0.1, 1.0)))
    for place, radius, fixed in zip(start.position, start.radius, start.static):
        axes.add_patch(Circle(place, radius, facecolor=RULE if fixed else "none", edgecolor=INK))
    for wall in start.walls:
        axes.plot(*wall.T, color=INK)
    if start.velocity.any():
        axes.quiver(*start.position.T, *start.velocity.T, color=INK, width=0.004)
    axes.set_aspect("equal")
    axes.autoscale_view()
    return svg_of(figure, f"{scenario.name} at the start")


def page_of_runs(comparisons: Sequence[Comparison], names: Sequence[str]) -> str:
    """A section for each scene: the score of each engine at each step size, and its replay."""
    sections = []
    for each in comparisons:
        scored = scores_of(each)
        parts: list[Part] = [Table(scored, corner="engine", caption=METRIC)]
        if scored.shape[1] > 1 and each.truth is not None:
            figure, axes = new_figure()
            lines = [Line(*line) for line in lines_of(each)]
            draw_lines(axes, lines, "step size, ms", "error, radii")
            parts.append(Chart(svg_of(figure, f"{each.scenario.name}: error against step size")))
        if layers := played(each):
            parts.append(replay_of(each.scenario, layers))
        says = each.scenario.asks if each.truth is not None else f"No score: {why_unscored(each)}"
        sections.append(Section(each.scenario.name, says, parts))
    shown = {name_of(run) for each in comparisons for run in each.runs}
    return framed("Runs", sections, [name for name in names if name in shown])


METRIC = (
    "Largest distance of any disk from its exact position, in radii. The replay has the middle"
    " step size."
)


def why_unscored(comparison: Comparison) -> str:
    """Why a scene has no exact answer."""
    return comparison.scenario.without_truth or "the scene comes without an exact answer"


def scores_of(comparison: Comparison) -> pd.DataFrame:
    """Engines by step sizes: score, or why there is none, and the verdict that a run fails."""
    cells: dict[str, dict[str, TableCell]] = {}
    table = comparison.table
    for run in comparison.runs:
        mine = table[(table.engine == run.engine) & (table.profile == run.profile)]
        mine = mine[mine.dt_s == run.dt]
        failed = mine[mine.value > mine.bound].metric.tolist()
        score = mine[(mine.metric == SCORE) & (mine.versus == TRUTH)].value
        text: Any = score.iloc[0] if len(score) else "–"
        if run.status != "ok":
            text = run.status
        notes = tuple(TableCell(f"fails {name}", css="bad") for name in failed[:1])
        column = f"{style.number(run.dt * 1e3)} ms"
        cells.setdefault(run.name, {})[column] = TableCell(text, title=run.reason, notes=notes)
    return pd.DataFrame.from_dict(cells, orient="index", dtype=object)


def lines_of(comparison: Comparison) -> Iterator[tuple[str, list[float], list[float], str]]:
    """(engine, step sizes in ms, scores, label) of a chart."""
    table = comparison.table
    scored = table[(table.metric == SCORE) & (table.versus == TRUTH)]
    for (engine, profile), mine in scored.groupby(["engine", "profile"], sort=False):
        name = f"{engine}:{profile}"
        yield name, (mine.dt_s * 1e3).tolist(), mine.value.tolist(), name


def page_of_check(found: FileCheck) -> str:
    """A row for each task, which has what is wrong in it."""
    rows: dict[str, Any] = {
        TASKS[task]: {
            "verdict": TableCell(found.word(task), css="bad" if word == "fault" else ""),
            "likely cause": "; ".join(row.cause for row in found.causes if row.task == task),
        }
        for task, word in found.tasks.items()
    }
    frame = pd.DataFrame.from_dict(rows, orient="index", dtype=object)
    says = " ".join(found.sentences)
    return framed(found.path.name, [Section("", says, [Table(frame, css="text", corner="task")])])


def frame_of_advice(advice: Advice) -> pd.DataFrame:
    """A row for each engine: those that keep the error, those that fail, those that do not."""
    tried = [(one, "") for one in advice.keeping] + [(one, one.reason) for one in advice.partial]
    tried += [(short.best, short.why) for short in advice.short]
    return pd.DataFrame(
        {
            "engine": [one.name for one, _ in tried],
            "dt_s": [one.dt for one, _ in tried],
            "error": [one.error for one, _ in tried],
            "us_per_simulated_s": [one.cost * 1e6 for one, _ in tried],
            "not_advised": [why for _, why in tried],
        }
    )
