"""The same scene in every engine: each panel shows one engine beside the exact answer, with its
error and its cost."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.adapters.engines import DISTINCT, FETCHED
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.laws import deviation
from crosscheck2d.reports.page.cost_points import RunTimes
from crosscheck2d.reports.page.documents import deflated
from crosscheck2d.reports.page.overview import NO_FRICTION, OverviewCell
from crosscheck2d.reports.page.replay import played
from crosscheck2d.reports.page.sections import OWN
from crosscheck2d.reports.page.style import number
from crosscheck2d.scenarios.catalogue import family_of
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

FEW = 5  # moving disks at most to draw all of them: more paths hide each other
NARROW = 0.2  # of the longer side of a path: a narrower path is drawn over time
ROOM = 0.5  # of the extent of the exact answer: margin for engines that go beyond it
LEAST = 0.1  # radii, least range of an axis of lengths: else rounding would fill a panel
VISIBLE = 0.03  # of the extent of a panel: a smaller error is not visible
MARKED = 6  # instants in a panel
TIMED = "Scenes with costs"
EMPTY = {"no truth": "no exact answer"}  # short texts for the map


class Panels(NamedTuple):
    """The section of panels.

    Attributes:
        groups: heading -> scenes, for the picker.
        first: the scene shown first.
        packed: scene -> `to_json` of what its panels show, deflated.
        timed: whether any scene has costs.
        javascript: whether to name the engines that play with the extra `js`.
    """

    groups: Mapping[str, Sequence[str]]
    first: str
    packed: str
    timed: bool
    javascript: bool


@dataclass(frozen=True)
class Drawn:
    """What is drawn of one scene, the same in every panel; the positions come from its replay.

    Attributes:
        disks: the disks whose centres are drawn.
        axes: "path": y over x; "x", "y": that over time.
        titles: of the two axes, with units.
        box: left, bottom, right, top of the axes, in these units.
        until: s, where the exact answer ends.
        off_by: engine -> its largest error as a fraction of the extent of the panel.
    """

    disks: Sequence[int]
    axes: str
    titles: tuple[str, str]
    box: Sequence[float]
    until: float
    off_by: Mapping[str, float]


def panels(
    comparisons: Sequence[Comparison],
    names: Sequence[str],
    errors: Mapping[str, Sequence[OverviewCell]],
    clock: RunTimes,
) -> Panels | None:
    """The panels of all scenes that any engine played; None if there is none, or a single engine.

    errors: scene -> a cell of `overview.heat_map` for each of `names`.
    """
    shown = [each for each in comparisons if any(run is not None for run, _ in played(each))]
    if not shown or len(names) < 2:
        return None
    costs = costs_of(clock)
    drawn = {each.scenario.name: drawn_of(each) for each in shown}
    timed = [name for name in drawn if name in costs]
    packed = {
        each.scenario.name: to_json(
            each,
            drawn[each.scenario.name],
            dict(zip(names, errors[each.scenario.name])),
            costs.get(each.scenario.name, {}),
        )
        for each in shown
    }
    return Panels(
        groups=grouped(list(drawn), timed),
        first=max(
            shown, key=lambda each: priority(each, drawn[each.scenario.name], costs)
        ).scenario.name,
        packed=deflated(json.dumps(packed, separators=(",", ":"))),
        timed=bool(timed),
        javascript=set(DISTINCT) <= set(names) and not set(FETCHED) & set(names),
    )


def grouped(scenes: Sequence[str], timed: Sequence[str]) -> dict[str, list[str]]:
    """The scenes under the headings of the report, after a first group of the timed scenes."""
    groups: dict[str, list[str]] = {TIMED: list(timed)} if timed else {}
    for name in scenes:
        if name not in timed:
            groups.setdefault(family_of(name) or OWN, []).append(name)
    return groups


def priority(
    comparison: Comparison, drawn: Drawn, costs: Mapping[str, Any]
) -> tuple[bool, int, bool, int]:
    """The sort key of the scene to show first: it has an exact answer, the number of engines that
    play it, it has costs, and how well it separates engines: the smaller of the numbers visibly off
    and not."""
    off = sum(share > VISIBLE for share in drawn.off_by.values())
    played_by = len(drawn.off_by)
    exact, timed = comparison.truth is not None, comparison.scenario.name in costs
    return exact, played_by, timed, min(off, played_by - off)


def costs_of(clock: RunTimes) -> dict[str, dict[tuple[str, float], float]]:
    """scene -> (`engine:profile`, dt in s) -> µs of engine time per simulated second."""
    found: dict[str, dict[tuple[str, float], float]] = {}
    for row in [] if clock.fault else clock.table.to_dict("records"):
        key = f"{row['engine']}:{row['profile']}", float(row["dt_s"])
        found.setdefault(str(row["scenario"]), {})[key] = float(row["cost_us_per_s"])
    return found


def drawn_of(comparison: Comparison) -> Drawn:
    """Chooses disks, axes and end time of a scene."""
    scenario, truth = comparison.scenario, comparison.truth
    runs = [run for run in comparison.middle_runs if run.trajectory is not None]
    # Without an exact answer the first run takes its place.
    centre = truth if truth is not None and len(truth) > 1 else runs[0].trajectory
    assert centre is not None
    disks = disks_of(scenario, runs, centre)
    axes = axes_of(centre, disks)
    lines = [
        drawn_points(axes, run.trajectory, disks, len(centre)) for run in runs if run.trajectory
    ]
    box = box_of(
        drawn_points(axes, centre, disks, len(centre)), lines, scenario.scene.radius[disks].max()
    )
    # If only the start was played, the time axis still has a length.
    until = float(centre.t[-1]) or scenario.sample_interval
    if axes != "path":
        box[2] = until
    return Drawn(
        disks=disks.tolist(),
        axes=axes,
        titles=titles_of(axes, scenario),
        box=box.tolist(),
        until=until,
        off_by={
            run.name: float(deviation(run.trajectory, centre, scenario.scene)[:, disks].max())
            / float((box[2:] - box[:2]).max() if axes == "path" else box[3] - box[1])
            for run in runs
            if run.trajectory is not None
        },
    )


def disks_of(scenario: Scenario, runs: Sequence[Run], centre: Trajectory) -> NDArray[np.int64]:
    """All moving disks; if there are more than `FEW`, the one that is farthest off, in radii, in
    most engines."""
    moving = np.flatnonzero(~scenario.scene.static)
    if len(moving) <= FEW:
        return moving if len(moving) else np.array([0])
    farthest = [
        deviation(run.trajectory, centre, scenario.scene).max(axis=0) / scenario.scene.radius
        for run in runs
        if run.trajectory is not None
    ]
    off = np.median(np.nan_to_num(farthest), axis=0)[moving]
    return moving[[int(np.argmax(off))]]


def axes_of(centre: Trajectory, disks: NDArray[np.int64]) -> str:
    """ "path", or if the disks stay on a line, the coordinate along it."""
    across, up = np.ptp(centre.position[:, disks], axis=0).max(axis=0)
    if up < NARROW * across:
        return "x"
    return "y" if across <= NARROW * up else "path"


def titles_of(axes: str, scenario: Scenario) -> tuple[str, str]:
    """The titles of the two axes."""
    if axes == "path":
        return "x (m)", "y (m)"
    gravity = scenario.scene.gravity
    falls = gravity[0] == 0 > gravity[1]
    return "time (s)", "x (m)" if axes == "x" else "height (m)" if falls else "y (m)"


def drawn_points(
    axes: str, trajectory: Trajectory, disks: NDArray[np.int64], samples: int
) -> Array:
    """(k, 2) the points to draw from the first samples, in the units of the axes."""
    position = trajectory.position[:samples, disks]
    if axes == "path":
        return position.reshape(-1, 2)
    values = position[..., 0 if axes == "x" else 1]
    t = np.repeat(trajectory.t[:samples], len(disks))
    return np.stack([t, values.ravel()], axis=1)


def box_of(centre: Array, lines: Sequence[Array], radius: float) -> Array:
    """(4,) the range of the axes: all of `centre`, and the parts of the other lines near it."""
    low, high = centre.min(axis=0), centre.max(axis=0)
    room = ROOM * np.maximum(high - low, radius)
    every = np.concatenate([line[np.isfinite(line).all(axis=1)] for line in lines])
    least, most = every.min(axis=0, initial=np.inf), every.max(axis=0, initial=-np.inf)
    low = np.minimum(low, np.maximum(least, low - room))
    high = np.maximum(high, np.minimum(most, high + room))
    missing = np.maximum(LEAST * radius - (high - low), 0.0) / 2
    return np.concatenate([low - missing, high + missing])


def to_json(
    comparison: Comparison,
    drawn: Drawn,
    errors: Mapping[str, OverviewCell],
    costs: Mapping[tuple[str, float], float],
) -> dict[str, Any]:
    """For JSON: what is drawn, its caption, and engine -> [outcome, reason, error, cost]."""
    return {
        "disks": drawn.disks,
        "axes": drawn.axes,
        "titles": drawn.titles,
        "box": [float(f"{value:.6g}") for value in drawn.box],
        "until": drawn.until,
        "says": said_of(comparison, drawn),
        "engines": {
            name: numbers_of(cell, costs.get((name, comparison.middle_dt), np.nan))
            for name, cell in errors.items()
            if cell.text != "–"  # not requested of this engine
        },
    }


def numbers_of(cell: OverviewCell, cost: float) -> tuple[str, str, str, str]:
    """The text below a panel: outcome and reason if the engine did not play to the end; else its
    error and its cost, "" if it was not timed."""
    if cell.failed or cell.text == NO_FRICTION:
        return cell.text, cell.remark, "", ""
    error = f"{cell.text} radii" if cell.heat >= 0 else EMPTY.get(cell.text, cell.text)
    return "", "", error, "" if np.isnan(cost) else f"{number(cost, 2)} µs"


def said_of(comparison: Comparison, drawn: Drawn) -> str:
    """A caption for the panels of a scene."""
    scenario = comparison.scenario
    moving = int((~scenario.scene.static).sum())
    named = drawn.titles[1].partition(" ")[0]
    line = "the path" if drawn.axes == "path" else f"{named} over time"
    if moving > FEW:
        who = (
            f"{line} of disk {drawn.disks[0]} of {moving}, the disk with the largest error in most"
            " engines"
        )
    else:
        who = f"{line} of {'the disk' if moving == 1 else 'each disk'}"
    ends = ""
    if comparison.truth is None:
        ends = "; there is no exact answer"
    elif drawn.until < scenario.times[-1]:
        ends = f", until the exact answer ends at {number(drawn.until)} s"
    return f"Drawn: {who}{ends}."
